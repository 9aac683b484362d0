//! No order of threads reaches the picture.

use super::{bidirectional, combined, render, scenes};
use luxel::transport::{IntegratorSpec, Method, PhotonMapperSpec, PhotonSpec};

#[test]
fn threads_change_no_bit() {
    let still = scenes::indoors().remove(1);
    let moving = scenes::cameras().remove(3);
    let photons = PhotonSpec {
        count: Some(9000),
        ..PhotonSpec::default()
    };
    let of = |method| bidirectional(method, 8, photons.clone());
    let mapper = PhotonMapperSpec {
        global_photons: 5000,
        caustic_photons: 5000,
        ..PhotonMapperSpec::default()
    };
    let specs = [
        of(Method::Bdpt),
        of(Method::Ptracer),
        of(Method::Vcm),
        of(Method::Sppm),
        combined(8, photons.clone()),
        IntegratorSpec::PhotonMapper(mapper),
    ];
    for scene in [still, moving] {
        let mut compiled = render::compile(&scene.xml);
        for spec in &specs {
            compiled.job.integrator = spec.clone();
            let rendered = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                pool.expect("threads can be had").install(|| {
                    let (film, _) = render::render(&compiled, 3);
                    (film.mean(), film.standard_error())
                })
            };
            let one = rendered(1);
            assert!(one.0.iter().any(|p| p[0] > 0.0));
            assert!(
                one == rendered(4),
                "{}: {} differs",
                scene.name,
                spec.name()
            );
        }
    }
}

//! Our scenes against pictures of them by Mitsuba 3.9.1 (made by `make.py` beside this file): pixel by
//! pixel within the noise of both, and scale and mean within half a percent where the noise allows to tell.
//! Those of caustics are luxel's own.

mod caustics;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use luxel::format::{self, Overrides};
use luxel::math::Rgb;
use luxel::render::Stop;
use luxel::study::Picture;
use luxel::study::z_test::{Noise, Rule, z_test};
use luxel::transport::IntegratorSpec;

const SPP: u64 = 256;
const SIZE: [u32; 2] = [128, 80];

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

/// The picture of a scene and the variance of its pixels.
fn render(scene: &str) -> [Picture; 2] {
    let overrides = Overrides {
        resolution: Some(SIZE),
        seed: Some(1),
        ..Overrides::default()
    };
    render_as(&format!("scenes/{scene}.xml"), &overrides, SPP, |_| ())
}

/// The same of the scene in `file`, with `spp` samples of the integrator after `change`.
fn render_as(
    file: &str,
    overrides: &Overrides,
    spp: u64,
    change: impl Fn(&mut IntegratorSpec),
) -> [Picture; 2] {
    let desc = format::load(&path(file), &[]).unwrap_or_else(|e| panic!("{e}"));
    let mut compiled = format::compile(&desc, overrides).unwrap_or_else(|e| panic!("{e}"));
    change(&mut compiled.job.integrator);
    let (film, stats) = compiled
        .job
        .render(Stop::Spp(spp), |_, _| ControlFlow::Continue(()))
        .unwrap();
    assert_eq!(stats.invalid.count, 0, "{file}: {:?}", stats.invalid);
    let window = film.window();
    let picture = |values: Vec<[f64; 3]>| Picture {
        width: window.width as usize,
        height: window.height as usize,
        pixels: values
            .into_iter()
            .map(|v| Rgb::from_array(v.map(|v| v as f32)))
            .collect(),
    };
    let variance = film.standard_error().into_iter().map(|e| e.map(|e| e * e));
    [picture(film.mean()), picture(variance.collect())]
}

fn check(scene: &str) {
    let read = |name: String| Picture::read(path(&name)).unwrap();
    let reference = read(format!("tests/reference/{scene}.exr"));
    let [image, variance] = render(scene);
    let noise = Noise::Both {
        image: variance,
        reference: read(format!("tests/reference/{scene}-variance.exr")),
    };
    let verdict = z_test(&image, &reference, &noise, &Rule::default()).unwrap();
    assert!(verdict.pass(), "{scene}: {verdict:#?}");
}

macro_rules! scenes {
    ($($name:ident $scene:literal)*) => {$(
        #[test]
        fn $name() {
            check($scene);
        }
    )*};
}

scenes! {
    bump "bump"
    coated "coated"
    depth_of_field "depth-of-field"
    environment "environment"
    glass "glass"
    instances "instances"
    lamps "lamps"
    mask "mask"
    metal "metal"
    penumbra "penumbra"
    plastic "plastic"
    texture "texture"
}

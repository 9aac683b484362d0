//! The same job gives the same picture, bit for bit, however the work was divided.

#[path = "common/render.rs"]
mod render;

use std::ops::ControlFlow;

use luxel::render::Stop;
use render::compile;

const SCENE: &str = include_str!("../scenes/cornell-balls.xml");

fn small(sampler: &str) -> String {
    SCENE
        .replace(
            r#"name="resolution" value="512""#,
            r#"name="resolution" value="50""#,
        )
        .replace(
            r#"sampler type="independent""#,
            &format!(r#"sampler type="{sampler}""#),
        )
}

fn in_threads<T: Send>(n: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new()
        .num_threads(n)
        .build()
        .unwrap()
        .install(f)
}

#[test]
fn thread_count_does_not_change_a_bit() {
    for sampler in ["independent", "sobol"] {
        let xml = small(sampler);
        let picture = |threads| {
            in_threads(threads, || {
                let (film, _) = render::render(&compile(&xml), 24);
                (film.mean(), film.standard_error())
            })
        };
        let one = picture(1);
        assert!(one == picture(2), "{sampler}: 2 threads differ from 1");
        assert!(one == picture(5), "{sampler}: 5 threads differ from 1");
    }
}

#[test]
fn stopping_early_equals_asking_for_less() {
    let compiled = compile(&small("sobol"));
    let stop_at = 16;
    let (stopped, _) = compiled
        .job
        .render(Stop::Spp(512), |film, _| match film.spp() >= stop_at {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        })
        .unwrap();
    // Passes depend on the clock, so the stop may come later than asked.
    let mut film = compiled.job.new_film(Stop::Spp(512));
    compiled.job.add_samples(&mut film, stopped.spp()).unwrap();
    assert!(film.mean() == stopped.mean());
}

#[test]
fn a_crop_shows_the_same_pixels() {
    let whole = render::render(&compile(&small("sobol")), 8).0;
    let crop = luxel::film::Window {
        x: 13,
        y: 21,
        width: 20,
        height: 17,
    };
    let overrides = luxel::format::Overrides {
        crop: Some(crop),
        ..Default::default()
    };
    let part = render::render(&render::compile_with(&small("sobol"), &overrides), 8).0;
    let (whole, part) = (whole.mean(), part.mean());
    for y in 0..17 {
        for x in 0..20 {
            assert_eq!(
                part[y * 20 + x],
                whole[(y + 21) * 50 + x + 13],
                "({x}, {y})"
            );
        }
    }
}

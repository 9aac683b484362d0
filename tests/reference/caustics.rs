//! Scenes of caustics against pictures of luxel's own, made in two independent halves by the integrator `vcm`
//! (see `make_caustics.py` beside this file): Mitsuba finds hardly any of this light. The squared deviations of the
//! halves are 0.98 (bulb) and 1.02 (marbles) of what their noise predicts, in the median.
//! `bdpt` has no bias and shares no photon with them; `sppm` and `vcm` are given the reference's radius, which
//! is a fraction of a pixel. A fault of 1 % fails the marbles.

use super::{Noise, Picture, Rule, path, render_as, z_test};
use luxel::film::Window;
use luxel::format::Overrides;

const SIZE: [u32; 2] = [48, 36];
const SPP: u64 = 128;
/// Per sample of each pixel.
const PHOTONS: u64 = 5000;

/// The rows below `top` of the picture of a scene by an integrator, against the reference.
fn check(scene: &str, integrator: &str, radius: f32, top: u32) {
    let read = |name: String| {
        let mut picture = Picture::read(path(&name)).unwrap();
        picture.pixels.drain(..(top * SIZE[0]) as usize);
        picture.height -= top as usize;
        picture
    };
    let reference = read(format!("tests/reference/caustics-{scene}.exr"));
    let overrides = Overrides {
        resolution: Some(SIZE),
        seed: Some(1),
        sampler: Some("sobol".to_string()),
        crop: Some(Window {
            x: 0,
            y: top,
            width: SIZE[0],
            height: SIZE[1] - top,
        }),
        integrator: Some(integrator.to_string()),
        ..Overrides::default()
    };
    let file = format!("scenes/caustics/{scene}.xml");
    let [image, variance] = render_as(&file, &overrides, SPP, |spec| {
        if let Some(photons) = spec.photons() {
            photons.radius = Some(radius);
            photons.count = Some(PHOTONS);
        }
    });
    let noise = Noise::Both {
        image: variance,
        reference: read(format!("tests/reference/caustics-{scene}-variance.exr")),
    };
    let verdict = z_test(&image, &reference, &noise, &Rule::default()).unwrap();
    assert!(verdict.pass(), "{scene} by {integrator}: {verdict:#?}");
}

/// Without the filament, which in few pixels is brighter than all the rest.
#[test]
fn bulb() {
    check("bulb", "bdpt", 0.02, 24);
    check("bulb", "sppm", 0.02, 24);
    check("bulb", "vcm", 0.02, 24);
}

#[test]
fn marbles() {
    check("marbles", "sppm", 0.015, 0);
    check("marbles", "combined", 0.015, 0);
    check("marbles", "vcm", 0.015, 0);
}

//! Scenes of caustics against pictures of luxel's own, made in two independent halves by the integrator `vcm`
//! (see `make_caustics.py` beside this file, which says how far they agree): Mitsuba finds none of this light.
//! `bdpt` has no bias and shares no photon with them; `sppm` and `vcm` are given the reference's radius, which
//! is a fraction of a pixel.

use super::{Noise, Picture, Rule, path, render_as, z_test};
use luxel::format::Overrides;

const SIZE: [u32; 2] = [48, 36];
const SPP: u64 = 64;

/// The picture of a scene by an integrator, against the reference.
fn check(scene: &str, integrator: &str, radius: f32) {
    let read = |name: String| Picture::read(path(&name)).unwrap();
    let reference = read(format!("tests/reference/caustics-{scene}.exr"));
    let overrides = Overrides {
        resolution: Some(SIZE),
        seed: Some(1),
        integrator: Some(integrator.to_string()),
        ..Overrides::default()
    };
    let file = format!("scenes/caustics/{scene}.xml");
    let [image, variance] = render_as(&file, &overrides, SPP, |spec| {
        if let Some(photons) = spec.photons() {
            photons.radius = Some(radius);
        }
    });
    let noise = Noise::Both {
        image: variance,
        reference: read(format!("tests/reference/caustics-{scene}-variance.exr")),
    };
    let verdict = z_test(&image, &reference, &noise, &Rule::default()).unwrap();
    assert!(verdict.pass(), "{scene} by {integrator}: {verdict:#?}");
}

#[test]
fn bulb() {
    check("bulb", "bdpt", 0.02);
    check("bulb", "sppm", 0.02);
    check("bulb", "vcm", 0.02);
}

#[test]
fn marbles() {
    check("marbles", "sppm", 0.015);
    check("marbles", "combined", 0.015);
    check("marbles", "vcm", 0.015);
}

#[test]
fn ring() {
    check("ring", "bdpt", 0.015);
    check("ring", "sppm", 0.015);
    check("ring", "vcm", 0.015);
}

//! Samples against their density.

use super::*;
use common::{Chi2Plan, sidak};

/// Samples on one side of the surface against their density; the other side counts as lost. (The cells of the
/// test would straddle two narrow lobes far apart.) What comes below is turned up for that.
fn check(name: &str, bsdf: Bsdf, wo: Vec3, below: bool, seed: u64, tests: usize) {
    let plan = Chi2Plan {
        samples: 200_000,
        ..Chi2Plan::cap(1.0, sidak(0.01, tests))
    };
    let side = |w: Vec3| if below { Vec3::new(w.x, w.y, -w.z) } else { w };
    plan.check(
        &format!("{name} from {wo}, below {below}"),
        seed,
        |rng| {
            let (u_lobe, u) = (rng.f32(), rng.vec2());
            let s = bsdf.sample(wo, u_lobe, u, R)?;
            let counts = s.density != Density::Delta && side(s.wi).z > 0.0;
            counts.then_some(side(s.wi))
        },
        |wi| bsdf.pdf(wo, side(wi)),
    );
}

/// Roughness, index and angle; whether reflection and refraction have enough samples to be tested.
const GLASSES: [([f32; 2], f32, f64, [bool; 2]); 10] = [
    ([0.02, 0.02], 1.5, 40.0, [false, true]),
    ([0.05, 0.5], 1.33, 60.0, [false, true]),
    ([1.0, 1.0], 2.0, 70.0, [false, true]),
    ([0.3, 0.3], 1.5, 140.0, [false, true]),
    ([0.3, 0.3], 1.5, 85.0, [false, true]),
    ([0.2, 0.2], 1.5, 89.8, [false, true]),
    ([0.3, 0.1], 30.0, 60.0, [true, false]),
    ([0.1, 0.4], 4.0, 170.0, [false, true]),
    ([0.2, 0.1], 0.7, 30.0, [false, true]),
    ([0.1, 0.1], 1.5, 91.0, [true, false]),
];

fn check_glass(shape: Shape, visible: bool, first: usize, seed: u64) {
    let cases = &GLASSES[first..];
    for (i, &(alpha, eta, polar, [reflects, passes])) in cases.iter().enumerate() {
        let name = format!("{shape:?} {alpha:?} index {eta} visible {visible}");
        let bsdf = glass(shape, alpha, eta, visible);
        let (wo, seed) = (direction(polar, 35.0), seed + 2 * i as u64);
        let inside = wo.z < 0.0;
        if reflects {
            check(&name, bsdf, wo, inside, seed, 2 * cases.len());
        }
        if passes {
            check(&name, bsdf, wo, !inside, seed + 1, 2 * cases.len());
        }
    }
}

#[test]
fn ggx_glass_samples_follow_their_pdf() {
    check_glass(Shape::Ggx, true, 0, 0);
}

#[test]
fn beckmann_glass_samples_follow_their_pdf() {
    check_glass(Shape::Beckmann, true, 0, 100);
}

#[test]
fn all_normals_glass_samples_follow_their_pdf() {
    check_glass(Shape::Ggx, false, 7, 200);
    check_glass(Shape::Beckmann, false, 7, 300);
}

#[test]
fn plastic_samples_follow_their_pdf() {
    let (d, s) = (Rgb::new(0.1, 0.5, 0.8), Rgb::new(0.9, 0.8, 0.5));
    for (i, polar) in [0.0, 60.0, 85.0].into_iter().enumerate() {
        let (wo, seed) = (direction(polar, 35.0), i as u64);
        check(
            "plastic",
            plastic(1.5, false, d, s),
            wo,
            false,
            400 + seed,
            15,
        );
        for (j, shape) in SHAPES.into_iter().enumerate() {
            for (k, (alpha, visible)) in [(if i < 2 { 0.05 } else { 0.2 }, true), (0.5, i != 1)]
                .into_iter()
                .enumerate()
            {
                let mut facets = Microfacet::new(shape, alpha, alpha);
                facets.visible = visible;
                let name = format!("{shape:?} {alpha} plastic");
                let bsdf = rough_plastic(facets, 1.5, k == 1, d, s);
                check(
                    &name,
                    bsdf,
                    wo,
                    false,
                    410 + 8 * seed + (2 * j + k) as u64,
                    15,
                );
            }
        }
    }
}

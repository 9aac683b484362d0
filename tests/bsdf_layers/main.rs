//! Rough glass and plastic: samples against densities, values against weights, energy and limits.

#[path = "../common/mod.rs"]
mod common;
mod energy;
mod limits;
mod samples;

use common::Rng;
use luxel::bsdf::*;
use luxel::math::{DVec3, Rgb, Vec2, Vec3};

const SHAPES: [Shape; 2] = [Shape::Ggx, Shape::Beckmann];
const R: Mode = Mode::Radiance;
const P: Mode = Mode::Importance;

fn direction(polar_deg: f64, azimuth_deg: f64) -> Vec3 {
    let (st, ct) = polar_deg.to_radians().sin_cos();
    let (sp, cp) = azimuth_deg.to_radians().sin_cos();
    DVec3::new(st * cp, st * sp, ct).as_vec3()
}

fn glass(shape: Shape, alpha: [f32; 2], eta: f32, visible: bool) -> Bsdf {
    let mut facets = Microfacet::new(shape, alpha[0], alpha[1]);
    facets.visible = visible;
    Bsdf::RoughDielectric(RoughDielectric {
        facets,
        surface: Dielectric::new(eta),
    })
}

fn plastic(eta: f32, nonlinear: bool, diffuse: Rgb, specular: Rgb) -> Bsdf {
    let base = Base::smooth(eta, nonlinear);
    Bsdf::Plastic(Plastic::new(eta, &base, diffuse, specular))
}

fn rough_plastic(facets: Microfacet, eta: f32, nonlinear: bool, diffuse: Rgb, spec: Rgb) -> Bsdf {
    let coat = Coat::of(facets.shape, facets.alpha.x, eta);
    let base = coat.base(eta, nonlinear);
    Bsdf::RoughPlastic(RoughPlastic::new(facets, eta, coat, &base, diffuse, spec))
}

/// A coat is made once per kind of surface: few kinds here, so that the tests do not spend their time on them.
const COATS: [(f32, f32); 4] = [(0.02, 1.5), (0.1, 4.0), (0.4, 1.05), (1.0, 0.8)];

/// A spread of surfaces and a direction to look from, inside for glass too.
fn many(rng: &mut Rng) -> (Bsdf, Vec3) {
    let log = |rng: &mut Rng, decades: f32| 10f32.powf(-decades * rng.f32());
    let shape = SHAPES[usize::from(rng.f32() < 0.5)];
    let visible = rng.f32() < 0.5;
    let (d, s) = (Rgb::new(0.1, 0.5, 0.8), Rgb::new(0.9, 0.8, 0.5));
    let wo = luxel::math::warp::uniform_sphere(rng.vec2());
    let up = Vec3::new(wo.x, wo.y, wo.z.abs());
    match rng.f32() {
        x if x < 0.6 => {
            let alpha = [log(rng, 2.0), log(rng, 2.0)];
            let eta = 1.0 + 3.0 * log(rng, 2.0);
            let eta = if rng.f32() < 0.3 { 1.0 / eta } else { eta };
            let mut bsdf = glass(shape, alpha, eta, visible);
            if let Bsdf::RoughDielectric(b) = &mut bsdf {
                (b.surface.reflectance, b.surface.transmittance) = (s, d);
            }
            (bsdf, wo)
        }
        x if x < 0.7 => (plastic(1.0 + rng.f32(), visible, d, s), up),
        _ => {
            let (alpha, eta) = COATS[(4.0 * rng.f32()) as usize];
            let mut facets = Microfacet::new(shape, alpha, alpha);
            facets.visible = visible;
            (rough_plastic(facets, eta, rng.f32() < 0.5, d, s), up)
        }
    }
}

/// How far the rounding of directions (1e-7) moves values: by the change of the facet normal over the width
/// of the lobe. The normal is a sum of the directions, and the shorter the sum, the less exact.
fn rounding(bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> f32 {
    let sum = |eta: f32| (wo + eta * wi).length();
    match bsdf {
        Bsdf::RoughDielectric(b) => {
            let eta = match (wo.z > 0.0, wi.z * wo.z > 0.0) {
                (_, true) => 1.0,
                (true, _) => b.surface.eta,
                _ => 1.0 / b.surface.eta,
            };
            // The cosines at the surface and at the facet.
            let m = (wo + eta * wi) / sum(eta);
            let grazing = [wo.z, wi.z, m.dot(wo), m.dot(wi)].map(f32::abs);
            let grazing = grazing.into_iter().fold(1.0, f32::min);
            4e-6 / (b.facets.alpha.min_element() * sum(eta)) + 1e-6 / grazing
        }
        Bsdf::RoughPlastic(b) => 4e-6 / (b.facets.alpha.x * sum(1.0)),
        _ => 0.0,
    }
}

/// `weight` is `f cos / pdf`, and the density of the sample is `pdf`; in both modes.
#[test]
fn weights_agree_with_values() {
    let mut rng = Rng::new(1);
    let mut seen = 0;
    for _ in 0..200_000 {
        let (bsdf, wo) = many(&mut rng);
        let mode = if rng.f32() < 0.5 { R } else { P };
        let Some(s) = bsdf.sample(wo, rng.f32(), rng.vec2(), mode) else {
            continue;
        };
        let (f, pdf) = bsdf.eval_pdf(wo, s.wi, mode);
        assert_eq!(pdf, bsdf.pdf(wo, s.wi));
        let Density::PerSr(density) = s.density else {
            assert!(matches!(bsdf, Bsdf::Plastic(_)));
            continue;
        };
        let tolerance = 1e-4 + rounding(&bsdf, wo, s.wi);
        if tolerance > 0.1 {
            continue;
        }
        assert!(
            (density / pdf - 1.0).abs() < tolerance,
            "{bsdf:?} {wo} {s:?} {pdf} {tolerance}"
        );
        for c in 0..3 {
            let expected = f[c] * s.wi.z.abs() / density;
            let error = (s.weight[c] / expected - 1.0).abs();
            assert!(
                error < tolerance,
                "{bsdf:?} {wo} {s:?} {expected} {tolerance}"
            );
        }
        seen += 1;
    }
    assert!(seen > 130_000, "{seen}");
}

/// Light takes the way back as it came: as radiance one way, as power the other (Veach 1997, section 5.2);
/// so radiance over the squared index is the same both ways.
#[test]
fn values_are_reciprocal() {
    let mut rng = Rng::new(2);
    let mut seen = 0;
    for _ in 0..100_000 {
        let (bsdf, wo) = many(&mut rng);
        let sampled = bsdf.sample(wo, rng.f32(), rng.vec2(), R);
        let Some(wi) = sampled
            .filter(|s| s.density != Density::Delta)
            .map(|s| s.wi)
        else {
            continue;
        };
        let (a, b) = (bsdf.eval(wo, wi, R), bsdf.eval(wi, wo, P));
        let back = bsdf.eval(wi, wo, R);
        let eta2 = sampled.map_or(1.0, |s| s.eta * s.eta);
        let tolerance = 1e-5 + rounding(&bsdf, wo, wi);
        if tolerance > 0.1 {
            continue;
        }
        for c in 0..3 {
            let name = || format!("{bsdf:?} {wo} {wi}: {a:?} {b:?} {back:?}");
            assert!((a[c] - b[c]).abs() <= tolerance * a[c], "{}", name());
            assert!(
                (a[c] * eta2 - back[c]).abs() <= tolerance * back[c],
                "{}",
                name()
            );
        }
        seen += 1;
    }
    assert!(seen > 60_000, "{seen}");
}

#[test]
fn kinds() {
    let diffuse = Rgb::splat(0.5);
    let facets = Microfacet::new(Shape::Ggx, 0.1, 0.1);
    for bsdf in [
        glass(Shape::Ggx, [0.1; 2], 1.5, true),
        plastic(1.5, false, diffuse, Rgb::WHITE),
        rough_plastic(facets, 1.5, false, diffuse, Rgb::WHITE),
    ] {
        assert!(
            !bsdf.is_delta() && bsdf.has_lobes() && !bsdf.is_diffuse(),
            "{bsdf:?}"
        );
        let is_glass = matches!(bsdf, Bsdf::RoughDielectric(_));
        assert_eq!(bsdf.diffuse_albedo().is_black(), is_glass, "{bsdf:?}");
        let below = bsdf.sample(-Vec3::Z, 0.5, Vec2::splat(0.3), R);
        assert_eq!(below.is_some(), is_glass, "{bsdf:?}");
    }
    // The same surface has the same coat.
    assert!(std::ptr::eq(
        Coat::of(Shape::Ggx, 0.1, 1.5),
        Coat::of(Shape::Ggx, 0.1, 1.5)
    ));
}

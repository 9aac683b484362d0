//! Rough glass and plastic: samples against densities, values against weights, energy and limits.

mod common;

use common::{Chi2Plan, Rng, sidak};
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

fn mirror(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
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

/// Means of the weights of what is reflected and of what passes, and their standard errors.
fn furnace(bsdf: Bsdf, wo: Vec3, seed: u64, n: u32) -> [(f64, f64); 2] {
    let mut rng = Rng::new(seed);
    let mut sums = [[0.0; 2]; 2];
    for _ in 0..n {
        if let Some(s) = bsdf.sample(wo, rng.f32(), rng.vec2(), P) {
            let (side, w) = (usize::from(s.wi.z * wo.z < 0.0), f64::from(s.weight.g));
            sums[side] = [sums[side][0] + w, sums[side][1] + w * w];
        }
    }
    sums.map(|[sum, sum2]| {
        let (n, mean) = (f64::from(n), sum / f64::from(n));
        (mean, ((sum2 / n - mean * mean).max(0.0) / n).sqrt())
    })
}

/// No glass makes light, from either side; both ways to choose normals scatter the same share of it; and
/// what passes is what the table of a coat says.
#[test]
fn glass_furnace_is_at_most_one() {
    for shape in SHAPES {
        for (i, (alpha, eta)) in [(0.05, 1.5), (0.4, 1.33), (1.0, 2.0), (0.3, 4.0)]
            .into_iter()
            .enumerate()
        {
            let coat = Coat::of(shape, alpha, eta);
            for node in [4, 32, -10, -50] {
                // A direction that the table holds.
                let cos = f64::from(node) / 63.0;
                let wo = direction(cos.acos().to_degrees(), 20.0);
                let seed = (i as i32 + 10 * node).unsigned_abs().into();
                let [r, t] = furnace(glass(shape, [alpha; 2], eta, true), wo, seed, 300_000);
                let [ra, ta] = furnace(glass(shape, [alpha; 2], eta, false), wo, seed + 7, 100_000);
                let name = format!("{shape:?} {alpha} {eta} at {cos}: {r:?} {t:?}, {ra:?} {ta:?}");
                assert!(r.0 + t.0 <= 1.0 + 1e-6, "{name}");
                for (a, b) in [(r, ra), (t, ta)] {
                    assert!((a.0 - b.0).abs() < 4.5 * a.1.hypot(b.1) + 1e-6, "{name}");
                }
                if node > 0 {
                    let through = f64::from(coat.through(cos as f32));
                    assert!(
                        (t.0 - through).abs() < 4.5 * t.1 + 1e-3 * through,
                        "{name}: {through}"
                    );
                    assert!(
                        4.5 * t.1 < 0.012 * through,
                        "{name}: the test would not see 1 %"
                    );
                }
            }
        }
    }
}

/// A white base under a boundary that absorbs nothing, with all reflections below counted.
#[test]
fn white_plastic_returns_everything() {
    for eta in [1.0f32, 1.1, 1.5, 2.0, 0.8] {
        for nonlinear in [false, true] {
            let bsdf = plastic(eta, nonlinear, Rgb::WHITE, Rgb::WHITE);
            for polar in [0.0, 50.0, 75.0] {
                let wo = direction(polar, 20.0);
                let [(mean, error), _] = furnace(bsdf, wo, 11, 100_000);
                assert!(
                    (mean - 1.0).abs() < 4.5 * error + 1e-4,
                    "{eta} {polar}: {mean} {error}"
                );
                assert!((bsdf.albedo(wo).g - 1.0).abs() < 1e-4, "{eta} {polar}");
            }
        }
    }
    // What passes two facets or more is lost, so rough plastic returns less.
    for shape in SHAPES {
        for (alpha, eta) in COATS {
            let facets = Microfacet::new(shape, alpha, alpha);
            let bsdf = rough_plastic(facets, eta, true, Rgb::WHITE, Rgb::WHITE);
            for polar in [0.0, 50.0, 85.0] {
                let [(mean, error), _] = furnace(bsdf, direction(polar, 20.0), 12, 50_000);
                assert!(
                    mean < 1.0 + 4.5 * error + 1e-4,
                    "{bsdf:?} {polar}: {mean} {error}"
                );
                let low = if alpha < 0.05 { 0.95 } else { 0.1 };
                assert!(mean > low || eta < 1.0, "{bsdf:?} {polar}: {mean} {error}");
            }
        }
    }
}

/// As roughness vanishes rough glass becomes glass: share and directions of both lobes.
#[test]
fn roughness_zero_is_smooth() {
    let mut rng = Rng::new(4);
    for shape in SHAPES {
        for eta in [1.5, 0.7, 1.0001] {
            for polar in [0.0, 30.0, 70.0, 120.0, 170.0] {
                let wo = direction(polar, 200.0);
                let (rough, smooth) = (
                    glass(shape, [0.0; 2], eta, true),
                    Bsdf::Dielectric(Dielectric::new(eta)),
                );
                let (mut near, n) = (0, 1000);
                for _ in 0..n {
                    let (u_lobe, u) = (rng.f32(), rng.vec2());
                    let (a, b) = (
                        rough.sample(wo, u_lobe, u, R),
                        smooth.sample(wo, u_lobe, u, R),
                    );
                    if let (Some(a), Some(b)) = (a, b) {
                        let close = (a.wi - b.wi).length() < 5e-3 && a.eta == b.eta;
                        near += u32::from(close && (a.weight.g / b.weight.g - 1.0).abs() < 2e-3);
                    }
                }
                assert!(
                    near > n * 97 / 100,
                    "{shape:?} {eta} {polar}: {near} of {n}"
                );
            }
        }
        // Rough plastic keeps the sums over 64 angles, by which the light inside comes out up to 2 % low.
        let facets = Microfacet::new(shape, 0.0, 0.0);
        let rough = rough_plastic(facets, 1.5, false, Rgb::WHITE, Rgb::WHITE);
        let smooth = plastic(1.5, false, Rgb::WHITE, Rgb::WHITE);
        let (wo, wi) = (direction(30.0, 0.0), direction(50.0, 90.0));
        let (a, b) = (rough.eval_pdf(wo, wi, R), smooth.eval_pdf(wo, wi, R));
        assert!((a.0.g / b.0.g - 1.0).abs() < 0.05, "{a:?} {b:?}");
        assert!((a.1 / b.1 - 1.0).abs() < 0.01, "{a:?} {b:?}");
    }
}

/// As the indices become equal the boundary vanishes.
#[test]
fn equal_indices_are_invisible() {
    let mut rng = Rng::new(5);
    for shape in SHAPES {
        for (eta, width) in [(1.0f32, 0.0), (1.000_001, 1e-4), (0.9999, 2e-2)] {
            for polar in [0.0, 60.0, 130.0] {
                let wo = direction(polar, 10.0);
                let bsdf = glass(shape, [0.1; 2], eta, true);
                for _ in 0..1000 {
                    // Facets that face away from the light have no part in it.
                    let Some(s) = bsdf.sample(wo, rng.f32().max(0.1), rng.vec2(), P) else {
                        continue;
                    };
                    assert!((s.wi + wo).length() <= width + 3e-7, "{eta} {wo} {s:?}");
                    assert!(
                        s.weight.g > 0.9 && s.weight.g < 1.0 + 1e-5,
                        "{eta} {wo} {s:?}"
                    );
                }
            }
        }
    }
    // Plastic is left with its base.
    let diffuse = Rgb::new(0.2, 0.5, 0.9);
    let bsdf = plastic(1.0, true, diffuse, Rgb::WHITE);
    let base = Bsdf::Diffuse(Diffuse::new(diffuse));
    let (wo, wi) = (direction(70.0, 0.0), direction(40.0, 80.0));
    assert_eq!(bsdf.eval_pdf(wo, wi, R), base.eval_pdf(wo, wi, R));
    assert_eq!(bsdf.diffuse_albedo(), diffuse);
}

/// Every roughness and index, every angle up to the last bit of grazing, at the ends of the random numbers.
#[test]
fn extremes_stay_finite() {
    let mut rng = Rng::new(6);
    let last = 1.0 - f32::EPSILON / 2.0;
    let number = |rng: &mut Rng| match rng.f32() {
        x if x < 0.1 => 0.0,
        x if x < 0.2 => last,
        x if x < 0.25 => 0.5,
        _ => rng.f32(),
    };
    let etas = [
        1e-6,
        0.3,
        0.9999,
        0.999_999_94,
        1.0,
        1.000_000_1,
        1.0001,
        1.5,
        4.0,
        100.0,
        1e6,
    ];
    for i in 0..400_000 {
        let shape = SHAPES[i / 10 % 2];
        let visible = i % 2 == 0;
        let eta = etas[i / 20 % etas.len()];
        let diffuse = Rgb::splat([0.0, 1e-9, 0.7, 1.0][i / 3 % 4]);
        let specular = Rgb::splat([0.0, 1e-9, 0.7, 1.0][i / 12 % 4]);
        let bsdf = match i % 5 {
            0 => plastic(eta, visible, diffuse, specular),
            1 => {
                let (alpha, _) = COATS[i / 5 % 4];
                // As few coats as there are indices.
                let alpha = if eta == 1.5 { alpha } else { 1e-4 };
                let mut facets = Microfacet::new(shape, alpha, alpha);
                facets.visible = visible;
                rough_plastic(facets, eta, i / 7 % 2 == 0, diffuse, specular)
            }
            _ => {
                let alpha = [0, 1].map(|_| 10f32.powf(-4.5 * rng.f32()));
                glass(shape, alpha, eta, visible)
            }
        };
        let z = match rng.f32() {
            x if x < 0.3 => 10f32.powf(-30.0 * rng.f32()),
            x if x < 0.4 => 1.0,
            _ => rng.f32(),
        };
        let z = if rng.f32() < 0.5 { -z } else { z };
        let (sin, phi) = ((1.0 - z * z).sqrt(), std::f32::consts::TAU * rng.f32());
        let wo = Vec3::new(sin * phi.cos(), sin * phi.sin(), z);
        let (u_lobe, u) = (
            number(&mut rng),
            Vec2::new(number(&mut rng), number(&mut rng)),
        );
        for mode in [R, P] {
            if let Some(s) = bsdf.sample(wo, u_lobe, u, mode) {
                let name = || format!("{bsdf:?} {wo} {u_lobe} {u} {s:?}");
                assert!((s.wi.length() - 1.0).abs() < 3e-6, "{}", name());
                assert!(s.wi.z != 0.0, "{}", name());
                assert!(
                    s.weight.is_finite() && s.weight.min_component() > 0.0,
                    "{}",
                    name()
                );
                if let Density::PerSr(pdf) = s.density {
                    assert!(pdf > 0.0 && pdf.is_finite(), "{}", name());
                }
                let is_glass = matches!(bsdf, Bsdf::RoughDielectric(_));
                if is_glass && visible && mode == P {
                    assert!(s.weight.g <= 1.0 + 1e-5, "{}", name());
                }
                let (f, pdf) = bsdf.eval_pdf(wo, s.wi, mode);
                assert!(
                    f.is_finite() && f.min_component() >= 0.0,
                    "{}: {f:?}",
                    name()
                );
                assert!(pdf.is_finite() && pdf >= 0.0, "{}: {pdf}", name());
            }
            let wi = luxel::math::warp::uniform_sphere(u);
            for wi in [wi, -wo, mirror(wo), wo] {
                let (f, pdf) = bsdf.eval_pdf(wo, wi, mode);
                assert!(
                    f.is_finite() && f.min_component() >= 0.0,
                    "{bsdf:?} {wo} {wi} {f:?}"
                );
                assert!(pdf.is_finite() && pdf >= 0.0, "{bsdf:?} {wo} {wi} {pdf}");
            }
        }
        let albedo = bsdf.albedo(wo);
        assert!(
            albedo.is_finite() && albedo.min_component() >= 0.0,
            "{bsdf:?} {wo} {albedo:?}"
        );
    }
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

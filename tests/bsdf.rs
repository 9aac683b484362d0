//! Scattering functions: samples against densities, values against weights, energy and limits.

mod common;

use common::{Chi2Plan, Rng, sidak};
use luxel::bsdf::*;
use luxel::geom::{Hit, PlaceId, ShapeId};
use luxel::material::Material;
use luxel::math::warp::uniform_hemisphere;
use luxel::math::{DVec3, Frame, Rgb, Vec2, Vec3};

const SHAPES: [Shape; 2] = [Shape::Ggx, Shape::Beckmann];
const R: Mode = Mode::Radiance;

fn direction(polar_deg: f64, azimuth_deg: f64) -> Vec3 {
    let (st, ct) = polar_deg.to_radians().sin_cos();
    let (sp, cp) = azimuth_deg.to_radians().sin_cos();
    DVec3::new(st * cp, st * sp, ct).as_vec3()
}

fn mirror(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}

fn below(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, -w.z)
}

/// A rough metal that absorbs nothing, so that weights are pure geometry.
fn rough(shape: Shape, alpha: [f32; 2], visible: bool) -> Bsdf {
    let (eta, k) = metals::lookup("none").unwrap();
    let mut facets = Microfacet::new(shape, alpha[0], alpha[1]);
    facets.visible = visible;
    let metal = Conductor::new(eta, k);
    Bsdf::RoughConductor(RoughConductor { facets, metal })
}

fn check(name: &str, bsdf: Bsdf, wo: Vec3, seed: u64, tests: usize) {
    Chi2Plan::cap(1.0, sidak(0.01, tests)).check(
        &format!("{name} from {wo}"),
        seed,
        |rng| {
            let (u_lobe, u) = (rng.f32(), rng.vec2());
            bsdf.sample(wo, u_lobe, u, R).map(|s| s.wi)
        },
        |wi| bsdf.pdf(wo, wi),
    );
}

#[test]
fn diffuse_samples_follow_their_pdf() {
    let diffuse = Bsdf::Diffuse(Diffuse::new(Rgb::splat(0.7)));
    for (seed, polar) in [0.0, 60.0, 89.99].into_iter().enumerate() {
        check("diffuse", diffuse, direction(polar, 40.0), seed as u64, 3);
    }
}

const ALPHAS: [[f32; 2]; 5] = [
    [1e-3, 1e-3],
    [0.03, 0.03],
    [0.3, 0.3],
    [1.0, 1.0],
    [0.05, 0.5],
];

fn check_rough(shape: Shape, visible: bool, alphas: &[[f32; 2]], polars: &[f64], seed: u64) {
    for (i, &alpha) in alphas.iter().enumerate() {
        for (j, &polar) in polars.iter().enumerate() {
            let name = format!("{shape:?} {alpha:?} visible {visible}");
            let wo = direction(polar, 35.0);
            let tests = alphas.len() * polars.len();
            check(
                &name,
                rough(shape, alpha, visible),
                wo,
                seed + (8 * i + j) as u64,
                tests,
            );
        }
    }
}

#[test]
fn visible_ggx_samples_follow_their_pdf() {
    check_rough(Shape::Ggx, true, &ALPHAS, &[0.0, 50.0, 85.0], 100);
}

#[test]
fn visible_beckmann_samples_follow_their_pdf() {
    check_rough(Shape::Beckmann, true, &ALPHAS, &[0.0, 50.0, 85.0], 200);
}

#[test]
fn all_normals_samples_follow_their_pdf() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        let alphas = [[1e-3, 1e-3], [0.6, 0.6], [0.05, 0.3]];
        check_rough(shape, false, &alphas, &[0.0, 70.0], 300 + 100 * seed as u64);
    }
}

/// Nearly along the surface: the masking function does all the work here.
#[test]
fn grazing_samples_follow_their_pdf() {
    for (seed, shape) in SHAPES.into_iter().enumerate() {
        check_rough(
            shape,
            true,
            &[[0.1, 0.1], [0.8, 0.2]],
            &[89.8],
            500 + 100 * seed as u64,
        );
    }
}

/// A spread of surfaces and a direction to look from, for the properties that all must have.
fn many(rng: &mut Rng) -> (Bsdf, Vec3) {
    let log_alpha = |rng: &mut Rng| 10f32.powf(-2.0 * rng.f32());
    let shape = SHAPES[usize::from(rng.f32() < 0.5)];
    let alpha = [log_alpha(rng), log_alpha(rng)];
    let mut bsdf = match rng.f32() {
        x if x < 0.2 => Bsdf::Diffuse(Diffuse::new(Rgb::new(0.2, 0.5, 0.9))),
        x if x < 0.6 => rough(shape, alpha, true),
        _ => rough(shape, alpha, false),
    };
    if let Bsdf::RoughConductor(b) = &mut bsdf {
        (b.metal.eta, b.metal.k) = metals::lookup("Cu").unwrap();
    }
    (bsdf, uniform_hemisphere(rng.vec2()))
}

/// `weight` is `f cos / pdf`, and the density of the sample is `pdf`.
#[test]
fn weights_agree_with_values() {
    let mut rng = Rng::new(1);
    let mut seen = 0;
    for _ in 0..200_000 {
        let (bsdf, wo) = many(&mut rng);
        let Some(s) = bsdf.sample(wo, rng.f32(), rng.vec2(), R) else {
            continue;
        };
        let (f, pdf) = bsdf.eval_pdf(wo, s.wi, R);
        assert_eq!((f, pdf), (bsdf.eval(wo, s.wi, R), bsdf.pdf(wo, s.wi)));
        // Directions are rounded to 1e-7, the half vector that comes of them to 1e-7 / cos: the value and
        // the density move by that over the width of the lobe, the more the steeper its flank.
        let alpha = match &bsdf {
            Bsdf::RoughConductor(b) => b.facets.alpha.min_element(),
            _ => 1.0,
        };
        let tolerance = 1e-4 + 2e-6 / (alpha * (wo.z + s.wi.z));
        let Density::PerSr(density) = s.density else {
            panic!("{bsdf:?}")
        };
        assert!(
            (density / pdf - 1.0).abs() < tolerance,
            "{bsdf:?} {wo} {s:?} {pdf}"
        );
        for c in 0..3 {
            let expected = f[c] * s.wi.z / density;
            let error = (s.weight[c] / expected - 1.0).abs();
            assert!(error < tolerance, "{bsdf:?} {wo} {s:?} {expected}");
        }
        seen += 1;
    }
    assert!(seen > 150_000);
}

#[test]
fn values_are_reciprocal() {
    let mut rng = Rng::new(2);
    for _ in 0..100_000 {
        let (bsdf, wo) = many(&mut rng);
        let wi = uniform_hemisphere(rng.vec2());
        let (a, b) = (bsdf.eval(wo, wi, R), bsdf.eval(wi, wo, Mode::Importance));
        for c in 0..3 {
            assert!(
                (a[c] - b[c]).abs() <= 1e-6 * a[c].abs(),
                "{bsdf:?} {wo} {wi}: {a:?} {b:?}"
            );
        }
    }
}

/// Mean weight and its standard error: the share of light from `wo` that is reflected.
fn furnace(bsdf: Bsdf, wo: Vec3, seed: u64, n: u32) -> (f64, f64) {
    let mut rng = Rng::new(seed);
    let (mut sum, mut sum2) = (0.0, 0.0);
    for _ in 0..n {
        let sample = bsdf.sample(wo, rng.f32(), rng.vec2(), R);
        let w = f64::from(sample.map_or(0.0, |s| s.weight.g));
        sum += w;
        sum2 += w * w;
    }
    let n = f64::from(n);
    let mean = sum / n;
    (mean, ((sum2 / n - mean * mean).max(0.0) / n).sqrt())
}

/// No surface makes light, and both ways to choose normals reflect the same share of it.
#[test]
fn rough_furnace_is_at_most_one() {
    for shape in SHAPES {
        for (i, alpha) in [
            [1e-4; 2],
            [0.01; 2],
            [0.1; 2],
            [0.5; 2],
            [1.0; 2],
            [0.1, 0.7],
        ]
        .into_iter()
        .enumerate()
        {
            for polar in [0.0, 45.0, 75.0] {
                let wo = direction(polar, 20.0);
                let (visible, e0) = furnace(rough(shape, alpha, true), wo, i as u64, 50_000);
                let (all, e1) = furnace(rough(shape, alpha, false), wo, 50 + i as u64, 200_000);
                let name =
                    format!("{shape:?} {alpha:?} at {polar}: {visible} +- {e0}, {all} +- {e1}");
                assert!(
                    visible <= 1.0 + 1e-6 && all <= 1.0 + 1e-6 + 4.5 * e1,
                    "{name}"
                );
                assert!((visible - all).abs() < 4.5 * e0.hypot(e1) + 1e-6, "{name}");
                if alpha[0] < 0.02 && alpha == [alpha[0]; 2] {
                    assert!(visible > 0.999, "{name}");
                }
            }
        }
    }
}

/// At normal incidence and roughness 1 the single-scattering reflectance has a closed form for GGX:
/// integrating D G1(wo) G1(wi) over the facets leaves a one-dimensional integral, evaluated here in f64.
#[test]
fn rough_furnace_matches_quadrature() {
    for alpha in [0.3f64, 1.0] {
        // Visible normals at normal incidence have density D cos: tan² m = alpha² t / (1 - t), t uniform.
        let n = 200_000;
        let exact: f64 = (0..n)
            .map(|i| {
                let t = (f64::from(i) + 0.5) / f64::from(n);
                let cos_m2 = (1.0 - t) / (1.0 - t + alpha * alpha * t);
                let cos = 2.0 * cos_m2 - 1.0;
                if cos <= 0.0 {
                    return 0.0;
                }
                let tan2 = (1.0 - cos * cos) / (cos * cos);
                2.0 / (1.0 + (1.0 + alpha * alpha * tan2).sqrt())
            })
            .sum::<f64>()
            / f64::from(n);
        let bsdf = rough(Shape::Ggx, [alpha as f32; 2], true);
        let (mean, e) = furnace(bsdf, Vec3::Z, 3, 1_000_000);
        assert!(
            (mean - exact).abs() < 4.0 * e,
            "{alpha}: {mean} +- {e}, {exact}"
        );
        assert!(4.0 * e < 0.005 * exact, "the test would not see 1 %");
    }
}

/// As the roughness vanishes samples gather at the mirror direction and weigh as the mirror does.
#[test]
fn roughness_zero_is_a_mirror() {
    let mut rng = Rng::new(4);
    for shape in SHAPES {
        for alpha in [1e-2f32, 1e-3, 1e-4, 0.0, f32::NAN] {
            let bsdf = rough(shape, [alpha; 2], true);
            let width = alpha.max(1e-4);
            for polar in [0.0, 30.0, 80.0] {
                let wo = direction(polar, 200.0);
                let (mut near, n) = (0, 2000);
                for _ in 0..n {
                    let s = bsdf.sample(wo, 0.5, rng.vec2(), R);
                    let Some(s) = s else { continue };
                    near += u32::from((s.wi - mirror(wo)).length() < 20.0 * width);
                    assert!(
                        s.weight.g > 0.9 && s.weight.g <= 1.0 || alpha > 5e-3,
                        "{s:?}"
                    );
                }
                assert!(
                    near > n * 98 / 100,
                    "{shape:?} {alpha} {polar}: {near} of {n}"
                );
            }
        }
    }
}

/// Every roughness from 1e-4 to 1 and every angle up to the last bit of grazing, at the ends of the random
/// numbers: finite, positive, of unit length, on the right side.
#[test]
fn extremes_stay_finite() {
    let mut rng = Rng::new(5);
    let last = 1.0 - f32::EPSILON / 2.0;
    let number = |rng: &mut Rng| match rng.f32() {
        x if x < 0.1 => 0.0,
        x if x < 0.2 => last,
        x if x < 0.25 => 0.5,
        _ => rng.f32(),
    };
    for i in 0..400_000 {
        let alpha = [0, 1].map(|_| 10f32.powf(-4.5 * rng.f32()));
        let visible = i % 2 == 0;
        let bsdf = match i % 5 {
            0 => Bsdf::Diffuse(Diffuse::new(Rgb::splat(0.5))),
            1 => Bsdf::Dielectric(Dielectric::new(10f32.powf(rng.f32() - 0.5))),
            2 => Bsdf::ThinDielectric(ThinDielectric::new(1.0 + rng.f32())),
            _ => rough(SHAPES[i / 10 % 2], alpha, visible),
        };
        let z = match rng.f32() {
            x if x < 0.3 => 10f32.powf(-30.0 * rng.f32()),
            x if x < 0.4 => 1.0,
            _ => rng.f32(),
        };
        let (sin, phi) = ((1.0 - z * z).sqrt(), std::f32::consts::TAU * rng.f32());
        let wo = Vec3::new(sin * phi.cos(), sin * phi.sin(), z);
        let (u_lobe, u) = (
            number(&mut rng),
            Vec2::new(number(&mut rng), number(&mut rng)),
        );
        if let Some(s) = bsdf.sample(wo, u_lobe, u, R) {
            let name = format!("{bsdf:?} {wo} {u} {s:?}");
            assert!((s.wi.length() - 1.0).abs() < 2e-6, "{name}");
            assert!(
                s.weight.is_finite() && s.weight.min_component() > 0.0,
                "{name}"
            );
            if let Density::PerSr(pdf) = s.density {
                assert!(pdf > 0.0 && pdf.is_finite() && s.wi.z > 0.0, "{name}");
                assert!(!visible || s.weight.g <= 1.0 + 1e-5, "{name}");
            }
            let (f, pdf) = bsdf.eval_pdf(wo, s.wi, R);
            assert!(
                f.is_finite() && pdf.is_finite() && pdf >= 0.0,
                "{name}: {f:?} {pdf}"
            );
        }
        let wi = uniform_hemisphere(u);
        let (f, pdf) = bsdf.eval_pdf(wo, wi, R);
        assert!(
            f.is_finite() && f.min_component() >= 0.0,
            "{bsdf:?} {wo} {wi}"
        );
        assert!(pdf.is_finite() && pdf >= 0.0, "{bsdf:?} {wo} {wi}");
    }
}

/// One-sided reflectors are black from below; two-sided ones behave there as they do from above.
#[test]
fn sides() {
    let (wo, wi) = (direction(40.0, 10.0), direction(50.0, 170.0));
    let u = Vec2::new(0.3, 0.6);
    let (eta, k) = metals::lookup("Cu").unwrap();
    let smooth = Bsdf::Conductor(Conductor::new(eta, k));
    for bsdf in [
        Bsdf::Diffuse(Diffuse::new(Rgb::splat(0.5))),
        rough(Shape::Ggx, [0.3, 0.2], true),
        rough(Shape::Beckmann, [0.3, 0.2], false),
        smooth,
    ] {
        for (o, i) in [(below(wo), wi), (wo, below(wi)), (below(wo), below(wi))] {
            assert_eq!(bsdf.eval_pdf(o, i, R), (Rgb::BLACK, 0.0));
        }
        assert!(bsdf.sample(below(wo), 0.5, u, R).is_none());
        assert_eq!(bsdf.albedo(below(wo)), Rgb::BLACK);
        let both = Material::UniformBothSides(bsdf);
        let seen_from = |wo: Vec3| both.shade(&seen_along(wo), 0.0, || (Vec3::X, Vec3::Y));
        let (front, back) = (seen_from(wo), seen_from(below(wo)));
        let (f, pdf) = bsdf.eval_pdf(wo, wi, R);
        assert_eq!(front.eval_pdf(wi, R), (f * wi.z, pdf));
        assert_eq!(back.eval_pdf(below(wi), R), (f * wi.z, pdf));
        assert_eq!(back.eval_pdf(wi, R), (Rgb::BLACK, 0.0));
        let a = bsdf.sample(wo, 0.5, u, R).unwrap();
        let b = back.sample(0.5, u, R).unwrap();
        assert_eq!(
            (below(a.wi), a.weight, a.density),
            (b.wi, b.weight, b.density)
        );
        assert_eq!(back.albedo(), bsdf.albedo(wo));
    }
}

/// A hit on the plane z = 0, seen from `wo`.
fn seen_along(wo: Vec3) -> Hit {
    Hit {
        p: Vec3::ZERO,
        p_err: Vec3::ZERO,
        ng: Vec3::Z,
        frame: Frame {
            s: Vec3::X,
            t: Vec3::Y,
            n: Vec3::Z,
        },
        uv: Vec2::ZERO,
        wo,
        time: 0.0,
        shape: ShapeId(0),
        prim: 0,
        bary: Vec2::ZERO,
        place: PlaceId::NONE,
    }
}

#[test]
fn what_absorbs_all_gives_no_sample() {
    let u = Vec2::splat(0.5);
    let black = Conductor {
        reflectance: Rgb::BLACK,
        ..Conductor::new(Rgb::WHITE, Rgb::WHITE)
    };
    let facets = Microfacet::new(Shape::Ggx, 0.1, 0.1);
    for bsdf in [
        Bsdf::Diffuse(Diffuse::new(Rgb::BLACK)),
        Bsdf::Conductor(black),
        Bsdf::RoughConductor(RoughConductor {
            facets,
            metal: black,
        }),
        Bsdf::Null(Null {
            transmittance: Rgb::BLACK,
        }),
    ] {
        assert!(bsdf.sample(Vec3::Z, 0.5, u, R).is_none(), "{bsdf:?}");
    }
}

/// A perfect mirror returns everything, at every angle.
#[test]
fn mirror_furnace_is_exactly_one() {
    let (eta, k) = metals::lookup("none").unwrap();
    let bsdf = Bsdf::Conductor(Conductor::new(eta, k));
    let mut rng = Rng::new(6);
    for _ in 0..10_000 {
        let wo = uniform_hemisphere(rng.vec2());
        let s = bsdf.sample(wo, 0.5, Vec2::ZERO, R).unwrap();
        assert_eq!((s.weight, s.wi, s.eta), (Rgb::WHITE, mirror(wo), 1.0));
    }
}

/// Reflection and transmission share all the light; refraction obeys Snell's law, can be reversed, and
/// scales radiance by the squared index ratio; a pass in and out scales nothing.
#[test]
fn dielectric_laws() {
    let mut rng = Rng::new(7);
    let u = Vec2::ZERO;
    for _ in 0..50_000 {
        let eta = 0.4 + 2.0 * rng.f32();
        let bsdf = Bsdf::Dielectric(Dielectric::new(eta));
        let mut wo = uniform_hemisphere(rng.vec2());
        if rng.f32() < 0.5 {
            wo = -wo;
        }
        assert_eq!(bsdf.albedo(wo), Rgb::WHITE);
        let s = bsdf.sample(wo, rng.f32(), u, R).unwrap();
        assert_eq!(s.density, Density::Delta);
        if s.wi.z * wo.z > 0.0 {
            assert_eq!((s.wi, s.weight, s.eta), (mirror(wo), Rgb::WHITE, 1.0));
            continue;
        }
        let ratio = if wo.z > 0.0 { eta } else { 1.0 / eta };
        assert!((s.eta / ratio - 1.0).abs() < 1e-6);
        assert!((s.wi.truncate() * ratio + wo.truncate()).length() < 1e-6);
        assert!((s.wi.length() - 1.0).abs() < 1e-6);
        assert!((s.weight.g * ratio * ratio - 1.0).abs() < 1e-5);
        let photon = bsdf
            .sample(wo, 1.0 - f32::EPSILON, u, Mode::Importance)
            .unwrap();
        assert_eq!(photon.weight, Rgb::WHITE, "photons keep their power");
        // The way back is the way in, with the inverse scale. (Not at grazing: the cosine is lost.)
        if let Some(back) = bsdf.sample(s.wi, 1.0 - f32::EPSILON, u, R)
            && wo.z.abs() > 0.05
        {
            assert!((back.wi - wo).length() < 2e-5, "{eta} {wo} {}", back.wi);
            assert!((back.weight.g * s.weight.g - 1.0).abs() < 1e-5);
        }
    }
}

/// The limit of equal indices is no surface at all.
#[test]
fn equal_indices_let_light_pass() {
    for wo in [
        direction(0.0, 0.0),
        direction(89.9, 10.0),
        -direction(60.0, 70.0),
    ] {
        for bsdf in [
            Bsdf::Dielectric(Dielectric::new(1.0)),
            Bsdf::ThinDielectric(ThinDielectric::new(1.0)),
        ] {
            let s = bsdf.sample(wo, 0.0, Vec2::ZERO, R).unwrap();
            assert_eq!((s.wi, s.weight, s.eta), (-wo, Rgb::WHITE, 1.0));
        }
    }
}

#[test]
fn kinds() {
    let (eta, k) = metals::lookup("Al").unwrap();
    let diffuse = Bsdf::Diffuse(Diffuse::new(Rgb::new(0.1, 0.2, 0.3)));
    let glass = Bsdf::Dielectric(Dielectric::new(1.5));
    assert!(diffuse.is_diffuse() && !diffuse.is_delta() && glass.is_delta() && !glass.is_diffuse());
    assert!(Bsdf::Conductor(Conductor::new(eta, k)).is_delta());
    assert!(!rough(Shape::Ggx, [0.1; 2], true).is_delta());
    assert_eq!(diffuse.diffuse_albedo(), Rgb::new(0.1, 0.2, 0.3));
    assert_eq!(
        (glass.diffuse_albedo(), glass.eval(Vec3::Z, Vec3::Z, R)),
        (Rgb::BLACK, Rgb::BLACK)
    );
}

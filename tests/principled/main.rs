//! Burley's principled materials: samples against densities, values against weights, energy and limits.

#[path = "../common/mod.rs"]
mod common;
mod figures;
mod sampling;

use common::Rng;
use luxel::bsdf::principled::Base;
use luxel::bsdf::*;
use luxel::math::warp::uniform_sphere;
use luxel::math::{DVec3, Rgb, Vec2, Vec3};

const R: Mode = Mode::Radiance;

pub fn solid(p: Principled) -> Bsdf {
    Bsdf::Principled(p)
}

pub fn sheet(p: PrincipledThin) -> Bsdf {
    Bsdf::PrincipledThin(p)
}

pub fn direction(polar_deg: f64, azimuth_deg: f64) -> Vec3 {
    let (st, ct) = polar_deg.to_radians().sin_cos();
    let (sp, cp) = azimuth_deg.to_radians().sin_cos();
    DVec3::new(st * cp, st * sp, ct).as_vec3()
}

fn grey(v: f32, roughness: f32) -> Base {
    Base::new(Rgb::splat(v), roughness, 0.0)
}

/// Any material of the two kinds, with each number at its ends as often as between.
fn any(rng: &mut Rng) -> Bsdf {
    let share = |rng: &mut Rng| match rng.f32() {
        x if x < 0.25 => 0.0,
        x if x < 0.4 => 1.0,
        _ => rng.f32(),
    };
    let color = Rgb::new(share(rng), share(rng), share(rng));
    let roughness = match rng.f32() {
        x if x < 0.5 => 10f32.powf(-4.0 * rng.f32()),
        _ => share(rng),
    };
    let base = Base {
        spec_tint: share(rng),
        sheen: share(rng),
        sheen_tint: share(rng),
        flatness: share(rng),
        ..Base::new(color, roughness, share(rng))
    };
    let eta = match rng.f32() {
        x if x < 0.2 => 1.0 + 10f32.powf(-7.0 * rng.f32()),
        x if x < 0.4 => 0.25 + 0.75 * rng.f32(),
        _ => 1.0 + 3.0 * rng.f32(),
    };
    if rng.f32() < 0.6 {
        solid(Principled {
            metallic: share(rng),
            spec_trans: share(rng),
            clearcoat: share(rng),
            clearcoat_gloss: share(rng),
            ..Principled::new(base, eta)
        })
    } else {
        sheet(PrincipledThin {
            spec_trans: share(rng),
            diff_trans: 2.0 * share(rng),
            ..PrincipledThin::new(base, eta)
        })
    }
}

/// Light goes the same way back: what is refracted as radiance returns as importance.
#[test]
fn values_are_reciprocal() {
    let mut rng = Rng::new(2);
    for _ in 0..200_000 {
        let bsdf = any(&mut rng);
        let (wo, wi) = (uniform_sphere(rng.vec2()), uniform_sphere(rng.vec2()));
        if let Bsdf::Principled(p) = &bsdf
            && (wo.z > 0.0) != (wi.z > 0.0)
            && (p.eta - 1.0).abs() < 0.03
        {
            continue; // the half vector of what passes nearly straight on is lost in rounding
        }
        let (a, b) = (bsdf.eval(wo, wi, R), bsdf.eval(wi, wo, Mode::Importance));
        // The normal of a narrow lobe is rounded to 1e-7, over the width of the lobe (at least 1e-3).
        let scale = a.max_component().max(b.max_component());
        let tolerance = 3e-3 * scale + 1e-5;
        for c in 0..3 {
            assert!(
                (a[c] - b[c]).abs() <= tolerance,
                "{bsdf:?} {wo} {wi}: {a:?} {b:?}"
            );
        }
    }
}

/// Radiance is compressed by the square of the index on its way in, power is not.
#[test]
fn importance_is_not_compressed() {
    let glass = solid(Principled {
        spec_trans: 1.0,
        ..Principled::new(grey(1.0, 0.7), 1.5)
    });
    for (wo, wi, eta) in [
        (direction(20.0, 0.0), direction(160.0, 190.0), 1.5f32),
        (direction(150.0, 0.0), direction(40.0, 170.0), 1.0 / 1.5),
    ] {
        let (a, b) = (
            glass.eval(wo, wi, R).g,
            glass.eval(wo, wi, Mode::Importance).g,
        );
        assert!(a > 0.0 && (b / a / (eta * eta) - 1.0).abs() < 1e-5);
    }
}

/// A metal of the principled kind with a white base is a rough mirror whose roughness is the square.
#[test]
fn white_metal_is_a_rough_mirror() {
    let mut rng = Rng::new(3);
    for roughness in [0.1f32, 0.5, 1.0] {
        let metal = solid(Principled {
            metallic: 1.0,
            ..Principled::new(grey(1.0, roughness), 1.5)
        });
        let alpha = roughness * roughness;
        let mirror = Bsdf::RoughConductor(RoughConductor {
            facets: Microfacet::new(Shape::Ggx, alpha, alpha),
            metal: Conductor::new(Rgb::BLACK, Rgb::WHITE),
        });
        for _ in 0..2000 {
            let (wo, wi) = (uniform_sphere(rng.vec2()), uniform_sphere(rng.vec2()));
            let (a, b) = (metal.eval(wo, wi, R), mirror.eval(wo, wi, R));
            assert!((a.g - b.g).abs() <= 1e-5 * b.g, "{roughness} {wo} {wi}");
        }
    }
}

#[test]
fn sides_and_limits() {
    let (above, below) = (direction(40.0, 10.0), direction(130.0, 200.0));
    let opaque = solid(Principled::new(grey(0.8, 0.5), 1.5));
    for (wo, wi) in [(below, below), (below, above), (above, below)] {
        assert_eq!(opaque.eval_pdf(wo, wi, R), (Rgb::BLACK, 0.0));
    }
    assert!(opaque.sample(below, 0.3, Vec2::splat(0.4), R).is_none());
    // Metal lets nothing through, and has no diffuse base.
    let metal = solid(Principled {
        metallic: 1.0,
        spec_trans: 1.0,
        ..Principled::new(grey(0.8, 0.1), 1.5)
    });
    assert_eq!(metal.eval(above, below, R), Rgb::BLACK);
    assert!(metal.eval(above, direction(10.0, 10.0), R).max_component() < 1e-3);
    // A sheet that passes all diffuse light reflects none; one that passes half is alike on both sides.
    let passes = |diff_trans: f32, wi: Vec3| {
        let paper = PrincipledThin {
            diff_trans,
            ..PrincipledThin::new(grey(0.8, 0.5), 1.5)
        };
        let (a, b) = (
            sheet(paper).eval(above, wi, R),
            sheet(paper).eval(-above, -wi, R),
        );
        assert_eq!(a, b);
        a.g
    };
    assert_eq!(passes(2.0, direction(30.0, 50.0)), 0.0);
    assert!((passes(2.0, below) / (0.8 / std::f32::consts::PI) - 1.0).abs() < 1e-6);
    assert!((passes(1.0, below) / passes(2.0, below) - 0.5).abs() < 1e-6);
    // A clear sheet without an interface is not there.
    let clear = sheet(PrincipledThin {
        spec_trans: 1.0,
        ..PrincipledThin::new(grey(1.0, 0.0), 1.0)
    });
    let (wo, mut seen) = (direction(50.0, 20.0), 0);
    for i in 0..100 {
        let u = Vec2::new((i as f32 + 0.5) / 100.0, 0.37);
        let Some(s) = clear.sample(wo, 0.5, u, R) else {
            continue;
        };
        assert!(
            (s.wi + wo).length() < 0.1 && (s.weight.g - 1.0).abs() < 0.03,
            "{s:?}"
        );
        seen += 1;
    }
    assert!(seen > 98);
}

/// At roughness 0 samples gather at the directions of the smooth interface and weigh as it does.
#[test]
fn roughness_zero_is_smooth_glass() {
    let mut rng = Rng::new(5);
    for eta in [1.0001f32, 1.5, 4.0, 0.7] {
        let glass = solid(Principled {
            spec_trans: 1.0,
            ..Principled::new(grey(1.0, 0.0), eta)
        });
        for wo in [direction(30.0, 70.0), direction(155.0, 20.0)] {
            let up = wo.z > 0.0;
            let ratio = if up { eta } else { 1.0 / eta };
            let (r, cos_t) = fresnel::dielectric(wo.z.abs(), ratio);
            let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
            let bent = Vec3::new(-wo.x / ratio, -wo.y / ratio, -cos_t.copysign(wo.z));
            let (mut through, mut near, n) = (0f32, 0, 20_000);
            for _ in 0..n {
                let Some(s) = glass.sample(wo, rng.f32(), rng.vec2(), Mode::Importance) else {
                    continue;
                };
                let passes = (s.wi.z > 0.0) != up;
                through += f32::from(u8::from(passes));
                let target = if passes { bent } else { mirror };
                near += u32::from((s.wi - target).length() < 0.05);
                assert!((s.weight.g - 1.0).abs() < 0.02, "{eta} {wo} {s:?}");
                assert_eq!(s.eta, if passes { ratio } else { 1.0 });
            }
            assert!(near > n * 99 / 100, "{eta} {wo}: {near}");
            let share = through / n as f32;
            let sigma = (r * (1.0 - r) / n as f32).sqrt();
            assert!(
                (share - (1.0 - r)).abs() < 4.5 * sigma + 2e-3,
                "{eta} {wo}: {share} {r}"
            );
        }
    }
}

/// Mean weight and its standard error: the share of light from `wo` that is scattered on.
fn furnace(bsdf: Bsdf, wo: Vec3, mode: Mode) -> (f64, f64) {
    let mut rng = Rng::new(7);
    let (mut sum, mut sum2) = (0.0, 0.0);
    let n = 40_000;
    for _ in 0..n {
        let sample = bsdf.sample(wo, rng.f32(), rng.vec2(), mode);
        let w = f64::from(sample.map_or(0.0, |s| s.weight.g));
        sum += w;
        sum2 += w * w;
    }
    let n = f64::from(n);
    (
        sum / n,
        ((sum2 / n - (sum / n) * (sum / n)).max(0.0) / n).sqrt(),
    )
}

/// Metal, clear matter and sheets make no light. The model adds its reflection to a diffuse base that does
/// not lose it, and on rough surfaces light that comes back: that stays below the bounds given here.
#[test]
fn energy_is_bounded() {
    let solid_of = |metallic: f32, spec_trans: f32, roughness: f32| {
        solid(Principled {
            metallic,
            spec_trans,
            ..Principled::new(grey(1.0, roughness), 1.5)
        })
    };
    let thin = |spec_trans: f32, diff_trans: f32, roughness: f32| {
        sheet(PrincipledThin {
            spec_trans,
            diff_trans,
            ..PrincipledThin::new(grey(1.0, roughness), 1.5)
        })
    };
    for roughness in [0.0f32, 0.2, 0.5, 1.0] {
        for polar in [0.0, 50.0, 80.0, 89.0, 100.0, 140.0] {
            let wo = direction(polar, 30.0);
            let cases = [
                ("metal", solid_of(1.0, 0.0, roughness), 1.0),
                ("glass", solid_of(0.0, 1.0, roughness), 1.0),
                ("clear sheet", thin(1.0, 0.0, roughness), 1.0),
                ("plastic", solid_of(0.0, 0.0, roughness), 1.9),
                ("paper", thin(0.0, 1.0, roughness), 1.5),
            ];
            for (name, bsdf, bound) in cases {
                let (mean, error) = furnace(bsdf, wo, Mode::Importance);
                assert!(
                    mean <= bound + 1e-4 + 4.5 * error,
                    "{name} {roughness} {polar}: {mean} +- {error}"
                );
                if name == "clear sheet" && roughness == 0.0 && polar != 89.0 {
                    assert!(mean > 0.98, "{name} {polar}: {mean}");
                }
            }
        }
    }
}

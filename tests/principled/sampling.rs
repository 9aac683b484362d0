//! Samples of the principled materials against their densities and values.

use crate::common::{Chi2Plan, Rng, chi2_p_value, sidak};
use crate::{any, direction, sheet, solid};
use luxel::bsdf::principled::Base;
use luxel::bsdf::*;
use luxel::math::warp::uniform_sphere;
use luxel::math::{DVec2, DVec3, Rgb, Vec2, Vec3};
use std::f64::consts::PI;

fn drawn(bsdf: &Bsdf, wo: Vec3, rng: &mut Rng) -> Option<Vec3> {
    let (u_lobe, u) = (rng.f32(), rng.vec2());
    Some(bsdf.sample(wo, u_lobe, u, Mode::Radiance)?.wi)
}

const SAMPLES: usize = 200_000;

/// Materials that only reflect: the density is smooth, narrow as it may be.
fn check_smooth(name: &str, bsdf: Bsdf, wo: Vec3, seed: u64, tests: usize) {
    let plan = Chi2Plan {
        samples: SAMPLES,
        ..Chi2Plan::cap(1.0, sidak(0.01, tests))
    };
    let name = format!("{name} from {wo}");
    plan.check(
        &name,
        seed,
        |rng| drawn(&bsdf, wo, rng),
        |wi| bsdf.pdf(wo, wi),
    );
}

const CELLS: [usize; 2] = [24, 32];
const FINE_BITS: u32 = 4;
const FINE: usize = 1 << FINE_BITS;

/// Where light passes, the density ends in steps (the facets at right angles to the surface), which rules
/// out integrating it to the last digit: a plain grid over the rectangle `lo..hi`, in coordinates in which
/// `density` is per area. Returns what [`assert_share`] takes.
fn check_grid(
    name: &str,
    [lo, hi]: [[f64; 2]; 2],
    (seed, tests): (u64, usize),
    sample: impl Fn(&mut Rng) -> Option<[f64; 2]>,
    density: impl Fn([f64; 2]) -> f64,
) -> [f64; 2] {
    let mut rng = Rng::new(seed);
    let mut counts = vec![0u32; CELLS[0] * CELLS[1]];
    let mut n = 0u32;
    for _ in 0..SAMPLES {
        let Some(p) = sample(&mut rng) else { continue };
        let c = [0, 1].map(|i| (p[i] - lo[i]) / (hi[i] - lo[i]));
        if c.iter().all(|c| (0.0..=1.0).contains(c)) {
            let [x, y] = [0, 1].map(|i| ((c[i] * CELLS[i] as f64) as usize).min(CELLS[i] - 1));
            counts[x * CELLS[1] + y] += 1;
            n += 1;
        }
    }
    let step = [0, 1].map(|i| (hi[i] - lo[i]) / CELLS[i] as f64);
    let expected = |cell: usize| -> f64 {
        let at = [cell / CELLS[1], cell % CELLS[1]];
        // Hammersley's points in both directions: no two share a coordinate, so that steps along an axis and
        // narrow ridges are met as well.
        let point = |k: usize| {
            let fine = FINE as f64;
            let [a, b] = [k / FINE, k % FINE];
            let reversed = |i: usize| (i.reverse_bits() >> (usize::BITS - FINE_BITS)) as f64 + 0.5;
            let inside = [a as f64 + reversed(b) / fine, b as f64 + reversed(a) / fine];
            density([0, 1].map(|i| lo[i] + (at[i] as f64 + inside[i] / fine) * step[i]))
        };
        let sum: f64 = (0..FINE * FINE).map(point).sum();
        sum * step[0] * step[1] * (SAMPLES as f64 / (FINE * FINE) as f64)
    };
    let (mut chi2, mut dof, mut total, mut rare) = (0.0, 0.0, 0.0, [0.0; 2]);
    for (cell, &count) in counts.iter().enumerate() {
        let (e, count) = (expected(cell), f64::from(count));
        total += e;
        if e < 10.0 {
            rare = [rare[0] + e, rare[1] + count];
        } else {
            chi2 += (count - e) * (count - e) / e;
            dof += 1.0;
        }
    }
    assert_share(name, [total, f64::from(n)]);
    let spread = 5.0 * rare[0].sqrt().max(3.0);
    assert!((rare[0] - rare[1]).abs() < spread, "{name}: {rare:?}");
    if dof > 0.0 {
        let p = chi2_p_value(chi2, dof);
        assert!(
            p > sidak(0.01, tests),
            "{name}: {chi2:.1} of {dof}, {p:.1e}"
        );
    }
    [total, f64::from(n)]
}

/// The integral of the density and the samples that carry something, both as numbers of samples: equal
/// within five standard errors and 0.1 %, the error of the grid.
fn assert_share(name: &str, [total, n]: [f64; 2]) {
    let chance = 5.0 * (n * (1.0 - n / SAMPLES as f64)).sqrt().max(5.0);
    assert!(
        (total - n).abs() < chance + 1e-3 * n,
        "{name}: the pdf integrates to {total:.0}, samples are {n:.0}"
    );
}

/// The directions of either side, by azimuth and the root of the height, which is fine at grazing angles.
fn check_sides(name: &str, bsdf: Bsdf, wo: Vec3, seed: u64, tests: usize) {
    // Both sides together: nearly all samples carry something, so chance leaves errors of 1 % in sight.
    let mut both = [0.0; 2];
    for side in [1.0, -1.0] {
        let part = check_grid(
            &format!("{name} from {wo}, side {side}"),
            [[0.0, -PI], [1.0, PI]],
            (seed, 2 * tests),
            |rng| {
                let wi = drawn(&bsdf, wo, rng)?.as_dvec3();
                (wi.z * side > 0.0).then(|| [wi.z.abs().sqrt(), wi.y.atan2(wi.x)])
            },
            |[root, phi]| {
                let z = root * root;
                let r = (1.0 - z * z).sqrt();
                let wi = DVec3::new(r * phi.cos(), r * phi.sin(), z * side);
                f64::from(bsdf.pdf(wo, wi.as_vec3())) * 2.0 * root
            },
        );
        both = [both[0] + part[0], both[1] + part[1]];
    }
    assert_share(&format!("{name} from {wo}"), both);
}

/// Light that passes nearly straight on, in units of the step of the index.
#[test]
fn an_interface_that_hardly_is_one() {
    for (seed, (eta, polar)) in [(1.0001f32, 30.0), (1.003, 120.0), (0.9999, 60.0)]
        .into_iter()
        .enumerate()
    {
        let bsdf = solid(Principled {
            spec_trans: 1.0,
            ..Principled::new(Base::new(Rgb::WHITE, 0.8, 0.5), eta)
        });
        let (wo, step) = (direction(polar, 35.0), f64::from(eta) - 1.0);
        let o = wo.as_dvec3();
        check_grid(
            &format!("index {eta}"),
            [[-2.5; 2], [2.5; 2]],
            (900 + seed as u64, 3),
            |rng| {
                let d = (drawn(&bsdf, wo, rng)?.as_dvec3() + o) / step;
                Some([d.x, d.y])
            },
            |[x, y]| {
                let flat = DVec2::new(x, y) * step - o.truncate();
                let z = -(1.0 - flat.length_squared()).sqrt().copysign(o.z);
                let pdf = f64::from(bsdf.pdf(wo, flat.extend(z).as_vec3()));
                pdf * step * step / z.abs()
            },
        );
    }
}

const COLOR: Rgb = Rgb::new(0.8, 0.4, 0.2);

fn plain(roughness: f32, anisotropic: f32, eta: f32) -> Principled {
    Principled::new(Base::new(COLOR, roughness, anisotropic), eta)
}

fn opaque() -> [(&'static str, Bsdf); 6] {
    let cloth = Base {
        sheen: 1.0,
        sheen_tint: 0.5,
        flatness: 0.7,
        spec_tint: 1.0,
        ..Base::new(COLOR, 1.0, 0.0)
    };
    let lacquer = |clearcoat_gloss: f32| Principled {
        clearcoat: 1.0,
        clearcoat_gloss,
        ..plain(0.9, 0.0, 1.5)
    };
    let metal = Principled {
        metallic: 1.0,
        ..plain(0.3, 1.0, 1.5)
    };
    [
        ("plastic 1e-4", solid(plain(1e-4, 0.0, 1.5))),
        ("plastic", solid(plain(0.4, 0.9, 1.5))),
        ("metal", solid(metal)),
        ("satin lacquer", solid(lacquer(0.0))),
        (
            "glossy lacquer",
            solid(lacquer(1.0).with_rates([0.5, 4.0, 0.0])),
        ),
        ("cloth", solid(Principled::new(cloth, 1.5))),
    ]
}

fn clear() -> [(&'static str, Bsdf); 4] {
    let clear = |roughness: f32, eta: f32, spec_trans: f32| Principled {
        spec_trans,
        ..plain(roughness, 0.3, eta)
    };
    let alloy = Principled {
        metallic: 0.5,
        clearcoat: 0.5,
        ..clear(0.7, 1.33, 0.5)
    };
    [
        ("half metal, half clear", solid(alloy)),
        ("water", solid(clear(0.4, 1.33, 1.0))),
        ("diamond", solid(clear(0.6, 4.0, 0.8))),
        ("bubble", solid(clear(0.5, 0.6, 1.0))),
    ]
}

fn sheets() -> Vec<(&'static str, Bsdf)> {
    let new = |roughness: f32, spec_trans: f32, diff_trans: f32| PrincipledThin {
        spec_trans,
        diff_trans,
        ..PrincipledThin::new(Base::new(COLOR, roughness, 0.5), 1.5)
    };
    vec![
        ("frosted", sheet(new(0.6, 1.0, 0.0))),
        ("leaf", sheet(new(0.5, 0.3, 0.8))),
        ("paper", sheet(new(1.0, 0.0, 1.2))),
        (
            "pane",
            sheet(new(0.4, 0.9, 2.0).with_rates([3.0, 1.0, 1.0, 1.0])),
        ),
    ]
}

type Check = fn(&str, Bsdf, Vec3, u64, usize);

fn check_all(check: Check, cases: &[(&str, Bsdf)], polars: &[f64], seed: u64) {
    for (i, (name, bsdf)) in cases.iter().enumerate() {
        for (j, &polar) in polars.iter().enumerate() {
            let seed = seed + (8 * i + j) as u64;
            let tests = cases.len() * polars.len();
            check(name, *bsdf, direction(polar, 35.0), seed, tests);
        }
    }
}

#[test]
fn samples_of_opaque_matter_follow_their_pdf() {
    check_all(check_smooth, &opaque(), &[60.0], 100);
    check_all(check_smooth, &opaque()[4..], &[0.0], 200);
    check_all(check_smooth, &opaque()[1..], &[89.5], 300);
}

#[test]
fn samples_of_clear_matter_follow_their_pdf() {
    check_all(check_sides, &clear(), &[40.0, 89.0, 110.0], 500);
}

#[test]
fn samples_of_sheets_follow_their_pdf() {
    check_all(check_sides, &sheets(), &[10.0, 110.0], 700);
}

/// `weight` is `f |cos| / pdf`, and the density of the sample is that of its direction.
#[test]
fn weights_agree_with_values() {
    let mut rng = Rng::new(1);
    let mut seen = 0;
    for i in 0..300_000 {
        let bsdf = any(&mut rng);
        let wo = uniform_sphere(rng.vec2());
        let mode = [Mode::Radiance, Mode::Importance][i % 2];
        let Some(s) = bsdf.sample(wo, rng.f32(), rng.vec2(), mode) else {
            continue;
        };
        let Density::PerSr(density) = s.density else {
            panic!("{bsdf:?}")
        };
        let (f, pdf) = bsdf.eval_pdf(wo, s.wi, mode);
        // Directions are rounded to 1e-7, over the width of the lobe and the length of the half vector.
        let (rough, interface) = match &bsdf {
            Bsdf::Principled(p) => (p.base.roughness, (p.eta - 1.0).abs()),
            Bsdf::PrincipledThin(p) => {
                (p.base.roughness * (0.65 * p.eta - 0.35).abs().min(1.0), 1.0)
            }
            _ => unreachable!(),
        };
        let alpha = (0.3 * rough * rough).max(1e-3);
        let passes = (wo.z > 0.0) != (s.wi.z > 0.0);
        let length = if passes { interface.min(0.5) } else { 1.0 };
        // Beside the angle of total reflection the reflectance moves as the root of the cosine.
        let tolerance = if passes { 3e-3 } else { 1e-4 };
        let tolerance = tolerance + 1e-5 / (alpha * length * (wo.z.abs() + s.wi.z.abs()));
        if tolerance > 0.05 {
            continue;
        }
        assert!(
            (density / pdf - 1.0).abs() < tolerance,
            "{bsdf:?} {wo} {s:?} {pdf}"
        );
        let scale = s.weight.max_component().max(1e-3);
        for c in 0..3 {
            let error = (s.weight[c] - f[c] * s.wi.z.abs() / density).abs();
            assert!(error < tolerance * scale, "{bsdf:?} {wo} {s:?} {f:?}");
        }
        seen += 1;
    }
    assert!(seen > 100_000, "{seen}");
}

/// Every material, every angle up to the last bit of grazing, at the ends of the random numbers.
#[test]
fn extremes_stay_finite() {
    let mut rng = Rng::new(6);
    let last = 1.0 - f32::EPSILON / 2.0;
    let number = |rng: &mut Rng| match rng.f32() {
        x if x < 0.1 => 0.0,
        x if x < 0.2 => last,
        _ => rng.f32(),
    };
    for i in 0..300_000 {
        let bsdf = any(&mut rng);
        let mut wo = uniform_sphere(rng.vec2());
        if rng.f32() < 0.3 {
            let z = 10f32.powf(-30.0 * rng.f32());
            let flat = Vec2::new(wo.x, wo.y).normalize() * (1.0 - z * z).sqrt();
            wo = flat.extend(z.copysign(wo.z));
        }
        let u = Vec2::new(number(&mut rng), number(&mut rng));
        let mode = [Mode::Radiance, Mode::Importance][i % 2];
        let sampled = bsdf.sample(wo, number(&mut rng), u, mode);
        let mut directions = vec![uniform_sphere(u), -wo, Vec3::new(wo.x, wo.y, -wo.z), wo];
        if let Some(s) = sampled {
            let name = || format!("{bsdf:?} {wo} {s:?}");
            assert!((s.wi.length() - 1.0).abs() < 2e-6, "{}", name());
            assert!(
                s.weight.is_finite() && s.weight.min_component() >= 0.0,
                "{}",
                name()
            );
            // Of luminance: a tint has more than 1 in a channel.
            let bright = s.weight.luminance();
            // The flat diffuse lobe grows as the inverse of both cosines together.
            let cosines = (wo.z.abs() + s.wi.z.abs()).min(1.0);
            assert!(bright > 0.0 && bright * cosines < 60.0, "{}", name());
            assert!(matches!(s.density, Density::PerSr(p) if p > 0.0 && p.is_finite()));
            directions.push(s.wi);
        }
        for wi in directions {
            let (f, pdf) = bsdf.eval_pdf(wo, wi, mode);
            let name = || format!("{bsdf:?} {wo} {wi}: {f:?} {pdf}");
            assert!(f.is_finite() && f.min_component() >= 0.0, "{}", name());
            assert!(pdf.is_finite() && pdf >= 0.0, "{}", name());
            assert!(pdf > 0.0 || f.is_black(), "{}", name());
        }
    }
}

//! What rough glass and plastic become at the ends of their parameters.

use super::*;

fn mirror(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
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

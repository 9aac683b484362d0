//! Reflectance of smooth interfaces for unpolarised light, written so that nothing cancels: an index
//! ratio near 1, grazing angles and the critical angle are exact to rounding.

use crate::math::{Rgb, sqr};

/// Reflectance of the boundary between two dielectrics, and the cosine of the refracted direction (0 under
/// total internal reflection).
///
/// `cos` in 0..1 is on the side the light comes from, `eta` = index beyond / index on that side, > 0.
/// Fresnel's equations (Born & Wolf, 1.5.2 (21)); with `g = eta cos_t` the differences in their numerators
/// are `(1 - eta²) / (cos + g)` and its like, so they vanish exactly as `eta` tends to 1.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> (f32, f32) {
    // eta² - 1, by factors: exact for ratios near 1.
    let excess = (eta - 1.0) * (eta + 1.0);
    if excess == 0.0 {
        return (0.0, cos);
    }
    let g2 = excess + cos * cos;
    if g2 <= 0.0 {
        return (1.0, 0.0);
    }
    let g = g2.sqrt();
    let sum = cos + g;
    let s = excess / (sum * sum);
    let p = excess * (cos - 1.0 / sum) / (eta * eta * cos + g);
    ((0.5 * (s * s + p * p)).min(1.0), g / eta)
}

/// Share of light that passes the boundary between two dielectrics when it arrives equally from all
/// directions; `eta` = index beyond / index on the side it comes from, 1e-12..1e12.
///
/// Closed form for light from the thinner side (Walsh 1926, in Duntley 1942, equation 18); from the denser
/// side it is `eta²` times as much, as that light is confined to the critical cone.
pub fn diffuse_through(eta: f64) -> f64 {
    if eta < 1.0 {
        return diffuse_through(1.0 / eta) * eta * eta;
    }
    let (n, d) = (eta, eta - 1.0);
    // So near to 1 the terms cancel, and next to nothing is reflected.
    if d < 1e-9 {
        return 1.0;
    }
    let (n2, s) = (n * n, n + 1.0);
    let (plus, minus) = (n2 + 1.0, d * s);
    let fourth = plus * minus; // n⁴ - 1
    let a = 0.5 - d * (3.0 * n + 1.0) / (6.0 * s * s);
    let b = n2 * minus * minus / (plus * plus * plus) * (d / s).ln();
    let c = 2.0 * n2 * n * (n2 + 2.0 * n - 1.0) / (plus * fourth);
    let e = 8.0 * n2 * n2 * (n2 * n2 + 1.0) / (plus * fourth * fourth) * d.ln_1p();
    (a - b + c - e).clamp(0.0, 1.0)
}

/// Reflectance of a conductor of complex index `eta + i k` relative to the medium outside, per channel.
///
/// `cos` in 0..1; `eta`, `k` >= 0. `eta` = 0 reflects everything, which is the material "none".
/// Born & Wolf, section 14.2, in the real form of Lazányi & Szirmay-Kalos 2005.
#[inline]
pub fn conductor(cos: f32, eta: Rgb, k: Rgb) -> Rgb {
    eta.zip(k, |eta, k| conductor_channel(cos, eta, k))
}

#[inline]
fn conductor_channel(cos: f32, eta: f32, k: f32) -> f32 {
    // Beyond, everything is reflected to the last digit, and fourth powers would leave the range of f32.
    let (eta, k) = (eta.min(1e9), k.min(1e9));
    let cos2 = sqr(cos.min(1.0));
    let sin2 = 1.0 - cos2;
    let ek = 2.0 * eta * k;
    // a + i b is the index times the cosine of the complex refracted direction: its squares below.
    let re = (eta - 1.0) * (eta + 1.0) - k * k + cos2;
    let norm = (re * re + ek * ek).sqrt();
    // 2 a² = norm + re; for re < 0 the sum would cancel, but (norm + re)(norm - re) = ek².
    let two_a2 = if re < 0.0 {
        ek * ek / (norm - re)
    } else {
        norm + re
    };
    let a_cos = (0.5 * two_a2).sqrt() * cos;
    let s = ratio(norm + cos2 - 2.0 * a_cos, norm + cos2 + 2.0 * a_cos);
    let t = cos2 * norm + sin2 * sin2;
    let p = s * ratio(t - 2.0 * a_cos * sin2, t + 2.0 * a_cos * sin2);
    (0.5 * (s + p)).clamp(0.0, 1.0)
}

/// 0/0 stands for an interface between equals: nothing is reflected.
#[inline]
fn ratio(num: f32, den: f32) -> f32 {
    if den > 0.0 { num / den } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The textbook form in f64.
    fn reference(cos: f64, eta: f64) -> f64 {
        let cos_t = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
        let s = (cos - eta * cos_t) / (cos + eta * cos_t);
        let p = (eta * cos - cos_t) / (eta * cos + cos_t);
        0.5 * (s * s + p * p)
    }

    #[test]
    fn dielectric_matches_the_textbook() {
        for eta in [0.5f32, 0.75, 1.0001, 1.3, 1.5, 2.4, 4.0] {
            for i in 1..=1000 {
                let cos = i as f32 / 1000.0;
                let (r, cos_t) = dielectric(cos, eta);
                let exact = reference(f64::from(cos), f64::from(eta));
                if exact.is_nan() {
                    assert_eq!((r, cos_t), (1.0, 0.0), "total reflection");
                } else {
                    let error = (f64::from(r) - exact).abs();
                    assert!(error < 1e-5 * exact + 1e-9, "{eta} {cos}: {r} {exact}");
                }
            }
        }
    }

    /// Against the integral of twice the cosine times what passes.
    #[test]
    fn diffuse_light_passes_by_the_mean_over_all_angles() {
        for eta in [
            0.1, 0.25, 0.5, 0.75, 0.9999, 1.0, 1.0001, 1.01, 1.5, 4.0, 1e3,
        ] {
            let n = 100_000;
            let cos = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
            let mean = (0..n)
                .map(|i| 2.0 * cos(i) * (1.0 - f64::from(dielectric(cos(i) as f32, eta as f32).0)))
                .sum::<f64>()
                / f64::from(n);
            let t = diffuse_through(eta);
            assert!((t - mean).abs() < 1e-6, "{eta}: {t} {mean}");
        }
        for eta in [1e-6f64, 1e6] {
            // 16 / (3 n) of the light passes where n is large: 4 cos / n and 4 / (n cos) of the two polarisations.
            let few = 16.0 / 3.0 * eta.min(1.0 / eta) * (eta * eta).min(1.0);
            assert!((diffuse_through(eta) / few - 1.0).abs() < 1e-3, "{eta}");
        }
        assert!(diffuse_through(1.0 + 1e-7) > 1.0 - 1e-6);
    }

    #[test]
    fn dielectric_limits() {
        assert!((dielectric(1.0, 1.5).0 - 0.04).abs() < 1e-7);
        for cos in [0.0, 1e-20, 1e-3, 0.5, 1.0] {
            assert_eq!(dielectric(cos, 1.0), (0.0, cos), "no interface");
        }
        for eta in [0.3, 0.999_999_9, 1.000_000_1, 1.5] {
            assert_eq!(dielectric(0.0, eta).0, 1.0, "grazing, eta {eta}");
        }
        // The quadratic law (eta - 1)² / 4 at normal incidence, far below the precision of 1 - T.
        let (r, _) = dielectric(1.0, 1.0 + f32::EPSILON);
        assert!((r / (0.25 * f32::EPSILON * f32::EPSILON) - 1.0).abs() < 1e-5);
    }

    /// At the critical angle the reflectance rises to 1 without a jump.
    #[test]
    fn dielectric_is_continuous_at_the_critical_angle() {
        let eta = 1.0 / 1.5f32;
        let critical = (1.0 - eta * eta).sqrt();
        let (r, cos_t) = dielectric(critical * (1.0 + 1e-6), eta);
        assert!(r > 0.98 && cos_t < 0.01, "{r} {cos_t}");
        assert_eq!(dielectric(critical * (1.0 - 1e-5), eta).0, 1.0);
    }

    #[test]
    fn conductor_limits() {
        for cos in [0.0, 1e-4, 0.3, 1.0] {
            let none = conductor(cos, Rgb::BLACK, Rgb::WHITE);
            assert_eq!(
                none,
                Rgb::WHITE,
                "\"none\" is a perfect mirror at cos {cos}"
            );
            // Without absorption a conductor is a dielectric.
            let glass = conductor(cos, Rgb::splat(1.5), Rgb::BLACK).r;
            assert!(
                (glass - dielectric(cos, 1.5).0).abs() < 2e-6,
                "{cos}: {glass}"
            );
            assert_eq!(conductor(cos, Rgb::WHITE, Rgb::BLACK), Rgb::BLACK);
        }
        let normal = conductor(1.0, Rgb::splat(0.2), Rgb::splat(3.9)).r;
        let exact = (0.8f32.powi(2) + 3.9f32.powi(2)) / (1.2f32.powi(2) + 3.9f32.powi(2));
        assert!((normal - exact).abs() < 1e-6, "{normal} {exact}");
        assert_eq!(conductor(0.0, Rgb::splat(0.2), Rgb::splat(3.9)), Rgb::WHITE);
    }
}

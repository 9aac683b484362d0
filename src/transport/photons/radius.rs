//! The radius that photons are gathered from.

use super::map::clamped;
use crate::math::Vec2;
use crate::scene::CameraSample;
use crate::transport::Setting;

/// Factors that are multiplied one by one; for further ones there is a formula.
const EXACT: u64 = 32;

/// Radius of iteration `i`, counted from 0, for `first` in iteration 0 and `alpha` in [0, 1]: the variance of
/// the mean over all iterations vanishes as well as its bias (Knaus & Zwicker 2011, equation 15), and the
/// radius is a function of the iteration alone.
///
/// The product of (k + alpha) / (k + 1) over k = 1..=i, relative to 1e-6 at any `i`. Never below the range of
/// [`super::RADII`].
pub fn reduced(first: f32, alpha: f32, i: u64) -> f32 {
    let alpha = f64::from(alpha.clamp(0.0, 1.0));
    let factor = |k: u64| (k as f64 + alpha) / (k as f64 + 1.0);
    let mut square: f64 = (1..=i.min(EXACT)).map(factor).product();
    if i > EXACT {
        square *= ratio(alpha, i) / ratio(alpha, EXACT);
    }
    clamped((f64::from(first) * square.sqrt()) as f32)
}

/// Gamma(i + 1 + alpha) / Gamma(i + 2): with d = alpha - 1 and w half-way between, w^d (1 + d (1 - d^2) / 24 w^2),
/// short of 1 by less than 1 / w^4 (Tricomi & Erdelyi 1951, section 3).
fn ratio(alpha: f64, i: u64) -> f64 {
    let (d, w) = (alpha - 1.0, i as f64 + 1.0 + 0.5 * alpha);
    w.powf(d) * (1.0 + d * (1.0 - d * d) / (24.0 * w * w))
}

/// Rays that look for the surfaces in view.
const LOOKS: u32 = 512;
/// Radius where the camera sees no size, in diagonals of the scene.
const SHARE_OF_SCENE: f32 = 0.002;

/// Size of a pixel across the line of sight, where surfaces are that the camera sees, in scene units: the median
/// over the picture, of what receives photons. Where the camera sees none, or has no pixels in space, a share of the scene's size.
/// Always in the range of [`super::RADII`].
pub fn footprint(setting: &Setting) -> f32 {
    let bounds = setting.scene.world().bounds();
    let crop = &setting.film.crop;
    let [x, y, width, height] = [crop.x, crop.y, crop.width, crop.height].map(|n| n as f32);
    // A lattice whose rows and columns are all different (Roberts 2018, the sequence R2).
    let look = |i: u32| {
        let at = |step: f64| ((f64::from(i) + 0.5) * step).fract() as f32;
        let film = Vec2::new(
            x + at(0.754_877_666_246_692_8) * width,
            y + at(0.569_840_290_998_053_3) * height,
        );
        let sample = CameraSample {
            time: at(0.618_033_988_749_894_9),
            ..CameraSample::central(film)
        };
        let ray = setting.camera.ray(&sample).ray;
        let hit = setting.scene.intersect(&ray)?;
        let importance = setting.camera.importance(hit.p, ray.d, sample.time);
        let size = 1.0 / importance.sqrt();
        let counts = size.is_normal() && setting.scene.receives(&hit);
        counts.then_some(size)
    };
    let mut sizes: Vec<f32> = (0..LOOKS).filter_map(look).collect();
    sizes.sort_unstable_by(f32::total_cmp);
    match sizes.get(sizes.len() / 2) {
        Some(size) => clamped(*size),
        None if bounds.is_empty() => 1.0,
        None => clamped(SHARE_OF_SCENE * bounds.diagonal().length()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_follow_the_product() {
        for alpha in [0.0, 0.1, 0.5, 0.75, 0.99, 1.0] {
            let mut square = 1.0f64;
            for i in 0..100_000u64 {
                if i > 0 {
                    square *= (i as f64 + f64::from(alpha)) / (i as f64 + 1.0);
                }
                if i < 100 || i % 997 == 0 {
                    let (got, expected) = (f64::from(reduced(0.3, alpha, i)), 0.3f32);
                    let expected = f64::from(expected) * square.sqrt();
                    // Half of it is the rounding of the result.
                    assert!(
                        (got / expected - 1.0).abs() < 1e-7,
                        "{alpha} {i}: {got} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn radii_fall_for_ever_and_stay_positive() {
        for alpha in [0.0, 0.5, 0.75, 1.0, f32::NAN, -1.0, 7.0] {
            let mut last = f32::INFINITY;
            for i in [
                0,
                1,
                31,
                32,
                33,
                34,
                1000,
                1_000_000,
                1_000_000_000_000,
                u64::MAX,
            ] {
                let r = reduced(2.0, alpha, i);
                assert!(r > 0.0 && (r <= last || alpha == 1.0), "{alpha} {i} {r}");
                last = r;
            }
        }
        assert!(reduced(0.0, 0.5, 3) > 0.0 && reduced(f32::INFINITY, 0.5, 3).is_finite());
        // r^2 falls with i^(alpha - 1).
        let slope = (reduced(1.0, 0.75, 1 << 30) / reduced(1.0, 0.75, 1 << 20)).log2() / 10.0;
        assert!((slope + 0.125).abs() < 1e-5, "{slope}");
    }
}

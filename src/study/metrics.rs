//! Error figures of an image against a reference. All sums are taken in f64.

use super::Picture;

/// What keeps relMSE finite in black pixels (Rousselle et al. 2011, section 5.3, use the same figure).
const REL_MSE_FLOOR: f64 = 0.01;

/// The share of pixels, those with the largest relMSE, that the trimmed figure leaves out: a few
/// fireflies can make up nearly all of relMSE.
pub const TRIMMED_SHARE: f64 = 0.001;

/// Error figures over all pixels and the channels R, G, B; `a` is the image, `b` the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metrics {
    /// Mean of (a - b)², in units of radiance squared.
    pub mse: f64,
    pub rmse: f64,
    /// Mean of (a - b)² / (b² + 0.01).
    pub rel_mse: f64,
    /// The same without the worst [`TRIMMED_SHARE`] of the pixels.
    pub rel_mse_trimmed: f64,
    /// Largest |a - b|.
    pub max_error: f64,
    /// Column and row of the largest |a - b|, from the top left, from 0.
    pub max_at: [usize; 2],
    pub mean_image: [f64; 3],
    pub mean_reference: [f64; 3],
}

impl Metrics {
    /// Compares two pictures of the same size, at least one pixel each.
    pub fn of(image: &Picture, reference: &Picture) -> Metrics {
        let count = image.pixels.len().min(reference.pixels.len());
        let (mut squares, mut relative) = (0.0, Vec::with_capacity(count));
        let (mut mean_image, mut mean_reference) = ([0.0; 3], [0.0; 3]);
        let (mut max_error, mut max_index) = (0.0, 0);
        for (i, (a, b)) in image.pixels.iter().zip(&reference.pixels).enumerate() {
            let mut rel = 0.0;
            for c in 0..3 {
                let (a, b) = (f64::from(a[c]), f64::from(b[c]));
                let d = a - b;
                squares += d * d;
                rel += d * d / (b * b + REL_MSE_FLOOR);
                mean_image[c] += a;
                mean_reference[c] += b;
                if d.abs() > max_error {
                    (max_error, max_index) = (d.abs(), i);
                }
            }
            relative.push(rel / 3.0);
        }
        let n = count.max(1) as f64;
        let mse = squares / (3.0 * n);
        let rel_mse = relative.iter().sum::<f64>() / n;
        relative.sort_unstable_by(f64::total_cmp);
        let keep = ((n * (1.0 - TRIMMED_SHARE)).round_ties_even() as usize).clamp(1, count.max(1));
        let kept = relative.iter().take(keep);
        Metrics {
            mse,
            rmse: mse.sqrt(),
            rel_mse,
            rel_mse_trimmed: kept.sum::<f64>() / keep as f64,
            max_error,
            max_at: [max_index % image.width, max_index / image.width],
            mean_image: mean_image.map(|s| s / n),
            mean_reference: mean_reference.map(|s| s / n),
        }
    }

    /// Mean of the image over mean of the reference, per channel; `None` where the reference is black.
    pub fn ratio(&self) -> [Option<f64>; 3] {
        std::array::from_fn(|c| ratio(self.mean_image[c], self.mean_reference[c]))
    }

    /// Mean of the image over mean of the reference, all channels together.
    pub fn ratio_all(&self) -> Option<f64> {
        ratio(
            self.mean_image.iter().sum(),
            self.mean_reference.iter().sum(),
        )
    }
}

fn ratio(a: f64, b: f64) -> Option<f64> {
    (b != 0.0).then_some(a / b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    fn picture(pixels: Vec<Rgb>) -> Picture {
        Picture {
            width: pixels.len(),
            height: 1,
            pixels,
        }
    }

    #[test]
    fn figures_of_a_known_pair() {
        let b = picture(vec![Rgb::splat(2.0); 2000]);
        let mut pixels = vec![Rgb::new(2.0, 2.0, 2.2); 2000];
        pixels[7] = Rgb::splat(12.0);
        let m = Metrics::of(&picture(pixels), &b);
        let d2 = (f64::from(2.2f32) - 2.0).powi(2);
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        close(m.mse, (1999.0 * d2 + 300.0) / 6000.0);
        close(m.rmse, m.mse.sqrt());
        close(m.rel_mse, (1999.0 * d2 + 300.0) / 6000.0 / 4.01);
        // Two pixels of 2000 are left out, one of them the firefly.
        close(m.rel_mse_trimmed, d2 / 3.0 / 4.01);
        assert_eq!((m.max_error, m.max_at), (10.0, [7, 0]));
        close(m.ratio()[0].unwrap(), (1999.0 * 2.0 + 12.0) / 4000.0);
    }

    #[test]
    fn a_black_reference_has_no_ratio() {
        let black = picture(vec![Rgb::BLACK; 4]);
        let m = Metrics::of(&picture(vec![Rgb::splat(0.1); 4]), &black);
        assert_eq!((m.ratio(), m.ratio_all()), ([None; 3], None));
        assert!((m.rel_mse - 1.0).abs() < 1e-6);
    }
}

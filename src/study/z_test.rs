//! Is an image an unbiased estimate of a reference, given how noisy both are?
//!
//! Three tests, each blind where another sees. The *pixel test* counts the pixels that lie further from
//! the reference than chance explains, as Mitsuba's scene tests do; it finds errors in places but misses
//! a 2 % error of scale where pixels are noisier than that. The *scale test* fits one factor between
//! image and reference with weights that favour quiet pixels. The *mean test* compares the means over
//! the image and sees what happens in the bright, noisy pixels that the scale test ignores.
//!
//! Assumed: means over many samples are close to normal, and pixels are independent (a box filter).

use crate::image_io::color::{RGB_TO_XYZ, apply};
use crate::math::Rgb;

use super::Picture;

/// Smallest variance per sample that a reference of kind `sample` is believed to have: below, rounding
/// errors would fail pixels without noise. The figure is Mitsuba's.
const SAMPLE_VARIANCE_FLOOR: f64 = 1e-4;

/// Relative error that the weights of the scale test grant each pixel besides its noise.
const WEIGHT_TOLERANCE: f64 = 0.005;

/// Relative error that the pixel test grants where the variance is estimated (kinds of a mean).
const MEAN_TOLERANCE: f64 = 1e-3;

/// What is known about the noise of the two pictures.
#[derive(Clone, Debug)]
pub enum Noise {
    /// The variance of one sample in XYZ, carried through the matrix to RGB (where it may be negative):
    /// what Mitsuba's test references come with. The test is done in XYZ. The image has `spp` samples,
    /// the reference `reference_spp`.
    Sample {
        variance: Picture,
        spp: f64,
        reference_spp: f64,
    },
    /// The variance of the reference, the mean of `reference_spp` samples. The image is taken to have
    /// the same noise per sample, which only holds for the same estimator.
    Mean {
        variance: Picture,
        spp: f64,
        reference_spp: f64,
    },
    /// The variances of both pictures.
    Both { image: Picture, reference: Picture },
}

/// Levels and tolerances. The default is the rule of this project.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// Probability that the pixel test would let the worst pixel of a right image fail.
    pub significance: f64,
    /// Share of (pixel, channel) values that must pass the pixel test.
    pub share: f64,
    /// A scale or mean is wrong when it is off by more than so many standard errors …
    pub bias_z: f64,
    /// … and by more than this relative error, which table sizes or rounding may explain.
    pub bias_tolerance: f64,
    /// Side of the blocks of pixels that are averaged first; `None`: 1 for [`Noise::Sample`], else 4,
    /// as estimated variances are themselves noisy.
    pub block: Option<usize>,
}

impl Default for Rule {
    fn default() -> Rule {
        Rule {
            significance: 0.01,
            share: 0.9975,
            bias_z: 3.9,
            bias_tolerance: 0.005,
            block: None,
        }
    }
}

/// Outcome of the pixel test.
#[derive(Clone, Copy, Debug)]
pub struct PixelTest {
    pub pass: bool,
    /// Share of the values with z below `z_limit`, and their number.
    pub share: f64,
    pub values: usize,
    pub z_limit: f64,
    pub z_max: f64,
    pub z_rms: f64,
}

/// Outcome of a scale or mean test of one channel.
#[derive(Clone, Copy, Debug)]
pub struct BiasTest {
    pub pass: bool,
    /// Relative error and how many standard errors that is.
    pub error: f64,
    pub z: f64,
    /// The smallest relative error that this test could have seen.
    pub power: f64,
}

/// Outcome of all tests.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// Names of the channels tested: X, Y, Z or R, G, B.
    pub channels: [&'static str; 3],
    /// Width and height after averaging blocks.
    pub size: [usize; 2],
    pub block: usize,
    pub pixel: PixelTest,
    pub scale: [BiasTest; 3],
    pub mean: [BiasTest; 3],
}

impl Verdict {
    pub fn pass(&self) -> bool {
        self.pixel.pass && self.scale.iter().chain(&self.mean).all(|t| t.pass)
    }
}

/// Tests an image against a reference of the same size.
///
/// # Errors
/// Sample counts that are not above zero, variances of another size, blocks larger than the picture.
pub fn z_test(
    image: &Picture,
    reference: &Picture,
    noise: &Noise,
    rule: &Rule,
) -> Result<Verdict, String> {
    let prepared = Prepared::new(image, reference, noise, rule)?;
    let pixel = prepared.pixel_test(rule);
    Ok(Verdict {
        channels: prepared.channels,
        size: [prepared.width, prepared.height],
        block: prepared.block,
        pixel,
        scale: std::array::from_fn(|c| prepared.scale_test(c, rule)),
        mean: std::array::from_fn(|c| prepared.mean_test(c, rule)),
    })
}

/// A channel of a picture in f64.
type Plane = Vec<f64>;

/// The two pictures and their noise in the space, and at the resolution, in which they are tested.
struct Prepared {
    channels: [&'static str; 3],
    width: usize,
    height: usize,
    block: usize,
    image: [Plane; 3],
    reference: [Plane; 3],
    /// Variance of image - reference for the pixel test: never too small.
    v_pixel: [Plane; 3],
    /// The same as it is, for sums over pixels.
    v_sum: [Plane; 3],
    /// Variance and reference that the weights of the scale test are made of.
    v_weight: [Plane; 3],
    r_weight: [Plane; 3],
}

impl Prepared {
    fn new(
        image: &Picture,
        reference: &Picture,
        noise: &Noise,
        rule: &Rule,
    ) -> Result<Prepared, String> {
        let sized = |p: &Picture| (p.width, p.height) == (reference.width, reference.height);
        let variances = match noise {
            Noise::Sample { variance, .. } | Noise::Mean { variance, .. } => [variance, variance],
            Noise::Both { image, reference } => [image, reference],
        };
        if !sized(image) || !variances.into_iter().all(sized) {
            return Err("the pictures and their variances differ in size".to_string());
        }
        if let Noise::Sample {
            spp, reference_spp, ..
        }
        | Noise::Mean {
            spp, reference_spp, ..
        } = noise
            && !(*spp > 0.0 && *reference_spp > 0.0 && (spp + reference_spp).is_finite())
        {
            return Err("the numbers of samples per pixel must be above zero".to_string());
        }
        let sample = matches!(noise, Noise::Sample { .. });
        let block = rule.block.unwrap_or(if sample { 1 } else { 4 });
        if block == 0 || block > reference.width.min(reference.height) {
            return Err(format!(
                "blocks of {block} x {block} pixels do not fit {} x {}",
                reference.width, reference.height
            ));
        }
        let space: fn(Rgb) -> [f64; 3] = match sample {
            true => |c| apply(&RGB_TO_XYZ, c.to_array().map(f64::from)),
            false => |c| c.to_array().map(f64::from),
        };
        let (v_pixel, v_sum) = variances_of(noise, space);
        let width = reference.width;
        let shrink = |planes: [Plane; 3], divide: f64| {
            planes.map(|p| average_blocks(&p, width, block, divide))
        };
        let area = (block * block) as f64;
        let image = shrink(planes(image, space), 1.0);
        let shrunk = shrink(planes(reference, space), 1.0);
        let (v_pixel, v_sum) = (shrink(v_pixel, area), shrink(v_sum, area));
        let mut prepared = Prepared {
            channels: if sample {
                ["X", "Y", "Z"]
            } else {
                ["R", "G", "B"]
            },
            width: width / block,
            height: reference.height / block,
            block,
            v_weight: v_pixel.clone(),
            r_weight: shrunk.clone(),
            image,
            reference: shrunk,
            v_pixel,
            v_sum,
        };
        if !sample {
            prepared.distrust_variances();
        }
        Ok(prepared)
    }

    /// An estimated variance is correlated with its pixel: one that met no firefly has a low mean and a
    /// low variance. Weights therefore come from the neighbours alone, and no variance of the pixel
    /// test is below that of its neighbourhood.
    fn distrust_variances(&mut self) {
        let (w, h) = (self.width, self.height);
        let overall = self.reference.iter().flatten().sum::<f64>() / (3 * w * h) as f64;
        for c in 0..3 {
            self.v_weight[c] = neighbours(&self.v_pixel[c], w, h, false);
            self.r_weight[c] = neighbours(&self.reference[c], w, h, false);
            let around = neighbours(&self.v_pixel[c], w, h, true);
            for (i, v) in self.v_pixel[c].iter_mut().enumerate() {
                let grant = MEAN_TOLERANCE * (self.reference[c][i].abs() + 0.01 * overall);
                *v = v.max(around[i]).max(grant * grant);
            }
        }
    }

    fn pixel_test(&self, rule: &Rule) -> PixelTest {
        let pixels = self.width * self.height;
        // Sidak: the level per pixel at which the worst of all stays at `significance`.
        let alpha = -(f64::ln_1p(-rule.significance) / pixels as f64).exp_m1();
        let z_limit = normal_upper_quantile(0.5 * alpha);
        let (mut inside, mut z_max, mut squares) = (0usize, 0.0f64, 0.0);
        for c in 0..3 {
            for (i, v) in self.v_pixel[c].iter().enumerate() {
                let d = self.image[c][i] - self.reference[c][i];
                // No noise and no difference is agreement, not 0 / 0.
                let z = if d == 0.0 { 0.0 } else { d.abs() / v.sqrt() };
                inside += usize::from(z < z_limit);
                z_max = z_max.max(z);
                squares += z * z;
            }
        }
        let values = 3 * pixels;
        let share = inside as f64 / values as f64;
        PixelTest {
            pass: share >= rule.share,
            share,
            values,
            z_limit,
            z_max,
            z_rms: (squares / values as f64).sqrt(),
        }
    }

    /// The factor s for which the weighted sum of (image - s reference) vanishes.
    fn scale_test(&self, c: usize, rule: &Rule) -> BiasTest {
        let (mut fit, mut difference, mut variance) = (0.0, 0.0, 0.0);
        for (i, r) in self.r_weight[c].iter().enumerate() {
            let w = r / (self.v_weight[c][i] + (WEIGHT_TOLERANCE * r).powi(2) + 1e-30);
            fit += w * self.reference[c][i];
            difference += w * (self.image[c][i] - self.reference[c][i]);
            variance += w * w * self.v_sum[c][i];
        }
        match fit > 0.0 {
            true => judge(difference / fit, variance.sqrt() / fit, rule),
            false => judge(0.0, f64::INFINITY, rule),
        }
    }

    fn mean_test(&self, c: usize, rule: &Rule) -> BiasTest {
        let n = (self.width * self.height) as f64;
        let (mut sum, mut squares) = (0.0, 0.0);
        for (a, b) in self.image[c].iter().zip(&self.reference[c]) {
            sum += a - b;
            squares += (a - b) * (a - b);
        }
        let mean = sum / n;
        let reference = self.reference[c].iter().sum::<f64>() / n;
        // A spread larger than predicted (a noisier estimator, fireflies) replaces the prediction.
        let predicted = self.v_sum[c].iter().sum::<f64>();
        let error = predicted.max(squares - n * mean * mean).sqrt() / n;
        match reference != 0.0 {
            true => judge(mean / reference, error / reference.abs(), rule),
            false => judge(0.0, f64::INFINITY, rule),
        }
    }
}

fn judge(error: f64, standard_error: f64, rule: &Rule) -> BiasTest {
    let z = match () {
        () if standard_error > 0.0 => error / standard_error,
        () if error == 0.0 => 0.0,
        () => f64::INFINITY.copysign(error),
    };
    BiasTest {
        pass: z.abs() <= rule.bias_z || error.abs() <= rule.bias_tolerance,
        error,
        z,
        power: (rule.bias_z * standard_error).max(rule.bias_tolerance),
    }
}

/// Variance of image - reference for the pixel test, and for sums.
fn variances_of(noise: &Noise, space: fn(Rgb) -> [f64; 3]) -> ([Plane; 3], [Plane; 3]) {
    let scaled = |planes: &[Plane; 3], floor: f64, factor: f64| {
        std::array::from_fn(|c| planes[c].iter().map(|v| v.max(floor) * factor).collect())
    };
    match noise {
        Noise::Sample {
            variance,
            spp,
            reference_spp,
        } => {
            let v = planes(variance, space);
            // The pixel test takes the reference as exact.
            (
                scaled(&v, SAMPLE_VARIANCE_FLOOR, 1.0 / spp),
                scaled(&v, 0.0, 1.0 / spp + 1.0 / reference_spp),
            )
        }
        Noise::Mean {
            variance,
            spp,
            reference_spp,
        } => {
            let v = scaled(&planes(variance, space), 0.0, reference_spp / spp + 1.0);
            (v.clone(), v)
        }
        Noise::Both { image, reference } => {
            let mut v: [Plane; 3] = scaled(&planes(image, space), 0.0, 1.0);
            let r: [Plane; 3] = scaled(&planes(reference, space), 0.0, 1.0);
            for (v, r) in v.iter_mut().flatten().zip(r.iter().flatten()) {
                *v += r;
            }
            (v.clone(), v)
        }
    }
}

fn planes(picture: &Picture, space: fn(Rgb) -> [f64; 3]) -> [Plane; 3] {
    let mut planes: [Plane; 3] = Default::default();
    for &pixel in &picture.pixels {
        for (plane, v) in planes.iter_mut().zip(space(pixel)) {
            plane.push(v);
        }
    }
    planes
}

/// Means over blocks, divided by `divide`; incomplete blocks at the right and bottom are left out.
fn average_blocks(plane: &[f64], width: usize, block: usize, divide: f64) -> Plane {
    if block == 1 {
        return plane.to_vec();
    }
    let (w, h) = (width / block, plane.len() / width / block);
    let factor = 1.0 / ((block * block) as f64 * divide);
    let mut out = Vec::with_capacity(w * h);
    for (y, x) in (0..h).flat_map(|y| (0..w).map(move |x| (y, x))) {
        let rows = (0..block).map(|j| &plane[(y * block + j) * width + x * block..][..block]);
        out.push(rows.flatten().sum::<f64>() * factor);
    }
    out
}

/// Mean over the 5 x 5 neighbourhood, with or without its centre, mirrored at the border.
fn neighbours(plane: &[f64], width: usize, height: usize, with_centre: bool) -> Plane {
    let mirror = |i: i64, n: usize| -> usize {
        let last = n as i64 - 1;
        if last == 0 {
            return 0;
        }
        let i = i.rem_euclid(2 * last);
        i.min(2 * last - i) as usize
    };
    let mut out = Vec::with_capacity(plane.len());
    for i in 0..plane.len() {
        let (x, y) = ((i % width) as i64, (i / width) as i64);
        let mut sum = 0.0;
        for (dy, dx) in (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (dy, dx))) {
            if with_centre || (dy, dx) != (0, 0) {
                sum += plane[mirror(y + dy, height) * width + mirror(x + dx, width)];
            }
        }
        out.push(sum / if with_centre { 25.0 } else { 24.0 });
    }
    out
}

/// The z above which a standard normal number lies with probability `p`, 0 < p <= 0.05.
///
/// Newton's method on the logarithm of the tail, which is nearly a parabola there; the tail by Laplace's
/// continued fraction (Abramowitz and Stegun 1964, 26.2.14).
fn normal_upper_quantile(p: f64) -> f64 {
    // 100 levels give 1e-15 from z = 1.6 on.
    let mills = |z: f64| (1..=100).rev().fold(z, |f, k| z + f64::from(k) / f);
    let log_tail = |z: f64| {
        let log_density = -0.5 * z * z - 0.5 * (2.0 * std::f64::consts::PI).ln();
        log_density - mills(z).ln()
    };
    let mut z = (-2.0 * p.ln()).sqrt();
    for _ in 0..20 {
        // The slope of the logarithm of the tail is minus the continued fraction.
        z = (z + (log_tail(z) - p.ln()) / mills(z)).max(1.0);
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_normal_distribution() {
        // Abramowitz and Stegun 1964, tables 26.5 and 26.6, and R's qnorm.
        for (p, z) in [
            (0.05, 1.644_853_626_951_472_2),
            (0.005, 2.575_829_303_548_900_4),
            (1e-6, 4.753_424_308_822_899),
            (1e-9, 5.997_807_015_007_686),
        ] {
            let found = normal_upper_quantile(p);
            assert!((found - z).abs() < 1e-9, "{p}: {found} is not {z}");
        }
    }

    #[test]
    fn neighbourhoods_mirror_at_the_border() {
        let plane: Vec<f64> = (0..9).map(f64::from).collect();
        // Around the corner of a 3 x 3 plane the columns 2 1 0 1 2 are seen, and the rows likewise.
        let columns = [2.0, 1.0, 0.0, 1.0, 2.0];
        let total: f64 = columns
            .iter()
            .map(|y| columns.iter().map(|x| 3.0 * y + x).sum::<f64>())
            .sum();
        assert!((neighbours(&plane, 3, 3, true)[0] - total / 25.0).abs() < 1e-12);
        assert_eq!(neighbours(&[2.0], 1, 1, false), [2.0]);
    }

    #[test]
    fn blocks_leave_out_what_is_incomplete() {
        let plane: Vec<f64> = (0..15).map(f64::from).collect();
        assert_eq!(average_blocks(&plane, 5, 2, 1.0), [3.0, 5.0]);
    }
}

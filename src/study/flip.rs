//! FLIP: the difference that a viewer notices when flipping between two pictures.
//!
//! LDR-FLIP after Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A
//! Difference Evaluator for Alternating Images"; HDR-FLIP after Andersson, Nilsson, Shirley and
//! Akenine-Möller 2021, "Visualizing Errors in Rendered High Dynamic Range Images". The Gaussian
//! filters are separable and applied along rows, then columns.

use rayon::prelude::*;

use super::Picture;
use crate::image_io::color::{RGB_TO_XYZ, XYZ_TO_RGB};
use crate::math::Rgb;

/// Pixels per degree of visual angle that the authors propose: a monitor 0.7 m wide with 3840 pixels,
/// seen from 0.7 m.
pub const DEFAULT_PPD: f32 = 67.020_64;

/// Exponent of colour differences (2020, section 4.1).
const COLOUR_EXPONENT: f32 = 0.7;
/// Differences up to this share of the largest one take up the range 0 to [`KNEE_VALUE`].
const KNEE: f32 = 0.4;
const KNEE_VALUE: f32 = 0.95;
/// Exponent of feature differences (2020, section 4.2).
const FEATURE_EXPONENT: f32 = 0.5;
/// Width of an edge detector, degrees of visual angle.
const FEATURE_WIDTH: f32 = 0.082;

/// Contrast sensitivity as Gaussians a sqrt(pi/b) exp(-pi² r²/b), r in degrees: the pairs (a, b) of
/// the achromatic channel, of red-green, and both of blue-yellow (2020, table 1).
const CSF: [(f32, f32); 4] = [(1.0, 0.0047), (1.0, 0.0053), (34.1, 0.04), (13.5, 0.025)];

/// A map of differences, 0 (none) to 1, and its mean.
#[derive(Clone, Debug)]
pub struct Flip {
    pub mean: f64,
    /// One number per pixel, row by row from the top left.
    pub map: Vec<f32>,
}

impl Flip {
    fn of_map(map: Vec<f32>) -> Flip {
        let sum: f64 = map.iter().map(|&v| f64::from(v)).sum();
        Flip {
            mean: sum / map.len().max(1) as f64,
            map,
        }
    }
}

/// LDR-FLIP of two pictures of the same size, given as linear colours and clamped to 0..1. `ppd` are
/// the pixels per degree, above 0; see [`DEFAULT_PPD`].
pub fn ldr(image: &Picture, reference: &Picture, ppd: f32) -> Flip {
    Flip::of_map(ldr_map(image, reference, ppd, |c| c))
}

/// HDR-FLIP of two pictures of the same size: the largest LDR-FLIP over the exposures at which a viewer
/// may look at the reference, from its highlights to its median, through the ACES tone curve. Negative
/// colours count as black. A reference that is black everywhere is seen at exposure 0 alone.
pub fn hdr(image: &Picture, reference: &Picture, ppd: f32) -> Flip {
    let mut map = vec![0.0f32; reference.pixels.len()];
    for exposure in exposures(reference) {
        let gain = exposure.exp2();
        let at = ldr_map(image, reference, ppd, |c| (c * gain).map(aces));
        map.iter_mut().zip(at).for_each(|(m, v)| *m = m.max(v));
    }
    Flip::of_map(map)
}

/// The ACES tone curve as fitted by Narkowicz, with the 0.6 that FLIP folds in (2021, section 3).
fn aces(v: f32) -> f32 {
    let v = 0.6 * v.max(0.0);
    // Past this the curve is 1 after clamping; the quotient of infinities would not be.
    if v > 1e6 {
        return 1.0;
    }
    v * (2.51 * v + 0.03) / (v * (2.43 * v + 0.59) + 0.14)
}

/// Exposures, log2, evenly spaced: from where the brightest pixel of the reference maps to 0.85 to
/// where the median does, at most about one stop apart (2021, section 3.2).
fn exposures(reference: &Picture) -> Vec<f32> {
    let mut luminance: Vec<f32> = reference.pixels.iter().map(|p| luminance(*p)).collect();
    luminance.sort_unstable_by(f32::total_cmp);
    let Some(&brightest) = luminance.last().filter(|&&l| l > 0.0) else {
        return vec![0.0];
    };
    let middle = luminance.len() / 2;
    let median = match luminance.len() % 2 {
        0 => 0.5 * (luminance[middle - 1] + luminance[middle]),
        _ => luminance[middle],
    };
    // The positive solution of aces(v) = 0.85, a quadratic in 0.6 v.
    let (a, b, c) = (
        2.51 - 0.85 * 2.43f32,
        0.03 - 0.85 * 0.59f32,
        -0.85 * 0.14f32,
    );
    let white = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a) / 0.6;
    let start = (white / brightest).log2();
    let stop = (white / median.max(f32::EPSILON)).log2();
    let count = (stop - start).ceil().max(2.0) as usize;
    let step = (stop - start) / (count - 1) as f32;
    (0..count).map(|i| start + i as f32 * step).collect()
}

fn luminance(c: Rgb) -> f32 {
    let [r, g, b] = RGB_TO_XYZ[1].map(|v| v as f32);
    r * c.r + g * c.g + b * c.b
}

/// LDR-FLIP after `tone` has been applied to the colours.
fn ldr_map(
    image: &Picture,
    reference: &Picture,
    ppd: f32,
    tone: impl Fn(Rgb) -> Rgb + Copy + Sync,
) -> Vec<f32> {
    let seen = |p: &Picture| Seen::new(p, ppd, tone);
    let (a, b) = (seen(image), seen(reference));
    let scale = largest_colour_difference();
    let feature = |v: &[f32], w: &[f32], i: usize| (v[i] - w[i]).abs();
    (0..a.lab.len())
        .into_par_iter()
        .map(|i| {
            let colour = redistribute(hyab(a.lab[i], b.lab[i]), scale);
            let difference = feature(&a.edge, &b.edge, i).max(feature(&a.point, &b.point, i));
            // Opposite edges of full strength differ by sqrt(2).
            let feature = (difference * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT);
            colour.powf(1.0 - feature)
        })
        .collect()
}

/// What the eye makes of one picture.
struct Seen {
    /// Colours after spatial filtering, in L*a*b* with the Hunt effect.
    lab: Vec<[f32; 3]>,
    /// Strength of edges and of points at each pixel.
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Seen {
    fn new(picture: &Picture, ppd: f32, tone: impl Fn(Rgb) -> Rgb + Sync) -> Seen {
        let width = picture.width;
        let unit = |v: f32| v.clamp(0.0, 1.0);
        let opponent: Vec<[f32; 3]> = picture
            .pixels
            .par_iter()
            .map(|&p| to_opponent(tone(p).map(unit).to_array()))
            .collect();
        let channel = |c: usize| -> Vec<f32> { opponent.par_iter().map(|v| v[c]).collect() };
        let lightness = channel(0);
        let [achromatic, red_green] = [(&lightness, 0), (&channel(1), 1)].map(|(plane, i)| {
            let (kernel, _) = csf_kernel(i, ppd);
            filter(plane, width, &kernel, &kernel)
        });
        // The two Gaussians of blue-yellow, weighted by their sums over the plane.
        let plane = channel(2);
        let [(broad, wide), (narrow, thin)] = [csf_kernel(2, ppd), csf_kernel(3, ppd)];
        let share = wide / (wide + thin);
        let broad = filter(&plane, width, &broad, &broad);
        let narrow = filter(&plane, width, &narrow, &narrow);
        let lab = (0..plane.len())
            .into_par_iter()
            .map(|i| {
                let yellow = share * broad[i] + (1.0 - share) * narrow[i];
                let rgb = from_opponent([achromatic[i], red_green[i], yellow]);
                to_hunt_lab(rgb.map(unit))
            })
            .collect();
        let (edge, point) = features(&lightness, width, ppd);
        Seen { lab, edge, point }
    }
}

/// A one-dimensional Gaussian of [`CSF`] of sum 1, and its weight: a times its sum over the plane. All
/// have the radius of the broadest, three of its standard deviations (2020, section 4.1.1).
fn csf_kernel(index: usize, ppd: f32) -> (Vec<f32>, f32) {
    use std::f32::consts::PI;
    let (a, b) = CSF[index];
    let broadest = CSF.iter().fold(0.0f32, |m, c| m.max(c.1));
    let radius = (3.0 * (broadest / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i32;
    let gauss = |x: i32| (-(PI * x as f32 / ppd).powi(2) / b).exp();
    let mut kernel: Vec<f32> = (-radius..=radius).map(gauss).collect();
    let sum: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|v| *v /= sum);
    (kernel, a * (PI / b).sqrt() * sum * sum)
}

/// Strength of edges and points in a plane of lightness (2020, section 4.2): lengths of the vectors
/// of first and of second derivatives of a Gaussian.
fn features(lightness: &[f32], width: usize, ppd: f32) -> (Vec<f32>, Vec<f32>) {
    let deviation = 0.5 * FEATURE_WIDTH * ppd;
    let radius = (3.0 * deviation).ceil() as i32;
    let kernel = |shape: &dyn Fn(f32) -> f32| -> Vec<f32> {
        let value = |x: i32| {
            let x = x as f32 / deviation;
            shape(x) * (-0.5 * x * x).exp()
        };
        let mut kernel: Vec<f32> = (-radius..=radius).map(value).collect();
        // Positive weights sum to 1, negative ones to -1.
        let positive: f32 = kernel.iter().map(|v| v.max(0.0)).sum();
        let negative: f32 = kernel.iter().map(|v| v.min(0.0)).sum();
        let sum = |v: f32| if v > 0.0 { positive } else { -negative };
        kernel
            .iter_mut()
            .for_each(|v| *v /= sum(*v).max(f32::MIN_POSITIVE));
        kernel
    };
    let smooth = kernel(&|_| 1.0);
    let length = |derivative: &[f32]| -> Vec<f32> {
        let across = filter(lightness, width, derivative, &smooth);
        let down = filter(lightness, width, &smooth, derivative);
        across.iter().zip(&down).map(|(x, y)| x.hypot(*y)).collect()
    };
    // Lightness of 0..1 instead of -16..100.
    let scaled = |kernel: Vec<f32>| -> Vec<f32> { kernel.iter().map(|v| v / 116.0).collect() };
    (
        length(&scaled(kernel(&|x| -x))),
        length(&scaled(kernel(&|x| x * x - 1.0))),
    )
}

/// Filters a plane along its rows with `across`, then along its columns with `down`; both have an odd
/// length. Beyond the border the nearest pixel is repeated.
fn filter(plane: &[f32], width: usize, across: &[f32], down: &[f32]) -> Vec<f32> {
    let height = plane.len() / width;
    let mut rows = vec![0.0; plane.len()];
    let filter_row = |(out, row): (&mut [f32], &[f32])| {
        let radius = across.len() / 2;
        let mut padded = vec![row[0]; radius];
        padded.extend_from_slice(row);
        padded.resize(width + 2 * radius, row[width - 1]);
        for (k, weight) in across.iter().enumerate() {
            for (out, v) in out.iter_mut().zip(&padded[k..]) {
                *out += weight * v;
            }
        }
    };
    rows.par_chunks_mut(width)
        .zip(plane.par_chunks(width))
        .for_each(filter_row);
    let mut done = vec![0.0; plane.len()];
    let filter_column = |(y, out): (usize, &mut [f32])| {
        let radius = down.len() / 2;
        for (k, weight) in down.iter().enumerate() {
            let from = (y + k).saturating_sub(radius).min(height - 1);
            for (out, v) in out.iter_mut().zip(&rows[from * width..][..width]) {
                *out += weight * v;
            }
        }
    };
    done.par_chunks_mut(width)
        .enumerate()
        .for_each(filter_column);
    done
}

fn apply(matrix: &[[f64; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] as f32 * v[0] + row[1] as f32 * v[1] + row[2] as f32 * v[2])
}

/// XYZ of white: what each row of the matrix sums to.
fn white() -> [f32; 3] {
    RGB_TO_XYZ.map(|row| row.iter().sum::<f64>() as f32)
}

/// Linear RGB to the linear opponent space Y Cx Cz (2020, section 4.1.1).
fn to_opponent(rgb: [f32; 3]) -> [f32; 3] {
    let (xyz, white) = (apply(&RGB_TO_XYZ, rgb), white());
    let [x, y, z] = std::array::from_fn(|c| xyz[c] / white[c]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent(opponent: [f32; 3]) -> [f32; 3] {
    let y = (opponent[0] + 16.0) / 116.0;
    let relative = [y + opponent[1] / 500.0, y, y - opponent[2] / 200.0];
    let white = white();
    apply(&XYZ_TO_RGB, std::array::from_fn(|c| relative[c] * white[c]))
}

/// Linear RGB to CIE L*a*b*, the colour weakened with falling lightness (Hunt 1952).
fn to_hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    let (xyz, white) = (apply(&RGB_TO_XYZ, rgb), white());
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = std::array::from_fn(|c| {
        let t = xyz[c] / white[c];
        if t > DELTA * DELTA * DELTA {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// Distance of large colour differences (Abasi et al. 2020), raised to [`COLOUR_EXPONENT`].
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    let distance = (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2]);
    distance.powf(COLOUR_EXPONENT)
}

/// The difference of green and blue, the largest there is (2020, section 4.1.3).
fn largest_colour_difference() -> f32 {
    hyab(to_hunt_lab([0.0, 1.0, 0.0]), to_hunt_lab([0.0, 0.0, 1.0]))
}

/// Colour difference to 0..1, the largest ones compressed.
fn redistribute(difference: f32, largest: f32) -> f32 {
    let knee = KNEE * largest;
    if difference < knee {
        KNEE_VALUE / knee * difference
    } else {
        KNEE_VALUE + (difference - knee) / (largest - knee) * (1.0 - KNEE_VALUE)
    }
}

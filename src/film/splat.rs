//! Light that arrives at the film anywhere: what light tracing contributes.

use super::{Filter, Window};
use crate::math::{Rgb, Vec2};

/// A contribution at a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// In pixels from the top left corner of the full picture.
    pub film: Vec2,
    pub value: Rgb,
}

/// Sums of splats over the pixels of a window, as integers: they do not depend on the order of the splats.
///
/// A splat of value v at x adds v h(x - c) to the pixel of centre c, with the reconstruction filter h of
/// integral 1 over the film: in the mean what camera samples, drawn from the same filter, give for the same
/// light. The weights h are rounded to 2^-30 of the largest and each term to a multiple of 2^-88 (3e-27), so
/// splats down to 1e-18 are kept to 24 bits and what is below 1e-27 is lost; sums are exact from there on.
#[derive(Clone, Debug)]
pub struct SplatBuffer {
    window: Window,
    kernel: Kernel,
    /// Per pixel, row by row, three channels.
    sums: Vec<[Fixed; 3]>,
}

/// Part of the buffer: some rows of the window, which can be filled beside other parts.
#[derive(Debug)]
pub struct SplatBand<'a> {
    window: Window,
    kernel: Kernel,
    sums: &'a mut [[Fixed; 3]],
    /// Weights of the columns of the splat under way.
    columns: Vec<f64>,
}

impl SplatBuffer {
    pub fn new(window: Window, filter: Filter) -> SplatBuffer {
        let pixels = window.width as usize * window.height as usize;
        SplatBuffer {
            window,
            kernel: Kernel::new(filter),
            sums: vec![[Fixed::ZERO; 3]; pixels],
        }
    }

    /// Whether a splat of this value can be added: finite, and not above 2^72 (5e21), or less where the filter
    /// is narrower than a pixel.
    pub fn accepts(&self, value: Rgb) -> bool {
        self.kernel.accepts(value)
    }

    /// Adds to the pixels that the reconstruction filter spreads the splat over; none for a splat that is
    /// not one of [`SplatBuffer::accepts`].
    pub fn add(&mut self, splat: &Splat) {
        for mut band in self.bands(1) {
            band.add(splat);
        }
    }

    /// The whole buffer as at most `n` bands of rows, top to bottom. A splat belongs into all of them.
    pub fn bands(&mut self, n: usize) -> Vec<SplatBand<'_>> {
        let (window, kernel) = (self.window, self.kernel);
        let rows = (window.height as usize).div_ceil(n.max(1)).max(1);
        let width = (window.width as usize).max(1);
        let bands = self.sums.chunks_mut(rows * width).enumerate();
        let band = |(i, sums): (usize, _)| {
            let sums: &mut [[Fixed; 3]] = sums;
            SplatBand {
                window: Window {
                    y: window.y + (i * rows) as u32,
                    height: (sums.len() / width) as u32,
                    ..window
                },
                kernel,
                sums,
                columns: Vec::new(),
            }
        };
        bands.map(band).collect()
    }

    /// The sums, row by row, which are zero from now on.
    pub fn take(&mut self) -> Vec<[f64; 3]> {
        let take = |sum: &mut [Fixed; 3]| {
            let value = sum.map(|c| c.value());
            *sum = [Fixed::ZERO; 3];
            value
        };
        self.sums.iter_mut().map(take).collect()
    }
}

impl SplatBand<'_> {
    /// Adds the splat to those pixels of the band that the reconstruction filter spreads it over. None for
    /// a splat that is not one of [`SplatBuffer::accepts`].
    pub fn add(&mut self, splat: &Splat) {
        let Splat { film, value } = *splat;
        let (window, kernel) = (self.window, self.kernel);
        let (y0, rows) = reached(film.y, kernel.radius, window.y, window.height);
        if rows == 0 || !kernel.accepts(value) {
            return;
        }
        let (x0, columns) = reached(film.x, kernel.radius, window.x, window.width);
        if columns == 0 {
            return;
        }
        let weight = |at: f32, pixel: u32| kernel.weight(at - (pixel as f32 + 0.5));
        self.columns.clear();
        self.columns
            .extend((x0..x0 + columns).map(|x| weight(film.x, x)));
        let factors = value.to_array().map(|v| Factor::new(v, kernel.exponent));
        for y in y0..y0 + rows {
            let of_row = weight(film.y, y) * 2f64.powi(kernel.exponent);
            let first = (y - window.y) as usize * window.width as usize + (x0 - window.x) as usize;
            let pixels = &mut self.sums[first..first + columns as usize];
            for (pixel, of_column) in pixels.iter_mut().zip(&self.columns) {
                // Halves away from zero, so that a splat and its negative cancel.
                let weight = of_row * of_column;
                let weight = (weight + 0.5f64.copysign(weight)) as i64;
                for (sum, factor) in pixel.iter_mut().zip(factors) {
                    sum.add(factor, weight);
                }
            }
        }
    }
}

/// First pixel along one axis, of `count` pixels from `first` on, whose filter reaches `x`, and the number
/// of those that do.
fn reached(x: f32, radius: f32, first: u32, count: u32) -> (u32, u32) {
    // Centres c with x - radius < c <= x + radius, so that boxes side by side share no point.
    let pixel = |x: f32| x.floor().clamp(-1e9, 1e10) as i64;
    let lo = pixel(x - radius - 0.5) + 1;
    let hi = pixel(x + radius - 0.5);
    let (first, end) = (i64::from(first), i64::from(first) + i64::from(count));
    let (lo, hi) = (lo.max(first), (hi + 1).min(end));
    (lo.max(0) as u32, (hi - lo).max(0) as u32)
}

/// The filter along one axis, normalised to integral 1.
#[derive(Clone, Copy, Debug)]
struct Kernel {
    filter: Filter,
    radius: f32,
    scale: f64,
    /// Weights of pixels count in units of two to the power of minus this: at most 2^30 of them.
    exponent: i32,
    /// Largest splat.
    largest: f32,
}

impl Kernel {
    fn new(filter: Filter) -> Kernel {
        let scale = 1.0 / filter.integral();
        let peak = (filter.peak() * scale).powi(2);
        Kernel {
            filter,
            radius: filter.radius(),
            scale,
            exponent: 30 - peak.log2().ceil() as i32,
            // More than 10^9 of them can meet in a pixel before its sum leaves the range of 2^103.
            largest: (2f64.powi(72) / peak.max(1.0)) as f32,
        }
    }

    fn accepts(&self, value: Rgb) -> bool {
        value.to_array().iter().all(|v| v.abs() <= self.largest)
    }

    #[inline]
    fn weight(&self, x: f32) -> f64 {
        match self.filter {
            // Which pixels a box reaches is decided already.
            Filter::Box { .. } => self.scale,
            _ => f64::from(self.filter.eval(x)) * self.scale,
        }
    }
}

/// The value of one channel of a splat, ready to be multiplied with weights.
#[derive(Clone, Copy, Debug)]
struct Factor {
    /// At most 2^24 from zero.
    significand: i64,
    /// Binary places from the unit of [`Fixed`] up to that of the product with a weight.
    shift: i32,
}

impl Factor {
    #[inline]
    fn new(v: f32, weight_exponent: i32) -> Factor {
        let bits = v.to_bits();
        let exponent = ((bits >> 23) & 0xff) as i32;
        let fraction = i64::from(bits & ((1 << 23) - 1));
        // Numbers too small for a leading one are lost anyway.
        let magnitude = if exponent == 0 { 0 } else { fraction | 1 << 23 };
        Factor {
            significand: if v < 0.0 { -magnitude } else { magnitude },
            shift: exponent - 150 + FRACTION_BITS - weight_exponent,
        }
    }
}

/// A signed number of 192 bits in units of 2^-88, in two's complement, least significant part first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Fixed([u64; 3]);

const FRACTION_BITS: i32 = 88;

impl Fixed {
    const ZERO: Fixed = Fixed([0; 3]);

    /// Adds the factor times `weight`, of at most 2^31, rounded to the nearest unit, halves away from zero.
    #[inline]
    fn add(&mut self, factor: Factor, weight: i64) {
        let product = factor.significand * weight;
        let [low, middle, high] = &mut self.0;
        match factor.shift {
            ..-62 => {}
            shift @ -62..64 => {
                let term = match shift {
                    0.. => i128::from(product) << shift,
                    _ => {
                        let half = 1u64 << (-shift - 1);
                        let magnitude = (product.unsigned_abs() + half) >> -shift;
                        i128::from(magnitude as i64) * i128::from(product.signum())
                    }
                };
                let sum = u128::from(*low) | u128::from(*middle) << 64;
                let (sum, carry) = sum.overflowing_add(term as u128);
                (*low, *middle) = (sum as u64, (sum >> 64) as u64);
                let extension = if term < 0 { u64::MAX } else { 0 };
                *high = high.wrapping_add(extension).wrapping_add(u64::from(carry));
            }
            shift => {
                let term = i128::from(product) << (shift - 64).min(127);
                let sum = u128::from(*middle) | u128::from(*high) << 64;
                let sum = sum.wrapping_add(term as u128);
                (*middle, *high) = (sum as u64, (sum >> 64) as u64);
            }
        }
    }

    fn value(self) -> f64 {
        let negative = (self.0[2] as i64) < 0;
        let mut magnitude = self.0;
        if negative {
            let mut carry = true;
            for part in &mut magnitude {
                (*part, carry) = (!*part).overflowing_add(u64::from(carry));
            }
        }
        let [low, middle, high] = magnitude.map(|part| part as f64);
        let unit = 2f64.powi(-FRACTION_BITS);
        let value = (high * 2f64.powi(128) + middle * 2f64.powi(64) + low) * unit;
        if negative { -value } else { value }
    }
}

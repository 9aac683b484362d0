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
/// light. Each such term is rounded to a multiple of 2^-88 (3e-27), so terms down to 1e-19 are kept to the 24
/// bits of an f32 and anything below 1e-27 is lost; sums are exact from there on.
#[derive(Clone, Debug)]
pub struct SplatBuffer {
    window: Window,
    kernel: Kernel,
    /// Per pixel, row by row, three channels.
    sums: Vec<[Fixed; 3]>,
}

/// Largest splat, 2^72: more than 10^9 of them can meet in a pixel before its sum leaves the range.
const LARGEST: f32 = (1u128 << 72) as f32;

/// What filters narrower than a tenth of a pixel could exceed with such splats.
const LARGEST_TERM: f64 = (1u128 << 80) as f64;

/// Part of the buffer: some rows of the window, which can be filled beside other parts.
#[derive(Debug)]
pub struct SplatBand<'a> {
    window: Window,
    kernel: Kernel,
    sums: &'a mut [[Fixed; 3]],
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

    /// Whether a splat of this value can be added: finite, and not above 2^72 (5e21).
    pub fn accepts(value: Rgb) -> bool {
        value.to_array().iter().all(|v| v.abs() <= LARGEST)
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

/// First pixel along one axis, of `window` pixels from `first` on, whose filter reaches `x`, and the number
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

impl SplatBand<'_> {
    /// Adds the splat to those pixels of the band that the reconstruction filter spreads it over. None for
    /// a splat that is not one of [`SplatBuffer::accepts`].
    pub fn add(&mut self, splat: &Splat) {
        let Splat { film, value } = *splat;
        let (window, kernel) = (self.window, self.kernel);
        let (y0, rows) = reached(film.y, kernel.radius, window.y, window.height);
        if rows == 0 || !SplatBuffer::accepts(value) {
            return;
        }
        let (x0, columns) = reached(film.x, kernel.radius, window.x, window.width);
        let value = value.to_array().map(f64::from);
        for y in y0..y0 + rows {
            let wy = kernel.weight(film.y - (y as f32 + 0.5));
            let row = (y - window.y) as usize * window.width as usize;
            for x in x0..x0 + columns {
                let weight = wy * kernel.weight(film.x - (x as f32 + 0.5));
                let sum = &mut self.sums[row + (x - window.x) as usize];
                for (sum, v) in sum.iter_mut().zip(value) {
                    sum.add(v * weight);
                }
            }
        }
    }
}

/// The filter along one axis, normalised to integral 1.
#[derive(Clone, Copy, Debug)]
struct Kernel {
    filter: Filter,
    radius: f32,
    scale: f64,
}

impl Kernel {
    fn new(filter: Filter) -> Kernel {
        Kernel {
            filter,
            radius: filter.radius(),
            scale: 1.0 / filter.integral(),
        }
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

/// A signed number of 192 bits in units of 2^-88, in two's complement, least significant part first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Fixed([u64; 3]);

const FRACTION_BITS: i32 = 88;

impl Fixed {
    const ZERO: Fixed = Fixed([0; 3]);

    /// Adds `v`, held within 2^80 of zero and rounded to the nearest unit, halves away from zero.
    #[inline]
    fn add(&mut self, v: f64) {
        let v = v.clamp(-LARGEST_TERM, LARGEST_TERM);
        let bits = v.to_bits();
        let exponent = ((bits >> 52) & 0x7ff) as i32;
        let significand = (bits & ((1 << 52) - 1)) | (1 << 52);
        // v is the significand times 2^(exponent - 1075).
        let shift = exponent - 1075 + FRACTION_BITS;
        let (place, wide) = match shift {
            ..-53 => return,
            -53..0 => {
                let half = 1u64 << (-shift - 1);
                (0, u128::from((significand + half) >> -shift))
            }
            _ => (shift / 64, u128::from(significand) << (shift % 64)),
        };
        let (low, high) = (wide as u64, (wide >> 64) as u64);
        let mut term = match place {
            0 => [low, high, 0],
            1 => [0, low, high],
            _ => [0, 0, low],
        };
        let mut carry = false;
        if v < 0.0 {
            // Minus a number is its complement plus one.
            term = term.map(|t| !t);
            carry = true;
        }
        for (sum, t) in self.0.iter_mut().zip(term) {
            let (s, first) = sum.overflowing_add(t);
            let (s, second) = s.overflowing_add(u64::from(carry));
            *sum = s;
            carry = first || second;
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

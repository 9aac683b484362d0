//! Reconstruction filters, importance sampled: a sample's position is drawn from the filter of the pixel
//! it belongs to, so every sample counts with the same weight (Ernst, Stamminger & Greiner 2006).

use crate::math::{Vec2, fp};

/// A separable reconstruction filter; lengths in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    Box {
        radius: f32,
    },
    Tent {
        radius: f32,
    },
    /// Gaussian of standard deviation `stddev`, cut at four of them and lowered to reach zero there.
    Gaussian {
        stddev: f32,
    },
    /// Mitchell & Netravali 1988, equation 8, of radius 2.
    Mitchell {
        b: f32,
        c: f32,
    },
    /// Windowed sinc with `lobes` zero crossings on either side.
    Lanczos {
        lobes: f32,
    },
}

impl Filter {
    pub fn radius(&self) -> f32 {
        match *self {
            Filter::Box { radius } | Filter::Tent { radius } => radius,
            Filter::Gaussian { stddev } => 4.0 * stddev,
            Filter::Mitchell { .. } => 2.0,
            Filter::Lanczos { lobes } => lobes,
        }
    }

    /// Integral of [`Filter::eval`] over its support, by the midpoint rule that the sampler is built on, in
    /// pixels. Above 0.
    pub fn integral(&self) -> f64 {
        if let Filter::Box { radius } = *self {
            return 2.0 * f64::from(radius);
        }
        let width = 2.0 * self.radius() / CELLS as f32;
        (0..CELLS).map(|i| self.at_cell(i)).sum::<f64>() * f64::from(width)
    }

    /// Largest magnitude of [`Filter::eval`].
    pub fn peak(&self) -> f64 {
        let cells = (0..CELLS).map(|i| self.at_cell(i).abs());
        cells.fold(f64::from(self.eval(0.0)).abs(), f64::max)
    }

    /// Value in the middle of cell `i`.
    fn at_cell(&self, i: usize) -> f64 {
        let width = 2.0 * self.radius() / CELLS as f32;
        f64::from(self.eval(-self.radius() + (i as f32 + 0.5) * width))
    }

    /// Value of the one-dimensional filter at distance `x`, not normalised.
    pub fn eval(&self, x: f32) -> f32 {
        let x = x.abs();
        if x > self.radius() {
            return 0.0;
        }
        match *self {
            Filter::Box { .. } => 1.0,
            Filter::Tent { radius } => (1.0 - x / radius).max(0.0),
            Filter::Gaussian { stddev } => {
                let g = |x: f32| (-0.5 * (x / stddev).powi(2)).exp();
                (g(x) - g(self.radius())).max(0.0)
            }
            Filter::Mitchell { b, c } => {
                let (x2, x3) = (x * x, x * x * x);
                let p = if x < 1.0 {
                    (12.0 - 9.0 * b - 6.0 * c) * x3
                        + (-18.0 + 12.0 * b + 6.0 * c) * x2
                        + (6.0 - 2.0 * b)
                } else {
                    (-b - 6.0 * c) * x3
                        + (6.0 * b + 30.0 * c) * x2
                        + (-12.0 * b - 48.0 * c) * x
                        + (8.0 * b + 24.0 * c)
                };
                p / 6.0
            }
            Filter::Lanczos { lobes } => {
                let sinc = |x: f32| if x < 1e-5 { 1.0 } else { x.sin() / x };
                sinc(std::f32::consts::PI * x) * sinc(std::f32::consts::PI * x / lobes)
            }
        }
    }
}

/// Cells of the tabulated inverse: fine enough that the piecewise constant density differs from the
/// filter by less than 1e-3 of its peak anywhere and by less than 1e-6 in its integral moments.
const CELLS: usize = 2048;

/// Draws positions from a filter.
#[derive(Clone, Debug)]
pub enum FilterSampler {
    /// Uniform over a square of this half-width.
    Box(f32),
    Tabulated(Box<Table>),
}

#[derive(Clone, Debug)]
pub struct Table {
    /// Cumulative sums of |f|, `CELLS + 1` of them from 0 to 1.
    cdf: Vec<f32>,
    /// Whether the filter is negative in a cell.
    negative: Vec<bool>,
    radius: f32,
    /// ∫|f| / ∫f: what a sample of a filter with negative lobes weighs.
    weight: f32,
}

impl FilterSampler {
    pub fn new(filter: &Filter) -> FilterSampler {
        if let Filter::Box { radius } = *filter {
            return FilterSampler::Box(radius);
        }
        let radius = filter.radius();
        let value = |i: usize| filter.at_cell(i);
        let absolute: f64 = (0..CELLS).map(|i| value(i).abs()).sum();
        let signed: f64 = (0..CELLS).map(value).sum();
        let mut sum = 0.0;
        let mut cdf = vec![0.0f32];
        for i in 0..CELLS {
            sum += value(i).abs() / absolute;
            cdf.push(sum as f32);
        }
        cdf[CELLS] = 1.0;
        let negative = (0..CELLS).map(|i| value(i) < 0.0).collect();
        FilterSampler::Tabulated(Box::new(Table {
            cdf,
            negative,
            radius,
            weight: (absolute / signed) as f32,
        }))
    }

    /// Offset from the pixel's centre and the weight of the sample: 1, or of either sign for a filter
    /// with negative lobes.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        match self {
            FilterSampler::Box(radius) => ((2.0 * u - 1.0) * *radius, 1.0),
            FilterSampler::Tabulated(table) => {
                let (x, wx) = table.sample(u.x);
                let (y, wy) = table.sample(u.y);
                (Vec2::new(x, y), wx * wy)
            }
        }
    }
}

impl Table {
    fn sample(&self, u: f32) -> (f32, f32) {
        let u = u.min(fp::ONE_MINUS_EPSILON);
        // Index of the last cell that begins at or before u; cells of no width are never chosen.
        let cell = self.cdf.partition_point(|c| *c <= u) - 1;
        let (lo, hi) = (self.cdf[cell], self.cdf[cell + 1]);
        let position = (cell as f32 + (u - lo) / (hi - lo)) * (2.0 / CELLS as f32) - 1.0;
        (
            position * self.radius,
            if self.negative[cell] {
                -self.weight
            } else {
                self.weight
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weighted_samples_have_the_moments_of_the_filter() {
        let filters = [
            Filter::Box { radius: 0.5 },
            Filter::Tent { radius: 1.0 },
            Filter::Gaussian { stddev: 0.5 },
            Filter::Mitchell {
                b: 1.0 / 3.0,
                c: 1.0 / 3.0,
            },
            Filter::Mitchell { b: 0.0, c: 0.5 },
            Filter::Lanczos { lobes: 3.0 },
        ];
        for filter in filters {
            let sampler = FilterSampler::new(&filter);
            let n = 100_000;
            let (mut moments, mut exact) = ([0.0f64; 3], [0.0f64; 3]);
            for i in 0..n {
                let u = (i as f32 + 0.5) / n as f32;
                let (p, w) = sampler.sample(Vec2::new(u, 0.5));
                let x = (2.0 * u - 1.0) * filter.radius();
                for k in 0..3 {
                    moments[k] += f64::from(w) * f64::from(p.x.powi(k as i32)) / n as f64;
                    exact[k] += f64::from(filter.eval(x)) * f64::from(x.powi(k as i32));
                }
            }
            // The weight of the fixed second number is a common factor.
            for k in [1, 2] {
                let (got, want) = (moments[k] / moments[0], exact[k] / exact[0]);
                assert!(
                    (got - want).abs() < 2e-4,
                    "{filter:?} moment {k}: {got} {want}"
                );
            }
        }
    }

    #[test]
    fn the_ends_of_the_unit_interval_stay_inside() {
        let sampler = FilterSampler::new(&Filter::Gaussian { stddev: 0.5 });
        for u in [0.0, fp::ONE_MINUS_EPSILON] {
            let (p, _) = sampler.sample(Vec2::splat(u));
            assert!(p.x.abs() <= 2.0 && p.is_finite(), "{p}");
        }
    }
}

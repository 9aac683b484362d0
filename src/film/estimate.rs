//! What the spread of the replicates says about the error of the picture.

use super::{Film, Sum, Tile};

/// The estimated error of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Mean over pixels and channels of variance / (mean² + 0.01).
    pub relmse: f64,
    /// Interval that holds the image's actual relMSE with 95 % confidence.
    pub ci95: [f64; 2],
}

/// Regularisation of relMSE: what keeps black pixels from counting infinitely.
pub const RELMSE_FLOOR: f64 = 0.01;

/// Two-sided 95 % quantile of Student's t with `dof` degrees of freedom: half-width of a pixel's
/// confidence interval in standard errors. Cornish-Fisher expansion (Abramowitz & Stegun 26.7.5), right
/// to 0.3 % from 3 degrees of freedom on, where it is used.
pub fn student_t_95(dof: u32) -> f64 {
    const EXACT: [f64; 3] = [12.706, 4.303, 3.182];
    if (1..=3).contains(&dof) {
        return EXACT[dof as usize - 1];
    }
    let (x, n) = (1.959_963_984_540_054_f64, f64::from(dof.max(1)));
    let g1 = (x.powi(3) + x) / 4.0;
    let g2 = (5.0 * x.powi(5) + 16.0 * x.powi(3) + 3.0 * x) / 96.0;
    let g3 = (3.0 * x.powi(7) + 19.0 * x.powi(5) + 17.0 * x.powi(3) - 15.0 * x) / 384.0;
    x + g1 / n + g2 / n.powi(2) + g3 / n.powi(3)
}

/// Spread of one channel of one pixel.
struct Spread {
    mean: f64,
    /// Variance of the mean.
    variance: f64,
    /// Estimated covariance of `variance` and `mean`: positive for a skewed estimator.
    covariance: f64,
}

impl Spread {
    /// This channel's share of relMSE, variance / (truth² + floor), with the truth unknown: dividing by
    /// the noisy mean is biased, and the second-order terms of its Taylor expansion take that bias off.
    /// Never negative.
    fn relative(&self) -> f64 {
        let d = self.mean * self.mean + RELMSE_FLOOR;
        let slope = -2.0 * self.mean / (d * d);
        let curvature = (6.0 * self.mean * self.mean - 2.0 * RELMSE_FLOOR) / d.powi(3);
        let bias = slope * self.covariance + 0.5 * curvature * self.variance.powi(2);
        // Where the correction is as large as what it corrects, the expansion says nothing any more.
        let plain = self.variance / d;
        (plain - bias).clamp(0.5 * plain, 2.0 * plain)
    }
}

impl Film {
    /// True when the replicates are enough to tell an error.
    pub fn has_error(&self) -> bool {
        !self.tiles.is_empty() && self.tiles.iter().all(Tile::has_error)
    }

    /// Degrees of freedom of a pixel's standard error.
    pub fn freedom(&self) -> u32 {
        match self.tiles.first().map(|tile| &tile.taken) {
            // Each half has a mean of its own.
            Some(super::Taken::Halves(_)) => self.replicates.saturating_sub(2),
            _ => self.replicates.saturating_sub(1),
        }
    }

    /// The standard error of every pixel, row by row: the square root of the variance of its mean.
    /// Zero when [`Film::has_error`] is false.
    pub fn standard_error(&self) -> Vec<[f64; 3]> {
        self.gather(|tile, i| {
            std::array::from_fn(|c| tile.spread(i, c).map_or(0.0, |s| s.variance.sqrt()))
        })
    }

    /// The estimated relMSE of the picture. `None` when there is no telling yet.
    pub fn estimate_error(&self) -> Option<ErrorEstimate> {
        if !self.has_error() {
            return None;
        }
        let (mut relmse, mut variance, mut count) = (0.0, 0.0, 0.0);
        for tile in &self.tiles {
            let error = tile.error();
            relmse += error.relative;
            variance += error.variance;
            count += error.count;
        }
        let (relmse, half) = (relmse / count, 1.96 * variance.max(0.0).sqrt() / count);
        Some(ErrorEstimate {
            relmse,
            ci95: [(relmse - half).max(0.0), relmse + half],
        })
    }
}

/// Sums over the pixels and channels of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub struct TileError {
    /// Of variance / (mean² + 0.01).
    pub relative: f64,
    /// Of the variance of its distance to the actual one.
    pub variance: f64,
    pub count: f64,
}

impl Tile {
    fn has_error(&self) -> bool {
        let r = self.replicates as usize;
        let least = match self.taken {
            super::Taken::Range(_) => 2,
            super::Taken::Halves(_) => 4,
        };
        r >= least && (0..r).all(|i| self.taken.of_replicate(i, r) > 0)
    }

    /// What the replicates say of the error; zero where they are too few.
    pub fn error(&self) -> TileError {
        let mut sum = TileError::default();
        if !self.has_error() {
            return sum;
        }
        for i in 0..(self.width * self.height) as usize {
            let spreads: [Spread; 3] = std::array::from_fn(|c| self.spread_over(i, c, 0, 1));
            let weights = spreads
                .each_ref()
                .map(|s| 1.0 / (s.mean * s.mean + RELMSE_FLOOR));
            for (c, s) in spreads.iter().enumerate() {
                sum.relative += s.relative();
                sum.count += 1.0;
                for d in 0..3 {
                    sum.variance += weights[c] * weights[d] * self.scatter(i, [c, d], &spreads);
                }
            }
        }
        sum
    }

    /// The same of one half of the samples alone ([`super::Taken::Halves`]): the variance of its mean.
    pub fn error_of_half(&self, half: usize) -> TileError {
        let mut sum = TileError::default();
        for i in 0..(self.width * self.height) as usize {
            for c in 0..3 {
                let s = self.spread_over(i, c, half, 2);
                sum.relative += s.relative();
                sum.count += 1.0;
            }
        }
        sum
    }

    /// Relative standard errors of its pixels, √ of the mean over the channels of variance / (mean² + 0.01), by one
    /// half of the samples; by both where `half` is `None`.
    pub fn pixel_errors(&self, half: Option<usize>) -> Vec<f64> {
        let of = |i: usize| {
            let channel = |c: usize| {
                let s = match half {
                    Some(half) => Some(self.spread_over(i, c, half, 2)),
                    None => self.spread(i, c),
                };
                s.map_or(0.0, |s| s.relative())
            };
            ((channel(0) + channel(1) + channel(2)) / 3.0).sqrt()
        };
        (0..(self.width * self.height) as usize).map(of).collect()
    }

    /// Of channel `c` of pixel `i`.
    fn spread(&self, i: usize, c: usize) -> Option<Spread> {
        if !self.has_error() {
            return None;
        }
        Some(self.spread_over(i, c, 0, 1))
    }

    /// Covariance, over channels `c` and `d` of a pixel, of how far the estimated variance of the mean V is from the
    /// squared error e² that this one picture happens to have.
    ///
    /// With R replicates of covariance Σ and fourth cumulant κ, cov(V_c, V_d) = (κ / R + 2 Σ² / (R - 1)) / R²,
    /// cov(e_c², e_d²) = κ / R³ + 2 Σ² / R², and cov(V_c, e_d²) = κ / R³: the cumulants cancel, and what is left is
    /// 2 (Σ / R)² R / (R - 1), whatever the noise is distributed like. Channels of one pixel go nearly together, so that
    /// what is between them counts as much as they do.
    fn scatter(&self, pixel: usize, [c, d]: [usize; 2], spreads: &[Spread; 3]) -> f64 {
        let all = self.replicates as usize;
        let dof = match self.taken {
            super::Taken::Range(_) => all - 1,
            super::Taken::Halves(_) => all - 2,
        } as f64;
        let product = spreads[c].variance * spreads[d].variance;
        let square = if c == d || all < 4 {
            // Of so few replicates nothing tells how far channels go together: all the way at worst. The square of a
            // variance of `dof` degrees of freedom is 1 + 2 / dof times too large in the mean.
            product * dof / (dof + 2.0)
        } else {
            // Σ² without bias from the sample's covariances S: with normal noise, E S_cd² = Σ_cd² (1 + 1/dof) +
            // Σ_cc Σ_dd / dof and E S_cc S_dd = Σ_cc Σ_dd + 2 Σ_cd² / dof (Wishart's moments).
            let square = self.covariance(pixel, [c, d], spreads).powi(2);
            (square - product / dof) * dof * dof / ((dof + 2.0) * (dof - 1.0))
        };
        2.0 * square * (dof + 1.0) / dof
    }

    /// Of the means of two channels of a pixel, on the scale of [`Spread::variance`].
    fn covariance(&self, pixel: usize, [c, d]: [usize; 2], spreads: &[Spread; 3]) -> f64 {
        let all = self.replicates as usize;
        let sums = &self.rgb[pixel * all..(pixel + 1) * all];
        let (mut both, mut own) = (0.0, 0.0);
        for (i, sums) in sums.iter().enumerate() {
            let n_r = self.taken.of_replicate(i, all) as f64;
            let of = |c: usize| sums[c].value() / n_r - spreads[c].mean;
            both += n_r * of(c) * of(d);
            own += n_r * of(c) * of(c);
        }
        // As the variance is scaled from the sum of squares.
        if own > 0.0 {
            both / own * spreads[c].variance
        } else {
            0.0
        }
    }

    /// By the replicates `first`, `first + step` and so on. A replicate of n_r of the n samples has the variance
    /// σ²/n_r, so Σ n_r (m_r - m)² / (R - 1) estimates σ², and σ²/n is the variance of the mean.
    fn spread_over(&self, pixel: usize, c: usize, first: usize, step: usize) -> Spread {
        let all = self.replicates as usize;
        let sums = &self.rgb[pixel * all..(pixel + 1) * all];
        let numbers = || (first..all).step_by(step);
        let n_of = |i: usize| self.taken.of_replicate(i, all) as f64;
        let r = numbers().count() as f64;
        let (mut n, mut sum) = (0.0, Sum::ZERO);
        for i in numbers() {
            n += n_of(i);
            sum += sums[i][c];
        }
        let mut mean = sum.value() / n;
        if let (super::Taken::Halves([even, odd]), 1) = (&self.taken, step) {
            // The mean of both halves' means: its variance is σ² (1/n_0 + 1/n_1) / 4.
            mean = self.taken.mean(|i| sums[i][c], all);
            n = 4.0 / (1.0 / *even as f64 + 1.0 / *odd as f64);
        }
        let (mut second, mut third) = (0.0, 0.0);
        for i in numbers() {
            let n_r = n_of(i);
            let d = n_r.sqrt() * (sums[i][c].value() / n_r - mean);
            second += d * d;
            third += d * d * d;
        }
        let sigma2 = second / (r - 1.0);
        let mut variance = sigma2 / n;
        if let (super::Taken::Halves(counts), 1) = (&self.taken, step) {
            // How many samples a half has was decided by what the other showed: a half that shows less noise than there
            // is leaves the other with few samples. Its own spread knows nothing of that.
            let of = |half: usize| self.spread_over(pixel, c, half, 2).variance;
            debug_assert!(counts.iter().all(|n| *n > 0));
            variance = 0.25 * (of(0) + of(1));
        }
        // Third central moment of the mean over n, from that of the replicates scaled by sqrt(n/r).
        let third = if r > 2.0 {
            third * r / ((r - 1.0) * (r - 2.0))
        } else {
            0.0
        };
        let covariance = third / (r.sqrt() * n.powf(1.5));
        Spread {
            mean,
            variance,
            covariance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Window;
    use super::*;
    use crate::math::Rgb;
    use crate::sampler::{Sampler, SamplerKind};

    fn film_of_noise(seed: u64, spp: u64) -> Film {
        let window = Window {
            x: 0,
            y: 0,
            width: 40,
            height: 25,
        };
        let mut film = Film::new(window, super::super::replicates(Some(spp), 1000), 0);
        for tile in film.tiles_mut() {
            for y in 0..tile.height {
                for x in 0..tile.width {
                    let pixel = u64::from((tile.y + y) * 40 + tile.x + x);
                    for s in 0..spp {
                        let u = Sampler::new(SamplerKind::Independent, seed, pixel, s, 1).get4(0);
                        tile.add(x, y, s, Rgb::new(u[0], 2.0 * u[1], u[2] * u[2]));
                    }
                }
            }
        }
        film.finish_pass(spp);
        film
    }

    #[test]
    fn intervals_cover_the_truth_as_often_as_they_say() {
        // Also with unequal replicates (50 = 16 * 3 + 2).
        for spp in [50, 64] {
            let film = film_of_noise(5, spp);
            let t = student_t_95(film.replicates() - 1);
            let truth = [0.5, 1.0, 1.0 / 3.0];
            let (mean, stderr) = (film.mean(), film.standard_error());
            let covered = mean
                .iter()
                .zip(&stderr)
                .flat_map(|(m, s)| (0..3).map(move |c| (m[c] - truth[c]).abs() < t * s[c]))
                .filter(|inside| *inside)
                .count();
            // 3000 independent intervals: 95 % with a standard deviation of 0.4 %.
            assert!((2800..=2900).contains(&covered), "{covered} of 3000");
        }
    }

    #[test]
    fn estimated_relmse_interval_holds_the_actual_one() {
        let truth = [0.5, 1.0, 1.0 / 3.0];
        let inside = |seed: &u64| {
            let film = film_of_noise(*seed, 32);
            let sum: f64 = film
                .mean()
                .iter()
                .flat_map(|m| {
                    (0..3).map(move |c| {
                        (m[c] - truth[c]).powi(2) / (truth[c] * truth[c] + RELMSE_FLOOR)
                    })
                })
                .sum();
            let actual = sum / 3000.0;
            let estimate = film.estimate_error().unwrap();
            estimate.ci95[0] <= actual && actual <= estimate.ci95[1]
        };
        let hits = (0..100).filter(inside).count();
        // Binomial(100, 0.95): outside 88..=100 with probability 0.4 %.
        assert!(hits >= 88, "{hits} of 100");
    }

    #[test]
    fn a_constant_picture_has_no_error() {
        let mut film = Film::new(
            Window {
                x: 0,
                y: 0,
                width: 3,
                height: 2,
            },
            16,
            0,
        );
        for tile in film.tiles_mut() {
            for s in 0..32 {
                for x in 0..3 {
                    for y in 0..2 {
                        tile.add(x, y, s, Rgb::splat(0.25));
                    }
                }
            }
        }
        film.finish_pass(32);
        assert_eq!(film.estimate_error().unwrap().relmse, 0.0);
        assert!(film.mean().iter().all(|m| *m == [0.25; 3]));
    }

    #[test]
    fn student_quantiles_match_the_tables() {
        for (dof, t) in [
            (3, 3.182),
            (4, 2.776),
            (7, 2.365),
            (15, 2.131),
            (100, 1.984),
        ] {
            assert!((student_t_95(dof) - t).abs() < 0.003 * t, "{dof}");
        }
    }
}

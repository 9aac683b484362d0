//! What several independent runs say about a method: its error, and bias and variance apart.
//!
//! All of it follows from the products `g_ij = Σ w (a_i - r)(a_j - r) / Σ 1` over pixels and channels of
//! the runs' pictures a_i and the reference r. With r = truth + ε, of known variance v,
//! - `g_ii` has the mean (error of one picture)² + Σ w v,
//! - `g_ij`, i ≠ j, has the mean bias² + Σ w v, since the noise of two runs is independent,
//!
//! so the mean of all `g_ij`, i ≠ j, less Σ w v estimates bias² without the noise that a squared mean
//! would carry. It is a U-statistic of order two (Hoeffding 1948) and may come out below zero.

use rayon::prelude::*;

use super::Picture;
use crate::film::student_t_95;
use crate::math::Rgb;

/// What keeps relative errors finite in black pixels; the same as in `metrics`.
const FLOOR: f64 = 0.01;

/// Relative errors below this are the rounding of pictures kept in 32 bits (2^-24 each), and count as none.
const ROUNDING: f64 = 3e-7;

/// A number with its standard deviation and 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub value: f64,
    pub sd: f64,
    pub low: f64,
    pub high: f64,
}

impl Estimate {
    /// `factor` standard deviations to either side.
    pub fn new(value: f64, sd: f64, factor: f64) -> Estimate {
        Estimate {
            value,
            sd,
            low: value - factor * sd,
            high: value + factor * sd,
        }
    }

    /// Without doubt.
    pub fn exact(value: f64) -> Estimate {
        Estimate::new(value, 0.0, 0.0)
    }

    /// The mean of independent numbers, with Student's t. One number has no interval of its own and is
    /// given one of width zero.
    pub fn mean_of(values: &[f64]) -> Estimate {
        let n = values.len();
        let mean = values.iter().sum::<f64>() / n.max(1) as f64;
        if n < 2 {
            return Estimate::exact(mean);
        }
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let sd = (squares / (n * (n - 1)) as f64).sqrt();
        Estimate::new(mean, sd, student_t_95(n as u32 - 1))
    }

    /// The mean of independent numbers that are not below zero, such as squared errors. A few of their pixels often
    /// make up most of them, and a low mean comes with a low spread then, so that Student's t alone holds too seldom
    /// (of 8 exponential numbers 90 %, of gamma-distributed ones of shape 1/2 84 %). The ends are those of the
    /// logarithm (95 % and 92 %), which are the same where the spread is small.
    pub fn mean_of_squares(values: &[f64]) -> Estimate {
        Estimate::mean_of(values).skewed()
    }

    /// With the ends that the interval of the logarithm would have.
    fn skewed(self) -> Estimate {
        if self.value <= 0.0 {
            return self;
        }
        // Beyond e^20 nothing is known.
        let ratio = ((self.high - self.value) / self.value).min(20.0);
        Estimate {
            high: self.value * ratio.exp(),
            ..self.above_zero()
        }
    }

    /// Of what is above zero by its nature: with the lower end that the interval of the logarithm would have.
    pub fn above_zero(self) -> Estimate {
        let low = match self.value > 0.0 {
            true => self.value * ((self.low - self.value) / self.value).exp(),
            false => self.low.max(0.0),
        };
        Estimate { low, ..self }
    }

    /// Of what is not below zero by its nature, though differences that estimate it may come out so.
    fn not_below_zero(self) -> Estimate {
        Estimate {
            value: self.value.max(0.0),
            low: self.low.max(0.0),
            high: self.high.max(0.0),
            ..self
        }
    }

    /// The square root, of what is below zero: zero. An estimate that may be zero is not said to be below what its
    /// standard deviation allows, even if it came out far below zero: that is chance, and no proof of a small root.
    pub fn root(self) -> Estimate {
        let value = self.value.max(0.0).sqrt();
        let by_chance = if self.low <= 0.0 { 1.96 * self.sd } else { 0.0 };
        Estimate {
            value,
            // Half the relative deviation, as for any square root; where the value is within its noise of
            // zero this says nothing, and the interval is what counts.
            sd: if value > 0.0 {
                self.sd / (2.0 * value)
            } else {
                0.0
            },
            low: self.low.max(0.0).sqrt(),
            high: self.high.max(by_chance).max(0.0).sqrt(),
        }
    }
}

/// What runs are judged by.
#[derive(Clone, Debug)]
pub struct Reference {
    pub picture: Picture,
    /// Variance of every pixel and channel, where it is known; else the reference counts as exact.
    pub variance: Option<Vec<Rgb>>,
}

/// How errors of pixels are weighed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighing {
    /// All alike: squares of radiance, as in RMSE.
    Absolute,
    /// By 1 / (r² + 0.01), as in relMSE.
    Relative,
}

impl Weighing {
    /// Weight by a reference of value `r` and variance `v`. Weights of noisy references are too large in the mean by
    /// half their curvature times v, or too small in the dark, which is taken off as far as it is small itself.
    fn weight(self, r: f64, v: f64) -> f64 {
        match self {
            Weighing::Absolute => 1.0,
            Weighing::Relative => {
                let plain = 1.0 / (r * r + FLOOR);
                (plain - 0.5 * v * curvature(r)).clamp(0.5 * plain, 2.0 * plain)
            }
        }
    }

    /// What the reference's noise of variance `v` adds to a weighed squared difference: with ε normal, the mean of
    /// weight(t + ε) ε² is w v + w'' v², w being the weight of the truth.
    fn added(self, r: f64, v: f64) -> f64 {
        let weight = self.weight(r, v);
        match self {
            Weighing::Absolute => v,
            Weighing::Relative => {
                (weight * v + curvature(r) * v * v).clamp(0.5 * weight * v, 2.0 * weight * v)
            }
        }
    }
}

/// Second derivative of 1 / (r² + 0.01).
fn curvature(r: f64) -> f64 {
    (6.0 * r * r - 2.0 * FLOOR) / (r * r + FLOOR).powi(3)
}

impl Reference {
    /// A picture that counts as exact.
    pub fn exact(picture: Picture) -> Reference {
        Reference {
            picture,
            variance: None,
        }
    }

    /// Value and variance of a channel of a pixel.
    fn at(&self, i: usize, c: usize) -> [f64; 2] {
        let v = self.variance.as_ref().map_or(0.0, |v| f64::from(v[i][c]));
        [f64::from(self.picture.pixels[i][c]), v]
    }

    /// Mean over pixels and channels of the weighed variance: what the reference adds to squared errors.
    pub fn error(&self, weighing: Weighing) -> f64 {
        if self.variance.is_none() {
            return 0.0;
        }
        let pixels = self.picture.pixels.len();
        let added = |i: usize, c: usize| {
            let [r, v] = self.at(i, c);
            weighing.added(r, v)
        };
        let sum: f64 = (0..pixels)
            .map(|i| (0..3).map(|c| added(i, c)).sum::<f64>())
            .sum();
        sum / (3 * pixels.max(1)) as f64
    }

    /// Standard deviation that the noise of the reference gives to the mean of squared differences of
    /// `picture`: Σ w (b - ε)² varies by 2 Σ w b ε and by Σ w ε² (variance 2 v² of a normal ε). Pixels
    /// are independent of each other; the channels of one go together at worst.
    fn doubt(&self, picture: &[[f64; 3]], weighing: Weighing) -> f64 {
        let Some(variance) = &self.variance else {
            return 0.0;
        };
        let mut sum = 0.0;
        for ((r, v), a) in self.picture.pixels.iter().zip(variance).zip(picture) {
            let (mut linear, mut square) = (0.0, 0.0);
            for c in 0..3 {
                let (r, v) = (f64::from(r[c]), f64::from(v[c]));
                let w = weighing.weight(r, v);
                linear += 2.0 * w * (a[c] - r).abs() * v.sqrt();
                square += w * v;
            }
            sum += linear * linear + 2.0 * square * square;
        }
        sum.sqrt() / (3 * variance.len().max(1)) as f64
    }
}

/// Products of the runs' differences from the reference; see the head of this module.
#[derive(Clone, Debug)]
pub struct Gram {
    runs: usize,
    products: Vec<f64>,
}

impl Gram {
    pub fn of(pictures: &[Picture], reference: &Reference, weighing: Weighing) -> Gram {
        const CHUNK: usize = 4096;
        let n = pictures.len();
        let pixels = reference.picture.pixels.len();
        let chunk = |k: usize| {
            let range = k * CHUNK..((k + 1) * CHUNK).min(pixels);
            let mut sums = vec![0.0; n * n];
            let mut differences = vec![0.0; n];
            for i in range {
                for c in 0..3 {
                    let [r, v] = reference.at(i, c);
                    let w = weighing.weight(r, v);
                    for (d, p) in differences.iter_mut().zip(pictures) {
                        *d = f64::from(p.pixels[i][c]) - r;
                    }
                    for (a, row) in differences.iter().zip(sums.chunks_exact_mut(n)) {
                        for (b, sum) in differences.iter().zip(row) {
                            *sum += w * a * b;
                        }
                    }
                }
            }
            sums
        };
        // Collected in order, so that the sum does not depend on threads.
        let chunks: Vec<Vec<f64>> = (0..pixels.div_ceil(CHUNK))
            .into_par_iter()
            .map(chunk)
            .collect();
        let mut products = vec![0.0; n * n];
        for sums in &chunks {
            products.iter_mut().zip(sums).for_each(|(p, s)| *p += s);
        }
        let count = (3 * pixels).max(1) as f64;
        products.iter_mut().for_each(|p| *p /= count);
        Gram { runs: n, products }
    }

    pub fn runs(&self) -> usize {
        self.runs
    }

    fn get(&self, i: usize, j: usize) -> f64 {
        self.products[i * self.runs + j]
    }

    /// Mean squared difference of each run.
    pub fn squares(&self) -> Vec<f64> {
        (0..self.runs).map(|i| self.get(i, i)).collect()
    }

    /// Σ_{j≠i} g_ij for each run i.
    fn sums_with_others(&self) -> Vec<f64> {
        let row = |i: usize| {
            (0..self.runs)
                .filter(|j| *j != i)
                .map(|j| self.get(i, j))
                .sum()
        };
        (0..self.runs).map(row).collect()
    }
}

/// Error, bias and variance of a method at one setting, all as means over pixels and channels of squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Of one run's picture; the reference's own error is taken off.
    pub mse: Estimate,
    pub bias2: Estimate,
    /// Of one run's picture about the mean of all.
    pub variance: Estimate,
}

impl Moments {
    /// From one run or more; fewer than three do not tell bias from noise: then both are zero with an interval that
    /// reaches to the upper end of the error, and one run's error has no upper end. `mean` is the mean of the runs'
    /// pictures.
    pub fn of(
        gram: &Gram,
        reference: &Reference,
        mean: &[[f64; 3]],
        weighing: Weighing,
    ) -> Moments {
        let own = reference.error(weighing);
        Moments::from_gram(gram, own, reference.doubt(mean, weighing))
    }

    /// Of one or two runs.
    fn of_few(squares: Estimate, own: f64) -> Moments {
        let high = match squares.sd > 0.0 {
            true => squares.high,
            false => f64::INFINITY,
        };
        let from_zero = |value: f64| Estimate {
            value,
            sd: squares.sd,
            low: 0.0,
            high,
        };
        Moments {
            mse: from_zero(squares.value - own),
            bias2: from_zero(0.0),
            variance: from_zero(0.0),
        }
    }

    /// `own` is the reference's mean squared error, `doubt` the standard deviation it leaves.
    fn from_gram(gram: &Gram, own: f64, doubt: f64) -> Moments {
        let n = gram.runs as f64;
        let t = student_t_95((gram.runs as u32).saturating_sub(1));
        let squares = Estimate::mean_of_squares(&gram.squares());
        if squares.value <= ROUNDING * ROUNDING {
            let zero = Estimate::exact(0.0);
            return Moments {
                mse: zero,
                bias2: zero,
                variance: zero,
            };
        }
        if gram.runs < 3 {
            return Moments::of_few(squares, own);
        }
        let sums = gram.sums_with_others();
        let total: f64 = sums.iter().sum();
        let between = total / (n * (n - 1.0));
        // Taken off, with its doubt.
        let with_reference = |e: Estimate| Estimate {
            value: e.value - own,
            sd: e.sd.hypot(doubt),
            low: e.value - own - (e.value - e.low).hypot(1.96 * doubt),
            high: e.value - own + (e.high - e.value).hypot(1.96 * doubt),
        };
        // The jackknife: both figures again without each run in turn.
        let (mut jack_bias, mut jack_variance) = (0.0, 0.0);
        for (i, sum) in sums.iter().enumerate() {
            let without = (total - 2.0 * sum) / ((n - 1.0) * (n - 2.0));
            let square = (squares.value * n - gram.get(i, i)) / (n - 1.0);
            jack_bias += (without - between).powi(2);
            // Means of the figures without one run are the figures themselves, for both.
            jack_variance += ((square - without) - (squares.value - between)).powi(2);
        }
        let jack = (n - 1.0) / n;
        let of_bias = corrected(gram, &sums, between, jack * jack_bias);
        let variance_sd = (jack * jack_variance).sqrt();
        let variance = Estimate::new(squares.value - between, variance_sd, t);
        Moments {
            mse: with_reference(squares).not_below_zero(),
            bias2: with_reference(Estimate::new(between, of_bias.sqrt(), t)),
            variance: variance.skewed(),
        }
    }
}

/// The jackknife counts the part of the variance that belongs to pairs, not to single runs, about twice
/// (Efron & Stein 1981, section 2). For 4 runs or more, that part shows in what is left of g_ij when the
/// effects of i and of j are taken away; the surplus is taken off.
fn corrected(gram: &Gram, sums: &[f64], mean: f64, jackknife: f64) -> f64 {
    let n = gram.runs;
    if n < 4 {
        return jackknife;
    }
    let nf = n as f64;
    // Least squares fit of g_ij = mean + e_i + e_j over i ≠ j.
    let effect: Vec<f64> = sums
        .iter()
        .map(|s| (s - (nf - 1.0) * mean) / (nf - 2.0))
        .collect();
    let mut left = 0.0;
    for i in 0..n {
        for j in 0..i {
            left += (gram.get(i, j) - mean - effect[i] - effect[j]).powi(2);
        }
    }
    let of_pairs = left / (nf * (nf - 3.0) / 2.0);
    let surplus = 2.0 * of_pairs / ((nf - 1.0) * (nf - 2.0));
    (jackknife - surplus).max(2.0 * of_pairs / (nf * (nf - 1.0)))
}

/// The mean of pictures of one size.
pub fn mean_picture(pictures: &[Picture]) -> Vec<[f64; 3]> {
    let pixels = pictures.first().map_or(0, |p| p.pixels.len());
    let n = pictures.len().max(1) as f64;
    let mean = |i: usize| {
        let sum = |c: usize| {
            pictures
                .iter()
                .map(|p| f64::from(p.pixels[i][c]))
                .sum::<f64>()
        };
        std::array::from_fn(|c| sum(c) / n)
    };
    (0..pixels).map(mean).collect()
}

/// The mean over all pixels of the runs' pictures, relative to that of the reference, less 1: how much
/// too bright they are. `None` where the reference is black.
pub fn brightness(pictures: &[Picture], reference: &Reference) -> Option<Estimate> {
    let total = |pixels: &[Rgb]| pixels.iter().map(|p| f64::from(p.luminance())).sum::<f64>();
    let truth = total(&reference.picture.pixels);
    if truth <= 0.0 {
        return None;
    }
    let ratios: Vec<f64> = pictures
        .iter()
        .map(|p| total(&p.pixels) / truth - 1.0)
        .collect();
    let of_runs = Estimate::mean_of(&ratios);
    let doubt = reference.variance.as_ref().map_or(0.0, |variance| {
        // Channels that go together: the deviation of the luminance is that of the deviations.
        let deviation = |v: &Rgb| f64::from(v.map(|x| x.max(0.0).sqrt()).luminance());
        variance
            .iter()
            .map(|v| deviation(v).powi(2))
            .sum::<f64>()
            .sqrt()
            / truth
    });
    let half = (of_runs.high - of_runs.value).hypot(1.96 * doubt);
    Some(Estimate {
        value: of_runs.value,
        sd: of_runs.sd.hypot(doubt),
        low: of_runs.value - half,
        high: of_runs.value + half,
    })
}

#[cfg(test)]
mod tests;

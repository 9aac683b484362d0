//! How error goes with samples: slopes in log-log plots with their intervals, where bias takes over, and
//! how many samples and seconds a wanted error takes.

use std::fmt;

use super::statistics::Estimate;

/// One setting of a method, as the fits see it. Errors are relative: roots of relMSE and of its parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitPoint {
    /// Mean samples per pixel, above 0.
    pub spp: f64,
    /// Mean seconds of a run.
    pub seconds: f64,
    pub runs: usize,
    /// Squares, of one run's picture.
    pub mse: Estimate,
    pub bias2: Estimate,
    pub variance: Estimate,
}

/// A straight line through logarithms: ln y = `at_center` + `slope` (ln x - `center`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    pub slope: Estimate,
    pub at_center: Estimate,
    pub center: f64,
}

impl Line {
    /// The y for x, both on their own scales.
    pub fn at(&self, x: f64) -> f64 {
        (self.at_center.value + self.slope.value * (x.ln() - self.center)).exp()
    }

    /// The x where the line passes y, with an interval by first-order propagation; `None` where the
    /// slope may be zero or has the wrong sign.
    fn where_it_falls_to(&self, y: f64) -> Option<Estimate> {
        let slope = self.slope;
        if slope.high >= 0.0 || y.is_nan() || y <= 0.0 {
            return None;
        }
        let u = (y.ln() - self.at_center.value) / slope.value;
        let factor = (slope.high - slope.value) / slope.sd.max(f64::MIN_POSITIVE);
        // center and slope are independent by the choice of the center.
        let sd = self.at_center.sd.hypot(u * slope.sd) / slope.value.abs();
        let half = factor.min(13.0) * sd;
        let at = |d: f64| (self.center + u + d).exp();
        let found = Estimate {
            value: at(0.0),
            sd: sd * at(0.0),
            low: at(-half),
            high: at(half),
        };
        (found.value.is_finite() && found.low > 0.0).then_some(found)
    }
}

/// Weighted least squares of ln sqrt(square) on ln x, through (x, square) with the square's own standard
/// deviation. Points whose square is not above zero cannot be drawn in a log-log plot and are left out.
/// Deviations are smoothed between the points, since each is from few runs: a relative deviation of s at
/// one point counts as the root of the mean of its own s² and that of all points. Where the points scatter about the line
/// more than their deviations explain, the interval is widened by as much. `None` for fewer than two
/// points of different x.
pub fn line(points: impl Iterator<Item = (f64, Estimate, usize)>) -> Option<Line> {
    let usable: Vec<_> = points
        .filter(|(x, y, _)| {
            let finite = x.is_finite() && y.value.is_finite() && y.sd.is_finite();
            finite && *x > 0.0 && y.value > 0.0
        })
        .collect();
    let n = usable.len();
    if usable.iter().all(|(x, ..)| *x == usable[0].0) {
        return None;
    }
    // Deviation of ln sqrt(y).
    let own: Vec<f64> = usable
        .iter()
        .map(|(_, y, _)| (y.sd / (2.0 * y.value)).powi(2))
        .collect();
    let pooled = own.iter().sum::<f64>() / n as f64;
    // Where nothing varies, all points count alike.
    let least = f64::EPSILON * f64::EPSILON;
    let weights: Vec<f64> = own
        .iter()
        .map(|s| 1.0 / (0.5 * (s + pooled)).max(least))
        .collect();
    let all: f64 = weights.iter().sum();
    let xs: Vec<f64> = usable.iter().map(|(x, ..)| x.ln()).collect();
    let ys: Vec<f64> = usable.iter().map(|(_, y, _)| 0.5 * y.value.ln()).collect();
    let mean = |v: &[f64]| v.iter().zip(&weights).map(|(v, w)| v * w).sum::<f64>() / all;
    let (center, height) = (mean(&xs), mean(&ys));
    let (mut sxx, mut sxy) = (0.0, 0.0);
    for ((x, y), w) in xs.iter().zip(&ys).zip(&weights) {
        sxx += w * (x - center).powi(2);
        sxy += w * (x - center) * (y - height);
    }
    if sxx <= 0.0 {
        return None;
    }
    let slope = sxy / sxx;
    let misfit =
        |((x, y), w): ((&f64, &f64), &f64)| w * (y - height - slope * (x - center)).powi(2);
    let chi2: f64 = xs.iter().zip(&ys).zip(&weights).map(misfit).sum();
    let runs_dof: usize = usable.iter().map(|(.., runs)| runs.saturating_sub(1)).sum();
    let (scale, dof) = match n {
        2 => (1.0, runs_dof),
        _ if chi2 > (n - 2) as f64 => (chi2 / (n - 2) as f64, n - 2),
        _ => (1.0, runs_dof),
    };
    // Numbers that are too far apart for f64 have no line.
    let figures = [slope, height, center, scale / sxx, scale / all];
    if figures.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let t = crate::film::student_t_95(dof.clamp(1, 100_000) as u32);
    Some(Line {
        slope: Estimate::new(slope, (scale / sxx).sqrt(), t),
        at_center: Estimate::new(height, (scale / all).sqrt(), t),
        center,
    })
}

/// What is known of the bias of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bias {
    /// Within its interval of zero at the largest setting; this much is the end of the interval.
    NotSeen { below: f64 },
    /// Seen, and falling with the number of samples along the line.
    Falls { last: Estimate, line: Line },
    /// Seen at the largest setting and not falling. From `floor_spp` samples on, where known, it makes up more
    /// of the error than noise does.
    Stays {
        last: Estimate,
        floor_spp: Option<f64>,
    },
}

/// How many samples and seconds bring the error down to one that is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Forecast {
    /// No error at any setting.
    Exact,
    Reached {
        spp: Estimate,
        seconds: Estimate,
    },
    /// The bias that stays, this much, is more.
    NeverBelow(f64),
    /// Too little is known.
    Unknown(Doubt),
}

/// Why there is no forecast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// Error is not known to fall, or the settings are too few to say.
    Slope,
    /// Error falls, but the interval of its slope is so wide that what it says beyond the settings is worth nothing.
    WideSlope,
    /// Nothing excludes a bias that is larger than the error wanted: it may be this much.
    BiasUpTo(f64),
    /// Bias was seen to fall, but perhaps so slowly that no number of samples helps.
    SlowBias,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Doubt::Slope => f.write_str("error is not known to fall"),
            Doubt::WideSlope => {
                f.write_str("the slope is too uncertain: more settings or runs are needed")
            }
            Doubt::BiasUpTo(most) => {
                write!(f, "bias may be as large as {:.2} %", 100.0 * most)
            }
            Doubt::SlowBias => f.write_str("bias may fall too slowly"),
        }
    }
}

/// Slopes whose intervals are wider than this do not tell N^-1/2 from N^-1, and say nothing beyond the settings.
const WIDEST_SLOPE: f64 = 0.5;

/// Bias that may fall more slowly than N to this power takes a thousandfold of samples for half of it, and more:
/// no forecast over so many would hold.
const SLOWEST_BIAS: f64 = -0.1;

/// All that is known of how a method converges.
#[derive(Clone, Debug, PartialEq)]
pub struct Convergence {
    /// Of the error, bias and noise together; `None` where there is none, or a single setting.
    pub error: Option<Line>,
    /// Of the noise alone.
    pub noise: Option<Line>,
    pub bias: Option<Bias>,
    /// Seconds before the first sample, and per sample per pixel.
    pub seconds: Option<[f64; 2]>,
    /// No setting has any error.
    pub exact: bool,
    /// The fewest samples without any error, with their seconds.
    pub exact_from: Option<[f64; 2]>,
    /// Whether the method has a bias by its nature. Of others, bias that is not seen counts as none.
    biased: bool,
    /// Samples of the largest setting.
    most_spp: f64,
    /// Of each setting, its samples and the upper end of its bias.
    bias_bounds: Vec<[f64; 2]>,
}

impl Convergence {
    /// From the settings of one method, by increasing samples; `biased` tells whether it has a bias by its nature.
    pub fn of(points: &[FitPoint], biased: bool) -> Convergence {
        let noise = line(points.iter().map(|p| (p.spp, p.variance, p.runs)));
        let bound = |p: &FitPoint| [p.spp, p.bias2.root().high];
        Convergence {
            error: line(points.iter().map(|p| (p.spp, p.mse, p.runs))),
            bias: bias(points, noise.as_ref()),
            noise,
            seconds: seconds(points),
            exact: !points.is_empty() && points.iter().all(is_exact),
            exact_from: exact_from(points),
            biased,
            most_spp: points.last().map_or(0.0, |p| p.spp),
            bias_bounds: points.iter().map(bound).collect(),
        }
    }

    /// What the relative error `wanted` (above 0; 0.01 is one per cent) takes.
    pub fn forecast(&self, wanted: f64) -> Forecast {
        if self.exact {
            return Forecast::Exact;
        }
        if let Some([spp, seconds]) = self.exact_from {
            // Measured: nothing that a line says can take more.
            let by_line = self.by_line(wanted);
            return match by_line {
                Forecast::Reached { spp: n, .. } if n.value < spp => by_line,
                _ => Forecast::Reached {
                    spp: Estimate::exact(spp),
                    seconds: Estimate::exact(seconds),
                },
            };
        }
        self.by_line(wanted)
    }

    fn by_line(&self, wanted: f64) -> Forecast {
        let Some([before, each]) = self.seconds else {
            return Forecast::Unknown(Doubt::Slope);
        };
        let spp = match self.bias {
            _ if wanted.is_nan() || wanted <= 0.0 => Err(Forecast::Unknown(Doubt::Slope)),
            Some(Bias::Stays { last, .. }) => self.beside_bias(wanted, last),
            Some(Bias::Falls { line, .. }) => self.with_falling_bias(wanted, &line),
            Some(Bias::NotSeen { below }) if self.biased => self.beside_unseen_bias(wanted, below),
            _ => self.reach(self.noise.or(self.error).as_ref(), wanted),
        };
        let spp = match spp {
            Ok(spp) => spp,
            Err(none) => return none,
        };
        // No time per sample is none for any number of them, however many.
        let time = |n: f64| before + if each > 0.0 { each * n.max(1.0) } else { 0.0 };
        let seconds = Estimate {
            value: time(spp.value),
            sd: if each > 0.0 { each * spp.sd } else { 0.0 },
            low: time(spp.low),
            high: time(spp.high),
        };
        Forecast::Reached { spp, seconds }
    }

    /// The samples at which a line falls to `y`; no forecast beyond the settings from a slope that is hardly known.
    fn reach(&self, line: Option<&Line>, y: f64) -> Result<Estimate, Forecast> {
        let slope = line.ok_or(Forecast::Unknown(Doubt::Slope))?.slope;
        let wide = slope.high - slope.low > WIDEST_SLOPE;
        match line.and_then(|l| l.where_it_falls_to(y)) {
            Some(spp) if wide && spp.value > self.most_spp => {
                Err(Forecast::Unknown(Doubt::WideSlope))
            }
            Some(spp) => Ok(spp),
            None if wide => Err(Forecast::Unknown(Doubt::WideSlope)),
            None => Err(Forecast::Unknown(Doubt::Slope)),
        }
    }

    /// The samples whose noise fills what a bias leaves of the wanted error.
    fn beside_bias(&self, wanted: f64, bias: Estimate) -> Result<Estimate, Forecast> {
        if bias.low >= wanted {
            return Err(Forecast::NeverBelow(bias.value));
        }
        if bias.high.is_nan() || bias.high >= wanted {
            return Err(Forecast::Unknown(Doubt::BiasUpTo(bias.high)));
        }
        let left = |bias: f64| (wanted * wanted - bias * bias).sqrt();
        let of = |bias: f64| self.reach(self.noise.as_ref(), left(bias));
        let spp = of(bias.value)?;
        Ok(Estimate {
            high: of(bias.high)?.high.max(spp.high),
            ..spp
        })
    }

    /// As [`Convergence::beside_bias`] with a bias of zero to `below`, and from the setting on from which it is known to be
    /// below the wanted error: fewer samples may have more of it.
    fn beside_unseen_bias(&self, wanted: f64, below: f64) -> Result<Estimate, Forecast> {
        let unseen = Estimate {
            value: 0.0,
            sd: 0.0,
            low: 0.0,
            high: below,
        };
        let spp = self.beside_bias(wanted, unseen)?;
        let known = self.bias_bounds.iter().rev();
        let first = known.take_while(|[_, bound]| *bound < wanted).last();
        let first = first.map_or(self.most_spp, |[spp, _]| *spp);
        Ok(Estimate {
            value: spp.value.max(first),
            high: spp.high.max(first),
            ..spp
        })
    }

    /// The samples at which the squares of noise and bias, each by its own line, add up to that of the wanted error.
    fn with_falling_bias(&self, wanted: f64, bias: &Line) -> Result<Estimate, Forecast> {
        if bias.slope.high > SLOWEST_BIAS {
            return Err(Forecast::Unknown(Doubt::SlowBias));
        }
        let noise = self.noise.ok_or(Forecast::Unknown(Doubt::Slope))?;
        let later = |y: f64| -> Result<[Estimate; 2], Forecast> {
            Ok([self.reach(Some(&noise), y)?, self.reach(Some(bias), y)?])
        };
        // Either alone must have fallen to the wanted error; and where both are at 1/√2 of it, their sum is.
        let ([a, b], [c, d]) = (later(wanted)?, later(wanted / 2f64.sqrt())?);
        let (mut low, mut high) = (a.value.max(b.value).ln(), c.value.max(d.value).ln());
        // Halved until the number of samples is known to rounding.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let x = middle.exp();
            match noise.at(x).hypot(bias.at(x)) > wanted {
                true => low = middle,
                false => high = middle,
            }
        }
        let value = (0.5 * (low + high)).exp();
        Ok(Estimate {
            value,
            sd: c.sd.max(d.sd),
            low: a.low.max(b.low).min(value),
            high: c.high.max(d.high).max(value),
        })
    }
}

fn is_exact(p: &FitPoint) -> bool {
    p.mse.value == 0.0 && p.mse.sd == 0.0 && p.mse.high == 0.0
}

/// Of the settings at the end that have no error, the first.
fn exact_from(points: &[FitPoint]) -> Option<[f64; 2]> {
    let at_end = points.iter().rev().take_while(|p| is_exact(p));
    at_end.last().map(|p| [p.spp, p.seconds])
}

fn bias(points: &[FitPoint], noise: Option<&Line>) -> Option<Bias> {
    let last = points.last()?;
    let root = last.bias2.root();
    if last.bias2.low <= 0.0 {
        return Some(Bias::NotSeen { below: root.high });
    }
    // Points where bias is not seen would pull the slope wherever noise has it.
    let seen = points.iter().filter(|p| p.bias2.low > 0.0);
    let falling = line(seen.map(|p| (p.spp, p.bias2, p.runs)));
    if let Some(falling) = falling.filter(|l| l.slope.high < 0.0) {
        return Some(Bias::Falls {
            last: root,
            line: falling,
        });
    }
    let floor_spp = match (noise, last.variance.value > 0.0) {
        (Some(line), true) => line.where_it_falls_to(root.value).map(|e| e.value.max(1.0)),
        // No noise at all: bias from the first sample on.
        _ => (last.variance.value <= 0.0).then_some(1.0),
    };
    Some(Bias::Stays {
        last: root,
        floor_spp,
    })
}

/// Line through seconds over samples, by relative errors, with neither part below zero.
fn seconds(points: &[FitPoint]) -> Option<[f64; 2]> {
    let known = |v: f64| v > 0.0 && v.is_finite();
    let usable = || (points.iter()).filter(|p| known(p.seconds) && known(p.spp));
    let count = usable().count();
    let (mut s, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for p in usable() {
        // Clocks tell no shorter times.
        let w = p.seconds.max(1e-9).powi(-2);
        s += w;
        sx += w * p.spp;
        sy += w * p.seconds;
        sxx += w * p.spp * p.spp;
        sxy += w * p.spp * p.seconds;
    }
    if count == 0 {
        return None;
    }
    let determinant = s * sxx - sx * sx;
    let through_zero = [0.0, sxy / sxx];
    if count == 1 || determinant <= 1e-9 * s * sxx {
        return Some(through_zero);
    }
    let each = (s * sxy - sx * sy) / determinant;
    let before = (sxx * sy - sx * sxy) / determinant;
    Some(if before < 0.0 {
        through_zero
    } else if each < 0.0 {
        [sy / s, 0.0]
    } else {
        [before, each]
    })
}

#[cfg(test)]
mod tests;

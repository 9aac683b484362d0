//! How error goes with samples: slopes in log-log plots with their intervals, where bias takes over, and
//! how many samples and seconds a wanted error takes.

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
    /// Seen, and falling with the number of samples N like N^slope.
    Falls { last: Estimate, slope: Estimate },
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
    /// Too little is known of how error falls.
    Unknown,
}

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
}

impl Convergence {
    /// From the settings of one method, by increasing samples.
    pub fn of(points: &[FitPoint]) -> Convergence {
        let noise = line(points.iter().map(|p| (p.spp, p.variance, p.runs)));
        Convergence {
            error: line(points.iter().map(|p| (p.spp, p.mse, p.runs))),
            bias: bias(points, noise.as_ref()),
            noise,
            seconds: seconds(points),
            exact: !points.is_empty() && points.iter().all(is_exact),
            exact_from: exact_from(points),
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
        if wanted.is_nan() || wanted <= 0.0 {
            return Forecast::Unknown;
        }
        let (line, target) = match self.bias {
            Some(Bias::Stays { last, .. }) => {
                if last.value >= wanted {
                    return Forecast::NeverBelow(last.value);
                }
                // The noise may fill what the bias leaves.
                let left = (wanted * wanted - last.value * last.value).sqrt();
                (self.noise, left)
            }
            Some(Bias::Falls { .. }) => (self.error, wanted),
            _ => (self.noise.or(self.error), wanted),
        };
        let (Some(line), Some([before, each])) = (line, self.seconds) else {
            return Forecast::Unknown;
        };
        let Some(spp) = line.where_it_falls_to(target) else {
            return Forecast::Unknown;
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
            slope: falling.slope,
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
mod tests {
    use super::*;

    fn points(f: impl Fn(f64) -> (f64, f64)) -> Vec<FitPoint> {
        let point = |k: i32| {
            let spp = f64::from(1 << k);
            let (bias2, variance) = f(spp);
            FitPoint {
                spp,
                seconds: 0.5 + 0.01 * spp,
                runs: 8,
                mse: Estimate::new(bias2 + variance, 0.02 * (bias2 + variance), 2.36),
                bias2: Estimate::new(bias2, 0.05 * bias2 + 0.01 * variance, 2.36),
                variance: Estimate::new(variance, 0.02 * variance, 2.36),
            }
        };
        (0..=8).map(point).collect()
    }

    #[test]
    fn noise_alone_falls_by_the_root_and_is_forecast() {
        let c = Convergence::of(&points(|n| (0.0, 0.04 / n)));
        let slope = c.error.unwrap().slope;
        assert!((slope.value + 0.5).abs() < 1e-9 && slope.low < -0.5 && slope.high > -0.5);
        assert!(matches!(c.bias, Some(Bias::NotSeen { .. })), "{:?}", c.bias);
        let Forecast::Reached { spp, seconds } = c.forecast(0.01) else {
            panic!("{:?}", c.forecast(0.01));
        };
        assert!((spp.value - 400.0).abs() < 1e-6 && spp.low < 400.0 && spp.high > 400.0);
        assert!((seconds.value - 4.5).abs() < 1e-6, "{seconds:?}");
    }

    #[test]
    fn a_bias_that_stays_is_a_floor() {
        // Noise 0.2 / sqrt(N) meets the bias of 0.02 at N = 100.
        let c = Convergence::of(&points(|n| (4e-4, 0.04 / n)));
        let Some(Bias::Stays { last, floor_spp }) = c.bias else {
            panic!("{:?}", c.bias);
        };
        assert!((last.value - 0.02).abs() < 1e-9);
        assert!((floor_spp.unwrap() - 100.0).abs() < 1e-6);
        assert_eq!(c.forecast(0.01), Forecast::NeverBelow(last.value));
        // 0.025² = 0.02² + 0.015²: the noise of 178 samples.
        let Forecast::Reached { spp, .. } = c.forecast(0.025) else {
            panic!();
        };
        assert!((spp.value - 0.04 / 2.25e-4).abs() < 1e-6);
    }

    #[test]
    fn a_bias_that_falls_is_no_floor() {
        // As of density estimation with shrinking radii: bias² ~ N^-2/3.
        let c = Convergence::of(&points(|n| (1e-2 * n.powf(-2.0 / 3.0), 1e-3 / n)));
        let Some(Bias::Falls { slope, .. }) = c.bias else {
            panic!("{:?}", c.bias);
        };
        assert!(
            slope.low < -1.0 / 3.0 && slope.high > -1.0 / 3.0,
            "{slope:?}"
        );
        assert!(matches!(c.forecast(1e-3), Forecast::Reached { .. }));
    }

    #[test]
    fn no_error_has_no_slope() {
        let mut all = points(|_| (0.0, 0.0));
        for p in &mut all {
            p.mse = Estimate::exact(0.0);
        }
        let c = Convergence::of(&all);
        assert!(c.exact && c.error.is_none() && c.noise.is_none());
        assert_eq!(c.forecast(0.01), Forecast::Exact);
        let nothing = Convergence::of(&[]);
        assert_eq!(nothing.forecast(0.01), Forecast::Unknown);
    }

    #[test]
    fn other_powers_are_found_and_noise_is_in_their_interval() {
        // N^-3/4, as of well-spread points, with errors of some per cent on the squares.
        let mut all = points(|n| (0.0, 0.04 * n.powf(-1.5)));
        for (k, p) in all.iter_mut().enumerate() {
            let by = 1.0 + 0.03 * if k % 2 == 0 { 1.0 } else { -1.0 };
            (p.mse.value, p.variance.value) = (p.mse.value * by, p.variance.value * by);
        }
        let c = Convergence::of(&all);
        let slope = c.error.unwrap().slope;
        assert!(slope.low < -0.75 && slope.high > -0.75, "{slope:?}");
        assert!(slope.high - slope.low < 0.05, "{slope:?}");
        // 0.2 N^-3/4 is 0.002 at N = 100^(2/1.5).
        let Forecast::Reached { spp, .. } = c.forecast(0.002) else {
            panic!("{:?}", c.forecast(0.002));
        };
        let truth = 1e4f64.powf(1.0 / 1.5);
        assert!(spp.low < truth && truth < spp.high, "{spp:?} {truth}");
    }

    #[test]
    fn two_settings_have_a_line_with_an_interval() {
        let c = Convergence::of(&points(|n| (0.0, 0.04 / n))[3..5]);
        let slope = c.error.unwrap().slope;
        assert!((slope.value + 0.5).abs() < 1e-9);
        assert!(slope.low < -0.5 && slope.high > -0.5 && slope.high - slope.low < 0.5);
        assert!(matches!(c.forecast(0.01), Forecast::Reached { .. }));
    }

    #[test]
    fn settings_of_the_same_samples_have_no_slope() {
        // Times so short that all come to one sample per pixel.
        let mut all = points(|n| (0.0, 0.04 / n));
        all.iter_mut().for_each(|p| p.spp = 1.0);
        let c = Convergence::of(&all);
        assert!(c.error.is_none() && c.noise.is_none());
        assert_eq!(c.forecast(0.01), Forecast::Unknown);
        // And where only the first and the last are alike, all are used.
        all[4].spp = 4.0;
        assert!(Convergence::of(&all).error.is_some());
    }

    #[test]
    fn what_was_measured_without_error_is_reached() {
        // An error of 0.2 / √N that is gone from 64 samples on.
        let mut all = points(|n| (0.0, if n < 64.0 { 0.04 / n } else { 0.0 }));
        for p in &mut all[6..] {
            (p.mse, p.bias2, p.variance) = (
                Estimate::exact(0.0),
                Estimate::exact(0.0),
                Estimate::exact(0.0),
            );
        }
        let c = Convergence::of(&all);
        assert!(!c.exact && (c.error.unwrap().slope.value + 0.5).abs() < 1e-9);
        let spp = |wanted: f64| match c.forecast(wanted) {
            Forecast::Reached { spp, seconds } => {
                assert!(seconds.value.is_finite());
                spp.value
            }
            other => panic!("{other:?}"),
        };
        assert!((spp(0.04) - 25.0).abs() < 1e-6);
        assert_eq!((spp(0.01), spp(1e-9)), (64.0, 64.0));
    }

    #[test]
    fn no_number_is_ever_nonsense() {
        // Negative, infinite and unknown values in every place.
        let odd = [0.0, -1e-3, f64::NAN, f64::INFINITY, 1e-300, 1e300, 0.04];
        for a in odd {
            for b in odd {
                let mut all = points(|n| (0.0, 0.04 / n));
                all[2].mse = Estimate::new(a, b.abs(), 2.0);
                all[5].variance = Estimate::new(b, a, 2.0);
                all[8].bias2 = Estimate::new(a, b, 2.0);
                all[7].seconds = if b.is_finite() { b } else { 1.0 };
                let c = Convergence::of(&all);
                let lines = [c.error, c.noise].into_iter().flatten();
                for line in lines {
                    assert!(
                        !line.slope.value.is_nan() && !line.at_center.value.is_nan(),
                        "{a} {b}: {line:?}"
                    );
                }
                for wanted in [0.0, -1.0, f64::NAN, 1e-300, 0.01, 1e300] {
                    if let Forecast::Reached { spp, seconds } = c.forecast(wanted) {
                        assert!(
                            !spp.value.is_nan() && !seconds.value.is_nan(),
                            "{a} {b} {wanted}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn one_setting_gives_no_slope_but_no_nonsense_either() {
        let c = Convergence::of(&points(|n| (0.0, 0.04 / n))[..1]);
        assert!(c.error.is_none());
        assert_eq!(c.forecast(0.01), Forecast::Unknown);
    }
}

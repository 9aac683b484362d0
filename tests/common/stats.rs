//! Means of samples, and tails of the distributions that the tests need.

/// Running mean and variance (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
pub struct Running {
    n: f64,
    pub mean: f64,
    m2: f64,
}

impl Running {
    pub fn add(&mut self, v: f64) {
        self.n += 1.0;
        let d = v - self.mean;
        self.mean += d / self.n;
        self.m2 += d * (v - self.mean);
    }

    /// Standard error of the mean.
    pub fn stderr(&self) -> f64 {
        (self.m2 / (self.n * (self.n - 1.0))).sqrt()
    }
}

/// Mean of `n` samples and its standard error.
pub fn mean_and_error(n: u32, mut sample: impl FnMut() -> f64) -> (f64, f64) {
    let mut all = Running::default();
    (0..n).for_each(|_| all.add(sample()));
    (all.mean, all.stderr())
}

/// Level of each of `n` tests such that all of them together reject truth with probability `alpha`
/// (Šidák 1967).
pub fn sidak(alpha: f64, n: usize) -> f64 {
    -((-alpha).ln_1p() / n as f64).exp_m1()
}

/// Probability that a chi-square variable of `dof` degrees of freedom exceeds `x`.
pub fn chi2_p_value(x: f64, dof: f64) -> f64 {
    gamma_q(0.5 * dof, 0.5 * x)
}

/// Probability that a normal variable lies further than `|z|` from its mean, on either side.
pub fn normal_p_value(z: f64) -> f64 {
    gamma_q(0.5, 0.5 * z * z)
}

/// Logarithm of the gamma function for x > 0 (Stirling's series after shifting x above 12).
pub fn ln_gamma(x: f64) -> f64 {
    let (mut x, mut shift) = (x, 0.0);
    while x < 12.0 {
        shift += x.ln();
        x += 1.0;
    }
    let r = 1.0 / (x * x);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series - shift
}

/// Upper regularised incomplete gamma function Q(a, x): the series of P below the bend, the continued
/// fraction (Lentz) above (DLMF 8.11.4 and 8.9.2).
pub fn gamma_q(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - front * sum
    } else {
        let tiny = 1e-300;
        let mut b = x + 1.0 - a;
        let (mut c, mut d) = (1.0 / tiny, 1.0 / b);
        let mut h = d;
        for i in 1..10_000 {
            let an = -f64::from(i) * (f64::from(i) - a);
            b += 2.0;
            d = 1.0 / (an * d + b);
            c = b + an / c;
            h *= d * c;
            if (d * c - 1.0).abs() < 1e-15 {
                break;
            }
        }
        front * h
    }
}

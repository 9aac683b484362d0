//! Rules of integration: Gauss and Legendre's on an interval and what is made of it.

use super::polygon::{Polygon, length};
use crate::math::DVec3;

/// Points in (0, 1) and weights that sum to 1.
#[derive(Clone, Debug)]
pub struct Rule(pub Vec<(f64, f64)>);

impl Rule {
    /// The rule of `n` ≥ 1 points, exact for polynomials of degree 2 n - 1: roots of the Legendre polynomial by
    /// Newton's method (Abramowitz & Stegun 25.4.29).
    pub fn gauss(n: usize) -> Rule {
        let root = |k: usize| {
            let mut x = (std::f64::consts::PI * (k as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..60 {
                // Bonnet's recursion for the polynomial of degree n and the one before.
                let (mut before, mut p) = (0.0, 1.0);
                for m in 0..n {
                    let m = m as f64;
                    (before, p) = (p, ((2.0 * m + 1.0) * x * p - m * before) / (m + 1.0));
                }
                slope = n as f64 * (x * p - before) / (x * x - 1.0);
                let step = p / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
        };
        Rule((0..n).map(root).collect())
    }

    /// The same after the substitution t = s³ (10 - 15 s + 6 s²), which crowds points at both ends: functions
    /// like t ln t become smooth enough there for the rule to converge fast.
    pub fn crowded(n: usize) -> Rule {
        let move_in = |(s, w): (f64, f64)| {
            let t = s * s * s * (10.0 + s * (6.0 * s - 15.0));
            let slope = 30.0 * (s * (1.0 - s)).powi(2);
            (t, w * slope)
        };
        Rule(Rule::gauss(n).0.into_iter().map(move_in).collect())
    }

    /// The integral of `f` over a polygon: the product rule on a parallelogram, and on each triangle of a fan
    /// otherwise, collapsed to one corner (Stroud 1971, section 2.4).
    pub fn over(&self, polygon: &Polygon, mut f: impl FnMut(DVec3) -> f64) -> f64 {
        if let [a, b, c, d] = polygon[..]
            && (a + c - b - d).abs().max_element() <= 1e-12 * (c - a).abs().max_element()
        {
            let (e1, e2) = (b - a, d - a);
            let area = length(e1.cross(e2));
            let mut sum = 0.0;
            for &(s, ws) in &self.0 {
                for &(t, wt) in &self.0 {
                    sum += ws * wt * f(a + e1 * s + e2 * t);
                }
            }
            return sum * area;
        }
        let Some(&first) = polygon.first() else {
            return 0.0;
        };
        let mut sum = 0.0;
        for pair in polygon[1..].windows(2) {
            let (e1, e2) = (pair[0] - first, pair[1] - pair[0]);
            let area = length(e1.cross(e2));
            for &(s, ws) in &self.0 {
                for &(t, wt) in &self.0 {
                    sum += ws * wt * s * area * f(first + (e1 + e2 * t) * s);
                }
            }
        }
        sum
    }
}

//! What the patches around a vertex say about the value there.
//!
//! Each has the weight of the angle it fills at the vertex, which does not depend on how a flat part is divided;
//! times exp(g · d), d the way to its middle, with g such that Σ w d = 0: then linear functions are kept, and no
//! weight is negative. These are the weights of greatest entropy (Sukumar 2004, "Construction of polygonal
//! interpolants: a maximum entropy approach", with the angles as prior). They exist where the middles surround
//! the vertex; on the border of a surface the angles alone remain.

use crate::math::{DVec2, DVec3};

/// A patch at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Around {
    pub patch: u32,
    /// In radians.
    pub angle: f64,
    pub to_center: DVec3,
}

/// The angle between two vectors, right also for small ones; zero where one of both is zero.
pub fn angle(a: DVec3, b: DVec3) -> f64 {
    let (a, b) = (a.normalize_or_zero(), b.normalize_or_zero());
    a.cross(b).length().atan2(a.dot(b))
}

/// Weights that add up to 1, of patches around a vertex with this unit normal.
pub fn weights(around: &[Around], normal: DVec3) -> Vec<f64> {
    let total: f64 = around.iter().map(|a| a.angle).sum();
    let base: Vec<f64> = match total > 0.0 {
        true => around.iter().map(|a| a.angle / total).collect(),
        false => vec![1.0 / around.len() as f64; around.len()],
    };
    let largest = around
        .iter()
        .map(|a| a.to_center.abs().max_element())
        .fold(0.0, f64::max);
    if around.len() < 3 || largest <= 0.0 {
        return base;
    }
    // In the tangent plane, curved parts unrolled: lengths stay.
    let (x, y) = normal.any_orthonormal_pair();
    let ways: Vec<DVec2> = around
        .iter()
        .map(|a| {
            let d = a.to_center / largest;
            DVec2::new(d.dot(x), d.dot(y)).normalize_or_zero() * d.length()
        })
        .collect();
    tilted(&base, &ways).unwrap_or(base)
}

/// Newton's method for the minimum over g of log Σ b exp(g · d), whose gradient is the mean of d.
fn tilted(base: &[f64], ways: &[DVec2]) -> Option<Vec<f64>> {
    /// The longest way is of length about 1, but a small patch beside a large one has a short way and may need
    /// this much to change its weight.
    const STEEPEST: f64 = 300.0;
    let mut g = DVec2::ZERO;
    let moments = |g: DVec2| {
        let mut sum = 0.0;
        let (mut mean, mut xx, mut xy, mut yy) = (DVec2::ZERO, 0.0, 0.0, 0.0);
        for (b, d) in base.iter().zip(ways) {
            let w = b * g.dot(*d).exp();
            sum += w;
            mean += *d * w;
            xx += d.x * d.x * w;
            xy += d.x * d.y * w;
            yy += d.y * d.y * w;
        }
        let mean = mean / sum;
        let square = [
            xx / sum - mean.x * mean.x,
            xy / sum - mean.x * mean.y,
            yy / sum - mean.y * mean.y,
        ];
        (sum, mean, square)
    };
    for _ in 0..60 {
        let (sum, mean, [xx, xy, yy]) = moments(g);
        if mean.length() < 1e-12 {
            let weight = |(b, d): (&f64, &DVec2)| b * g.dot(*d).exp() / sum;
            return Some(base.iter().zip(ways).map(weight).collect());
        }
        let det = xx * yy - xy * xy;
        if det <= 1e-9 * (xx + yy) * (xx + yy) {
            return None;
        }
        let step = -DVec2::new(yy * mean.x - xy * mean.y, xx * mean.y - xy * mean.x) / det;
        // Shorter, until the function falls by enough, as far as rounding lets that be seen.
        let mut share = 1.0;
        while share > 1e-3
            && moments(g + step * share).0.ln() > sum.ln() + 0.1 * share * mean.dot(step) + 1e-14
        {
            share *= 0.5;
        }
        g += step * share;
        if g.is_nan() || g.length() > STEEPEST {
            return None;
        }
    }
    None
}

//! Form factors of polygons in closed form.
//!
//! What two patches exchange, A_i F_ij without anything between, is the integral over one of them of Lambert's
//! closed form for the other. Of the two, the smaller one is integrated over, by a product rule of Gauss. The
//! closed form is analytic but at the edges of its polygon, so the rule converges geometrically, by the ratio of
//! the distance of these edges to the size of the integrated patch. Where that is small or zero (patches that
//! touch), both integrals go around the contours (Sparrow 1963), one of them in closed form, and the other one by
//! a rule that is cut where edges come near each other.

use super::polygon::{Polygon, distance2_to_segment, length};
use super::quadrature::Rule;
use crate::math::DVec3;
use std::f64::consts::{PI, TAU};

/// Polygons that appear smaller than this (their size over their distance) are points with an area: the closed
/// form would lose (distance / size)² roundings.
const POINT: f64 = 1e-4;

/// Edges nearer than this many radii of the integrated patch: the contours are integrated.
const NEAR: f64 = 2.0;

/// The product rule takes as few points as keep its error below about this.
const TOLERANCE: f64 = 1e-7;

/// Rules for the integrals.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Of 1, 2, ... points.
    by_points: Vec<Rule>,
    contour: Rule,
}

impl Rules {
    /// The product rule has at most about `samples` points.
    pub fn new(samples: u32) -> Rules {
        // More than 32 points in a row add nothing to geometric convergence.
        let most = f64::from(samples).sqrt().ceil().clamp(1.0, 32.0) as usize;
        Rules {
            by_points: (1..=most).map(Rule::gauss).collect(),
            contour: Rule::crowded(24),
        }
    }

    /// A_a F_ab = A_b F_ba in squared scene units, when nothing stands between the patches: the integral over both
    /// of cos cos / (π r²), where that is positive. `a` has the unit normal `na`. At most the smaller area.
    ///
    /// The same, but for rounding, in either order; best called with the smaller one first.
    pub fn exchange(&self, a: &Polygon, na: DVec3, b: &Polygon, nb: DVec3) -> f64 {
        let (pa, pb) = (a[0], b[0]);
        // In front of each other's planes.
        let seen_b = b.clip(|p| (p - pa).dot(na));
        let seen_a = a.clip(|p| (p - pb).dot(nb));
        if seen_a.len() < 3 || seen_b.len() < 3 {
            return 0.0;
        }
        let (area_a, center) = seen_a.area_and_center();
        let (area_b, _) = seen_b.area_and_center();
        let radius2 = |sum: f64, p: &DVec3| sum.max(p.distance_squared(center));
        let radius = seen_a.iter().fold(0.0, radius2).sqrt();
        let distance2 = |sum: f64, (p, q)| sum.min(distance2_to_segment(center, p, q));
        let distance = seen_b.edges().fold(f64::INFINITY, distance2).sqrt();
        let exchanged = if distance < NEAR * radius {
            self.around(&seen_a, &seen_b)
        } else {
            let ratio = (distance / radius).max(NEAR);
            let points = (-TOLERANCE.ln() / (2.0 * ratio.ln())).ceil().max(1.0) as usize;
            let rule = &self.by_points[points.min(self.by_points.len()) - 1];
            rule.over(&seen_a, |x| lambert(x, na, &seen_b, nb))
        };
        match exchanged.is_finite() {
            true => exchanged.clamp(0.0, area_a.min(area_b)),
            false => 0.0,
        }
    }

    /// 1/(2π) ∮∮ ln r dr·dr' over both contours, which see nothing but each other's fronts (Sparrow 1963).
    fn around(&self, a: &Polygon, b: &Polygon) -> f64 {
        // A common factor of all distances adds the integral of a constant, which is zero; near 1, r costs no
        // digits.
        let unit = a
            .edges()
            .chain(b.edges())
            .fold(0.0, |sum: f64, (p, q)| sum.max((q - p).length()));
        if unit <= 0.0 {
            return 0.0;
        }
        let mut sum = 0.0;
        for (p, q) in a.edges() {
            for (v, w) in b.edges() {
                let along = (q - p).dot(w - v) / (unit * unit);
                if along != 0.0 {
                    let edge = [(p - v) / unit, (q - p) / unit, (w - v) / unit];
                    sum += along * self.mean_log(edge);
                }
            }
        }
        sum * unit * unit / TAU
    }

    /// The mean of ln r between two edges: one begins at `from` and runs along `d`, the other one begins at the
    /// origin and runs along `e`.
    fn mean_log(&self, [from, d, e]: [DVec3; 3]) -> f64 {
        let length_e = e.length();
        let length_d2 = d.length_squared();
        if length_e <= 0.0 || length_d2 <= 0.0 {
            return 0.0;
        }
        let u = e / length_e;
        // The integrand is smooth but where the edge passes the ends of the other one, or its line.
        let mut cuts = [0.0, 1.0, 1.0, 1.0, 1.0];
        let nearest_to = |p: DVec3| (p - from).dot(d) / length_d2;
        cuts[1] = nearest_to(DVec3::ZERO);
        cuts[2] = nearest_to(e);
        let across = d - u * d.dot(u);
        let offset = from - u * from.dot(u);
        let across2 = across.length_squared();
        if across2 > 1e-20 * length_d2 {
            cuts[3] = -offset.dot(across) / across2;
        }
        for cut in &mut cuts[1..4] {
            if !(*cut > 0.0 && *cut < 1.0) {
                *cut = 1.0;
            }
        }
        cuts.sort_by(f64::total_cmp);
        let mut sum = 0.0;
        for pair in cuts.windows(2) {
            let width = pair[1] - pair[0];
            if width <= 0.0 {
                continue;
            }
            let part = |&(t, w): &(f64, f64)| {
                let x = from + d * (pair[0] + width * t);
                w * log_to_edge(x, u, length_e)
            };
            sum += width * self.contour.0.iter().map(part).sum::<f64>();
        }
        sum
    }
}

/// The mean of ln r from `x` to the points of an edge of this `length` that begins at the origin and runs along
/// the unit vector `u`.
#[inline]
fn log_to_edge(x: DVec3, u: DVec3, length: f64) -> f64 {
    let a = x.dot(u);
    let b = length - a;
    let d2 = (x - u * a).length_squared();
    let term = |t: f64| match t * t + d2 {
        r2 if r2 > 0.0 => 0.5 * t * r2.ln(),
        _ => 0.0,
    };
    let d = d2.sqrt();
    let turn = (d * length).atan2(d2 - a * b);
    (term(a) + term(b) + d * turn) / length - 1.0
}

/// The form factor from a point with unit normal `n` to a polygon in front of it, which shows it its front with
/// unit normal `nb`: 1/(2π) Σ over edges of the angle that each covers times the cosine of its plane's normal
/// (Lambert 1760). In [0, 1] up to rounding.
pub fn lambert(x: DVec3, n: DVec3, polygon: &Polygon, nb: DVec3) -> f64 {
    let Some(&first) = polygon.first() else {
        return 0.0;
    };
    let size = polygon
        .iter()
        .fold(0.0, |s: f64, p| s.max((*p - first).abs().max_element()));
    let distance = (first - x).abs().max_element();
    if size < POINT * distance {
        let (area, center) = polygon.area_and_center();
        return kernel(x, n, center, nb) * area;
    }
    let mut sum = 0.0;
    let mut at = first - x;
    for k in 1..=polygon.len() {
        let next = if k == polygon.len() {
            first
        } else {
            polygon[k]
        } - x;
        // The cross product by the edge itself: that of two long vectors side by side would lose digits.
        let edge = match k == polygon.len() {
            true => first - polygon[k - 1],
            false => polygon[k] - polygon[k - 1],
        };
        let cross = at.cross(edge);
        let sine = length(cross);
        if sine > 0.0 {
            let angle = sine.atan2(at.dot(next));
            sum -= angle / sine * cross.dot(n);
        }
        at = next;
    }
    sum / TAU
}

/// cos cos / (π r²), in one over squared scene units; zero where one of the points does not see the other's front.
#[inline]
pub fn kernel(x: DVec3, n: DVec3, y: DVec3, nb: DVec3) -> f64 {
    let d = y - x;
    let r = length(d);
    if r <= 0.0 {
        return 0.0;
    }
    let w = d / r;
    let cosines = w.dot(n).max(0.0) * (-w.dot(nb)).max(0.0);
    match cosines > 0.0 {
        true => cosines / r / r / PI,
        false => 0.0,
    }
}

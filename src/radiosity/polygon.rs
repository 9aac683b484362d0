//! Form factors from a point to a polygon, in closed form.

use crate::math::DVec3;
use std::f64::consts::TAU;

/// Most corners of a quadrilateral that is cut by a plane.
const CORNERS: usize = 5;

/// Share of the light that leaves the surface at `p` with unit normal `n`, as a diffuse emitter, towards the flat
/// polygon with these (three or four) `corners`, as if nothing stood between; what lies behind the surface is cut
/// off. Both ways around count alike. In [0,1] (Lambert 1760; as a sum over edges in Baum, Rushmeier & Winget
/// 1989, equation 8).
pub fn point_to_polygon(p: DVec3, n: DVec3, corners: impl Iterator<Item = DVec3>) -> f64 {
    let mut cut = [DVec3::ZERO; CORNERS];
    let count = above(corners.map(|c| c - p), n, &mut cut);
    if count < 3 {
        return 0.0;
    }
    let mut sum = 0.0;
    for i in 0..count {
        let (a, b) = (cut[i], cut[(i + 1) % count]);
        let cross = a.cross(b);
        let sin = cross.length();
        if sin > 0.0 {
            sum += sin.atan2(a.dot(b)) * (cross.dot(n) / sin);
        }
    }
    let f = sum.abs() / TAU;
    if f.is_finite() { f.min(1.0) } else { 0.0 }
}

/// Cuts a polygon at the plane through the origin, keeping what is on the side of `n`, scaled so that squares stay
/// in range. Gives the number of corners.
fn above(corners: impl Iterator<Item = DVec3>, n: DVec3, out: &mut [DVec3; CORNERS]) -> usize {
    let mut given = [DVec3::ZERO; 4];
    let mut count = 0;
    let mut scale = 0.0f64;
    for (slot, corner) in given.iter_mut().zip(corners) {
        *slot = corner;
        scale = scale.max(corner.abs().max_element());
        count += 1;
    }
    if !(scale > 0.0 && scale.is_finite()) {
        return 0;
    }
    let mut kept = 0;
    let mut keep = |v: DVec3| {
        if kept < CORNERS {
            out[kept] = v;
            kept += 1;
        }
    };
    for i in 0..count {
        let (a, b) = (given[i] / scale, given[(i + 1) % count] / scale);
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha >= 0.0 {
            keep(a);
        }
        if (ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0) {
            keep(a + (b - a) * (ha / (ha - hb)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rectangle a by b parallel to the surface at distance c, one corner above the point (Howell's catalogue,
    /// B-3).
    fn parallel(a: f64, b: f64, c: f64) -> f64 {
        let (x, y) = (a / c, b / c);
        let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / rx * (y / rx).atan() + y / ry * (x / ry).atan()) / TAU
    }

    #[test]
    fn a_parallel_rectangle_has_its_closed_form() {
        for (a, b, c) in [
            (1.0, 1.0, 1.0),
            (3.0, 0.2, 0.5),
            (1e-3, 2e-3, 1.0),
            (50.0, 80.0, 0.1),
        ] {
            for scale in [1e-6, 1.0, 1e6] {
                let corners = [(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)];
                let corners = corners.map(|(x, y)| DVec3::new(x, y, c) * scale);
                let f = point_to_polygon(DVec3::ZERO, DVec3::Z, corners.into_iter());
                assert!(
                    (f / parallel(a, b, c) - 1.0).abs() < 1e-9,
                    "{a} {b} {c}: {f}"
                );
            }
        }
    }

    #[test]
    fn what_is_behind_is_cut_off() {
        let wall = [(-1.0, -2.0), (1.0, -2.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = wall.map(|(x, z)| DVec3::new(x, 0.7, z));
        let upper = [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 1.0)];
        let upper = upper.map(|(x, z)| DVec3::new(x, 0.7, z));
        let f = |corners: [DVec3; 4]| point_to_polygon(DVec3::ZERO, DVec3::Z, corners.into_iter());
        assert!((f(corners) - f(upper)).abs() < 1e-12);
        assert_eq!(f(corners.map(|c| c - 5.0 * DVec3::Z)), 0.0);
    }
}

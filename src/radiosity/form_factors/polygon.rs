//! Small convex polygons: what is left of a patch in front of planes.

use super::super::Piece;
use crate::math::DVec3;
use std::ops::Deref;

/// Corners of a quadrangle and one more for each of six planes that cut it.
const MOST: usize = 10;

/// A flat convex polygon; counter-clockwise as seen from its front. Holds no corner when nothing is left.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    corners: [DVec3; MOST],
    len: usize,
}

impl Deref for Polygon {
    type Target = [DVec3];

    #[inline]
    fn deref(&self) -> &[DVec3] {
        &self.corners[..self.len]
    }
}

impl From<&Piece> for Polygon {
    fn from(piece: &Piece) -> Polygon {
        let mut polygon = Polygon::EMPTY;
        piece.corners().for_each(|p| polygon.push(p));
        polygon
    }
}

impl Polygon {
    pub const EMPTY: Polygon = Polygon {
        corners: [DVec3::ZERO; MOST],
        len: 0,
    };

    /// The polygon of these corners, of which there are at most ten.
    pub fn new(corners: &[DVec3]) -> Polygon {
        let mut polygon = Polygon::EMPTY;
        corners.iter().for_each(|p| polygon.push(*p));
        polygon
    }

    /// Each corner moved.
    #[inline]
    pub fn map(&self, to: impl Fn(DVec3) -> DVec3) -> Polygon {
        let mut polygon = *self;
        for p in &mut polygon.corners[..self.len] {
            *p = to(*p);
        }
        polygon
    }

    #[inline]
    fn push(&mut self, p: DVec3) {
        // Rounding may make a polygon so little concave that a plane cuts it more than twice.
        if self.len < MOST {
            self.corners[self.len] = p;
            self.len += 1;
        }
    }

    /// The part where `height`, which is linear in space, is positive (Sutherland & Hodgman 1974); empty when
    /// it is positive nowhere.
    #[inline]
    pub fn clip(&self, height: impl Fn(DVec3) -> f64) -> Polygon {
        let mut heights = [0.0; MOST];
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (h, p) in heights.iter_mut().zip(self.iter()) {
            *h = height(*p);
            low = low.min(*h);
            high = high.max(*h);
        }
        if low >= 0.0 && high > 0.0 {
            return *self;
        }
        let mut cut = Polygon::EMPTY;
        if high.is_nan() || high <= 0.0 {
            return cut;
        }
        for k in 0..self.len {
            let next = if k + 1 == self.len { 0 } else { k + 1 };
            let (p, q) = (self.corners[k], self.corners[next]);
            let (a, b) = (heights[k], heights[next]);
            if a >= 0.0 {
                cut.push(p);
            }
            if (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0) {
                cut.push(p + (q - p) * (a / (a - b)));
            }
        }
        cut
    }

    /// Pairs of neighbouring corners, around the polygon.
    #[inline]
    pub fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
        let next = self.iter().skip(1).chain(self.first());
        self.iter().copied().zip(next.copied())
    }

    /// Area and centre of gravity; the mean of the corners where there is no area.
    pub fn area_and_center(&self) -> (f64, DVec3) {
        let Some(&first) = self.first() else {
            return (0.0, DVec3::ZERO);
        };
        let (mut area, mut moment) = (0.0, DVec3::ZERO);
        for pair in self[1..].windows(2) {
            let (a, b) = (pair[0] - first, pair[1] - first);
            let part = 0.5 * length(a.cross(b));
            area += part;
            moment += (a + b) * (part / 3.0);
        }
        let mean = || self.iter().fold(DVec3::ZERO, |sum, p| sum + *p) / self.len as f64;
        match area > 0.0 {
            true => (area, first + moment / area),
            false => (0.0, mean()),
        }
    }
}

/// Length of a vector whose square may leave the range.
#[inline]
pub fn length(v: DVec3) -> f64 {
    let scale = v.abs().max_element();
    match scale > 0.0 {
        true => (v / scale).length() * scale,
        false => 0.0,
    }
}

/// Squared distance of `p` from the segment from `a` to `b`.
#[inline]
pub fn distance2_to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let (d, e) = (p - a, b - a);
    let e2 = e.length_squared();
    let t = match e2 > 0.0 {
        true => (d.dot(e) / e2).clamp(0.0, 1.0),
        false => 0.0,
    };
    (d - e * t).length_squared()
}

//! The item buffer of one face of a hemicube: which patch each pixel shows.

use super::polygon::Polygon;
use crate::math::DVec3;

/// Pixels that show nothing.
pub const NOTHING: u32 = u32::MAX;
/// Pixels that show what takes no part: the backs of patches, and shapes that are not divided into patches.
pub const BLOCKED: u32 = u32::MAX - 1;

/// How much further away backs are taken to be, so that of two sides of one surface the front shows.
const BEHIND: f64 = 1e-6;

/// How much a span is longer at both ends, in pixels: neighbours that share an edge leave no gap between them.
/// Where both claim a pixel, the nearer or first one has it.
const SEAM: f64 = 1e-9;

/// Pixels of a window of the plane at distance 1 from the eye. The window reaches from -1 to 1 in x, and from `low`
/// (-1 or 0) to 1 in y.
#[derive(Clone, Debug)]
pub struct Buffer {
    pub width: usize,
    pub height: usize,
    low: f64,
    /// By row and column: what is seen, and one over its distance along the axis.
    pub items: Vec<u32>,
    inverse: Vec<f64>,
}

impl Buffer {
    pub fn new(width: usize, height: usize, low: f64) -> Buffer {
        Buffer {
            width,
            height,
            low,
            items: vec![NOTHING; width * height],
            inverse: vec![0.0; width * height],
        }
    }

    pub fn clear(&mut self) {
        self.items.fill(NOTHING);
        self.inverse.fill(0.0);
    }

    /// Corners of a pixel in the plane.
    pub fn pixel(&self, row: usize, column: usize) -> [f64; 4] {
        let x = |i: usize| 2.0 * i as f64 / self.width as f64 - 1.0;
        let y = |j: usize| self.low + (1.0 - self.low) * j as f64 / self.height as f64;
        [x(column), y(row), x(column + 1), y(row + 1)]
    }

    /// Draws a polygon, in coordinates whose origin is the eye and whose z axis is that of the view. Returns how
    /// many middles of pixels it covers, seen or not.
    pub fn draw(&mut self, polygon: &Polygon, item: u32) -> usize {
        // To the frustum's four sides, which meet in the eye: what is left is in front.
        let low = self.low;
        let heights = |p: DVec3| [p.z - p.x, p.z + p.x, p.z - p.y, p.y - low * p.z];
        // Most polygons are outside of one of them altogether, or inside of all.
        let (mut highest, mut lowest) = ([0.0f64; 4], 0.0f64);
        for p in polygon.iter() {
            for (high, h) in highest.iter_mut().zip(heights(*p)) {
                *high = high.max(h);
                lowest = lowest.min(h);
            }
        }
        if highest.contains(&0.0) {
            return 0;
        }
        let inside = match lowest < 0.0 {
            true => (0..4).fold(*polygon, |part, side| part.clip(|p| heights(p)[side])),
            false => *polygon,
        };
        if inside.len() < 3 || inside.iter().any(|p| p.z <= 0.0) {
            return 0;
        }
        // One over z is linear in the plane.
        let n = normal(polygon);
        let plane = n.dot(polygon[0]);
        if plane == 0.0 {
            return 0;
        }
        let n = n / plane * if item == BLOCKED { 1.0 - BEHIND } else { 1.0 };
        let across = self.width as f64 * 0.5;
        let along = self.height as f64 / (1.0 - low);
        let mut corners = [(0.0, 0.0); 10];
        let (mut bottom, mut top) = (f64::INFINITY, f64::NEG_INFINITY);
        for (corner, p) in corners.iter_mut().zip(inside.iter()) {
            let y = (p.y / p.z - low) * along;
            *corner = ((p.x / p.z + 1.0) * across, y);
            bottom = bottom.min(y);
            top = top.max(y);
        }
        let corners = &corners[..inside.len()];
        let first = (bottom - 0.5).ceil().max(0.0) as usize;
        let end = ((top - 0.5).floor() + 1.0).clamp(0.0, self.height as f64) as usize;
        let mut covered = 0;
        for row in first..end {
            let y = row as f64 + 0.5;
            let Some((left, right)) = span(corners, y) else {
                continue;
            };
            let from = (left - 0.5 - SEAM).ceil().max(0.0) as usize;
            let to = ((right - 0.5 + SEAM).floor() + 1.0).clamp(0.0, self.width as f64) as usize;
            let base = n.y * (low + y / along) + n.z;
            for column in from..to {
                let x = (column as f64 + 0.5) / across - 1.0;
                let inverse = n.x * x + base;
                let index = row * self.width + column;
                if inverse > self.inverse[index] {
                    self.inverse[index] = inverse;
                    self.items[index] = item;
                }
            }
            covered += to.saturating_sub(from);
        }
        covered
    }
}

/// Where a line of constant y crosses a convex polygon.
fn span(corners: &[(f64, f64)], y: f64) -> Option<(f64, f64)> {
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    for k in 0..corners.len() {
        let (p, q) = (corners[k], corners[(k + 1) % corners.len()]);
        // From below to above, whichever way around: both neighbours compute the same.
        let (p, q) = if p.1 <= q.1 { (p, q) } else { (q, p) };
        if p.1 <= y && y < q.1 {
            let x = p.0 + (q.0 - p.0) * ((y - p.1) / (q.1 - p.1));
            left = left.min(x);
            right = right.max(x);
        }
    }
    (left <= right).then_some((left, right))
}

/// A normal of any length (Newell's method); good for polygons of any size.
fn normal(polygon: &Polygon) -> DVec3 {
    let origin = polygon[0];
    let around = |sum: DVec3, (p, q): (DVec3, DVec3)| sum + (p - origin).cross(q - origin);
    let n = polygon.edges().fold(DVec3::ZERO, around);
    match n.abs().max_element() {
        scale if scale > 0.0 => n / scale,
        _ => DVec3::ZERO,
    }
}

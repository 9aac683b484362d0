//! A facet divided into triangles of any form.

use super::mesh::Located;
use super::piece::{Outline, Piece};
use crate::math::{DVec2, DVec3};

/// Triangles that cover a facet, in the coordinates of its piece.
#[derive(Clone, Debug)]
pub struct Triangulation {
    /// Corners of each, counter-clockwise.
    pub triangles: Vec<[DVec2; 3]>,
    /// Number of the patch that the first triangle is; the others follow.
    pub first: u32,
}

impl Triangulation {
    /// The triangle at `st`, or the nearest one.
    pub fn locate(&self, st: DVec2) -> Located {
        let mut best = (f64::NEG_INFINITY, 0, DVec2::ZERO);
        for (i, triangle) in self.triangles.iter().enumerate() {
            let inside =
                Piece::triangle(triangle.map(|c| DVec3::new(c.x, c.y, 0.0))).locate(st.extend(0.0));
            // The smallest barycentric weight: how far inside.
            let depth = inside.x.min(inside.y).min(1.0 - inside.x - inside.y);
            if depth > best.0 {
                best = (depth, i, inside);
            }
        }
        Located {
            patch: self.first + best.1 as u32,
            st: Outline::Triangle.clamp(best.2),
        }
    }
}

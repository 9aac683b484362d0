//! Points on a surface that a meter measures.

use crate::geom::{Geometry, SurfaceSample};
use crate::math::Vec2;
use crate::math::warp::Tabulated1;

/// A shape whose points can be drawn uniformly.
#[derive(Clone, Debug)]
pub struct Surface {
    geometry: Geometry,
    /// Areas of the triangles of a mesh, and the share of each in the whole.
    triangles: Option<Triangles>,
}

#[derive(Clone, Debug)]
struct Triangles {
    table: Tabulated1,
    shares: Vec<f32>,
}

impl Surface {
    /// `None` for a shape without area, or of more triangles than a table can hold (2^22).
    pub fn new(geometry: Geometry) -> Option<Surface> {
        let area = geometry.area();
        if !(area > 0.0 && area.is_finite()) {
            return None;
        }
        let triangles = match geometry {
            Geometry::Mesh(_) => {
                let share = |prim| (geometry.prim_area(prim) / area) as f32;
                let shares: Vec<f32> = (0..geometry.prim_count()).map(share).collect();
                let table = Tabulated1::new(&shares)?;
                Some(Triangles { table, shares })
            }
            _ => None,
        };
        Some(Surface {
            geometry,
            triangles,
        })
    }

    /// A point by `u` in [0,1)², and how much it counts: 1 but for the rounding of the table, by which
    /// small triangles of large meshes are drawn a little too often.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (SurfaceSample, f32) {
        match &self.triangles {
            None => (self.geometry.sample_area(0, u), 1.0),
            Some(t) => {
                let pick = t.table.pick(u.x);
                let u = Vec2::new(pick.u, u.y);
                let point = self.geometry.sample_area(pick.index as u32, u);
                (point, t.shares[pick.index] / pick.prob)
            }
        }
    }
}

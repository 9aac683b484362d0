//! A facet divided into triangles of any form.

use super::piece::Outline;
use crate::math::DVec2;

/// What irradiance does across a line on a facet: the lowest derivative that jumps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// Irradiance itself: where surfaces touch, and at the shadows of lights without extent.
    Value,
    /// Its slope (or a higher derivative): at the bounds of half-shadows.
    Slope,
}

/// Triangles that cover a facet, in the coordinates of its piece.
#[derive(Clone, Debug, Default)]
pub struct Triangulation {
    /// Corners of each, counter-clockwise.
    pub triangles: Vec<[DVec2; 3]>,
    /// Number of the first triangle's cell in the mesh; the others follow. Where cells are not divided further, as
    /// in [`discontinuity::mesh`](super::discontinuity::mesh), patches have the numbers of their cells.
    pub first: u32,
    /// Numbers of the corners: triangles that share a corner have the same number there.
    pub corners: Vec<[u32; 3]>,
    /// What happens across the side from corner i to corner i + 1; `None` for sides that follow no line.
    pub edges: Vec<[Option<Order>; 3]>,
    /// Cells per axis of the grid over [0,1]².
    cells: u32,
    /// By cell: where its triangles begin in `members`; one more at the end.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Triangulation {
    /// From corners counter-clockwise; `corners` and `edges` as in the fields of these names.
    pub fn new(
        triangles: Vec<[DVec2; 3]>,
        corners: Vec<[u32; 3]>,
        edges: Vec<[Option<Order>; 3]>,
        first: u32,
    ) -> Triangulation {
        // About two cells per triangle.
        let cells = ((2 * triangles.len()) as f64)
            .sqrt()
            .ceil()
            .clamp(1.0, 2048.0) as u32;
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); (cells * cells) as usize];
        for (i, triangle) in triangles.iter().enumerate() {
            for cell in cells_of(triangle, cells) {
                lists[cell].push(i as u32);
            }
        }
        let mut starts = Vec::with_capacity(lists.len() + 1);
        let mut members = Vec::new();
        for list in lists {
            starts.push(members.len() as u32);
            members.extend(list);
        }
        starts.push(members.len() as u32);
        Triangulation {
            triangles,
            first,
            corners,
            edges,
            cells,
            starts,
            members,
        }
    }

    /// The index of the triangle at `st`, or of the nearest one by its weights, and where in the triangle that is:
    /// looks at the few that reach into the same cell of a grid.
    pub fn locate(&self, st: DVec2) -> (u32, DVec2) {
        let scaled = st * f64::from(self.cells);
        let index = |x: f64| (x as u32).min(self.cells.saturating_sub(1));
        let cell = (index(scaled.y) * self.cells + index(scaled.x)) as usize;
        let range = match (self.starts.get(cell), self.starts.get(cell + 1)) {
            (Some(&a), Some(&b)) => a as usize..b as usize,
            _ => 0..0,
        };
        let near = &self.members[range];
        let (depth, i, inside) = self.deepest(near.iter().map(|i| *i as usize), st);
        // Only what rounding put beyond the outline is in no triangle of its cell.
        let (i, inside) = match depth < -1e-6 {
            true => {
                let (_, i, inside) = self.deepest(0..self.triangles.len(), st);
                (i, inside)
            }
            false => (i, inside),
        };
        (i as u32, Outline::Triangle.clamp(inside))
    }

    /// The triangle that `st` is deepest in: its smallest weight, number and the place in it.
    fn deepest(&self, among: impl Iterator<Item = usize>, st: DVec2) -> (f64, usize, DVec2) {
        let mut best = (f64::NEG_INFINITY, 0, DVec2::splat(1.0 / 3.0));
        for i in among {
            let inside = weights(&self.triangles[i], st);
            let depth = inside.x.min(inside.y).min(1.0 - inside.x - inside.y);
            if depth > best.0 {
                best = (depth, i, inside);
            }
        }
        best
    }
}

/// Weights of the second and third corner at `p`; NaN for a triangle without area.
fn weights([a, b, c]: &[DVec2; 3], p: DVec2) -> DVec2 {
    let (e1, e2, d) = (*b - *a, *c - *a, p - *a);
    DVec2::new(d.perp_dot(e2), e1.perp_dot(d)) / e1.perp_dot(e2)
}

/// Numbers of the cells of a grid over [0,1]² that a triangle may reach into.
fn cells_of(triangle: &[DVec2; 3], cells: u32) -> Vec<usize> {
    let n = f64::from(cells);
    let corners = triangle.map(|c| c * n);
    let [a, b, c] = corners;
    // Wider by far more than rounding.
    let margin = 1e-9 * n + 1e-6;
    let index = |x: f64| (x.max(0.0) as u32).min(cells - 1);
    let (low, high) = (a.min(b).min(c) - margin, a.max(b).max(c) + margin);
    let mut found = Vec::new();
    for j in index(low.y)..=index(high.y) {
        for i in index(low.x)..=index(high.x) {
            let middle = DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5);
            // No side has all of the cell on its outer side.
            let apart = (0..3).any(|k| {
                let side = corners[(k + 1) % 3] - corners[k];
                let reach = 0.5 * (side.x.abs() + side.y.abs()) + margin * side.length();
                side.perp_dot(middle - corners[k]) < -reach
            });
            if !apart {
                found.push((j * cells + i) as usize);
            }
        }
    }
    found
}

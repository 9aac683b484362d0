//! One point where corners of patches fall together up to rounding.

use crate::math::DVec3;
use crate::radiosity::PatchMesh;
use std::collections::HashMap;

/// Corners of patches of one surface.
pub struct Welded {
    pub points: Vec<DVec3>,
    /// By point: what is nearer than this is the same.
    pub tolerance: Vec<f64>,
    /// By patch: its corners, in order.
    pub corners: Vec<Vec<u32>>,
}

/// The points of a surface. Facets come from coordinates of single precision, so that corners of neighbours may
/// differ by some of its steps; but never are points joined that are as far apart as a twentieth of an edge there.
pub fn points(mesh: &PatchMesh, patches: &[u32]) -> Welded {
    let piece = |patch: u32| &mesh.patches[patch as usize].piece;
    let largest = patches
        .iter()
        .flat_map(|&p| piece(p).corners())
        .map(|c| c.abs().max_element())
        .fold(0.0, f64::max);
    let rounding = 8.0 * f64::from(f32::EPSILON) * largest;
    let mut found = Found {
        points: Vec::new(),
        tolerance: Vec::new(),
        levels: Vec::new(),
    };
    let corners = patches
        .iter()
        .map(|&patch| {
            let corners: Vec<DVec3> = piece(patch).corners().collect();
            let edges =
                (0..corners.len()).map(|i| corners[i].distance(corners[(i + 1) % corners.len()]));
            let shortest = edges.fold(f64::INFINITY, f64::min);
            let tolerance = rounding.min(0.05 * shortest);
            corners
                .iter()
                .map(|&c| found.number(c, tolerance))
                .collect()
        })
        .collect();
    Welded {
        points: found.points,
        tolerance: found.tolerance,
        corners,
    }
}

/// Points so far, findable by place: in grids whose cells fit the tolerances, which differ where patches are
/// smaller than coordinates are exact.
struct Found {
    points: Vec<DVec3>,
    tolerance: Vec<f64>,
    levels: Vec<Level>,
}

struct Level {
    /// Edge of a cell.
    size: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Found {
    /// The number of the point at `p`, a new one unless there is one.
    fn number(&mut self, p: DVec3, tolerance: f64) -> u32 {
        for level in &self.levels {
            // No farther than either of both tolerances; those here are at most a quarter of a cell.
            let reach = DVec3::splat(tolerance.min(0.25 * level.size));
            let (low, high) = (cell(p - reach, level.size), cell(p + reach, level.size));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let there = level.cells.get(&[x, y, z]).into_iter().flatten();
                        let near = |&&i: &&u32| {
                            let most = tolerance.min(self.tolerance[i as usize]);
                            self.points[i as usize].distance(p) <= most
                        };
                        if let Some(&i) = there.clone().find(near) {
                            // A smaller patch makes it a sharper one.
                            let known = &mut self.tolerance[i as usize];
                            *known = known.min(tolerance);
                            return i;
                        }
                    }
                }
            }
        }
        let number = self.points.len() as u32;
        self.points.push(p);
        self.tolerance.push(tolerance);
        // Powers of two, so that there are few grids; a tolerance of zero leaves only equal points.
        let size = 4.0 * tolerance.max(f64::MIN_POSITIVE).log2().ceil().exp2();
        let known = self.levels.iter().position(|l| l.size == size);
        let level = known.unwrap_or_else(|| {
            self.levels.push(Level {
                size,
                cells: HashMap::new(),
            });
            self.levels.len() - 1
        });
        let place = cell(p, size);
        let level = &mut self.levels[level];
        level.cells.entry(place).or_default().push(number);
        number
    }
}

fn cell(p: DVec3, size: f64) -> [i64; 3] {
    (p / size).floor().to_array().map(|x| x as i64)
}

//! Patches: the surfaces divided as finely as the solution asks for, and which of them a hit lies on.

use super::Rgb64;
use super::optics::{self, Optics};
use super::piece::{Outline, Piece};
use super::surfaces::{Facet, Surfaces};
use super::triangulation::Triangulation;
use crate::geom::Hit;
use crate::math::DVec2;
use crate::scene::Scene;
use rayon::prelude::*;
use std::sync::Arc;

/// A piece of surface of uniform radiosity.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    pub piece: Piece,
    pub facet: u32,
    /// In squared scene units.
    pub area: f64,
    /// Diffuse reflectance, averaged over the patch.
    pub albedo: Rgb64,
    /// Exitance that is emitted, in W/m².
    pub emission: Rgb64,
}

/// Where on a patch something lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    pub patch: u32,
    /// In the coordinates of the patch's piece, inside of it.
    pub st: DVec2,
}

/// How one facet is divided.
#[derive(Clone, Debug)]
pub enum Division {
    /// Equal cells side by side, each divided further on its own.
    Grid(Grid),
    /// Triangles that follow lines across the facet, each divided further on its own.
    Triangles(Box<Triangulation>),
}

/// A facet divided into `n` rows of congruent pieces of its own form; a parallelogram also into columns.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Columns and rows; for triangles both are the same.
    pub n: [u32; 2],
    /// Number of the first cell.
    pub first: u32,
}

/// A square or triangle of a division: a patch, or four cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cell {
    Patch(u32),
    /// The first of four in a row.
    Split(u32),
}

/// All patches.
#[derive(Clone, Debug)]
pub struct PatchMesh {
    pub surfaces: Arc<Surfaces>,
    pub patches: Vec<Patch>,
    /// By facet.
    pub divisions: Vec<Division>,
    pub cells: Vec<Cell>,
}

impl Grid {
    pub fn count(&self, outline: Outline) -> u32 {
        match outline {
            Outline::Parallelogram => self.n[0] * self.n[1],
            Outline::Triangle => self.n[0] * self.n[0],
        }
    }

    /// Cell number `index` of the facet's `piece`, counted from the first.
    pub fn piece(&self, piece: &Piece, index: u32) -> Piece {
        let n = DVec2::new(f64::from(self.n[0]), f64::from(self.n[1]));
        let (i, j, flipped) = match piece.outline {
            Outline::Parallelogram => (index % self.n[0], index / self.n[0], false),
            Outline::Triangle => {
                // Row j has 2 (n - j) - 1 triangles.
                let n = self.n[0];
                let mut j = 0;
                let mut rest = index;
                while rest > 2 * (n - j - 1) {
                    rest -= 2 * (n - j) - 1;
                    j += 1;
                }
                (rest / 2, j, rest % 2 == 1)
            }
        };
        let turn = if flipped { -1.0 } else { 1.0 };
        let corner = DVec2::new(f64::from(i), f64::from(j)) + f64::from(u32::from(flipped));
        Piece {
            o: piece.at(corner / n),
            e1: piece.e1 * (turn / n.x),
            e2: piece.e2 * (turn / n.y),
            outline: piece.outline,
        }
    }

    /// The cell at `st` of the facet, and where in it.
    #[inline]
    fn locate(&self, outline: Outline, st: DVec2) -> (u32, DVec2) {
        let n = DVec2::new(f64::from(self.n[0]), f64::from(self.n[1]));
        let scaled = st * n;
        let clamped = |x: f64, n: u32| (x as u32).min(n.saturating_sub(1));
        let (i, j) = (clamped(scaled.x, self.n[0]), clamped(scaled.y, self.n[1]));
        let inside = scaled - DVec2::new(f64::from(i), f64::from(j));
        match outline {
            Outline::Parallelogram => (j * self.n[0] + i, inside),
            Outline::Triangle => {
                let n = self.n[0];
                // On the long edge rounding may step out of the last cell of the row.
                let i = i.min(n - 1 - j);
                let inside = scaled - DVec2::new(f64::from(i), f64::from(j));
                let row = n * n - (n - j) * (n - j);
                match inside.x + inside.y > 1.0 && i + j + 1 < n {
                    true => (row + 2 * i + 1, DVec2::ONE - inside),
                    false => (row + 2 * i, inside),
                }
            }
        }
    }
}

impl PatchMesh {
    /// Divides all facets evenly, so that no edge of a patch is longer than `size` (in scene units); infinity
    /// leaves facets whole but for the longest strips.
    pub fn uniform(scene: &Scene, surfaces: Arc<Surfaces>, size: f64) -> PatchMesh {
        let mut mesh = PatchMesh {
            patches: Vec::new(),
            divisions: Vec::new(),
            cells: Vec::new(),
            surfaces,
        };
        let surfaces = mesh.surfaces.clone();
        let mut pieces = Vec::new();
        for (i, facet) in surfaces.facets().iter().enumerate() {
            let grid = Grid {
                n: cells_for(&facet.piece, size),
                first: mesh.cells.len() as u32,
            };
            mesh.divisions.push(Division::Grid(grid));
            for index in 0..grid.count(facet.piece.outline) {
                mesh.cells.push(Cell::Patch(pieces.len() as u32));
                pieces.push((i as u32, grid.piece(&facet.piece, index)));
            }
        }
        mesh.patches = patches(scene, &surfaces, &pieces);
        mesh
    }

    pub fn len(&self) -> usize {
        self.patches.len()
    }

    pub fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }

    /// The patch at `hit`, on the side of `hit.wo`; `None` where the surface takes no part.
    #[inline]
    pub fn locate(&self, hit: &Hit) -> Option<Located> {
        let number = self.surfaces.facet_at(hit)?;
        let facet = &self.surfaces.facets()[number as usize];
        let outline = facet.piece.outline;
        let st = outline.clamp(facet.piece.locate(hit.p.as_dvec3()));
        // A cell, its form, and the place in it.
        let (cell, outline, mut st) = match &self.divisions[number as usize] {
            Division::Triangles(triangles) => {
                let (index, inside) = triangles.locate(st);
                (triangles.first + index, Outline::Triangle, inside)
            }
            Division::Grid(grid) => {
                let (index, inside) = grid.locate(outline, st);
                (grid.first + index, outline, inside)
            }
        };
        let mut cell = self.cells[cell as usize];
        loop {
            match cell {
                Cell::Patch(patch) => {
                    let st = outline.clamp(st);
                    return Some(Located { patch, st });
                }
                Cell::Split(first) => {
                    let (child, inside) = outline.child_at(st);
                    cell = self.cells[first as usize + child];
                    st = inside;
                }
            }
        }
    }

    /// The surface at `st` of a patch, seen from its front: on the exact surface, as a ray would have met it.
    pub fn hit(&self, scene: &Scene, patch: u32, st: DVec2) -> Hit {
        let patch = &self.patches[patch as usize];
        on_facet(scene, &self.surfaces, patch.facet, &patch.piece, st)
    }

    /// Σ area, in squared scene units.
    pub fn area(&self) -> f64 {
        self.patches.iter().map(|p| p.area).sum()
    }
}

/// Most patches that a mesh can number.
pub const MOST_PATCHES: u64 = 1 << 30;

/// Columns and rows of a facet for edges of at most `size`; also without a limit, cells are at most twice as
/// long as they are wide, but for needles.
pub fn cells_for(piece: &Piece, size: f64) -> [u32; 2] {
    // Callers refuse what has more cells than this before.
    parts(piece, size).map(|n| n.min(f64::from(1 << 15)) as u32)
}

/// How many patches [`PatchMesh::uniform`] makes of `surfaces`.
pub fn count(surfaces: &Surfaces, size: f64) -> u64 {
    let of = |facet: &Facet| {
        let [a, b] = parts(&facet.piece, size);
        a * b
    };
    surfaces.facets().iter().map(of).sum::<f64>() as u64
}

/// The smallest size, within 2 %, that makes at most `wanted` patches of `surfaces`; infinity where whole facets
/// are more than that.
pub fn size_for(surfaces: &Surfaces, wanted: u64) -> f64 {
    let edges = surfaces.facets().iter().map(|f| f.piece.longest_edge());
    let longest = edges.fold(0.0, f64::max);
    if count(surfaces, longest) > wanted || longest <= 0.0 {
        return f64::INFINITY;
    }
    let (mut small, mut large) = (longest, longest);
    while count(surfaces, small) <= wanted && small > f64::MIN_POSITIVE {
        large = small;
        small *= 0.5;
    }
    while large > 1.02 * small {
        let middle = (large * small).sqrt();
        match count(surfaces, middle) > wanted {
            true => small = middle,
            false => large = middle,
        }
    }
    large
}

/// Columns and rows, which may be more than fit into an integer.
fn parts(piece: &Piece, size: f64) -> [f64; 2] {
    /// Into how many parts a needle is cut for its shape alone.
    const MOST: f64 = 64.0;
    /// By how much an edge may be longer, relatively, so that rounding makes no more of it.
    const ROUNDING: f64 = 1e-6;
    let part = |length: f64, size: f64| (length / size * (1.0 - ROUNDING)).ceil().max(1.0);
    match piece.outline {
        Outline::Triangle => [part(piece.longest_edge(), size); 2],
        Outline::Parallelogram => {
            let (a, b) = (piece.e1.length(), piece.e2.length());
            let shape = (2.0 * a.min(b)).max(a.max(b) / MOST);
            [part(a, size.min(shape)), part(b, size.min(shape))]
        }
    }
}

/// The surface at `st` of a piece of a facet.
pub fn on_facet(scene: &Scene, surfaces: &Surfaces, facet: u32, piece: &Piece, st: DVec2) -> Hit {
    let whole = &surfaces.facets()[facet as usize].piece;
    let st = whole.outline.clamp(whole.locate(piece.at(st)));
    surfaces.hit(scene, facet, st)
}

/// Patches of these facets and pieces, with their optics.
pub fn patches(scene: &Scene, surfaces: &Surfaces, pieces: &[(u32, Piece)]) -> Vec<Patch> {
    let make = |&(facet, piece): &(u32, Piece)| {
        let Optics {
            albedo, emission, ..
        } = of_piece(scene, surfaces, facet, &piece);
        Patch {
            area: piece.area(),
            piece,
            facet,
            albedo,
            emission,
        }
    };
    pieces.par_iter().map(make).collect()
}

/// Optics averaged over a piece of a facet: over more points where the material varies.
pub fn of_piece(scene: &Scene, surfaces: &Surfaces, facet: u32, piece: &Piece) -> Optics {
    let shape = surfaces.facets()[facet as usize].shape;
    let points = if scene.varies(shape) { 64 } else { 1 };
    let look = |st| on_facet(scene, surfaces, facet, piece, st);
    optics::mean(
        scene,
        look,
        piece.outline,
        points,
        surfaces.cut.gloss_as_diffuse,
    )
}

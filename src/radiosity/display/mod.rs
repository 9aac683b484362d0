//! Radiosity as it is displayed: interpolated between shared vertices instead of one value per patch.
//!
//! Vertices are shared by patches that meet smoothly; where patches of different sizes meet, the corners of the
//! small ones also become vertices of the large one, so that neighbours agree along their whole common edge
//! (no T-vertices; Baum, Mann, Smith & Winget 1991). Nothing is shared across creases, surfaces, and lines where
//! the light jumps.

mod hang;
mod join;
mod weights;
mod weld;

use super::{Located, Outline, PatchMesh, Rgb64};
use crate::math::{DVec2, DVec3};
use crate::scene::Scene;
use rayon::prelude::*;
use std::ops::Range;

/// Corners of patches, shared where the surface goes on smoothly.
#[derive(Clone, Debug)]
pub struct Display {
    vertices: Vec<Vertex>,
    /// The vertices around each patch, counter-clockwise from its first corner; those that are no corners of the
    /// patch have `HANGS` set.
    rings: Vec<u32>,
    /// Into `rings`: where each patch begins, and the end.
    first: Vec<u32>,
    /// By vertex: into `shares`, and the end.
    shares_of: Vec<u32>,
    shares: Vec<Share>,
}

/// A corner that one or more patches of a surface have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Relative to the scene's centre, in scene units.
    pub position: DVec3,
    /// Unit length, on the side that is seen.
    pub normal: DVec3,
}

/// How much a patch says about the value at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Share {
    patch: u32,
    weight: f64,
}

/// Marks a vertex that lies on an edge of a patch and is none of its corners.
const HANGS: u32 = 1 << 31;

/// The displayed mesh as triangles.
#[derive(Clone, Debug, Default)]
pub struct Triangles {
    /// The vertices of the display, then the middles of patches that have hanging vertices; or, for one value
    /// per patch, those of each patch apart.
    pub vertices: Vec<Vertex>,
    /// Where the value of each vertex comes from.
    pub sources: Vec<Source>,
    /// Counter-clockwise as seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// By triangle: the patch that it is part of.
    pub patches: Vec<u32>,
}

/// Where a value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    Vertex(u32),
    /// The mean of a patch's corners.
    Middle(u32),
    /// The value of a patch.
    Patch(u32),
}

/// What one surface contributes.
struct Part {
    vertices: Vec<Vertex>,
    /// By patch of the surface, in the numbers of this part.
    rings: Vec<Vec<u32>>,
    shares: Vec<Vec<Share>>,
}

impl Display {
    /// Joins the corners of all patches of `mesh`, which was made of `scene`.
    pub fn new(scene: &Scene, mesh: &PatchMesh) -> Display {
        let surfaces = by_surface(mesh);
        let parts: Vec<Part> = surfaces
            .par_iter()
            .map(|patches| part(scene, mesh, patches))
            .collect();
        let mut vertices = Vec::new();
        let (mut shares_of, mut shares) = (vec![0], Vec::new());
        let mut rings_of: Vec<Vec<u32>> = vec![Vec::new(); mesh.len()];
        for (patches, part) in surfaces.iter().zip(parts) {
            let base = vertices.len() as u32;
            vertices.extend(part.vertices);
            for of_vertex in part.shares {
                shares.extend(of_vertex);
                shares_of.push(shares.len() as u32);
            }
            for (&patch, mut ring) in patches.iter().zip(part.rings) {
                for vertex in &mut ring {
                    *vertex += base;
                }
                rings_of[patch as usize] = ring;
            }
        }
        let (mut rings, mut first) = (Vec::new(), vec![0]);
        for ring in rings_of {
            rings.extend(ring);
            first.push(rings.len() as u32);
        }
        Display {
            vertices,
            rings,
            first,
            shares_of,
            shares,
        }
    }

    pub fn vertices(&self) -> &[Vertex] {
        &self.vertices
    }

    /// The vertices around `patch`, counter-clockwise as seen from its front, and whether each is a corner of it:
    /// the others lie on its edges.
    pub fn ring(&self, patch: u32) -> impl ExactSizeIterator<Item = (u32, bool)> + Clone + '_ {
        let ring = &self.rings[self.range(patch)];
        ring.iter().map(|&v| (v & !HANGS, v & HANGS == 0))
    }

    fn range(&self, patch: u32) -> Range<usize> {
        let i = patch as usize;
        self.first[i] as usize..self.first[i + 1] as usize
    }

    /// A value for each vertex out of one for each patch: a mean over the patches around it, by the angles that
    /// they have there, corrected such that a linear function is kept where patches surround the vertex
    /// (see `weights`). Never outside of the range of the values around.
    pub fn vertex_values(&self, patches: &[Rgb64]) -> Vec<Rgb64> {
        let value = |v: usize| {
            let range = self.shares_of[v] as usize..self.shares_of[v + 1] as usize;
            let shares = self.shares[range].iter();
            shares
                .map(|s| patches[s.patch as usize] * s.weight)
                .sum::<Rgb64>()
        };
        (0..self.vertices.len())
            .into_par_iter()
            .map(value)
            .collect()
    }

    /// The interpolated value at a place of a patch of `mesh`, that this display was made of. `values` is what
    /// [`Display::vertex_values`] gave. Bilinear in a parallelogram, linear in a triangle; a patch with hanging
    /// vertices is a fan of triangles around its middle. Continuous wherever vertices are shared.
    pub fn at(&self, mesh: &PatchMesh, values: &[Rgb64], at: Located) -> Rgb64 {
        let ring = &self.rings[self.range(at.patch)];
        let value = |i: usize| values[(ring[i] & !HANGS) as usize];
        let piece = &mesh.patches[at.patch as usize].piece;
        let (s, t) = (at.st.x, at.st.y);
        match (piece.outline, ring.len()) {
            (Outline::Triangle, 3) => value(0) * (1.0 - s - t) + value(1) * s + value(2) * t,
            (Outline::Parallelogram, 4) => {
                let near = value(0) * (1.0 - s) + value(1) * s;
                let far = value(3) * (1.0 - s) + value(2) * s;
                near * (1.0 - t) + far * t
            }
            _ => {
                let place = |i: usize| {
                    let vertex = (ring[i] & !HANGS) as usize;
                    piece.locate(self.vertices[vertex].position)
                };
                let middle = self.middle(at.patch, values);
                in_fan(ring.len(), place, value, middle, piece.outline, at.st)
            }
        }
    }

    /// The mean over the corners of a patch.
    fn middle(&self, patch: u32, values: &[Rgb64]) -> Rgb64 {
        let corners = self.ring(patch).filter(|(_, corner)| *corner);
        let (sum, n) = corners.fold((Rgb64::ZERO, 0.0), |(sum, n), (v, _)| {
            (sum + values[v as usize], n + 1.0)
        });
        sum / f64::max(n, 1.0)
    }

    /// All patches of `mesh` as triangles without T-vertices. With `shared` vertices are those of the display, for
    /// interpolated values; else each patch has vertices of its own, for one value per patch.
    pub fn triangles(&self, mesh: &PatchMesh, shared: bool) -> Triangles {
        let mut out = Triangles::default();
        if shared {
            out.vertices = self.vertices.clone();
            out.sources = (0..self.vertices.len() as u32)
                .map(Source::Vertex)
                .collect();
        }
        let mut ring = Vec::new();
        for (patch, p) in (0u32..).zip(&mesh.patches) {
            ring.clear();
            ring.extend(self.ring(patch).map(|(v, _)| v));
            let corners = p.piece.outline.corners().len();
            let hangs = ring.len() > corners;
            if !shared {
                for v in &mut ring {
                    out.vertices.push(self.vertices[*v as usize]);
                    out.sources.push(Source::Patch(patch));
                    *v = out.vertices.len() as u32 - 1;
                }
            }
            if hangs {
                let middle = out.vertices.len() as u32;
                let normals: DVec3 = self
                    .ring(patch)
                    .map(|(v, _)| self.vertices[v as usize].normal)
                    .sum();
                out.vertices.push(Vertex {
                    position: p.piece.center(),
                    normal: normals.normalize_or(p.piece.normal()),
                });
                out.sources.push(match shared {
                    true => Source::Middle(patch),
                    false => Source::Patch(patch),
                });
                for (i, &v) in ring.iter().enumerate() {
                    out.triangles.push([middle, v, ring[(i + 1) % ring.len()]]);
                }
            } else if corners == 3 {
                out.triangles.push([ring[0], ring[1], ring[2]]);
            } else {
                // The shorter diagonal makes the better triangles.
                let (e1, e2) = (p.piece.e1, p.piece.e2);
                let turn = usize::from((e1 + e2).length() > (e1 - e2).length());
                let v = |i: usize| ring[(i + turn) % 4];
                out.triangles.push([v(0), v(1), v(2)]);
                out.triangles.push([v(0), v(2), v(3)]);
            }
            out.patches.resize(out.triangles.len(), patch);
        }
        out
    }

    /// The value of each vertex of [`Display::triangles`] out of one for each patch.
    pub fn values(&self, triangles: &Triangles, patches: &[Rgb64]) -> Vec<Rgb64> {
        let vertices = self.vertex_values(patches);
        let value = |source: &Source| match *source {
            Source::Vertex(v) => vertices[v as usize],
            Source::Middle(patch) => self.middle(patch, &vertices),
            Source::Patch(patch) => patches[patch as usize],
        };
        triangles.sources.iter().map(value).collect()
    }
}

/// The value at `st` of a fan of triangles around the middle of a piece, between `n` places around it.
fn in_fan(
    n: usize,
    place: impl Fn(usize) -> DVec2,
    value: impl Fn(usize) -> Rgb64,
    middle: Rgb64,
    outline: Outline,
    st: DVec2,
) -> Rgb64 {
    let center = outline.center();
    let d = st - center;
    let mut best = (f64::NEG_INFINITY, middle);
    for i in 0..n {
        let next = (i + 1) % n;
        let (a, b) = (place(i) - center, place(next) - center);
        let whole = a.perp_dot(b);
        if whole <= 0.0 {
            continue;
        }
        let (wa, wb) = (d.perp_dot(b) / whole, a.perp_dot(d) / whole);
        // The triangle that `st` is deepest inside of, or least outside by rounding.
        let depth = wa.min(wb);
        if depth > best.0 {
            let (wa, wb) = (wa.max(0.0), wb.max(0.0));
            let scale = 1.0 / f64::max(wa + wb, 1.0);
            let (wa, wb) = (wa * scale, wb * scale);
            best = (
                depth,
                middle * (1.0 - wa - wb) + value(i) * wa + value(next) * wb,
            );
        }
    }
    best.1
}

/// The patches of each surface, in order.
fn by_surface(mesh: &PatchMesh) -> Vec<Vec<u32>> {
    let surface = |patch: u32| {
        let facet = mesh.patches[patch as usize].facet;
        mesh.surfaces.facets()[facet as usize].surface
    };
    let mut order: Vec<(u32, u32)> = (0..mesh.len() as u32).map(|p| (surface(p), p)).collect();
    order.sort_unstable();
    order
        .chunk_by(|a, b| a.0 == b.0)
        .map(|chunk| chunk.iter().map(|&(_, patch)| patch).collect())
        .collect()
}

/// Joins the corners of the patches of one surface.
fn part(scene: &Scene, mesh: &PatchMesh, patches: &[u32]) -> Part {
    let welded = weld::points(mesh, patches);
    let rings = hang::rings(&welded);
    let slots = join::Slots::new(scene, mesh, patches, &welded, &rings);
    let (vertex_of, count) = slots.join(mesh, patches, &rings);
    let mut vertices = vec![
        Vertex {
            position: DVec3::ZERO,
            normal: DVec3::ZERO,
        };
        count
    ];
    let mut around: Vec<Vec<weights::Around>> = vec![Vec::new(); count];
    let mut out = Vec::with_capacity(rings.len());
    let mut slot = 0;
    for (i, ring) in rings.iter().enumerate() {
        let piece = &mesh.patches[patches[i] as usize].piece;
        let mut of_patch = Vec::with_capacity(ring.len());
        for k in 0..ring.len() {
            let vertex = vertex_of[slot + k];
            let point = |k: usize| welded.points[ring[k % ring.len()].point as usize];
            let p = point(k);
            vertices[vertex as usize].position = p;
            let angle = weights::angle(point(k + ring.len() - 1) - p, point(k + 1) - p);
            // By angle, as the values: independent of how a flat part is divided.
            vertices[vertex as usize].normal += slots.normals[slot + k] * angle;
            around[vertex as usize].push(weights::Around {
                patch: patches[i],
                angle,
                to_center: piece.center() - p,
            });
            of_patch.push(vertex | if ring[k].hangs { HANGS } else { 0 });
        }
        slot += ring.len();
        out.push(of_patch);
    }
    for (vertex, around) in vertices.iter_mut().zip(&around) {
        let some = around
            .first()
            .map_or(DVec3::Z, |a| mesh.patches[a.patch as usize].piece.normal());
        vertex.normal = vertex.normal.normalize_or(some);
    }
    let weigh = |(vertex, around): (&Vertex, &Vec<weights::Around>)| {
        let weights = weights::weights(around, vertex.normal);
        let share = |(a, weight): (&weights::Around, f64)| Share {
            patch: a.patch,
            weight,
        };
        around.iter().zip(weights).map(share).collect()
    };
    let shares = vertices.iter().zip(&around).map(weigh).collect();
    Part {
        vertices,
        rings: out,
        shares,
    }
}

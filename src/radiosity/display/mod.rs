//! Radiosity as it is displayed: interpolated between shared vertices instead of one value per patch.
//!
//! Vertices are shared by patches that meet smoothly; where patches of different sizes meet, the corners of the
//! small ones also become vertices of the large one, so that neighbours agree along their whole common edge
//! (no T-vertices; Baum, Mann, Smith & Winget 1991). Nothing is shared across creases, surfaces, and lines where
//! the light jumps.

mod hang;
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
    let slots = Slots::new(scene, mesh, patches, &welded, &rings);
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

/// The places around the patches of a surface, one after the other, before they are joined.
struct Slots {
    /// As shading has it, or that of the patch on flat surfaces; on the side that is seen.
    normals: Vec<DVec3>,
}

/// Surfaces whose normals differ by less than this angle's cosine (0.3 degrees) go on flat.
const FLAT: f64 = 1.0 - 1.4e-5;
/// Shading normals of patches that meet smoothly are equal but for rounding and the curve's flattening (8 degrees).
const SMOOTH: f64 = 0.99;

impl Slots {
    fn new(
        scene: &Scene,
        mesh: &PatchMesh,
        patches: &[u32],
        welded: &weld::Welded,
        rings: &[Vec<hang::Place>],
    ) -> Slots {
        let mut normals = Vec::with_capacity(rings.iter().map(Vec::len).sum());
        for (&patch, ring) in patches.iter().zip(rings) {
            let p = &mesh.patches[patch as usize];
            let flat = p.piece.normal();
            let smooth = mesh.surfaces.facets()[p.facet as usize].smooth;
            for place in ring {
                normals.push(match smooth {
                    false => flat,
                    true => {
                        let st = p.piece.locate(welded.points[place.point as usize]);
                        let hit = mesh.hit(scene, patch, p.piece.outline.clamp(st));
                        let n = hit.frame.n.as_dvec3();
                        match n.dot(flat) < 0.0 {
                            true => -n,
                            false => n,
                        }
                    }
                });
            }
        }
        Slots { normals }
    }

    /// The vertex of each slot, and how many there are.
    fn join(
        &self,
        mesh: &PatchMesh,
        patches: &[u32],
        rings: &[Vec<hang::Place>],
    ) -> (Vec<u32>, usize) {
        let mut edges = Vec::with_capacity(self.normals.len());
        let mut slot = 0u32;
        for (i, ring) in (0u32..).zip(rings) {
            let n = ring.len() as u32;
            for k in 0..n {
                let (from, to) = (slot + k, slot + (k + 1) % n);
                let (p, q) = (ring[k as usize].point, ring[((k + 1) % n) as usize].point);
                edges.push(Edge {
                    ends: [p.min(q), p.max(q)],
                    backward: p > q,
                    slots: if p > q { [to, from] } else { [from, to] },
                    patch: patches[i as usize],
                    jump: jumps(mesh, patches[i as usize], ring[k as usize].edge),
                });
            }
            slot += n;
        }
        edges.sort_unstable_by_key(|e| (e.ends, e.backward, e.slots));
        let mut groups = Groups::new(self.normals.len());
        for along in edges.chunk_by(|a, b| a.ends == b.ends) {
            // More than two at an edge: which goes on as which is not known.
            if let [a, b] = along
                && a.backward != b.backward
                && !(a.jump || b.jump)
                && self.goes_on(mesh, a, b)
            {
                for end in 0..2 {
                    groups.unite(a.slots[end], b.slots[end]);
                }
            }
        }
        groups.numbers()
    }

    /// Whether a surface is smooth across an edge.
    fn goes_on(&self, mesh: &PatchMesh, a: &Edge, b: &Edge) -> bool {
        let [p, q] = [a, b].map(|e| &mesh.patches[e.patch as usize]);
        if p.piece.normal().dot(q.piece.normal()) >= FLAT {
            return true;
        }
        let smooth = |facet: u32| mesh.surfaces.facets()[facet as usize].smooth;
        let alike = |end: usize| {
            let [m, n] = [a, b].map(|e| self.normals[e.slots[end] as usize]);
            m.dot(n) >= SMOOTH
        };
        smooth(p.facet) && smooth(q.facet) && alike(0) && alike(1)
    }
}

/// A part of an edge between neighbouring places around a patch.
struct Edge {
    /// Points, the smaller number first, and the slots there.
    ends: [u32; 2],
    slots: [u32; 2],
    /// Whether the patch runs from the second end to the first.
    backward: bool,
    patch: u32,
    jump: bool,
}

/// Whether light jumps across edge number `edge` of a patch.
fn jumps(_mesh: &PatchMesh, _patch: u32, _edge: u8) -> bool {
    false
}

/// Disjoint groups of slots.
struct Groups(Vec<u32>);

impl Groups {
    fn new(n: usize) -> Groups {
        Groups((0..n as u32).collect())
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let up = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = up;
            i = up;
        }
        i
    }

    fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // The smaller number stays, whatever the order of unions.
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// By slot, the number of its group, in the order of first slots; and the count of groups.
    fn numbers(mut self) -> (Vec<u32>, usize) {
        let mut numbers = vec![0; self.0.len()];
        let mut count = 0;
        for slot in 0..self.0.len() {
            let root = self.root(slot as u32) as usize;
            if root == slot {
                numbers[slot] = count;
                count += 1;
            } else {
                numbers[slot] = numbers[root];
            }
        }
        (numbers, count as usize)
    }
}

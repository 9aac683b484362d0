//! Which corners of patches are one vertex: those at one point, of patches that a smooth surface joins there.

use super::hang::Place;
use super::weld::Welded;
use crate::math::DVec3;
use crate::radiosity::PatchMesh;
use crate::radiosity::mesh::Division;
use crate::radiosity::triangulation::Order;
use crate::scene::Scene;

/// The places around the patches of a surface, one after the other, before they are joined.
pub struct Slots {
    /// As shading has it, or that of the patch on flat surfaces; on the side that is seen.
    pub normals: Vec<DVec3>,
}

/// Surfaces whose normals differ by less than this angle's cosine (0.3 degrees) go on flat.
const FLAT: f64 = 1.0 - 1.4e-5;
/// Shading normals of patches that meet smoothly are equal but for rounding and the curve's flattening (8 degrees).
const SMOOTH: f64 = 0.99;

impl Slots {
    pub fn new(
        scene: &Scene,
        mesh: &PatchMesh,
        patches: &[u32],
        welded: &Welded,
        rings: &[Vec<Place>],
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
    pub fn join(
        &self,
        mesh: &PatchMesh,
        patches: &[u32],
        rings: &[Vec<Place>],
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

/// Whether light jumps across edge number `edge` of a patch: where something touches the surface, and at shadows of
/// lights without extent.
fn jumps(mesh: &PatchMesh, patch: u32, edge: u8) -> bool {
    let facet = mesh.patches[patch as usize].facet;
    match &mesh.divisions[facet as usize] {
        Division::Grid(_) => false,
        Division::Triangles(triangles) => {
            let edges = triangles.edges.get((patch - triangles.first) as usize);
            edges.is_some_and(|e| e.get(usize::from(edge)) == Some(&Some(Order::Value)))
        }
    }
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

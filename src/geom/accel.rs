//! The acceleration structure: which surface does a ray meet first, and does it meet any.
//!
//! Triangles of all meshes and the boxes of all other shapes stand in one 8-wide tree (`wide`). It is
//! built as a binary tree by binned SAH, improved by obvhs' parallel reinsertion (Meister & Bittner
//! 2017), and collapsed. What a shape other than a mesh is, and which meetings a mask lets pass, the
//! caller says through [`Hooks`].

use super::wide::binary::{self, BinaryNode, Prim, half_area};
use super::wide::{self, Found, Leaf, OTHER, Wide, collapse};
use super::{RawHit, Ray, ShapeId};
use crate::math::{Aabb, DVec3, Vec2, Vec3};
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};
use rayon::prelude::*;

/// A triangle mesh to build over.
#[derive(Clone, Copy)]
pub struct MeshRef<'a> {
    pub shape: ShapeId,
    pub positions: &'a [Vec3],
    /// Corners of each triangle, as indices of `positions`.
    pub indices: &'a [[u32; 3]],
}

/// What the acceleration structure must ask about shapes. Resolved at compile time: a scene of meshes
/// without masks uses `()` and pays for nothing here.
pub trait Hooks {
    /// Whether there are shapes other than meshes; without, they are not hit.
    const SHAPES: bool;
    /// Whether some meeting may be refused.
    const FILTERS: bool;

    /// Nearest meeting of `ray` with a shape that is no mesh, `0 < t <= ray.t_max`: the distance and
    /// the surface parameters.
    fn intersect(&self, shape: ShapeId, ray: &Ray) -> Option<(f32, Vec2)>;

    /// Whether a meeting with a triangle counts; false where a mask lets the ray through.
    fn accept(&self, shape: ShapeId, prim: u32, uv: Vec2) -> bool;
}

impl Hooks for () {
    const SHAPES: bool = false;
    const FILTERS: bool = false;

    fn intersect(&self, _: ShapeId, _: &Ray) -> Option<(f32, Vec2)> {
        None
    }

    fn accept(&self, _: ShapeId, _: u32, _: Vec2) -> bool {
        true
    }
}

/// The tree over a scene, immutable.
pub struct Accel {
    wide: Wide,
    /// Number of the first triangle of each mesh, ascending, and its shape.
    meshes: Vec<(u32, ShapeId)>,
    /// Shapes that are no mesh.
    others: Vec<ShapeId>,
    bounds: Aabb,
    depth: u32,
}

/// Depth of the binary tree at which splits by cost give way to halving. Deep enough for any sensible
/// scene, whose trees stay below 40.
const BINARY_DEPTH: u32 = 64;

impl Accel {
    /// Most triangles, and most other shapes, that can be built over.
    pub const MAX_PRIMS: usize = wide::MAX_PRIMS;

    /// Build over meshes and other shapes. Triangles with corners that are not finite or do not exist,
    /// and those whose area is zero, are left out, as are shapes with infinite or empty boxes. The
    /// result does not depend on the number of threads.
    ///
    /// # Panics
    /// With more than [`Accel::MAX_PRIMS`] triangles or shapes, some 70 gigabytes; whoever reads files
    /// checks that.
    pub fn build(meshes: &[MeshRef<'_>], others: &[(ShapeId, Aabb)]) -> Accel {
        let scene = Input::new(meshes, others);
        let mut prims = scene.prims();
        let bounds = prims.iter().fold(Aabb::EMPTY, |b, p| b.union(p.bounds()));
        let (wide, depth) = if prims.is_empty() {
            (Wide::empty(), 0)
        } else {
            let tree = improve(binary::build(&mut prims, BINARY_DEPTH));
            let (wide, depth) = collapse::collapse(&tree, &scene);
            if depth <= wide::MAX_DEPTH {
                (wide, depth)
            } else {
                // Each wide level takes at least one binary level, so this one cannot be too deep.
                let tree = binary::build(&mut prims, wide::MAX_DEPTH - 1);
                collapse::collapse(&tree, &scene)
            }
        };
        Accel {
            wide,
            meshes: scene
                .first
                .iter()
                .copied()
                .zip(meshes.iter().map(|m| m.shape))
                .collect(),
            others: others.iter().map(|o| o.0).collect(),
            bounds,
            depth,
        }
    }

    /// The nearest meeting with `0 < t <= ray.t_max`, in a scene of meshes without masks.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<RawHit> {
        self.intersect_with(ray, &())
    }

    /// Whether `ray` meets anything with `0 < t <= ray.t_max`, in a scene of meshes without masks.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_with(ray, &())
    }

    /// The nearest meeting with `0 < t <= ray.t_max`.
    #[inline]
    pub fn intersect_with<H: Hooks>(&self, ray: &Ray, hooks: &H) -> Option<RawHit> {
        let found = self.wide.nearest(ray, &Hooked { accel: self, hooks })?;
        let Found { t, id, uv } = found;
        let (shape, prim) = if H::SHAPES && id & OTHER != 0 {
            (self.others[(id & !OTHER) as usize], 0)
        } else {
            self.triangle(id)
        };
        Some(RawHit { t, shape, prim, uv })
    }

    /// Whether `ray` meets anything with `0 < t <= ray.t_max`.
    #[inline]
    pub fn occluded_with<H: Hooks>(&self, ray: &Ray, hooks: &H) -> bool {
        self.wide.any(ray, &Hooked { accel: self, hooks })
    }

    /// The box of everything that can be hit; empty for an empty scene.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Memory in bytes, the input meshes not counted.
    pub fn bytes(&self) -> usize {
        self.wide.bytes() + size_of_val(&self.meshes[..]) + size_of_val(&self.others[..])
    }

    /// Levels of the tree.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// The tree itself, for tests and benchmarks.
    pub fn wide(&self) -> &Wide {
        &self.wide
    }

    /// Trace with plain arrays even where AVX2 is there; same results bit for bit, slower.
    pub fn force_plain(&mut self) {
        self.wide.force_plain();
    }

    /// Shape and triangle of a global triangle number.
    #[inline]
    fn triangle(&self, id: u32) -> (ShapeId, u32) {
        let at = match self.meshes.len() {
            1 => 0,
            _ => self.meshes.partition_point(|m| m.0 <= id) - 1,
        };
        let (first, shape) = self.meshes[at];
        (shape, id - first)
    }
}

/// The caller's hooks, as leaves of the tree.
struct Hooked<'a, H> {
    accel: &'a Accel,
    hooks: &'a H,
}

impl<H: Hooks> Leaf for Hooked<'_, H> {
    const OTHERS: bool = H::SHAPES;
    const FILTERS: bool = H::FILTERS;

    #[inline]
    fn other(&self, index: u32, ray: &Ray) -> Option<(f32, Vec2)> {
        self.hooks.intersect(self.accel.others[index as usize], ray)
    }

    #[inline]
    fn accept(&self, triangle: u32, uv: Vec2) -> bool {
        let (shape, prim) = self.accel.triangle(triangle);
        self.hooks.accept(shape, prim, uv)
    }
}

/// The primitives under one numbering: the triangles of all meshes, then the other shapes.
struct Input<'a> {
    meshes: &'a [MeshRef<'a>],
    others: &'a [(ShapeId, Aabb)],
    /// Number of the first triangle of each mesh.
    first: Vec<u32>,
    triangles: u32,
}

impl<'a> Input<'a> {
    fn new(meshes: &'a [MeshRef<'a>], others: &'a [(ShapeId, Aabb)]) -> Input<'a> {
        let triangles: usize = meshes.iter().map(|m| m.indices.len()).sum();
        let most = triangles.max(others.len());
        assert!(most <= Accel::MAX_PRIMS, "{most} primitives are too many");
        let mut next = 0;
        let mut first = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            first.push(next);
            next += mesh.indices.len() as u32;
        }
        Input {
            meshes,
            others,
            first,
            triangles: next,
        }
    }

    fn prims(&self) -> Vec<Prim> {
        let mut prims = Vec::with_capacity(self.triangles as usize + self.others.len());
        for (mesh, &first) in self.meshes.iter().zip(&self.first) {
            let prim = |(i, t): (usize, &[u32; 3])| {
                let [a, b, c] = corners(mesh, t)?;
                let bounds = Aabb {
                    min: a.min(b).min(c),
                    max: a.max(b).max(c),
                };
                usable([a, b, c]).then(|| Prim::new(bounds, first + i as u32))
            };
            if mesh.indices.len() > 100_000 {
                prims.par_extend(mesh.indices.par_iter().enumerate().filter_map(prim));
            } else {
                prims.extend(mesh.indices.iter().enumerate().filter_map(prim));
            }
        }
        for (i, &(_, b)) in self.others.iter().enumerate() {
            if b.min.is_finite() && b.max.is_finite() && !b.is_empty() {
                prims.push(Prim::new(b, self.triangles + i as u32));
            }
        }
        prims
    }
}

fn corners(mesh: &MeshRef<'_>, t: &[u32; 3]) -> Option<[Vec3; 3]> {
    let at = |i: u32| mesh.positions.get(i as usize).copied();
    Some([at(t[0])?, at(t[1])?, at(t[2])?])
}

/// Finite and of non-zero area. In double precision the differences of floats of like size are exact,
/// so this finds the triangles that are exactly degenerate.
fn usable([a, b, c]: [Vec3; 3]) -> bool {
    let finite = a.is_finite() && b.is_finite() && c.is_finite();
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    finite && (b - a).cross(c - a) != DVec3::ZERO
}

impl collapse::Source for Input<'_> {
    fn triangle(&self, id: u32) -> Option<[Vec3; 3]> {
        let at = self.first.partition_point(|&f| f <= id).checked_sub(1)?;
        let mesh = &self.meshes[at];
        corners(mesh, mesh.indices.get((id - self.first[at]) as usize)?)
    }

    fn other(&self, id: u32) -> u32 {
        id - self.triangles
    }

    fn is_triangle(&self, id: u32) -> bool {
        id < self.triangles
    }
}

/// Share of the nodes that reinsertion tries to place better, in each of its rounds.
const REINSERTION: f32 = 0.05;
/// Expected number of nodes that a ray through the scene's box meets, up to which reinsertion runs at
/// full share. Its search visits about as many, so beyond this (thousands of nested or coincident
/// boxes) the share shrinks and the work stays near-linear.
const REINSERTION_COST: f32 = 400.0;

/// Move subtrees to where they enlarge the tree's boxes less.
fn improve(tree: Vec<BinaryNode>) -> Vec<BinaryNode> {
    let root = half_area(&tree[0].bounds);
    let area = tree.iter().map(|n| f64::from(half_area(&n.bounds)));
    let cost = (area.sum::<f64>() / f64::from(root)) as f32;
    // Areas that over- or underflow would make obvhs compare NaNs.
    if tree.len() < 8 || !(root.is_normal() && cost.is_finite()) {
        return tree;
    }
    let share = REINSERTION * (REINSERTION_COST / cost).min(1.0);
    let mut bvh = Bvh2::zeroed(0);
    bvh.nodes = tree
        .par_iter()
        .map(|n| {
            let b = obvhs::aabb::Aabb::new(n.bounds.min.into(), n.bounds.max.into());
            Bvh2Node::new(b, n.leaf.into(), n.first)
        })
        .collect();
    // Stack of the search; a subtree moved in makes a path longer by one.
    bvh.max_depth = 8 * BINARY_DEPTH as usize;
    ReinsertionOptimizer::default().run(&mut bvh, share, None);
    bvh.nodes
        .par_iter()
        .map(|n| BinaryNode {
            bounds: Aabb {
                min: n.aabb.min.into(),
                max: n.aabb.max.into(),
            },
            first: n.first_index,
            leaf: n.prim_count > 0,
        })
        .collect()
}

#[cfg(test)]
mod tests;

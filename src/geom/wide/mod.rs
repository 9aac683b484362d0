//! The 8-wide bounding volume hierarchy: its memory, and the choice of instruction set.
//!
//! Traversal ([`trace`]) is written once over the eight-lane operations of [`Isa`]; AVX2 and plain
//! arrays implement them with the same roundings, so both return the same bits. The tree comes from a
//! binary one ([`binary`], built by binned SAH) cut by dynamic programming ([`collapse`]). Shapes,
//! materials and obvhs are the business of `accel`.

mod avx2;
pub mod binary;
pub mod collapse;
mod isa;
mod stack;
mod trace;

pub use trace::{Found, Leaf};

use super::Ray;
use crate::math::{Aabb, Vec3};
use avx2::Avx2;
use isa::Plain;

/// Boxes and triangles tested at once.
pub const WIDTH: usize = 8;

/// Depth of the wide tree that the traversal stack is made for; [`collapse`] reports what it reached.
pub const MAX_DEPTH: u32 = 36;

/// Number of triangles, and of other primitives, that a child word can address with room to spare.
pub const MAX_PRIMS: usize = 1 << 30;

/// Set in [`Found::id`] when a primitive other than a triangle was hit.
pub const OTHER: u32 = 1 << 31;

/// One number for each of the eight children or triangles.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Lanes<T>(pub [T; WIDTH]);

/// A child word: an inner node, a run of packs, one primitive that is no triangle, or nothing.
///
/// Bit 31 marks a leaf, bits 28 to 30 give its number of packs (0: another primitive), the rest is the
/// index of the node, of the first pack or of the primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Child(pub u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const INDEX: u32 = (1 << 28) - 1;
    /// Never followed: the box of an empty slot is empty, and the root is checked.
    pub const EMPTY: Child = Child(u32::MAX);

    fn node(index: usize) -> Child {
        Child(index as u32)
    }

    fn packs(first: usize, count: usize) -> Child {
        Child(Child::LEAF | (count as u32) << 28 | first as u32)
    }

    fn other(index: u32) -> Child {
        Child(Child::LEAF | index)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & Child::LEAF != 0
    }

    #[inline(always)]
    fn pack_count(self) -> usize {
        (self.0 >> 28 & 7) as usize
    }

    #[inline(always)]
    fn leaf_index(self) -> usize {
        (self.0 & Child::INDEX) as usize
    }
}

/// Eight boxes and what they hold. 256 bytes, four cache lines.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Node {
    /// Lower, then upper bounds; each by axis. Empty slots have infinite, inverted boxes.
    planes: [[Lanes<f32>; 3]; 2],
    child: [Child; WIDTH],
}

impl Node {
    const EMPTY: Node = Node {
        planes: [
            [Lanes([f32::INFINITY; WIDTH]); 3],
            [Lanes([f32::NEG_INFINITY; WIDTH]); 3],
        ],
        child: [Child::EMPTY; WIDTH],
    };

    fn set(&mut self, slot: usize, bounds: Aabb) {
        for axis in 0..3 {
            self.planes[0][axis].0[slot] = bounds.min[axis];
            self.planes[1][axis].0[slot] = bounds.max[axis];
        }
    }
}

/// Eight triangles. 320 bytes, five cache lines.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Pack {
    /// Coordinates by axis, then by corner. Unused lanes are NaN, which no comparison accepts; zeros
    /// would send each partly filled pack down the double-precision path.
    corner: [[Lanes<f32>; 3]; 3],
    id: [u32; WIDTH],
}

impl Pack {
    const EMPTY: Pack = Pack {
        corner: [[Lanes([f32::NAN; WIDTH]); 3]; 3],
        id: [u32::MAX; WIDTH],
    };

    fn set(&mut self, lane: usize, corners: [Vec3; 3]) {
        for (axis, to) in self.corner.iter_mut().enumerate() {
            for (to, corner) in to.iter_mut().zip(corners) {
                to.0[lane] = corner[axis];
            }
        }
    }
}

/// The tree as it is traversed.
pub struct Wide {
    nodes: Vec<Node>,
    packs: Vec<Pack>,
    root: Child,
    avx2: Option<Avx2>,
}

impl Wide {
    fn new(nodes: Vec<Node>, packs: Vec<Pack>, root: Child) -> Wide {
        let avx2 = Avx2::detect();
        Wide {
            nodes,
            packs,
            root,
            avx2,
        }
    }

    /// A tree that nothing hits.
    pub fn empty() -> Wide {
        Wide::new(Vec::new(), Vec::new(), Child::EMPTY)
    }

    /// Use plain arrays even where AVX2 is there: the results are the same bits, only slower.
    pub fn force_plain(&mut self) {
        self.avx2 = None;
    }

    /// The nearest primitive with `0 < t <= ray.t_max`.
    #[inline]
    pub fn nearest<L: Leaf>(&self, ray: &Ray, leaf: &L) -> Option<Found> {
        match self.avx2 {
            Some(isa) => avx2::trace::<L, false>(isa, self, ray, leaf),
            None => trace::trace::<Plain, L, false>(Plain, self, ray, leaf),
        }
    }

    /// Whether any primitive has `0 < t <= ray.t_max`.
    #[inline]
    pub fn any<L: Leaf>(&self, ray: &Ray, leaf: &L) -> bool {
        match self.avx2 {
            Some(isa) => avx2::trace::<L, true>(isa, self, ray, leaf).is_some(),
            None => trace::trace::<Plain, L, true>(Plain, self, ray, leaf).is_some(),
        }
    }

    /// Memory of nodes and packs.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.packs[..])
    }

    /// A hash of every bit of the tree (FNV-1a over words), to compare trees with.
    pub fn fingerprint(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325u64;
        let mut add = |x: u32| hash = (hash ^ u64::from(x)).wrapping_mul(0x0100_0000_01b3);
        for node in &self.nodes {
            let planes = node.planes.as_flattened();
            planes
                .iter()
                .flat_map(|l| l.0)
                .for_each(|x| add(x.to_bits()));
            node.child.iter().for_each(|c| add(c.0));
        }
        for pack in &self.packs {
            let corners = pack.corner.as_flattened();
            corners
                .iter()
                .flat_map(|l| l.0)
                .for_each(|x| add(x.to_bits()));
            pack.id.iter().for_each(|&id| add(id));
        }
        hash
    }

    /// Nodes, packs, and the mean number of children and of triangles in them: how well they are filled.
    pub fn stats(&self) -> (usize, usize, f64, f64) {
        let used = |n: usize, of: usize| n as f64 / of.max(1) as f64;
        let children = self.nodes.iter().flat_map(|n| n.child);
        let children = children.filter(|&c| c != Child::EMPTY).count();
        let ids = self.packs.iter().flat_map(|p| p.id);
        let triangles = ids.filter(|&id| id != u32::MAX).count();
        let (nodes, packs) = (self.nodes.len(), self.packs.len());
        (nodes, packs, used(children, nodes), used(triangles, packs))
    }
}

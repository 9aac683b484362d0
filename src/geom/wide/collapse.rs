//! From the binary tree to the wide one: the cut of least expected cost by dynamic programming
//! (Ylitie, Karras & Laine 2017, "Efficient incoherent ray traversal on GPUs through compressed wide
//! BVHs", section 3.1), and the packing of triangles by eight.

use super::binary::{BinaryNode, half_area};
use super::{Child, Node, Pack, WIDTH, Wide};
use crate::math::Vec3;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Cost of testing a pack, relative to a node. Below its true value, about one: fuller packs save
/// memory and cost no speed.
const PACK_COST: f32 = 0.6;
/// Cost of a primitive that is no triangle: called one by one, in double precision.
const OTHER_COST: f32 = 1.0;
/// Most triangles in a leaf.
const LEAF_MAX: u32 = 2 * WIDTH as u32;

/// What the packing must know of the primitives.
pub trait Source: Sync {
    /// Corners of a triangle, or `None` if `id` is another primitive.
    fn triangle(&self, id: u32) -> Option<[Vec3; 3]>;
    /// Index of another primitive, as [`super::Leaf::other`] gets it.
    fn other(&self, id: u32) -> u32;
    fn is_triangle(&self, id: u32) -> bool;
}

/// Collapse `tree`, root first. Also gives the depth of the result; traverse it only if that is at
/// most [`super::MAX_DEPTH`].
pub fn collapse<S: Source>(tree: &[BinaryNode], source: &S) -> (Wide, u32) {
    if tree.is_empty() {
        return (Wide::empty(), 0);
    }
    let plan = Plan {
        tree,
        source,
        cost: (0..tree.len()).map(|_| Default::default()).collect(),
    };
    plan.solve(0, 0);
    let mut parts = Vec::new();
    plan.subtrees(0, 2, &mut parts);
    let parts: Vec<Part> = {
        use rayon::prelude::*;
        parts.par_iter().map(|&n| plan.part(n)).collect()
    };
    let mut out = Part::default();
    out.nodes
        .reserve(parts.iter().map(|p| p.nodes.len()).sum::<usize>() + 1 + WIDTH);
    out.packs.reserve(parts.iter().map(|p| p.packs.len()).sum());
    let mut parts = parts.into_iter();
    out.root = plan.join(0, 2, &mut parts, &mut out);
    (Wide::new(out.nodes, out.packs, out.root), out.depth)
}

/// Part of the wide tree, with indices of its own.
struct Part {
    nodes: Vec<Node>,
    packs: Vec<Pack>,
    root: Child,
    depth: u32,
}

impl Default for Part {
    fn default() -> Part {
        Part {
            nodes: Vec::new(),
            packs: Vec::new(),
            root: Child::EMPTY,
            depth: 0,
        }
    }
}

impl Part {
    /// Append `part`; gives its root as seen from here.
    fn append(&mut self, part: Part) -> Child {
        let (nodes, packs) = (self.nodes.len() as u32, self.packs.len() as u32);
        let moved = |c: Child| match c {
            Child::EMPTY => c,
            c if !c.is_leaf() => Child(c.0 + nodes),
            c if c.pack_count() > 0 => Child(c.0 + packs),
            other => other,
        };
        self.packs.extend_from_slice(&part.packs);
        self.nodes.extend(part.nodes.iter().map(|n| Node {
            child: n.child.map(moved),
            ..*n
        }));
        moved(part.root)
    }
}

/// The least cost of representing a binary subtree by at most 1, 2, … 7 wide children; and 1 in the
/// last place if as one child it is a leaf. Atomic only so that subtrees may be solved in parallel.
type Costs = [AtomicU32; WIDTH];

struct Plan<'a, S> {
    tree: &'a [BinaryNode],
    source: &'a S,
    cost: Vec<Costs>,
}

/// Levels of the binary tree whose children are solved in parallel.
const PARALLEL_LEVELS: u32 = 10;

impl<S: Source> Plan<'_, S> {
    /// Fill the costs of the subtree at `n`; gives them with the number of its triangles, which is
    /// above [`LEAF_MAX`] if it cannot be a leaf.
    fn solve(&self, n: usize, level: u32) -> ([f32; WIDTH - 1], u32) {
        let node = &self.tree[n];
        let area = half_area(&node.bounds);
        let (costs, triangles, is_leaf) = if node.leaf {
            let triangle = self.source.is_triangle(node.first);
            let cost = area * if triangle { PACK_COST } else { OTHER_COST };
            let triangles = if triangle { 1 } else { LEAF_MAX + 1 };
            ([cost; WIDTH - 1], triangles, true)
        } else {
            let (l, r) = (node.first as usize, node.first as usize + 1);
            let (l, r) = if level < PARALLEL_LEVELS {
                rayon::join(|| self.solve(l, level + 1), || self.solve(r, level + 1))
            } else {
                (self.solve(l, level + 1), self.solve(r, level + 1))
            };
            let triangles = (l.1 + r.1).min(LEAF_MAX + 1);
            let as_leaf = if triangles <= LEAF_MAX {
                area * PACK_COST * triangles.div_ceil(WIDTH as u32) as f32
            } else {
                f32::INFINITY
            };
            let as_node = area + distribute(&l.0, &r.0, WIDTH).0;
            let one = as_node.min(as_leaf);
            let mut costs = [one; WIDTH - 1];
            for roots in 2..WIDTH {
                costs[roots - 1] = one.min(distribute(&l.0, &r.0, roots).0);
            }
            // Both are infinite where areas overflow.
            let is_leaf = triangles <= LEAF_MAX && as_leaf <= as_node;
            (costs, triangles, is_leaf)
        };
        let to = &self.cost[n];
        for (to, cost) in to.iter().zip(costs) {
            to.store(cost.to_bits(), Relaxed);
        }
        to[WIDTH - 1].store(is_leaf.into(), Relaxed);
        (costs, triangles)
    }

    fn is_leaf(&self, n: usize) -> bool {
        self.cost[n][WIDTH - 1].load(Relaxed) == 1
    }

    fn costs(&self, n: usize) -> [f32; WIDTH - 1] {
        std::array::from_fn(|i| f32::from_bits(self.cost[n][i].load(Relaxed)))
    }

    /// The binary nodes that become the children of the wide node at `n`.
    fn children(&self, n: usize) -> Slots {
        let mut slots = Slots::default();
        self.open(n, WIDTH, &mut slots);
        slots
    }

    fn open(&self, n: usize, roots: usize, out: &mut Slots) {
        let (l, r) = (self.tree[n].first as usize, self.tree[n].first as usize + 1);
        let (_, left) = distribute(&self.costs(l), &self.costs(r), roots);
        for (n, roots) in [(l, left), (r, roots - left)] {
            let costs = self.costs(n);
            if roots == 1 || self.tree[n].leaf || costs[roots - 1] == costs[0] {
                out.push(n);
            } else {
                self.open(n, roots, out);
            }
        }
    }

    /// Roots of the subtrees `levels` below `n`, in order.
    fn subtrees(&self, n: usize, levels: u32, out: &mut Vec<usize>) {
        if levels == 0 || self.is_leaf(n) {
            out.push(n);
        } else {
            for &c in self.children(n).as_slice() {
                self.subtrees(c, levels - 1, out);
            }
        }
    }

    /// The top of the tree, down to the parts made from `subtrees`.
    fn join(
        &self,
        n: usize,
        levels: u32,
        parts: &mut impl Iterator<Item = Part>,
        out: &mut Part,
    ) -> Child {
        if levels == 0 || self.is_leaf(n) {
            let Some(part) = parts.next() else {
                return Child::EMPTY;
            };
            out.depth = out.depth.max(part.depth + 2 - levels);
            return out.append(part);
        }
        self.node(n, out, |c, out| self.join(c, levels - 1, parts, out))
    }

    fn part(&self, n: usize) -> Part {
        let mut out = Part::default();
        out.root = self.emit(n, 1, &mut out);
        out
    }

    fn emit(&self, n: usize, depth: u32, out: &mut Part) -> Child {
        out.depth = out.depth.max(depth);
        if self.is_leaf(n) {
            return self.leaf(n, out);
        }
        self.node(n, out, |c, out| self.emit(c, depth + 1, out))
    }

    fn node(
        &self,
        n: usize,
        out: &mut Part,
        mut child: impl FnMut(usize, &mut Part) -> Child,
    ) -> Child {
        let at = out.nodes.len();
        out.nodes.push(Node::EMPTY);
        let mut node = Node::EMPTY;
        for (slot, &c) in self.children(n).as_slice().iter().enumerate() {
            node.set(slot, self.tree[c].bounds);
            node.child[slot] = child(c, out);
        }
        out.nodes[at] = node;
        Child::node(at)
    }

    fn leaf(&self, n: usize, out: &mut Part) -> Child {
        let mut ids = [0; LEAF_MAX as usize];
        let mut count = 0;
        self.gather(n, &mut ids, &mut count);
        let ids = &ids[..count];
        if !self.source.is_triangle(ids[0]) {
            return Child::other(self.source.other(ids[0]));
        }
        let first = out.packs.len();
        for ids in ids.chunks(WIDTH) {
            let mut pack = Pack::EMPTY;
            for (lane, &id) in ids.iter().enumerate() {
                let Some(corners) = self.source.triangle(id) else {
                    continue;
                };
                pack.set(lane, corners);
                pack.id[lane] = id;
            }
            out.packs.push(pack);
        }
        Child::packs(first, out.packs.len() - first)
    }

    fn gather(&self, n: usize, ids: &mut [u32; LEAF_MAX as usize], count: &mut usize) {
        let node = &self.tree[n];
        if node.leaf {
            ids[*count] = node.first;
            *count += 1;
        } else {
            self.gather(node.first as usize, ids, count);
            self.gather(node.first as usize + 1, ids, count);
        }
    }
}

/// Share `roots` wide children between two subtrees: the least cost, and how many the left one gets.
fn distribute(l: &[f32; WIDTH - 1], r: &[f32; WIDTH - 1], roots: usize) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for left in 1..roots {
        let cost = l[left - 1] + r[roots - left - 1];
        if cost < best.0 {
            best = (cost, left);
        }
    }
    best
}

/// Up to eight node indices.
#[derive(Default)]
struct Slots {
    at: [usize; WIDTH],
    len: usize,
}

impl Slots {
    fn push(&mut self, n: usize) {
        self.at[self.len] = n;
        self.len += 1;
    }

    fn as_slice(&self) -> &[usize] {
        &self.at[..self.len]
    }
}

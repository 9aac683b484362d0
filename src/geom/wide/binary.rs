//! The binary tree that the wide one is cut from: top-down, binned surface-area heuristic (Wald 2007,
//! "On fast construction of SAH-based bounding volume hierarchies"), one primitive per leaf.
//!
//! Work is O(n log n) for any input, also for boxes that are all alike, nested or in a row: where no
//! plane separates them the list is halved. The tree does not depend on the number of threads.

use crate::math::Aabb;
use glam::{Vec3A, Vec4};
use rayon::prelude::*;

/// A primitive to build over. The number rides in the fourth lane of one corner.
#[derive(Clone, Copy)]
pub struct Prim {
    min: Vec4,
    max: Vec4,
}

impl Prim {
    /// `bounds` finite and not empty.
    pub fn new(bounds: Aabb, id: u32) -> Prim {
        Prim {
            min: bounds.min.extend(f32::from_bits(id)),
            max: bounds.max.extend(0.0),
        }
    }

    pub fn id(&self) -> u32 {
        self.min.w.to_bits()
    }

    pub fn bounds(&self) -> Aabb {
        Aabb {
            min: self.min.truncate(),
            max: self.max.truncate(),
        }
    }

    /// Twice the centre; only compared with its like. Halved first, so that it cannot overflow.
    fn center(&self) -> Vec3A {
        Vec3A::from_vec4(self.min * 0.5 + self.max * 0.5)
    }
}

/// A node of the binary tree; the root is node 0, and the children of a node are neighbours.
#[derive(Clone, Copy)]
pub struct BinaryNode {
    pub bounds: Aabb,
    /// First child, or the primitive's number in a leaf.
    pub first: u32,
    pub leaf: bool,
}

impl BinaryNode {
    pub const EMPTY: BinaryNode = BinaryNode {
        bounds: Aabb::EMPTY,
        first: 0,
        leaf: true,
    };
}

/// Half the surface of a box, which stands for the chance that a ray meets it.
pub fn half_area(b: &Aabb) -> f32 {
    let d = b.diagonal();
    d.x * (d.y + d.z) + d.y * d.z
}

/// Build over `prims`, which must not be empty. No leaf lies deeper than `max_depth`, if that is at
/// least the binary logarithm of their number, rounded up.
pub fn build(prims: &mut [Prim], max_depth: u32) -> Vec<BinaryNode> {
    let bounds = union(prims);
    let mut nodes = vec![BinaryNode::EMPTY; 2 * prims.len() - 1];
    let (root, below) = nodes.split_at_mut(1);
    split(prims, bounds, &mut root[0], below, 1, max_depth);
    nodes
}

/// Lists longer than this are worth a task of their own.
const TASK: usize = 8192;
const BINS: usize = 16;

/// Put a tree over `prims` into `node` and its descendants into `below`, whose first has index `base`.
fn split(
    prims: &mut [Prim],
    bounds: Aabb,
    node: &mut BinaryNode,
    below: &mut [BinaryNode],
    base: u32,
    depth_left: u32,
) {
    if let [only] = prims {
        *node = BinaryNode {
            bounds,
            first: only.id(),
            leaf: true,
        };
        return;
    }
    *node = BinaryNode {
        bounds,
        first: base,
        leaf: false,
    };
    let (at, left_bounds, right_bounds) = divide(prims, depth_left);
    let (left, right) = prims.split_at_mut(at);
    let (children, below) = below.split_at_mut(2);
    let (left_below, right_below) = below.split_at_mut(2 * left.len() - 2);
    let (left_node, right_node) = children.split_at_mut(1);
    let (left_base, right_base) = (base + 2, base + 2 * left.len() as u32);
    let parallel = left.len() + right.len() > TASK;
    let mut l = || {
        let node = &mut left_node[0];
        split(
            left,
            left_bounds,
            node,
            left_below,
            left_base,
            depth_left - 1,
        )
    };
    let mut r = || {
        let node = &mut right_node[0];
        split(
            right,
            right_bounds,
            node,
            right_below,
            right_base,
            depth_left - 1,
        )
    };
    if parallel {
        rayon::join(l, r);
    } else {
        l();
        r();
    }
}

/// Reorder `prims` (two or more) into two parts; gives the length of the first, and the bounds of both.
fn divide(prims: &mut [Prim], depth_left: u32) -> (usize, Aabb, Aabb) {
    let n = prims.len();
    let halves = |prims: &mut [Prim]| {
        let (l, r) = prims.split_at(n / 2);
        (n / 2, union(l), union(r))
    };
    // Levels needed to reach single primitives by halving from here.
    let needed = (n - 1).ilog2() + 1;
    if n == 2 {
        return halves(prims);
    }
    let centers = fold(
        prims,
        || (Vec3A::INFINITY, Vec3A::NEG_INFINITY),
        |(lo, hi), p| (lo.min(p.center()), hi.max(p.center())),
        |a, b| (a.0.min(b.0), a.1.max(b.1)),
    );
    let grid = Grid::new(centers, n);
    if depth_left <= needed {
        return halve_by_center(prims, &grid);
    }
    let bins = fold(prims, Bins::default, |b, p| b.add(&grid, p), Bins::merge);
    let Some(plane) = bins.best_plane(grid.count) else {
        return halves(prims);
    };
    let mut at = 0;
    for i in 0..n {
        if grid.bin(&prims[i], plane.axis) < plane.bin {
            prims.swap(i, at);
            at += 1;
        }
    }
    (at, plane.left, plane.right)
}

/// Two halves of equal number along the longest axis: for where the tree has become too deep.
fn halve_by_center(prims: &mut [Prim], grid: &Grid) -> (usize, Aabb, Aabb) {
    let axis = grid.longest;
    let at = prims.len() / 2;
    let key = |p: &Prim| p.center()[axis];
    prims.select_nth_unstable_by(at, |a, b| {
        key(a).total_cmp(&key(b)).then(a.id().cmp(&b.id()))
    });
    let (l, r) = prims.split_at(at);
    (at, union(l), union(r))
}

/// Fold that is parallel for long lists. `merge` must be exact, so that the cuts do not matter.
fn fold<T: Send>(
    prims: &[Prim],
    start: impl Fn() -> T + Sync,
    add: impl Fn(T, &Prim) -> T + Sync,
    merge: impl Fn(T, T) -> T + Sync,
) -> T {
    if prims.len() <= 8 * TASK {
        prims.iter().fold(start(), add)
    } else {
        let parts = prims.par_chunks(TASK).map(|c| c.iter().fold(start(), &add));
        parts.reduce(&start, &merge)
    }
}

fn union(prims: &[Prim]) -> Aabb {
    let all = fold(
        prims,
        || (Vec4::INFINITY, Vec4::NEG_INFINITY),
        |(lo, hi), p| (lo.min(p.min), hi.max(p.max)),
        |a, b| (a.0.min(b.0), a.1.max(b.1)),
    );
    Prim {
        min: all.0,
        max: all.1,
    }
    .bounds()
}

/// Where the bins lie: `count` equal intervals of the box of the centres, on each axis.
struct Grid {
    min: Vec3A,
    scale: Vec3A,
    count: usize,
    longest: usize,
}

impl Grid {
    fn new((min, max): (Vec3A, Vec3A), prims: usize) -> Grid {
        let size = max - min;
        let count = prims.clamp(4, BINS);
        // An axis without extent gets scale 0: all in bin 0. So does one too short to be divided.
        let per = Vec3A::splat(count as f32 * 0.999_99) / size;
        let scale = Vec3A::select(per.is_finite_mask(), per, Vec3A::ZERO);
        Grid {
            min,
            scale,
            count,
            longest: size.max_position(),
        }
    }

    fn bin3(&self, p: &Prim) -> [usize; 3] {
        let at = (p.center() - self.min) * self.scale;
        at.to_array().map(|x| (x as usize).min(BINS - 1))
    }

    fn bin(&self, p: &Prim, axis: usize) -> usize {
        self.bin3(p)[axis]
    }
}

#[derive(Clone, Copy)]
struct Bin {
    min: Vec4,
    max: Vec4,
    count: u32,
}

const EMPTY_BIN: Bin = Bin {
    min: Vec4::INFINITY,
    max: Vec4::NEG_INFINITY,
    count: 0,
};

impl Bin {
    fn union(self, o: &Bin) -> Bin {
        Bin {
            min: self.min.min(o.min),
            max: self.max.max(o.max),
            count: self.count + o.count,
        }
    }

    fn bounds(&self) -> Aabb {
        Aabb {
            min: self.min.truncate(),
            max: self.max.truncate(),
        }
    }

    /// Cost of making this a subtree: its area times the number of its primitives.
    fn cost(&self) -> f32 {
        let d = self.max - self.min;
        (d.x * (d.y + d.z) + d.y * d.z) * self.count as f32
    }
}

struct Bins([[Bin; BINS]; 3]);

impl Default for Bins {
    fn default() -> Bins {
        Bins([[EMPTY_BIN; BINS]; 3])
    }
}

/// Primitives in bins below `bin` go left.
struct Plane {
    axis: usize,
    bin: usize,
    left: Aabb,
    right: Aabb,
}

impl Bins {
    fn add(mut self, grid: &Grid, p: &Prim) -> Bins {
        let at = grid.bin3(p);
        for (bins, at) in self.0.iter_mut().zip(at) {
            let bin = &mut bins[at];
            bin.min = bin.min.min(p.min);
            bin.max = bin.max.max(p.max);
            bin.count += 1;
        }
        self
    }

    fn merge(mut self, o: Bins) -> Bins {
        for (bins, others) in self.0.iter_mut().zip(&o.0) {
            for (bin, other) in bins.iter_mut().zip(others) {
                *bin = bin.union(other);
            }
        }
        self
    }

    /// The cheapest plane with primitives on both sides.
    fn best_plane(&self, count: usize) -> Option<Plane> {
        let mut best: Option<Plane> = None;
        let mut best_cost = f32::INFINITY;
        for (axis, bins) in self.0.iter().enumerate() {
            let mut right = [EMPTY_BIN; BINS];
            let mut sum = EMPTY_BIN;
            for bin in (1..count).rev() {
                sum = sum.union(&bins[bin]);
                right[bin] = sum;
            }
            let mut left = EMPTY_BIN;
            for bin in 1..count {
                left = left.union(&bins[bin - 1]);
                if left.count == 0 || right[bin].count == 0 {
                    continue;
                }
                let cost = left.cost() + right[bin].cost();
                if cost < best_cost {
                    best_cost = cost;
                    let (left, right) = (left.bounds(), right[bin].bounds());
                    best = Some(Plane {
                        axis,
                        bin,
                        left,
                        right,
                    });
                }
            }
        }
        best
    }
}

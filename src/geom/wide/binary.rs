//! The binary tree that the wide one is cut from: top-down, binned surface-area heuristic (Wald 2007,
//! "On fast construction of SAH-based bounding volume hierarchies"), one primitive per leaf.
//!
//! Work is O(n log n) for any input, also for boxes that are all alike, nested or in a row: where no
//! plane separates them the list is halved. The tree does not depend on the number of threads.

use crate::math::{Aabb, Vec3A, Vec4};
use rayon::prelude::*;

/// A primitive to build over. The halves of its number ride in the fourth lanes of the corners, as
/// fractions of floats from 1 to 2: as plain bits they would be subnormal, and arithmetic that drags
/// them along ten times slower.
#[derive(Clone, Copy)]
pub struct Prim {
    min: Vec4,
    max: Vec4,
}

const ONE: u32 = 0x3f80_0000;
const HALF: u32 = 0xffff;

impl Prim {
    /// `bounds` finite and not empty.
    pub fn new(bounds: Aabb, id: u32) -> Prim {
        Prim {
            min: bounds.min.extend(f32::from_bits(ONE | id & HALF)),
            max: bounds.max.extend(f32::from_bits(ONE | id >> 16)),
        }
    }

    pub fn id(&self) -> u32 {
        self.min.w.to_bits() & HALF | (self.max.w.to_bits() & HALF) << 16
    }

    pub fn bounds(&self) -> Aabb {
        Aabb {
            min: self.min.truncate(),
            max: self.max.truncate(),
        }
    }

    /// The centre; halved before the sum, so that it cannot overflow.
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
/// Lists up to this length are halved: they end up in one pack of triangles anyway.
const TINY: usize = 4;
/// Lists up to this length make do with eight bins, longer ones get sixteen.
const SMALL: usize = 16;

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
    let centers = fold(
        prims,
        || (Vec3A::INFINITY, Vec3A::NEG_INFINITY),
        |(lo, hi), p| (*lo, *hi) = (lo.min(p.center()), hi.max(p.center())),
        |a, b| (a.0.min(b.0), a.1.max(b.1)),
    );
    // Levels needed to reach single primitives by halving from here.
    let needed = (n - 1).ilog2() + 1;
    let by_cost = if n <= TINY || depth_left <= needed {
        None
    } else if n <= SMALL {
        divide_by_cost::<8>(prims, centers)
    } else {
        divide_by_cost::<16>(prims, centers)
    };
    by_cost.unwrap_or_else(|| {
        let axis = (centers.1 - centers.0).max_position();
        let key = |p: &Prim| p.center()[axis];
        prims.select_nth_unstable_by(n / 2, |a, b| {
            key(a).total_cmp(&key(b)).then(a.id().cmp(&b.id()))
        });
        let (l, r) = prims.split_at(n / 2);
        (n / 2, union(l), union(r))
    })
}

/// [`divide`] at the cheapest plane between bins; `None` if there is no plane.
fn divide_by_cost<const BINS: usize>(
    prims: &mut [Prim],
    centers: (Vec3A, Vec3A),
) -> Option<(usize, Aabb, Aabb)> {
    let grid = Grid::<BINS>::new(centers);
    let start = Bins::<BINS>::default;
    let bins = fold(prims, start, |b, p| b.add(&grid, p), Bins::merge);
    let plane = bins.best_plane()?;
    // Always swapping is cheaper than a branch that is wrong every other time.
    let mut at = 0;
    for i in 0..prims.len() {
        let left = grid.bins(&prims[i])[plane.axis] < plane.bin;
        prims.swap(i, at);
        at += usize::from(left);
    }
    Some((at, plane.left, plane.right))
}

/// Fold that is parallel for long lists. `merge` must be exact, so that the cuts do not matter.
fn fold<T: Send>(
    prims: &[Prim],
    start: impl Fn() -> T + Sync,
    add: impl Fn(&mut T, &Prim) + Sync,
    merge: impl Fn(T, T) -> T + Sync,
) -> T {
    let part = |prims: &[Prim]| {
        let mut sum = start();
        prims.iter().for_each(|p| add(&mut sum, p));
        sum
    };
    if prims.len() <= 8 * TASK {
        part(prims)
    } else {
        prims.par_chunks(TASK).map(part).reduce(&start, &merge)
    }
}

fn union(prims: &[Prim]) -> Aabb {
    let all = fold(
        prims,
        || (Vec4::INFINITY, Vec4::NEG_INFINITY),
        |(lo, hi), p| (*lo, *hi) = (lo.min(p.min), hi.max(p.max)),
        |a, b| (a.0.min(b.0), a.1.max(b.1)),
    );
    Prim {
        min: all.0,
        max: all.1,
    }
    .bounds()
}

/// Where the bins lie: equal intervals of the box of the centres, on each axis.
struct Grid<const BINS: usize> {
    min: Vec3A,
    scale: Vec3A,
}

impl<const BINS: usize> Grid<BINS> {
    fn new((min, max): (Vec3A, Vec3A)) -> Grid<BINS> {
        // An axis without extent, or too short to be divided, gets scale 0: all in bin 0.
        let per = Vec3A::splat(BINS as f32 * 0.999_99) / (max - min);
        let scale = Vec3A::select(per.is_finite_mask(), per, Vec3A::ZERO);
        Grid { min, scale }
    }

    /// The bin on each axis.
    fn bins(&self, p: &Prim) -> [usize; 3] {
        let at = (p.center() - self.min) * self.scale;
        at.to_array().map(|x| x as i32 as usize & (BINS - 1))
    }
}

/// What lies in a bin, or in several.
#[derive(Clone, Copy)]
struct Bin {
    min: Vec4,
    max: Vec4,
    count: u32,
}

impl Bin {
    const EMPTY: Bin = Bin {
        min: Vec4::INFINITY,
        max: Vec4::NEG_INFINITY,
        count: 0,
    };

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

struct Bins<const BINS: usize>([[Bin; BINS]; 3]);

impl<const BINS: usize> Default for Bins<BINS> {
    fn default() -> Bins<BINS> {
        Bins([[Bin::EMPTY; BINS]; 3])
    }
}

/// Primitives in bins below `bin` go left.
struct Plane {
    axis: usize,
    bin: usize,
    left: Aabb,
    right: Aabb,
}

impl<const BINS: usize> Bins<BINS> {
    fn add(&mut self, grid: &Grid<BINS>, p: &Prim) {
        let at = grid.bins(p);
        for (bins, at) in self.0.iter_mut().zip(at) {
            let bin = &mut bins[at];
            bin.min = bin.min.min(p.min);
            bin.max = bin.max.max(p.max);
            bin.count += 1;
        }
    }

    fn merge(mut self, o: Bins<BINS>) -> Bins<BINS> {
        for (bins, others) in self.0.iter_mut().zip(&o.0) {
            for (bin, other) in bins.iter_mut().zip(others) {
                *bin = bin.union(other);
            }
        }
        self
    }

    /// The cheapest plane with primitives on both sides.
    fn best_plane(&self) -> Option<Plane> {
        let mut best = (f32::INFINITY, 0, 0);
        for (axis, bins) in self.0.iter().enumerate() {
            let mut right_cost = [f32::INFINITY; BINS];
            let mut right = Bin::EMPTY;
            for bin in (1..BINS).rev() {
                right = right.union(&bins[bin]);
                if right.count > 0 {
                    right_cost[bin] = right.cost();
                }
            }
            let mut left = Bin::EMPTY;
            for bin in 1..BINS {
                left = left.union(&bins[bin - 1]);
                let cost = left.cost() + right_cost[bin];
                if left.count > 0 && cost < best.0 {
                    best = (cost, axis, bin);
                }
            }
        }
        let (cost, axis, bin) = best;
        let all = |bins: &[Bin]| bins.iter().fold(Bin::EMPTY, Bin::union).bounds();
        (cost < f32::INFINITY).then(|| Plane {
            axis,
            bin,
            left: all(&self.0[axis][..bin]),
            right: all(&self.0[axis][bin..]),
        })
    }
}

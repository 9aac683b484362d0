//! Traversal and the triangle test, over any instruction set.
//!
//! Triangles: Woop, Benthin & Wald 2013, "Watertight ray/triangle intersection". A ray that meets a
//! closed mesh meets one of its triangles, also exactly on an edge or a corner, because neighbours
//! compute the sign of a shared edge from the same numbers, and a sign lost to rounding is found again
//! in double precision. Boxes: Ize 2013, "Robust BVH ray traversal", with a margin that also covers
//! the rounding of the triangle test, so that no box hides what the triangle test would accept.

use super::isa::Isa;
use super::stack::{Entry, Stack};
use super::{Child, Lanes, Node, OTHER, Pack, Wide};
use crate::geom::Ray;
use crate::math::{Vec2, fp};

/// What was met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Distance, `0 < t <= ray.t_max`.
    pub t: f32,
    /// Number of the triangle, or [`OTHER`] plus the number of another primitive.
    pub id: u32,
    /// Barycentric weights of the second and third corner, or what [`Leaf::other`] gave.
    pub uv: Vec2,
}

/// What the tree does not know about its leaves.
pub trait Leaf {
    /// Whether [`Leaf::other`] can be reached; otherwise it is compiled out.
    const OTHERS: bool;
    /// Whether [`Leaf::accept`] is asked; otherwise it is compiled out.
    const FILTERS: bool;
    /// Meeting of `ray`, up to `ray.t_max`, with primitive `index` that is no triangle.
    fn other(&self, index: u32, ray: &Ray) -> Option<(f32, Vec2)>;
    /// Whether a meeting with `triangle` counts (alpha masks).
    fn accept(&self, triangle: u32, uv: Vec2) -> bool;
}

/// Error of the box test: entry and exit carry three roundings each (subtraction, product, and the
/// inverse); the triangle test moves the point where the ray passes by up to four roundings relative
/// to each offset from the origin, on two axes.
const BOX_MARGIN: f32 = 1.0 + fp::gamma(14 + 1);

/// The ray as the triangle test wants it (section 3.1 of the paper): the axis of the largest
/// direction component is `z`, and x and y are sheared so that the ray runs along it. The paper swaps
/// x and y to keep the winding; we take both sides, so the sign of the determinant is free.
struct Shear {
    x: usize,
    y: usize,
    z: usize,
    sx: f32,
    sy: f32,
    sz: f32,
}

impl Shear {
    #[inline(always)]
    fn new(ray: &Ray) -> Shear {
        let d = ray.d.abs();
        let z = if d.x > d.y {
            if d.x > d.z { 0 } else { 2 }
        } else if d.y > d.z {
            1
        } else {
            2
        };
        let (x, y) = [(1, 2), (2, 0), (0, 1)][z];
        let d = ray.d.to_array();
        Shear {
            x,
            y,
            z,
            sx: d[x] / d[z],
            sy: d[y] / d[z],
            sz: 1.0 / d[z],
        }
    }

    /// One corner of eight triangles, relative to the origin and sheared.
    #[inline(always)]
    fn corner<I: Isa>(&self, isa: I, pack: &Pack, o: &[f32; 3], k: usize) -> [I::F; 3] {
        let x = isa.load(&pack.corner[self.x][k]);
        let y = isa.load(&pack.corner[self.y][k]);
        let z = isa.load(&pack.corner[self.z][k]);
        let z = isa.sub(z, isa.splat(o[self.z]));
        let x = isa.sub(
            isa.sub(x, isa.splat(o[self.x])),
            isa.mul(isa.splat(self.sx), z),
        );
        let y = isa.sub(
            isa.sub(y, isa.splat(o[self.y])),
            isa.mul(isa.splat(self.sy), z),
        );
        [x, y, z]
    }
}

/// The lowest bit of `mask` as a lane, taken out of it.
#[inline(always)]
fn take(mask: &mut u32) -> usize {
    let lane = mask.trailing_zeros() as usize & 7;
    *mask &= *mask - 1;
    lane
}

/// The ray as the box test wants it.
struct Boxes<I: Isa> {
    o: [I::F; 3],
    inv: [I::F; 3],
    /// 1 where the direction is negative: there the upper bound is the near one.
    side: [usize; 3],
}

impl<I: Isa> Boxes<I> {
    #[inline(always)]
    fn new(isa: I, ray: &Ray) -> Boxes<I> {
        let (o, d) = (ray.o, ray.d);
        // An inverse of infinity is right: times a non-zero offset it gives an infinity of the right
        // sign, times zero (the origin lies in the plane) a NaN, which `test` passes over.
        let inv = [1.0 / d.x, 1.0 / d.y, 1.0 / d.z];
        Boxes {
            o: [isa.splat(o.x), isa.splat(o.y), isa.splat(o.z)],
            inv: [isa.splat(inv[0]), isa.splat(inv[1]), isa.splat(inv[2])],
            side: [
                usize::from(inv[0].is_sign_negative()),
                usize::from(inv[1].is_sign_negative()),
                usize::from(inv[2].is_sign_negative()),
            ],
        }
    }

    /// Where the ray crosses the plane.
    #[inline(always)]
    fn slab(&self, isa: I, node: &Node, upper: usize, axis: usize) -> I::F {
        let plane = isa.load(&node.planes[upper & 1][axis]);
        isa.mul(isa.sub(plane, self.o[axis]), self.inv[axis])
    }

    /// The children met before `limit`, and where the ray enters each.
    #[inline(always)]
    fn test(&self, isa: I, node: &Node, limit: I::F) -> (u32, I::F) {
        let [x, y, z] = self.side;
        // Where one operand is a NaN the second wins: at worst a bound is forgotten, and `enter` is
        // never a NaN.
        let enter = isa.max(self.slab(isa, node, x, 0), self.slab(isa, node, y, 1));
        let floor = isa.max(self.slab(isa, node, z, 2), isa.splat(0.0));
        let enter = isa.max(enter, floor);
        let leave = isa.min(self.slab(isa, node, !x, 0), self.slab(isa, node, !y, 1));
        let leave = isa.min(leave, self.slab(isa, node, !z, 2));
        let leave = isa.min(isa.mul(leave, isa.splat(BOX_MARGIN)), limit);
        (isa.le(enter, leave), enter)
    }
}

/// An edge function, from two sheared corners.
#[inline(always)]
fn edge<I: Isa>(isa: I, p: &[I::F; 3], q: &[I::F; 3]) -> I::F {
    isa.sub(isa.mul(p[0], q[1]), isa.mul(p[1], q[0]))
}

#[inline(always)]
fn stored<I: Isa>(isa: I, [x, y, z]: [I::F; 3]) -> [Lanes<f32>; 3] {
    [isa.store(x), isa.store(y), isa.store(z)]
}

/// Traverse. With `ANY` the first meeting found ends the search.
#[inline(always)]
pub fn trace<I: Isa, L: Leaf, const ANY: bool>(
    isa: I,
    wide: &Wide,
    ray: &Ray,
    leaf: &L,
) -> Option<Found> {
    if wide.root == Child::EMPTY {
        return None;
    }
    let o = ray.o.to_array();
    let boxes = Boxes::new(isa, ray);
    let shear = Shear::new(ray);

    let mut search = Search {
        // `t < best` is the test, and `t_max` itself is inside.
        best: ray.t_max.next_up(),
        found: None,
    };
    let mut limit = search.best * BOX_MARGIN;
    let mut limit_v = isa.splat(limit);
    let mut stack = Stack::new();
    let mut current = wide.root;
    loop {
        while !current.is_leaf() {
            let node = &wide.nodes[current.0 as usize];
            let (mut hits, enter) = boxes.test(isa, node, limit_v);
            if hits == 0 {
                current = Child::EMPTY;
                break;
            }
            let first = take(&mut hits);
            current = node.child[first];
            wide.prefetch(isa, current);
            if hits == 0 {
                continue;
            }
            if ANY {
                while hits != 0 {
                    let slot = take(&mut hits);
                    wide.prefetch(isa, node.child[slot]);
                    stack.push(Entry::new(node.child[slot], 0.0));
                }
                continue;
            }
            let enter = isa.store(enter);
            let a = Entry::new(current, enter.0[first]);
            let slot = take(&mut hits);
            wide.prefetch(isa, node.child[slot]);
            let b = Entry::new(node.child[slot], enter.0[slot]);
            let (near, far) = if a <= b { (a, b) } else { (b, a) };
            if hits == 0 {
                stack.push(far);
                current = near.child();
                continue;
            }
            let base = stack.len();
            stack.push(far);
            stack.push(near);
            while hits != 0 {
                let slot = take(&mut hits);
                wide.prefetch(isa, node.child[slot]);
                stack.insert(base, Entry::new(node.child[slot], enter.0[slot]));
            }
            match stack.pop() {
                Some(e) => current = e.child(),
                None => break,
            }
        }

        if current != Child::EMPTY {
            let (first, count) = (current.leaf_index(), current.pack_count());
            let mut hit = false;
            if L::OTHERS && count == 0 {
                hit = search.other(first as u32, ray, leaf);
            }
            for pack in wide.packs.get(first..first + count).unwrap_or(&[]) {
                hit |= search.pack(isa, pack, &o, &shear, leaf);
                if ANY && hit {
                    return search.found;
                }
            }
            if ANY && hit {
                return search.found;
            }
            if hit {
                limit = search.best * BOX_MARGIN;
                limit_v = isa.splat(limit);
            }
        }
        loop {
            let Some(e) = stack.pop() else {
                return search.found;
            };
            if ANY || e.t() <= limit {
                current = e.child();
                break;
            }
        }
    }
}

impl Wide {
    #[inline(always)]
    fn prefetch<I: Isa>(&self, isa: I, child: Child) {
        if child.is_leaf() {
            isa.prefetch(self.packs.as_ptr().wrapping_add(child.leaf_index()));
        } else {
            isa.prefetch(self.nodes.as_ptr().wrapping_add(child.0 as usize));
        }
    }
}

/// The best so far.
struct Search {
    /// What is met must be nearer than this.
    best: f32,
    found: Option<Found>,
}

impl Search {
    #[inline(always)]
    fn keep(&mut self, t: f32, id: u32, uv: Vec2) {
        self.best = t;
        self.found = Some(Found { t, id, uv });
    }

    #[inline(always)]
    fn other<L: Leaf>(&mut self, index: u32, ray: &Ray, leaf: &L) -> bool {
        let ray = Ray {
            t_max: self.best,
            ..*ray
        };
        match leaf.other(index, &ray) {
            Some((t, uv)) if t > 0.0 && t < self.best => {
                self.keep(t, OTHER | index, uv);
                true
            }
            _ => false,
        }
    }

    /// Test eight triangles; true when one is the new best.
    #[inline(always)]
    fn pack<I: Isa, L: Leaf>(
        &mut self,
        isa: I,
        pack: &Pack,
        o: &[f32; 3],
        s: &Shear,
        leaf: &L,
    ) -> bool {
        // Corners relative to the origin, sheared, each of the three as x, y, z.
        let a = s.corner(isa, pack, o, 0);
        let b = s.corner(isa, pack, o, 1);
        let c = s.corner(isa, pack, o, 2);
        // Twice the areas that the ray spans with each edge: the edge functions.
        let u = edge(isa, &c, &b);
        let v = edge(isa, &a, &c);
        let w = edge(isa, &b, &a);
        let zero = isa.splat(0.0);
        let least = isa.min(isa.min(u, v), w);
        let most = isa.max(isa.max(u, v), w);
        let inside = isa.le(zero, least) | isa.le(most, zero);
        if inside == 0 {
            return false;
        }
        let exact = inside & (isa.eq(u, zero) | isa.eq(v, zero) | isa.eq(w, zero));

        // Barycentric weights before distances: products of three lengths would leave the range of a
        // float for scenes of 1e-13 or 1e13.
        let inv_det = isa.div(isa.splat(1.0), isa.add(isa.add(u, v), w));
        let (u, v, w) = (
            isa.mul(u, inv_det),
            isa.mul(v, inv_det),
            isa.mul(w, inv_det),
        );
        let depth = isa.add(
            isa.add(isa.mul(u, a[2]), isa.mul(v, b[2])),
            isa.mul(w, c[2]),
        );
        let t = isa.mul(isa.splat(s.sz), depth);
        let mut hits = isa.lt(zero, t) & isa.lt(t, isa.splat(self.best)) & inside & !exact;
        let mut hit = false;
        if hits != 0 {
            let (t, v, w) = (isa.store(t), isa.store(v), isa.store(w));
            while hits != 0 {
                let i = take(&mut hits);
                let uv = Vec2::new(v.0[i], w.0[i]);
                if t.0[i] < self.best && (!L::FILTERS || leaf.accept(pack.id[i], uv)) {
                    self.keep(t.0[i], pack.id[i], uv);
                    hit = true;
                }
            }
        }
        if exact != 0 {
            let lanes = [stored(isa, a), stored(isa, b), stored(isa, c)];
            hit |= self.exact(exact, &lanes, pack, s.sz, leaf);
        }
        hit
    }

    /// The lanes in which an edge function came out as zero, again in double precision: products of
    /// floats are exact there and so is the sign of their difference. The signs found in single
    /// precision stand, since rounding is monotonic; so neighbours still agree. Zero-area triangles
    /// have a zero determinant and end here.
    #[cold]
    #[inline(never)]
    fn exact<L: Leaf>(
        &mut self,
        mut lanes: u32,
        corners: &[[Lanes<f32>; 3]; 3],
        pack: &Pack,
        sz: f32,
        leaf: &L,
    ) -> bool {
        let mut hit = false;
        while lanes != 0 {
            let i = take(&mut lanes);
            let [a, b, c] = corners
                .each_ref()
                .map(|p| p.each_ref().map(|x| f64::from(x.0[i])));
            let edge = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
            let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
            let det = u + v + w;
            let mixed = u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0;
            if mixed || det == 0.0 {
                continue;
            }
            let t = (f64::from(sz) * (u * a[2] + v * b[2] + w * c[2]) / det) as f32;
            let uv = Vec2::new((v / det) as f32, (w / det) as f32);
            if t > 0.0 && t < self.best && (!L::FILTERS || leaf.accept(pack.id[i], uv)) {
                self.keep(t, pack.id[i], uv);
                hit = true;
            }
        }
        hit
    }
}

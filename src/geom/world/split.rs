//! Stretches of time for what moves: something fast sweeps a large box over the whole shutter, but a small
//! one during a short while. Each stretch is a box of its own in the tree, which only rays of that time
//! follow further.

use super::{Stretch, What};
use crate::geom::wide::binary::half_area;
use crate::math::{Aabb, Motion};

/// Most stretches that one thing is cut into.
pub(super) const MOST: u32 = 32;

/// What it costs to reject a ray whose time is that of another stretch, relative to tracing into the
/// thing itself. Set by `benches/render.rs`.
const REJECTION: f64 = 0.05;

/// A box and when it is in use.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub bounds: Aabb,
    from: f32,
    until: f32,
}

impl Piece {
    pub fn stretch(self, what: What) -> (Stretch, Aabb) {
        let Piece {
            bounds,
            from,
            until,
        } = self;
        (Stretch { from, until, what }, bounds)
    }
}

/// The shutter cut into `n` equal parts, of which part `i` reaches from `.0` to `.1`.
pub(super) fn part(i: u32, n: u32) -> (f32, f32) {
    let at = |i: u32| i as f32 / n as f32;
    (at(i), at(i + 1))
}

/// A box for part `i` of `n`. Times before the shutter opens and after it closes belong to the first and
/// the last one.
pub(super) fn piece(bounds: Aabb, i: u32, n: u32) -> Piece {
    let (from, until) = part(i, n);
    Piece {
        bounds,
        from: if i == 0 { f32::NEG_INFINITY } else { from },
        until: if i + 1 == n { f32::INFINITY } else { until },
    }
}

/// The number of parts, a power of two up to [`MOST`], for which the expected cost of a ray is least.
/// `area` gives the sum of the areas of all boxes with so many parts: a ray meets a box as often as its
/// area says, and is of the right time once in as many parts.
pub(super) fn parts(mut area: impl FnMut(u32) -> f64) -> u32 {
    let mut best = (f64::INFINITY, 1);
    let mut n = 1;
    while n <= MOST {
        let cost = area(n) * (REJECTION + 1.0 / f64::from(n));
        if cost < best.0 {
            best = (cost, n);
        }
        n *= 2;
    }
    best.1
}

/// The boxes of something that fills `local` and moves by `motion`.
pub(super) fn of_motion(motion: &Motion, local: Aabb) -> Vec<Piece> {
    if motion.as_still().is_some() {
        return vec![piece(motion.bounds(local, 0.0, 1.0), 0, 1)];
    }
    let boxes = |n: u32| {
        (0..n).map(move |i| {
            let (t0, t1) = part(i, n);
            piece(motion.bounds(local, t0, t1), i, n)
        })
    };
    let n = parts(|n| boxes(n).map(|p| f64::from(half_area(&p.bounds))).sum());
    boxes(n).collect()
}

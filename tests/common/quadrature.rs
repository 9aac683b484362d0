//! Adaptive integration over boxes of the plane.

/// Gauss-Legendre nodes and weights of 3 and 5 points on [-1, 1].
const G3: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];
const G5: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// What is integrated over a box: the density, and the density times each of three coordinates.
pub type Moments = [f64; 4];

pub fn add(a: Moments, b: Moments) -> Moments {
    std::array::from_fn(|i| a[i] + b[i])
}

#[derive(Clone, Copy, Debug)]
pub struct Box2 {
    pub lo: [f64; 2],
    pub hi: [f64; 2],
}

impl Box2 {
    pub fn split(self, axis: usize, at: f64) -> [Box2; 2] {
        let (mut a, mut b) = (self, self);
        a.hi[axis] = at;
        b.lo[axis] = at;
        [a, b]
    }

    pub fn around(points: &[[f64; 2]]) -> Option<Box2> {
        let &first = points.first()?;
        let point = Box2 {
            lo: first,
            hi: first,
        };
        Some(points.iter().fold(point, |b, p| Box2 {
            lo: std::array::from_fn(|i| b.lo[i].min(p[i])),
            hi: std::array::from_fn(|i| b.hi[i].max(p[i])),
        }))
    }

    pub fn middle(&self, axis: usize) -> f64 {
        0.5 * (self.lo[axis] + self.hi[axis])
    }
}

/// How often a box may be quartered.
const DEPTH: u32 = 12;

/// Integral of `f` over the box, refined where two rules disagree by more than `tolerance` (absolute, of
/// the first moment).
///
/// Most of it is expected within `focus`. Around that the box is cut at distances that grow fourfold: a
/// tail that ends far from the focus would hide between the nodes of one large box. Where less than
/// `least` is found, a ridge may still hide, and all parts are looked at more closely.
pub fn integrate(
    f: &impl Fn([f64; 2]) -> Moments,
    b: Box2,
    focus: Box2,
    tolerance: f64,
    least: f64,
) -> Moments {
    let cuts = [0, 1].map(|i| cuts(b.lo[i], b.hi[i], focus.lo[i], focus.hi[i]));
    let parts = |forced: u32| {
        let mut sum = [0.0; 4];
        for x in cuts[0].windows(2) {
            for y in cuts[1].windows(2) {
                let part = Box2 {
                    lo: [x[0], y[0]],
                    hi: [x[1], y[1]],
                };
                sum = add(sum, refine(f, part, tolerance, DEPTH, forced));
            }
        }
        sum
    };
    let sum = parts(0);
    if sum[0] < least { parts(2) } else { sum }
}

/// Positions from `lo` to `hi`, dense around the interval from `a` to `b`.
fn cuts(lo: f64, hi: f64, a: f64, b: f64) -> Vec<f64> {
    let width = (b - a).max(1e-7 * (hi - lo));
    let mut cuts = vec![lo, hi];
    let mut step = 0.5 * width;
    while step < hi - lo {
        for at in [a - step, b + step] {
            // No slivers: the last step reaches the end.
            if at - lo > step && hi - at > step {
                cuts.push(at);
            }
        }
        step *= 4.0;
    }
    cuts.sort_by(f64::total_cmp);
    cuts
}

fn refine(
    f: &impl Fn([f64; 2]) -> Moments,
    b: Box2,
    tolerance: f64,
    depth: u32,
    forced: u32,
) -> Moments {
    if forced == 0 {
        let (coarse, fine) = (rule(f, b, &G3), rule(f, b, &G5));
        if depth == 0 || (coarse[0] - fine[0]).abs() <= tolerance {
            return fine;
        }
    }
    let mut sum = [0.0; 4];
    for half in b.split(0, b.middle(0)) {
        for quarter in half.split(1, half.middle(1)) {
            let forced = forced.saturating_sub(1);
            sum = add(
                sum,
                refine(f, quarter, 0.5 * tolerance, depth.saturating_sub(1), forced),
            );
        }
    }
    sum
}

fn rule(f: &impl Fn([f64; 2]) -> Moments, b: Box2, nodes: &[(f64, f64)]) -> Moments {
    let half = [0.5 * (b.hi[0] - b.lo[0]), 0.5 * (b.hi[1] - b.lo[1])];
    let mut sum = [0.0; 4];
    for &(x, wx) in nodes {
        for &(y, wy) in nodes {
            let w = wx * wy * half[0] * half[1];
            let v = f([b.middle(0) + half[0] * x, b.middle(1) + half[1] * y]);
            for (s, v) in sum.iter_mut().zip(v) {
                *s += w * v;
            }
        }
    }
    sum
}

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

    pub fn middle(&self, axis: usize) -> f64 {
        0.5 * (self.lo[axis] + self.hi[axis])
    }
}

/// How often a box may be quartered, and how often it is when it looks too empty.
const DEPTH: u32 = 12;
const FORCED: u32 = 4;

/// Integral of `f` over the box, refined where two rules disagree by more than `tolerance` (absolute, of
/// the first moment). A box is expected to hold at least `least`: when it seems to hold less, a peak may
/// hide between the nodes, and it is looked at more closely.
pub fn integrate(f: &impl Fn([f64; 2]) -> Moments, b: Box2, tolerance: f64, least: f64) -> Moments {
    let (coarse, fine) = (rule(f, b, &G3), rule(f, b, &G5));
    if (coarse[0] - fine[0]).abs() <= tolerance && fine[0] >= least {
        return fine;
    }
    let forced = if fine[0] < least { FORCED } else { 1 };
    quarters(f, b, tolerance, DEPTH, forced)
}

fn quarters(
    f: &impl Fn([f64; 2]) -> Moments,
    b: Box2,
    tolerance: f64,
    depth: u32,
    forced: u32,
) -> Moments {
    let [left, right] = b.split(0, b.middle(0));
    let mut sum = [0.0; 4];
    for half in [left, right] {
        for quarter in half.split(1, half.middle(1)) {
            let refine = |t| quarters(f, quarter, t, depth - 1, forced.saturating_sub(1));
            let part = if forced > 1 {
                refine(tolerance)
            } else {
                let (coarse, fine) = (rule(f, quarter, &G3), rule(f, quarter, &G5));
                if depth == 0 || (coarse[0] - fine[0]).abs() <= tolerance {
                    fine
                } else {
                    refine(0.5 * tolerance)
                }
            };
            sum = add(sum, part);
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

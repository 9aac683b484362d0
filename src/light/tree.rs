//! The light tree: choosing among many lights by what they can do for the point that is lit.
//!
//! Source: Conty Estévez & Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting".
//! A binary tree over light bounds (box, cone of normals, power), built by their surface area orientation
//! heuristic; a stochastic descent chooses a child by the importance of both.

use crate::geom::Hit;
use crate::math::fp::ONE_MINUS_EPSILON;
use crate::math::{Aabb, Vec3, safe_sqrt};
use std::f32::consts::{FRAC_PI_2, PI};

/// What the tree knows of a light, or of all lights below a node. Emission is confined to within an angle,
/// the reach, of one of the normals (or axes): a right angle for surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBounds {
    pub bounds: Aabb,
    /// Axis of the cone that holds all normals, and the cosine of its half-angle; -1 for all directions.
    pub axis: Vec3,
    pub cos_spread: f32,
    /// Cosine of the reach.
    pub cos_reach: f32,
    pub power: f32,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    center: Vec3,
    /// Of the sphere around the box.
    radius2: f32,
    axis: Vec3,
    cos_spread: f32,
    cos_reach: f32,
    power: f32,
    /// Second child (the first one follows its parent), or the item of a leaf.
    link: Link,
}

#[derive(Clone, Copy, Debug)]
enum Link {
    Inner(u32),
    Leaf(u32),
}

/// See the module page.
#[derive(Clone, Debug)]
pub(crate) struct LightTree {
    nodes: Vec<Node>,
    /// The way from the root to each item: bit i is set where the second child is taken at depth i.
    trails: Vec<u64>,
}

/// Below this depth splits are by median, so that no trail grows beyond 64 bits.
const SAOH_DEPTH: u32 = 32;
const BUCKETS: usize = 12;

/// Importance of a cluster behind the surface relative to the same in front: most surfaces do not
/// transmit, but those that do must not be starved.
const BEHIND: f32 = 0.1;

impl LightTree {
    pub fn new(items: &[LightBounds]) -> LightTree {
        let mut tree = LightTree {
            nodes: Vec::with_capacity(2 * items.len()),
            trails: vec![0; items.len()],
        };
        let total: f64 = items.iter().map(|b| b.power as f64).sum();
        let mut order: Vec<(u32, LightBounds)> = items
            .iter()
            .enumerate()
            .map(|(i, b)| {
                let mut b = *b;
                // Relative to the whole, so that products with squared distances stay in range.
                b.power = ((b.power as f64 / total) as f32).max(f32::MIN_POSITIVE);
                (i as u32, b)
            })
            .collect();
        if !order.is_empty() {
            tree.build(&mut order, 0, 0);
        }
        tree
    }

    fn build(&mut self, items: &mut [(u32, LightBounds)], depth: u32, trail: u64) -> LightBounds {
        let at = self.nodes.len();
        if let [(item, b)] = items {
            self.nodes.push(Node::new(b, Link::Leaf(*item)));
            self.trails[*item as usize] = trail;
            return *b;
        }
        let whole = items.iter().skip(1).fold(items[0].1, |a, b| a.union(&b.1));
        self.nodes.push(Node::new(&whole, Link::Leaf(0)));
        let mid = if depth < SAOH_DEPTH {
            split(items, &whole)
        } else {
            None
        };
        let mid = mid.unwrap_or_else(|| {
            let axis = widest(&centroids(items));
            let mid = items.len() / 2;
            items.select_nth_unstable_by(mid, |a, b| {
                let (x, y) = (a.1.bounds.center()[axis], b.1.bounds.center()[axis]);
                x.total_cmp(&y).then(a.0.cmp(&b.0))
            });
            mid
        });
        let (left, right) = items.split_at_mut(mid);
        self.build(left, depth + 1, trail);
        let second = self.nodes.len() as u32;
        self.build(right, depth + 1, trail | 1 << depth);
        self.nodes[at].link = Link::Inner(second);
        whole
    }

    /// An item, and its probability, for the point `from`. `None` when no light can reach it.
    pub fn sample(&self, from: &Hit, mut u: f32) -> Option<(usize, f32)> {
        let eye = Eye::new(from);
        let (mut at, mut prob) = (0, 1.0);
        loop {
            let second = match self.nodes.get(at)?.link {
                Link::Leaf(item) => return Some((item as usize, prob)),
                Link::Inner(second) => second as usize,
            };
            let p = self.share(at + 1, second, &eye)?;
            if u < p {
                (at, prob, u) = (at + 1, prob * p, u / p);
            } else {
                (at, prob, u) = (second, prob * (1.0 - p), (u - p) / (1.0 - p));
            }
            u = u.min(ONE_MINUS_EPSILON);
        }
    }

    /// Probability that [`LightTree::sample`] chooses `item`.
    pub fn prob(&self, from: &Hit, item: usize) -> f32 {
        let Some(&trail) = self.trails.get(item) else {
            return 0.0;
        };
        let eye = Eye::new(from);
        let (mut at, mut prob, mut trail) = (0, 1.0, trail);
        while let Link::Inner(second) = self.nodes[at].link {
            let Some(p) = self.share(at + 1, second as usize, &eye) else {
                return 0.0;
            };
            if trail & 1 == 0 {
                (at, prob) = (at + 1, prob * p);
            } else {
                (at, prob) = (second as usize, prob * (1.0 - p));
            }
            trail >>= 1;
        }
        prob
    }

    /// Probability of the first of two siblings.
    fn share(&self, first: usize, second: usize, eye: &Eye) -> Option<f32> {
        let a = self.nodes[first].importance(eye);
        let b = self.nodes[second].importance(eye);
        // A share above 1 - 2^-24 would leave the second child a probability but no numbers.
        (a + b > 0.0).then(|| {
            if b == 0.0 {
                1.0
            } else {
                (a / (a + b)).min(ONE_MINUS_EPSILON)
            }
        })
    }
}

/// The point that is lit, with its normal on the side it is seen from.
struct Eye {
    p: Vec3,
    n: Vec3,
}

impl Eye {
    fn new(from: &Hit) -> Eye {
        let n = from.frame.n;
        Eye {
            p: from.p,
            n: if from.wo.dot(n) < 0.0 { -n } else { n },
        }
    }
}

impl Node {
    fn new(b: &LightBounds, link: Link) -> Node {
        Node {
            center: b.bounds.center(),
            radius2: 0.25 * b.bounds.diagonal().length_squared(),
            axis: b.axis,
            cos_spread: b.cos_spread,
            cos_reach: b.cos_reach,
            power: b.power,
            link,
        }
    }

    /// A guess of the light from here at `eye` (equation 3 of the paper); zero only where none can come.
    fn importance(&self, eye: &Eye) -> f32 {
        let w = eye.p - self.center;
        let d2 = w.length_squared();
        // Half-angle under which the sphere around the lights is seen.
        let (sin_u, cos_u) = if d2 <= self.radius2 {
            (0.0, -1.0)
        } else {
            let sin2 = self.radius2 / d2;
            (sin2.sqrt(), safe_sqrt(1.0 - sin2))
        };
        let w = w / d2.sqrt().max(f32::MIN_POSITIVE);
        let emitted = if self.cos_spread <= -1.0 || cos_u <= -1.0 {
            1.0
        } else {
            let cos = self.axis.dot(w).clamp(-1.0, 1.0);
            let sin_spread = safe_sqrt(1.0 - self.cos_spread * self.cos_spread);
            let (s, c) = subtract(
                (safe_sqrt(1.0 - cos * cos), cos),
                (sin_spread, self.cos_spread),
            );
            let (_, c) = subtract((s, c), (sin_u, cos_u));
            // Some room for the roundings on the way here: a light that can be seen is never lost.
            if c < self.cos_reach - 1e-3 {
                return 0.0;
            }
            c.max(1e-3)
        };
        let cos = (-eye.n.dot(w)).clamp(-1.0, 1.0);
        let sin = safe_sqrt(1.0 - cos * cos);
        let received = if cos_u <= -1.0 {
            1.0
        } else {
            let front = subtract((sin, cos), (sin_u, cos_u)).1;
            let back = subtract((sin, -cos), (sin_u, cos_u)).1;
            front.max(BEHIND * back).max(1e-3)
        };
        let falloff = d2.max(self.radius2).max(1e-30);
        (self.power * emitted * received / falloff).max(f32::MIN_POSITIVE)
    }
}

/// Sine and cosine of the difference of two angles in [0, π], zero where it would be negative.
fn subtract((sin_a, cos_a): (f32, f32), (sin_b, cos_b): (f32, f32)) -> (f32, f32) {
    if cos_a >= cos_b {
        (0.0, 1.0)
    } else {
        (sin_a * cos_b - cos_a * sin_b, cos_a * cos_b + sin_a * sin_b)
    }
}

impl LightBounds {
    fn union(&self, o: &LightBounds) -> LightBounds {
        let (axis, cos_spread) = cone_union((self.axis, self.cos_spread), (o.axis, o.cos_spread));
        LightBounds {
            bounds: self.bounds.union(o.bounds),
            axis,
            cos_spread,
            cos_reach: self.cos_reach.min(o.cos_reach),
            power: self.power + o.power,
        }
    }

    /// Measure of the directions that are lit, weighted by the cosine beyond the cone of normals (the
    /// paper's M_Ω; its emission angle is the reach).
    fn orientation(&self) -> f32 {
        let o = self.cos_spread.clamp(-1.0, 1.0).acos();
        let w = (o + self.cos_reach.clamp(-1.0, 1.0).acos()).min(PI);
        let (sin, cos) = o.sin_cos();
        2.0 * PI * (1.0 - cos)
            + FRAC_PI_2 * (2.0 * w * sin - (o - 2.0 * w).cos() - 2.0 * o * sin + cos)
    }

    fn cost(&self) -> f32 {
        let d = self.bounds.diagonal();
        let area = 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x);
        self.power * area * self.orientation()
    }
}

/// The smallest cone around two cones (paper, algorithm 1).
fn cone_union((a, cos_a): (Vec3, f32), (b, cos_b): (Vec3, f32)) -> (Vec3, f32) {
    let (spread_a, spread_b) = (cos_a.clamp(-1.0, 1.0).acos(), cos_b.clamp(-1.0, 1.0).acos());
    let between = 2.0 * (a - b).length().atan2((a + b).length());
    if (between + spread_b).min(PI) <= spread_a {
        return (a, cos_a);
    }
    if (between + spread_a).min(PI) <= spread_b {
        return (b, cos_b);
    }
    let spread = 0.5 * (spread_a + spread_b + between);
    let across = (b - a * a.dot(b)).normalize_or_zero();
    if spread >= PI || across == Vec3::ZERO {
        return (Vec3::Z, -1.0);
    }
    let (sin, cos) = (spread - spread_a).sin_cos();
    // A little wider, for the roundings.
    (
        (a * cos + across * sin).normalize_or(Vec3::Z),
        (spread + 1e-5).min(PI).cos(),
    )
}

fn centroids(items: &[(u32, LightBounds)]) -> Aabb {
    let mut b = Aabb::EMPTY;
    for i in items {
        b.grow(i.1.bounds.center());
    }
    b
}

fn widest(b: &Aabb) -> usize {
    let d = b.diagonal();
    (0..3).fold(0, |w, k| if d[k] > d[w] { k } else { w })
}

/// Parts the items where the surface area orientation heuristic costs least, over buckets of equal width
/// on each axis; `None` when the centres coincide or no parting helps to compare.
fn split(items: &mut [(u32, LightBounds)], whole: &LightBounds) -> Option<usize> {
    let centers = centroids(items);
    let extent = whole.bounds.diagonal();
    let mut best: Option<(f32, usize, usize)> = None;
    let bucket_of = |b: &LightBounds, axis: usize| {
        let t = (b.bounds.center()[axis] - centers.min[axis]) / centers.diagonal()[axis];
        ((t * BUCKETS as f32) as usize).min(BUCKETS - 1)
    };
    for axis in 0..3 {
        if centers.diagonal()[axis] <= 0.0 {
            continue;
        }
        let mut buckets: [Option<LightBounds>; BUCKETS] = [None; BUCKETS];
        let join = |a: Option<LightBounds>, b: Option<LightBounds>| match (a, b) {
            (Some(a), Some(b)) => Some(a.union(&b)),
            (a, b) => a.or(b),
        };
        for (_, b) in items.iter() {
            let k = bucket_of(b, axis);
            buckets[k] = join(buckets[k], Some(*b));
        }
        // Thin boxes are not to be cut across their short sides.
        let thinness = extent.max_element() / extent[axis];
        let mut above = [None; BUCKETS];
        for k in (1..BUCKETS).rev() {
            above[k - 1] = join(buckets[k], above[k]);
        }
        let mut below = None;
        for k in 0..BUCKETS - 1 {
            below = join(below, buckets[k]);
            if let (Some(l), Some(r)) = (below, above[k]) {
                let cost = thinness * (l.cost() + r.cost());
                if cost.is_finite() && best.is_none_or(|b| cost < b.0) {
                    best = Some((cost, axis, k));
                }
            }
        }
    }
    let (cost, axis, k) = best?;
    // Lights without extent cost nothing anywhere: the median serves them better.
    if cost <= 0.0 {
        return None;
    }
    items.sort_unstable_by_key(|i| (bucket_of(&i.1, axis) > k, i.0));
    Some(items.partition_point(|i| bucket_of(&i.1, axis) <= k))
}

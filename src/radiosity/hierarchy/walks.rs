//! What arrives at patches by rays, to put links right.
//!
//! Links err one by one: what one ray too few found to be blocked brings nothing, and a gap that many links go
//! through is too dark by all of them. So where it counts, random walks (see [`trace`]) look at the scene itself. The
//! light that links bring to a node is then scaled so that it is, in the mean over the points that walks left from,
//! what arrived by them. Patches where many walks came by are divided first: what lies on both sides of a wall, or of
//! the edge of a shadow, has one light as far as links know, but not as far as walks do.
//!
//! Since walks meet surfaces as light does, points count by what they see of the scene: the parts of a patch that
//! lie behind a wall or within another body have no walks, and do not darken the rest.

use super::bodies::Parts;
use super::trace::{self, Point, Traces};
use super::tree::{Gain, NONE, Tree};
use crate::radiosity::Rgb64;
use crate::radiosity::optics::rgb64;
use rayon::prelude::*;

/// Points that walks left from, and what arrives there.
pub struct Walks {
    /// By patch: how many points it has.
    visits: Vec<u32>,
    /// By patch: irradiance straight from emitters, summed over its points, in W/m².
    pub direct: Arrived,
    /// The same from emitters by mirrors, glass and gloss.
    pub stray: Arrived,
    /// What edges found; those from patch i are `first[i]..first[i + 1]`.
    terms: Vec<Term>,
    first: Vec<u32>,
    /// By patch: its node.
    pub leaf: Vec<u32>,
    /// By patch: irradiance straight from emitters as corrected, in W/m².
    straight: Vec<Rgb64>,
}

/// What came to the points that walks left from, by patch.
pub struct Arrived {
    /// Irradiance summed over the points, in W/m².
    pub sum: Vec<Rgb64>,
    /// The square of the sum of its channels, summed over the points.
    pub squares: Vec<f64>,
}

/// An edge to a point of patch `to` brings `weight` times the irradiance there.
#[derive(Clone, Copy)]
struct Term {
    from: u32,
    to: u32,
    weight: [f32; 3],
    /// See [`trace::Term`].
    lit: Option<[f32; 3]>,
}

impl Walks {
    /// Of `traces`, for a mesh whose patches are the nodes `leaf` of `tree`, which was divided further since
    /// `traced`, the nodes that patches were when the walks were traced.
    pub fn new(tree: &Tree, traces: Traces, traced: &[u32], leaf: Vec<u32>) -> Walks {
        let mut patch_of = vec![NONE; tree.nodes.len()];
        for (patch, &node) in leaf.iter().enumerate() {
            patch_of[node as usize] = patch as u32;
        }
        let patch_at =
            |at: &Point| patch_of[tree.leaf_at(traced[at.patch as usize], at.st) as usize];
        let mut walks = Walks {
            visits: vec![0; leaf.len()],
            direct: Arrived {
                sum: vec![Rgb64::ZERO; leaf.len()],
                squares: vec![0.0; leaf.len()],
            },
            stray: Arrived {
                sum: vec![Rgb64::ZERO; leaf.len()],
                squares: vec![0.0; leaf.len()],
            },
            straight: vec![Rgb64::ZERO; leaf.len()],
            terms: Vec::new(),
            first: Vec::new(),
            leaf,
        };
        let from: Vec<u32> = traces.visits.par_iter().map(|v| patch_at(&v.at)).collect();
        for (visit, &patch) in traces.visits.iter().zip(&from) {
            let patch = patch as usize;
            walks.visits[patch] += 1;
            let direct = rgb64(visit.direct);
            walks.direct.sum[patch] += direct;
            walks.direct.squares[patch] += direct.element_sum().powi(2);
            let stray = rgb64(visit.stray);
            walks.stray.sum[patch] += stray;
            walks.stray.squares[patch] += stray.element_sum().powi(2);
        }
        let term = |t: &trace::Term| Term {
            from: from[t.from as usize],
            to: patch_at(&t.to),
            weight: t.weight,
            lit: t.lit,
        };
        walks.terms = traces.terms.par_iter().map(term).collect();
        walks.terms.par_sort_by_key(|t| t.from);
        let start = |i: u32| walks.terms.partition_point(|t| t.from < i) as u32;
        walks.first = (0..=walks.leaf.len() as u32)
            .into_par_iter()
            .map(start)
            .collect();
        walks
    }

    /// Patches that walks met.
    pub fn met(&self) -> Vec<u32> {
        let mut met = vec![false; self.leaf.len()];
        for (met, visits) in met.iter_mut().zip(&self.visits) {
            *met = *visits > 0;
        }
        for term in &self.terms {
            met[term.to as usize] = true;
        }
        let patches = 0..self.leaf.len() as u32;
        patches.filter(|i| met[*i as usize]).collect()
    }

    /// To be told, by patch, before it is asked what arrives: irradiance straight from emitters, in W/m².
    pub fn set_straight(&mut self, straight: Vec<Rgb64>) {
        self.straight = straight;
    }

    /// What arrives if patches have `irradiance` (by patch). What comes straight from emitters counts as it does at
    /// the very points that edges lead to: the mean over a patch that lies partly in a shadow would light what casts it.
    pub fn arriving(&self, irradiance: &[Rgb64]) -> Arrived {
        let of = |patch: usize| {
            let range = self.first[patch] as usize..self.first[patch + 1] as usize;
            let (mut sum, mut squares) = (Rgb64::ZERO, 0.0);
            for t in &self.terms[range] {
                let e = self.brought(t, irradiance);
                sum += e;
                squares += e.element_sum().powi(2);
            }
            (sum, squares)
        };
        let found: Vec<(Rgb64, f64)> = (0..self.leaf.len()).into_par_iter().map(of).collect();
        Arrived {
            squares: found.iter().map(|f| f.1).collect(),
            sum: found.into_iter().map(|f| f.0).collect(),
        }
    }

    /// Irradiance that an edge brings.
    fn brought(&self, t: &Term, irradiance: &[Rgb64]) -> Rgb64 {
        let to = t.to as usize;
        let weight = Rgb64::from_array(t.weight.map(f64::from));
        match t.lit {
            None => weight * irradiance[to],
            Some(lit) => {
                let reflected = (irradiance[to] - self.straight[to]).max(Rgb64::ZERO);
                weight * reflected + Rgb64::from_array(lit.map(f64::from))
            }
        }
    }

    /// What makes of `linked`, what links bring to patches (by patch), what `arrived`: by node of `order`. What is
    /// known of the node above weighs by how much gains of nodes differ from it: their relative variance `spread`; `None`: as the
    /// gains themselves tell.
    pub fn gains(
        &self,
        tree: &Tree,
        order: &Order,
        arrived: &Arrived,
        linked: &[Rgb64],
        spread: Option<f64>,
    ) -> (Vec<Gain>, f64) {
        let mut sums = vec![Sums::default(); order.nodes.len()];
        for (patch, &visits) in self.visits.iter().enumerate().filter(|(_, n)| **n > 0) {
            let n = f64::from(visits);
            let [sum, by_links] = [arrived.sum[patch], linked[patch]].map(Rgb64::element_sum);
            sums[order.number[self.leaf[patch] as usize] as usize].add(&Sums {
                n,
                arrived: arrived.sum[patch],
                linked: linked[patch] * n,
                within: (arrived.squares[patch] - sum * sum / n).max(0.0),
                freedom: n - 1.0,
                scale: n * by_links * by_links,
            });
        }
        // Nodes come before what they contain.
        let above = |i: usize| match tree.nodes[order.nodes[i] as usize].parent {
            NONE => None,
            parent => Some(order.number[parent as usize] as usize),
        };
        for i in (0..sums.len()).rev() {
            if let Some(above) = above(i) {
                let below = sums[i];
                sums[above].add(&below);
            }
        }
        // Of one point; where few are known, as around.
        let mut variances = Vec::<f64>::with_capacity(sums.len());
        for (i, sum) in sums.iter().enumerate() {
            let around = above(i).map_or(f64::NAN, |above| variances[above]);
            variances.push(sum.variance().unwrap_or(around));
        }
        let spread = spread.unwrap_or_else(|| {
            let with_parent = |i: usize| {
                let above = above(i)?;
                Some((&sums[i], &sums[above], variances[above]))
            };
            spread_of_gains((0..sums.len()).filter_map(with_parent))
        });
        let mut out = vec![Gain::NONE; sums.len()];
        // What is thought to have arrived: of the root, what did.
        let mut arrived: Vec<Rgb64> = sums.iter().map(|s| s.arrived).collect();
        for (i, &node) in order.nodes.iter().enumerate() {
            let inherited = above(i).map_or(Gain::NONE, |above| out[above]);
            out[i] = sums[i].gain(arrived[i], inherited);
            let inside = tree
                .children(node)
                .map(|c| order.number[c as usize] as usize);
            // The parts of a body are not told apart.
            let inside = inside.filter(|c| *c != i);
            let mut whole = Rgb64::ZERO;
            let prior = points_of_prior(variances[i], spread);
            for c in inside.clone() {
                arrived[c] = sums[c].believed(&out[i], prior);
                whole += arrived[c];
            }
            // Together what arrived at the whole.
            let share = arrived[i] / whole;
            for c in inside {
                let believed = arrived[c] * share;
                if believed.is_finite() {
                    arrived[c] = believed;
                }
            }
        }
        (out, spread)
    }
}

/// How many points tell as much as the node above, by the relative variances of one point and of gains around the gain
/// of the node above: so good links stay what they are, and bad ones follow the walks.
fn points_of_prior(variance: f64, spread: f64) -> f64 {
    /// Bounds where chance rules.
    const FEWEST: f64 = 16.0;
    const MOST: f64 = 1e6;
    let points = variance / spread;
    match points.is_nan() {
        true => MOST,
        false => points.clamp(FEWEST, MOST),
    }
}

/// Relative variance of gains around those of the nodes above, by the method of moments (DerSimonian & Laird 1986):
/// of nodes, with what they are in and the relative variance of one point there.
fn spread_of_gains<'a>(nodes: impl Iterator<Item = (&'a Sums, &'a Sums, f64)>) -> f64 {
    let (mut excess, mut weights) = (0.0, 0.0);
    for (node, above, variance) in nodes.filter(|(node, _, _)| node.n > 0.0) {
        let expected =
            node.linked.element_sum() * above.arrived.element_sum() / above.linked.element_sum();
        let deviation = node.arrived.element_sum() / expected - 1.0;
        let weight = node.n / variance;
        // Of what is hardly linked, gains say nothing; one far off does not rule over all.
        if deviation.is_finite() && weight.is_finite() {
            excess += (weight * deviation.clamp(-1.0, 1.0).powi(2)) - 1.0;
            weights += weight;
        }
    }
    match excess > 0.0 {
        true => excess / weights,
        false => 0.0,
    }
}

/// Nodes that have gains, those above before those below.
pub struct Order {
    pub nodes: Vec<u32>,
    /// By node: its number in this order; of nodes in a body, that of the body.
    pub number: Vec<u32>,
}

impl Order {
    /// All nodes, or those that exchange light.
    pub fn new(tree: &Tree, parts: Option<&Parts>) -> Order {
        let mut order = Order {
            nodes: Vec::new(),
            number: vec![NONE; tree.nodes.len()],
        };
        for node in 0..tree.nodes.len() as u32 {
            let body = parts.map_or(NONE, |parts| parts.body_of[node as usize]);
            let body = parts
                .filter(|_| body != NONE)
                .map(|parts| parts.bodies[body as usize].node);
            order.number[node as usize] = match body {
                Some(body) if body != node => order.number[body as usize],
                _ => {
                    order.nodes.push(node);
                    order.nodes.len() as u32 - 1
                }
            };
        }
        order
    }
}

/// Of the points in a node.
#[derive(Clone, Copy, Default)]
struct Sums {
    n: f64,
    arrived: Rgb64,
    linked: Rgb64,
    /// Squares of what arrived at each point less the mean of its patch, of the sum of the channels; and how many of them
    /// are independent.
    within: f64,
    freedom: f64,
    /// Squares of what links bring to each point, of the sum of the channels.
    scale: f64,
}

impl Sums {
    fn add(&mut self, o: &Sums) {
        self.n += o.n;
        self.arrived += o.arrived;
        self.linked += o.linked;
        self.within += o.within;
        self.freedom += o.freedom;
        self.scale += o.scale;
    }

    /// Variance of what arrives at one point, relative to the square of what is expected there; `None` where too few
    /// points tell.
    fn variance(&self) -> Option<f64> {
        /// Points by which a variance is known to about a third, if tails are not too heavy.
        const ENOUGH: f64 = 16.0;
        let gain = self.arrived.element_sum() / self.linked.element_sum();
        let expected = gain * gain * self.scale / self.n;
        let variance = self.within / self.freedom / expected;
        (self.freedom >= ENOUGH && variance > 0.0 && variance.is_finite()).then_some(variance)
    }

    /// What arrived, as far as can be known by what was found here and by the gain of the node above.
    fn believed(&self, above: &Gain, prior: f64) -> Rgb64 {
        if self.n <= 0.0 {
            return Rgb64::ZERO;
        }
        let share = prior / self.n;
        let expected = above.scale * self.linked + above.more * self.n;
        (self.arrived + expected * share) / (1.0 + share)
    }

    /// The gain that makes it `arrived`; `inherited` where nothing is known.
    fn gain(&self, arrived: Rgb64, inherited: Gain) -> Gain {
        /// By how much links may be scaled up; what is still missing is added, the same everywhere.
        const MOST: f64 = 4.0;
        if self.n <= 0.0 {
            return inherited;
        }
        let of = |c: usize| {
            let ratio = arrived[c] / self.linked[c];
            match ratio.is_finite() {
                true => ratio.min(MOST),
                false => 1.0,
            }
        };
        let scale = Rgb64::new(of(0), of(1), of(2));
        let more = (arrived - scale * self.linked).max(Rgb64::ZERO) / self.n;
        Gain { scale, more }
    }
}

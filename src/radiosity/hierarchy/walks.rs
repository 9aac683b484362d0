//! What arrives at patches by rays, to put links right.
//!
//! Links err one by one: what one ray too few found to be blocked brings nothing, and a gap that many links go
//! through is too dark by all of them. So where it counts, random walks from surface to surface look at the scene
//! itself. Each edge of a walk, from a point x in a direction by the cosine to the point y, is a sample of the
//! irradiance at x: E(x) = π ⟨L(y → x)⟩, with L(y → x) = ρ E(y) / π from the solution. The light that links bring to a
//! node is then scaled so that it is, in the mean over the points that walks left from, what arrived by them.
//!
//! Since walks meet surfaces as light does, points count by what they see of the scene: the parts of a patch that
//! lie behind a wall or within another body have no walks, and do not darken the rest. On the way, mirrors, glass
//! and gloss do to a walk what they do to light.

use super::bodies::Parts;
use super::gather::Field;
use super::tree::{Gain, NONE, Tree};
use crate::bsdf::{Bsdf, Density, Mode};
use crate::geom::Hit;
use crate::math::{DVec2, Frame, PI, Rgb, Vec2, Vec3, warp};
use crate::radiosity::mesh::{Patch, on_facet};
use crate::radiosity::optics::rgb64;
use crate::radiosity::{Gloss, PatchMesh, Rgb64, SolveSpec};
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use rayon::prelude::*;

/// Edges of a walk between diffuse surfaces, at most: enough to get around in a building.
const LONGEST: u32 = 32;
/// Mirrors, glass and gloss in a row, at most.
const PASSES: u32 = 8;

/// Points that walks left from, and what arrives there.
pub struct Walks {
    /// By patch: how many points it has.
    visits: Vec<u32>,
    /// By patch: irradiance straight from emitters, summed over its points, in W/m².
    pub direct: Arrived,
    /// The same from emitters by mirrors, glass and gloss.
    stray: Vec<Rgb64>,
    /// What edges found; those from patch i are `first[i]..first[i + 1]`.
    terms: Vec<Term>,
    first: Vec<u32>,
    /// By patch: its node.
    pub leaf: Vec<u32>,
}

/// What came to the points that walks left from, by patch.
pub struct Arrived {
    /// Irradiance summed over the points, in W/m².
    pub sum: Vec<Rgb64>,
    /// The square of the sum of its channels, summed over all points.
    pub squares: f64,
}

/// An edge brings `weight` times the irradiance of patch `to`.
#[derive(Clone, Copy)]
struct Term {
    from: u32,
    to: u32,
    weight: [f32; 3],
}

/// What one walk met.
#[derive(Default)]
struct Walk {
    visits: Vec<Visit>,
    terms: Vec<Term>,
}

/// Irradiance at a point of a patch, in W/m²: straight from emitters, and from these by mirrors, glass and gloss.
struct Visit {
    patch: u32,
    direct: Rgb,
    stray: Rgb,
}

impl Walks {
    /// About as many edges as asked for; fewer where they leave the scene soon. Walks start where the light of `field`
    /// leaves patches, and go on with equal chances, however dark a surface is.
    pub fn new(
        scene: &Scene,
        tree: &Tree,
        (mesh, leaf): (&PatchMesh, Vec<u32>),
        field: &Field,
        spec: &SolveSpec,
    ) -> Walks {
        let mut sums = Vec::with_capacity(leaf.len());
        let mut sum = 0.0;
        for (patch, &node) in mesh.patches.iter().zip(&leaf) {
            sum += (field.radiosity[node as usize].element_sum() * patch.area).max(0.0);
            sums.push(sum);
        }
        let mut walks = Walks {
            visits: vec![0; leaf.len()],
            direct: Arrived {
                sum: vec![Rgb64::ZERO; leaf.len()],
                squares: 0.0,
            },
            stray: vec![Rgb64::ZERO; leaf.len()],
            terms: Vec::new(),
            first: Vec::new(),
            leaf,
        };
        let walk = |i: u64| {
            let sampler = Sampler::new(SamplerKind::Sobol, spec.seed, u64::MAX - 1, i, 1);
            let [x, y, pick, _] = sampler.get4(0);
            let at = f64::from(pick) * sum;
            let patch = sums.partition_point(|s| *s <= at).min(sums.len() - 1);
            let Patch { piece, facet, .. } = mesh.patches[patch];
            let st = piece.outline.sample(DVec2::new(f64::from(x), f64::from(y)));
            let hit = on_facet(scene, &tree.surfaces, facet, &piece, st);
            let walker = Walker {
                scene,
                mesh,
                gloss: spec.gloss,
                sampler,
                blocks: 0,
                walk: Walk::default(),
            };
            walker.walk(patch as u32, hit)
        };
        // Rounds, until there are enough edges.
        let round = spec.walks.div_ceil(u64::from(LONGEST));
        let (mut made, mut number) = (0, 0);
        while sum.is_finite() && sum > 0.0 && made < spec.walks && number < spec.walks {
            let found: Vec<Walk> = (number..number + round).into_par_iter().map(walk).collect();
            number += round;
            made += walks.add(found);
        }
        walks.terms.par_sort_by_key(|t| t.from);
        let start = |i: u32| walks.terms.partition_point(|t| t.from < i) as u32;
        walks.first = (0..=mesh.len() as u32).into_par_iter().map(start).collect();
        walks
    }

    /// Gives how many edges that are.
    fn add(&mut self, found: Vec<Walk>) -> u64 {
        let mut edges = 0;
        for walk in found {
            for visit in &walk.visits {
                let patch = visit.patch as usize;
                self.visits[patch] += 1;
                let direct = rgb64(visit.direct);
                self.direct.sum[patch] += direct;
                self.direct.squares += direct.element_sum().powi(2);
                self.stray[patch] += rgb64(visit.stray);
            }
            edges += walk.visits.len() as u64;
            self.terms.extend(walk.terms);
        }
        edges
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

    /// What arrives if patches have `irradiance` (by patch).
    pub fn arriving(&self, irradiance: &[Rgb64]) -> Arrived {
        let of = |patch: usize| {
            let range = self.first[patch] as usize..self.first[patch + 1] as usize;
            let (mut sum, mut squares) = (self.stray[patch], 0.0);
            for t in &self.terms[range] {
                let e = Rgb64::from_array(t.weight.map(f64::from)) * irradiance[t.to as usize];
                sum += e;
                squares += e.element_sum().powi(2);
            }
            (sum, squares)
        };
        let found: Vec<(Rgb64, f64)> = (0..self.leaf.len()).into_par_iter().map(of).collect();
        Arrived {
            squares: found.iter().map(|f| f.1).sum(),
            sum: found.into_iter().map(|f| f.0).collect(),
        }
    }

    /// What makes of `linked`, what links bring to patches (by patch), what `arrived`: by node of `order`. What is
    /// known of the node above weighs as much as `prior` points; `None`: as many as the gains themselves tell.
    pub fn gains(
        &self,
        tree: &Tree,
        order: &Order,
        arrived: &Arrived,
        linked: &[Rgb64],
        prior: Option<f64>,
    ) -> (Vec<Gain>, f64) {
        let mut sums = vec![Sums::default(); order.nodes.len()];
        for (patch, &visits) in self.visits.iter().enumerate().filter(|(_, n)| **n > 0) {
            let n = f64::from(visits);
            sums[order.number[self.leaf[patch] as usize] as usize].add(&Sums {
                n,
                arrived: arrived.sum[patch],
                linked: linked[patch] * n,
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
        let prior = prior.unwrap_or_else(|| {
            let with_parent = |i: usize| Some((&sums[i], &sums[above(i)?]));
            let pairs = (0..sums.len()).filter_map(with_parent);
            points_of_prior(sums.first(), arrived.squares, pairs)
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
        (out, prior)
    }
}

/// Variance over squared mean, of `n` numbers.
fn relative_variance(sum: f64, squares: f64, n: f64) -> f64 {
    squares * n / (sum * sum) - 1.0
}

/// How many points tell as much as the node above: the variance of one point over that of gains around the gain of
/// the node above, both relative; of gains by the method of moments (DerSimonian & Laird 1986), from all nodes below
/// `root` and what they are in. So good links stay what they are, and bad ones follow the walks.
fn points_of_prior<'a>(
    root: Option<&Sums>,
    squares: f64,
    nodes: impl Iterator<Item = (&'a Sums, &'a Sums)>,
) -> f64 {
    /// Bounds where chance rules.
    const FEWEST: f64 = 16.0;
    const MOST: f64 = 1e6;
    let Some(root) = root.filter(|root| root.n > 0.0) else {
        return MOST;
    };
    let variance = relative_variance(root.arrived.element_sum(), squares, root.n);
    if !(variance.is_finite() && variance > 0.0) {
        return MOST;
    }
    let (mut excess, mut weights) = (0.0, 0.0);
    for (node, above) in nodes.filter(|(node, _)| node.n > 0.0) {
        let expected =
            node.linked.element_sum() * above.arrived.element_sum() / above.linked.element_sum();
        let deviation = node.arrived.element_sum() / expected - 1.0;
        // Of what is hardly linked, gains say nothing; one far off does not rule over all.
        if deviation.is_finite() {
            let weight = node.n / variance;
            excess += (weight * deviation.clamp(-1.0, 1.0).powi(2)) - 1.0;
            weights += weight;
        }
    }
    match excess > 0.0 {
        true => (variance * weights / excess).clamp(FEWEST, MOST),
        false => MOST,
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
}

impl Sums {
    fn add(&mut self, o: &Sums) {
        self.n += o.n;
        self.arrived += o.arrived;
        self.linked += o.linked;
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

/// On its way.
struct Walker<'a> {
    scene: &'a Scene,
    mesh: &'a PatchMesh,
    gloss: Gloss,
    sampler: Sampler,
    /// Numbers that are used up.
    blocks: u32,
    walk: Walk,
}

impl Walker<'_> {
    fn numbers(&mut self) -> [f32; 4] {
        self.blocks += 1;
        self.sampler.get4(self.blocks)
    }

    /// From `hit` on patch `from`.
    fn walk(mut self, mut from: u32, mut hit: Hit) -> Walk {
        for _ in 0..LONGEST {
            let sampled = lit_straight(self.scene, &hit, self.numbers());
            let [u, v, ..] = self.numbers();
            let wi = direction(&hit, Vec2::new(u, v));
            let (shown, next) = self.follow(from, hit, wi);
            self.walk.visits.push(Visit {
                patch: from,
                direct: sampled + shown.straight,
                stray: shown.stray,
            });
            match next {
                Some(next) => (from, hit) = next,
                None => break,
            }
        }
        self.walk
    }

    /// Looks along `wi` from `hit` on patch `from`, by what mirrors and glass show: gives the emitters that are seen, and
    /// the first diffuse surface.
    fn follow(&mut self, from: u32, mut hit: Hit, mut wi: Vec3) -> (Shown, Option<(u32, Hit)>) {
        let (origin, density) = (hit, Density::PerSr(front(&hit).dot(wi) / PI));
        let (mut next, mut shown) = (None, Shown::default());
        let (mut throughput, mut bent) = (Rgb::WHITE, false);
        for _ in 0..PASSES {
            let met = self.scene.intersect(&hit.spawn(wi));
            let le = match &met {
                Some(met) => self.scene.le(met),
                None => self.scene.le_escaped(wi),
            };
            if !le.is_black() {
                let lit = throughput * le * PI;
                match (bent, &met) {
                    (true, _) => shown.stray += lit,
                    (false, Some(met)) => {
                        let rival = self.scene.pdf_light(&origin, met);
                        shown.straight += lit * density.mis_weight(rival);
                    }
                    (false, None) => {
                        let rival = self.scene.pdf_light_escaped(&origin, wi);
                        shown.straight += lit * density.mis_weight(rival);
                    }
                }
            }
            let Some(met) = met else {
                break;
            };
            hit = met;
            let [u, v, lobe, mixed] = self.numbers();
            let shading = self.scene.shade(&hit, mixed);
            let diffuse = shading.diffuse_share();
            let found = match diffuse.is_black() {
                true => None,
                false => self.mesh.locate(&hit),
            };
            if let Some(at) = found {
                self.walk.terms.push(Term {
                    from,
                    to: at.patch,
                    weight: (throughput * diffuse).to_array(),
                });
                next = next.or(Some((at.patch, hit)));
            }
            let Some(rest) = shading.without_diffuse() else {
                break;
            };
            let straight = matches!(rest.bsdf, Bsdf::Null(_));
            if self.gloss == Gloss::LeftOut && !straight {
                break;
            }
            let Some(sample) = rest.sample(lobe, Vec2::new(u, v), Mode::Radiance) else {
                break;
            };
            bent |= !straight;
            throughput *= sample.weight;
            wi = sample.wi;
        }
        if self.gloss != Gloss::All || !shown.stray.is_finite() {
            shown.stray = Rgb::BLACK;
        }
        (shown, next)
    }
}

/// Irradiance in W/m² by the emitters that an edge sees: straight, where these cannot be sampled as well, and by
/// mirrors, glass and gloss.
#[derive(Default)]
struct Shown {
    straight: Rgb,
    stray: Rgb,
}

/// One sample of the irradiance at `hit` straight from emitters, in W/m², where edges do not see them as well.
fn lit_straight(scene: &Scene, hit: &Hit, [u, v, pick, _]: [f32; 4]) -> Rgb {
    let Some(sample) = scene.sample_light(hit, pick, Vec2::new(u, v)) else {
        return Rgb::BLACK;
    };
    let (cos, weight) = (front(hit).dot(sample.wi), sample.weight());
    if cos <= 0.0 || weight.is_black() {
        return Rgb::BLACK;
    }
    let passes = scene.transmittance(&sample.shadow_ray(hit), PASSES);
    let lit = weight * (cos * passes * sample.density.mis_weight(cos / PI));
    if lit.is_finite() { lit } else { Rgb::BLACK }
}

/// A direction away from the front that `hit` is seen from, by its cosine.
pub fn direction(hit: &Hit, u: Vec2) -> Vec3 {
    Frame::from_normal(front(hit)).to_world(warp::cosine_hemisphere(u))
}

/// The normal on the side that `hit` is seen from.
fn front(hit: &Hit) -> Vec3 {
    match hit.ng.dot(hit.wo) < 0.0 {
        true => -hit.ng,
        false => hit.ng,
    }
}

//! Which nodes are linked.

use super::estimate::{Estimate, estimate};
use super::gather::Field;
use super::tree::{Kind, NONE, Tree, TreeLink};
use super::watch::Watch;
use crate::radiosity::lights::Others;
use crate::radiosity::{Rgb64, SolveSpec, Surfaces};
use crate::scene::Scene;
use rayon::prelude::*;

/// Edges of patches are not divided below this share of the size of the scene, unless a size is asked for.
const MIN_SIZE: f64 = 1.0 / 256.0;

/// Connections to lights that are no patches, per node.
const CONNECTIONS: u32 = 64;

/// Memory ends where a wish for accuracy does not: beyond so many links, no pair is divided any more.
const MOST_LINKS: usize = 20_000_000;

pub struct Refiner<'a> {
    scene: &'a Scene,
    others: Others<'a>,
    seed: u64,
    min_size: f64,
    /// Pairs of receiver and sender that no light goes between yet.
    dormant: Vec<(u32, u32)>,
    /// Links that there are, and pairs that may become some.
    links: usize,
}

/// Pairs that are judged between two looks whether to go on.
const CHUNK: usize = 1 << 12;

/// A receiver and a sender to be judged.
struct Pair {
    nodes: (u32, u32),
    known: Known,
}

/// Form factor of a pair and the share of rays that arrive, as far as the pair that it is a part of tells.
type Known = Option<[f32; 2]>;

/// What becomes of a pair.
enum Fate {
    /// Never any light.
    Dropped,
    /// No light yet.
    Dormant,
    Linked(TreeLink),
    /// To be replaced by pairs of the parts of one of them.
    Divided {
        sender: bool,
        known: Known,
    },
}

/// Edges of patches are not divided below this length, in scene units.
pub fn min_size(tree: &Tree, spec: &SolveSpec) -> f64 {
    let size = 2.0 * tree.nodes[0].radius;
    spec.min_size.unwrap_or(size * MIN_SIZE)
}

impl<'a> Refiner<'a> {
    /// Also finds the light that comes from lights that are no patches.
    pub fn new(
        scene: &'a Scene,
        surfaces: &'a Surfaces,
        spec: &SolveSpec,
        tree: &mut Tree,
    ) -> Refiner<'a> {
        let refiner = Refiner {
            scene,
            others: Others::new(scene, surfaces),
            seed: spec.seed,
            min_size: min_size(tree, spec),
            dormant: vec![(0, 0)],
            links: 0,
        };
        let surfaces =
            (0..tree.nodes.len() as u32).filter(|n| !tree.nodes[*n as usize].is_cluster());
        let surfaces: Vec<u32> = surfaces.collect();
        refiner.light(tree, &surfaces);
        refiner
    }

    /// Finds the irradiance of surfaces from lights that are no patches.
    fn light(&self, tree: &mut Tree, nodes: &[u32]) {
        if self.others.is_empty() {
            return;
        }
        let find = |&node: &u32| match tree.nodes[node as usize].kind {
            Kind::Surface { facet, piece } => {
                let number = u64::from(node);
                self.others
                    .irradiance(facet, &piece, CONNECTIONS, number, self.seed)
            }
            Kind::Cluster { .. } => Rgb64::ZERO,
        };
        let found: Vec<Rgb64> = nodes.par_iter().map(find).collect();
        for (node, found) in nodes.iter().zip(found) {
            tree.nodes[*node as usize].external = found;
        }
    }

    /// Divides surfaces over which the light of lights that are no patches differs too much.
    fn refine_external(
        &self,
        tree: &mut Tree,
        field: &mut Field,
        threshold: f64,
        watch: &mut Watch,
    ) {
        if self.others.is_empty() {
            return;
        }
        let mut nodes: Vec<u32> = tree.cells.clone();
        while !nodes.is_empty() {
            // Divided, then looked at: whether it was worth it shows in the quarters.
            let large = |&&node: &&u32| {
                let arriving = tree.nodes[node as usize].external.max_element();
                weight(tree, field, node) * arriving > threshold
            };
            let large: Vec<u32> = nodes.iter().filter(large).copied().collect();
            let mut next = Vec::new();
            for node in large {
                if watch.look(tree, field) {
                    return;
                }
                let known = !tree.children(node).is_empty();
                if !tree.divide(self.scene, node, self.min_size) {
                    continue;
                }
                field.grow(tree);
                let quarters: Vec<u32> = tree.children(node).collect();
                if !known {
                    self.light(tree, &quarters);
                }
                next.extend(quarters);
            }
            // Only where quarters differ by more than chance makes them.
            let differs = |&node: &u32| {
                let n = &tree.nodes[node as usize];
                let mean = tree.nodes[n.parent as usize].external;
                let difference = (n.external - mean).max_element().abs();
                let chance = 2.0 * mean.max_element() / f64::from(CONNECTIONS).sqrt();
                weight(tree, field, node) * difference > threshold && difference > chance
            };
            next.retain(differs);
            nodes = next;
        }
    }

    /// Links all pairs of nodes so that no link errs by more than `threshold` (see [`errors`]), judged by the light
    /// of `field`; what is darker than `black`, as a share of the mean, is no better than that. Where `watch` ends it,
    /// pairs are linked by what is known of the larger ones that they are parts of.
    pub fn refine(
        &mut self,
        tree: &mut Tree,
        field: &mut Field,
        threshold: f64,
        black: f64,
        watch: &mut Watch,
    ) {
        field.judge_by(tree, black);
        self.refine_external(tree, field, threshold, watch);
        let unknown = |nodes| Pair { nodes, known: None };
        let dormant = std::mem::take(&mut self.dormant);
        let mut pairs: Vec<Pair> = dormant.into_iter().map(unknown).collect();
        pairs.extend(self.reconsidered(tree, field, threshold));
        while !pairs.is_empty() {
            self.links = tree.links() + pairs.len();
            let judge = |pair: &Pair| self.judge(tree, field, pair.nodes, threshold);
            let mut fates: Vec<Fate> = Vec::with_capacity(pairs.len());
            for chunk in pairs.chunks(CHUNK) {
                fates.par_extend(chunk.par_iter().map(judge));
                if watch.look(tree, field) {
                    break;
                }
            }
            for pair in pairs.drain(fates.len()..) {
                self.settle(tree, pair.nodes, pair.known);
            }
            let mut next = Vec::new();
            for (Pair { nodes, .. }, fate) in pairs.into_iter().zip(fates) {
                match fate {
                    Fate::Dropped => {}
                    Fate::Dormant => self.dormant.push(nodes),
                    Fate::Linked(link) => tree.nodes[nodes.0 as usize].links.push(link),
                    Fate::Divided { known, .. } if watch.look(tree, field) => {
                        self.settle(tree, nodes, known);
                    }
                    Fate::Divided { sender, known } => {
                        self.divide(tree, field, (nodes, known), sender, &mut next);
                    }
                }
            }
            pairs = next;
        }
    }

    /// Links a pair that is not looked at any more; a pair of which nothing is known has to wait.
    fn settle(&mut self, tree: &mut Tree, (r, s): (u32, u32), known: Known) {
        match known {
            Some([form_factor, visible]) => tree.nodes[r as usize].links.push(TreeLink {
                sender: s,
                form_factor,
                spread: form_factor,
                visible,
            }),
            None => self.dormant.push((r, s)),
        }
    }

    /// Takes out the links that are not good enough any more, as pairs to be divided.
    fn reconsidered(&mut self, tree: &mut Tree, field: &Field, threshold: f64) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for r in 0..tree.nodes.len() as u32 {
            let mut links = std::mem::take(&mut tree.nodes[r as usize].links);
            links.retain(|link| {
                let found = Estimate {
                    form_factor: f64::from(link.form_factor),
                    spread: f64::from(link.spread),
                    visible: f64::from(link.visible),
                };
                let found = errors(tree, field, r, link.sender, &found);
                let good = self
                    .to_divide(tree, (r, link.sender), found, threshold)
                    .is_none();
                if !good {
                    pairs.push(Pair {
                        nodes: (r, link.sender),
                        known: Some([link.form_factor, link.visible]),
                    });
                }
                good
            });
            tree.nodes[r as usize].links = links;
        }
        pairs
    }

    fn judge(&self, tree: &Tree, field: &Field, (r, s): (u32, u32), threshold: f64) -> Fate {
        let sent = field.radiosity[s as usize].max_element();
        let receiver = &tree.nodes[r as usize];
        if r == s && !receiver.is_cluster() {
            return Fate::Dropped;
        }
        if sent <= 0.0 {
            return Fate::Dormant;
        }
        // No form factor is larger than 1.
        let most = weight(tree, field, r) * sent;
        if r == s && most > threshold {
            return Fate::Divided {
                sender: false,
                known: None,
            };
        }
        let fine = most > threshold;
        let Some(found) = estimate(self.scene, tree, &field.radiosity, (r, s), fine) else {
            return Fate::Dropped;
        };
        let errors = errors(tree, field, r, s, &found);
        if let Some(sender) = self.to_divide(tree, (r, s), errors, threshold) {
            return Fate::Divided {
                sender,
                known: Some([found.form_factor as f32, found.visible as f32]),
            };
        }
        Fate::Linked(TreeLink {
            sender: s,
            form_factor: found.form_factor as f32,
            spread: found.spread as f32,
            visible: found.visible as f32,
        })
    }

    /// Whether the sender is to be divided rather than the receiver.
    fn by_sender(&self, tree: &Tree, r: u32, s: u32, varied: bool) -> bool {
        let (receiver, sender) = (&tree.nodes[r as usize], &tree.nodes[s as usize]);
        match (receiver.is_cluster(), sender.is_cluster()) {
            (false, false) => varied,
            _ if sender.radius != receiver.radius => sender.radius > receiver.radius,
            (_, sender_is_cluster) => sender_is_cluster,
        }
    }

    /// Whether a pair errs by more than `threshold`, by its [`errors`], and can be divided: then, whether by its sender.
    fn to_divide(
        &self,
        tree: &Tree,
        (r, s): (u32, u32),
        [spread, varied]: [f64; 2],
        threshold: f64,
    ) -> Option<bool> {
        if spread + varied <= threshold || (self.links > MOST_LINKS && r != s) {
            return None;
        }
        let by_sender = self.by_sender(tree, r, s, spread < varied);
        let (wanted, other) = if by_sender { (s, r) } else { (r, s) };
        if self.can_be_divided(tree, wanted) {
            return Some(by_sender);
        }
        // The other end helps where it is a cluster, or errs by itself.
        let helps = tree.nodes[other as usize].is_cluster()
            || (spread.min(varied) > threshold && self.can_be_divided(tree, other));
        helps.then_some(!by_sender)
    }

    fn can_be_divided(&self, tree: &Tree, node: u32) -> bool {
        let n = &tree.nodes[node as usize];
        match n.kind {
            Kind::Cluster { .. } => true,
            Kind::Surface { .. } if n.quarters != NONE => true,
            Kind::Surface { piece, .. } => {
                piece.longest_edge() >= 2.0 * self.min_size && tree.patches + 3 <= tree.max_patches
            }
        }
    }

    /// Replaces a pair by pairs of the parts of one of its nodes.
    fn divide(
        &mut self,
        tree: &mut Tree,
        field: &mut Field,
        ((r, s), known): ((u32, u32), Known),
        sender: bool,
        next: &mut Vec<Pair>,
    ) {
        if r == s {
            for a in tree.children(r) {
                let pair = |b| Pair {
                    nodes: (a, b),
                    known: None,
                };
                next.extend(tree.children(r).map(pair));
            }
            return;
        }
        let node = if sender { s } else { r };
        if !tree.divide(self.scene, node, self.min_size) {
            // Patches ran out while the pairs were looked at.
            if let Some(found) = estimate(self.scene, tree, &field.radiosity, (r, s), true) {
                tree.nodes[r as usize].links.push(TreeLink {
                    sender: s,
                    form_factor: found.form_factor as f32,
                    spread: found.spread as f32,
                    visible: found.visible as f32,
                });
            }
            return;
        }
        if tree.nodes.len() > field.radiosity.len() {
            field.grow(tree);
            let quarters: Vec<u32> = tree.children(node).collect();
            self.light(tree, &quarters);
        }
        for child in tree.children(node) {
            let share = tree.nodes[child as usize].area / tree.nodes[node as usize].area;
            next.push(match sender {
                true => Pair {
                    nodes: (r, child),
                    // What a part of a sender gives is its part of the form factor.
                    known: known.map(|[f, visible]| [f * share as f32, visible]),
                },
                false => Pair {
                    nodes: (child, s),
                    known,
                },
            });
        }
    }
}

/// What an error of the irradiance of node `r` in W/m² counts: its share of what arrives there usually, times the
/// node's share of all area, times its reflectance in proportion to the scene's. So dark corners are as good as
/// bright ones, and large surfaces better than small ones.
fn weight(tree: &Tree, field: &Field, r: u32) -> f64 {
    let (receiver, root) = (&tree.nodes[r as usize], &tree.nodes[0]);
    let reflectance = receiver.albedo.max_element() / root.albedo.max_element();
    let weight = receiver.area / root.area * reflectance / field.usual[r as usize];
    if weight.is_finite() { weight } else { 0.0 }
}

/// Errors of the light that a link brings, as shares (see [`weight`]): by the spread over the receiver, and by the
/// differences of radiosity over the sender.
fn errors(tree: &Tree, field: &Field, r: u32, s: u32, found: &Estimate) -> [f64; 2] {
    let weight = weight(tree, field, r);
    let sent = field.radiosity[s as usize].max_element();
    let quarters = match tree.nodes[s as usize].kind {
        Kind::Surface { .. } => tree.children(s),
        Kind::Cluster { .. } => 0..0,
    };
    let (mut least, mut most) = (Rgb64::INFINITY, Rgb64::NEG_INFINITY);
    for quarter in quarters {
        let b = field.radiosity[quarter as usize];
        (least, most) = (least.min(b), most.max(b));
    }
    let varied = (most - least).max_element().max(0.0);
    [
        weight * found.spread * sent,
        0.5 * weight * found.form_factor * varied,
    ]
}

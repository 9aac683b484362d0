//! How much light a link carries: form factor, visibility, and how both differ over the receiver.

use super::tree::{Kind, NONE, Tree, TreeNode};
use crate::geom::{Endpoint, Hit};
use crate::math::{DVec2, DVec3};
use crate::radiosity::mesh::on_facet;
use crate::radiosity::polygon::point_to_polygon;
use crate::radiosity::{Outline, Piece, Rgb64};
use crate::sampler::mix;
use crate::scene::Scene;
use std::f64::consts::PI;

/// What is known of a pair of nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean over the receiver, visibility included.
    pub form_factor: f64,
    /// How far it differs over the receiver.
    pub spread: f64,
    /// Share of rays that arrive.
    pub visible: f64,
}

/// Pairs of points of clusters that a ray is traced between.
const CLUSTER_RAYS: usize = 12;
/// Pairs that are tried to find so many that face each other.
const CLUSTER_TRIES: usize = 64;
/// What is not known of the light of a cluster by its low frequencies alone, as a share.
const SMOOTHED: f64 = 0.1;

/// Whether no point of `a` can see one of `b` from its front.
fn behind(a: &TreeNode, b: &TreeNode) -> bool {
    let (Kind::Surface { piece, .. }, Kind::Surface { piece: other, .. }) = (a.kind, b.kind) else {
        return false;
    };
    // As flat as coordinates in f32 can say.
    let slack = 1e-6 * (a.radius + b.radius);
    let is_behind = |of: &TreeNode, piece: &Piece, other: &Piece| {
        other
            .corners()
            .all(|c| (c - piece.o).dot(of.normal) <= slack)
    };
    is_behind(a, &piece, &other) || is_behind(b, &other, &piece)
}

/// The pair of receiver `r` and sender `s`; `None` where neither can see the other. Nodes have `radiosity`. `fine` takes more rays.
pub fn estimate(
    scene: &Scene,
    tree: &Tree,
    radiosity: &[Rgb64],
    (r, s): (u32, u32),
    fine: bool,
) -> Option<Estimate> {
    let (receiver, sender) = (&tree.nodes[r as usize], &tree.nodes[s as usize]);
    match (receiver.kind, sender.kind) {
        (
            Kind::Surface {
                facet: rf,
                piece: rp,
            },
            Kind::Surface {
                facet: sf,
                piece: sp,
            },
        ) => {
            if behind(receiver, sender) {
                return None;
            }
            let look = |facet, piece: Piece| {
                move |st: DVec2| on_facet(scene, &tree.surfaces, facet, &piece, st)
            };
            let numbers = Numbers::new(r, s);
            let found = between_surfaces(
                scene,
                (receiver, &rp, &look(rf, rp)),
                (&sp, &look(sf, sp)),
                numbers,
                if fine { 4 } else { 1 },
            );
            if sender.area >= receiver.area {
                return Some(found);
            }
            // Four points of a wide receiver do not meet a small sender. All of the sender's points know much of the
            // receiver, by A_r F_rs = A_s F_sr; where both disagree, light differs over the receiver.
            let free = returned((sender, &sp), (receiver, &rp)) * sender.area / receiver.area;
            let form_factor = found.visible * free;
            Some(Estimate {
                spread: found.spread.max((form_factor - found.form_factor).abs()),
                form_factor,
                ..found
            })
        }
        _ => between_clusters(scene, tree, radiosity, (r, s)),
    }
}

/// Unoccluded form factor from the sender to the receiver: the mean over the middles of the sender's quarters.
fn returned((sender, sp): (&TreeNode, &Piece), (receiver, rp): (&TreeNode, &Piece)) -> f64 {
    let at = |quarter| {
        let p = sp.child(quarter).center();
        // What lies behind the receiver is not seen by it.
        match (p - rp.o).dot(receiver.normal) > 0.0 {
            true => point_to_polygon(p, sender.normal, rp.corners()),
            false => 0.0,
        }
    };
    0.25 * (0..4).map(at).sum::<f64>()
}

/// Unoccluded form factors at the middles of the receiver's quarters, and rays to the sender from each.
fn between_surfaces(
    scene: &Scene,
    (receiver, rp, at_receiver): (&TreeNode, &Piece, &dyn Fn(DVec2) -> Hit),
    (sp, at_sender): (&Piece, &dyn Fn(DVec2) -> Hit),
    mut numbers: Numbers,
    rays: usize,
) -> Estimate {
    let free = |p: DVec3| point_to_polygon(p, receiver.normal, sp.corners());
    let mut factors = [0.0; 4];
    for (quarter, f) in factors.iter_mut().enumerate() {
        *f = free(rp.child(quarter).center());
    }
    if factors == [0.0; 4] {
        // The sender is seen from an edge at most.
        let corners = rp.corners().map(|c| c.lerp(receiver.center, 0.05));
        let most = corners.map(free).fold(0.0, f64::max);
        return Estimate {
            form_factor: 0.0,
            spread: most,
            visible: 1.0,
        };
    }
    let ends: [Hit; 4] =
        std::array::from_fn(|i| at_sender(in_quarter(sp.outline, i, &mut numbers)));
    let (mut arrived, mut sent) = (0.0, 0.0);
    let mut seen = [None; 4];
    for (i, seen) in seen.iter_mut().enumerate() {
        let hit = at_receiver(in_quarter(rp.outline, i, &mut numbers));
        *seen = visibility(scene, &hit, &ends, i, rays);
    }
    // Where no pair of points faces each other, as elsewhere.
    let known = seen.iter().flatten().count().max(1) as f64;
    let elsewhere = match seen.iter().all(Option::is_none) {
        true => 1.0,
        false => seen.iter().flatten().sum::<f64>() / known,
    };
    for (f, seen) in factors.iter_mut().zip(seen) {
        sent += *f;
        *f *= seen.unwrap_or(elsewhere);
        arrived += *f;
    }
    let least = factors.iter().copied().fold(f64::INFINITY, f64::min);
    let most = factors.iter().copied().fold(0.0, f64::max);
    // That no ray arrived does not say that none would: one of so many and two more (the rule of succession).
    let unseen = match arrived > 0.0 {
        true => 0.0,
        false => 0.25 * sent / (4.0 * rays as f64 + 2.0),
    };
    Estimate {
        form_factor: 0.25 * factors.iter().sum::<f64>(),
        spread: (most - least).max(unseen),
        visible: arrived / sent,
    }
}

/// Share of the light of `ends` that arrives at `hit`, by `rays` of them, from number `first` on; `None` where they
/// do not face each other.
fn visibility(scene: &Scene, hit: &Hit, ends: &[Hit; 4], first: usize, rays: usize) -> Option<f64> {
    let (mut arrived, mut sent, mut traced) = (0.0, 0.0, 0);
    for j in 0..4 {
        let end = &ends[(first + j) % 4];
        let d = (end.p - hit.p).as_dvec3();
        let d2 = d.length_squared();
        // The piece shows its front to where the hits look.
        let facing = |n: &Hit, d: DVec3| d.dot(n.ng.as_dvec3()) * n.ng.dot(n.wo).signum() as f64;
        let (ca, cb) = (facing(hit, d), facing(end, -d));
        if !(ca > 0.0 && cb > 0.0 && d2 > 0.0) {
            continue;
        }
        let weight = (ca / d2) * (cb / d2);
        sent += weight;
        arrived += weight * passed(scene, hit, &Endpoint::from(end));
        traced += 1;
        if traced == rays {
            break;
        }
    }
    (sent > 0.0).then(|| arrived / sent)
}

/// Share of light that arrives.
fn passed(scene: &Scene, from: &Hit, to: &Endpoint) -> f64 {
    let ray = from.spawn_to(to);
    match ray.t_max > 0.0 {
        true => f64::from(scene.transmittance(&ray, PASSES)),
        false => 0.0,
    }
}

/// Surfaces that a ray may pass through.
const PASSES: u32 = 8;

/// What random pairs of points of clusters found.
#[derive(Default)]
struct Met {
    tries: usize,
    /// Pairs that face each other.
    facing: usize,
    /// Their form factors, summed, and of those the share that arrives; the largest.
    free: f64,
    arrived: f64,
    most: f64,
}

/// Random pairs of points, those that face each other with a ray between. Points of the receiver are uniform over its
/// area, those of the sender over what `weigh` gives.
fn meet(
    scene: &Scene,
    tree: &Tree,
    (r, s): (u32, u32),
    numbers: &mut Numbers,
    weigh: impl Fn(usize) -> f64,
) -> Met {
    let mut met = Met::default();
    while met.tries < CLUSTER_TRIES && met.facing < CLUSTER_RAYS {
        met.tries += 1;
        let a = tree.point(r, numbers, |n| tree.nodes[n].area);
        let b = tree.point(s, numbers, &weigh);
        let kernel = kernel(&a, &b, tree.nodes[s as usize].area);
        if kernel <= 0.0 {
            continue;
        }
        met.facing += 1;
        met.free += kernel;
        met.most = met.most.max(kernel);
        let hit = |at: &Point| on_facet(scene, &tree.surfaces, at.facet, &at.piece, at.st);
        met.arrived += kernel * passed(scene, &hit(&a), &Endpoint::from(&hit(&b)));
    }
    met
}

/// By random pairs of points.
fn between_clusters(
    scene: &Scene,
    tree: &Tree,
    radiosity: &[Rgb64],
    (r, s): (u32, u32),
) -> Option<Estimate> {
    let (receiver, sender) = (&tree.nodes[r as usize], &tree.nodes[s as usize]);
    let mut numbers = Numbers::new(r, s);
    let area = |n: usize| tree.nodes[n].area;
    let mut met = meet(scene, tree, (r, s), &mut numbers, area);
    if met.facing == 0 {
        // A lamp among much else that faces another way, or away, is met where light is looked for.
        let power = |n: usize| area(n) * radiosity[n].element_sum().max(0.0);
        met = meet(scene, tree, (r, s), &mut numbers, power);
    }
    if met.facing == 0 {
        // What so many pairs did not find is little.
        return None;
    }
    let Met {
        tries,
        facing,
        free,
        arrived,
        most,
    } = met;
    let visible: f64 = arrived / free;
    let distance = receiver.center.distance(sender.center);
    let apart = distance - receiver.radius - sender.radius;
    let (form_factor, mean) = (arrived / tries as f64, free / facing as f64);
    // Light of a cluster is evaluated for each surface by its direction and distance: what errs is the size of
    // both, and that visibility is one number.
    let spread = match apart > 0.0 {
        true => {
            let size = (receiver.radius + sender.radius) / distance;
            mean * (2.0 * visible.min(1.0 - visible) + visible * (size.min(1.0) + SMOOTHED))
        }
        false => most.max(visible),
    };
    let unseen = match arrived > 0.0 {
        true => 0.0,
        false => mean / (facing as f64 + 2.0),
    };
    let spread = spread.max(unseen);
    Some(Estimate {
        form_factor: form_factor.min(1.0).min(sender.area / receiver.area),
        spread: spread.min(1.0),
        visible,
    })
}

/// A point of a surface below some node.
pub struct Point {
    facet: u32,
    piece: Piece,
    st: DVec2,
    p: DVec3,
    n: DVec3,
}

/// Form factor of a sender of `area` like at `b` for a receiver at `a`.
fn kernel(a: &Point, b: &Point, area: f64) -> f64 {
    let d = b.p - a.p;
    let d2 = d.length_squared();
    let (ca, cb) = (d.dot(a.n), -d.dot(b.n));
    if !(ca > 0.0 && cb > 0.0 && d2 > 0.0) {
        return 0.0;
    }
    // Each cosine is d · n over the distance.
    (area * (ca / d2) * (cb / d2) / PI).min(1.0)
}

impl Tree {
    /// A point below `node`; surfaces are chosen by what `weigh` gives for them and for the clusters around them.
    fn point(&self, mut node: u32, numbers: &mut Numbers, weigh: impl Fn(usize) -> f64) -> Point {
        loop {
            let n = &self.nodes[node as usize];
            match n.kind {
                Kind::Surface { facet, piece } => {
                    let st = piece.outline.sample(numbers.two());
                    return Point {
                        facet,
                        piece,
                        st,
                        p: piece.at(st),
                        n: n.normal,
                    };
                }
                Kind::Cluster { .. } => {
                    let of = |child: u32| weigh(child as usize);
                    let all: f64 = self.children(node).map(of).sum();
                    let mut left = numbers.one() * all;
                    let mut chosen = NONE;
                    for child in self.children(node) {
                        // Where all weigh nothing, any will do.
                        if chosen == NONE || of(child) > 0.0 {
                            chosen = child;
                            left -= of(child);
                        }
                        if left < 0.0 {
                            break;
                        }
                    }
                    node = chosen;
                }
            }
        }
    }
}

/// A random place in quarter `i` of a piece.
fn in_quarter(outline: Outline, i: usize, numbers: &mut Numbers) -> DVec2 {
    let unit = Piece {
        o: DVec3::ZERO,
        e1: DVec3::X,
        e2: DVec3::Y,
        outline,
    };
    let p = unit.child(i).at(outline.sample(numbers.two()));
    outline.clamp(DVec2::new(p.x, p.y))
}

/// Random numbers of a pair of nodes: the same whenever they are asked for.
struct Numbers(u64);

impl Numbers {
    fn new(r: u32, s: u32) -> Numbers {
        Numbers(mix((u64::from(r) << 32) | u64::from(s)))
    }

    fn one(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        (mix(self.0) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    fn two(&mut self) -> DVec2 {
        DVec2::new(self.one(), self.one())
    }
}

//! Where diffuse light comes from: a distribution over the patches that light each patch.
//!
//! The links of a patch and of its ancestors partition all senders of its light. With probability proportional to
//! the irradiance that it brings, a link is chosen; below its sender a patch, by its power; on that a point, uniform
//! over its area. What emitters send is left out, since they are sampled by themselves, so nothing is aimed at their
//! surfaces.
//!
//! The technique is "a point of patch q, seen from p": a direction counts only if what a ray meets first lies on the
//! very patch that was aimed at. A direction that meets q then has one density, whoever found it. Patches are flat,
//! while what they stand for may be curved: a direction that meets the surface of q, but passes beside its flat
//! piece, is never aimed at, and has density 0.

use super::{Piece, Rgb64, Solution};
use crate::geom::Hit;
use crate::math::{DVec2, DVec3, Vec3};
use crate::scene::Scene;
use rayon::prelude::*;
use std::f64::consts::PI;
use std::sync::Arc;

/// The distribution, made of a hierarchical solution.
#[derive(Debug)]
pub struct Guide {
    solution: Arc<Solution>,
    nodes: Vec<Node>,
    senders: Vec<Sender>,
    /// Power in W, as luminance and without emitters, of all patches before each; one more than there are patches.
    power: Vec<f64>,
    /// By patch: share of the directions that are best found here (see [`Guide::share`]).
    shares: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// The nearest ancestor with senders; `u32::MAX` if there is none.
    above: u32,
    /// Into `Guide::senders`.
    first: u32,
    end: u32,
    /// Irradiance in W/m² that comes by links of this node, and of all above with it.
    own: f64,
    total: f64,
}

/// A link that brings light.
#[derive(Clone, Copy, Debug)]
struct Sender {
    /// Its patches.
    first: u32,
    end: u32,
    /// Irradiance in W/m² by the links before it of the same node.
    before: f64,
    /// By this link per power of the sender, in 1/m².
    per_power: f64,
}

/// A patch that light comes to.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    node: u32,
    patch: u32,
}

impl Receiver {
    /// Number of the patch.
    #[inline]
    pub fn patch(self) -> u32 {
        self.patch
    }
}

/// A point that was aimed at.
#[derive(Clone, Copy, Debug)]
pub struct Aim {
    /// What a ray has to meet first for the sample to count.
    pub patch: u32,
    /// Unit direction.
    pub wi: Vec3,
}

const NONE: u32 = u32::MAX;

impl Guide {
    /// What the links of `solution` know of the light in `scene`; `None` if it has no links.
    pub fn new(scene: &Scene, solution: Arc<Solution>) -> Option<Guide> {
        let hierarchy = solution.hierarchy.as_ref()?;
        let patches = &solution.mesh.patches;
        let facets = solution.mesh.surfaces.facets();
        let (mut power, mut area) = (vec![0.0], vec![0.0]);
        let (mut power_so_far, mut area_so_far) = (0.0, 0.0);
        for (patch, &b) in patches.iter().zip(&solution.radiosity) {
            if !scene.is_emitter(facets[patch.facet as usize].shape) {
                power_so_far += positive(luminance(b - patch.emission) * patch.area);
            }
            area_so_far += patch.area;
            power.push(power_so_far);
            area.push(area_so_far);
        }
        let below = |sums: &[f64], first: u32, end: u32| sums[end as usize] - sums[first as usize];
        let mut senders = Vec::with_capacity(hierarchy.links.len());
        let mut nodes: Vec<Node> = Vec::with_capacity(hierarchy.nodes.len());
        for node in &hierarchy.nodes {
            let first = senders.len() as u32;
            let mut own = 0.0;
            for link in &hierarchy.links[node.links.start as usize..node.links.end as usize] {
                let from = &hierarchy.nodes[link.sender as usize].patches;
                let per_power = f64::from(link.form_factor) / below(&area, from.start, from.end);
                let brought = positive(per_power * below(&power, from.start, from.end));
                if brought > 0.0 {
                    senders.push(Sender {
                        first: from.start,
                        end: from.end,
                        before: own,
                        per_power,
                    });
                    own += brought;
                }
            }
            // Parents have smaller numbers.
            let parent = nodes.get(node.parent as usize).copied();
            nodes.push(Node {
                above: match parent {
                    Some(parent) if parent.own > 0.0 => node.parent,
                    Some(parent) => parent.above,
                    None => NONE,
                },
                first,
                end: senders.len() as u32,
                own,
                total: own + parent.map_or(0.0, |p| p.total),
            });
        }
        let mut guide = Guide {
            nodes,
            senders,
            power,
            shares: Vec::new(),
            solution,
        };
        guide.shares = guide.find_shares(&area);
        Some(guide)
    }

    /// The patch at `hit` on the side of `hit.wo`, if links bring light to it.
    #[inline]
    pub fn receiver(&self, hit: &Hit) -> Option<Receiver> {
        let patch = self.patch(hit)?;
        let node = *self.solution.hierarchy.as_ref()?.leaf.get(patch as usize)?;
        let total = self.nodes[node as usize].total;
        (total > 0.0).then_some(Receiver { node, patch })
    }

    /// The patch at `hit` on the side of `hit.wo`.
    #[inline]
    pub fn patch(&self, hit: &Hit) -> Option<u32> {
        Some(self.solution.mesh.locate(hit)?.patch)
    }

    /// Share of the directions, in [0, 1), that are best found here, if the others follow the cosine: 0 where light
    /// comes evenly from everywhere.
    #[inline]
    pub fn share(&self, receiver: Receiver) -> f32 {
        self.shares[receiver.patch as usize]
    }

    /// Irradiance of a patch in W/m², as luminance.
    #[inline]
    pub fn irradiance(&self, patch: u32) -> f32 {
        luminance(self.solution.irradiance[patch as usize]) as f32
    }

    /// Radiance in W/(m² sr), as luminance, of a patch without what it emits.
    #[inline]
    pub fn radiance(&self, patch: u32) -> f32 {
        let emitted = self.solution.mesh.patches[patch as usize].emission;
        (luminance(self.solution.radiosity[patch as usize] - emitted) / PI) as f32
    }

    /// A direction from `p` towards a point that sends light to `receiver`; `choice` in [0,1) chooses the patch, `u`
    /// in [0,1)² the point. `None` where the patch that was chosen turns its back.
    #[inline]
    pub fn sample(&self, receiver: Receiver, p: Vec3, choice: f64, u: DVec2) -> Option<Aim> {
        let patch = self.choose(receiver, choice)?;
        let piece = &self.solution.mesh.patches[patch as usize].piece;
        let d = piece.sample(u) - p.as_dvec3();
        (d.dot(piece.cross()) < 0.0).then(|| Aim {
            patch,
            wi: d.normalize_or_zero().as_vec3(),
        })
    }

    /// Density per steradian with which [`Guide::sample`] aims along `wi` at `patch`.
    #[inline]
    pub fn pdf(&self, receiver: Receiver, p: Vec3, wi: Vec3, patch: u32) -> f32 {
        let per_power = self.per_power(receiver, patch);
        if per_power == 0.0 {
            return 0.0;
        }
        let total = self.nodes[receiver.node as usize].total;
        let power = self.power[patch as usize + 1] - self.power[patch as usize];
        let q = &self.solution.mesh.patches[patch as usize];
        let pdf_a = per_power * (power / (total * q.area));
        bounded(pdf_a * sr_per_area(&q.piece, p.as_dvec3(), wi.as_dvec3()))
    }

    /// Irradiance that the link by which `patch` sends to `receiver` brings per power of its sender, in 1/m²; 0
    /// without such a link.
    #[inline]
    fn per_power(&self, receiver: Receiver, patch: u32) -> f64 {
        let mut number = receiver.node;
        while let Some(node) = self.nodes.get(number as usize) {
            let senders = &self.senders[node.first as usize..node.end as usize];
            // Senders of a node do not overlap.
            let behind = senders.partition_point(|s| s.first <= patch);
            if let Some(sender) = behind.checked_sub(1).map(|i| &senders[i])
                && patch < sender.end
            {
                return sender.per_power;
            }
            number = node.above;
        }
        0.0
    }

    /// The patch that `choice` in [0,1) falls on.
    #[inline]
    fn choose(&self, receiver: Receiver, choice: f64) -> Option<u32> {
        let mut node = self.nodes.get(receiver.node as usize)?;
        let mut left = choice * node.total;
        while left >= node.own {
            match self.nodes.get(node.above as usize) {
                Some(above) => {
                    left -= node.own;
                    node = above;
                }
                // By rounding.
                None => break,
            }
        }
        let senders = &self.senders[node.first as usize..node.end as usize];
        let behind = senders.partition_point(|s| s.before <= left);
        let sender = senders.get(behind.checked_sub(1)?)?;
        let (first, end) = (sender.first as usize, sender.end as usize);
        let power = self.power[first] + (left - sender.before) / sender.per_power;
        // The last patch that has any power, if rounding went beyond.
        let power = power.min(self.power[end].next_down());
        let before = self.power[first..=end].partition_point(|sum| *sum <= power);
        Some((first + before.saturating_sub(1)).min(end - 1) as u32)
    }
}

/// Steradians at `p`, per area of `piece`, in direction `wi`, are one over this: squared distance over cosine. 0 where
/// the line along `wi` does not pass through the piece from its front.
#[inline]
fn sr_per_area(piece: &Piece, p: DVec3, wi: DVec3) -> f64 {
    let n = piece.normal();
    let cos = -wi.dot(n);
    if cos.is_nan() || cos <= 0.0 {
        return 0.0;
    }
    let distance = (p - piece.o).dot(n) / cos;
    match distance > 0.0 && piece.outline.contains(piece.locate(p + wi * distance)) {
        true => distance * distance / cos,
        false => 0.0,
    }
}

/// In the range of f32, and 0 for what is not a number.
fn bounded(pdf: f64) -> f32 {
    match pdf > 0.0 {
        true => pdf.min(f64::from(f32::MAX)) as f32,
        false => 0.0,
    }
}

fn positive(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x } else { 0.0 }
}

fn luminance(c: Rgb64) -> f64 {
    c.dot(Rgb64::new(0.212_671, 0.715_160, 0.072_169))
}

/// Light of one receiver by its radiosity: form factor and irradiance, in steps of factors of 2 from the brightest
/// sender down.
#[derive(Clone, Copy, Default)]
struct Brightness([[f64; 2]; 16]);

/// Share of the directions found by links that meet what they aim at, and bring what they promise.
const FOUND: f64 = 0.6;
/// A share of directions that lowers the variance by less than this is not worth its costs.
const WORTH: f64 = 0.1;
/// No larger share is taken: light that radiosity knows nothing of comes by the others.
const MOST: u32 = 8;

impl Guide {
    /// By patch: the share of directions by links for which the variance is least. With share a, directions to a
    /// sender of radiosity b have the density a b/E + 1 - a, relative to the cosine's, where E is all irradiance: so
    /// the second moment is Σ F b² / (a b/E + 1 - a).
    fn find_shares(&self, area: &[f64]) -> Vec<f32> {
        let brightest = self.senders.iter().map(|s| self.radiosity(s, area));
        let brightest = brightest.fold(0.0, f64::max);
        let hierarchy = self.solution.hierarchy.as_ref();
        let leaves = hierarchy.map_or(&[][..], |h| &h.leaf);
        let find = |&leaf: &u32| {
            let mut light = Brightness::default();
            let mut number = leaf;
            while let Some(node) = self.nodes.get(number as usize) {
                for sender in &self.senders[node.first as usize..node.end as usize] {
                    let b = self.radiosity(sender, area);
                    let step = -(b / brightest).log2();
                    let size = f64::from(sender.end - sender.first);
                    debug_assert!(size > 0.0);
                    let f = sender.per_power
                        * (area[sender.end as usize] - area[sender.first as usize]);
                    let [form_factor, irradiance] = &mut light.0[(step as usize).min(15)];
                    *form_factor += f;
                    *irradiance += f * b;
                }
                number = node.above;
            }
            light.best_share()
        };
        leaves.par_iter().map(find).collect()
    }

    /// Mean radiosity of a sender in W/m².
    fn radiosity(&self, sender: &Sender, area: &[f64]) -> f64 {
        let (first, end) = (sender.first as usize, sender.end as usize);
        (self.power[end] - self.power[first]) / (area[end] - area[first])
    }
}

impl Brightness {
    fn best_share(&self) -> f32 {
        let all: f64 = self.0.iter().map(|[_, e]| e).sum();
        let moment = |share: f64| -> f64 {
            let part = |&[f, e]: &[f64; 2]| match f > 0.0 {
                true => (e / f) * e / (share * FOUND * (e / f) / all + 1.0 - share),
                false => 0.0,
            };
            self.0.iter().map(part).sum()
        };
        let none = moment(0.0);
        let shares = (1..=MOST).map(|i| f64::from(i) * 0.1);
        let best = shares.min_by(|a, b| moment(*a).total_cmp(&moment(*b)));
        match best {
            Some(share) if moment(share) < (1.0 - WORTH) * none => share as f32,
            _ => 0.0,
        }
    }
}

//! What the links of a patch sum to.
//!
//! Each link errs by itself, so the form factors of a patch do not sum to what they should: the share of directions
//! in which there are patches. Where they sum to more than 1, light would be made of nothing, and they are scaled
//! down. In a closed scene they are scaled both ways, to 1 less the share of light that meets other things than
//! patches.

use super::bodies::Parts;
use super::gather::Field;
use super::tree::{Gain, Kind, NONE, Tree, TreeNode};
use super::walks::direction;
use crate::math::{DVec2, Vec2};
use crate::radiosity::Rgb64;
use crate::radiosity::mesh::on_facet;
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use rayon::prelude::*;

/// Rays that tell whether a scene is closed.
const RAYS: u64 = 1 << 13;
/// A scene whose light meets more of other things than patches is not thought of as closed.
const ELSEWHERE: f64 = 0.2;
/// What may get out of a closed scene where patches reach through its walls.
const LEAK: f64 = 2e-3;
/// A patch with less in its links lies mostly within other bodies: it gets what it gets.
const BURIED: f64 = 0.7;
/// Reflectance from which on a patch absorbs nothing: f32 and averages of textures know it no better.
const ALL: f64 = 1.0 - 1e-6;

/// What scaling had to do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Balanced {
    pub closed: bool,
    /// Mean of |1 - scale| by area.
    pub mean: f64,
}

/// Sets the gain of all patches that are in no body, and of the bodies, by the sums of their links.
pub fn balance(tree: &mut Tree, parts: &Parts, closed: Option<f64>) -> Balanced {
    let mut field = Field::uniform(tree);
    let mut sums: Vec<(u32, Rgb64)> = field.gather(tree, parts).concat();
    for (number, body) in parts.bodies.iter().enumerate() {
        sums.push((body.node, field.linked_to_body(tree, body, number)));
    }
    let (mut off, mut area) = (0.0, 0.0);
    for (node, sum) in sums {
        let (node, sum) = (&mut tree.nodes[node as usize], sum.max_element());
        let scale = match closed {
            Some(wanted) if sum > BURIED * wanted => wanted / sum,
            _ => 1.0f64.min(1.0 / sum),
        };
        node.gain = Gain {
            scale: Rgb64::splat(scale),
            ..Gain::NONE
        };
        off += (1.0 - scale).abs() * node.area;
        area += node.area;
    }
    Balanced {
        closed: closed.is_some(),
        mean: if area > 0.0 { off / area } else { 0.0 },
    }
}

/// If (nearly) no light of `field` gets out of the scene: the share of it that meets patches.
pub fn closed(scene: &Scene, tree: &Tree, field: &Field, seed: u64) -> Option<f64> {
    let mut sums = Vec::with_capacity(tree.nodes.len());
    let mut sum = 0.0;
    for (node, radiosity) in tree.nodes.iter().zip(&field.radiosity) {
        if is_patch(node) {
            sum += (radiosity.element_sum() * node.area).max(0.0);
        }
        sums.push(sum);
    }
    if !(sum.is_finite() && sum > 0.0) {
        return None;
    }
    let look = |i: u64| {
        let sampler = Sampler::new(SamplerKind::Sobol, seed, u64::MAX, i, 1);
        let ([x, y, u, v], [pick, ..]) = (sampler.get4(0), sampler.get4(1));
        let at = f64::from(pick) * sum;
        let patch = sums.partition_point(|s| *s <= at).min(sums.len() - 1);
        let Kind::Surface { facet, piece } = tree.nodes[patch].kind else {
            return [0, 0];
        };
        let st = piece.outline.sample(DVec2::new(f64::from(x), f64::from(y)));
        let hit = on_facet(scene, &tree.surfaces, facet, &piece, st);
        let met = scene.intersect(&hit.spawn(direction(&hit, Vec2::new(u, v))));
        match met {
            None => [1, 0],
            Some(met) => [0, u64::from(tree.surfaces.facet_at(&met).is_none())],
        }
    };
    let counts: Vec<[u64; 2]> = (0..RAYS).into_par_iter().map(look).collect();
    let escaped: u64 = counts.iter().map(|c| c[0]).sum();
    let elsewhere: u64 = counts.iter().map(|c| c[1]).sum();
    let share = |n: u64| n as f64 / RAYS as f64;
    let lost = share(escaped) + share(elsewhere);
    (share(escaped) <= LEAK && lost <= ELSEWHERE).then_some(1.0 - lost)
}

fn is_patch(node: &TreeNode) -> bool {
    !node.is_cluster() && node.quarters == NONE
}

/// Whether nothing is absorbed, in a channel that has light.
pub fn absorbs_nothing(tree: &Tree) -> bool {
    let lit: Rgb64 = tree.emitted_power();
    let all_white = |c: usize| {
        let cells = tree.cells.iter();
        lit[c] > 0.0
            && cells
                .into_iter()
                .all(|&i| tree.nodes[i as usize].albedo[c] >= ALL)
    };
    (0..3).any(all_white)
}

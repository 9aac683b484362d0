//! What the links of a patch sum to.
//!
//! Each link errs by itself, so the form factors of a patch do not sum to what they should: the share of directions
//! in which there are patches. Where they sum to more than 1, light would be made of nothing, and they are scaled
//! down.

use super::bodies::Parts;
use super::gather::Field;
use super::trace::direction;
use super::tree::{Gain, Kind, NONE, Tree, TreeNode};
use crate::math::{DVec2, Vec2};
use crate::radiosity::Rgb64;
use crate::radiosity::mesh::on_facet;
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use rayon::prelude::*;

/// Rays that tell whether a scene is closed.
const RAYS: u64 = 1 << 13;
/// What may get out of a closed scene where patches reach through its walls.
const LEAK: f64 = 2e-3;
/// Reflectance from which on a patch absorbs nothing: f32 and averages of textures know it no better.
const ALL: f64 = 1.0 - 1e-6;

/// Sets the gain of all patches that are in no body, and of the bodies, by the sums of their links. Gives the mean of
/// how far that takes them down, by area.
pub fn balance(tree: &mut Tree, parts: &Parts) -> f64 {
    let mut field = Field::uniform(tree);
    let mut sums: Vec<(u32, Rgb64)> = field.gather(tree, parts).concat();
    for (number, body) in parts.bodies.iter().enumerate() {
        sums.push((body.node, field.linked_to_body(tree, body, number)));
    }
    let (mut off, mut area) = (0.0, 0.0);
    for (node, sum) in sums {
        let (node, sum) = (&mut tree.nodes[node as usize], sum.max_element());
        let scale = 1.0f64.min(1.0 / sum);
        node.gain = Gain {
            scale: Rgb64::splat(scale),
            ..Gain::NONE
        };
        off += (1.0 - scale) * node.area;
        area += node.area;
    }
    if area > 0.0 { off / area } else { 0.0 }
}

/// Whether (nearly) all light of `field` meets patches.
fn is_closed(scene: &Scene, tree: &Tree, field: &Field, seed: u64) -> bool {
    let mut sums = Vec::with_capacity(tree.nodes.len());
    let mut sum = 0.0;
    for (node, radiosity) in tree.nodes.iter().zip(&field.radiosity) {
        if is_patch(node) {
            sum += (radiosity.element_sum() * node.area).max(0.0);
        }
        sums.push(sum);
    }
    if !(sum.is_finite() && sum > 0.0) {
        return false;
    }
    let look = |i: u64| {
        let sampler = Sampler::new(SamplerKind::Sobol, seed, u64::MAX, i, 1);
        let ([x, y, u, v], [pick, ..]) = (sampler.get4(0), sampler.get4(1));
        let at = f64::from(pick) * sum;
        let patch = sums.partition_point(|s| *s <= at).min(sums.len() - 1);
        let Kind::Surface { facet, piece } = tree.nodes[patch].kind else {
            return false;
        };
        let st = piece.outline.sample(DVec2::new(f64::from(x), f64::from(y)));
        let hit = on_facet(scene, &tree.surfaces, facet, &piece, st);
        let met = scene.intersect(&hit.spawn(direction(&hit, Vec2::new(u, v))));
        met.is_none_or(|met| tree.surfaces.facet_at(&met).is_none())
    };
    let lost = (0..RAYS).into_par_iter().filter(|i| look(*i)).count();
    lost as f64 <= LEAK * RAYS as f64
}

fn is_patch(node: &TreeNode) -> bool {
    !node.is_cluster() && node.quarters == NONE
}

/// Whether nothing is absorbed of the light of `field`, in a channel that has any, and nothing gets out.
pub fn keeps_all(scene: &Scene, tree: &Tree, field: &Field, seed: u64) -> bool {
    let lit: Rgb64 = tree.emitted_power();
    let is_white = |cell: &u32, c: usize| tree.nodes[*cell as usize].albedo[c] >= ALL;
    let all_white = |c: usize| lit[c] > 0.0 && tree.cells.iter().all(|cell| is_white(cell, c));
    (0..3).any(all_white) && is_closed(scene, tree, field, seed)
}

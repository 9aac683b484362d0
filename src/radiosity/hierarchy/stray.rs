//! Light that comes from emitters to patches by mirrors, glass and gloss: links know nothing of it, walks do.

use super::divide;
use super::output;
use super::trace::{Purpose, Traces, Visit};
use super::tree::{NONE, Tree};
use super::walks::{Order, Walks};
use crate::radiosity::{Gloss, Rgb64, SolveSpec};
use crate::scene::Scene;

/// Whether anything in a scene can lead light astray.
pub fn is_possible(scene: &Scene, spec: &SolveSpec) -> bool {
    spec.gloss != Gloss::LeftOut && (scene.throws_caustics().is_ok() || scene.is_glossy())
}

/// Finds such light roughly, for links to be made by: a room that all light comes to through a pane would have none.
/// Patches are divided where it differs.
pub fn find(scene: &Scene, tree: &mut Tree, spec: &SolveSpec) {
    if spec.walks == 0 || spec.gloss != Gloss::All || !is_possible(scene, spec) {
        return;
    }
    let (mesh, traced) = output::mesh(tree);
    let lit = vec![true; mesh.len()];
    let traces = Traces::new(scene, tree, &mesh, &lit, spec, Purpose::Stray);
    let stray = |visit: &Visit| visit.stray.to_array().iter().sum();
    let brought: Vec<f32> = traces.visits.iter().map(stray).collect();
    if brought.iter().all(|b| *b == 0.0) {
        return;
    }
    divide::by_visits(scene, tree, &traces, &traced.leaf, &brought, spec);
    let (_, now) = output::mesh(tree);
    let walks = Walks::new(tree, traces, &traced.leaf, now.leaf);
    for (node, found) in of(tree, &walks).into_iter().enumerate() {
        tree.nodes[node].stray = found;
    }
    // Quarters have larger numbers than what they are quarters of.
    for node in (0..tree.nodes.len()).rev() {
        let first = tree.nodes[node].quarters;
        if first != NONE {
            let quarters = first as usize..first as usize + 4;
            let sum: Rgb64 = quarters.map(|quarter| tree.nodes[quarter].stray).sum();
            tree.nodes[node].stray = sum / 4.0;
        }
    }
}

/// What walks know of it: irradiance in W/m² by node, of patches.
pub fn of(tree: &Tree, walks: &Walks) -> Vec<Rgb64> {
    let mut stray = vec![Rgb64::ZERO; tree.nodes.len()];
    if walks.stray.squares.iter().all(|s| *s == 0.0) {
        return stray;
    }
    let order = Order::new(tree, None);
    // Where little is known, as much as around.
    let same = vec![Rgb64::ONE; walks.leaf.len()];
    let (gains, _) = walks.gains(tree, &order, &walks.stray, &same, None);
    for &leaf in &walks.leaf {
        let gain = gains[order.number[leaf as usize] as usize];
        stray[leaf as usize] = gain.of(Rgb64::ONE);
    }
    stray
}

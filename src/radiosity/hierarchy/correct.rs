//! The solution with links put right by what random walks find.

use super::bodies::Parts;
use super::gather::Field;
use super::trace::{Purpose, Traces};
use super::tree::{Gain, NONE, Tree};
use super::walks::{Order, Walks};
use super::watch::Watch;
use super::{divide, output, stray};
use crate::radiosity::{Report, Rgb64, SolveSpec};
use crate::scene::Scene;
use rayon::prelude::*;

/// Steps that all look at the gains; how far walks are trusted is settled then.
const OFTEN: u64 = 8;
/// Of those after, one in so many does; and all while light grows, which gains may be the cause of.
const SELDOM: u64 = 32;

/// Solves again, with what links bring to patches corrected by walks (see [`super::walks`]): light straight from
/// emitters first, then what is reflected. Gives irradiance straight from emitters, by node.
pub fn correct(
    scene: &Scene,
    tree: &mut Tree,
    field: &mut Field,
    spec: &SolveSpec,
    report: &mut Report,
    watch: &mut Watch,
) -> Vec<Rgb64> {
    let mut walks = walks(scene, tree, field, spec);
    let parts = &Parts::new(tree);
    let emitted = tree.emitted_power().element_sum();
    for node in &mut tree.nodes {
        node.gain = Gain::NONE;
    }
    let direct = corrected(tree, parts, &walks);
    let of_patch = |&leaf: &u32| direct[leaf as usize];
    walks.set_straight(walks.leaf.iter().map(of_patch).collect());
    let strays = stray::of(tree, &walks);
    let given: Vec<Rgb64> = direct.iter().zip(strays).map(|(d, s)| *d + s).collect();
    let met = walks.met();
    let order = Order::new(tree, Some(parts));
    let irradiance = std::mem::take(&mut field.irradiance);
    let mut reflected = Field::reflected(tree, given.clone(), irradiance);
    reflected.prepare(tree, parts);
    let (mut spread, mut settled, mut grows) = (None, false, false);
    for step in 1..=spec.max_steps.unwrap_or(super::MAX_STEPS) {
        let linked = reflected.gather(tree, parts);
        // Bright rooms take many steps, of which gains need few.
        let looks = settled || grows || step <= OFTEN || step % SELDOM == 0;
        if looks {
            let [by_links, irradiance] = by_patch(tree, parts, &reflected, &walks, &met, &linked);
            let arriving = walks.arriving(&irradiance);
            let known = spread.filter(|_| step > OFTEN);
            let (gains, used) = walks.gains(tree, &order, &arriving, &by_links, known);
            spread = Some(used);
            for (&node, gain) in order.nodes.iter().zip(gains) {
                tree.nodes[node as usize].gain = gain;
            }
        }
        let change = reflected.apply(tree, parts, &linked);
        report.steps += 1;
        let residual = change / emitted.max(f64::MIN_POSITIVE);
        grows = residual > report.residual;
        report.residual = residual;
        settled = report.residual <= spec.residual;
        report.converged = settled && looks;
        if report.converged || !report.residual.is_finite() {
            break;
        }
        if step % SELDOM == 0 {
            let mut seen = reflected.clone();
            seen.spread(tree, parts, None);
            seen.emit(tree);
            (watch.step, watch.residual) = (report.steps, report.residual);
            watch.show(tree, &seen);
            if watch.is_stopped() {
                break;
            }
        }
    }
    let linked = reflected.gather(tree, parts);
    let [by_links, irradiance] = by_patch(tree, parts, &reflected, &walks, &met, &linked);
    let arriving = walks.arriving(&irradiance);
    let (in_bodies, _) = walks.gains(tree, &Order::new(tree, None), &arriving, &by_links, spread);
    if let Some(edges) = spec.max_edges.filter(|&e| u64::from(e) < report.steps) {
        reflected = edge_by_edge(tree, parts, &given, edges);
    }
    reflected.spread(tree, parts, Some(&in_bodies));
    reflected.emit(tree);
    *field = reflected;
    direct
}

/// Traces walks, and divides patches as finely as these tell them apart.
fn walks(scene: &Scene, tree: &mut Tree, field: &mut Field, spec: &SolveSpec) -> Walks {
    let (mesh, traced) = output::mesh(tree);
    // Links know nothing of light by mirrors, glass and gloss.
    let all = stray::is_possible(scene, spec);
    let lit = |&node: &u32| all || field.irradiance[node as usize].element_sum() > 0.0;
    let lit: Vec<bool> = traced.leaf.iter().map(lit).collect();
    let traces = Traces::new(scene, tree, &mesh, &lit, spec, Purpose::Correct);
    let irradiance = |patch: u32| field.irradiance[traced.leaf[patch as usize] as usize];
    let brought = traces.brought(irradiance);
    divide::by_visits(scene, tree, &traces, &traced.leaf, &brought, spec);
    field.grow(tree);
    let (_, now) = output::mesh(tree);
    Walks::new(tree, traces, &traced.leaf, now.leaf)
}

/// Irradiance that links bring straight from emitters, by node.
pub fn straight(tree: &Tree, parts: &Parts) -> Vec<Rgb64> {
    let mut emission = Field::of_emission(tree);
    let linked = emission.gather(tree, parts);
    let mut direct = vec![Rgb64::ZERO; tree.nodes.len()];
    for &(leaf, linked) in linked.iter().flatten() {
        let node = &tree.nodes[leaf as usize];
        direct[leaf as usize] = node.gain.of(linked) + node.external;
    }
    let of = |&leaf: &u32| {
        let stray = tree.nodes[leaf as usize].stray;
        emission.irradiance_in_body(tree, parts, leaf) - stray
    };
    let in_bodies: Vec<Rgb64> = parts.leaves.par_iter().map(of).collect();
    for (&leaf, found) in parts.leaves.iter().zip(in_bodies) {
        direct[leaf as usize] = found;
    }
    direct
}

/// The same, corrected by walks.
fn corrected(tree: &Tree, parts: &Parts, walks: &Walks) -> Vec<Rgb64> {
    let mut direct = straight(tree, parts);
    let order = Order::new(tree, None);
    let linked: Vec<Rgb64> = walks
        .leaf
        .iter()
        .map(|&leaf| direct[leaf as usize])
        .collect();
    let (gains, _) = walks.gains(tree, &order, &walks.direct, &linked, None);
    for &leaf in &walks.leaf {
        let gain = gains[order.number[leaf as usize] as usize];
        direct[leaf as usize] = gain.of(direct[leaf as usize]);
    }
    direct
}

/// What links bring to patches that walks met, and their irradiance: by patch.
fn by_patch(
    tree: &Tree,
    parts: &Parts,
    field: &Field,
    walks: &Walks,
    met: &[u32],
    linked: &[Vec<(u32, Rgb64)>],
) -> [Vec<Rgb64>; 2] {
    let mut by_node = vec![Rgb64::ZERO; tree.nodes.len()];
    for &(leaf, linked) in linked.iter().flatten() {
        by_node[leaf as usize] = linked;
    }
    let of = |&patch: &u32| {
        let leaf = walks.leaf[patch as usize];
        match parts.body_of[leaf as usize] {
            NONE => [by_node[leaf as usize], field.irradiance[leaf as usize]],
            _ => [
                field.linked_in_body(tree, parts, leaf),
                field.irradiance_in_body(tree, parts, leaf),
            ],
        }
    };
    let found: Vec<[Rgb64; 2]> = met.par_iter().map(of).collect();
    let mut out = [(); 2].map(|_| vec![Rgb64::ZERO; walks.leaf.len()]);
    for (&patch, [linked, irradiance]) in met.iter().zip(found) {
        out[0][patch as usize] = linked;
        out[1][patch as usize] = irradiance;
    }
    out
}

/// Light of paths from emitters to patches of at most so many edges, with the gains that there are.
fn edge_by_edge(tree: &Tree, parts: &Parts, direct: &[Rgb64], edges: u32) -> Field {
    let mut field = Field::reflected(tree, direct.to_vec(), direct.to_vec());
    field.prepare(tree, parts);
    for _ in 1..edges {
        field.step(tree, parts);
    }
    field
}

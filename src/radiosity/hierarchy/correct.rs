//! The solution with links put right by what random walks find.

use super::bodies::Parts;
use super::gather::Field;
use super::trace::{Traces, Visit};
use super::tree::{Gain, Kind, NONE, Tree};
use super::walks::{Order, Walks};
use super::{output, refine};
use crate::math::DVec2;
use crate::radiosity::{Gloss, Progress, Report, Rgb64, SolveSpec};
use crate::scene::Scene;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Points of walks for which a patch is divided, at least.
const POINTS: usize = 16;
/// Variance between quarters of a patch over that within, times the degrees of freedom of the former: what chance
/// alone exceeds in one case of a thousand (chi-square, 3 degrees of freedom).
const SURE: f64 = 16.27;
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
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
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
    let given = stray(tree, &walks, &direct);
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
            if super::observes(tree, &seen, report, observe).is_break() {
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
    let all =
        spec.gloss != Gloss::LeftOut && (scene.throws_caustics().is_ok() || scene.is_glossy());
    let lit = |&node: &u32| all || field.irradiance[node as usize].element_sum() > 0.0;
    let lit: Vec<bool> = traced.leaf.iter().map(lit).collect();
    let traces = Traces::new(scene, tree, &mesh, &lit, spec);
    let reflected = |patch: u32| {
        let node = traced.leaf[patch as usize] as usize;
        field.irradiance[node]
    };
    let brought = traces.brought(reflected);
    let sample = |(visit, brought): (&Visit, f32)| Sample {
        node: traced.leaf[visit.at.patch as usize],
        st: visit.at.st,
        brought,
    };
    let mut samples: Vec<Sample> = traces.visits.iter().zip(brought).map(sample).collect();
    samples.par_sort_by_key(|s| s.node);
    let min_size = refine::min_size(tree, spec);
    for of_one in samples.chunk_by_mut(|a, b| a.node == b.node) {
        divide(scene, tree, of_one, min_size);
    }
    field.grow(tree);
    let (_, now) = output::mesh(tree);
    Walks::new(tree, traces, &traced.leaf, now.leaf)
}

/// What comes to a point of a leaf, which is given in the coordinates of its piece.
struct Sample {
    node: u32,
    st: [f32; 2],
    /// By the first solution: in W/m², summed over the channels.
    brought: f32,
}

/// Divides the leaf of `samples` into quarters, and these again, as long as what comes to them differs.
fn divide(scene: &Scene, tree: &mut Tree, samples: &mut [Sample], min_size: f64) {
    let Some(&Sample { node, .. }) = samples.first() else {
        return;
    };
    let Kind::Surface { piece, .. } = tree.nodes[node as usize].kind else {
        return;
    };
    if samples.len() < POINTS {
        return;
    }
    // By quarter: number, sum and sum of squares.
    let mut sums = [[0.0; 3]; 4];
    let quarter_of = |sample: &Sample| {
        let st = DVec2::from_array(sample.st.map(f64::from));
        piece.outline.child_at(st)
    };
    for sample in samples.iter() {
        let (x, sums) = (f64::from(sample.brought), &mut sums[quarter_of(sample).0]);
        for (sum, more) in sums.iter_mut().zip([1.0, x, x * x]) {
            *sum += more;
        }
    }
    if !differ(&sums) || !tree.divide(scene, node, min_size) {
        return;
    }
    let first = tree.nodes[node as usize].quarters;
    for sample in samples.iter_mut() {
        let (quarter, inside) = quarter_of(sample);
        sample.node = first + quarter as u32;
        sample.st = inside.as_vec2().to_array();
    }
    samples.sort_by_key(|s| s.node);
    for of_one in samples.chunk_by_mut(|a, b| a.node == b.node) {
        divide(scene, tree, of_one, min_size);
    }
}

/// Whether means differ by more than chance makes them: number, sum and sum of squares of each are given.
fn differ(sums: &[[f64; 3]; 4]) -> bool {
    let whole: [f64; 3] = std::array::from_fn(|i| sums.iter().map(|s| s[i]).sum());
    let mean = whole[1] / whole[0];
    let filled = sums.iter().filter(|s| s[0] > 0.0);
    let between: f64 = filled
        .clone()
        .map(|[n, sum, _]| n * (sum / n - mean).powi(2))
        .sum();
    let within = whole[2] - whole[0] * mean * mean - between;
    let freedom = whole[0] - filled.count() as f64;
    freedom > 0.0 && between * freedom > SURE * within
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
    let of = |&leaf: &u32| emission.irradiance_in_body(tree, parts, leaf);
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

/// `direct` (by node) and what comes from emitters by mirrors, glass and gloss, as far as walks tell: links, and what
/// corrects them, know nothing of that.
fn stray(tree: &Tree, walks: &Walks, direct: &[Rgb64]) -> Vec<Rgb64> {
    let mut given = direct.to_vec();
    if walks.stray.squares.iter().all(|s| *s == 0.0) {
        return given;
    }
    let order = Order::new(tree, None);
    // Where little is known, as much as around.
    let same = vec![Rgb64::ONE; walks.leaf.len()];
    let (gains, _) = walks.gains(tree, &order, &walks.stray, &same, None);
    for &leaf in &walks.leaf {
        let gain = gains[order.number[leaf as usize] as usize];
        given[leaf as usize] += gain.of(Rgb64::ONE);
    }
    given
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

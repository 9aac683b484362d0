//! Patches divided as finely as walks tell them apart.

use super::refine;
use super::trace::{Traces, Visit};
use super::tree::{Kind, Tree};
use crate::math::DVec2;
use crate::radiosity::SolveSpec;
use crate::scene::Scene;
use rayon::prelude::*;

/// Points of walks for which a patch is divided, at least.
const POINTS: usize = 16;
/// Variance between quarters of a patch over that within, times the degrees of freedom of the former: what chance
/// alone exceeds in one case of a thousand (chi-square, 3 degrees of freedom).
const SURE: f64 = 16.27;

/// Divides the leaves that `traces` left from, which were `traced` by patch, where what was `brought` to their visits
/// differs: in W/m², summed over the channels.
pub fn by_visits(
    scene: &Scene,
    tree: &mut Tree,
    traces: &Traces,
    traced: &[u32],
    brought: &[f32],
    spec: &SolveSpec,
) {
    let sample = |(visit, &brought): (&Visit, &f32)| Sample {
        node: traced[visit.at.patch as usize],
        st: visit.at.st,
        brought,
    };
    let mut samples: Vec<Sample> = traces.visits.iter().zip(brought).map(sample).collect();
    samples.par_sort_by_key(|s| s.node);
    let min_size = refine::min_size(tree, spec);
    for of_one in samples.chunk_by_mut(|a, b| a.node == b.node) {
        divide(scene, tree, of_one, min_size);
    }
}

/// What comes to a point of a leaf, which is given in the coordinates of its piece.
struct Sample {
    node: u32,
    st: [f32; 2],
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

//! Hierarchical radiosity: light is exchanged between pieces of surface as large as the error allows.
//!
//! Nodes are clusters of facets, facets, and quarters of quarters of these; leaves are the patches. A link brings
//! light from a sending node to a receiving one; each pair of points of two patches belongs to exactly one link
//! between ancestors of theirs (Hanrahan, Salzman & Aupperle 1991; clusters as in Smits, Arvo & Greenberg 1994).
//!
//! A link is as good as needed when the error of the power that it brings is below a threshold: the spread of the
//! form factor, visibility included, over the receiver, times what is sent; and the spread of radiosity over the
//! sender, times the form factor. Otherwise one of its ends is divided. The threshold falls in steps from a loose
//! one to the one that is asked for, with solutions between, so that links are judged by the light that there is.

mod balance;
mod bodies;
mod cluster;
mod correct;
mod divide;
mod estimate;
mod gather;
mod output;
mod refine;
mod sphere;
mod stray;
mod trace;
mod tree;
mod walks;
mod watch;

use super::{Progress, Report, Rgb64, Solution, SolveError, SolveSpec, Surfaces};
use crate::scene::Scene;
use bodies::Parts;
use gather::Field;
use refine::Refiner;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;
use std::time::Instant;
use tree::Tree;
use watch::Watch;

/// A cluster or a piece of surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// `u32::MAX` for the root.
    pub parent: u32,
    /// The patches below, which are numbered depth first: an ancestor's range contains those of its descendants.
    pub patches: Range<u32>,
    /// Into `Hierarchy::links`: those that bring light here, by rising first patch of their senders.
    pub links: Range<u32>,
}

/// Light on its way from one node to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// The node that it comes from.
    pub sender: u32,
    /// From the receiver to the sender, with visibility: times the sender's radiosity it is irradiance in W/m².
    pub form_factor: f32,
}

/// What light was exchanged between. The parent of a node has a smaller number than the node.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    pub nodes: Vec<Node>,
    pub links: Vec<Link>,
    /// By patch: the node that it is.
    pub leaf: Vec<u32>,
}

/// The thresholds fall by this factor from one refinement to the next.
const STEP: f64 = 4.0;
/// Refinements before the last, at most.
const LOOSER: i32 = 4;
/// The largest error that is worth a refinement.
const LOOSEST: f64 = 0.2;
/// Gathering steps before each refinement but the first, at most.
const LOOKS: u64 = 5;
/// Scaling of form factors that is worth a warning, in the mean.
const MUCH: f64 = 0.05;
/// Irradiance that is no more than this share of the mean is not resolved better than that.
const BLACK: f64 = 1e-3;
/// Gathering steps after the last refinement, at most, when no other limit is given.
const MAX_STEPS: u64 = 10_000;

/// The hierarchical solution of `scene`. Where it is stopped while links are made, those that are still to be divided
/// stay as they are, and nothing is put right by walks.
pub fn solve(
    scene: &Scene,
    surfaces: Arc<Surfaces>,
    spec: &SolveSpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Solution, SolveError> {
    let start = Instant::now();
    let mut tree = Tree::new(scene, surfaces.clone(), spec)?;
    let mut report = Report {
        mesh_seconds: start.elapsed().as_secs_f64(),
        ..Report::default()
    };
    stray::find(scene, &mut tree, spec);
    let mut refiner = Refiner::new(scene, &surfaces, spec, &mut tree);
    let emitted = tree.emitted_power();
    let mut field = Field::new(&tree);
    let most = spec.max_steps.unwrap_or(MAX_STEPS);
    let mut too_much = 0.0;
    let mut parts = Parts::new(&tree);
    let mut watch = Watch::new(observe);
    let looser = (LOOSEST / spec.error).log(STEP).floor() as i32;
    for looser in (0..=looser.clamp(0, LOOSER)).rev() {
        let clock = Instant::now();
        let error = spec.error * STEP.powi(looser);
        // What few links make dark may be brighter than it seems.
        let black = (BLACK * STEP.powi(looser)).min(0.25);
        refiner.refine(&mut tree, &mut field, error, black, &mut watch);
        if balance::keeps_all(scene, &tree, &field, spec.seed) {
            return Err(SolveError::NoAbsorption);
        }
        parts = Parts::new(&tree);
        too_much = balance::balance(&mut tree, &parts);
        field.prepare(&tree, &parts);
        report.form_factor_seconds += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        // Before the last refinement, it is enough to see where light goes.
        let stopped = watch.is_stopped();
        let (wanted, until) = match looser {
            0 if spec.walks == 0 && !stopped => (spec.residual, most),
            _ => (spec.residual.max(0.02), most.min(report.steps + LOOKS)),
        };
        loop {
            report.residual =
                field.step(&tree, &parts) / emitted.element_sum().max(f64::MIN_POSITIVE);
            report.steps += 1;
            report.converged = looser == 0 && !stopped && report.residual <= wanted;
            let growing = !report.residual.is_finite();
            if report.residual <= wanted || report.steps >= until || growing {
                break;
            }
            (watch.step, watch.residual) = (report.steps, report.residual);
            if !stopped && watch.look(&tree, &field) {
                break;
            }
        }
        (watch.step, watch.residual) = (report.steps, report.residual);
        field.spread(&tree, &parts, None);
        report.solve_seconds += clock.elapsed().as_secs_f64();
        if looser == 0 || report.steps >= most || watch.is_stopped() {
            break;
        }
        watch.show(&tree, &field);
        if watch.is_stopped() {
            break;
        }
    }
    if watch.is_stopped() {
        let said =
            "stopped before all links were as good as was asked for: light is found only roughly";
        report.warnings.push(said.to_string());
    }
    report.links = tree.links();
    let mut direct = None;
    if report.residual.is_finite() && spec.walks > 0 && !watch.is_stopped() {
        let clock = Instant::now();
        direct = Some(correct::correct(
            scene,
            &mut tree,
            &mut field,
            spec,
            &mut report,
            &mut watch,
        ));
        report.solve_seconds += clock.elapsed().as_secs_f64();
    }
    if too_much > MUCH && spec.walks == 0 {
        report.warnings.push(format!(
            "the form factors of patches were scaled down to a sum of 1, by {:.0} % in the mean: surfaces that coincide \
             or let light through, or links that are too coarse",
            100.0 * too_much
        ));
    }
    let direct = direct.unwrap_or_else(|| correct::straight(&tree, &parts));
    let solution = output::solution(scene, &tree, &field, &direct, report);
    if solution.mesh.is_empty() {
        return Err(SolveError::NoPatches);
    }
    let last = Progress {
        step: solution.report.steps,
        mesh: &solution.mesh,
        radiosity: &solution.radiosity,
        ambient: Rgb64::ZERO,
        residual: solution.report.residual,
    };
    let _ = (watch.observe)(&last);
    Ok(solution)
}

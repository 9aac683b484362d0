//! A wish to stop is heard wherever work takes long.

use crate::rooms::*;
use luxel::radiosity::{self, Progress, Solution, SolveSpec};
use std::ops::ControlFlow;

/// Links are divided down to this size, however little they err.
fn endless(min_size: f64) -> SolveSpec {
    SolveSpec {
        error: 1e-12,
        min_size: Some(min_size),
        ..SolveSpec::default()
    }
}

/// The solution for an observer that stops when `at` says so, and the step that it stopped at.
fn stopped(spec: &SolveSpec, mut at: impl FnMut(&Progress) -> bool) -> (Solution, u64) {
    let scene = scene(&room_of_blocks(1.0, 0.3));
    let mut stopped = None;
    let mut after = 0;
    let mut observe = |p: &Progress| {
        assert_eq!(p.radiosity.len(), p.mesh.len());
        after += u32::from(stopped.is_some());
        if stopped.is_none() && at(p) {
            stopped = Some(p.step);
        }
        match stopped {
            Some(_) => ControlFlow::Break(()),
            None => ControlFlow::Continue(()),
        }
    };
    let solution = radiosity::solve(&scene, spec, &mut observe).unwrap();
    assert_eq!(after, 1, "only the solution is shown after the wish");
    (solution, stopped.expect("shown to the observer"))
}

#[test]
fn links_that_would_take_minutes_end_when_that_is_wished() {
    // Before there is any solution: millions of links of the lamp; and after the first: millions of others.
    for (step, min_size) in [(0, 1e-3), (1, 0.1)] {
        // The second time, so that the step is over and links are being made.
        let mut seen = 0;
        let (solution, at) = stopped(&endless(min_size), |p| {
            seen += u32::from(p.step >= step);
            seen >= 2
        });
        let r = &solution.report;
        // Light goes around a few times over the links that there are, and no links are added: there are some 50,000
        // by the second look, and would be millions in the end.
        assert!(r.steps <= at + 5, "{} steps after {at}", r.steps);
        assert!(r.links < 1_000_000, "{} links", r.links);
        assert!(!r.converged);
        let said = r
            .warnings
            .iter()
            .filter(|w| w.starts_with("stopped before"));
        assert_eq!(said.count(), 1, "{:?}", r.warnings);
        let all = solution.radiosity.iter().chain(&solution.irradiance);
        assert!(all.into_iter().all(|x| x.is_finite()));
        // Light straight from the lamp at least, from which walls of any reflectance take in some, and no more than
        // there is but for the error of rough links.
        let share = r.absorbed.element_sum() / r.emitted.element_sum();
        assert!((0.1..1.1).contains(&share), "step {step}: {share}");
    }
}

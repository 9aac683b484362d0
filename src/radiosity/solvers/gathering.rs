//! Gathering: each patch takes in what all others have, sweep after sweep.

use super::watch::Watch;
use super::{Run, Solved, System};
use crate::radiosity::form_factors::Matrix;
use crate::radiosity::{Progress, Rgb64, SolveError, Solver};
use rayon::prelude::*;

/// Iterates until the residual is small, in the manner of Jacobi or of Gauss and Seidel.
///
/// Each sweep divides the error by at least the largest ρ Σ_j F_ij, which is below 1 but where light cannot fade.
pub(super) fn iterate(
    system: &System,
    f: &Matrix,
    solver: Solver,
    run: Run,
) -> Result<Solved, SolveError> {
    let mut radiosity = system.source.clone();
    let mut watch = Watch::new();
    let mut steps = 0;
    while steps < run.max_steps {
        let change = match solver {
            Solver::Jacobi => all_at_once(system, f, &mut radiosity),
            _ => in_turn(system, f, &mut radiosity),
        };
        let residual = system.relative(change);
        steps += 1;
        let progress = Progress {
            step: steps,
            mesh: system.mesh,
            radiosity: &radiosity,
            ambient: Rgb64::ZERO,
            residual,
        };
        let stop = (run.observe)(&progress).is_break();
        if residual <= run.residual || stop || at_rounding(system, &radiosity, change) {
            break;
        }
        if watch.is_stuck(residual) {
            let sums = (0..f.n).map(|i| f.row(i).iter().sum());
            return Err(system.growth(solver, sums.fold(0.0, f64::max)));
        }
    }
    Ok(gather(system, f, &radiosity, steps, run.residual))
}

/// Whether a change is no more than what rounding makes of sums of so many numbers.
pub(super) fn at_rounding(system: &System, radiosity: &[Rgb64], change: f64) -> bool {
    let all = system.watts(radiosity).element_sum();
    change <= 4.0 * f64::EPSILON * all
}

/// One step of Jacobi. Returns Σ A |change| over the channels: the residual of what was there before.
fn all_at_once(system: &System, f: &Matrix, radiosity: &mut Vec<Rgb64>) -> f64 {
    let patches = &system.mesh.patches;
    let next: Vec<Rgb64> = (0..f.n)
        .into_par_iter()
        .map(|i| system.source[i] + patches[i].albedo * dot(f.row(i), radiosity))
        .collect();
    let changes = next.iter().zip(radiosity.iter()).zip(patches);
    let change = changes.map(|((a, b), p)| p.area * (*a - *b).abs().element_sum());
    let change = change.sum();
    *radiosity = next;
    change
}

/// One sweep of Gauss and Seidel: every patch uses what those before it have just got.
fn in_turn(system: &System, f: &Matrix, radiosity: &mut [Rgb64]) -> f64 {
    let mut change = 0.0;
    for (i, patch) in system.mesh.patches.iter().enumerate() {
        let next = system.source[i] + patch.albedo * dot(f.row(i), radiosity);
        change += patch.area * (next - radiosity[i]).abs().element_sum();
        radiosity[i] = next;
    }
    change
}

/// Σ f x in four partial sums, which do not wait for each other.
fn dot(f: &[f64], x: &[Rgb64]) -> Rgb64 {
    let mut sums = [Rgb64::ZERO; 4];
    let (mut fs, mut xs) = (f.chunks_exact(4), x.chunks_exact(4));
    for (f, x) in (&mut fs).zip(&mut xs) {
        for k in 0..4 {
            sums[k] += x[k] * f[k];
        }
    }
    let rest = fs.remainder().iter().zip(xs.remainder());
    let rest: Rgb64 = rest.map(|(f, x)| *x * *f).sum();
    sums.into_iter().sum::<Rgb64>() + rest
}

/// The solution from these radiosities: all gather once more, so that B = E + ρ irradiance holds exactly. The
/// residual is that of `radiosity`, which bounds that of the result.
pub(super) fn gather(
    system: &System,
    f: &Matrix,
    radiosity: &[Rgb64],
    steps: u64,
    wanted: f64,
) -> Solved {
    let patches = &system.mesh.patches;
    let emission: Vec<Rgb64> = patches.iter().map(|p| p.emission).collect();
    let gathered = |x: &[Rgb64]| -> Vec<Rgb64> {
        let rows = (0..f.n).into_par_iter();
        rows.map(|i| system.external[i] + dot(f.row(i), x))
            .collect()
    };
    let (irradiance, direct) = (gathered(radiosity), gathered(&emission));
    let all = patches.iter().zip(&irradiance);
    let result: Vec<Rgb64> = all.map(|(p, &e)| p.emission + p.albedo * e).collect();
    let changes = result.iter().zip(radiosity).zip(patches);
    let change = changes.map(|((a, b), p)| p.area * (*a - *b).abs().element_sum());
    let residual = system.relative(change.sum());
    // What patches give, less what others get of it: F's error of reciprocity included, so that the energies
    // balance.
    let given =
        system.watts(radiosity) - (system.watts(&irradiance) - system.watts(&system.external));
    let sums = (0..f.n).map(|i| f.row(i).iter().sum());
    Solved {
        radiosity: result,
        irradiance,
        direct,
        steps,
        residual,
        converged: residual <= wanted,
        row_sum: sums.fold(0.0, f64::max),
        escaped: given,
        quality: None,
        form_factor_seconds: 0.0,
    }
}

//! Gaussian elimination: one factorisation of I - ρ F per channel.

use super::gathering::gather;
use super::{Run, Solved, System};
use crate::radiosity::form_factors::Matrix;
use crate::radiosity::{Progress, Rgb64, SolveError, Solver};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::{Conj, Mat, Par};

/// Into how many parts the elimination is divided: a fixed number, so that the result does not depend on that of
/// the threads.
const PARTS: usize = 8;

/// More radiosity than this over what was emitted says no more than that (almost) nothing is absorbed: form
/// factors are not known that well.
const MOST_GAIN: f64 = 1e6;

/// Solves with partial pivoting; the residual is that of the rounding.
pub(super) fn eliminate(system: &System, f: &Matrix, run: Run) -> Result<Solved, SolveError> {
    let n = system.len();
    let albedo: Vec<Rgb64> = system.mesh.patches.iter().map(|p| p.albedo).collect();
    // Channels with the same albedos everywhere share a factorisation.
    let alike = |a: usize, b: usize| albedo.iter().all(|rho| rho[a] == rho[b]);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for channel in 0..3 {
        match groups.iter_mut().find(|group| alike(group[0], channel)) {
            Some(group) => group.push(channel),
            None => groups.push(vec![channel]),
        }
    }
    let mut radiosity = vec![Rgb64::ZERO; n];
    for group in groups {
        let matrix = Mat::from_fn(n, n, |i, j| {
            let identity = if i == j { 1.0 } else { 0.0 };
            identity - albedo[i][group[0]] * f.f[i * n + j]
        });
        let mut sides = Mat::from_fn(n, group.len(), |i, k| system.source[i][group[k]]);
        solve_in_place(matrix, &mut sides);
        for (k, &channel) in group.iter().enumerate() {
            for (i, b) in radiosity.iter_mut().enumerate() {
                b[channel] = sides[(i, k)];
            }
        }
    }
    check(system, f, &radiosity)?;
    let solved = gather(system, f, &radiosity, 1, run.residual);
    let progress = Progress {
        step: 1,
        mesh: system.mesh,
        radiosity: &solved.radiosity,
        ambient: Rgb64::ZERO,
        residual: solved.residual,
    };
    // The one step is done: there is nothing to stop any more.
    let _ = (run.observe)(&progress);
    Ok(solved)
}

fn solve_in_place(mut matrix: Mat<f64>, sides: &mut Mat<f64>) {
    let (n, par) = (matrix.nrows(), Par::rayon(PARTS));
    let (mut forward, mut backward) = (vec![0usize; n], vec![0usize; n]);
    let params = Default::default();
    let scratch = factor::lu_in_place_scratch::<usize, f64>(n, n, par, params);
    let (_, permutation) = factor::lu_in_place(
        matrix.as_mut(),
        &mut forward,
        &mut backward,
        par,
        MemStack::new(&mut MemBuffer::new(scratch)),
        params,
    );
    let scratch = solve::solve_in_place_scratch::<usize, f64>(n, sides.ncols(), par);
    solve::solve_in_place_with_conj(
        matrix.as_ref(),
        matrix.as_ref(),
        permutation,
        Conj::No,
        sides.as_mut(),
        par,
        MemStack::new(&mut MemBuffer::new(scratch)),
    );
}

/// A solution with negative radiosity, or far more light than was emitted, is that of a scene in which light
/// grows: where it fades, all of (I - ρ F)⁻¹ is positive.
fn check(system: &System, f: &Matrix, radiosity: &[Rgb64]) -> Result<(), SolveError> {
    let most = radiosity.iter().map(|b| b.max_element());
    let most = most.fold(0.0, f64::max);
    let rounding = -1e-9 * most;
    let sound = |b: &Rgb64| b.is_finite() && b.min_element() >= rounding;
    let gain = system.relative(system.watts(radiosity).element_sum());
    match radiosity.iter().all(sound) && gain <= MOST_GAIN {
        true => Ok(()),
        false => {
            let sums = (0..f.n).map(|i| f.row(i).iter().sum());
            Err(system.growth(Solver::Gauss, sums.fold(0.0, f64::max)))
        }
    }
}

//! Solvers on a flat mesh of patches: B = E + ρ (e + F B), by elimination, by gathering and by shooting.
//!
//! They know form factors only as rows of F ([`Exchange`]), and all solve the same equations, up to the residual, as
//! far as A_i F_ij = A_j F_ji holds: gathering takes what row i says of those that give to i, shooting what it says
//! of those that get from i. Rows are taken as they are: those that sum to more than 1 are not scaled down in
//! silence; where light would grow for that reason, it is an error that says so.

mod closure;
mod direct;
mod gathering;
mod memory;
mod shooting;
mod watch;

#[cfg(test)]
mod tests;

use super::discontinuity::{self, Limits};
use super::form_factors::{FormFactors, Matrix, Quality};
use super::report::{self, Balance};
use super::{
    PatchMesh, Progress, Report, Rgb64, Solution, SolveError, SolveSpec, Solver, Surfaces, lights,
    mesh,
};
use crate::scene::Scene;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Patches that a mesh gets where no size is given: of the solvers that hold all form factors, and of shooting.
const PATCHES_OF_MATRIX: u64 = 2_000;
const PATCHES_OF_SHOOTING: u64 = 10_000;

/// A row that sums to more than 1 by this is worth a warning.
const ROW_SUM_DOUBT: f64 = 0.1;

/// In the report, rows of a closed scene that miss 1 by more than this count as off.
const ROW_TOLERANCE: f64 = 0.01;

/// Form factors between patches, as the solvers ask for them. Each is a pure function of its numbers.
pub(super) trait Exchange: Sync {
    /// F_ij for all j: the share of what leaves i that arrives at j.
    fn row(&self, i: u32, out: &mut [f64]);

    /// All rows; and how well they keep what holds of form factors, if that is known.
    fn matrix(&self) -> (Matrix, Option<Quality>);
}

impl Exchange for FormFactors<'_> {
    fn row(&self, i: u32, out: &mut [f64]) {
        FormFactors::row(self, i, out);
    }

    fn matrix(&self) -> (Matrix, Option<Quality>) {
        let (matrix, losses) = self.matrix_and_losses();
        let quality = Quality::new(self, &matrix, &losses, ROW_TOLERANCE);
        (matrix, Some(quality))
    }
}

/// What is known of the patches: all but the form factors.
pub(super) struct System<'a> {
    pub mesh: &'a PatchMesh,
    /// Irradiance in W/m² from lights that are no patches.
    pub external: Vec<Rgb64>,
    /// E + ρ e in W/m²: what leaves a patch before any exchange.
    pub source: Vec<Rgb64>,
    /// Σ A (E + ρ e) over patches and channels, in W.
    pub power: f64,
}

/// What a solver found.
pub(super) struct Solved {
    pub radiosity: Vec<Rgb64>,
    pub irradiance: Vec<Rgb64>,
    pub direct: Vec<Rgb64>,
    pub steps: u64,
    pub residual: f64,
    pub converged: bool,
    /// Largest sum of a row that was seen.
    pub row_sum: f64,
    /// W that leave patches and arrive at none.
    pub escaped: Rgb64,
    /// Of the form factors, where all of them were known at once.
    pub quality: Option<Quality>,
    pub form_factor_seconds: f64,
}

/// When a solver is done, and whom it tells.
pub(super) struct Run<'a> {
    pub residual: f64,
    pub max_steps: u64,
    pub observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
}

impl<'a> System<'a> {
    pub fn new(mesh: &'a PatchMesh, external: Vec<Rgb64>) -> System<'a> {
        let patches = mesh.patches.iter().zip(&external);
        let source: Vec<Rgb64> = patches.map(|(p, &e)| p.emission + p.albedo * e).collect();
        let mut system = System {
            mesh,
            external,
            source,
            power: 0.0,
        };
        system.power = system.watts(&system.source).element_sum();
        system
    }

    pub fn len(&self) -> usize {
        self.source.len()
    }

    /// Σ A x, per channel.
    pub fn watts(&self, x: &[Rgb64]) -> Rgb64 {
        let patches = self.mesh.patches.iter().zip(x);
        patches.map(|(p, &x)| x * p.area).sum()
    }

    /// `watts` relative to the emitted power; 0 where nothing shines.
    pub fn relative(&self, watts: f64) -> f64 {
        match self.power > 0.0 {
            true => watts / self.power,
            false => 0.0,
        }
    }

    /// Why light grows without limit, if the largest sum of a row of form factors is this.
    fn growth(&self, solver: Solver, row_sum: f64) -> SolveError {
        let albedos = self.mesh.patches.iter().map(|p| p.albedo.max_element());
        let albedo = albedos.fold(0.0, f64::max);
        match row_sum > 1.0 + 1e-6 && albedo < 1.0 {
            true => SolveError::Diverges {
                solver: solver.name(),
                row_sum,
                albedo,
            },
            false => SolveError::NoAbsorption,
        }
    }
}

/// The solution of `scene` by elimination, gathering or shooting.
pub(super) fn solve(
    scene: &Scene,
    surfaces: Arc<Surfaces>,
    spec: &SolveSpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Solution, SolveError> {
    let start = Instant::now();
    let (mesh, said) = divided(scene, surfaces, spec)?;
    let mesh_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let system = System::new(&mesh, lights::external(scene, &mesh, spec.seed));
    closure::check(scene, &system, spec.seed)?;
    let run = Run {
        // Not a number asks for as little as there can be.
        residual: spec.residual.max(0.0),
        max_steps: spec.max_steps.unwrap_or(u64::MAX),
        observe,
    };
    let solved = by_spec(scene, &system, spec, run)?;
    let seconds = start.elapsed().as_secs_f64() - solved.form_factor_seconds;
    let balance = Balance {
        mesh: &mesh,
        external: &system.external,
        irradiance: &solved.irradiance,
        escaped: solved.escaped,
    };
    let mut report = Report {
        patches: mesh.len(),
        links: 0,
        steps: solved.steps,
        converged: solved.converged,
        residual: solved.residual,
        mesh_seconds,
        form_factor_seconds: solved.form_factor_seconds,
        solve_seconds: seconds,
        quality: solved.quality,
        ..report::of(scene, &balance)
    };
    report.warnings.extend(said);
    let doubts = doubts(&report, solved.row_sum);
    report.warnings.extend(doubts);
    if report.converged {
        let ways = [report.absorbed, report.escaped].map(Rgb64::element_sum);
        let doubt = closure::doubt(scene, &system, &solved.radiosity, ways, spec.seed);
        report.warnings.extend(doubt);
    }
    Ok(Solution {
        radiosity: solved.radiosity,
        irradiance: solved.irradiance,
        direct: solved.direct,
        hierarchy: None,
        report,
        mesh,
    })
}

/// The mesh that `spec` asks for, refused before it is made where it has too many patches; and what to say of it.
fn divided(
    scene: &Scene,
    surfaces: Arc<Surfaces>,
    spec: &SolveSpec,
) -> Result<(PatchMesh, Vec<String>), SolveError> {
    let wanted = match spec.solver {
        Solver::Shooting => PATCHES_OF_SHOOTING,
        _ => PATCHES_OF_MATRIX,
    };
    let size = spec
        .patch_size
        .unwrap_or_else(|| mesh::size_for(&surfaces, wanted));
    admit(spec, mesh::count(&surfaces, size))?;
    if !spec.discontinuities {
        return Ok((PatchMesh::uniform(scene, surfaces, size), Vec::new()));
    }
    let (mesh, found) = discontinuity::mesh(scene, surfaces, size, &Limits::default());
    admit(spec, mesh.len() as u64)?;
    Ok((mesh, found.warnings()))
}

/// Refuses more patches than there may be, or than the solver has memory for.
fn admit(spec: &SolveSpec, patches: u64) -> Result<(), SolveError> {
    let limit = spec.max_patches.min(mesh::MOST_PATCHES);
    match patches > limit {
        true => Err(SolveError::TooManyPatches { patches, limit }),
        false => memory::check(spec.solver, patches),
    }
}

fn by_spec(
    scene: &Scene,
    system: &System,
    spec: &SolveSpec,
    run: Run,
) -> Result<Solved, SolveError> {
    let factors = FormFactors::new(scene, system.mesh, spec.form_factors, spec.seed);
    by_factors(system, &factors, spec, run)
}

/// The solution with form factors of any origin.
fn by_factors(
    system: &System,
    factors: &dyn Exchange,
    spec: &SolveSpec,
    run: Run,
) -> Result<Solved, SolveError> {
    if spec.solver == Solver::Shooting {
        return shooting::shoot(system, factors, spec.ambient, run);
    }
    let start = Instant::now();
    let (matrix, quality) = factors.matrix();
    let form_factor_seconds = start.elapsed().as_secs_f64();
    let solved = match spec.solver {
        Solver::Gauss => direct::eliminate(system, &matrix, run)?,
        solver => gathering::iterate(system, &matrix, solver, run)?,
    };
    Ok(Solved {
        quality,
        form_factor_seconds,
        ..solved
    })
}

/// What the user should know of the iteration.
fn doubts(report: &Report, row_sum: f64) -> Vec<String> {
    let mut doubts = Vec::new();
    if !report.converged {
        doubts.push(format!(
            "the solver stopped after {} steps with a residual of {:.2e}, which is more than was asked for",
            report.steps, report.residual
        ));
    }
    if row_sum > 1.0 + ROW_SUM_DOUBT {
        doubts.push(format!(
            "form factors of a patch sum to {row_sum:.4}: light that is not there is exchanged; use more \
             samples or a higher resolution"
        ));
    }
    doubts
}

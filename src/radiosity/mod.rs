//! Radiosity: the diffuse light of a scene, the same from wherever it is seen.
//!
//! The surfaces are divided into patches of uniform radiosity B (exitance in W/m², per channel), which obey
//! B_i = E_i + ρ_i (e_i + Σ_j F_ij B_j): E what the patch emits, ρ its diffuse reflectance, e the irradiance
//! from lights that are no patches, and F_ij the form factor, the share of what leaves patch i (as a diffuse
//! emitter) that arrives at patch j (Goral, Torrance, Greenberg & Battaile 1984). A patch shows radiance B/π.
//!
//! What other lobes than diffuse ones do to light is left out. The result is biased; it converges with the size
//! of the patches for scenes of diffuse surfaces.

pub mod dark;
pub mod discontinuity;
pub mod display;
pub mod export;
pub mod form_factors;
pub mod guide;
pub mod hierarchy;
pub mod lights;
pub mod mesh;
pub mod optics;
pub mod piece;
pub mod polygon;
mod report;
mod solvers;
pub mod surfaces;
pub mod triangulation;

pub use display::Display;
pub use form_factors::FormFactors;
pub use guide::Guide;
pub use hierarchy::Hierarchy;
pub use mesh::{Located, Patch, PatchMesh};
pub use piece::{Outline, Piece};
pub use surfaces::{Cut, Surfaces};

use crate::math::DVec3;
use crate::scene::Scene;
use dark::DarkSides;
use std::fmt;
use std::ops::ControlFlow;
use std::sync::Arc;

/// A number per channel.
pub type Rgb64 = DVec3;

/// How form factors are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FormFactorMethod {
    /// All patches are drawn onto the half-cube over the middle of a patch (Cohen & Greenberg 1985), with
    /// `resolution` pixels along its edge.
    Hemicube { resolution: u32 },
    /// `samples` pairs of points on both patches, and a ray between each.
    MonteCarlo { samples: u32 },
    /// The closed form of a polygon's irradiance at a point (Lambert 1760), at about `samples` points of the
    /// receiver, times the share of rays that arrive.
    Analytic { samples: u32 },
}

/// How the radiosities are solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Gaussian elimination with partial pivoting.
    Gauss,
    /// Each patch gathers what the others have, in turn.
    GaussSeidel,
    /// All patches gather what the others had.
    Jacobi,
    /// The patch that has most to give sends it to all others (Cohen, Chen, Wallace & Greenberg 1988).
    Shooting,
    /// Links between patches as large as the error allows (Hanrahan, Salzman & Aupperle 1991), and clusters of
    /// patches (Smits, Arvo & Greenberg 1994).
    Hierarchical,
}

/// What becomes of light that surfaces scatter in other ways than diffusely: by mirrors, gloss, glass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gloss {
    /// It is lost: what is left is radiosity as its equation says.
    LeftOut,
    /// Walks follow it from one diffuse surface to the next ([`SolveSpec::walks`]).
    BetweenDiffuse,
    /// Also from emitters; and links take what opaque surfaces reflect for diffuse, so that it goes astray before walks
    /// put it right: better for guiding walks, and for what they read.
    All,
}

/// What is solved, and how well.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveSpec {
    pub solver: Solver,
    pub form_factors: FormFactorMethod,
    /// Longest edge of a patch in scene units; `None`: what gives about 2,000 patches, of which all form factors
    /// are kept, or 10,000 for shooting; a part of the size of the scene for the hierarchical solver. The hierarchical solver
    /// begins with whole facets and makes no patch with a longer edge than this in the end, nor a shorter one
    /// than `min_size`.
    pub patch_size: Option<f64>,
    /// Shortest edge that the hierarchical solver makes; `None`: a part of the size of the scene.
    pub min_size: Option<f64>,
    /// Greatest error of a link of the hierarchical solver: the error of its receiver's irradiance as a share of
    /// the irradiance that is usual there, times the receiver's share of the area of all surfaces.
    ///
    /// All links together err by no more than `links` (see [`Report`]) times this, as a share of the irradiance in
    /// the mean over all surfaces; by far less where their signs differ, and where walks put them right. Against the
    /// direct solution of five rooms (tests/radiosity_accuracy; root mean square of irradiance on squares of an eighth
    /// of a wall, as a share of the mean irradiance): 1 to 6 % at 1e-3, 0.5 to 2 % at 1e-4, 0.2 to 1 % at 1e-5; without
    /// walks 6 to 16 %, 3 to 8 %, 0.4 to 6 %. Where `min_size` stops the division, smaller errors bring nothing more.
    pub error: f64,
    /// The iteration ends when the residual, relative to the emitted power, is less.
    pub residual: f64,
    /// Most steps of an iterative solver: sweeps, or patches that shoot; `None`: as many as it takes.
    pub max_steps: Option<u64>,
    /// Show light that is not shot yet as if it were spread everywhere (shooting only; display, not result).
    pub ambient: bool,
    /// Edges of random walks by which the hierarchical solver corrects what links bring, about; 0: it trusts them. The
    /// noise of the corrected light falls with their square root; how far links need it is found by the walks too.
    pub walks: u64,
    /// Light at patches has at most so many edges, from its emitter on; `None`: any number (hierarchical solver with
    /// walks only).
    pub max_edges: Option<u32>,
    /// Cut patches along the edges of shadows.
    pub discontinuities: bool,
    /// Let patches of the hierarchical solver end where other surfaces touch or pass through them, so that a wall
    /// parts what lies on both of its sides. Scenes of very many facets are left as they are; so are some facets that
    /// too many others touch.
    pub contacts: bool,
    /// Curved shapes differ from their facets by at most this share of their radius.
    pub curve_error: f64,
    /// What becomes of light that surfaces scatter in other ways than diffusely.
    pub gloss: Gloss,
    /// Leave out sides of surfaces that walks of light never meet, though they often meet the other side: insides of
    /// closed bodies. Where they are met after all, they have no patches.
    pub lit_only: bool,
    /// Most patches; more are an error before anything is solved.
    pub max_patches: u64,
    pub seed: u64,
}

/// Fewer walks than this, but for none, say too little of light to be asked for.
pub const LEAST_WALKS: u64 = 1 << 12;

impl Default for SolveSpec {
    fn default() -> SolveSpec {
        SolveSpec {
            solver: Solver::Hierarchical,
            form_factors: FormFactorMethod::Analytic { samples: 16 },
            patch_size: None,
            min_size: None,
            error: 1e-5,
            residual: 1e-4,
            max_steps: None,
            ambient: true,
            walks: 1 << 20,
            max_edges: None,
            discontinuities: false,
            contacts: false,
            curve_error: 0.02,
            gloss: Gloss::LeftOut,
            lit_only: false,
            max_patches: 4_000_000,
            seed: 0,
        }
    }
}

/// How far a solver has come; handed to an observer after each step.
pub struct Progress<'a> {
    /// From 1; 0 while nothing is solved yet, and what emits is all that is bright. A step may be shown again.
    pub step: u64,
    pub mesh: &'a PatchMesh,
    /// Per patch, in W/m², without the ambient term.
    pub radiosity: &'a [Rgb64],
    /// The ambient term: to be multiplied with a patch's reflectance and added for display; zero where a solver
    /// has none.
    pub ambient: Rgb64,
    /// Relative to the emitted power.
    pub residual: f64,
}

/// What a solution is known to be, and what it cost.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    pub patches: usize,
    pub links: usize,
    pub steps: u64,
    /// Whether the residual that was asked for was reached.
    pub converged: bool,
    /// Σ A |E + ρ e + ρ F B - B| over Σ A (E + ρ e), summed over the channels.
    pub residual: f64,
    /// W, per channel: emitted by patches and, in `external`, arriving from lights that are no patches.
    pub emitted: Rgb64,
    pub external: Rgb64,
    /// Taken in by surfaces, and lost from the scene: together what was emitted, up to the residual. What is lost
    /// is what patches give less what patches get, so that it has the error of the form factors: it may be
    /// somewhat below 0 in a closed scene. What goes through masks is neither there.
    pub absorbed: Rgb64,
    pub escaped: Rgb64,
    /// Share of the light that arrives at patches that they scatter in ways which radiosity leaves out.
    pub other: f64,
    /// How well the form factors keep what must hold of them; `None` of solvers that never have all of them.
    pub quality: Option<form_factors::Quality>,
    /// Sentences for the user: what was left out and why.
    pub warnings: Vec<String>,
    pub mesh_seconds: f64,
    pub form_factor_seconds: f64,
    pub solve_seconds: f64,
}

/// The radiosity of a scene.
#[derive(Debug)]
pub struct Solution {
    pub mesh: PatchMesh,
    /// B per patch in W/m².
    pub radiosity: Vec<Rgb64>,
    /// All irradiance per patch in W/m²: B = E + ρ irradiance.
    pub irradiance: Vec<Rgb64>,
    /// Of it, what comes straight from emitters.
    pub direct: Vec<Rgb64>,
    /// What the hierarchical solver linked; `None` of other solvers.
    pub hierarchy: Option<Hierarchy>,
    pub report: Report,
}

impl Solution {
    /// Irradiance of `patch` in W/m² that arrives after at least one diffuse reflection.
    pub fn indirect(&self, patch: u32) -> Rgb64 {
        let i = patch as usize;
        (self.irradiance[i] - self.direct[i]).max(Rgb64::ZERO)
    }
}

/// Why a scene has no solution.
#[derive(Clone, Debug, PartialEq)]
pub enum SolveError {
    /// Nothing reflects diffusely or shines.
    NoPatches,
    /// More patches than may be.
    TooManyPatches { patches: u64, limit: u64 },
    /// The matrix of a direct or gathering solver would not fit.
    TooLarge {
        solver: &'static str,
        patches: u64,
        bytes: u64,
    },
    /// A closed scene that absorbs nothing has no finite solution.
    NoAbsorption,
    /// The light that was found has grown beyond all numbers.
    Unbounded { solver: &'static str },
    /// The form factors of a patch sum to more than 1, so that its light grows though some is absorbed.
    Diverges {
        solver: &'static str,
        row_sum: f64,
        /// The largest reflectance of a patch.
        albedo: f64,
    },
}

impl fmt::Display for SolveError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SolveError::NoPatches => {
                f.write_str("no surface of the scene reflects diffusely or shines")
            }
            SolveError::TooManyPatches { patches, limit } => {
                match *patches {
                    u64::MAX => f.write_str("more patches than can be counted")?,
                    n => write!(f, "{n} patches")?,
                }
                write!(
                    f,
                    " are more than the {limit} that are allowed: make patches larger"
                )
            }
            SolveError::TooLarge {
                solver,
                patches,
                bytes,
            } => write!(
                f,
                "the solver {solver} needs {} MiB for the form factors of {patches} patches: make patches \
                 larger, or use the solver shooting or hierarchical",
                bytes >> 20
            ),
            SolveError::NoAbsorption => f.write_str(
                "the scene is closed and absorbs nothing: its radiosity grows without limit; give a surface a reflectance \
                 below 1, or leave an opening",
            ),
            SolveError::Unbounded { solver } => write!(
                f,
                "the solver {solver} does not converge: light grows without limit; use smaller errors or another \
                 number of walks"
            ),
            SolveError::Diverges {
                solver,
                row_sum,
                albedo,
            } => write!(
                f,
                "the solver {solver} does not converge: form factors of a patch sum to {row_sum:.6}, which a \
                 reflectance of {albedo} makes grow; use more samples, a higher resolution or the analytic form \
                 factors"
            ),
        }
    }
}

impl std::error::Error for SolveError {}

impl Solver {
    pub const ALL: [Solver; 5] = [
        Solver::Gauss,
        Solver::GaussSeidel,
        Solver::Jacobi,
        Solver::Shooting,
        Solver::Hierarchical,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Solver::Gauss => "gauss",
            Solver::GaussSeidel => "gauss-seidel",
            Solver::Jacobi => "jacobi",
            Solver::Shooting => "shooting",
            Solver::Hierarchical => "hierarchical",
        }
    }
}

impl FormFactorMethod {
    pub fn name(self) -> &'static str {
        match self {
            FormFactorMethod::Hemicube { .. } => "hemicube",
            FormFactorMethod::MonteCarlo { .. } => "montecarlo",
            FormFactorMethod::Analytic { .. } => "analytic",
        }
    }
}

/// The radiosity of `scene`. `observe` sees every step and may stop the work: what is done until then is the
/// result, with a report that says that it has not converged.
pub fn solve(
    scene: &Scene,
    spec: &SolveSpec,
    observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Solution, SolveError> {
    let dark = match spec.lit_only {
        true => DarkSides::of(scene, spec.seed),
        false => DarkSides::default(),
    };
    let cut = Cut {
        curve_error: spec.curve_error,
        gloss_as_diffuse: spec.gloss == Gloss::All,
        dark,
    };
    let surfaces = Arc::new(Surfaces::of(scene, cut));
    if surfaces.facets().is_empty() {
        return Err(SolveError::NoPatches);
    }
    match spec.solver {
        Solver::Hierarchical => {
            let mut solution = hierarchy::solve(scene, surfaces, spec, observe)?;
            // What reads it would spread it all over the picture.
            let mut found = solution.radiosity.iter().chain(&solution.irradiance);
            if !found.all(|x| x.is_finite()) {
                let solver = spec.solver.name();
                return Err(SolveError::Unbounded { solver });
            }
            let doubts = report::doubts(&solution.report, spec.residual);
            solution.report.warnings.extend(doubts);
            Ok(solution)
        }
        _ => solvers::solve(scene, surfaces, spec, observe),
    }
}

//! What the command line says, and what that means to solvers.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::cli::Failure;
use crate::cli::numbers::{positive, whole};
use crate::cli::progress::ProgressMode;
use crate::cli::render::parse_define;
use crate::radiosity::export::{Shading, Up};
use crate::radiosity::{FormFactorMethod, LEAST_WALKS, SolveSpec, Solver};
use crate::transport::IntegratorSpec;

#[derive(Args, Debug)]
pub struct RadiosityArgs {
    /// Scene file in Mitsuba's XML; without it, the scene built into the program
    pub scene: Option<PathBuf>,
    /// Mesh to write: .glb (glTF 2.0), .obj or .ply; may be given several times
    /// [default: SCENE.glb in the current folder]
    #[arg(short, long = "output", value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// How to solve [default: what the scene's integrator says, else hierarchical]
    #[arg(long, value_name = "NAME", value_parser = parse_solver)]
    pub solver: Option<Solver>,
    /// How the share of light that goes from patch to patch is found: not for the solver hierarchical
    /// [default: what the scene's integrator says, else analytic]
    #[arg(long, value_name = "NAME", value_enum)]
    pub form_factors: Option<Method>,
    /// Samples of each pair of patches, for form factors by montecarlo or analytic
    /// [default: what the scene's integrator says, else 16]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=1u32 << 20))]
    pub samples: Option<u32>,
    /// Pixels along the edge of a hemicube [default: what the scene's integrator says, else 128]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(2..=4096u32))]
    pub resolution: Option<u32>,
    /// Longest edge of a patch, in scene units [default: what the scene's integrator says, else what gives about
    /// 2,000 patches, 10,000 for shooting; for hierarchical a part of the scene]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive)]
    pub patch_size: Option<f64>,
    /// Shortest edge of a patch that the solver hierarchical makes, in scene units
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive)]
    pub min_size: Option<f64>,
    /// Greatest error of a link of the solver hierarchical, as a share of the light that is usual at its receiver, times the receiver's share of all area
    /// [default: what the scene's integrator says, else 1e-5]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive)]
    pub error: Option<f64>,
    /// Edges of random walks by which the solver hierarchical corrects what links bring; 0: it trusts links; else at least 4096
    /// [default: what the scene's integrator says, else 1048576]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(0..=1u64 << 26))]
    pub walks: Option<u64>,
    /// Residual relative to the emitted power at which solving ends
    /// [default: what the scene's integrator says, else 1e-4]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive)]
    pub residual: Option<f64>,
    /// Most steps: sweeps, or patches that shoot [default: what the scene's integrator says, else as many as the residual
    /// takes]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=u64::MAX))]
    pub max_steps: Option<u64>,
    /// Cut patches along the edges of shadows
    #[arg(long)]
    pub discontinuities: bool,
    /// Show in snapshots only light that the solver shooting has shot, without a guess at the rest
    #[arg(long, requires = "snapshots")]
    pub no_ambient: bool,
    /// Write statistics to this file, as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Write pictures of steps on the way, seen by the scene's camera, to this folder: EXR and PNG
    #[arg(long, value_name = "DIR")]
    pub snapshots: Option<PathBuf>,
    /// Steps to write pictures of; the result is always one
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "1,20,250", requires = "snapshots",
        allow_negative_numbers = true, value_parser = whole(1..=u64::MAX))]
    pub snapshot_steps: Vec<u64>,
    /// Samples per pixel of these pictures
    #[arg(long, value_name = "N", default_value_t = 16, requires = "snapshots",
        allow_negative_numbers = true, value_parser = whole(1..=u64::MAX))]
    pub snapshot_spp: u64,
    /// Colours of the mesh and of snapshots: one per patch, or interpolated between vertices
    #[arg(long, value_enum, default_value_t = Show::Gouraud)]
    pub show: Show,
    /// Colours of the mesh are radiance times this; glTF has none above 1
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true, value_parser = positive)]
    pub exposure: f64,
    /// Which way is up in the scene: viewers of glTF want to know
    #[arg(long, value_enum, default_value_t = Axis::Y)]
    pub up: Axis,
    /// Set a parameter of the scene that it names with <default>
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_define)]
    pub define: Vec<(String, String)>,
    /// Threads to solve with [default: one per processor]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=u16::MAX))]
    pub threads: Option<u16>,
    /// How to show progress
    #[arg(long, value_enum, default_value_t = ProgressMode::Auto)]
    pub progress: ProgressMode,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    Hemicube,
    Montecarlo,
    Analytic,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Show {
    Flat,
    Gouraud,
}

impl From<Show> for Shading {
    fn from(show: Show) -> Shading {
        match show {
            Show::Flat => Shading::Flat,
            Show::Gouraud => Shading::Gouraud,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    Y,
    Z,
}

impl From<Axis> for Up {
    fn from(axis: Axis) -> Up {
        match axis {
            Axis::Y => Up::Y,
            Axis::Z => Up::Z,
        }
    }
}

fn parse_solver(text: &str) -> Result<Solver, String> {
    let known = Solver::ALL.map(Solver::name);
    let found = Solver::ALL.into_iter().find(|s| s.name() == text);
    found.ok_or_else(|| format!("expected one of {}", known.join(", ")))
}

/// Samples and resolution where nothing asks for others: those of the scene language.
const SAMPLES: u32 = 16;
const RESOLUTION: u32 = 128;

impl RadiosityArgs {
    /// What is to be solved, beginning with what the scene's integrator says of it.
    ///
    /// # Errors
    /// Arguments that would have no effect together with others.
    pub fn spec(&self, integrator: &IntegratorSpec) -> Result<SolveSpec, Failure> {
        let base = super::of_scene(integrator).unwrap_or_default();
        let solver = self.solver.unwrap_or(base.solver);
        let hierarchical = solver == Solver::Hierarchical;
        let given = [
            ("--min-size", self.min_size.is_some(), hierarchical),
            ("--error", self.error.is_some(), hierarchical),
            ("--walks", self.walks.is_some(), hierarchical),
            ("--form-factors", self.form_factors.is_some(), !hierarchical),
            ("--samples", self.samples.is_some(), !hierarchical),
            ("--resolution", self.resolution.is_some(), !hierarchical),
            ("--no-ambient", self.no_ambient, solver == Solver::Shooting),
        ];
        if let Some((name, ..)) = given.iter().find(|(_, given, works)| *given && !works) {
            let what = format!("{name} has no effect with the solver {}", solver.name());
            return Err(Failure::Usage(what));
        }
        if self.walks.is_some_and(|n| (1..LEAST_WALKS).contains(&n)) {
            let what = format!("--walks: so few say too little, give 0 or at least {LEAST_WALKS}");
            return Err(Failure::Usage(what));
        }
        Ok(SolveSpec {
            solver,
            form_factors: self.form_factors(base.form_factors)?,
            patch_size: self.patch_size.or(base.patch_size),
            min_size: self.min_size.or(base.min_size),
            error: self.error.unwrap_or(base.error),
            walks: self.walks.unwrap_or(base.walks),
            residual: self.residual.unwrap_or(base.residual),
            max_steps: self.max_steps.or(base.max_steps),
            ambient: !self.no_ambient,
            discontinuities: self.discontinuities || base.discontinuities,
            ..base
        })
    }

    fn form_factors(&self, base: FormFactorMethod) -> Result<FormFactorMethod, Failure> {
        let (mut samples, mut resolution) = (SAMPLES, RESOLUTION);
        let own = match base {
            FormFactorMethod::Hemicube { resolution: r } => {
                resolution = r;
                Method::Hemicube
            }
            FormFactorMethod::MonteCarlo { samples: n } => {
                samples = n;
                Method::Montecarlo
            }
            FormFactorMethod::Analytic { samples: n } => {
                samples = n;
                Method::Analytic
            }
        };
        let method = self.form_factors.unwrap_or(own);
        let unused = match method {
            Method::Hemicube => self.samples.is_some().then_some("--samples"),
            _ => self.resolution.is_some().then_some("--resolution"),
        };
        let samples = self.samples.unwrap_or(samples);
        let method = match method {
            Method::Hemicube => FormFactorMethod::Hemicube {
                resolution: self.resolution.unwrap_or(resolution),
            },
            Method::Montecarlo => FormFactorMethod::MonteCarlo { samples },
            Method::Analytic => FormFactorMethod::Analytic { samples },
        };
        match unused {
            None => Ok(method),
            Some(name) => Err(Failure::Usage(format!(
                "{name} has no effect with form factors by {}",
                method.name()
            ))),
        }
    }
}

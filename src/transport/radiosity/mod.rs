//! Radiosity seen by the camera's walk: shown as it is ([`view`]), or read in place of long walks ([`gather`]).
//!
//! The solution is independent of the view. It is made once, when the first iteration begins, by all threads of
//! the pool, and read where the walk meets a *matte* surface: one whose lobes, but for delta ones, are all diffuse
//! ([`Bsdf::is_matte`](crate::bsdf::Bsdf::is_matte)). What is read is irradiance; the surface's own reflectance at
//! the hit turns it into radiance, so textures stay sharp.
//!
//! Only surfaces that stand still have patches. What moves receives light from the solution, but sends it none:
//! light that comes by way of a moving surface is left out of it, and what moves casts the shadows in it that it
//! has when the shutter opens. Light straight from emitters is never read where walks find it themselves, so it
//! is right at all times, and so is all that is seen in mirrors and through glass.

mod gather;
mod guide;
mod pilot;
mod solved;
mod view;

pub use gather::Bias;
pub(super) use gather::{CachedPath, Reader, Reads};
pub(super) use guide::{Guided, Guiding};
pub use solved::Solved;
pub(super) use solved::{Cache, Solving, Use};
pub(super) use view::View;

use super::PathSpec;
use super::path::UNBOUNDED;
use crate::radiosity::{Gloss, SolveSpec};
use crate::scene::{PlanEntry, Scene};

/// What a path tracer does with the light that diffuse surfaces send each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Indirect {
    /// Finds it by itself.
    #[default]
    None,
    /// Reads it from the radiosity where a walk that a matte surface has scattered meets the next: biased.
    Gather,
    /// Sends its walks where the radiosity says that light comes from: unbiased.
    Guide,
}

impl Indirect {
    pub const ALL: [Indirect; 3] = [Indirect::None, Indirect::Gather, Indirect::Guide];

    pub fn name(self) -> &'static str {
        match self {
            Indirect::None => "none",
            Indirect::Gather => "gather",
            Indirect::Guide => "guide",
        }
    }
}

/// The use that a path tracer makes of radiosity.
#[derive(Clone, Debug, PartialEq)]
pub struct CacheSpec {
    pub indirect: Indirect,
    pub solve: SolveSpec,
    /// What is read, if it is known already.
    pub given: Option<Solved>,
    /// Whether walks are guided also where a few that are tried before say that it does not pay.
    pub always: bool,
}

impl Default for CacheSpec {
    fn default() -> CacheSpec {
        CacheSpec {
            indirect: Indirect::None,
            solve: SolveSpec {
                error: GATHER_ERROR,
                walks: CACHE_WALKS,
                lit_only: true,
                contacts: true,
                gloss: Gloss::All,
                ..SolveSpec::default()
            },
            given: None,
            always: false,
        }
    }
}

/// Error of a link that is good enough behind a final gather, where walks put links right.
const GATHER_ERROR: f64 = 1e-2;
/// Edges of these walks: what is read is averaged over many patches.
const CACHE_WALKS: u64 = 1 << 19;

/// Path tracing with radiosity to help it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CachedSpec {
    pub path: PathSpec,
    pub cache: CacheSpec,
}

/// How radiosity is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Show {
    /// Each patch by its own irradiance: the patches are seen.
    Flat,
    /// By irradiance interpolated between vertices that patches share (Gouraud 1971).
    Gouraud,
    /// By what is sent to the point that is seen: light straight from emitters is sampled, and a ray for the rest
    /// reads the irradiance where it ends.
    #[default]
    Gather,
}

impl Show {
    pub const ALL: [Show; 3] = [Show::Flat, Show::Gouraud, Show::Gather];

    pub fn name(self) -> &'static str {
        match self {
            Show::Flat => "flat",
            Show::Gouraud => "gouraud",
            Show::Gather => "gather",
        }
    }
}

/// Settings of the integrator that shows radiosity.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RadiositySpec {
    /// Of the walk by mirrors, glass and gloss to what is shown; radiosity itself has light of any number of
    /// edges.
    pub path: PathSpec,
    pub solve: SolveSpec,
    pub show: Show,
    /// What is shown, if it is known already.
    pub given: Option<Solved>,
}

/// Edges of the shortest path whose light is read from a cache: emitter, a diffuse surface that scatters before it
/// is read, the one where it is read, the one that is seen, the eye.
const CACHED_EDGES: u32 = 4;

/// Greatest error of a link where radiosity guides walks (see [`SolveSpec::error`]).
pub const GUIDE_ERROR: f64 = 1e-3;

impl CacheSpec {
    /// What is made of light between diffuse surfaces, with a solution as good as that needs.
    pub fn of(indirect: Indirect) -> CacheSpec {
        let mut solve = CacheSpec::default().solve;
        if indirect == Indirect::Guide {
            solve.error = GUIDE_ERROR;
        }
        CacheSpec {
            indirect,
            solve,
            given: None,
            always: false,
        }
    }

    /// Whether there is anything to read in `scene` for walks of `path`; if not, why.
    pub fn is_used(&self, scene: &Scene, path: &PathSpec) -> Result<(), &'static str> {
        if self.indirect == Indirect::None {
            return Err("it is not asked for");
        }
        if path.max_depth.unwrap_or(UNBOUNDED) < CACHED_EDGES {
            return Err("paths are too short: it takes four edges");
        }
        scene.exchanges_diffuse_light()
    }

    /// What is done about light between diffuse surfaces, and why.
    pub fn plan(&self, scene: &Scene, path: &PathSpec) -> Option<PlanEntry> {
        if self.indirect == Indirect::None {
            return None;
        }
        Some(entry(self.is_used(scene, path), scene, || {
            let solver = self.solve.solver.name();
            let used = match self.indirect {
                Indirect::Guide => {
                    "sends walks from diffuse surfaces where their light comes from, unless walks tried before say that it \
                     does not pay"
                }
                _ => "read where a walk meets a second diffuse surface",
            };
            format!("solved once (solver {solver}), {used}")
        }))
    }
}

impl RadiositySpec {
    /// What is done in `scene`, and why.
    pub fn plan(&self, scene: &Scene) -> PlanEntry {
        entry(view::is_used(scene), scene, || {
            let solver = self.solve.solver.name();
            format!("solved once (solver {solver}), shown {}", self.show.name())
        })
    }
}

/// The plan's entry on radiosity.
fn entry(
    used: Result<(), &'static str>,
    scene: &Scene,
    decision: impl FnOnce() -> String,
) -> PlanEntry {
    let (decision, reason) = match used {
        Ok(()) => (
            decision(),
            "diffuse surfaces light each other".to_string() + lost(scene),
        ),
        Err(why) => ("none, nothing is solved".to_string(), why.to_string()),
    };
    PlanEntry {
        subject: "radiosity",
        decision,
        reason,
    }
}

/// What radiosity leaves out in `scene`, for the plan.
fn lost(scene: &Scene) -> &'static str {
    match (
        scene.throws_caustics().is_ok() || scene.is_glossy(),
        scene.moves(),
    ) {
        (false, false) => "",
        (true, false) => {
            "; what mirrors, glass and gloss send to diffuse surfaces is found only roughly, or lost"
        }
        (false, true) => "; light by way of moving surfaces is left out of it",
        (true, true) => {
            "; what mirrors, glass, gloss and moving surfaces send to diffuse surfaces is found only roughly, or lost"
        }
    }
}

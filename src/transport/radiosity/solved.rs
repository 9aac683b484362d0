//! The solution: made once, and read by many threads.

use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use super::{CacheSpec, Indirect};
use crate::geom::Hit;
use crate::math::Rgb;
use crate::radiosity::{
    self, Display, Gloss, Guide, Progress, Report, Rgb64, Solution, SolveError, SolveSpec,
};
use crate::scene::Scene;
use crate::transport::PathSpec;

/// A solution that is known already. Two are equal if they are the same one.
#[derive(Clone, Debug)]
pub struct Solved(pub Arc<Solution>);

impl PartialEq for Solved {
    fn eq(&self, other: &Solved) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// A solution in the form that walks read.
pub struct Cache {
    solution: Arc<Solution>,
    /// Irradiance of each patch in W/m²: all of it, and what diffuse surfaces have reflected before.
    total: Vec<Rgb>,
    reflected: Vec<Rgb>,
    /// The same between vertices; `None` where patches are to be seen.
    smooth: Option<Smooth>,
    /// Squared distance from a patch, in scene units, within which its irradiance is too coarse to be seen.
    near2: Vec<f32>,
    /// Where light comes from, if walks are guided.
    pub guide: Option<Guide>,
}

/// Irradiance interpolated between the vertices of patches.
struct Smooth {
    display: Display,
    total: Vec<Rgb64>,
    reflected: Vec<Rgb64>,
}

/// What a solution is made ready for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Irradiance is read, the same all over a patch.
    Flat,
    /// Irradiance is read, interpolated within surfaces.
    Smooth,
    /// Walks are guided.
    Guide,
}

/// What is read at a hit.
pub struct Read {
    /// In W/m².
    pub irradiance: Rgb,
    /// Squared distance from which on that is good enough.
    pub near2: f32,
}

impl Cache {
    pub fn new(solution: Arc<Solution>, scene: &Scene, made_for: Use) -> Cache {
        let diagonal = scene.world().bounds().diagonal().length();
        let most = (NEAR * diagonal).powi(2);
        let patches = 0..solution.mesh.len() as u32;
        let reflected: Vec<Rgb64> = patches.map(|i| solution.indirect(i)).collect();
        let interpolated = || {
            let display = Display::new(scene, &solution.mesh);
            Smooth {
                total: display.vertex_values(&solution.irradiance),
                reflected: display.vertex_values(&reflected),
                display,
            }
        };
        Cache {
            smooth: (made_for == Use::Smooth).then(interpolated),
            guide: match made_for {
                Use::Guide => Guide::new(scene, Arc::clone(&solution)),
                _ => None,
            },
            total: solution.irradiance.iter().map(|e| rgb(*e)).collect(),
            reflected: reflected.iter().map(|e| rgb(*e)).collect(),
            near2: (solution.mesh.patches.iter())
                .map(|p| most.min(p.area as f32))
                .collect(),
            solution,
        }
    }

    /// All irradiance at `hit`; `None` where the surface has no patch.
    #[inline]
    pub fn total(&self, hit: &Hit) -> Option<Read> {
        self.read(hit, &self.total, |smooth| &smooth.total)
    }

    /// The same without light straight from emitters.
    #[inline]
    pub fn reflected(&self, hit: &Hit) -> Option<Read> {
        self.read(hit, &self.reflected, |smooth| &smooth.reflected)
    }

    #[inline]
    fn read(&self, hit: &Hit, flat: &[Rgb], smooth: fn(&Smooth) -> &[Rgb64]) -> Option<Read> {
        let mesh = &self.solution.mesh;
        let at = mesh.locate(hit)?;
        let patch = at.patch as usize;
        Some(Read {
            irradiance: match &self.smooth {
                Some(by) => rgb(by.display.at(mesh, smooth(by), at)),
                None => flat[patch],
            },
            near2: self.near2[patch],
        })
    }
}

fn rgb(c: Rgb64) -> Rgb {
    Rgb::from_array(c.to_array().map(|v| v.max(0.0) as f32))
}

/// A patch is never too coarse from further away than this share of the scene's diagonal, however large it is: it is
/// only large where its light hardly changes.
const NEAR: f32 = 0.02;

/// A solution to be made when it is asked for first.
pub struct Solving<'a> {
    scene: &'a Scene,
    spec: &'a SolveSpec,
    given: Option<&'a Solved>,
    made_for: Use,
    /// Whether light from emitters by mirrors and gloss is left out of the solution, since photons bring it.
    beside_photons: bool,
    /// See [`SolveSpec::max_edges`].
    max_edges: Option<u32>,
    made: OnceLock<Result<Option<Cache>, SolveError>>,
}

impl<'a> Solving<'a> {
    pub fn new(
        scene: &'a Scene,
        spec: &'a SolveSpec,
        given: Option<&'a Solved>,
        made_for: Use,
    ) -> Solving<'a> {
        Solving {
            made_for,
            beside_photons: false,
            max_edges: spec.max_edges,
            scene,
            spec,
            given,
            made: OnceLock::new(),
        }
    }

    /// What a path tracer makes of radiosity.
    pub fn of(scene: &'a Scene, cache: &'a CacheSpec, path: &PathSpec) -> Solving<'a> {
        let made_for = match cache.indirect {
            Indirect::Guide => Use::Guide,
            // A final gather sees no single patch.
            Indirect::None | Indirect::Gather => Use::Flat,
        };
        // From the eye to where it is read, by the shortest way, a path has two edges.
        let max_edges = path.max_depth.map(|depth| depth.saturating_sub(2).max(1));
        Solving {
            max_edges: cache.solve.max_edges.or(max_edges),
            ..Solving::new(scene, &cache.solve, cache.given.as_ref(), made_for)
        }
    }

    /// The same without light by mirrors and gloss where it is read: what photons bring must not be read too.
    pub fn beside_photons(self) -> Solving<'a> {
        Solving {
            beside_photons: self.made_for != Use::Guide,
            ..self
        }
    }

    /// Solves, on all threads of the current pool, unless that is done. `observe` sees every step and may stop the
    /// work. Seconds that it took on the clock.
    pub fn prepare(
        &self,
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<f64, SolveError> {
        let start = Instant::now();
        match self.made.get_or_init(|| self.make(observe)) {
            Ok(_) => Ok(start.elapsed().as_secs_f64()),
            Err(error) => Err(error.clone()),
        }
    }

    /// Solves nothing, unless that is done: there is then nothing to read.
    pub fn skip(&self) {
        let _ = self.made.get_or_init(|| Ok(None));
    }

    /// Edges of walks that solving takes.
    pub fn walks(&self) -> u64 {
        self.spec.walks
    }

    /// Whether the solution, or that there is none, is known already.
    pub fn is_settled(&self) -> bool {
        self.given.is_some() || self.made.get().is_some()
    }

    fn make(
        &self,
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Option<Cache>, SolveError> {
        let solution = match self.given {
            Some(Solved(solution)) => Arc::clone(solution),
            None => match radiosity::solve(self.scene, &self.to_solve(), observe) {
                Ok(solution) => Arc::new(solution),
                // Nothing to read: walks find all light by themselves.
                Err(SolveError::NoPatches) => return Ok(None),
                Err(error) => return Err(error),
            },
        };
        let cache = Cache::new(solution, self.scene, self.made_for);
        // Without links, nothing to be guided by.
        Ok((self.made_for != Use::Guide || cache.guide.is_some()).then_some(cache))
    }

    fn to_solve(&self) -> SolveSpec {
        let gloss = match self.spec.gloss {
            Gloss::All if self.beside_photons => Gloss::BetweenDiffuse,
            other => other,
        };
        SolveSpec {
            gloss,
            max_edges: self.max_edges,
            ..self.spec.clone()
        }
    }

    /// The solution, once [`Solving::prepare`] has made it; `None` where there is nothing to read.
    #[inline]
    pub fn get(&self) -> Option<&Cache> {
        self.made.get()?.as_ref().ok()?.as_ref()
    }

    /// The solution itself, once it is made.
    pub fn solution(&self) -> Option<Solved> {
        self.get().map(|cache| Solved(Arc::clone(&cache.solution)))
    }

    /// What the solution is known to be.
    pub fn report(&self) -> Option<&Report> {
        self.get().map(|cache| &cache.solution.report)
    }
}

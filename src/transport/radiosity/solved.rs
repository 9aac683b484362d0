//! The solution: made once, and read by many threads.

use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use super::{CacheSpec, Indirect};
use crate::geom::Hit;
use crate::math::Rgb;
use crate::radiosity::{self, Guide, Progress, Report, Rgb64, Solution, SolveError, SolveSpec};
use crate::scene::Scene;

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
    /// Squared distance from a patch, in scene units, within which its irradiance is too coarse to be seen.
    near2: Vec<f32>,
    /// Where light comes from, if walks are to be guided.
    pub guide: Option<Guide>,
}

/// What is read at a hit.
pub struct Read {
    /// In W/m².
    pub irradiance: Rgb,
    /// Squared distance from which on that is good enough.
    pub near2: f32,
}

impl Cache {
    pub fn new(solution: Arc<Solution>, scene: &Scene, guides: bool) -> Cache {
        let rgb = |c: Rgb64| Rgb::from_array(c.to_array().map(|v| v.max(0.0) as f32));
        let diagonal = scene.world().bounds().diagonal().length();
        let most = (NEAR * diagonal).powi(2);
        Cache {
            total: solution.irradiance.iter().map(|e| rgb(*e)).collect(),
            reflected: (0..solution.mesh.len() as u32)
                .map(|i| rgb(solution.indirect(i)))
                .collect(),
            near2: (solution.mesh.patches.iter())
                .map(|p| most.min(p.area as f32))
                .collect(),
            guide: match guides {
                true => Guide::new(scene, Arc::clone(&solution)),
                false => None,
            },
            solution,
        }
    }

    /// All irradiance at `hit`; `None` where the surface has no patch.
    #[inline]
    pub fn total(&self, hit: &Hit) -> Option<Read> {
        self.read(hit, &self.total)
    }

    /// The same without light straight from emitters.
    #[inline]
    pub fn reflected(&self, hit: &Hit) -> Option<Read> {
        self.read(hit, &self.reflected)
    }

    #[inline]
    fn read(&self, hit: &Hit, values: &[Rgb]) -> Option<Read> {
        let patch = self.solution.mesh.locate(hit)?.patch as usize;
        Some(Read {
            irradiance: values[patch],
            near2: self.near2[patch],
        })
    }
}

/// A patch is never too coarse from further away than this share of the scene's diagonal, however large it is: it is
/// only large where its light hardly changes.
const NEAR: f32 = 0.02;

/// A solution to be made when it is asked for first.
pub struct Solving<'a> {
    scene: &'a Scene,
    spec: &'a SolveSpec,
    given: Option<&'a Solved>,
    guides: bool,
    made: OnceLock<Result<Option<Cache>, SolveError>>,
}

impl<'a> Solving<'a> {
    pub fn new(scene: &'a Scene, spec: &'a SolveSpec, given: Option<&'a Solved>) -> Solving<'a> {
        Solving {
            scene,
            spec,
            given,
            guides: false,
            made: OnceLock::new(),
        }
    }

    /// What `cache` asks for.
    pub fn of(scene: &'a Scene, cache: &'a CacheSpec) -> Solving<'a> {
        Solving {
            guides: cache.indirect == Indirect::Guide,
            ..Solving::new(scene, &cache.solve, cache.given.as_ref())
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

    fn make(
        &self,
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Option<Cache>, SolveError> {
        let solution = match self.given {
            Some(Solved(solution)) => Arc::clone(solution),
            None => match radiosity::solve(self.scene, self.spec, observe) {
                Ok(solution) => Arc::new(solution),
                // Nothing to read: walks find all light by themselves.
                Err(SolveError::NoPatches) => return Ok(None),
                Err(error) => return Err(error),
            },
        };
        Ok(Some(Cache::new(solution, self.scene, self.guides)))
    }

    /// The solution, once [`Solving::prepare`] has made it; `None` where there is nothing to read.
    #[inline]
    pub fn get(&self) -> Option<&Cache> {
        self.made.get()?.as_ref().ok()?.as_ref()
    }

    /// What the solution is known to be.
    pub fn report(&self) -> Option<&Report> {
        self.get().map(|cache| &cache.solution.report)
    }
}

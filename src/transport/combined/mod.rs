//! Path tracing that leaves caustics to photons.
//!
//! Let S be a scattering by a delta lobe (mirrors, smooth glass and coats) and D by any other. Every path of
//! light L … E belongs to one of two estimators:
//!
//! | path | found by |
//! | --- | --- |
//! | L S* E | the walk from the eye, which meets the emitter |
//! | L D …, the first D at x | next-event estimation at x, and the walk, weighted against each other |
//! | L S+ D …, the D at x | photons around x, wherever on the eye's walk x lies |
//!
//! So the walk drops emission that it meets by delta lobes alone after another one scattered it. Whether a
//! scattering is S is decided by the lobe that was sampled, in the walks of eye and light alike: a surface with
//! both kinds of lobes stores photons, and sends them on.
//!
//! Photons are gathered within a disk that shrinks from iteration to iteration (Knaus & Zwicker 2011), so the
//! picture is biased, and the bias vanishes. Emitters that no ray can meet (points, beams) throw caustics too,
//! which a path tracer alone misses.

mod caustics;

pub(super) use caustics::{Caustics, Gathering, caustic};

use super::light_walk::LightWalk;
use super::mis::Techniques;
use super::path::{Start, UNBOUNDED};
use super::photons::{self, Kernel, KernelShape, PhotonMap, Shoot};
use super::radiosity::{Cache, Guided, Guiding, Reader, Reads, Solving};
use super::{CacheSpec, Iteration, Ledger, Li, PathSpec, PhotonSpec, Setting, Technique};
use crate::geom::Ray;
use crate::light::Aim;
use crate::sampler::Sampler;
use crate::scene::{PlanEntry, Scene};

/// Who finds caustics, and what else is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// All light, caustics by photons.
    All,
    /// All light, caustics by the walk as a path tracer does.
    AllByPath,
    /// Caustics by photons, and nothing else.
    CausticsAlone,
    /// All but caustics.
    WithoutCaustics,
}

/// Settings of the path tracer with caustic photons.
#[derive(Clone, Debug, PartialEq)]
pub struct CombinedSpec {
    pub path: PathSpec,
    pub photons: PhotonSpec,
    pub show: Show,
    /// Of the light between diffuse surfaces; read only where all light is shown.
    pub cache: CacheSpec,
}

impl Default for CombinedSpec {
    fn default() -> CombinedSpec {
        CombinedSpec {
            path: PathSpec::default(),
            photons: PhotonSpec::default(),
            show: Show::All,
            cache: CacheSpec::default(),
        }
    }
}

impl CombinedSpec {
    /// Whether photons are shot in `scene`.
    pub fn shoots(&self, scene: &Scene) -> bool {
        let longest = self.path.max_depth.unwrap_or(UNBOUNDED);
        // Light, delta lobe, receiver, eye.
        let long_enough = longest >= 3;
        self.show != Show::AllByPath && long_enough && scene.throws_caustics().is_ok()
    }

    /// What is done about caustics in `scene`, and why.
    pub fn plan(&self, scene: &Scene) -> PlanEntry {
        let subject = "caustics";
        let (decision, reason) = match scene.throws_caustics() {
            _ if self.show == Show::AllByPath => {
                ("found by the path tracer", "photons are switched off")
            }
            Err(why) => ("none, no photon is shot", why),
            Ok(()) if !self.shoots(scene) => (
                "none, no photon is shot",
                "paths are too short: a caustic takes three edges",
            ),
            Ok(()) => (
                "photons in every iteration, in place of the path tracer's",
                "a surface has a delta lobe, and another receives its light",
            ),
        };
        let aimed = match self.shoots(scene) && scene.aim_at_caustics().share > 0.0 {
            true => ", aimed at what throws them",
            false => "",
        };
        PlanEntry {
            subject,
            decision: format!("{decision}{aimed}"),
            reason: reason.to_string(),
        }
    }
}

/// The path tracer with caustic photons at work on a scene where photons are shot.
pub struct Combined<'a> {
    spec: &'a CombinedSpec,
    setting: Setting<'a>,
    aim: Aim,
    /// Walks of light per iteration.
    count: u64,
    /// Of the first iteration.
    radius: f32,
    /// `None` where no cache is read.
    pub solving: Option<Solving<'a>>,
}

impl<'a> Combined<'a> {
    pub fn new(spec: &'a CombinedSpec, setting: Setting<'a>) -> Combined<'a> {
        let crop = setting.film.crop;
        let pixels = u64::from(crop.width) * u64::from(crop.height);
        let radius = match spec.photons.radius {
            Some(radius) => radius,
            None => RADIUS_IN_PIXELS * photons::footprint(&setting),
        };
        let cache = &spec.cache;
        let used = spec.show == Show::All && cache.is_used(setting.scene, &spec.path).is_ok();
        Combined {
            spec,
            setting,
            solving: used.then(|| Solving::of(setting.scene, cache, &spec.path).beside_photons()),
            aim: setting.scene.aim_at_caustics(),
            count: spec.photons.count.unwrap_or(pixels),
            radius,
        }
    }

    /// Of the disk that photons of iteration `number` are gathered from.
    pub fn radius(&self, number: u64) -> f32 {
        photons::reduced(self.radius, self.spec.photons.alpha, number)
    }

    /// Whether the photons of an iteration fit into the memory that they may take; if not, what is wrong.
    pub fn fits(&self) -> Result<(), String> {
        let shoot = self.shoot(0, 0.0);
        shoot.check(self.spec.photons.memory, "photon_count", caustic)
    }

    fn shoot(&self, number: u64, time: f32) -> Shoot<'_> {
        Shoot {
            setting: self.setting,
            walk: LightWalk {
                scene: self.setting.scene,
                aim: &self.aim,
                techniques: Techniques::default(),
                // One edge is left for the eye.
                max_edges: self.spec.path.max_depth.unwrap_or(UNBOUNDED) - 1,
                specular_only: true,
            },
            count: self.count,
            iteration: number,
            time,
        }
    }

    /// Shoots the photons of iteration `number`.
    pub fn begin(&self, number: u64, ledger: &mut Ledger) -> Iteration {
        let time = self.setting.common_time(number);
        if self.spec.show == Show::WithoutCaustics {
            return Iteration {
                time,
                ..Iteration::default()
            };
        }
        let radius = self.radius(number);
        let shoot = self.shoot(number, time.unwrap_or(0.0));
        let (photons, _) = shoot.trace(ledger, caustic);
        Iteration {
            time,
            caustics: Some(Caustics {
                map: ledger.build_map(|| PhotonMap::new(photons, radius)),
                kernel: Kernel::new(KernelShape::Epanechnikov, radius),
                share: 1.0 / self.count.max(1) as f32,
            }),
            ..Iteration::default()
        }
    }

    /// One sample of the radiance along `ray`.
    #[inline]
    pub fn sample(
        &self,
        iteration: &Iteration,
        ray: Ray,
        sampler: &Sampler,
        ledger: &mut Ledger,
    ) -> Li {
        let path = &self.spec.path;
        if let Some(cache) = self.solving.as_ref().and_then(Solving::get) {
            return self.sample_cached(cache, iteration, ray, sampler, ledger);
        }
        let mut gathering = Gathering {
            caustics: iteration.caustics.as_ref(),
            max_depth: path.max_depth.unwrap_or(UNBOUNDED),
            alone: self.spec.show == Show::CausticsAlone,
            found: Default::default(),
        };
        let (scene, start) = (self.setting.scene, Start::at_camera(ray));
        let li = path.walk(scene, start, sampler, &mut ledger.rays, &mut gathering);
        ledger.record(Technique::Merging, gathering.found);
        ledger.record(Technique::Path, li.radiance - gathering.found);
        li
    }

    /// The same with a cache of light between diffuse surfaces.
    #[inline]
    fn sample_cached(
        &self,
        cache: &Cache,
        iteration: &Iteration,
        ray: Ray,
        sampler: &Sampler,
        ledger: &mut Ledger,
    ) -> Li {
        let (scene, path) = (self.setting.scene, &self.spec.path);
        if let Some(guide) = &cache.guide {
            let gathering = Gathering {
                caustics: iteration.caustics.as_ref(),
                max_depth: path.max_depth.unwrap_or(UNBOUNDED),
                alone: false,
                found: Default::default(),
            };
            let mut guiding = Guiding::new(scene, guide, gathering, Guided::Everywhere);
            let start = Start::at_camera(ray);
            let li = path.walk(scene, start, sampler, &mut ledger.rays, &mut guiding);
            let found = guiding.gather.found;
            ledger.record(Technique::Merging, found);
            ledger.record(Technique::Path, li.radiance - found);
            return li;
        }
        let mut reader = Reader::<true>::new(scene, path, Some(cache), Reads::ReflectedBehind);
        reader.caustics = iteration.caustics.as_ref();
        let start = Start::at_camera(ray);
        let li = path.walk(scene, start, sampler, &mut ledger.rays, &mut reader);
        ledger.fresh_bias = reader.bias;
        ledger.record(Technique::Merging, reader.found);
        ledger.record(Technique::Path, li.radiance - reader.found);
        li
    }
}

/// Radius of the first iteration's disk in pixels.
const RADIUS_IN_PIXELS: f32 = 2.0;

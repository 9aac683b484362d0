//! Photon mapping (Jensen 1996; Jensen 2001, "Realistic Image Synthesis Using Photon Mapping").
//!
//! Where the camera's walk first meets a lobe that is not a delta one, light is found in classes (S: scattered
//! by a delta lobe, D: by any other):
//!
//! - straight from an emitter: by sampling emitters and the BSDF, weighted against each other;
//! - from an emitter by delta lobes alone (L S+ D): from the photons of the *caustic map* around the point;
//! - scattered by any other lobe before: by a *final gather*. Rays go out by the BSDF, and where they meet the
//!   next such surface, the photons of the *global map* around that point tell the radiance that leaves it.
//!
//! Where a gathering ray ends within the disk that photons would be taken from, that disk reaches around a
//! corner; there the walk goes on instead, as if it had begun at that point.
//!
//! The number of photons is fixed, so the picture keeps a bias however many samples are taken: it is blurred by
//! the disks that photons are taken from, and vanishes with their number. In a still scene all samples share one
//! pair of maps; where something moves each iteration has its own, at a moment of its own.

mod gather;
mod maps;

pub(super) use maps::Maps;

use std::sync::{Arc, OnceLock};

use super::path::{Start, UNBOUNDED};
use super::{Iteration, Ledger, Li, PathSpec, Setting};
use crate::geom::Ray;
use crate::light::Aim;
use crate::sampler::Sampler;
use crate::scene::{PlanEntry, Scene};
use gather::FirstVertex;

/// Settings of the photon mapper; defaults are those of Mitsuba 0.6.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotonMapperSpec {
    /// Of the camera's walk.
    pub path: PathSpec,
    /// Light samples where the camera's walk first scatters, at least 1.
    pub direct_samples: u32,
    /// Gathering rays from there, where the surface is diffuse; 0 leaves out what they would find.
    pub gather_samples: u32,
    /// The same for other surfaces.
    pub glossy_samples: u32,
    /// Photons to be kept in the map of all light.
    pub global_photons: u64,
    /// Photons to be kept in the map of caustics.
    pub caustic_photons: u64,
    /// Most distance of photons from where they are gathered, relative to the radius of the scene's sphere.
    pub global_radius: f32,
    pub caustic_radius: f32,
    /// Photons that are gathered at once, if as many lie within that distance.
    pub global_lookup: u32,
    pub caustic_lookup: u32,
    /// Bytes that both maps may take.
    pub memory: u64,
}

impl Default for PhotonMapperSpec {
    fn default() -> PhotonMapperSpec {
        PhotonMapperSpec {
            path: PathSpec::default(),
            direct_samples: 16,
            gather_samples: 32,
            glossy_samples: 32,
            global_photons: 250_000,
            caustic_photons: 250_000,
            global_radius: 0.05,
            caustic_radius: 0.0125,
            global_lookup: 120,
            caustic_lookup: 120,
            memory: 4 << 30,
        }
    }
}

impl PhotonMapperSpec {
    /// Whether both maps fit into the memory that they may take; if not, what is wrong.
    pub fn fits(&self) -> Result<(), String> {
        let photons = self.global_photons.saturating_add(self.caustic_photons);
        let needed = maps::bytes(photons);
        match needed <= self.memory {
            true => Ok(()),
            false => Err(format!(
                "maps of {photons} photons may take {} MiB, and \"memory\" allows {}",
                needed >> 20,
                self.memory >> 20
            )),
        }
    }

    /// What is done about caustics in `scene`, and why.
    pub fn plan(&self, scene: &Scene) -> PlanEntry {
        let (decision, reason) = match scene.throws_caustics() {
            Err(why) => ("a global map only", why),
            Ok(()) => (
                "a map of caustics and a global one",
                "a surface has a delta lobe, and another receives its light",
            ),
        };
        PlanEntry {
            subject: "photon maps",
            decision: decision.to_string(),
            reason: reason.to_string(),
        }
    }
}

/// The photon mapper at work.
pub struct PhotonMapper<'a> {
    spec: &'a PhotonMapperSpec,
    setting: Setting<'a>,
    /// Of caustic photons.
    aim: Aim,
    everywhere: Aim,
    /// Those of a still scene, once made.
    still: OnceLock<Arc<Maps>>,
}

impl<'a> PhotonMapper<'a> {
    pub fn new(spec: &'a PhotonMapperSpec, setting: Setting<'a>) -> PhotonMapper<'a> {
        PhotonMapper {
            spec,
            setting,
            aim: setting.scene.aim_at_caustics(),
            everywhere: Aim::default(),
            still: OnceLock::new(),
        }
    }

    /// See [`PhotonMapperSpec::fits`].
    pub fn fits(&self) -> Result<(), String> {
        self.spec.fits()
    }

    /// Whether every sample needs maps of its own.
    pub fn iterates(&self) -> bool {
        self.setting.scene.moves() || self.setting.camera.moves()
    }

    /// The maps of iteration `number`.
    pub fn begin(&self, number: u64, ledger: &mut Ledger) -> Iteration {
        let time = self.setting.common_time(number);
        let maps = match time {
            Some(time) => Arc::new(self.shoot(number, time, ledger)),
            None => Arc::clone(
                self.still
                    .get_or_init(|| Arc::new(self.shoot(0, 0.0, ledger))),
            ),
        };
        Iteration {
            time,
            maps: Some(maps),
            ..Iteration::default()
        }
    }

    /// One sample of the radiance along `ray`.
    pub fn sample(
        &self,
        iteration: &Iteration,
        ray: Ray,
        sampler: &Sampler,
        ledger: &mut Ledger,
    ) -> Li {
        let (scene, path) = (self.setting.scene, &self.spec.path);
        let mut first = FirstVertex {
            spec: self.spec,
            scene,
            maps: iteration.maps.as_deref(),
            max_depth: path.max_depth.unwrap_or(UNBOUNDED),
        };
        let start = Start::at_camera(ray);
        path.walk(scene, start, sampler, &mut ledger.rays, &mut first)
    }
}

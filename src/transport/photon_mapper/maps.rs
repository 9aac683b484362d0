//! The two maps, and what they tell of the light at a point.

use super::PhotonMapper;
use crate::math::Rgb;
use crate::transport::Ledger;
use crate::transport::combined::caustic;
use crate::transport::light_walk::{LightVertex, LightWalk};
use crate::transport::mis::Techniques;
use crate::transport::path::{UNBOUNDED, Vertex};
use crate::transport::photons::{Kernel, KernelShape, Photon, PhotonMap, Shoot};

/// Photons, and how they are gathered.
struct Map {
    photons: PhotonMap<Photon>,
    kernel: Kernel,
    /// One over the number of walks.
    share: f32,
}

/// Radiance from photons, and the radius of the disk that they were taken from.
pub struct Estimate {
    pub radiance: Rgb,
    pub radius: f32,
}

/// All photons that the picture is made of.
pub struct Maps {
    /// Of all light, straight from the emitters too.
    global: Map,
    /// Of light that delta lobes alone brought; `None` where there is none.
    caustic: Option<Map>,
}

impl Maps {
    pub fn global(&self, vertex: &Vertex, max_depth: u32) -> Estimate {
        self.global.at(vertex, max_depth)
    }

    pub fn caustic(&self, vertex: &Vertex, max_depth: u32) -> Rgb {
        let map = self.caustic.as_ref();
        map.map_or(Rgb::BLACK, |map| map.at(vertex, max_depth).radiance)
    }
}

impl Map {
    fn at(&self, vertex: &Vertex, max_depth: u32) -> Estimate {
        let sum = Photon::gather(&self.photons, &self.kernel, vertex, max_depth);
        Estimate {
            radiance: sum * self.share,
            radius: self.photons.radius(),
        }
    }
}

impl PhotonMapper<'_> {
    /// The maps of the light that flies at `time`.
    pub fn shoot(&self, number: u64, time: f32, ledger: &mut Ledger) -> Maps {
        let scene = self.setting.scene;
        let max_depth = self.spec.path.max_depth.unwrap_or(UNBOUNDED);
        let shoot = |specular_only| Shoot {
            setting: self.setting,
            walk: LightWalk {
                scene,
                aim: &self.aim,
                techniques: Techniques::default(),
                // One edge is left for the eye.
                max_edges: max_depth.saturating_sub(1),
                specular_only,
            },
            count: 0,
            iteration: number,
            time,
        };
        let size = 0.5 * scene.world().bounds().diagonal().length();
        let all = Wanted {
            photons: self.spec.global_photons,
            radius: self.spec.global_radius * size,
        };
        let caustics = Wanted {
            photons: self.spec.caustic_photons,
            radius: self.spec.caustic_radius * size,
        };
        let thrown = scene.throws_caustics().is_ok();
        Maps {
            global: all.collect(shoot(false), ledger, |vertex| Some(Photon::of(vertex))),
            caustic: thrown.then(|| caustics.collect(shoot(true), ledger, caustic)),
        }
    }
}

/// What a map is to hold.
struct Wanted {
    photons: u64,
    radius: f32,
}

impl Wanted {
    /// Shoots about as many photons: a few walks tell how many it takes.
    fn collect(
        &self,
        shoot: Shoot,
        ledger: &mut Ledger,
        store: impl Fn(&LightVertex) -> Option<Photon> + Sync,
    ) -> Map {
        let pilot = Shoot {
            count: PILOT.min(self.photons),
            ..shoot
        };
        let (_, tally) = pilot.trace(ledger, &store);
        let per_walk = tally.stored as f64 / pilot.count.max(1) as f64;
        // Where hardly any walk leaves a photon, more walks are not worth their time.
        let count = (self.photons as f64 / per_walk.max(WORTH)).ceil() as u64;
        let (photons, _) = Shoot { count, ..shoot }.trace(ledger, store);
        Map {
            photons: ledger.build_map(|| PhotonMap::new(photons, self.radius)),
            kernel: Kernel::new(KernelShape::Epanechnikov, self.radius),
            share: 1.0 / count.max(1) as f32,
        }
    }
}

/// Walks that tell how many photons a walk leaves.
const PILOT: u64 = 1 << 14;
/// Least photons of a walk that count on.
const WORTH: f64 = 0.01;

//! The two maps, and what they tell of the light at a point.

use super::PhotonMapper;
use crate::math::{PI, Rgb};
use crate::transport::Ledger;
use crate::transport::combined::caustic;
use crate::transport::light_walk::LightWalk;
use crate::transport::mis::Techniques;
use crate::transport::path::{UNBOUNDED, Vertex};
use crate::transport::photons::{Photon, PhotonMap, Volley};

/// Photons and the walks that they are of.
struct Map {
    photons: PhotonMap<Photon>,
    walks: u64,
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
    /// Density estimate with the kernel 3 (1 - d²/r²)² / (π r²), d being the distance (Silverman 1986,
    /// equation 4.5): smooth, and with the mean 1 over the disk.
    fn at(&self, vertex: &Vertex, max_depth: u32) -> Estimate {
        let radius = self.photons.radius();
        let r2 = f64::from(radius).powi(2);
        let inverse = (1.0 / r2) as f32;
        let mut sum = Rgb::BLACK;
        self.photons.within(vertex.hit.p, |photon, d2| {
            let near = (1.0 - d2 * inverse).max(0.0);
            sum += photon.scattered(vertex, max_depth) * (near * near);
        });
        let scale = 3.0 / (f64::from(PI) * r2 * self.walks.max(1) as f64);
        Estimate {
            radiance: sum * scale as f32,
            radius,
        }
    }
}

impl PhotonMapper<'_> {
    /// The maps of the light that flies at `time`.
    pub fn shoot(&self, number: u64, time: f32, ledger: &mut Ledger) -> Maps {
        let scene = self.setting.scene;
        let volley = |specular_only, stream| Volley {
            walk: LightWalk {
                scene,
                aim: &self.aim,
                techniques: Techniques::default(),
                // One edge is left for the eye.
                max_edges: self
                    .spec
                    .path
                    .max_depth
                    .unwrap_or(UNBOUNDED)
                    .saturating_sub(1),
                specular_only,
            },
            setting: self.setting,
            stream,
            number,
            time,
        };
        let size = 0.5 * scene.world().bounds().diagonal().length();
        let map = |(photons, walks), relative: f32| Map {
            photons: PhotonMap::new(photons, relative * size),
            walks,
        };
        let wanted = self.spec.global_photons;
        let global = volley(false, GLOBAL).shoot_until(wanted, most(wanted), ledger, |vertex| {
            scene.receives(&vertex.hit).then(|| Photon::of(vertex))
        });
        let wanted = self.spec.caustic_photons;
        let caustics = scene.throws_caustics().is_ok().then(|| {
            let shot = volley(true, CAUSTIC).shoot_until(wanted, most(wanted), ledger, |vertex| {
                caustic(scene, vertex)
            });
            map(shot, self.spec.caustic_radius)
        });
        Maps {
            global: map(global, self.spec.global_radius),
            caustic: caustics,
        }
    }
}

/// Most walks for so many photons: more are not worth their time.
fn most(photons: u64) -> u64 {
    photons.saturating_mul(100)
}

/// Set the numbers of the walks apart.
const GLOBAL: u64 = 0x676c_6f62_616c_0001;
const CAUSTIC: u64 = 0x6361_7573_7469_6302;

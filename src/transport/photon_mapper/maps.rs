//! The two maps, and what they tell of the light at a point.

use std::num::NonZeroUsize;

use super::PhotonMapper;
use crate::math::{PI, Rgb, Vec3};
use crate::transport::Ledger;
use crate::transport::combined::caustic;
use crate::transport::light_walk::{LightVertex, LightWalk};
use crate::transport::mis::Techniques;
use crate::transport::path::{UNBOUNDED, Vertex};
use crate::transport::photons::{Kernel, KernelShape, NearestMap, Photon, Shoot};

/// A photon and its place: its distance alone does not tell whether it lies on the surface that is asked about.
type Placed = (Vec3, Photon);

/// Photons, and how they are gathered.
struct Map {
    photons: NearestMap<Placed>,
    /// So many at once, ...
    lookup: NonZeroUsize,
    /// ... if as many lie within this distance.
    radius: f32,
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
    /// Density estimate with a kernel that falls by the squared distance (Epanechnikov 1969), over the disk of
    /// the nearest photons.
    fn at(&self, vertex: &Vertex, max_depth: u32) -> Estimate {
        let hit = vertex.hit;
        // The kernel is known once all photons are: sums of what does and what does not fall with distance.
        let (mut sum, mut falling) = (Rgb::BLACK, Rgb::BLACK);
        let scale = self.radius.powi(-2);
        let visit = |(p, photon): &Placed, d2: f32| {
            // As seen from a photon at the rim of the disk.
            let kernel = Kernel::new(KernelShape::Uniform, d2.sqrt());
            if let Some(lit) = photon.seen(&kernel, vertex, *p - hit.p, max_depth) {
                sum += lit;
                falling += lit * (d2 * scale);
            }
        };
        let r2 = self.photons.nearest(hit.p, self.lookup, self.radius, visit);
        // 2 (1 - d^2 / r^2) / (pi r^2), its mean over the disk one.
        let r2 = f64::from(r2);
        let peak = 2.0 / (f64::from(PI) * r2) * f64::from(self.share);
        let fall = (1.0 / (f64::from(scale) * r2)) as f32;
        Estimate {
            // Rounding may leave less than nothing where all photons lie at the rim.
            radiance: sum.zip(falling, |s, f| (s - f * fall).max(0.0)) * peak as f32,
            radius: r2.sqrt() as f32,
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
                aim: if specular_only {
                    &self.aim
                } else {
                    &self.everywhere
                },
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
            lookup: self.spec.global_lookup,
            radius: self.spec.global_radius * size,
        };
        let caustics = Wanted {
            photons: self.spec.caustic_photons,
            lookup: self.spec.caustic_lookup,
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
    lookup: u32,
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
        // Where hardly any walk leaves a photon, more walks are not worth their time; where none does, there is
        // no light to wait for.
        let count = match tally.stored {
            0 => 0,
            _ => (self.photons as f64 / per_walk.max(WORTH)).ceil() as u64,
        };
        let (photons, _) = Shoot { count, ..shoot }.trace(ledger, store);
        let placed = photons.into_iter().map(|(p, photon)| (p, (p, photon)));
        Map {
            photons: ledger.build_map(|| NearestMap::new(placed.collect())),
            lookup: NonZeroUsize::new(self.lookup as usize).unwrap_or(NonZeroUsize::MIN),
            radius: self.radius,
            share: 1.0 / count.max(1) as f32,
        }
    }
}

/// Most bytes that building maps of so many photons takes, what they come in included.
pub fn bytes(photons: u64) -> u64 {
    photons.saturating_mul(4 * size_of::<(Vec3, Placed)>() as u64)
}

/// Walks that tell how many photons a walk leaves.
const PILOT: u64 = 1 << 14;
/// Least photons of a walk that count on.
const WORTH: f64 = 0.05;

//! Shooting photons, and the books of the power that they carry.

use rayon::prelude::*;

use super::PhotonMap;
use crate::math::{Rgb, Vec3};
use crate::sampler::{Sampler, mix};
use crate::transport::light_walk::{End, LightVertex, LightWalk, Walked};
use crate::transport::{Ledger, Setting};

/// The photons of one iteration, yet to be shot.
#[derive(Clone, Copy, Debug)]
pub struct Shoot<'a> {
    pub setting: Setting<'a>,
    pub walk: LightWalk<'a>,
    /// Walks of light.
    pub count: u64,
    pub iteration: u64,
    /// When they travel, 0 to 1 over the shutter.
    pub time: f32,
}

/// Where the power went that walks of light began with, in W: what they ended with together, shared out to them
/// all. Emitted is absorbed, escaped and stopped.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    pub walks: u64,
    /// Photons stored: any number per walk.
    pub stored: u64,
    pub emitted: [f64; 3],
    /// By surfaces on the way, and where walks ended.
    pub absorbed: [f64; 3],
    /// Out of the scene.
    pub escaped: [f64; 3],
    /// Of walks that were not followed to their end: by a limit of their length, or since only delta lobes were
    /// to carry them on. Where each walk stores one photon at its end, this is the power stored.
    pub stopped: [f64; 3],
}

/// Walks of one task. Fixed: sums must not depend on threads.
const CHUNK: u64 = 1 << 12;
/// Sets the numbers of photons apart from those of pixels.
const STREAM: u64 = 0x7068_6f74_6f6e_0001;
/// Walks that tell how many photons a walk stores.
const PILOT: u64 = 1 << 10;

impl Shoot<'_> {
    /// Shoots on all threads of the current pool. `store` makes a photon of light that arrives where the scene
    /// receives photons, or `None`: it is not kept. Their order is that of the walks.
    pub fn trace<T: Send>(
        &self,
        ledger: &mut Ledger,
        store: impl Fn(&LightVertex) -> Option<T> + Sync,
    ) -> (Vec<(Vec3, T)>, Tally) {
        let chunk = |number: u64| {
            let mut part = Part::new();
            let first = number * CHUNK;
            for i in first..self.count.min(first + CHUNK) {
                part.shoot(self, i, &store);
            }
            part.photons.shrink_to_fit();
            part
        };
        let parts: Vec<Part<T>> = (0..self.count.div_ceil(CHUNK))
            .into_par_iter()
            .map(chunk)
            .collect();
        let mut photons = Vec::with_capacity(parts.iter().map(|p| p.photons.len()).sum());
        let mut tally = Tally::default();
        for part in parts {
            photons.extend(part.photons);
            ledger.rays += part.rays;
            tally.add(&part.tally);
        }
        tally.walks = self.count;
        tally.stored = photons.len() as u64;
        tally.share_out();
        (photons, tally)
    }

    /// Whether a map of the photons fits into `limit` bytes, judged by a few walks: an error that names
    /// `parameter`, which sets the count, where it does not.
    pub fn check<T: Copy + Send + Sync>(
        &self,
        limit: u64,
        parameter: &str,
        store: impl Fn(&LightVertex) -> Option<T> + Sync,
    ) -> Result<(), String> {
        let pilot = Shoot {
            count: self.count.min(PILOT),
            ..*self
        };
        if pilot.count == 0 {
            return Ok(());
        }
        let (_, tally) = pilot.trace(&mut Ledger::default(), store);
        let per_walk = tally.stored as f64 / pilot.count as f64;
        let photons = (per_walk * self.count as f64).ceil() as u64;
        let bytes = PhotonMap::<T>::bytes_to_build(photons);
        let most = u64::from(u32::MAX);
        if bytes <= limit && photons <= most {
            return Ok(());
        }
        let fits = |n: &u64| {
            let photons = (per_walk * *n as f64).ceil() as u64;
            photons <= most && PhotonMap::<T>::bytes_to_build(photons) <= limit
        };
        // Halves until it fits: 64 steps at most.
        let fitting = std::iter::successors(Some(self.count / 2), |n| Some(n / 2))
            .take_while(|n| *n > 0)
            .find(fits);
        let advice = match fitting {
            Some(n) => format!("; {n} would fit"),
            None => String::new(),
        };
        Err(format!(
            "{parameter} {} makes about {photons} photons, which take {} of memory, more than the {} allowed{advice}",
            self.count,
            in_bytes(bytes),
            in_bytes(limit),
        ))
    }
}

/// 1536 as "1.5 KiB".
fn in_bytes(n: u64) -> String {
    const UNITS: [&str; 5] = ["KiB", "MiB", "GiB", "TiB", "PiB"];
    if n < 1024 {
        return format!("{n} bytes");
    }
    let step = ((n.ilog2() / 10) as usize).min(UNITS.len());
    let value = n as f64 / 1024f64.powi(step as i32);
    format!("{value:.1} {}", UNITS[step - 1])
}

/// What one task brings.
struct Part<T> {
    photons: Vec<(Vec3, T)>,
    rays: crate::transport::PathStats,
    tally: Tally,
}

impl<T> Part<T> {
    fn new() -> Part<T> {
        Part {
            photons: Vec::new(),
            rays: Default::default(),
            tally: Tally::default(),
        }
    }

    fn shoot(&mut self, shoot: &Shoot, number: u64, store: &impl Fn(&LightVertex) -> Option<T>) {
        let Setting {
            scene,
            sampler,
            seed,
            ..
        } = shoot.setting;
        let sampler = Sampler::new(sampler, mix(seed ^ STREAM), shoot.iteration, number, 1);
        let photons = &mut self.photons;
        let visit = |vertex: &LightVertex| {
            if scene.receives(&vertex.hit)
                && let Some(photon) = store(vertex)
            {
                photons.push((vertex.hit.p, photon));
            }
            true
        };
        let walked = shoot.walk.walk(&sampler, shoot.time, &mut self.rays, visit);
        self.tally.note(&walked);
    }
}

impl Tally {
    fn note(&mut self, walked: &Walked) {
        let Walked { emitted, left, end } = *walked;
        add(&mut self.emitted, wide(emitted));
        match end {
            End::Absorbed => {}
            End::Escaped => add(&mut self.escaped, wide(left)),
            End::Stopped => add(&mut self.stopped, wide(left)),
        }
        let (emitted, left) = (wide(emitted), wide(left));
        add(&mut self.absorbed, [0, 1, 2].map(|c| emitted[c] - left[c]));
    }

    fn add(&mut self, o: &Tally) {
        add(&mut self.emitted, o.emitted);
        add(&mut self.absorbed, o.absorbed);
        add(&mut self.escaped, o.escaped);
        add(&mut self.stopped, o.stopped);
    }

    /// The power of a walk is what the emitters would send if all walks were like it.
    fn share_out(&mut self) {
        let share = 1.0 / self.walks.max(1) as f64;
        for sum in [
            &mut self.emitted,
            &mut self.absorbed,
            &mut self.escaped,
            &mut self.stopped,
        ] {
            *sum = sum.map(|v| v * share);
        }
    }
}

fn wide(c: Rgb) -> [f64; 3] {
    [c.r, c.g, c.b].map(f64::from)
}

fn add(sum: &mut [f64; 3], v: [f64; 3]) {
    sum.iter_mut().zip(v).for_each(|(s, v)| *s += v);
}

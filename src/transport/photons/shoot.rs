//! Photons on their way into a map.

use rayon::prelude::*;

use crate::math::Vec3;
use crate::sampler::{Sampler, mix};
use crate::transport::light_walk::{LightVertex, LightWalk};
use crate::transport::{Ledger, PathStats, Setting};

/// Walks that one task follows. Fixed: what is found must not depend on threads.
const CHUNK: u64 = 1 << 10;

/// Walks of light that belong together.
#[derive(Clone, Copy, Debug)]
pub struct Volley<'a> {
    pub walk: LightWalk<'a>,
    pub setting: Setting<'a>,
    /// Sets the numbers of these walks apart from others'.
    pub stream: u64,
    /// The iteration that they are shot for: every one has numbers of its own.
    pub number: u64,
    /// When they fly.
    pub time: f32,
}

/// What walks left.
struct Found<T> {
    photons: Vec<(Vec3, T)>,
    rays: PathStats,
}

impl Volley<'_> {
    /// Follows `count` walks on all threads of the current pool, and keeps what `keep` makes of the surfaces
    /// that they meet, in the order of the walks.
    pub fn shoot<T: Send>(
        &self,
        count: u64,
        ledger: &mut Ledger,
        keep: impl Fn(&LightVertex) -> Option<T> + Sync,
    ) -> Vec<(Vec3, T)> {
        self.chunks(0..count.div_ceil(CHUNK), count, ledger, &keep)
            .into_iter()
            .flatten()
            .collect()
    }

    /// The same until `wanted` photons are kept, or until `most` walks were followed. Returns the number of
    /// walks as well, which is a whole number of chunks: what was found last has no say in where it ends.
    pub fn shoot_until<T: Send>(
        &self,
        wanted: u64,
        most: u64,
        ledger: &mut Ledger,
        keep: impl Fn(&LightVertex) -> Option<T> + Sync,
    ) -> (Vec<(Vec3, T)>, u64) {
        let mut photons = Vec::new();
        let (mut done, mut round) = (0, wanted.div_ceil(CHUNK).max(1));
        let last = most.div_ceil(CHUNK);
        while done < last && (photons.len() as u64) < wanted {
            let end = (done + round).min(last);
            for chunk in self.chunks(done..end, u64::MAX, ledger, &keep) {
                photons.extend(chunk);
                done += 1;
                if photons.len() as u64 >= wanted {
                    break;
                }
            }
            // As many more as it will take at this rate, within reason.
            let rate = photons.len() as f64 / done as f64;
            let missing = wanted.saturating_sub(photons.len() as u64) as f64;
            round = ((missing / rate.max(1e-9)) as u64 + 1).min(4 * done);
        }
        (photons, done * CHUNK)
    }

    fn chunks<T: Send>(
        &self,
        chunks: std::ops::Range<u64>,
        count: u64,
        ledger: &mut Ledger,
        keep: &(impl Fn(&LightVertex) -> Option<T> + Sync),
    ) -> Vec<Vec<(Vec3, T)>> {
        let shoot = |chunk: u64| {
            let mut found = Found {
                photons: Vec::new(),
                rays: PathStats::default(),
            };
            let first = chunk * CHUNK;
            for i in first..first.saturating_add(CHUNK).min(count) {
                self.follow(i, &mut found, keep);
            }
            found
        };
        let found: Vec<Found<T>> = chunks.into_par_iter().map(shoot).collect();
        let mut photons = Vec::with_capacity(found.len());
        for chunk in found {
            ledger.rays += chunk.rays;
            photons.push(chunk.photons);
        }
        photons
    }

    fn follow<T>(&self, i: u64, found: &mut Found<T>, keep: &impl Fn(&LightVertex) -> Option<T>) {
        let Setting { sampler, seed, .. } = self.setting;
        let sampler = Sampler::new(sampler, mix(seed ^ self.stream), self.number, i, 1);
        let Found { photons, rays } = found;
        self.walk.walk(&sampler, self.time, rays, |vertex| {
            photons.extend(keep(vertex).map(|photon| (vertex.hit.p, photon)));
            true
        });
    }
}

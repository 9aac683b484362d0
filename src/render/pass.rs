//! Samples for all pixels of a tile.

use std::ops::Range;

use super::{Invalid, Job};
use crate::film::{FilterSampler, Taken, Tile};
use crate::math::Vec2;
use crate::sampler::{Sampler, dim};
use crate::scene::CameraSample;
use crate::transport::aov::{self, Aov};
use crate::transport::{Iteration, Ledger, PerTechnique, Technique, Transport};

/// Samples that tiles take.
pub(super) struct Pass<'a> {
    pub job: &'a Job,
    pub transport: &'a Transport<'a>,
    pub iteration: &'a Iteration,
    pub filter: &'a FilterSampler,
    pub moving: bool,
    pub techniques: &'static [Technique],
}

/// Which samples a pass takes.
#[derive(Clone, Debug)]
pub(super) enum Samples {
    /// The same of all tiles.
    Range(Range<u64>),
    /// Of each tile what is missing to its goal, but no more than this.
    ToGoal(u64),
}

impl Samples {
    /// What a tile gets, and the numbers of these samples.
    pub fn of(&self, tile: &Tile) -> (Taken, Vec<u64>) {
        match (self, tile.taken()) {
            (Samples::Range(range), _) => (Taken::Range(range.clone()), range.clone().collect()),
            (Samples::ToGoal(most), Taken::Halves(done)) => {
                let all = u64::from(tile.replicates());
                let more = |half: usize| (tile.goal()[half].saturating_sub(done[half])).min(*most);
                let more = [more(0), more(1)];
                let number = |half: usize| {
                    let numbers = done[half]..done[half] + more[half];
                    numbers.map(move |i| Taken::number_in_half(i, half as u64, all))
                };
                (Taken::Halves(more), number(0).chain(number(1)).collect())
            }
            (Samples::ToGoal(_), Taken::Range(range)) => {
                (Taken::Range(range.end..range.end), Vec::new())
            }
        }
    }
}

impl Pass<'_> {
    /// Adds the samples of these numbers to every pixel of the tile.
    pub fn render_tile(&self, tile: &mut Tile, numbers: &[u64]) -> (Ledger, Invalid) {
        let job = self.job;
        let (mut ledger, mut invalid) = (Ledger::default(), Invalid::default());
        let aovs: Vec<Aov> = job.aovs.iter().map(|l| l.aov).collect();
        let mut aov_values = Vec::new();
        let replicates = tile.replicates();
        for y in 0..tile.height {
            for x in 0..tile.width {
                let (px, py) = (job.film.crop.x + tile.x + x, job.film.crop.y + tile.y + y);
                // The pixel's number in the full picture, so that a crop shows the same samples.
                let pixel = u64::from(py) * u64::from(job.film.width) + u64::from(px);
                for &s in numbers {
                    let sampler = Sampler::new(job.sampler, job.seed, pixel, s, replicates);
                    let [u, v, lens_u, lens_v] = sampler.get4(dim::CAMERA);
                    let (offset, weight) = self.filter.sample(Vec2::new(u, v));
                    let time = match (self.moving, self.iteration.time) {
                        (false, _) => 0.0,
                        (true, Some(time)) => time,
                        (true, None) => sampler.get4(dim::TIME)[0],
                    };
                    let at = CameraSample {
                        film: Vec2::new(px as f32 + 0.5, py as f32 + 0.5) + offset,
                        lens: Vec2::new(lens_u, lens_v),
                        time,
                    };
                    let seen = job.camera.ray(&at);
                    let ray = seen.ray;
                    let (transport, iteration) = (self.transport, self.iteration);
                    let mut li = transport.sample(iteration, &at, ray, &sampler, &mut ledger);
                    li.radiance *= seen.weight;
                    ledger.settle(seen.weight * weight);
                    let radiance = li.radiance;
                    // Splats are told apart where they arrive.
                    let mut parts = PerTechnique::default();
                    if !self.techniques.is_empty() {
                        parts = ledger.take_parts();
                    }
                    // A NaN fails the comparison too.
                    if radiance.is_finite() && radiance.min_component() >= 0.0 {
                        tile.add(x, y, s, radiance * weight);
                        for (i, technique) in self.techniques.iter().enumerate() {
                            if *technique != Technique::Splat {
                                let part = parts[*technique as usize];
                                tile.add_part(x, y, i, part * f64::from(seen.weight * weight));
                            }
                        }
                    } else {
                        invalid.count += 1;
                        invalid.first = invalid.first.or(Some((px, py, s, radiance)));
                    }
                    if !aovs.is_empty() {
                        aov_values.clear();
                        let [.., u] = sampler.get4(dim::VERTEX + dim::CHOICES);
                        aov::evaluate(&job.scene, &ray, &li, u, &aovs, &mut aov_values);
                        aov_values.iter_mut().for_each(|v| *v *= weight);
                        tile.add_aov(x, y, &aov_values);
                    }
                }
            }
        }
        (ledger, invalid)
    }
}

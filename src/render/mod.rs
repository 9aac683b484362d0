//! Rendering: passes over the film, when to stop, and what it cost.

mod picture;

pub use picture::{ComponentFormat, Metadata, PixelFormat};

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::film::{self, ErrorEstimate, Film, FilmSpec, FilterSampler, Tile};
use crate::math::{Rgb, Vec2};
use crate::sampler::{Sampler, SamplerKind, dim};
use crate::scene::{Camera, CameraSample, Scene};
use crate::transport::aov::{self, Aov};
use crate::transport::{IntegratorSpec, PathStats};

/// A layer of arbitrary output variables that the picture gets beside its colours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AovLayer {
    pub name: String,
    pub aov: Aov,
}

/// Everything that determines a picture, up to the number of samples.
#[derive(Debug)]
pub struct Job {
    pub scene: Scene,
    pub camera: Camera,
    pub film: FilmSpec,
    pub sampler: SamplerKind,
    pub seed: u64,
    pub integrator: IntegratorSpec,
    pub aovs: Vec<AovLayer>,
    pub pixel_format: PixelFormat,
    pub component_format: ComponentFormat,
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// After this many samples per pixel.
    Spp(u64),
    /// After this much time, at the end of a pass; at least one sample per pixel is taken.
    Time(Duration),
}

/// Samples whose value was NaN, infinite or negative. They are left out of the film and reported: each
/// one is a fault of the program, never hidden.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Invalid {
    pub count: u64,
    /// Pixel, sample number and value of the first one, in the order of tiles.
    pub first: Option<(u32, u32, u64, Rgb)>,
}

impl Invalid {
    fn merge(&mut self, later: Invalid) {
        self.count += later.count;
        self.first = self.first.or(later.first);
    }
}

/// What rendering took.
#[derive(Clone, Debug, Default)]
pub struct Stats {
    pub rays: PathStats,
    pub seconds: f64,
    pub invalid: Invalid,
}

/// Longest pass: how often progress is shown and a request to stop is heard, memory and samples allowing.
const PASS: Duration = Duration::from_millis(400);

impl Job {
    /// An empty film for this job.
    pub fn new_film(&self, stop: Stop) -> Film {
        let spp = match stop {
            Stop::Spp(n) => Some(n),
            Stop::Time(_) => None,
        };
        let crop = self.film.crop;
        let pixels = u64::from(crop.width) * u64::from(crop.height);
        let channels = self.aovs.iter().map(|l| l.aov.channels().len()).sum();
        Film::new(crop, film::replicates(spp, pixels), channels)
    }

    /// Renders until `stop` or until `on_pass`, called after every pass, breaks. Which samples a pass
    /// takes depends on the clock, but the sums they end up in do not: the film after n samples per
    /// pixel is the same bit for bit, however they were divided into passes and threads.
    pub fn render(
        &self,
        stop: Stop,
        mut on_pass: impl FnMut(&Film, &Stats) -> ControlFlow<()>,
    ) -> (Film, Stats) {
        let start = Instant::now();
        let mut film = self.new_film(stop);
        let mut stats = Stats::default();
        while let Some(n) = next_pass(stop, film.spp(), start.elapsed()) {
            let pass = self.add_samples(&mut film, n);
            stats.rays += pass.rays;
            stats.invalid.merge(pass.invalid);
            stats.seconds = start.elapsed().as_secs_f64();
            if on_pass(&film, &stats).is_break() {
                break;
            }
        }
        (film, stats)
    }

    /// Takes the next `n` samples of every pixel, on all threads of the current pool.
    pub fn add_samples(&self, film: &mut Film, n: u64) -> Stats {
        let start = Instant::now();
        let filter = FilterSampler::new(&self.film.filter);
        let first = film.spp();
        let work = |tile: &mut Tile| self.render_tile(tile, first, n, &filter);
        let done: Vec<(PathStats, Invalid)> = film.tiles_mut().par_iter_mut().map(work).collect();
        film.finish_pass(n);
        let mut stats = Stats {
            seconds: start.elapsed().as_secs_f64(),
            ..Stats::default()
        };
        for (rays, invalid) in done {
            stats.rays += rays;
            stats.invalid.merge(invalid);
        }
        stats
    }

    /// Adds the samples `first..first + n` of every pixel of the tile.
    fn render_tile(
        &self,
        tile: &mut Tile,
        first: u64,
        n: u64,
        filter: &FilterSampler,
    ) -> (PathStats, Invalid) {
        let (mut rays, mut invalid) = (PathStats::default(), Invalid::default());
        let aovs: Vec<Aov> = self.aovs.iter().map(|l| l.aov).collect();
        let mut aov_values = Vec::new();
        let replicates = tile.replicates();
        let moving = self.camera.moves() || self.scene.moves();
        for y in 0..tile.height {
            for x in 0..tile.width {
                let (px, py) = (self.film.crop.x + tile.x + x, self.film.crop.y + tile.y + y);
                // The pixel's number in the full picture, so that a crop shows the same samples.
                let pixel = u64::from(py) * u64::from(self.film.width) + u64::from(px);
                for s in first..first + n {
                    let sampler = Sampler::new(self.sampler, self.seed, pixel, s, replicates);
                    let [u, v, lens_u, lens_v] = sampler.get4(dim::CAMERA);
                    let (offset, weight) = filter.sample(Vec2::new(u, v));
                    let time = match moving {
                        true => sampler.get4(dim::TIME)[0],
                        false => 0.0,
                    };
                    let seen = self.camera.ray(&CameraSample {
                        film: Vec2::new(px as f32 + 0.5, py as f32 + 0.5) + offset,
                        lens: Vec2::new(lens_u, lens_v),
                        time,
                    });
                    let ray = seen.ray;
                    let mut li = self.integrator.li(&self.scene, ray, &sampler, &mut rays);
                    li.radiance *= seen.weight;
                    let radiance = li.radiance;
                    // A NaN fails the comparison too.
                    if radiance.is_finite() && radiance.min_component() >= 0.0 {
                        tile.add(x, y, s, radiance * weight);
                    } else {
                        invalid.count += 1;
                        invalid.first = invalid.first.or(Some((px, py, s, radiance)));
                    }
                    if !aovs.is_empty() {
                        aov_values.clear();
                        let [.., u] = sampler.get4(dim::VERTEX + dim::CHOICES);
                        aov::evaluate(&self.scene, &ray, &li, u, &aovs, &mut aov_values);
                        aov_values.iter_mut().for_each(|v| *v *= weight);
                        tile.add_aov(x, y, &aov_values);
                    }
                }
            }
        }
        (rays, invalid)
    }
}

/// Samples per pixel of the next pass; `None` to stop.
fn next_pass(stop: Stop, done: u64, elapsed: Duration) -> Option<u64> {
    if done == 0 {
        return match stop {
            Stop::Spp(0) => None,
            _ => Some(1),
        };
    }
    let per_sample = elapsed.as_secs_f64() / done as f64;
    let affordable = |time: f64| (time / per_sample.max(1e-9)) as u64;
    match stop {
        // At most doubling: the first passes also pay for warming up.
        Stop::Spp(n) => {
            (n > done).then(|| affordable(PASS.as_secs_f64()).clamp(1, done).min(n - done))
        }
        Stop::Time(limit) => {
            let left = limit.checked_sub(elapsed)?.as_secs_f64();
            let n = affordable(left.min(PASS.as_secs_f64())).min(done);
            (n > 0).then_some(n)
        }
    }
}

impl Stats {
    pub fn rays_per_second(&self) -> f64 {
        self.rays.total() as f64 / self.seconds.max(1e-9)
    }
}

/// Estimated error of a film as a percentage: the root of its relMSE with the interval's ends.
pub fn percent(e: &ErrorEstimate) -> [f64; 3] {
    [e.relmse, e.ci95[0], e.ci95[1]].map(|v| 100.0 * v.sqrt())
}

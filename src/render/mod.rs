//! Rendering: passes over the film, when to stop, and what it cost.

mod picture;

pub use picture::{ComponentFormat, Metadata, PixelFormat};

use std::ops::{ControlFlow, Range};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::film::{self, ErrorEstimate, Film, FilmSpec, FilterSampler, SplatBuffer, Tile};
use crate::math::{Rgb, Vec2};
use crate::sampler::{Sampler, SamplerKind, dim};
use crate::scene::{Camera, CameraSample, Scene};
use crate::transport::aov::{self, Aov};
use crate::transport::{IntegratorSpec, Iteration, Ledger, PathStats, Setting, Transport};

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
        let transport = self.transport(film.replicates());
        while let Some(n) = next_pass(stop, film.spp(), start.elapsed()) {
            let pass = self.add_pass(&transport, &mut film, n);
            stats.rays += pass.rays;
            stats.invalid.merge(pass.invalid);
            stats.seconds = start.elapsed().as_secs_f64();
            if on_pass(&film, &stats).is_break() {
                break;
            }
        }
        (film, stats)
    }

    /// The integrator, ready to take samples.
    fn transport(&self, replicates: u32) -> Transport<'_> {
        let setting = Setting {
            scene: &self.scene,
            camera: &self.camera,
            film: &self.film,
            sampler: self.sampler,
            seed: self.seed,
            replicates,
        };
        Transport::new(&self.integrator, setting)
    }

    /// Takes the next `n` samples of every pixel, on all threads of the current pool.
    pub fn add_samples(&self, film: &mut Film, n: u64) -> Stats {
        let transport = self.transport(film.replicates());
        self.add_pass(&transport, film, n)
    }

    fn add_pass(&self, transport: &Transport, film: &mut Film, n: u64) -> Stats {
        let start = Instant::now();
        let mut stats = Stats::default();
        if transport.iterates() {
            let mut splats = SplatBuffer::new(self.film.crop, self.film.filter);
            for _ in 0..n {
                self.add_iteration(transport, film, 1, &mut stats, Some(&mut splats));
            }
        } else {
            self.add_iteration(transport, film, n, &mut stats, None);
        }
        stats.seconds = start.elapsed().as_secs_f64();
        stats
    }

    /// Takes the next `n` samples of every pixel, which share what the first of them begins.
    fn add_iteration(
        &self,
        transport: &Transport,
        film: &mut Film,
        n: u64,
        stats: &mut Stats,
        splats: Option<&mut SplatBuffer>,
    ) {
        let filter = FilterSampler::new(&self.film.filter);
        let first = film.spp();
        let mut ledger = Ledger::default();
        let iteration = transport.begin(first, &mut ledger);
        let pass = Pass {
            job: self,
            transport,
            iteration: &iteration,
            filter: &filter,
            moving: self.camera.moves() || self.scene.moves(),
            samples: first..first + n,
        };
        let work = |tile: &mut Tile| pass.render_tile(tile);
        let done: Vec<(Ledger, Invalid)> = film.tiles_mut().par_iter_mut().map(work).collect();
        stats.rays += ledger.rays;
        for (ledger, invalid) in &done {
            stats.rays += ledger.rays;
            stats.invalid.merge(invalid.clone());
        }
        if let Some(splats) = splats {
            let all = done.iter().flat_map(|(ledger, _)| &ledger.splats);
            let mut any = false;
            for splat in all {
                let value = splat.value;
                if value.is_finite() && value.min_component() >= 0.0 {
                    any = true;
                    splats.add(splat);
                } else {
                    let pixel = splat.film.floor().max(Vec2::ZERO).as_uvec2();
                    let first_one = Some((pixel.x, pixel.y, first, value));
                    stats.invalid.merge(Invalid {
                        count: 1,
                        first: first_one,
                    });
                }
            }
            if any {
                film.add_everywhere(&splats.take());
            }
        }
        film.finish_pass(n);
    }
}

/// Samples that every tile takes.
struct Pass<'a> {
    job: &'a Job,
    transport: &'a Transport<'a>,
    iteration: &'a Iteration,
    filter: &'a FilterSampler,
    moving: bool,
    samples: Range<u64>,
}

impl Pass<'_> {
    /// Adds the samples to every pixel of the tile.
    fn render_tile(&self, tile: &mut Tile) -> (Ledger, Invalid) {
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
                for s in self.samples.clone() {
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
            // A sample of all pixels may take longer than a pass should.
            let n = affordable(PASS.as_secs_f64()).max(1);
            let n = n.min(affordable(left)).min(done);
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

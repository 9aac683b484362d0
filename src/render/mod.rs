//! Rendering: passes over the film, when to stop, and what it cost.

mod picture;
mod splats;
mod techniques;

pub use picture::{ComponentFormat, Metadata, PixelFormat};
pub use techniques::TechniqueStats;

use std::fmt;
use std::ops::{ControlFlow, Range};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::film::{self, ErrorEstimate, Film, FilmSpec, FilterSampler, SplatBuffer, Tile};
use crate::math::{Rgb, Vec2};
use crate::radiosity::{Report, SolveError};
use crate::sampler::{Sampler, SamplerKind, dim};
use crate::scene::{Camera, CameraSample, Scene};
use crate::transport::aov::{self, Aov};
use crate::transport::{
    Bias, IntegratorSpec, Iteration, Ledger, PathStats, PerTechnique, Setting, Technique, Transport,
};

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
    /// All of it.
    pub seconds: f64,
    pub phases: Phases,
    pub invalid: Invalid,
    /// Of the shadow rays, those that were traced for one technique alone.
    pub connections: PerTechnique<u64>,
    /// Of the photon rays, those of photons that were shot ahead of the samples.
    pub shot: u64,
    /// Radius of the disk that photons are gathered from in the first and in the last iteration, in scene units;
    /// `None` where there is none.
    pub radius: Option<[f32; 2]>,
    /// How far the solving for radiosity has come, while it is under way.
    pub solving: Option<SolvingStep>,
    /// What the solution is known to be, where there is one.
    pub solution: Option<Report>,
    /// What reading it did to the picture.
    pub bias: Bias,
}

/// A step of solving for radiosity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolvingStep {
    /// From 1.
    pub step: u64,
    pub patches: usize,
    /// Relative to the emitted power.
    pub residual: f64,
}

/// Why nothing was rendered.
#[derive(Clone, Debug, PartialEq)]
pub enum RenderError {
    /// Radiosity is asked for, and the scene has none.
    Radiosity(SolveError),
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RenderError::Radiosity(why) => write!(f, "cannot solve for radiosity: {why}"),
        }
    }
}

impl std::error::Error for RenderError {}

/// Where the time went, in seconds on the clock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Phases {
    /// What all iterations share, but for radiosity.
    pub setup: f64,
    /// Solving for radiosity.
    pub radiosity: f64,
    /// Shooting photons.
    pub photons: f64,
    /// Sorting them into maps.
    pub map: f64,
    /// The pixels' samples.
    pub samples: f64,
    /// Bringing light to the pixels where it arrives.
    pub splats: f64,
}

impl Phases {
    /// What went before the samples.
    pub fn precompute(&self) -> f64 {
        self.setup + self.radiosity + self.photons + self.map
    }
}

impl Stats {
    fn add(&mut self, later: Stats) {
        self.rays += later.rays;
        self.seconds += later.seconds;
        self.invalid.merge(later.invalid);
        self.shot += later.shot;
        self.bias += later.bias;
        self.solution = later.solution.or(self.solution.take());
        for (sum, n) in self.connections.iter_mut().zip(later.connections) {
            *sum += n;
        }
        let (sum, more) = (&mut self.phases, later.phases);
        sum.setup += more.setup;
        sum.radiosity += more.radiosity;
        sum.photons += more.photons;
        sum.map += more.map;
        sum.samples += more.samples;
        sum.splats += more.splats;
        self.radius = match (self.radius, later.radius) {
            (Some([first, _]), Some([_, last])) => Some([first, last]),
            (a, b) => a.or(b),
        };
    }

    fn add_ledger(&mut self, ledger: &Ledger) {
        self.rays += ledger.rays;
        self.bias += ledger.bias;
        for (sum, n) in self.connections.iter_mut().zip(ledger.connections) {
            *sum += n;
        }
    }
}

/// Longest pass: how often progress is shown and a request to stop is heard, memory and samples allowing.
const PASS: Duration = Duration::from_millis(400);

impl Job {
    /// An empty film for this job.
    pub fn new_film(&self, stop: Stop) -> Film {
        let spp = planned(stop);
        let crop = self.film.crop;
        let pixels = u64::from(crop.width) * u64::from(crop.height);
        let channels = self.aovs.iter().map(|l| l.aov.channels().len()).sum();
        let parts = self.integrator.techniques(&self.scene).len();
        Film::new(crop, film::replicates(spp, pixels), channels).with_parts(parts)
    }

    /// Renders until `stop` or until `on_pass`, called after every pass, breaks. Which samples a pass
    /// takes depends on the clock, but the sums they end up in do not: the film after n samples per
    /// pixel is the same bit for bit, however they were divided into passes and threads. While radiosity is
    /// solved for, `on_pass` sees every step with an empty film; if it breaks then, what is solved until then is
    /// shown by one sample per pixel.
    ///
    /// # Errors
    /// The integrator needs radiosity, and there is none.
    pub fn render(
        &self,
        stop: Stop,
        mut on_pass: impl FnMut(&Film, &Stats) -> ControlFlow<()>,
    ) -> Result<(Film, Stats), RenderError> {
        let start = Instant::now();
        let mut film = self.new_film(stop);
        let mut stats = Stats::default();
        let transport = self.transport(film.replicates(), planned(stop));
        stats.phases.setup = start.elapsed().as_secs_f64();
        let solved = transport.prepare(&mut |progress| {
            stats.seconds = start.elapsed().as_secs_f64();
            stats.solving = Some(SolvingStep {
                step: progress.step,
                patches: progress.mesh.len(),
                residual: progress.residual,
            });
            on_pass(&film, &stats)
        });
        stats.phases.radiosity = solved.map_err(RenderError::Radiosity)?;
        stats.solving = None;
        stats.solution = transport.solution_report().cloned();
        let prepared = start.elapsed();
        while let Some(n) = next_pass(stop, film.spp(), prepared, start.elapsed()) {
            let pass = self.add_pass(&transport, &mut film, n);
            stats.add(pass);
            stats.seconds = start.elapsed().as_secs_f64();
            if on_pass(&film, &stats).is_break() {
                break;
            }
        }
        Ok((film, stats))
    }

    /// Whether what the integrator keeps beside the film fits into the memory that it may take; if not, what is
    /// wrong.
    pub fn fits(&self) -> Result<(), String> {
        self.transport(1, None).fits()
    }

    /// The integrator, ready to take samples.
    fn transport(&self, replicates: u32, planned: Option<u64>) -> Transport<'_> {
        let setting = Setting {
            scene: &self.scene,
            camera: &self.camera,
            film: &self.film,
            sampler: self.sampler,
            seed: self.seed,
            replicates,
            planned,
        };
        Transport::new(&self.integrator, setting)
    }

    /// Takes the next `n` samples of every pixel, on all threads of the current pool.
    ///
    /// # Errors
    /// As of [`Job::render`].
    pub fn add_samples(&self, film: &mut Film, n: u64) -> Result<Stats, RenderError> {
        let start = Instant::now();
        let transport = self.transport(film.replicates(), None);
        let setup = start.elapsed().as_secs_f64();
        let solved = transport.prepare(&mut |_| ControlFlow::Continue(()));
        let radiosity = solved.map_err(RenderError::Radiosity)?;
        let mut stats = self.add_pass(&transport, film, n);
        stats.phases.setup = setup;
        stats.phases.radiosity = radiosity;
        stats.solution = transport.solution_report().cloned();
        stats.seconds += setup + radiosity;
        Ok(stats)
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
        let radius = |number: u64| transport.radius(number);
        if n > 0 {
            stats.radius = radius(film.next_sample() - n)
                .zip(radius(film.next_sample() - 1))
                .map(<[f32; 2]>::from);
        }
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
        let first = film.next_sample();
        let start = Instant::now();
        let mut ledger = Ledger::default();
        let iteration = transport.begin(first, &mut ledger);
        let begun = start.elapsed().as_secs_f64();
        stats.phases.map += ledger.map_seconds;
        stats.phases.photons += (begun - ledger.map_seconds).max(0.0);
        stats.shot += ledger.rays.photon;
        stats.add_ledger(&ledger);
        // A film that was not made for this job keeps none of their moments.
        let techniques = match film.parts() {
            0 => &[],
            _ => self.integrator.techniques(&self.scene),
        };
        let pass = Pass {
            job: self,
            transport,
            iteration: &iteration,
            filter: &filter,
            moving: self.camera.moves() || self.scene.moves(),
            samples: first..first + n,
            techniques,
        };
        let work = |tile: &mut Tile| pass.render_tile(tile);
        let mut done: Vec<(Ledger, Invalid)> = film.tiles_mut().par_iter_mut().map(work).collect();
        for (ledger, invalid) in &mut done {
            stats.add_ledger(ledger);
            stats.invalid.merge(std::mem::take(invalid));
        }
        stats.phases.samples += start.elapsed().as_secs_f64() - begun;
        if let Some(splats) = splats {
            let start = Instant::now();
            let lists = done.iter_mut().map(|(ledger, _)| &mut ledger.splats);
            let lists: Vec<_> = lists.filter(|list| !list.is_empty()).collect();
            if !lists.is_empty() {
                let part = techniques.iter().position(|t| *t == Technique::Splat);
                stats.invalid.merge(splats::add(lists, splats, film, part));
            }
            stats.phases.splats += start.elapsed().as_secs_f64();
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
    techniques: &'static [Technique],
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

/// Samples per pixel, where they are known before.
fn planned(stop: Stop) -> Option<u64> {
    match stop {
        Stop::Spp(n) => Some(n),
        Stop::Time(_) => None,
    }
}

/// Samples per pixel of the next pass; `None` to stop. `elapsed` counts from the start, and the first sample was
/// begun when it was `prepared`.
fn next_pass(stop: Stop, done: u64, prepared: Duration, elapsed: Duration) -> Option<u64> {
    if done == 0 {
        return match stop {
            Stop::Spp(0) => None,
            _ => Some(1),
        };
    }
    let per_sample = elapsed.saturating_sub(prepared).as_secs_f64() / done as f64;
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

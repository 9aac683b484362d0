//! Rendering: passes over the film, when to stop, and what it cost.

mod adaptive;
mod choice;
mod pass;
mod picture;
mod saved;
mod splats;
mod stats;
mod stop;
mod techniques;

pub use choice::{Choice, Measured, Trial};
pub use picture::{ComponentFormat, Metadata, PixelFormat, Recipe};
pub use saved::{Identity, Saved, merge};
pub use stats::{Invalid, Phases, SolvingStep, Stats};
pub use stop::{Shard, Stop, Target, Work};
pub use techniques::TechniqueStats;

use std::fmt;
use std::ops::ControlFlow;
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::film::{self, ErrorEstimate, Film, FilmSpec, FilterSampler, SplatBuffer, Tile};
use crate::radiosity::SolveError;
use crate::sampler::SamplerKind;
use crate::scene::{Camera, Scene};
use crate::transport::aov::Aov;
use crate::transport::{IntegratorSpec, Ledger, Setting, Technique, Transport};
use pass::{Pass, Samples};
use stop::Clock;

/// A layer of arbitrary output variables that the picture gets beside its colours.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

/// Why nothing was rendered.
#[derive(Clone, Debug, PartialEq)]
pub enum RenderError {
    /// Radiosity is asked for, and the scene has none.
    Radiosity(SolveError),
    /// An integrator is to be chosen, and none of those that were to be tried can render the scene.
    NoChoice(Choice),
}

impl fmt::Display for RenderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RenderError::Radiosity(why) => write!(f, "cannot solve for radiosity: {why}"),
            RenderError::NoChoice(choice) => {
                write!(f, "no integrator that may be chosen can render the scene")?;
                let failed = choice.trials.iter();
                let failed = failed.filter_map(|t| Some((t.options, t.found.as_ref().err()?)));
                failed
                    .into_iter()
                    .try_for_each(|(options, why)| write!(f, "; {options}: {why}"))
            }
        }
    }
}

impl std::error::Error for RenderError {}

impl Job {
    /// An empty film for this job.
    pub fn new_film(&self, stop: Stop) -> Film {
        self.film_for(&Work::whole(stop))
    }

    /// An empty film for a part of this job.
    pub fn film_for(&self, work: &Work) -> Film {
        let crop = self.film.crop;
        let pixels = u64::from(crop.width) * u64::from(crop.height);
        let channels = self.aovs.iter().map(|l| l.aov.channels().len()).sum();
        let parts = self.integrator.techniques(&self.scene).len();
        let film = match work.stop {
            Stop::Error { .. } if self.is_adaptive() => {
                let replicates = film::replicates(None, pixels).min(adaptive::REPLICATES);
                Film::adaptive(crop, replicates, channels)
            }
            stop => {
                let replicates = film::replicates(stop.spp(), pixels);
                let first = work.range().map_or(0, |range| range.start);
                Film::new(crop, replicates, channels).from_sample(first)
            }
        };
        film.with_parts(parts)
    }

    /// Whether some pixels can have more samples than others: light that is splatted, and photons that are shot anew
    /// for each sample, serve all alike.
    pub fn is_adaptive(&self) -> bool {
        !self.transport(1, None).iterates()
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
        on_pass: impl FnMut(&Film, &Stats) -> ControlFlow<()>,
    ) -> Result<(Film, Stats), RenderError> {
        let work = Work::whole(stop);
        self.go_on(&work, self.film_for(&work), Stats::default(), on_pass)
    }

    /// As [`Job::render`], from what was done of `work` before: an empty film of [`Job::film_for`], or one that was
    /// saved.
    ///
    /// # Errors
    /// As of [`Job::render`].
    pub fn go_on(
        &self,
        work: &Work,
        film: Film,
        mut stats: Stats,
        on_pass: impl FnMut(&Film, &Stats) -> ControlFlow<()>,
    ) -> Result<(Film, Stats), RenderError> {
        let start = Instant::now();
        let transport = self.transport(film.replicates(), work.stop.spp());
        let setup = start.elapsed().as_secs_f64();
        stats.phases.setup += setup;
        stats.seconds += setup;
        self.go_on_by(&transport, work, film, stats, on_pass)
    }

    /// The same by an integrator that is ready.
    fn go_on_by(
        &self,
        transport: &Transport,
        work: &Work,
        mut film: Film,
        mut stats: Stats,
        mut on_pass: impl FnMut(&Film, &Stats) -> ControlFlow<()>,
    ) -> Result<(Film, Stats), RenderError> {
        let start = Instant::now();
        let before = stats.seconds;
        let solved = transport.prepare(&mut |progress| {
            stats.seconds = before + start.elapsed().as_secs_f64();
            stats.solving = Some(SolvingStep {
                step: progress.step,
                patches: progress.mesh.len(),
                residual: progress.residual,
            });
            on_pass(&film, &stats)
        });
        stats.phases.radiosity += solved.map_err(RenderError::Radiosity)?;
        stats.solving = None;
        stats.solution = transport.solution_report().cloned();
        let mut clock = Clock::new(start, before);
        loop {
            if let Stop::Error { target, .. } = work.stop
                && adaptive::round_is_done(&film)
                && !adaptive::plan_round(&mut film, &target)
            {
                break;
            }
            let Some(samples) = clock.next_pass(work, &film) else {
                break;
            };
            let begun = Instant::now();
            let done = film.samples();
            let pass = self.add_pass(transport, &mut film, &samples);
            clock.count(film.samples() - done, begun.elapsed());
            stats.add(pass);
            stats.seconds = before + start.elapsed().as_secs_f64();
            if on_pass(&film, &stats).is_break() {
                break;
            }
        }
        Ok((film, stats))
    }

    /// Whether a picture is as good as `target` says.
    pub fn is_good_enough(&self, film: &Film, target: &Target) -> bool {
        film.samples() > 0 && adaptive::is_good_enough(film, target)
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
        let next = film.next_sample();
        let mut stats = self.add_pass(&transport, film, &Samples::Range(next..next + n));
        stats.phases.setup = setup;
        stats.phases.radiosity = radiosity;
        stats.solution = transport.solution_report().cloned();
        stats.seconds += setup + radiosity;
        Ok(stats)
    }

    fn add_pass(&self, transport: &Transport, film: &mut Film, samples: &Samples) -> Stats {
        let start = Instant::now();
        let mut stats = Stats::default();
        match samples {
            Samples::Range(range) if transport.iterates() => {
                let mut splats = SplatBuffer::new(self.film.crop, self.film.filter);
                for s in range.clone() {
                    let one = Samples::Range(s..s + 1);
                    self.add_iteration(transport, film, &one, &mut stats, Some(&mut splats));
                }
            }
            _ => self.add_iteration(transport, film, samples, &mut stats, None),
        }
        stats.seconds = start.elapsed().as_secs_f64();
        if let Samples::Range(range) = samples
            && !range.is_empty()
        {
            let [first, last] = [range.start, range.end - 1].map(|s| transport.radius(s));
            stats.radius = first.zip(last).map(<[f32; 2]>::from);
        }
        stats
    }

    /// Takes samples that share what the first of them begins.
    fn add_iteration(
        &self,
        transport: &Transport,
        film: &mut Film,
        samples: &Samples,
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
            techniques,
        };
        let work = |tile: &mut Tile| {
            let (more, numbers) = samples.of(tile);
            let (ledger, invalid) = pass.render_tile(tile, &numbers);
            (more, ledger, invalid)
        };
        let mut done: Vec<_> = film.tiles_mut().par_iter_mut().map(work).collect();
        for (_, ledger, invalid) in &mut done {
            stats.add_ledger(ledger);
            stats.invalid.merge(std::mem::take(invalid));
        }
        stats.phases.samples += start.elapsed().as_secs_f64() - begun;
        if let Some(splats) = splats {
            let start = Instant::now();
            let lists = done.iter_mut().map(|(_, ledger, _)| &mut ledger.splats);
            let lists: Vec<_> = lists.filter(|list| !list.is_empty()).collect();
            if !lists.is_empty() {
                let part = techniques.iter().position(|t| *t == Technique::Splat);
                stats.invalid.merge(splats::add(lists, splats, film, part));
            }
            stats.phases.splats += start.elapsed().as_secs_f64();
        }
        for (tile, (more, ledger, _)) in film.tiles_mut().iter_mut().zip(&done) {
            tile.take(more);
            tile.add_cost(ledger.rays.total());
        }
    }
}

/// Estimated error of a film as a percentage: the root of its relMSE with the interval's ends.
pub fn percent(e: &ErrorEstimate) -> [f64; 3] {
    [e.relmse, e.ci95[0], e.ci95[1]].map(|v| 100.0 * v.sqrt())
}

//! What rendering took, and what it left out.

use serde::{Deserialize, Serialize};

use crate::math::Rgb;
use crate::radiosity::Report;
use crate::transport::{Bias, Ledger, PathStats, PerTechnique};

/// Samples whose value was NaN, infinite or negative. They are left out of the film and reported: each
/// one is a fault of the program, never hidden.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Invalid {
    pub count: u64,
    /// Pixel, sample number and value of the first one, in the order of tiles.
    pub first: Option<(u32, u32, u64, Rgb)>,
}

impl Invalid {
    pub(super) fn merge(&mut self, later: Invalid) {
        self.count += later.count;
        self.first = self.first.or(later.first);
    }
}

/// What rendering took.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
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
    #[serde(skip)]
    pub solving: Option<SolvingStep>,
    /// What the solution is known to be, where there is one.
    #[serde(skip)]
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

/// Where the time went, in seconds on the clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Trying integrators that were not chosen.
    #[serde(default)]
    pub trials: f64,
}

impl Phases {
    /// What went before the samples.
    pub fn precompute(&self) -> f64 {
        self.setup + self.radiosity + self.photons + self.map + self.trials
    }
}

impl Stats {
    /// Of samples that were taken later, or elsewhere.
    pub fn add(&mut self, later: Stats) {
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
        sum.trials += more.trials;
        self.radius = match (self.radius, later.radius) {
            (Some([first, _]), Some([_, last])) => Some([first, last]),
            (a, b) => a.or(b),
        };
    }

    pub(super) fn add_ledger(&mut self, ledger: &Ledger) {
        self.rays += ledger.rays;
        self.bias += ledger.bias;
        for (sum, n) in self.connections.iter_mut().zip(ledger.connections) {
            *sum += n;
        }
    }
}

impl Stats {
    pub fn rays_per_second(&self) -> f64 {
        self.rays.total() as f64 / self.seconds.max(1e-9)
    }
}

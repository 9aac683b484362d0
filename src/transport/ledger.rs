//! What samples leave behind beside their radiance: counts of rays, light for other pixels, and how much each
//! technique brought.

use std::time::Instant;

use super::light_walk::LightVertex;
use super::radiosity::Bias;
use crate::film::Splat;
use crate::math::Rgb;

/// Rays traced, by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct PathStats {
    pub camera: u64,
    pub shadow: u64,
    pub indirect: u64,
    /// Of walks that start at lights.
    pub photon: u64,
}

impl PathStats {
    pub fn total(&self) -> u64 {
        self.camera + self.shadow + self.indirect + self.photon
    }
}

impl std::ops::AddAssign for PathStats {
    fn add_assign(&mut self, o: PathStats) {
        self.camera += o.camera;
        self.shadow += o.shadow;
        self.indirect += o.indirect;
        self.photon += o.photon;
    }
}

/// A way to find light paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Technique {
    /// The walk from the eye runs into an emitter.
    Emission,
    /// A vertex of the eye's walk is connected to a point of an emitter.
    NextEvent,
    /// Both of these, where they are not told apart.
    Path,
    /// Vertices of both walks are connected.
    Connection,
    /// A vertex of the light's walk is connected to the camera.
    Splat,
    /// Photons near a vertex of the eye's walk.
    Merging,
}

impl Technique {
    pub const COUNT: usize = 6;

    pub fn name(self) -> &'static str {
        match self {
            Technique::Emission => "emission",
            Technique::NextEvent => "next_event",
            Technique::Path => "path",
            Technique::Connection => "connection",
            Technique::Splat => "splat",
            Technique::Merging => "merging",
        }
    }
}

/// A number per technique, at `technique as usize`.
pub type PerTechnique<T> = [T; Technique::COUNT];

/// The books of one thread.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    pub rays: PathStats,
    /// Of the shadow rays, those that were traced for one technique alone.
    pub connections: PerTechnique<u64>,
    /// Light for wherever in the picture it arrives, in the order it was found.
    pub splats: Vec<Splat>,
    /// What reading a cache of radiosity did to the picture, ...
    pub bias: Bias,
    /// ... and to the sample under way.
    pub(super) fresh_bias: Bias,
    /// Seconds spent on sorting photons into maps, by the thread that waited for it.
    pub map_seconds: f64,
    /// Luminance that the sample under way owes to each technique.
    parts: PerTechnique<f64>,
    /// Where walks from lights are kept while they are joined with one from the eye.
    pub(super) light: Vec<LightVertex>,
}

impl Ledger {
    /// Notes what `technique` brought to the sample under way: a weighted contribution, all of which add up to
    /// the sample's radiance. Splats are counted where they arrive instead.
    #[inline]
    pub fn record(&mut self, technique: Technique, value: Rgb) {
        self.parts[technique as usize] += f64::from(value.luminance());
    }

    /// Counts a shadow ray that `technique` needs.
    #[inline]
    pub fn connect(&mut self, technique: Technique) {
        self.rays.shadow += 1;
        self.connections[technique as usize] += 1;
    }

    /// What was recorded since the last call.
    #[inline]
    pub fn take_parts(&mut self) -> PerTechnique<f64> {
        std::mem::take(&mut self.parts)
    }

    /// Ends a sample that counts `weight` times in the picture.
    #[inline]
    pub fn settle(&mut self, weight: f32) {
        if self.fresh_bias.reads > 0 {
            let fresh = std::mem::take(&mut self.fresh_bias);
            self.bias += fresh.scaled(f64::from(weight));
        }
    }

    /// Makes a photon map with `build`, on the clock.
    pub fn build_map<T>(&mut self, build: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let map = build();
        self.map_seconds += start.elapsed().as_secs_f64();
        map
    }
}

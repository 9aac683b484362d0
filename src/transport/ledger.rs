//! What samples leave behind beside their radiance: counts of rays, light for other pixels, and how much each
//! technique brought.

use super::light_walk::LightVertex;
use crate::film::Splat;
use crate::math::Rgb;

/// Rays traced, by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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
    /// Vertices of both walks are connected.
    Connection,
    /// A vertex of the light's walk is connected to the camera.
    Splat,
    /// Photons near a vertex of the eye's walk.
    Merging,
}

/// The books of one thread.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    pub rays: PathStats,
    /// Light for wherever in the picture it arrives, in the order it was found.
    pub splats: Vec<Splat>,
    /// Where walks from lights are kept while they are joined with one from the eye.
    pub(super) light: Vec<LightVertex>,
}

impl Ledger {
    /// Notes what `technique` brought to the picture: a weighted contribution.
    #[inline]
    pub fn record(&mut self, _technique: Technique, _value: Rgb) {}
}

//! Photons that delta lobes alone brought from an emitter, and what they add at a vertex of the eye's walk.

use crate::math::Rgb;
use crate::transport::PathStats;
use crate::transport::light_walk::LightVertex;
use crate::transport::path::{Gather, Gathered, Vertex};
use crate::transport::photons::{Kernel, Photon, PhotonMap};

/// The photon to keep at `vertex`, which receives photons, if any.
#[inline]
pub fn caustic(vertex: &LightVertex) -> Option<Photon> {
    (vertex.scattered > 0 && vertex.specular).then(|| Photon::of(vertex))
}

/// The caustic photons of one iteration.
pub struct Caustics {
    pub map: PhotonMap<Photon>,
    pub kernel: Kernel,
    /// One over the number of walks.
    pub share: f32,
}

impl Caustics {
    /// Radiance that the photons around `vertex` send towards the eye, on paths of at most `max_depth` edges.
    #[inline]
    pub fn at(&self, vertex: &Vertex, max_depth: u32) -> Rgb {
        Photon::gather(&self.map, &self.kernel, vertex, max_depth) * self.share
    }
}

/// Gathers caustics along one walk of the eye.
pub struct Gathering<'a> {
    /// `None` leaves them out.
    pub caustics: Option<&'a Caustics>,
    pub max_depth: u32,
    /// Whether nothing else is shown.
    pub alone: bool,
    /// What was gathered, as it counts in the picture.
    pub found: Rgb,
}

impl Gather for Gathering<'_> {
    const TAKES_CAUSTICS: bool = true;

    #[inline]
    fn alone(&self) -> bool {
        self.alone
    }

    #[inline]
    fn at(&mut self, vertex: &Vertex, _: &mut PathStats) -> Gathered {
        let Some(caustics) = self.caustics else {
            return Gathered::Nothing;
        };
        let lit = caustics.at(vertex, self.max_depth);
        self.found += vertex.throughput * lit;
        Gathered::Also(lit)
    }
}

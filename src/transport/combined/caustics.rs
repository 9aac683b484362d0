//! Photons that delta lobes alone brought from an emitter, and what they add at a vertex of the eye's walk.

use crate::math::Rgb;
use crate::scene::Scene;
use crate::transport::PathStats;
use crate::transport::light_walk::LightVertex;
use crate::transport::path::{Gather, Gathered, Vertex};
use crate::transport::photons::{Photon, PhotonMap};

/// The photon to keep at `vertex`, if any.
#[inline]
pub fn caustic(scene: &Scene, vertex: &LightVertex) -> Option<Photon> {
    let caustic = vertex.scattered > 0 && vertex.specular && scene.receives(&vertex.hit);
    caustic.then(|| Photon::of(vertex))
}

/// The caustic photons of one iteration.
pub struct Caustics {
    pub map: PhotonMap<Photon>,
    /// One over the number of walks and the area that photons are gathered from.
    pub density: f32,
}

impl Caustics {
    /// Radiance that the photons around `vertex` send towards the eye, on paths of at most `max_depth` edges.
    #[inline]
    pub fn at(&self, vertex: &Vertex, max_depth: u32) -> Rgb {
        let mut sum = Rgb::BLACK;
        self.map.within(vertex.hit.p, |photon, _| {
            sum += photon.scattered(vertex, max_depth);
        });
        sum * self.density
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

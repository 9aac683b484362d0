//! Photons that delta lobes alone brought from an emitter, and what they add at a vertex of the eye's walk.

use crate::bsdf::Mode;
use crate::math::{Rgb, Vec3};
use crate::scene::Scene;
use crate::transport::PathStats;
use crate::transport::light_walk::LightVertex;
use crate::transport::path::{Gather, Gathered, Vertex};
use crate::transport::photons::PhotonMap;

/// Light of a caustic as it arrives at a surface.
#[derive(Clone, Copy, Debug)]
pub struct CausticPhoton {
    /// Unit direction to where it came from.
    wi: Vec3,
    /// Geometric normal of the surface.
    ng: Vec3,
    /// In W, times the number of walks.
    power: Rgb,
    /// From the emitter to here.
    edges: u32,
}

impl CausticPhoton {
    /// The photon to keep at `vertex`, if any.
    #[inline]
    pub fn of(scene: &Scene, vertex: &LightVertex) -> Option<CausticPhoton> {
        let caustic = vertex.scattered > 0 && vertex.specular && scene.receives(&vertex.hit);
        caustic.then_some(CausticPhoton {
            wi: vertex.hit.wo,
            ng: vertex.hit.ng,
            power: vertex.power,
            edges: vertex.edges,
        })
    }
}

/// The caustic photons of one iteration.
pub struct Caustics {
    pub map: PhotonMap<CausticPhoton>,
    /// One over the number of walks and the area that photons are gathered from.
    pub density: f32,
}

impl Caustics {
    /// Radiance that the photons around `vertex` send towards the eye, on paths of at most `max_depth` edges.
    #[inline]
    pub fn at(&self, vertex: &Vertex, max_depth: u32) -> Rgb {
        let Vertex { hit, shading, .. } = *vertex;
        let mut sum = Rgb::BLACK;
        self.map.within(hit.p, |photon, _| {
            if photon.edges + vertex.edges > max_depth || photon.ng.dot(hit.ng) < SAME_SIDE {
                return;
            }
            let (f_cos, _) = shading.eval_pdf(photon.wi, Mode::Radiance);
            if f_cos.is_black() {
                return;
            }
            let lit = photon.power * f_cos * (1.0 / hit.ng.dot(photon.wi).abs());
            // Light along the surface brings nothing.
            if lit.is_finite() {
                sum += lit;
            }
        });
        sum * self.density
    }
}

/// Least cosine between the normals where a photon lies and where it is gathered.
const SAME_SIDE: f32 = 0.5;

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

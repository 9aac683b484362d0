//! A photon, and what it brings where it is gathered.

use super::{Kernel, PhotonMap};
use crate::bsdf::Mode;
use crate::math::{Rgb, Vec3};
use crate::transport::light_walk::LightVertex;
use crate::transport::path::Vertex;

/// Light as it arrives at a surface.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Unit direction to where it came from.
    wi: Vec3,
    /// Geometric normal of the surface.
    ng: Vec3,
    /// In W, times the number of walks.
    power: Rgb,
    /// From the emitter to here.
    edges: u32,
}

// A map adds the point: 52 bytes in all, which the README states.
const _: () = assert!(size_of::<Photon>() == 40);

impl Photon {
    #[inline]
    pub fn of(vertex: &LightVertex) -> Photon {
        Photon {
            wi: vertex.hit.wo,
            ng: vertex.hit.ng,
            power: vertex.power,
            edges: vertex.edges,
        }
    }

    /// What it brings of the light that leaves `vertex` towards the eye, on paths of at most `max_depth` edges:
    /// times the density of the kernel, radiance. It lies at `offset` from the vertex; `None` where it lies on
    /// another surface, or brings nothing.
    #[inline]
    pub(in crate::transport) fn seen(
        &self,
        kernel: &Kernel,
        vertex: &Vertex,
        offset: Vec3,
        max_depth: u32,
    ) -> Option<Rgb> {
        if self.edges + vertex.edges > max_depth || !kernel.accepts(vertex.hit, self.ng, offset) {
            return None;
        }
        let (f_cos, _) = vertex.shading.eval_pdf(self.wi, Mode::Radiance);
        let lit = self.power * f_cos * (1.0 / vertex.hit.ng.dot(self.wi).abs());
        // Light along the surface brings nothing.
        (lit.is_finite() && !lit.is_black()).then_some(lit)
    }

    /// Radiance that the photons of `map` around `vertex` send towards the eye, if one walk made them.
    #[inline]
    pub(in crate::transport) fn gather(
        map: &PhotonMap<Photon>,
        kernel: &Kernel,
        vertex: &Vertex,
        max_depth: u32,
    ) -> Rgb {
        let mut sum = Rgb::BLACK;
        map.around(vertex.hit.p, |photon, offset, d2| {
            if let Some(lit) = photon.seen(kernel, vertex, offset, max_depth) {
                sum += lit * kernel.eval(d2);
            }
        });
        sum
    }
}

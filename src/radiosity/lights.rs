//! Light from emitters that are no patches: points, directions, environments, beams, and surfaces that move.

use super::optics::rgb64;
use super::piece::Piece;
use super::surfaces::Surfaces;
use super::{PatchMesh, Rgb64, mesh};
use crate::light::EmitterId;
use crate::math::{DVec2, Vec2};
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use rayon::prelude::*;

/// Connections to lights per patch.
const CONNECTIONS: u32 = 256;

/// Surfaces that are not there, and that light passes one after the other.
const PASSES: u32 = 64;

/// The lights of a scene that are no patches.
pub struct Others<'a> {
    scene: &'a Scene,
    surfaces: &'a Surfaces,
    /// By shape: whether its surface has facets, so that its emission is theirs.
    has_facets: Vec<bool>,
    /// Whether there are any.
    any: bool,
}

impl<'a> Others<'a> {
    pub fn new(scene: &'a Scene, surfaces: &'a Surfaces) -> Others<'a> {
        let mut has_facets = vec![false; scene.world().geometries().len()];
        for facet in surfaces.facets() {
            if let Some(known) = has_facets.get_mut(facet.shape.0 as usize) {
                *known = true;
            }
        }
        let mut others = Others {
            scene,
            surfaces,
            has_facets,
            any: false,
        };
        let lights = 0..scene.counts().emitters as u32;
        others.any = lights.map(EmitterId).any(|id| !others.is_of_patches(id));
        others
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// Mean irradiance in W/m² on a piece of facet number `facet`, from about `connections` well-spread points.
    /// `number` is one for each piece: points of different pieces are independent.
    pub fn irradiance(
        &self,
        facet: u32,
        piece: &Piece,
        connections: u32,
        number: u64,
        seed: u64,
    ) -> Rgb64 {
        if !self.any {
            return Rgb64::ZERO;
        }
        let mut sum = Rgb64::ZERO;
        for i in 0..connections {
            let sampler = Sampler::new(SamplerKind::Sobol, seed, number, u64::from(i), 1);
            let [x, y, u, v] = sampler.get4(0);
            let [pick, ..] = sampler.get4(1);
            let st = piece.outline.sample(DVec2::new(f64::from(x), f64::from(y)));
            let hit = mesh::on_facet(self.scene, self.surfaces, facet, piece, st);
            let Some(sample) = self.scene.sample_light(&hit, pick, Vec2::new(u, v)) else {
                continue;
            };
            if self.is_of_patches(sample.emitter) {
                continue;
            }
            let front = match hit.ng.dot(hit.wo) < 0.0 {
                true => -hit.ng,
                false => hit.ng,
            };
            let cos = front.dot(sample.wi);
            let weight = rgb64(sample.weight());
            if cos > 0.0 && weight.is_finite() && weight != Rgb64::ZERO {
                let passes = self.scene.transmittance(&sample.shadow_ray(&hit), PASSES);
                sum += weight * f64::from(cos * passes);
            }
        }
        sum / f64::from(connections.max(1))
    }

    fn is_of_patches(&self, id: EmitterId) -> bool {
        let shape = self.scene.lambertian_shape(id);
        shape.is_some_and(|s| self.has_facets.get(s.0 as usize) == Some(&true))
    }
}

/// Irradiance of every patch in W/m² from lights that are no patches.
pub fn external(scene: &Scene, mesh: &PatchMesh, seed: u64) -> Vec<Rgb64> {
    let others = Others::new(scene, &mesh.surfaces);
    let of = |(i, patch): (usize, &super::Patch)| {
        others.irradiance(patch.facet, &patch.piece, CONNECTIONS, i as u64, seed)
    };
    mesh.patches.par_iter().enumerate().map(of).collect()
}

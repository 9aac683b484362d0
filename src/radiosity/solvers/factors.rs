//! Form factors in closed form from the middle of a patch.

use super::Exchange;
use crate::geom::{Endpoint, Hit};
use crate::radiosity::PatchMesh;
use crate::radiosity::polygon::point_to_polygon;
use crate::scene::Scene;

pub(super) struct Lambert<'a> {
    scene: &'a Scene,
    mesh: &'a PatchMesh,
    hits: Vec<Hit>,
}

impl<'a> Lambert<'a> {
    pub fn new(scene: &'a Scene, mesh: &'a PatchMesh) -> Lambert<'a> {
        let middle = |i| mesh.hit(scene, i, mesh.patches[i as usize].piece.outline.center());
        Lambert {
            scene,
            mesh,
            hits: (0..mesh.len() as u32).map(middle).collect(),
        }
    }

    fn pair(&self, i: usize, j: usize) -> f64 {
        let (a, b) = (&self.mesh.patches[i].piece, &self.mesh.patches[j].piece);
        let (p, n) = (a.center(), a.normal());
        if i == j || b.normal().dot(p - b.o) <= 0.0 {
            return 0.0;
        }
        let f = point_to_polygon(p, n, b.corners());
        let blocked = || {
            let ray = self.hits[i].spawn_to(&Endpoint::from(&self.hits[j]));
            self.scene.occluded(&ray)
        };
        if f == 0.0 || blocked() { 0.0 } else { f }
    }
}

impl Exchange for Lambert<'_> {
    fn row(&self, i: u32, out: &mut [f64]) {
        for (j, f) in out.iter_mut().enumerate() {
            *f = self.pair(i as usize, j);
        }
    }

    fn column(&self, i: u32, out: &mut [f64]) {
        for (j, f) in out.iter_mut().enumerate() {
            *f = self.pair(j, i as usize);
        }
    }
}

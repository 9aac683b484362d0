//! What the camera's walk finds where it first scatters, and the rays that it sends out from there.

use super::{Maps, PhotonMapperSpec};
use crate::bsdf::{Density, Mode};
use crate::math::{Rgb, Vec3};
use crate::scene::Scene;
use crate::transport::path::{Departure, Gather, Gathered, Start, Vertex};
use crate::transport::{Connect, Mis, PathStats, VertexNumbers, direct_light};

/// Settles the light at the first vertex with a lobe that is not a delta one.
pub struct FirstVertex<'a> {
    pub spec: &'a PhotonMapperSpec,
    pub scene: &'a Scene,
    pub maps: Option<&'a Maps>,
    pub max_depth: u32,
}

impl Gather for FirstVertex<'_> {
    const TAKES_CAUSTICS: bool = true;

    fn at(&mut self, vertex: &Vertex, stats: &mut PathStats) -> Gathered {
        let Some(maps) = self.maps else {
            return Gathered::Nothing;
        };
        let rays = match vertex.shading.bsdf.is_diffuse() {
            true => self.spec.gather_samples,
            false => self.spec.glossy_samples,
        };
        let mut lit = maps.caustic(vertex, self.max_depth);
        lit += self.direct(vertex, rays, stats);
        lit += self.gather(vertex, rays, maps, stats);
        Gathered::Instead(lit)
    }
}

impl FirstVertex<'_> {
    /// Light straight from emitters, of which gathering rays will find their share.
    fn direct(&self, vertex: &Vertex, rays: u32, stats: &mut PathStats) -> Rgb {
        let n = self.spec.direct_samples;
        let connect = Connect {
            mis: match rays {
                0 => Mis::LightOnly,
                _ => Mis::Power {
                    bsdf_per_light: rays as f32 / n as f32,
                },
            },
            passes: self.max_depth - vertex.edges - 1,
        };
        let mut sum = Rgb::BLACK;
        for i in 0..n {
            let sampler = vertex.sampler.of_part(i, n);
            let numbers = VertexNumbers::new(&sampler, vertex.edges - 1);
            let u = numbers.draw(self.scene.lights_are_chosen());
            let (hit, shading) = (vertex.hit, vertex.shading);
            sum += direct_light(self.scene, hit, shading, connect, u.pick, u.light, stats);
        }
        sum * (1.0 / n as f32)
    }

    /// Light of other surfaces, and what the rays meet of emitters.
    fn gather(&self, vertex: &Vertex, rays: u32, maps: &Maps, stats: &mut PathStats) -> Rgb {
        let hit = vertex.hit;
        let mut sum = Rgb::BLACK;
        for i in 0..rays {
            let sampler = vertex.sampler.of_part(i, rays);
            let u = VertexNumbers::new(&sampler, vertex.edges - 1).draw(true);
            let Some(sample) = vertex.shading.sample(u.lobe, u.direction, Mode::Radiance) else {
                continue;
            };
            // Delta lobes lead the camera's own walk on.
            if sample.density == Density::Delta {
                continue;
            }
            let start = Start {
                ray: hit.spawn(sample.wi),
                edges: vertex.edges,
                throughput: sample.weight,
                eta2: sample.eta * sample.eta,
                departure: Some(Departure {
                    from: *hit,
                    density: sample.density,
                    light_per_bsdf: self.spec.direct_samples as f32 / rays as f32,
                }),
            };
            stats.indirect += 1;
            let mut second = SecondVertex {
                maps,
                max_depth: self.max_depth,
                from: hit.p,
            };
            let path = &self.spec.path;
            sum += path
                .walk(self.scene, start, &sampler, stats, &mut second)
                .radiance;
        }
        match rays {
            0 => Rgb::BLACK,
            _ => sum * (1.0 / rays as f32),
        }
    }
}

/// Ends a gathering ray at the first surface whose photons lie apart from where the ray comes from.
struct SecondVertex<'a> {
    maps: &'a Maps,
    max_depth: u32,
    /// The last vertex with a lobe that is not a delta one.
    from: Vec3,
}

impl Gather for SecondVertex<'_> {
    const TAKES_CAUSTICS: bool = true;

    fn at(&mut self, vertex: &Vertex, _: &mut PathStats) -> Gathered {
        let p = vertex.hit.p;
        let found = self.maps.global(vertex, self.max_depth);
        if self.from.distance_squared(p) > found.radius * found.radius {
            return Gathered::Instead(found.radiance);
        }
        self.from = p;
        Gathered::Also(self.maps.caustic(vertex, self.max_depth))
    }
}

//! The walk of light from an emitter through the scene: what photons and light subpaths have in common.
//!
//! The walk carries power and, for bidirectional methods, what multiple importance sampling must know of the
//! way so far ([`State`]).

use super::PathStats;
use super::mis::{self, State, Techniques};
use crate::bsdf::{Bsdf, BsdfSample, Density, Mode};
use crate::geom::Hit;
use crate::light::{Aim, Emission, EmissionNumbers};
use crate::material::Shading;
use crate::math::{Rgb, Vec2, Vec3};
use crate::sampler::{Sampler, dim};
use crate::scene::Scene;

use super::VertexNumbers;

/// Settings of the walk.
#[derive(Clone, Copy, Debug)]
pub struct LightWalk<'a> {
    pub scene: &'a Scene,
    pub aim: &'a Aim,
    pub techniques: Techniques,
    /// Most edges of the walk.
    pub max_edges: u32,
    /// Whether only delta lobes carry the light on: the walk ends at the first other.
    pub specular_only: bool,
}

/// Light that arrives at a surface.
#[derive(Clone, Copy, Debug)]
pub struct LightVertex {
    /// `hit.wo` leads back to where the light came from.
    pub hit: Hit,
    pub shading: Shading,
    /// Chooses what a mixed material is; that of `shading`.
    pub u_material: f32,
    /// In W: the share of the emitters' light that this walk stands for.
    pub power: Rgb,
    pub state: State,
    /// Edges from the emitter to here, boundaries that are not there counted.
    pub edges: u32,
    /// Times that the light was scattered before it came here.
    pub scattered: u32,
    /// Whether all of these were by delta lobes.
    pub specular: bool,
}

/// What became of a walk.
#[derive(Clone, Copy, Debug)]
pub struct Walked {
    /// Power that it began with, in W; black where no emitter sent anything.
    pub emitted: Rgb,
    /// Power that it ended with. Surfaces absorbed the rest on the way: less than nothing, where chance made up
    /// for other walks that it ended.
    pub left: Rgb,
    pub end: End,
}

/// How a walk ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// All that was left is absorbed too.
    Absorbed,
    /// Light leaves the scene.
    Escaped,
    /// Light would go on, but nobody asks for it.
    Stopped,
}

/// Light on its way to the next surface.
struct OnTheWay {
    from: Vec3,
    power: Rgb,
    scattered: u32,
    specular: bool,
    leg: Leg,
}

enum Leg {
    First(Emission),
    Later(mis::Leg),
}

impl LightWalk<'_> {
    /// Follows the light that `sampler` starts at `time`, and calls `visit` for each surface that it meets,
    /// as long as that says to go on.
    pub fn walk(
        &self,
        sampler: &Sampler,
        time: f32,
        stats: &mut PathStats,
        mut visit: impl FnMut(&LightVertex) -> bool,
    ) -> Walked {
        let [pick, aim, ..] = sampler.get4(dim::EMISSION);
        let [x, y, dx, dy] = sampler.get4(dim::EMISSION + 1);
        let numbers = EmissionNumbers {
            pick,
            aim,
            place: Vec2::new(x, y),
            direction: Vec2::new(dx, dy),
            time,
        };
        let Some(emission) = self.scene.sample_emission(self.aim, &numbers) else {
            return Walked {
                emitted: Rgb::BLACK,
                left: Rgb::BLACK,
                end: End::Absorbed,
            };
        };
        let mut end = End::Stopped;
        let mut ray = emission.ray;
        let mut way = OnTheWay {
            from: ray.o,
            power: emission.power,
            scattered: 0,
            specular: true,
            leg: Leg::First(emission),
        };
        for depth in 0..self.max_edges {
            stats.photon += 1;
            let Some(hit) = self.scene.intersect(&ray) else {
                end = End::Escaped;
                break;
            };
            let independent;
            let sampler = match depth < super::path::SPREAD_VERTICES {
                true => sampler,
                false => {
                    independent = sampler.independent();
                    &independent
                }
            };
            let mut numbers = VertexNumbers::new(sampler, depth);
            let u_material = numbers.material(self.scene);
            let shading = self.scene.shade(&hit, u_material);
            let vertex = LightVertex {
                hit,
                shading,
                u_material,
                power: way.power,
                state: self.arrive(&way, &hit),
                edges: depth + 1,
                scattered: way.scattered,
                specular: way.specular,
            };
            if !visit(&vertex) || depth + 1 >= self.max_edges {
                break;
            }
            if let Bsdf::Null(passed) = shading.bsdf {
                way.power *= passed.transmittance;
                ray = hit.spawn(ray.d);
                continue;
            }
            let u = numbers.draw(true);
            let Some(sample) = shading.sample(u.lobe, u.direction, Mode::Importance) else {
                end = End::Absorbed;
                break;
            };
            if self.specular_only && sample.density != Density::Delta {
                break;
            }
            let weight = self.weight(&vertex, &sample);
            // Power that is lost ends walks instead of weakening them, so that all photons count alike.
            let survival = weight.max_component().min(1.0);
            if u.roulette >= survival {
                end = End::Absorbed;
                break;
            }
            way = OnTheWay {
                from: hit.p,
                power: way.power * weight * (1.0 / survival),
                scattered: way.scattered + 1,
                specular: way.specular && sample.density == Density::Delta,
                leg: Leg::Later(self.leave(&vertex, &sample)),
            };
            if way.power.is_black() || !way.power.is_finite() {
                end = End::Absorbed;
                break;
            }
            ray = hit.spawn(sample.wi);
        }
        Walked {
            emitted: emission.power,
            left: match end {
                End::Absorbed => Rgb::BLACK,
                End::Escaped | End::Stopped => way.power,
            },
            end,
        }
    }

    /// What the power is multiplied with when light goes on along `sample`.
    fn weight(&self, vertex: &LightVertex, sample: &BsdfSample) -> Rgb {
        let (hit, shading) = (&vertex.hit, &vertex.shading);
        match sample.density {
            Density::PerSr(pdf) if shading.is_bent() => {
                let (scattered, _) = vertex.scatter(self.scene, sample.wi);
                scattered * (1.0 / pdf)
            }
            _ => sample.weight * shading.adjoint(hit, sample.wi),
        }
    }

    fn arrive(&self, way: &OnTheWay, hit: &Hit) -> State {
        if !self.techniques.weighs() {
            return State::default();
        }
        let dist2 = f64::from((hit.p - way.from).length_squared());
        let cos = f64::from(hit.ng.dot(hit.wo).abs());
        match &way.leg {
            Leg::Later(leg) => leg.arrive(dist2, cos),
            Leg::First(emission) => {
                let start = f64::from(emission.pdf.start);
                let pdf = &emission.pdf;
                let connected = || f64::from(self.scene.pdf_connection(hit, &emission.source));
                State {
                    pdf: pdf.arrival(dist2, cos),
                    reverse: match pdf.can_be_met && self.techniques.emission {
                        true => mis::power(pdf.start_per_sr(dist2) / start),
                        false => 0.0,
                    },
                    cut_straight: 0.0,
                    cut: match self.techniques.next_event {
                        true => mis::power(connected() / start),
                        false => 0.0,
                    },
                }
            }
        }
    }

    fn leave(&self, vertex: &LightVertex, sample: &BsdfSample) -> mis::Leg {
        if !self.techniques.weighs() {
            return mis::Leg::default();
        }
        let hit = &vertex.hit;
        let back = || {
            let seen = self
                .scene
                .seen_from(hit, &vertex.shading, vertex.u_material, sample.wi);
            seen.eval_pdf(hit.wo, Mode::Radiance).1
        };
        vertex.state.leave(
            sample.density,
            back,
            f64::from(hit.ng.dot(sample.wi).abs()),
            self.techniques.connection,
            // The eye's walk comes from where this goes, so it is scattered before.
            vertex.merging(&self.techniques, true),
        )
    }
}

impl LightVertex {
    /// What merging here counts for with an eye's walk that was scattered before, or not. Light that was not
    /// scattered is not merged: next-event estimation does that better.
    #[inline]
    pub fn merging(&self, techniques: &Techniques, later: bool) -> f64 {
        match self.scattered {
            0 => 0.0,
            _ => techniques.merging(later),
        }
    }

    /// Share of the light scattered into the unit vector `wi`, per steradian: times the power and over the
    /// squared distance, the irradiance on what is at right angles to `wi` there. Also the density per
    /// steradian with which a walk from the eye that comes against `wi` would have gone to where the light
    /// comes from. Delta lobes contribute nothing.
    #[inline]
    pub fn scatter(&self, scene: &Scene, wi: Vec3) -> (Rgb, f32) {
        let hit = &self.hit;
        // As the walk from the eye would see it, so that both agree whatever the normals.
        let seen = scene.seen_from(hit, &self.shading, self.u_material, wi);
        let (f_cos, pdf_back) = seen.eval_pdf(hit.wo, Mode::Radiance);
        let factor = (hit.ng.dot(wi) / hit.ng.dot(hit.wo)).abs();
        match factor.is_finite() {
            true => (f_cos * factor, pdf_back),
            false => (Rgb::BLACK, 0.0),
        }
    }
}

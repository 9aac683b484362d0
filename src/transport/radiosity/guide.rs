//! The camera's walk, sent where radiosity says that light comes from.
//!
//! At a vertex on a patch, a direction is found by the guide ([`crate::radiosity::guide`]) with probability a, by the
//! BSDF otherwise, and counts by the density of both together (one-sample model of multiple importance sampling,
//! Veach 1997, section 9.2.4, balance heuristic). What the guide's density is depends on the patch that the ray meets
//! first, so the ray is traced before the direction is weighed.
//!
//! The guide aims at no emitter. Against light samples the BSDF's part of the density counts alone, (1 - a) times its
//! own, on both sides: the two weights of a direction sum to 1 whichever way it was found.
//!
//! Roulette ends walks that are expected to bring little: what the edge's end sends back by the solution, times the
//! throughput, against what the first patch on the walk is expected to send to the eye (Vorba & Křivánek 2016,
//! "Adjoint-driven Russian roulette and splitting in light transport simulation", without their splitting).

use crate::bsdf::{Bsdf, BsdfSample, Density, Mode};
use crate::geom::{Hit, ShapeId};
use crate::math::{DVec2, PI, Rgb, Vec2, Vec3};
use crate::radiosity::Guide;
use crate::radiosity::guide::Receiver;
use crate::sampler::dim;
use crate::scene::Scene;
use crate::transport::PathStats;
use crate::transport::path::{Gather, Gathered, Onward, Vertex};

/// What of a walk is guided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Guided {
    /// Where it goes, and where it ends.
    Everywhere,
    /// Where it ends.
    EndsOnly,
}

/// Guides one walk of the eye, which gathers beside what `gather` does.
pub struct Guiding<'a, G> {
    scene: &'a Scene,
    guide: &'a Guide,
    pub gather: G,
    guided: Guided,
    /// Of the current vertex, where the guide takes part.
    place: Option<Place>,
    /// What the edge from there meets, and the patch there, where that was found out.
    ahead: Option<Ahead>,
    /// What the first patch on the walk is expected to bring, as luminance in the picture's units.
    expected: Option<f32>,
}

/// Where the guide takes part.
#[derive(Clone, Copy)]
struct Place {
    receiver: Receiver,
    /// Of the directions that the guide finds.
    share: f32,
}

/// The patch at a hit, if it has one.
#[derive(Clone, Copy)]
struct Ahead {
    p: Vec3,
    shape: ShapeId,
    patch: Option<u32>,
}

/// Share of the directions from a diffuse surface that the guide finds. No direction counts for more than 1 / (1 - a)
/// of what it would without a guide, however wrong the solution is; 0.3 to 0.5 measured much alike, 0.7 worse.
const SHARE: f32 = 0.4;
/// A walk is ended only where it is expected to bring less than this share of what the pixel shows.
const WINDOW: f32 = 0.15;
/// No walk is ended with a greater probability than one less this: radiosity does not know all light.
const LEAST_SURVIVAL: f32 = 0.1;

impl<'a, G> Guiding<'a, G> {
    pub fn new(scene: &'a Scene, guide: &'a Guide, gather: G, guided: Guided) -> Guiding<'a, G> {
        Guiding {
            guided,
            scene,
            guide,
            gather,
            place: None,
            ahead: None,
            expected: None,
        }
    }

    /// Where the guide takes part at `vertex`.
    #[inline]
    fn find_place(&mut self, vertex: &Vertex) -> Option<Place> {
        let diffuse = diffuse_part(vertex);
        if diffuse == 0.0 {
            return None;
        }
        let hit = vertex.hit;
        let patch = match self.ahead.take() {
            Some(ahead) if ahead.p == hit.p && ahead.shape == hit.shape => ahead.patch,
            _ => self.guide.patch(hit),
        }?;
        let receiver = self.guide.receiver(patch)?;
        if self.expected.is_none() {
            let reflected = vertex.throughput * vertex.shading.diffuse_share();
            let irradiance = self.guide.irradiance(patch);
            self.expected = Some(reflected.luminance() * irradiance * (1.0 / PI));
        }
        let share = match self.guided {
            Guided::Everywhere => SHARE * diffuse,
            Guided::EndsOnly => 0.0,
        };
        Some(Place { receiver, share })
    }

    /// What is met from `vertex` in direction `wi`, whose patch is then known.
    #[inline]
    fn look(&mut self, vertex: &Vertex, wi: Vec3) -> Option<Hit> {
        let met = self.scene.intersect(&vertex.hit.spawn(wi));
        self.ahead = met.as_ref().map(|met| Ahead {
            p: met.p,
            shape: met.shape,
            patch: self.guide.patch(met),
        });
        met
    }

    /// A direction by the BSDF, and what it meets.
    #[inline]
    fn unguided(&mut self, vertex: &Vertex, u_lobe: f32, u: Vec2) -> Option<Onward> {
        let sample = vertex.shading.sample(u_lobe, u, Mode::Radiance)?;
        let met = match sample.density {
            Density::PerSr(_) => Some(self.look(vertex, sample.wi)),
            Density::Delta => None,
        };
        Some(Onward { sample, met })
    }

    /// A direction by either way, and what it meets if the guide takes part.
    #[inline]
    fn mixed(
        &mut self,
        vertex: &Vertex,
        Place { receiver, share }: Place,
        u_lobe: f32,
        u: Vec2,
    ) -> Option<Onward> {
        let (hit, shading) = (vertex.hit, vertex.shading);
        if share == 0.0 {
            return self.unguided(vertex, u_lobe, u);
        }
        let rest = 1.0 - share;
        let block = dim::VERTEX + (vertex.edges - 1) * dim::PER_VERTEX + dim::PATCH;
        let coarse = match shading.bsdf {
            // It chooses nothing else.
            Bsdf::Diffuse(_) => u_lobe,
            _ => vertex.sampler.get4(block)[0],
        };
        // Need not be well spread.
        let fine = vertex.sampler.independent().get4(block)[1];
        // Links of little light have smaller probabilities than one number in f32 can tell apart.
        let choice = f64::from(coarse) + f64::from(fine) * STEP_OF_F32;
        let by_guide = choice < f64::from(share);
        let (wi, f_cos, bsdf_pdf, aimed) = if by_guide {
            let choice = choice / f64::from(share);
            let u = DVec2::new(f64::from(u.x), f64::from(u.y));
            let aim = self.guide.sample(receiver, hit.p, choice, u)?;
            let (f_cos, pdf) = shading.eval_pdf(aim.wi, Mode::Radiance);
            if f_cos.is_black() {
                return None;
            }
            (aim.wi, f_cos, pdf, Some(aim.patch))
        } else {
            let mut sample = shading.sample(u_lobe, u, Mode::Radiance)?;
            let Density::PerSr(pdf) = sample.density else {
                sample.weight *= 1.0 / rest;
                return Some(Onward { sample, met: None });
            };
            (sample.wi, sample.weight * pdf, pdf, None)
        };
        let met = self.look(vertex, wi);
        let patch = self.ahead.and_then(|ahead| ahead.patch);
        if aimed.is_some() && aimed != patch {
            return None;
        }
        let guide_pdf = match (patch, &met) {
            (Some(patch), Some(met)) => self.guide.pdf(receiver, hit.p, wi, met, patch),
            _ => 0.0,
        };
        if aimed.is_some() && guide_pdf == 0.0 {
            return None;
        }
        let sample = BsdfSample {
            wi,
            weight: f_cos * (1.0 / (share * guide_pdf + rest * bsdf_pdf)),
            density: Density::PerSr(rest * bsdf_pdf),
            eta: 1.0,
        };
        Some(Onward {
            sample,
            met: Some(met),
        })
    }
}

/// The step between two numbers of a sampler.
const STEP_OF_F32: f64 = 1.0 / (1 << 24) as f64;

/// How much of what the surface scatters it scatters diffusely; 0 for surfaces that the guide knows nothing of.
#[inline]
fn diffuse_part(vertex: &Vertex) -> f32 {
    match vertex.shading.bsdf {
        Bsdf::Diffuse(_) => 1.0,
        Bsdf::Plastic(_) | Bsdf::RoughPlastic(_) => {
            let diffuse = vertex.shading.diffuse_share().luminance();
            let all = vertex.shading.albedo().luminance();
            match diffuse > 0.0 && all > 0.0 {
                true => (diffuse / all).min(1.0),
                false => 0.0,
            }
        }
        _ => 0.0,
    }
}

impl<G: Gather> Gather for Guiding<'_, G> {
    const TAKES_CAUSTICS: bool = G::TAKES_CAUSTICS;
    const ENDS_EARLY: bool = true;

    #[inline]
    fn alone(&self) -> bool {
        self.gather.alone()
    }

    #[inline]
    fn at(&mut self, vertex: &Vertex, stats: &mut PathStats) -> Gathered {
        self.gather.at(vertex, stats)
    }

    #[inline]
    fn bsdf_share(&mut self, vertex: &Vertex) -> f32 {
        self.place = self.find_place(vertex);
        self.ahead = None;
        self.place.map_or(1.0, |place| 1.0 - place.share)
    }

    #[inline]
    fn scatter(
        &mut self,
        vertex: &Vertex,
        u_lobe: f32,
        u: Vec2,
        stats: &mut PathStats,
    ) -> Option<Onward> {
        match self.place.take() {
            Some(place) => {
                let onward = self.mixed(vertex, place, u_lobe, u);
                if onward.is_none() {
                    stats.indirect += 1;
                }
                onward
            }
            None => self.gather.scatter(vertex, u_lobe, u, stats),
        }
    }

    #[inline]
    fn survival(
        &mut self,
        throughput: Rgb,
        eta2: f32,
        met: Option<&Option<Hit>>,
        played: Option<u32>,
    ) -> f32 {
        let known = || {
            let (expected, met) = (self.expected?, met?.as_ref()?);
            if self.scene.is_emitter(met.shape) || expected.is_nan() || expected <= 0.0 {
                return None;
            }
            let radiance = self.guide.radiance(self.ahead?.patch?);
            Some(throughput.luminance() * radiance / expected)
        };
        match known() {
            Some(ratio) => (ratio / WINDOW).clamp(LEAST_SURVIVAL, 1.0),
            None => self.gather.survival(throughput, eta2, met, played),
        }
    }
}

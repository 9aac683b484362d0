//! Light as it leaves the emitters: the start of photons and light subpaths.
//!
//! Every emission has two densities, whose product is that of the ray: of the place it starts from and of
//! what follows. Bidirectional methods weigh them against the density with which a receiver would have
//! connected to the same start ([`Lights::pdf_connection`]).

use super::Lights;
use crate::geom::{Geometry, Hit, Ray};
use crate::math::{Rgb, Vec2};

/// What decides an emission, in [0,1) each.
#[derive(Clone, Copy, Debug)]
pub struct EmissionNumbers {
    /// Chooses the light.
    pub pick: f32,
    /// Chooses whether, and at what, it is aimed.
    pub aim: f32,
    /// Point on the light; direction, for what shines from infinity.
    pub place: Vec2,
    /// Direction from there; point on the disk that covers the scene, for what shines from infinity.
    pub direction: Vec2,
    /// Over the shutter.
    pub time: f32,
}

/// Densities of an emission, the choice of the light included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmissionPdf {
    /// Of the start: per unit of area of a surface, per steradian of an environment. For what shines from
    /// one point or in one direction only (points, directional lights, beams) the probability of its choice.
    pub start: f32,
    /// Of what follows: per steradian from the start where light diverges, else per unit of area across the
    /// ray.
    pub onward: f32,
    /// |cos| of the emission at the shading normal of a surface; 1 where there is none.
    pub cos: f32,
    /// Whether light spreads from the start, so that its density falls with the squared distance.
    pub diverges: bool,
    /// Whether a walk from the eye can run into the start.
    pub can_be_met: bool,
}

impl EmissionPdf {
    /// Density per unit of area with which the light arrives at a surface, `dist2` being the squared distance
    /// from the start and `cos` the cosine there.
    #[inline]
    pub fn arrival(&self, dist2: f64, cos: f64) -> f64 {
        let across = f64::from(self.onward) * cos;
        match self.diverges {
            true => across / dist2,
            false => across,
        }
    }

    /// What turns a density per steradian at the first receiver, for the direction to the start, into the
    /// measure of [`EmissionPdf::start`].
    #[inline]
    pub fn start_per_sr(&self, dist2: f64) -> f64 {
        match self.diverges {
            true => f64::from(self.cos) / dist2,
            false => 1.0,
        }
    }
}

/// What a connection to the start of an emission needs to know of it.
#[derive(Clone, Copy, Debug)]
pub enum Source {
    /// A point of a surface; `wo` is the direction of the light.
    Surface(Hit),
    /// A point or beam: the light of this number (see [`Lights::choose`]).
    Item(u32),
    /// Infinity, along this emitter's number, with the unit direction that leads to it.
    Far { emitter: u32, wi: crate::math::Vec3 },
}

/// Light that leaves an emitter.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Begins clear of the surface that shines, or outside of the scene.
    pub ray: Ray,
    /// Radiance times cosine (intensity, irradiance) over both densities: W.
    pub power: Rgb,
    pub pdf: EmissionPdf,
    pub source: Source,
}

/// Where light is aimed at: spheres around what can throw a caustic. Empty: nowhere in particular.
#[derive(Clone, Debug, Default)]
pub struct Aim {
    /// Share of the emission that is aimed, 0 to 1. With 1, light that meets none of the targets first is
    /// never emitted.
    pub share: f32,
    pub targets: Vec<Target>,
}

/// A sphere, in scene coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    pub center: crate::math::Vec3,
    pub radius: f32,
}

impl Lights {
    /// Light that leaves one of the emitters, chosen in proportion to power.
    pub fn sample_emission(
        &self,
        _geoms: &[Geometry],
        _aim: &Aim,
        _u: &EmissionNumbers,
    ) -> Option<Emission> {
        None
    }

    /// As [`Lights::sample`], with the densities of the light that would have come from there by emission.
    pub fn sample_both_ways(
        &self,
        _geoms: &[Geometry],
        _aim: &Aim,
        _from: &Hit,
        _u_pick: f32,
        _u: Vec2,
    ) -> Option<(super::EmitterSample, EmissionPdf)> {
        None
    }

    /// Densities with which [`Lights::sample_emission`] lets light start at `met` along `met.wo`.
    pub fn pdf_emission(&self, _geoms: &[Geometry], _aim: &Aim, _met: &Hit) -> Option<EmissionPdf> {
        None
    }

    /// The same for light from infinity that arrives at `at` from the direction `wi`.
    pub fn pdf_emission_escaped(
        &self,
        _aim: &Aim,
        _at: &Hit,
        _wi: crate::math::Vec3,
    ) -> Option<EmissionPdf> {
        None
    }

    /// Density with which [`Lights::sample`] connects `from` to `source`, in the measure of
    /// [`EmissionPdf::start`].
    pub fn pdf_connection(&self, _geoms: &[Geometry], _from: &Hit, _source: &Source) -> f32 {
        0.0
    }
}

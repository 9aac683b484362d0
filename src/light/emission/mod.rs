//! Light as it leaves the emitters: the start of photons and light subpaths.
//!
//! Every emission has two densities, whose product is that of the ray: of the place it starts from and of
//! what follows. Bidirectional methods weigh them against the density with which a receiver would have
//! connected to the same start ([`Lights::pdf_connection`]).

mod aim;
mod around;
mod far;
mod lights;
mod sources;
mod surface;

pub use aim::{Aim, Target};

pub(super) use aim::Outlook;
pub(super) use far::Cover;
pub(super) use sources::Sources;

use super::local;
use crate::geom::{Hit, Ray};
use crate::math::{Rgb, Vec2, Vec3};

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
    /// |cos| of the emission at the geometric normal of a surface, which turns a density per steradian at the
    /// receiver into one per unit of area there; 1 where there is no surface.
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
    Far { emitter: u32, wi: Vec3 },
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

/// Densities before they are rounded to f32, which holds no density of areas below 1e-38.
#[derive(Clone, Copy, Debug)]
struct Densities {
    start: f64,
    onward: f64,
    cos: f64,
    diverges: bool,
    can_be_met: bool,
}

impl Densities {
    /// `None` where either is zero: nothing is emitted like this.
    fn rounded(&self) -> Option<EmissionPdf> {
        let possible = self.start > 0.0 && self.onward > 0.0 && self.cos > 0.0;
        possible.then(|| self.stated())
    }

    /// The same for a start that is found otherwise; where nothing would be emitted from there in this
    /// direction, since all light is aimed elsewhere, the density of the direction is 0.
    fn stated(&self) -> EmissionPdf {
        EmissionPdf {
            start: local::bounded(self.start),
            onward: local::bounded(self.onward),
            // Seen edge on, the cosine may round to 0, which others divide by.
            cos: local::bounded(self.cos.max(f64::from(f32::MIN_POSITIVE))),
            diverges: self.diverges,
            can_be_met: self.can_be_met,
        }
    }

    /// The emission of `le` (radiance, intensity or irradiance) along `ray`. `None` where there is none.
    fn emission(&self, ray: Ray, le: Rgb, source: Source) -> Option<Emission> {
        let factor = self.cos / (self.start * self.onward);
        // Channel by channel in f64: the factor alone may leave the range of f32.
        let power = le.map(|c| (f64::from(c) * factor) as f32);
        let pdf = self.rounded()?;
        (power.is_finite() && !power.is_black()).then_some(Emission {
            ray,
            power,
            pdf,
            source,
        })
    }
}

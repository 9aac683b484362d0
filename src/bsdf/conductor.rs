//! Metals, polished and rough.

use super::dielectric::{delta, mirror};
use super::microfacet::Microfacet;
use super::{BsdfSample, Density, Sides, fresnel};
use crate::math::{Rgb, Vec2, Vec3};

/// A polished metal: a mirror with the reflectance of a conductor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// Complex index of refraction `eta + i k` relative to the medium outside (see `metals`).
    pub eta: Rgb,
    pub k: Rgb,
    /// Factor on the reflectance, 1 for real matter.
    pub reflectance: Rgb,
    pub sides: Sides,
}

impl Conductor {
    #[inline]
    pub fn new(eta: Rgb, k: Rgb) -> Conductor {
        Conductor {
            eta,
            k,
            reflectance: Rgb::WHITE,
            sides: Sides::Front,
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        let cos = self.sides.front(wo.z, wo.z);
        if cos <= 0.0 {
            return None;
        }
        delta(mirror(wo), self.fresnel(cos), 1.0)
    }

    #[inline]
    pub(super) fn fresnel(&self, cos: f32) -> Rgb {
        self.reflectance * fresnel::conductor(cos, self.eta, self.k)
    }
}

/// A rough metal: mirrors whose normals follow a microfacet distribution, with Smith's masking and
/// shadowing taken as independent (Walter et al. 2007, equation 20, without transmission). Light that is
/// reflected more than once is lost, as in that model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor {
    pub facets: Microfacet,
    pub metal: Conductor,
}

impl RoughConductor {
    #[inline]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let Some((wo, wi, m, d)) = self.half_vector(wo, wi) else {
            return (Rgb::BLACK, 0.0);
        };
        let masking = self.facets.g1_over_cos(wo);
        let f = 0.25 * d * masking * self.facets.g1_over_cos(wi);
        let pdf = if self.facets.visible {
            0.25 * d * masking
        } else {
            0.25 * d * m.z / wo.dot(m)
        };
        (self.metal.fresnel(wo.dot(m)) * f, pdf)
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Some((wo, _, m, d)) = self.half_vector(wo, wi) else {
            return 0.0;
        };
        if self.facets.visible {
            0.25 * d * self.facets.g1_over_cos(wo)
        } else {
            0.25 * d * m.z / wo.dot(m)
        }
    }

    /// Both directions seen from the front, the facet normal that reflects one into the other, and its
    /// density D. `None` where nothing is reflected.
    #[inline]
    fn half_vector(&self, wo: Vec3, wi: Vec3) -> Option<(Vec3, Vec3, Vec3, f32)> {
        let sides = self.metal.sides;
        let wi = sides.front_vec(wo, wi);
        let wo = sides.front_vec(wo, wo);
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let m = (wo + wi).try_normalize()?;
        let d = self.facets.d(m);
        (d > 0.0 && wo.dot(m) > 0.0).then_some((wo, wi, m, d))
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let front = self.metal.sides.front_vec(wo, wo);
        if front.z <= 0.0 {
            return None;
        }
        let m = self.facets.sample(front, u);
        let cos = front.dot(m);
        let wi = 2.0 * cos * m - front;
        if cos <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        // From the sampled normal, not from the rounded directions: at a roughness of 1e-4 the half vector
        // of two f32 directions has lost the shape of the lobe.
        let d = self.facets.d(m);
        let shadowing = self.facets.g1_over_cos(wi) * wi.z;
        let (pdf, weight) = if self.facets.visible {
            (0.25 * d * self.facets.g1_over_cos(front), shadowing)
        } else {
            let pdf = 0.25 * d * m.z / cos;
            let masking = self.facets.g1_over_cos(front);
            (pdf, shadowing * masking * cos / m.z)
        };
        let weight = self.metal.fresnel(cos) * weight;
        let usable = pdf > 0.0 && pdf.is_finite() && !weight.is_black();
        usable.then_some(BsdfSample {
            wi: self.metal.sides.front_vec(wo, wi),
            weight,
            density: Density::PerSr(pdf),
            eta: 1.0,
        })
    }
}

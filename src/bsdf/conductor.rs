//! Metals, polished and rough.

use super::dielectric::{delta, mirror};
use super::microfacet::Microfacet;
use super::{BsdfSample, Density, fresnel};
use crate::math::{Rgb, Vec2, Vec3};

/// A polished metal: a mirror with the reflectance of a conductor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    /// Complex index of refraction `eta + i k` relative to the medium outside (see `metals`).
    pub eta: Rgb,
    pub k: Rgb,
    /// Factor on the reflectance, 1 for real matter.
    pub reflectance: Rgb,
}

impl Conductor {
    #[inline]
    pub fn new(eta: Rgb, k: Rgb) -> Conductor {
        Conductor {
            eta,
            k,
            reflectance: Rgb::WHITE,
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        delta(mirror(wo), self.fresnel(wo.z), 1.0)
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
        let Some(half) = self.facets.half_vector(wo, wi) else {
            return (Rgb::BLACK, 0.0);
        };
        let masking = self.facets.g1_over_cos(wo);
        let f = 0.25 * half.d * (masking * self.facets.g1_over_cos(wi));
        let pdf = self
            .facets
            .reflected_pdf(half.d, masking, half.m.z, half.cos);
        (self.metal.fresnel(half.cos) * f, pdf)
    }

    #[inline]
    pub(super) fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.facets.half_vector(wo, wi).map_or(0.0, |half| {
            let masking = self.facets.g1_over_cos(wo);
            self.facets
                .reflected_pdf(half.d, masking, half.m.z, half.cos)
        })
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let m = self.facets.sample(wo, u);
        let cos = wo.dot(m);
        let wi = 2.0 * cos * m - wo;
        if cos <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        // From the sampled normal, not from the rounded directions: at a roughness of 1e-4 the half vector
        // of two f32 directions has lost the shape of the lobe.
        let d = self.facets.d(m);
        let shadowing = self.facets.g1_over_cos(wi) * wi.z;
        let masking = self.facets.g1_over_cos(wo);
        let pdf = self.facets.reflected_pdf(d, masking, m.z, cos);
        let weight = if self.facets.visible {
            shadowing
        } else {
            shadowing * masking * cos / m.z
        };
        let weight = self.metal.fresnel(cos) * weight;
        let usable = pdf > 0.0 && pdf.is_finite() && !weight.is_black();
        usable.then_some(BsdfSample {
            wi,
            weight,
            density: Density::PerSr(pdf),
            eta: 1.0,
        })
    }
}

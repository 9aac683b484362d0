//! Lambert's reflector.

use super::{BsdfSample, Density, Sides};
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{Rgb, Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Reflects `albedo` (per channel, 0..1) of what arrives, equally bright in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    pub albedo: Rgb,
    pub sides: Sides,
}

impl Diffuse {
    #[inline]
    pub fn new(albedo: Rgb) -> Diffuse {
        Diffuse {
            albedo,
            sides: Sides::Front,
        }
    }

    #[inline]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        let cos_o = self.sides.front(wo.z, wo.z);
        let cos_i = self.sides.front(wo.z, wi.z);
        if cos_o > 0.0 && cos_i > 0.0 {
            (self.albedo * FRAC_1_PI, cosine_hemisphere_pdf(cos_i))
        } else {
            (Rgb::BLACK, 0.0)
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        if self.sides.front(wo.z, wo.z) <= 0.0 || self.albedo.is_black() {
            return None;
        }
        let mut wi = cosine_hemisphere(u);
        let pdf = cosine_hemisphere_pdf(wi.z);
        wi.z = self.sides.front(wo.z, wi.z);
        Some(BsdfSample {
            wi,
            weight: self.albedo,
            density: Density::PerSr(pdf),
            eta: 1.0,
        })
    }
}

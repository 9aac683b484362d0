//! Lambert's reflector.

use super::{BsdfSample, Density};
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{Rgb, Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Reflects `albedo` (per channel, 0..1) of what arrives, equally bright in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    pub albedo: Rgb,
}

impl Diffuse {
    #[inline]
    pub fn new(albedo: Rgb) -> Diffuse {
        Diffuse { albedo }
    }

    #[inline]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        if wo.z > 0.0 && wi.z > 0.0 {
            (self.albedo * FRAC_1_PI, cosine_hemisphere_pdf(wi.z))
        } else {
            (Rgb::BLACK, 0.0)
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        if wo.z <= 0.0 || self.albedo.is_black() {
            return None;
        }
        let wi = cosine_hemisphere(u);
        Some(BsdfSample {
            wi,
            weight: self.albedo,
            density: Density::PerSr(cosine_hemisphere_pdf(wi.z)),
            eta: 1.0,
        })
    }
}

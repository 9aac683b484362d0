//! Smooth boundaries of transparent matter. All lobes are deltas: `eval` and `pdf` are zero.

use super::{BsdfSample, Density, Mode, fresnel};
use crate::math::{Rgb, Vec3};

/// A smooth boundary between two dielectrics: mirror reflection and refraction, chosen by the reflectance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction on the inside (below the surface, z < 0) over that on the outside, > 0.
    pub eta: f32,
    /// Factors on the two lobes, 1 for real matter.
    pub reflectance: Rgb,
    pub transmittance: Rgb,
}

impl Dielectric {
    #[inline]
    pub fn new(eta: f32) -> Dielectric {
        Dielectric {
            eta,
            reflectance: Rgb::WHITE,
            transmittance: Rgb::WHITE,
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, mode: Mode) -> Option<BsdfSample> {
        // Index ratio in the direction of travel.
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let (r, cos_t) = fresnel::dielectric(wo.z.abs().min(1.0), eta);
        if u_lobe < r {
            return delta(mirror(wo), self.reflectance, 1.0);
        }
        // Radiance is compressed into the narrower cone of the denser side: L / index² is invariant
        // (Veach 1997, section 5.2). Photons carry power, which is not.
        let scale = match mode {
            Mode::Radiance => 1.0 / (eta * eta),
            Mode::Importance => 1.0,
        };
        let wi = Vec3::new(-wo.x / eta, -wo.y / eta, -cos_t.copysign(wo.z));
        delta(wi, self.transmittance * scale, eta)
    }

    /// Share of the light from `wo` that leaves again on either side.
    #[inline]
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let (r, _) = fresnel::dielectric(wo.z.abs().min(1.0), eta);
        self.transmittance.lerp(self.reflectance, r)
    }
}

/// A thin sheet of a dielectric: light passes straight on; the reflections inside are summed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    /// Index of refraction of the sheet over that around it, > 0.
    pub eta: f32,
    pub reflectance: Rgb,
    pub transmittance: Rgb,
}

impl ThinDielectric {
    #[inline]
    pub fn new(eta: f32) -> ThinDielectric {
        ThinDielectric {
            eta,
            reflectance: Rgb::WHITE,
            transmittance: Rgb::WHITE,
        }
    }

    /// R + T R T + T R³ T + ... = 2 R / (1 + R) with T = 1 - R (Stokes 1862).
    #[inline]
    fn reflected(&self, wo: Vec3) -> f32 {
        let (r, _) = fresnel::dielectric(wo.z.abs().min(1.0), self.eta);
        2.0 * r / (1.0 + r)
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32) -> Option<BsdfSample> {
        if u_lobe < self.reflected(wo) {
            delta(mirror(wo), self.reflectance, 1.0)
        } else {
            delta(-wo, self.transmittance, 1.0)
        }
    }

    #[inline]
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        self.transmittance
            .lerp(self.reflectance, self.reflected(wo))
    }
}

/// A boundary that is not there: light goes straight on, filtered by `transmittance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Null {
    pub transmittance: Rgb,
}

impl Null {
    #[inline]
    pub(super) fn sample(&self, wo: Vec3) -> Option<BsdfSample> {
        delta(-wo, self.transmittance, 1.0)
    }
}

#[inline]
pub(super) fn mirror(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}

/// `None` for a direction within the surface, to which neither side belongs, and for no energy.
#[inline]
pub(super) fn delta(wi: Vec3, weight: Rgb, eta: f32) -> Option<BsdfSample> {
    (wi.z != 0.0 && !weight.is_black()).then_some(BsdfSample {
        wi,
        weight,
        density: Density::Delta,
        eta,
    })
}

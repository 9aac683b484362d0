//! Surface scattering. A [`Bsdf`] is a small `Copy` value of numbers only: textures were looked up when
//! the material made it, so every lobe can be tested alone.
//!
//! `wo` and `wi` are unit vectors pointing away from the surface in the local frame (z = shading normal).

use crate::math::Rgb;
use crate::math::Vec3;

/// The measure a direction was sampled in. It is a type so that a delta cannot slip into MIS.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// Density per steradian.
    PerSr(f32),
    Delta,
}

impl Density {
    /// Power-heuristic weight (exponent 2) of this sample against a rival strategy of density `rival`
    /// per steradian (Veach 1997, section 9.2.4).
    #[inline]
    pub fn mis_weight(self, rival: f32) -> f32 {
        match self {
            Density::Delta => 1.0,
            Density::PerSr(pdf) => {
                let ratio = rival / pdf;
                1.0 / (1.0 + ratio * ratio)
            }
        }
    }
}

/// A sampled direction.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    pub wi: Vec3,
    /// `f * |cos wi| / pdf`; for a delta lobe, its reflectance over its lobe probability.
    pub weight: Rgb,
    pub density: Density,
    /// Relative index of refraction passed through (`eta_transmitted / eta_incident`), 1 for reflection:
    /// Russian roulette must not mistake the (1/eta²) compression of radiance for absorption.
    pub eta: f32,
}

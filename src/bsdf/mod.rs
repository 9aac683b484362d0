//! Surface scattering. A [`Bsdf`] is a small `Copy` value of numbers only: textures were looked up when
//! the material made it, so every lobe can be tested alone.
//!
//! `wo` and `wi` are unit vectors pointing away from the surface in the local frame (z = shading normal).

pub mod conductor;
pub mod dielectric;
pub mod diffuse;
pub mod fresnel;
pub mod iors;
pub mod metals;
pub mod microfacet;
pub mod plastic;
pub mod principled;
pub mod rough_dielectric;
pub mod rough_plastic;

pub use conductor::{Conductor, RoughConductor};
pub use dielectric::{Dielectric, Null, ThinDielectric};
pub use diffuse::Diffuse;
pub use microfacet::{Microfacet, Shape};
pub use plastic::{Base, Plastic};
pub use principled::{Principled, PrincipledThin};
pub use rough_dielectric::RoughDielectric;
pub use rough_plastic::{Coat, RoughPlastic};

use crate::math::{Rgb, Vec2, Vec3};

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

/// What the light carries: refraction scales radiance by the squared index ratio, but not the importance
/// (the power of photons) that goes the other way (Veach 1997, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// `wo` points towards the camera.
    Radiance,
    /// `wo` points towards the light.
    Importance,
}

/// How a point of a surface scatters light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    Diffuse(Diffuse),
    Conductor(Conductor),
    RoughConductor(RoughConductor),
    Dielectric(Dielectric),
    ThinDielectric(ThinDielectric),
    RoughDielectric(RoughDielectric),
    Plastic(Plastic),
    RoughPlastic(RoughPlastic),
    Principled(Principled),
    PrincipledThin(PrincipledThin),
    Null(Null),
}

const _: () = assert!(size_of::<Bsdf>() <= 76);

impl Bsdf {
    /// f(wo, wi) in 1/sr, without cosine. Delta lobes contribute nothing.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> Rgb {
        self.eval_pdf(wo, wi, mode).0
    }

    /// Density per steradian with which [`Bsdf::sample`] returns `wi` for radiance. Delta lobes contribute
    /// nothing.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Bsdf::Diffuse(b) => b.eval_pdf(wo, wi).1,
            Bsdf::RoughConductor(b) => b.pdf(wo, wi),
            Bsdf::RoughDielectric(b) => b.eval_pdf(wo, wi, Mode::Radiance).1,
            Bsdf::Plastic(b) => b.eval_pdf(wo, wi).1,
            Bsdf::RoughPlastic(b) => b.eval_pdf(wo, wi).1,
            Bsdf::Principled(b) => b.eval_pdf(wo, wi, Mode::Radiance).1,
            Bsdf::PrincipledThin(b) => b.eval_pdf(wo, wi, Mode::Radiance).1,
            Bsdf::Conductor(_) | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) | Bsdf::Null(_) => {
                0.0
            }
        }
    }

    /// [`Bsdf::eval`] and [`Bsdf::pdf`] at once: multiple importance sampling needs both.
    #[inline]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: Mode) -> (Rgb, f32) {
        match self {
            Bsdf::Diffuse(b) => b.eval_pdf(wo, wi),
            Bsdf::RoughConductor(b) => b.eval_pdf(wo, wi),
            Bsdf::RoughDielectric(b) => b.eval_pdf(wo, wi, mode),
            Bsdf::Plastic(b) => b.eval_pdf(wo, wi),
            Bsdf::RoughPlastic(b) => b.eval_pdf(wo, wi),
            Bsdf::Principled(b) => b.eval_pdf(wo, wi, mode),
            Bsdf::PrincipledThin(b) => b.eval_pdf(wo, wi, mode),
            Bsdf::Conductor(_) | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) | Bsdf::Null(_) => {
                (Rgb::BLACK, 0.0)
            }
        }
    }

    /// A direction in which light goes on. `None` when this choice carries no energy; never a zero pdf,
    /// never a NaN, for unit `wo` and numbers in [0,1).
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: Mode) -> Option<BsdfSample> {
        match self {
            Bsdf::Diffuse(b) => b.sample(wo, u),
            Bsdf::Conductor(b) => b.sample(wo),
            Bsdf::RoughConductor(b) => b.sample(wo, u),
            Bsdf::Dielectric(b) => b.sample(wo, u_lobe, mode),
            Bsdf::ThinDielectric(b) => b.sample(wo, u_lobe),
            Bsdf::RoughDielectric(b) => b.sample(wo, u_lobe, u, mode),
            Bsdf::Plastic(b) => b.sample(wo, u_lobe, u),
            Bsdf::RoughPlastic(b) => b.sample(wo, u_lobe, u),
            Bsdf::Principled(b) => b.sample(wo, u_lobe, u, mode),
            Bsdf::PrincipledThin(b) => b.sample(wo, u_lobe, u, mode),
            Bsdf::Null(b) => b.sample(wo),
        }
    }

    /// Only delta lobes: a connection to a light or a photon carries nothing.
    #[inline]
    pub fn is_delta(&self) -> bool {
        matches!(
            self,
            Bsdf::Conductor(_) | Bsdf::Dielectric(_) | Bsdf::ThinDielectric(_) | Bsdf::Null(_)
        )
    }

    /// Whether some lobe is neither a delta nor a diffuse one.
    #[inline]
    pub fn is_glossy(&self) -> bool {
        matches!(
            self,
            Bsdf::RoughConductor(_)
                | Bsdf::RoughDielectric(_)
                | Bsdf::RoughPlastic(_)
                | Bsdf::Principled(_)
                | Bsdf::PrincipledThin(_)
        )
    }

    /// Whether some lobe is a delta one that reflects or refracts. What lets light pass straight on as if it
    /// were not there has none.
    #[inline]
    pub fn has_delta(&self) -> bool {
        match self {
            Bsdf::Conductor(_)
            | Bsdf::Dielectric(_)
            | Bsdf::ThinDielectric(_)
            | Bsdf::Plastic(_) => true,
            // Between equal indices all facets send light straight on.
            Bsdf::RoughDielectric(b) => b.surface.eta == 1.0,
            _ => false,
        }
    }

    /// Whether no light passes through.
    #[inline]
    pub fn is_opaque(&self) -> bool {
        match self {
            Bsdf::Diffuse(_)
            | Bsdf::Conductor(_)
            | Bsdf::RoughConductor(_)
            | Bsdf::Plastic(_)
            | Bsdf::RoughPlastic(_) => true,
            Bsdf::Principled(b) => b.spec_trans == 0.0,
            Bsdf::Dielectric(_)
            | Bsdf::ThinDielectric(_)
            | Bsdf::RoughDielectric(_)
            | Bsdf::PrincipledThin(_)
            | Bsdf::Null(_) => false,
        }
    }

    /// Whether [`Bsdf::sample`] uses `u_lobe`.
    #[inline]
    pub fn has_lobes(&self) -> bool {
        matches!(
            self,
            Bsdf::Dielectric(_)
                | Bsdf::ThinDielectric(_)
                | Bsdf::RoughDielectric(_)
                | Bsdf::Plastic(_)
                | Bsdf::RoughPlastic(_)
                | Bsdf::Principled(_)
                | Bsdf::PrincipledThin(_)
        )
    }

    /// Nothing but a diffuse lobe: irradiance is all there is to know of the light that arrives.
    #[inline]
    pub fn is_diffuse(&self) -> bool {
        matches!(self, Bsdf::Diffuse(_))
    }

    /// Whether all lobes but delta ones are diffuse, and there is one: irradiance is all there is to know of the
    /// light that these scatter.
    #[inline]
    pub fn is_matte(&self) -> bool {
        matches!(self, Bsdf::Diffuse(_) | Bsdf::Plastic(_))
    }

    /// Share of light that arrives equally from all directions which the diffuse lobe sends towards `wo`, as
    /// radiance over radiance; 0 where there is none that can be told from other lobes.
    #[inline]
    pub fn diffuse_towards(&self, wo: Vec3) -> Rgb {
        match self {
            Bsdf::Diffuse(b) if wo.z > 0.0 => b.albedo,
            Bsdf::Plastic(b) if wo.z > 0.0 => b.diffuse_towards(wo),
            Bsdf::RoughPlastic(b) if wo.z > 0.0 => b.diffuse_towards(wo),
            _ => Rgb::BLACK,
        }
    }

    /// What is left without that lobe; `None` if that is nothing.
    #[inline]
    pub fn without_diffuse(&self) -> Option<Bsdf> {
        match self {
            Bsdf::Diffuse(_) => None,
            Bsdf::Plastic(b) => b.without_diffuse().map(Bsdf::Plastic),
            Bsdf::RoughPlastic(b) => b.without_diffuse().map(Bsdf::RoughPlastic),
            other => Some(*other),
        }
    }

    /// Reflectance of the diffuse lobe for light that arrives equally from all directions, 0 without one.
    #[inline]
    pub fn diffuse_albedo(&self) -> Rgb {
        match self {
            Bsdf::Diffuse(b) => b.albedo,
            Bsdf::Plastic(b) => b.diffuse_albedo(),
            Bsdf::RoughPlastic(b) => b.diffuse_albedo(),
            Bsdf::Principled(b) => b.diffuse_albedo(),
            Bsdf::PrincipledThin(b) => b.diffuse_albedo(),
            _ => Rgb::BLACK,
        }
    }

    /// Share of the light from `wo` that is scattered on, for the albedo layer (denoisers): exact for
    /// smooth surfaces, for rough ones the Fresnel reflectance without masking.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let metal = |b: &Conductor| match wo.z > 0.0 {
            true => b.fresnel(wo.z),
            false => Rgb::BLACK,
        };
        match self {
            Bsdf::Diffuse(b) if wo.z > 0.0 => b.albedo,
            Bsdf::Diffuse(_) => Rgb::BLACK,
            Bsdf::Conductor(b) => metal(b),
            Bsdf::RoughConductor(b) => metal(&b.metal),
            Bsdf::Dielectric(b) => b.albedo(wo),
            Bsdf::ThinDielectric(b) => b.albedo(wo),
            Bsdf::RoughDielectric(b) => b.albedo(wo),
            Bsdf::Plastic(b) => b.albedo(wo),
            Bsdf::RoughPlastic(b) => b.albedo(wo),
            Bsdf::Principled(b) => b.albedo(wo),
            Bsdf::PrincipledThin(b) => b.albedo(wo),
            Bsdf::Null(b) => b.transmittance,
        }
    }
}

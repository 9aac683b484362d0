//! A material at a hit: a BSDF in the frame that it refers to.

use super::relief;
use crate::bsdf::{Bsdf, BsdfSample, Mode};
use crate::geom::Hit;
use crate::math::{Frame, PI, Rgb, Vec2, Vec3};

/// How the surface scatters light at one hit. All directions are unit vectors in world space.
#[derive(Clone, Copy, Debug)]
pub struct Shading {
    pub bsdf: Bsdf,
    /// The frame of the BSDF: that of the hit, turned to the side that is seen where both sides are alike,
    /// and bent where the material has a relief.
    frame: Frame,
    /// `hit.wo` in that frame.
    wo: Vec3,
    /// What a relief bent the frame away from.
    bend: Option<Bend>,
}

/// The smooth surface below a relief.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    pub normal: Vec3,
    /// Of the shadowing function (see `relief`).
    pub alpha2: f32,
}

impl Shading {
    #[inline]
    pub fn new(hit: &Hit, frame: Frame, bsdf: Bsdf) -> Shading {
        Shading {
            bsdf,
            frame,
            wo: frame.to_local(hit.wo),
            bend: None,
        }
    }

    #[inline]
    pub(super) fn bent(self, bend: Option<Bend>) -> Shading {
        Shading { bend, ..self }
    }

    /// f |cos| towards `wi` in 1/sr, and the density per steradian with which [`Shading::sample`] returns
    /// `wi`. Delta lobes contribute nothing.
    #[inline]
    pub fn eval_pdf(&self, wi: Vec3, mode: Mode) -> (Rgb, f32) {
        let local = self.frame.to_local(wi);
        let Some(shadowing) = self.shadowing(wi, local) else {
            return (Rgb::BLACK, 0.0);
        };
        let (f, pdf) = self.bsdf.eval_pdf(self.wo, local, mode);
        (f * (local.z.abs() * shadowing), pdf)
    }

    /// Whether a relief bends the frame, which may depend on the side it is seen from.
    #[inline]
    pub fn is_bent(&self) -> bool {
        self.bend.is_some()
    }

    /// The same surface seen from `wo`, for a frame that does not depend on that.
    #[inline]
    pub fn turned_to(&self, wo: Vec3) -> Shading {
        Shading {
            wo: self.frame.to_local(wo),
            ..*self
        }
    }

    /// If all that the surface does is to scatter diffusely: f in 1/sr, the unit normal that `wi` must be on
    /// the side of, and the density per steradian with which a walk that comes from there goes on to
    /// `hit.wo`.
    #[inline]
    pub fn lambert(&self) -> Option<(Rgb, Vec3, f32)> {
        match self.bsdf {
            Bsdf::Diffuse(diffuse) if self.bend.is_none() && self.wo.z > 0.0 => {
                let f = diffuse.albedo * (1.0 / PI);
                Some((f, self.frame.n, self.wo.z * (1.0 / PI)))
            }
            _ => None,
        }
    }

    /// [`Shading::eval_pdf`] for radiance, and the density per steradian with which [`Shading::sample`] would
    /// return `hit.wo` if the surface were seen from `wi`; for a frame that does not depend on that.
    #[inline]
    pub fn eval_both_pdfs(&self, wi: Vec3) -> (Rgb, f32, f32) {
        let local = self.frame.to_local(wi);
        let Some(shadowing) = self.shadowing(wi, local) else {
            return (Rgb::BLACK, 0.0, 0.0);
        };
        let (f, pdf) = self.bsdf.eval_pdf(self.wo, local, Mode::Radiance);
        let back = match f.is_black() {
            true => 0.0,
            false => self.bsdf.pdf(local, self.wo),
        };
        (f * (local.z.abs() * shadowing), pdf, back)
    }

    /// What the weight of a sample in [`Mode::Importance`] is multiplied with to be that of light which goes
    /// on along `wi`: where shading and geometric normals differ, light crosses the surface by the one and is
    /// scattered by the other (Veach 1997, section 5.3.2).
    #[inline]
    pub fn adjoint(&self, hit: &Hit, wi: Vec3) -> f32 {
        let shading = self.wo.z * hit.ng.dot(wi);
        let geometric = hit.ng.dot(hit.wo) * self.frame.n.dot(wi);
        let factor = (shading / geometric).abs();
        if factor.is_finite() { factor } else { 0.0 }
    }

    /// A direction in which light goes on; see [`Bsdf::sample`].
    #[inline]
    pub fn sample(&self, u_lobe: f32, u: Vec2, mode: Mode) -> Option<BsdfSample> {
        let sample = self.bsdf.sample(self.wo, u_lobe, u, mode)?;
        let wi = self.frame.to_world(sample.wi);
        let shadowing = self.shadowing(wi, sample.wi)?;
        let weight = sample.weight * shadowing;
        Some(BsdfSample {
            wi,
            weight,
            ..sample
        })
    }

    /// Share of the light from `wi` that a relief leaves. `None` where `wi` lies on different sides of the
    /// relief and of the surface that carries it: such light would go through the surface.
    #[inline]
    fn shadowing(&self, wi: Vec3, local: Vec3) -> Option<f32> {
        let Some(bend) = self.bend else {
            return Some(1.0);
        };
        let cos = bend.normal.dot(wi);
        (cos * local.z > 0.0).then(|| relief::shadowing(bend.alpha2, cos))
    }

    /// Share of the light from `wo` that is scattered on (see [`Bsdf::albedo`]).
    pub fn albedo(&self) -> Rgb {
        self.bsdf.albedo(self.wo)
    }

    /// Share of light that arrives equally from all directions which the diffuse lobe sends to `hit.wo` (see
    /// [`Bsdf::diffuse_towards`]).
    #[inline]
    pub fn diffuse_share(&self) -> Rgb {
        self.bsdf.diffuse_towards(self.wo)
    }

    /// The surface without that lobe; `None` if nothing is left.
    #[inline]
    pub fn without_diffuse(&self) -> Option<Shading> {
        let bsdf = self.bsdf.without_diffuse()?;
        Some(Shading { bsdf, ..*self })
    }

    /// Shading normal, on the side the BSDF calls its outside.
    pub fn normal(&self) -> Vec3 {
        self.frame.n
    }
}

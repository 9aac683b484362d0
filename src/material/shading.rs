//! A material at a hit: a BSDF in the frame that it refers to.

use crate::bsdf::{Bsdf, BsdfSample, Mode};
use crate::geom::Hit;
use crate::math::{Frame, Rgb, Vec2, Vec3};

/// How the surface scatters light at one hit. All directions are unit vectors in world space.
#[derive(Clone, Copy, Debug)]
pub struct Shading {
    pub bsdf: Bsdf,
    /// The frame of the BSDF: that of the hit, turned to the side that is seen where both sides are alike,
    /// and bent where the material has a relief.
    frame: Frame,
    /// `hit.wo` in that frame.
    wo: Vec3,
    /// Where a relief bends the frame: the normal of the smooth surface below.
    smooth: Option<Vec3>,
}

impl Shading {
    #[inline]
    pub fn new(hit: &Hit, frame: Frame, bsdf: Bsdf) -> Shading {
        Shading {
            bsdf,
            frame,
            wo: frame.to_local(hit.wo),
            smooth: None,
        }
    }

    /// The same with `frame` bent away from the surface whose normal is `smooth`.
    #[inline]
    pub fn bent(hit: &Hit, frame: Frame, smooth: Vec3, bsdf: Bsdf) -> Shading {
        Shading {
            smooth: Some(smooth),
            ..Shading::new(hit, frame, bsdf)
        }
    }

    /// f |cos| towards `wi` in 1/sr, and the density per steradian with which [`Shading::sample`] returns
    /// `wi`. Delta lobes contribute nothing.
    #[inline]
    pub fn eval_pdf(&self, wi: Vec3, mode: Mode) -> (Rgb, f32) {
        let local = self.frame.to_local(wi);
        if self.is_torn(wi, local) {
            return (Rgb::BLACK, 0.0);
        }
        let (f, pdf) = self.bsdf.eval_pdf(self.wo, local, mode);
        (f * local.z.abs(), pdf)
    }

    /// A direction in which light goes on; see [`Bsdf::sample`].
    #[inline]
    pub fn sample(&self, u_lobe: f32, u: Vec2, mode: Mode) -> Option<BsdfSample> {
        let sample = self.bsdf.sample(self.wo, u_lobe, u, mode)?;
        let wi = self.frame.to_world(sample.wi);
        (!self.is_torn(wi, sample.wi)).then_some(BsdfSample { wi, ..sample })
    }

    /// Whether `wi` lies on different sides of the relief and of the surface that carries it: such light
    /// would go through the surface, so it is left out.
    #[inline]
    fn is_torn(&self, wi: Vec3, local: Vec3) -> bool {
        match self.smooth {
            Some(n) => n.dot(wi) * local.z <= 0.0,
            None => false,
        }
    }

    /// Share of the light from `wo` that is scattered on (see [`Bsdf::albedo`]).
    pub fn albedo(&self) -> Rgb {
        self.bsdf.albedo(self.wo)
    }

    /// Shading normal, on the side the BSDF calls its outside.
    pub fn normal(&self) -> Vec3 {
        self.frame.n
    }
}

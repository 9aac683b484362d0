//! A diffuse base under a smooth clear boundary.

use super::dielectric::{delta, mirror};
use super::{BsdfSample, Density, fresnel};
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{Rgb, Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// Polished plastic: light is reflected by the boundary, or enters, is scattered by the base, again and again
/// between base and boundary, and leaves. One-sided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    /// Index of refraction inside over that outside, > 0.
    pub eta: f32,
    /// Factor on the reflection by the boundary, 1 for real matter.
    pub reflectance: Rgb,
    /// What the base sends out of the boundary, per share that gets in and that gets out (see [`Base::body`]).
    pub body: Rgb,
    /// Share of the samples for the boundary where it reflects half of the light.
    pub specular_share: f32,
}

/// What the boundary does with the light that the base scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base {
    eta2: f32,
    /// Share of the diffuse light from inside that gets through the boundary, times `eta2`.
    leaving: f32,
    /// Whether the colour of the base deepens with each reflection; else all of them count as white.
    nonlinear: bool,
}

impl Base {
    /// Under a smooth boundary of index ratio `eta` (inside over outside, > 0).
    pub fn smooth(eta: f32, nonlinear: bool) -> Base {
        // What gets in is eta² times what gets out: this is the latter, times eta².
        Base {
            eta2: eta * eta,
            leaving: fresnel::diffuse_through(f64::from(eta)) as f32,
            nonlinear,
        }
    }

    /// Under a boundary that lets the share `leaves` (above 0, to 1) of diffuse light from inside through.
    pub(super) fn new(eta: f32, leaves: f32, nonlinear: bool) -> Base {
        Base {
            eta2: eta * eta,
            leaving: leaves * (eta * eta),
            nonlinear,
        }
    }

    /// The sum of all reflections between a base of that `albedo` (0..1) and the boundary, over the squared
    /// index ratio that radiance loses on its way out: `a / (eta² (1 - a r))`, or `a / (eta² (1 - r))`
    /// where the model is linear in the albedo, for the boundary's reflectance `r` from inside.
    #[inline]
    pub fn body(&self, albedo: Rgb) -> Rgb {
        let tinted = if self.nonlinear { 1.0 } else { 0.0 };
        albedo.map(|a| {
            let absorbed = tinted * (1.0 - a).max(0.0);
            let a_or_white = 1.0 - absorbed;
            // 1 - a r = (1 - a) + a (1 - r): nothing cancels.
            a / (absorbed * self.eta2 + a_or_white * self.leaving)
        })
    }
}

/// Share of the samples for the boundary where it reflects half of the light: by the mean colours.
#[inline]
pub(super) fn specular_share(diffuse: Rgb, specular: Rgb) -> f32 {
    let (d, s) = (diffuse.mean(), specular.mean());
    if s > 0.0 { s / (d + s) } else { 0.0 }
}

/// Probability of the boundary's lobe: `reflected` is the share of the light it reflects.
#[inline]
pub(super) fn specular_prob(reflected: f32, specular_share: f32) -> f32 {
    let specular = reflected * specular_share;
    let diffuse = (1.0 - reflected) * (1.0 - specular_share);
    if specular > 0.0 {
        specular / (specular + diffuse)
    } else {
        0.0
    }
}

impl Plastic {
    /// `diffuse` is the albedo of the base, `reflectance` the factor on the boundary's reflection, all 0..1.
    #[inline]
    pub fn new(eta: f32, base: &Base, diffuse: Rgb, reflectance: Rgb) -> Plastic {
        Plastic {
            eta,
            reflectance,
            body: base.body(diffuse),
            specular_share: specular_share(diffuse, reflectance),
        }
    }

    /// Share that the boundary reflects, from outside.
    #[inline]
    fn reflected(&self, cos: f32) -> f32 {
        fresnel::dielectric(cos.min(1.0), self.eta).0
    }

    /// The diffuse lobe, which is chosen with the probability that the density holds.
    #[inline]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let (r_o, r_i) = (self.reflected(wo.z), self.reflected(wi.z));
        let prob = 1.0 - specular_prob(r_o, self.specular_share);
        let through = (1.0 - r_o) * (1.0 - r_i);
        (
            self.body * (FRAC_1_PI * through),
            prob * cosine_hemisphere_pdf(wi.z),
        )
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let r_o = self.reflected(wo.z);
        let prob = specular_prob(r_o, self.specular_share);
        if u_lobe < prob {
            return delta(mirror(wo), self.reflectance * (r_o / prob), 1.0);
        }
        let wi = cosine_hemisphere(u);
        let through = (1.0 - r_o) * (1.0 - self.reflected(wi.z));
        let weight = self.body * (through / (1.0 - prob));
        let pdf = (1.0 - prob) * cosine_hemisphere_pdf(wi.z);
        (pdf > 0.0 && !weight.is_black()).then_some(BsdfSample {
            wi,
            weight,
            density: Density::PerSr(pdf),
            eta: 1.0,
        })
    }

    /// Share of diffuse light that the base sends back towards `wo`, above the surface.
    #[inline]
    pub(super) fn diffuse_towards(&self, wo: Vec3) -> Rgb {
        self.body * ((1.0 - self.reflected(wo.z)) * self.entering())
    }

    /// The boundary alone, over a black base; `None` if that is black too.
    #[inline]
    pub(super) fn without_diffuse(&self) -> Option<Plastic> {
        (!self.reflectance.is_black()).then_some(Plastic {
            body: Rgb::BLACK,
            specular_share: 1.0,
            ..*self
        })
    }

    /// Share of diffuse light that the base sends back.
    pub(super) fn diffuse_albedo(&self) -> Rgb {
        let entering = self.entering();
        self.body * (entering * entering)
    }

    /// Share of diffuse light that enters.
    fn entering(&self) -> f32 {
        fresnel::diffuse_through(f64::from(self.eta)) as f32
    }

    /// Share of the light from `wo` that leaves again.
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        if wo.z <= 0.0 {
            return Rgb::BLACK;
        }
        let r = self.reflected(wo.z);
        self.reflectance * r + self.body * ((1.0 - r) * self.entering())
    }
}

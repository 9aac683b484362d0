//! The thin sheet: both sides alike, light that passes keeps its direction apart from the roughness.

use super::lobes::{self, Base, MARGIN, choose, facet_cos, half_vector, probabilities, tinted};
use super::{finish, usable};
use crate::bsdf::{BsdfSample, Mode, fresnel};
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{Rgb, Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;

/// A sheet without thickness: paper, leaves, frosted panes (Burley 2015, section 5.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledThin {
    pub base: Base,
    /// Index of refraction of the sheet over that around it, >= 0.
    pub eta: f32,
    /// From diffuse (0) to clear (1).
    pub spec_trans: f32,
    /// Share of diffuse light that goes through, 0..2: 1 is as much as is reflected, 2 all.
    pub diff_trans: f32,
    /// Factors on the share of samples: reflection, transmission, diffuse reflection and transmission.
    pub rates: [f32; 4],
}

impl PrincipledThin {
    /// An opaque sheet of index `eta`.
    #[inline]
    pub fn new(base: Base, eta: f32) -> PrincipledThin {
        PrincipledThin {
            base,
            eta,
            spec_trans: 0.0,
            diff_trans: 0.0,
            rates: [1.0; 4],
        }
    }

    /// The same with factors on the share of samples that specular reflection and transmission, diffuse
    /// reflection and transmission get. They change the noise only.
    #[inline]
    pub fn with_rates(self, rates: [f32; 4]) -> PrincipledThin {
        let rates = lobes::rates(rates);
        PrincipledThin { rates, ..self }
    }

    /// Roughness of what passes: two refractions that nearly cancel (Burley 2015, section 5.3).
    #[inline]
    fn passed_roughness(&self) -> f32 {
        (0.65 * self.eta - 0.35) * self.base.roughness
    }

    /// Weights of diffuse reflection and transmission.
    #[inline]
    fn diffuse_weights(&self) -> [f32; 2] {
        let (opaque, through) = (1.0 - self.spec_trans, 0.5 * self.diff_trans);
        [opaque * (1.0 - through), opaque * through]
    }

    /// Reflectance of the diffuse lobe on the side that light comes from, without sheen.
    pub(in crate::bsdf) fn diffuse_albedo(&self) -> Rgb {
        let [reflected, _] = self.diffuse_weights();
        self.base.diffuse_albedo() * reflected
    }

    #[inline]
    fn probs(&self, cos: f32) -> [f32; 4] {
        let [reflected, through] = self.diffuse_weights();
        let (tint, _) = tinted(&self.base, facet_cos(cos, self.base.roughness), self.eta);
        let (f, _) = fresnel::dielectric(facet_cos(cos, self.passed_roughness()), self.eta);
        let [a, b, c, d] = self.rates;
        probabilities([
            a * self.spec_trans * (tint.mean() + MARGIN),
            b * self.spec_trans * (1.0 - f + MARGIN) * self.base.color.mean(),
            c * reflected * self.base.diffuse_share(cos),
            d * through * self.base.color.mean(),
        ])
    }

    /// f and density for `wo` and `over` above the sheet, `over` standing for what goes through (mirrored
    /// by the sheet) when `passes`. `m` is the facet between them, `cos_d` its angle to either.
    #[inline]
    fn scatter(
        &self,
        [wo, over, m]: [Vec3; 3],
        cos_d: f32,
        passes: bool,
        probs: [f32; 4],
        mode: Mode,
    ) -> (Rgb, f32) {
        let [reflected, through] = self.diffuse_weights();
        let (mut f, mut pdf) = (Rgb::BLACK, 0.0);
        let specular = self.spec_trans > 0.0 && m.z > 0.0;
        let cosine = cosine_hemisphere_pdf(over.z);
        if passes {
            f += self.base.color * (through * FRAC_1_PI);
            pdf += probs[3] * cosine;
            if specular && is_behind([wo, over, m], mode) {
                let facets = self.base.facets(self.passed_roughness());
                let (d, g) = (0.25 * facets.d(m), facets.g1_over_cos(wo));
                let (r, _) = fresnel::dielectric(cos_d, self.eta);
                let value = self.spec_trans * (1.0 - r) * (d * (g * facets.g1_over_cos(over)));
                f += self.base.color * value;
                pdf += probs[1] * (d * g);
            }
            return (f, pdf);
        }
        if specular {
            let facets = self.base.facets(self.base.roughness);
            let (d, g) = (0.25 * facets.d(m), facets.g1_over_cos(wo));
            let (r, _) = tinted(&self.base, cos_d, self.eta);
            f += r * (self.spec_trans * (d * (g * facets.g1_over_cos(over))));
            pdf += probs[0] * (d * g);
        }
        f += self.base.diffuse(wo.z, over.z, cos_d) * reflected;
        f += self.base.sheen(cos_d) * reflected;
        (f, pdf + probs[2] * cosine)
    }

    #[inline]
    pub(in crate::bsdf) fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: Mode) -> (Rgb, f32) {
        if wo.z == 0.0 || wi.z == 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let passes = (wo.z > 0.0) != (wi.z > 0.0);
        let (wo, over) = (above(wo), above(wi));
        let (m, cos_d) = half_vector(wo, over);
        let probs = self.probs(wo.z.min(1.0));
        usable(self.scatter([wo, over, m], cos_d, passes, probs, mode))
    }

    #[inline]
    pub(in crate::bsdf) fn sample(
        &self,
        wo: Vec3,
        u_lobe: f32,
        u: Vec2,
        mode: Mode,
    ) -> Option<BsdfSample> {
        let up = above(wo);
        if up.z == 0.0 {
            return None;
        }
        let probs = self.probs(up.z.min(1.0));
        let (lobe, _) = choose(probs, u_lobe)?;
        let (over, m, cos_d) = if lobe < 2 {
            let roughness = match lobe {
                0 => self.base.roughness,
                _ => self.passed_roughness(),
            };
            let m = self.base.facets(roughness).sample(up, u);
            let (over, facet) = super::reflect(up, m)?;
            (over, m, facet.cos_o)
        } else {
            let over = cosine_hemisphere(u);
            let (m, cos_d) = half_vector(up, over);
            (over, m, cos_d)
        };
        let passes = lobe % 2 == 1;
        if lobe == 1 && !is_behind([up, over, m], mode) {
            return None;
        }
        let (f, pdf) = self.scatter([up, over, m], cos_d, passes, probs, mode);
        let z = if passes == (wo.z > 0.0) {
            -over.z
        } else {
            over.z
        };
        finish(Vec3::new(over.x, over.y, z), f, pdf, 1.0)
    }

    /// About the share of light from `wo` that is scattered on.
    pub(in crate::bsdf) fn albedo(&self, wo: Vec3) -> Rgb {
        let cos = wo.z.abs().min(1.0);
        let (reflect, _) = tinted(&self.base, cos, self.eta);
        let (r, _) = fresnel::dielectric(cos, self.eta);
        let specular = (reflect + self.base.color * (1.0 - r)) * self.spec_trans;
        (specular + self.base.color * (1.0 - self.spec_trans)).map(|v| v.min(1.0))
    }
}

/// Whether what goes through lies behind the facet `m`, which only the masking of the model asks for: light
/// that arrives must. Photons arrive from `wo`.
#[inline]
fn is_behind([wo, over, m]: [Vec3; 3], mode: Mode) -> bool {
    let from = match mode {
        Mode::Radiance => over,
        Mode::Importance => wo,
    };
    from.z * m.z > from.x * m.x + from.y * m.y
}

#[inline]
fn above(w: Vec3) -> Vec3 {
    Vec3::new(w.x, w.y, w.z.abs())
}

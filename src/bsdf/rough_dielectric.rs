//! Frosted glass: a rough boundary between two dielectrics.

use super::microfacet::Microfacet;
use super::{BsdfSample, Density, Dielectric, Mode, fresnel};
use crate::math::{Rgb, Vec2, Vec3};

/// Facets that reflect and refract as a smooth boundary does, with normals of a microfacet distribution and
/// Smith's masking and shadowing taken as independent (Walter et al. 2007, equations 20 and 21). Light that
/// meets more than one facet is lost, as in that model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    pub facets: Microfacet,
    /// What a facet is.
    pub surface: Dielectric,
}

/// A facet seen from `wo` and what it does with the light from there.
struct Facet {
    m: Vec3,
    /// Cosine between `m` and `wo`, > 0.
    cos: f32,
    /// Share that is reflected.
    r: f32,
    /// Cosine between `-m` and the refracted direction.
    cos_t: f32,
    /// Length of `wo + eta wi` for the refracted `wi`.
    length: f32,
}

impl RoughDielectric {
    #[inline]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: Mode) -> (Rgb, f32) {
        // Turned such that `wo` lies above the surface: facets have no tangent direction of their own.
        let (eta, wo, wi) = self.seen_from_above(wo, wi);
        if wo.z <= 0.0 || wi.z == 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        if wi.z > 0.0 {
            let Some(half) = self.facets.half_vector(wo, wi) else {
                return (Rgb::BLACK, 0.0);
            };
            let (r, _) = fresnel::dielectric(half.cos, eta);
            let pdf = r * self.reflected_pdf(wo, half.m, half.cos);
            return (
                self.surface.reflectance * (r * self.reflection(wo, wi, half.d)),
                pdf,
            );
        }
        let Some(facet) = refracting_facet(wo, wi, eta) else {
            return (Rgb::BLACK, 0.0);
        };
        let f = self.refraction(wo, wi, &facet, eta, mode);
        (
            self.surface.transmittance * f,
            (1.0 - facet.r) * self.refracted_pdf(wo, &facet, eta),
        )
    }

    /// A facet by the distribution of normals, then reflection or refraction by `u_lobe`.
    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: Mode) -> Option<BsdfSample> {
        let (eta, up, _) = self.seen_from_above(wo, wo);
        if up.z <= 0.0 {
            return None;
        }
        let m = self.chosen_from(up).sample(up, u);
        let cos = up.dot(m).min(1.0);
        if cos <= 0.0 {
            return None;
        }
        let (r, cos_t) = fresnel::dielectric(cos, eta);
        // The difference of two cosines that are nearly equal where eta is nearly 1: by their squares.
        let length = ((eta - 1.0) * (eta + 1.0)).abs() / (cos + eta * cos_t);
        let facet = Facet {
            m,
            cos,
            r,
            cos_t,
            length,
        };
        // Weights and densities from the sampled normal, not from the rounded directions, in which narrow
        // lobes have lost their shape.
        let weight = self.weight_of_normal(up, &facet);
        let (wi, weight, pdf, eta) = if u_lobe < r {
            let wi = 2.0 * cos * m - up;
            let pdf = r * self.reflected_pdf(up, m, cos);
            (wi, self.surface.reflectance * weight, pdf, 1.0)
        } else {
            // The part along the facet is short when it is stretched much, so it comes first.
            let wi = ((cos * m - up) / eta - cos_t * m).normalize();
            let pdf = (1.0 - r) * self.refracted_pdf(up, &facet, eta);
            let scale = weight * radiance_scale(eta, mode);
            (wi, self.surface.transmittance * scale, pdf, eta)
        };
        let reflected = u_lobe < r;
        if (wi.z > 0.0) != reflected || wi.z == 0.0 {
            return None;
        }
        let weight = weight * (self.facets.g1_over_cos(upper(wi)) * wi.z.abs());
        // Between equal indices all facets send light straight on: no density holds that.
        let density = match pdf.is_finite() {
            true => Density::PerSr(pdf),
            false => Density::Delta,
        };
        let wi = if wo.z > 0.0 { wi } else { -wi };
        (pdf > 0.0 && wi.z != 0.0 && !weight.is_black()).then_some(BsdfSample {
            wi,
            weight,
            density,
            eta,
        })
    }

    /// The index ratio in the direction of travel, and both directions turned such that `wo` is above.
    #[inline]
    fn seen_from_above(&self, wo: Vec3, wi: Vec3) -> (f32, Vec3, Vec3) {
        if wo.z > 0.0 {
            (self.surface.eta, wo, wi)
        } else {
            (1.0 / self.surface.eta, -wo, -wi)
        }
    }

    /// The distribution that normals are chosen from. Where these are not only the visible ones it is wider
    /// than the facets', so that the weights at grazing angles stay bounded (Walter et al. 2007, section 5.3).
    #[inline]
    fn chosen_from(&self, wo: Vec3) -> Microfacet {
        match self.facets.visible {
            true => self.facets,
            false => Microfacet {
                alpha: self.facets.alpha * (1.2 - 0.2 * wo.z.sqrt()),
                ..self.facets
            },
        }
    }

    /// D G1(wo) (wo·m) / wo.z over the density of the normal.
    #[inline]
    fn weight_of_normal(&self, wo: Vec3, facet: &Facet) -> f32 {
        if self.facets.visible {
            return 1.0;
        }
        let visible = self.facets.d(facet.m) * self.facets.g1_over_cos(wo) * facet.cos;
        let density = self.chosen_from(wo).pdf(wo, facet.m);
        if density > 0.0 {
            visible / density
        } else {
            0.0
        }
    }

    /// Density of the direction that the facet of normal `m` reflects `wo` into.
    #[inline]
    fn reflected_pdf(&self, wo: Vec3, m: Vec3, cos: f32) -> f32 {
        let from = self.chosen_from(wo);
        from.reflected_pdf(from.d(m), from.g1_over_cos(wo), m.z, cos)
    }

    /// D G / (4 cos cos).
    #[inline]
    fn reflection(&self, wo: Vec3, wi: Vec3, d: f32) -> f32 {
        0.25 * d * (self.facets.g1_over_cos(wo) * self.facets.g1_over_cos(wi))
    }

    /// Density of the refracted direction: that of the facet normal over the spread of the directions per
    /// normal (Walter et al. 2007, equation 17).
    #[inline]
    fn refracted_pdf(&self, wo: Vec3, facet: &Facet, eta: f32) -> f32 {
        let from = self.chosen_from(wo);
        let ratio = eta / facet.length;
        from.pdf(wo, facet.m) * facet.cos_t * (ratio * ratio)
    }

    /// Walter et al. 2007, equation 21.
    #[inline]
    fn refraction(&self, wo: Vec3, wi: Vec3, facet: &Facet, eta: f32, mode: Mode) -> f32 {
        let masking = self.facets.g1_over_cos(wo) * self.facets.g1_over_cos(upper(wi));
        let ratio = eta / facet.length;
        let spread = facet.cos * facet.cos_t * (ratio * ratio);
        (1.0 - facet.r) * self.facets.d(facet.m) * masking * spread * radiance_scale(eta, mode)
    }

    /// Share of the light from `wo` that leaves again on either side, were the boundary smooth.
    #[inline]
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        self.surface.albedo(wo)
    }
}

/// The facet that refracts the light from `wo` (above) into `wi` (below): its normal is that of the plane in
/// which `wo + eta wi` has no part (Walter et al. 2007, equation 16).
#[inline]
fn refracting_facet(wo: Vec3, wi: Vec3, eta: f32) -> Option<Facet> {
    let h = wo + eta * wi;
    let length = h.length();
    // It points to the side of the lower index.
    let m = h * (if eta > 1.0 { -1.0 } else { 1.0 } / length);
    let (cos, below) = (wo.dot(m), wi.dot(m));
    if !(m.z > 0.0 && cos > 0.0 && below < 0.0) {
        return None;
    }
    // From the thinner side: on the other the angle next to the critical one has lost its digits.
    let (r, _) = match eta > 1.0 {
        true => fresnel::dielectric(cos.min(1.0), eta),
        false => fresnel::dielectric((-below).min(1.0), 1.0 / eta),
    };
    Some(Facet {
        m,
        cos,
        r,
        cos_t: -below,
        length,
    })
}

/// Masking is the same from either end of a direction.
#[inline]
fn upper(w: Vec3) -> Vec3 {
    if w.z < 0.0 { -w } else { w }
}

/// Radiance is compressed into the narrower cone of the denser side: L / index² is invariant (Veach 1997,
/// section 5.2). Photons carry power, which is not.
#[inline]
pub(super) fn radiance_scale(eta: f32, mode: Mode) -> f32 {
    match mode {
        Mode::Radiance => 1.0 / (eta * eta),
        Mode::Importance => 1.0,
    }
}

//! Burley's principled materials: one for the surfaces of solids, one for thin sheets.
//!
//! Burley 2012, "Physically-based shading at Disney", and 2015, "Extending the Disney BRDF to a BSDF with
//! integrated subsurface scattering". What the papers leave open (how lobes are weighted, masking, the
//! inside) is as in Mitsuba 3.9, found by measuring its values.
//!
//! Samples come from one lobe, chosen about by the energy that it carries; the weight is that of all lobes
//! over the density of all (Veach's balance heuristic), so no lobe has to be matched closely. Whether a
//! facet reflects or refracts is decided after the facet is known.

mod lobes;
mod thin;

pub use lobes::Base;
pub use thin::PrincipledThin;

use super::{BsdfSample, Density, Mode};
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{Rgb, Vec2, Vec3, sqr};
use lobes::{Coat, MARGIN, choose, facet_cos, half_vector, probabilities, schlick, tinted};

/// The surface of a solid body: metal, or a dielectric coat over a diffuse base or over clear matter, with
/// sheen and a clear coat on the outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    pub base: Base,
    /// Index of refraction inside over that outside, > 0.
    pub eta: f32,
    /// From dielectric (0) to metal (1).
    pub metallic: f32,
    /// From diffuse (0) to clear (1), for what is not metal.
    pub spec_trans: f32,
    /// Strength of the clear coat, >= 0, and its gloss, 0..1.
    pub clearcoat: f32,
    pub clearcoat_gloss: f32,
    /// Factors on the share of samples: microfacets, clear coat, diffuse; > 0.
    pub rates: [f32; 3],
}

/// A facet and the two directions it connects.
#[derive(Clone, Copy)]
struct Facet {
    /// Unit normal, m.z > 0.
    m: Vec3,
    /// Cosine to `wo`, > 0; and to `wi`, taken positive.
    cos_o: f32,
    cos_i: f32,
    /// Length of `wo + eta wi` for refraction.
    length: f32,
}

/// What the microfacets do with light that meets one at some angle.
struct Interface {
    reflect: Rgb,
    transmit: Rgb,
    cos_t: f32,
}

impl Interface {
    /// Probability of following the reflection.
    #[inline]
    fn prob_reflect(&self) -> f32 {
        let (r, t) = (self.reflect.mean(), self.transmit.mean());
        if t > 0.0 { r / (r + t) } else { 1.0 }
    }
}

impl Principled {
    /// A dielectric of index `eta` without metal, transmission or coat. An index of exactly 1, where the
    /// model has no interface to refract at, is taken as 1.001.
    #[inline]
    pub fn new(base: Base, eta: f32) -> Principled {
        Principled {
            base,
            eta: if eta == 1.0 { 1.001 } else { eta },
            metallic: 0.0,
            spec_trans: 0.0,
            clearcoat: 0.0,
            clearcoat_gloss: 0.0,
            rates: [1.0; 3],
        }
    }

    /// The same with factors on the share of samples that microfacets, clear coat and diffuse lobe get.
    /// They change the noise only.
    #[inline]
    pub fn with_rates(self, rates: [f32; 3]) -> Principled {
        let rates = lobes::rates(rates);
        Principled { rates, ..self }
    }

    /// Weight of the diffuse base.
    #[inline]
    fn opaque(&self) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.spec_trans)
    }

    /// Reflectance of the diffuse base alone, without sheen.
    pub(super) fn diffuse_albedo(&self) -> Rgb {
        self.base.diffuse_albedo() * self.opaque()
    }

    /// Index beyond the surface over that on the side of `wo`.
    #[inline]
    fn eta_from(&self, outside: bool) -> f32 {
        if outside { self.eta } else { 1.0 / self.eta }
    }

    #[inline]
    fn interface(&self, cos: f32, outside: bool) -> Interface {
        let eta = self.eta_from(outside);
        let clear = (1.0 - self.metallic) * self.spec_trans;
        let (f, cos_t) = super::fresnel::dielectric(cos, eta);
        let reflect = if outside {
            let (dielectric, _) = tinted(&self.base, cos, eta);
            dielectric.lerp(schlick(self.base.color, cos, cos_t, eta), self.metallic)
        } else {
            Rgb::splat(clear * f)
        };
        Interface {
            reflect,
            transmit: self.base.color.map(f32::sqrt) * (clear * (1.0 - f)),
            cos_t,
        }
    }

    /// Probabilities of microfacets, clear coat and diffuse lobe.
    #[inline]
    fn probs(&self, cos: f32, outside: bool) -> [f32; 3] {
        let met = facet_cos(cos, self.base.roughness);
        let at = self.interface(met, outside);
        let facets = at.reflect.mean() + at.transmit.mean();
        if !outside {
            return probabilities([facets, 0.0, 0.0]);
        }
        let facets = facets + MARGIN;
        // The masked lobe loses about a cosine on either side; long tails leave some at grazing angles.
        let coat = self.clearcoat
            * schlick(Rgb::splat(0.04), cos, cos, 2.0).r
            * (sqr(cos) + 0.1 * (1.0 - cos));
        let diffuse = self.opaque() * self.base.diffuse_share(cos);
        let [a, b, c] = self.rates;
        probabilities([a * facets, b * coat, c * diffuse])
    }

    /// The facet that takes `wo` (above the surface) to `wi`. `None` where there is none that both see from
    /// the sides they are on.
    #[inline]
    fn facet(wo: Vec3, wi: Vec3, eta: f32) -> Option<Facet> {
        if wi.z > 0.0 {
            let (m, cos) = half_vector(wo, wi);
            return (m.z > 0.0).then_some(Facet {
                m,
                cos_o: cos,
                cos_i: cos,
                length: 0.0,
            });
        }
        // Walter et al. 2007, equation 16, turned to the upper side.
        let h = wo + wi * eta;
        let length = h.length();
        let m = h / if h.z < 0.0 { -length } else { length };
        let (cos_o, cos_i) = (wo.dot(m), -wi.dot(m));
        (cos_o > 0.0 && cos_i > 0.0 && m.z > 0.0).then_some(Facet {
            m,
            cos_o,
            cos_i,
            length,
        })
    }

    /// f and density for `wo` above the surface, of both sides of which `outside` says which it is.
    /// `probs` are those of [`Principled::probs`].
    #[inline]
    fn scatter(
        &self,
        [wo, wi]: [Vec3; 2],
        facet: &Facet,
        outside: bool,
        probs: [f32; 3],
        mode: Mode,
    ) -> (Rgb, f32) {
        let facets = self.base.facets(self.base.roughness);
        let Facet { m, cos_o, .. } = *facet;
        let at = self.interface(cos_o.min(1.0), outside);
        let d = facets.d(m);
        let g_o = facets.g1_over_cos(wo);
        if wi.z < 0.0 {
            let eta = self.eta_from(outside);
            // Walter et al. 2007, equations 21 and 17; photons are not compressed as radiance is.
            let jacobian = facet.cos_i / sqr(facet.length);
            let g = g_o * facets.g1_over_cos(-wi);
            let value = at.transmit * (d * g * (cos_o * jacobian));
            let pdf =
                probs[0] * (1.0 - at.prob_reflect()) * (g_o * cos_o * d * (sqr(eta) * jacobian));
            let value = match mode {
                Mode::Radiance => value,
                Mode::Importance => value * sqr(eta),
            };
            return (value, pdf);
        }
        let mut f = at.reflect * (0.25 * d * (g_o * facets.g1_over_cos(wi)));
        let mut pdf = probs[0] * at.prob_reflect() * (0.25 * d * g_o);
        if !outside {
            return (f, pdf);
        }
        if self.clearcoat > 0.0 {
            let coat = Coat::new(self.clearcoat_gloss);
            let reflectance = schlick(Rgb::splat(0.04), cos_o, at.cos_t, self.eta).r;
            let masking = coat.g1(wo) * coat.g1(wi);
            f += Rgb::splat(0.25 * self.clearcoat * reflectance * coat.d(m) * masking);
            pdf += probs[1] * coat.reflected_pdf(m, cos_o);
        }
        let opaque = self.opaque();
        // Without a diffuse base there is no sheen either.
        if opaque > 0.0 {
            f += self.base.diffuse(wo.z, wi.z, cos_o) * opaque;
            f += self.base.sheen(cos_o) * (1.0 - self.metallic);
            pdf += probs[2] * cosine_hemisphere_pdf(wi.z);
        }
        (f, pdf)
    }

    #[inline]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: Mode) -> (Rgb, f32) {
        let outside = wo.z > 0.0;
        // All lobes are alike under reflection through the point, so the side of `wo` becomes the upper one.
        let (wo, wi) = if outside { (wo, wi) } else { (-wo, -wi) };
        let goes_in = wi.z < 0.0;
        if wo.z <= 0.0 || wi.z == 0.0 || goes_in && self.spec_trans == 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        match Self::facet(wo, wi, self.eta_from(outside)) {
            Some(facet) => {
                let probs = self.probs(wo.z.min(1.0), outside);
                usable(self.scatter([wo, wi], &facet, outside, probs, mode))
            }
            None => (Rgb::BLACK, 0.0),
        }
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, mode: Mode) -> Option<BsdfSample> {
        let outside = wo.z > 0.0;
        let up = if outside { wo } else { -wo };
        if up.z <= 0.0 {
            return None;
        }
        let eta = self.eta_from(outside);
        let probs = self.probs(up.z.min(1.0), outside);
        let (lobe, u_lobe) = choose(probs, u_lobe)?;
        let (wi, facet) = match lobe {
            0 => {
                let m = self.base.facets(self.base.roughness).sample(up, u);
                self.follow(up, m, u_lobe, outside)?
            }
            1 => reflect(up, Coat::new(self.clearcoat_gloss).sample(u))?,
            _ => {
                let wi = cosine_hemisphere(u);
                (wi, Self::facet(up, wi, eta)?)
            }
        };
        let (f, pdf) = self.scatter([up, wi], &facet, outside, probs, mode);
        let wi_out = if outside { wi } else { -wi };
        finish(wi_out, f, pdf, if wi.z < 0.0 { eta } else { 1.0 })
    }

    /// Where light from `wo` goes at the facet `m`: reflected or refracted, by `u`. The facet is kept as it
    /// was drawn: what is refracted by an index near 1 has lost it.
    #[inline]
    fn follow(&self, wo: Vec3, m: Vec3, u: f32, outside: bool) -> Option<(Vec3, Facet)> {
        let cos_o = wo.dot(m).min(1.0);
        if cos_o <= 0.0 {
            return None;
        }
        let at = self.interface(cos_o, outside);
        if u < at.prob_reflect() {
            return reflect(wo, m);
        }
        let eta = self.eta_from(outside);
        let wi = m * (cos_o / eta - at.cos_t) - wo / eta;
        // |cos_o - eta cos_t| by the difference of squares.
        let length = ((eta - 1.0) * (eta + 1.0)).abs() / (cos_o + eta * at.cos_t);
        let facet = Facet {
            m,
            cos_o,
            cos_i: at.cos_t,
            length,
        };
        (wi.z < 0.0 && at.cos_t > 0.0).then(|| (wi.normalize(), facet))
    }

    /// About the share of light from `wo` that is scattered on.
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        let outside = wo.z > 0.0;
        let cos = wo.z.abs().min(1.0);
        let at = self.interface(cos, outside);
        let mut albedo = at.reflect + at.transmit;
        if outside {
            albedo += self.base.color * self.opaque();
        }
        albedo.map(|v| v.min(1.0))
    }
}

/// `wo` mirrored by the facet `m`; `None` when that leads below the surface.
#[inline]
fn reflect(wo: Vec3, m: Vec3) -> Option<(Vec3, Facet)> {
    let cos = wo.dot(m).min(1.0);
    let wi = 2.0 * cos * m - wo;
    let facet = Facet {
        m,
        cos_o: cos,
        cos_i: cos,
        length: 0.0,
    };
    (cos > 0.0 && wi.z > 0.0).then(|| (wi.normalize(), facet))
}

/// Value and density, or nothing where either has left the range of f32.
#[inline]
fn usable((f, pdf): (Rgb, f32)) -> (Rgb, f32) {
    if pdf > 0.0 && pdf.is_finite() && f.is_finite() {
        (f, pdf)
    } else {
        (Rgb::BLACK, 0.0)
    }
}

#[inline]
fn finish(wi: Vec3, f: Rgb, pdf: f32, eta: f32) -> Option<BsdfSample> {
    let weight = f * (wi.z.abs() / pdf);
    let good = pdf > 0.0 && pdf.is_finite() && weight.is_finite() && !weight.is_black();
    good.then_some(BsdfSample {
        wi,
        weight,
        density: Density::PerSr(pdf),
        eta,
    })
}

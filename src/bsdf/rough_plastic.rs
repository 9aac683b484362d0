//! A diffuse base under a rough clear boundary.

use std::f32::consts::FRAC_1_PI;
use std::sync::Mutex;

use super::microfacet::{HalfVector, Microfacet, Shape};
use super::plastic::{Base, specular_prob, specular_share};
use super::{BsdfSample, Density, fresnel};
use crate::math::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::math::{DVec3, Rgb, Vec2, Vec3, safe_sqrt};

/// Plastic with a surface of microfacets: what they reflect, and the light that gets through them to the base
/// and back out. One-sided, equally rough in all directions along the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughPlastic {
    pub facets: Microfacet,
    /// Index of refraction inside over that outside, > 0.
    pub eta: f32,
    pub coat: &'static Coat,
    /// Factor on the reflection by the facets, 1 for real matter.
    pub reflectance: Rgb,
    /// What the base sends out, per share that gets in and that gets out (see [`Base::body`]).
    pub body: Rgb,
    /// Share of the samples for the facets where these reflect half of the light.
    pub specular_share: f32,
}

/// Directions for which the transmittance of a rough boundary is kept.
const ANGLES: usize = 64;

/// Facet normals that stand for all: by slope, and by azimuth over one half (the other is its mirror image).
/// The sums over them are within 0.1 % of their limit, for grazing light of a coat thinner than air 1 %.
const SLOPES: usize = 96;
const AZIMUTHS: usize = 32;

/// What gets through a rough boundary, as a table.
#[derive(Debug, PartialEq)]
pub struct Coat {
    /// Share of the light from outside that goes on inside without meeting a second facet, by cosines from 0
    /// to 1 in equal steps.
    through: [f32; ANGLES],
    /// Share of diffuse light from inside that is not reflected back by one facet.
    leaves: f32,
    /// Share of diffuse light from outside that gets through.
    entering: f32,
}

/// The coats made so far; there are as many as there are different surfaces in the scenes of the program, so
/// they are kept for good, and a [`Bsdf`](super::Bsdf) stays a small value that refers to one.
static COATS: Mutex<Vec<(CoatKey, &'static Coat)>> = Mutex::new(Vec::new());

type CoatKey = (Shape, u32, u32);

impl Coat {
    /// The coat of facets of that `shape` and roughness `alpha` on a boundary of index ratio `eta` (inside
    /// over outside, > 0). The same arguments give the same coat, made the first time (some 10 ms).
    pub fn of(shape: Shape, alpha: f32, eta: f32) -> &'static Coat {
        let facets = Microfacet::new(shape, alpha, alpha);
        let key = (shape, facets.alpha.x.to_bits(), eta.to_bits());
        // A panic while the list is locked cannot leave it half written.
        let mut coats = COATS.lock().unwrap_or_else(|e| e.into_inner());
        if let Some((_, coat)) = coats.iter().find(|(k, _)| *k == key) {
            return coat;
        }
        let coat: &'static Coat = Box::leak(Box::new(Coat::new(&facets, eta)));
        coats.push((key, coat));
        coat
    }

    fn new(facets: &Microfacet, eta: f32) -> Coat {
        let normals = Normal::all(facets);
        let mut through = [0.0; ANGLES];
        let (mut leaves, mut entering, mut cosines) = (0.0, 0.0, 0.0);
        for (i, through) in through.iter_mut().enumerate() {
            let cos = (i as f32 / (ANGLES - 1) as f32).max(1e-6);
            let wo = Vec3::new(safe_sqrt(1.0 - cos * cos), 0.0, cos);
            let (t, kept) = shares(facets, &normals, wo, eta);
            *through = t as f32;
            // Means over diffuse light as sums over the same angles, ends included, as Mitsuba takes them:
            // for a smooth boundary of index 1.5 the reflectance from inside comes out 2 % too low.
            let cos = f64::from(cos);
            cosines += cos;
            leaves += cos * kept;
            entering += cos * t;
        }
        let (leaves, entering) = (leaves / cosines, entering / cosines);
        // Where next to nothing leaves, rounding must not make that nothing: what enters could leave by the
        // way it came, and a boundary of the largest index lets 1e-18 out.
        let least = (entering / f64::from(eta * eta)).max(1e-18);
        Coat {
            through,
            leaves: leaves.max(least).min(1.0) as f32,
            entering: entering as f32,
        }
    }

    /// Share of the light of cosine `cos` (0..1) from outside that gets through.
    #[inline]
    pub fn through(&self, cos: f32) -> f32 {
        let x = cos * (ANGLES - 1) as f32;
        let i = (x as usize).min(ANGLES - 2);
        let w = x - i as f32;
        self.through[i] * (1.0 - w) + self.through[i + 1] * w
    }

    /// What this coat does with light from the base below.
    pub fn base(&self, eta: f32, nonlinear: bool) -> Base {
        Base::new(eta, self.leaves, nonlinear)
    }
}

/// A facet normal, and how much of the surface has normals near it.
struct Normal {
    m: Vec3,
    area: f32,
}

impl Normal {
    /// Over the cumulative share of the area as seen along the surface normal, which a cubic stretches at
    /// both ends: the tails of the distribution are long.
    fn all(facets: &Microfacet) -> Vec<Normal> {
        let mut normals = Vec::with_capacity(SLOPES * AZIMUTHS);
        for i in 0..SLOPES {
            let x = (i as f64 + 0.5) / SLOPES as f64;
            let share = x * x * (3.0 - 2.0 * x);
            let left = (1.0 - x) * (1.0 - x) * (1.0 + 2.0 * x);
            let slope2 = match facets.shape {
                Shape::Ggx => share / left,
                Shape::Beckmann => -left.ln(),
            };
            let slope = f64::from(facets.alpha.x) * slope2.sqrt();
            for k in 0..AZIMUTHS {
                let phi = std::f64::consts::PI * (k as f64 + 0.5) / AZIMUTHS as f64;
                let n = DVec3::new(-slope * phi.cos(), -slope * phi.sin(), 1.0);
                normals.push(Normal {
                    m: n.normalize().as_vec3(),
                    area: (x * (1.0 - x) * n.length()) as f32,
                });
            }
        }
        normals
    }
}

/// Of the light from `wo` outside, the share that the facets let through; of that from `wo` inside, the
/// share that they do not reflect: means over the facets visible from `wo`, each with the masking of the
/// direction it sends the light into (Heitz & d'Eon 2014, equation 18).
fn shares(facets: &Microfacet, normals: &[Normal], wo: Vec3, eta: f32) -> (f64, f64) {
    let (mut through, mut reflected, mut all) = (0.0, 0.0, 0.0);
    for Normal { m, area } in normals {
        let cos = wo.dot(*m).min(1.0);
        if cos <= 0.0 {
            continue;
        }
        let visible = area * cos;
        all += f64::from(visible);
        let (r, cos_t) = fresnel::dielectric(cos, eta);
        let below = wo / eta - (cos / eta - cos_t) * *m;
        if r < 1.0 && below.z > 0.0 {
            let open = facets.g1_over_cos(below) * below.z;
            through += f64::from(visible * (1.0 - r) * open);
        }
        let wi = 2.0 * cos * *m - wo;
        if wi.z > 0.0 {
            let (r, _) = fresnel::dielectric(cos, 1.0 / eta);
            let open = facets.g1_over_cos(wi) * wi.z;
            reflected += f64::from(visible * r * open);
        }
    }
    // At grazing angles few facets are seen, but some always are: those that face the light.
    (through / all, 1.0 - reflected / all)
}

impl RoughPlastic {
    /// `facets` equally rough along both tangents, of the roughness of the `coat`; `base` is that of the
    /// coat; `diffuse` is the albedo of the base, `reflectance` the factor on the facets' reflection, 0..1.
    #[inline]
    pub fn new(
        facets: Microfacet,
        eta: f32,
        coat: &'static Coat,
        base: &Base,
        diffuse: Rgb,
        reflectance: Rgb,
    ) -> RoughPlastic {
        RoughPlastic {
            facets,
            eta,
            coat,
            reflectance,
            body: base.body(diffuse),
            specular_share: specular_share(diffuse, reflectance),
        }
    }

    #[inline]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Rgb, f32) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (Rgb::BLACK, 0.0);
        }
        let t_o = self.coat.through(wo.z);
        let prob = specular_prob(1.0 - t_o, self.specular_share);
        self.both_lobes(wo, wi, t_o, prob, self.facets.half_vector(wo, wi))
    }

    /// Value and density of both lobes towards `wi`, above the surface, where `half` is the facet between.
    #[inline]
    fn both_lobes(
        &self,
        wo: Vec3,
        wi: Vec3,
        t_o: f32,
        prob: f32,
        half: Option<HalfVector>,
    ) -> (Rgb, f32) {
        let mut f = self.body * (FRAC_1_PI * t_o * self.coat.through(wi.z));
        let mut pdf = (1.0 - prob) * cosine_hemisphere_pdf(wi.z);
        if let Some(half) = half {
            let masking = self.facets.g1_over_cos(wo);
            let (r, _) = fresnel::dielectric(half.cos, self.eta);
            let facets = 0.25 * half.d * (masking * self.facets.g1_over_cos(wi));
            f += self.reflectance * (r * facets);
            pdf += prob
                * self
                    .facets
                    .reflected_pdf(half.d, masking, half.m.z, half.cos);
        }
        (f, pdf)
    }

    #[inline]
    pub(super) fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let t_o = self.coat.through(wo.z);
        let prob = specular_prob(1.0 - t_o, self.specular_share);
        let (wi, half) = if u_lobe < prob {
            let m = self.facets.sample(wo, u);
            let cos = wo.dot(m);
            let wi = 2.0 * cos * m - wo;
            // From the sampled normal: see RoughConductor.
            let d = self.facets.d(m);
            (
                wi,
                (cos > 0.0 && d > 0.0).then_some(HalfVector {
                    m,
                    d,
                    cos: cos.min(1.0),
                }),
            )
        } else {
            let wi = cosine_hemisphere(u);
            (wi, self.facets.half_vector(wo, wi))
        };
        if wi.z <= 0.0 {
            return None;
        }
        let (f, pdf) = self.both_lobes(wo, wi, t_o, prob, half);
        let weight = f * (wi.z / pdf);
        let usable = pdf > 0.0 && pdf.is_finite() && !weight.is_black();
        usable.then_some(BsdfSample {
            wi,
            weight,
            density: Density::PerSr(pdf),
            eta: 1.0,
        })
    }

    /// Share of diffuse light that the base sends back towards `wo`, above the surface.
    #[inline]
    pub(super) fn diffuse_towards(&self, wo: Vec3) -> Rgb {
        self.body * (self.coat.through(wo.z) * self.coat.entering)
    }

    /// The boundary alone, over a black base; `None` if that is black too.
    #[inline]
    pub(super) fn without_diffuse(&self) -> Option<RoughPlastic> {
        (!self.reflectance.is_black()).then_some(RoughPlastic {
            body: Rgb::BLACK,
            specular_share: 1.0,
            ..*self
        })
    }

    /// Share of diffuse light that the base sends back.
    pub(super) fn diffuse_albedo(&self) -> Rgb {
        self.body * (self.coat.entering * self.coat.entering)
    }

    /// Share of the light from `wo` that leaves again, the facets' part without masking.
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        if wo.z <= 0.0 {
            return Rgb::BLACK;
        }
        let (r, _) = fresnel::dielectric(wo.z.min(1.0), self.eta);
        self.reflectance * r + self.body * (self.coat.through(wo.z) * self.coat.entering)
    }
}

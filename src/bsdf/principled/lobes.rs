//! The lobes that both principled materials are made of.

use crate::bsdf::fresnel;
use crate::bsdf::{Microfacet, Shape};
use crate::math::warp::concentric_disk;
use crate::math::{Rgb, Vec2, Vec3, sqr};
use std::f32::consts::FRAC_1_PI;

/// Narrowest microfacet lobe of the model.
const ALPHA_MIN: f32 = 1e-3;

/// Roughness along both tangents that shapes the masking of the clear coat, whatever its gloss.
const COAT_MASKING: f32 = 0.25;

/// Smallest share of samples, relative to the energy, that a user's rate may leave to a lobe: what carries
/// energy must stay within reach, or the picture would miss it.
const RATE_MIN: f32 = 0.01;

/// Added to what facets reflect, or let through, at their [`facet_cos`]: keeps a lobe within reach that would
/// carry nothing at that angle, but does at others.
pub(super) const MARGIN: f32 = 0.02;

/// What both materials have: a colour, a roughness, and how the colour enters the lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base {
    /// Colour of the diffuse lobe, of the metal, and by its square root of what is refracted; 0..1.
    pub color: Rgb,
    /// 0..1; the microfacets have the square of it.
    pub roughness: f32,
    /// Stretch of the microfacets along the first tangent, in (0, 1]; 1 when isotropic.
    pub aspect: f32,
    /// How much of the reflection has the tint of the colour, 0..1.
    pub spec_tint: f32,
    /// Strength of the sheen, and how much of it has the tint of the colour (0..1).
    pub sheen: f32,
    pub sheen_tint: f32,
    /// From Burley's diffuse lobe (0) to one that is flat as if light came out elsewhere (1).
    pub flatness: f32,
}

impl Base {
    /// `anisotropic` in 0..1. Burley 2012, section 5.4: the aspect ratio is `sqrt(1 - 0.9 anisotropic)`.
    #[inline]
    pub fn new(color: Rgb, roughness: f32, anisotropic: f32) -> Base {
        Base {
            color,
            roughness,
            aspect: (1.0 - 0.9 * anisotropic.clamp(0.0, 1.0)).sqrt(),
            spec_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            flatness: 0.0,
        }
    }

    #[inline]
    pub fn is_anisotropic(&self) -> bool {
        self.aspect != 1.0
    }

    /// The microfacets of a surface of this aspect and some `roughness`.
    #[inline]
    pub(super) fn facets(&self, roughness: f32) -> Microfacet {
        let alpha = sqr(roughness);
        Microfacet::new(
            Shape::Ggx,
            (alpha / self.aspect).max(ALPHA_MIN),
            (alpha * self.aspect).max(ALPHA_MIN),
        )
    }

    /// The hue of the colour, of luminance 1.
    #[inline]
    pub(super) fn tint(&self) -> Rgb {
        let luminance = self.color.luminance();
        if luminance > 0.0 {
            self.color / luminance
        } else {
            Rgb::WHITE
        }
    }

    /// Diffuse reflection in 1/sr: Burley's (2012, section 5.3, with the retroreflection apart as in 2015,
    /// equation 4) and the flat one that approximates subsurface scattering (2012, after Hanrahan & Krueger).
    ///
    /// `cos_o`, `cos_i` to the normal, `cos_d` between either direction and the half vector.
    #[inline]
    pub(super) fn diffuse(&self, cos_o: f32, cos_i: f32, cos_d: f32) -> Rgb {
        let (fo, fi) = (schlick_weight(cos_o), schlick_weight(cos_i));
        let rr = 2.0 * self.roughness * sqr(cos_d);
        let lambert = (1.0 - 0.5 * fo) * (1.0 - 0.5 * fi);
        let retro = rr * (fo + fi + fo * fi * (rr - 1.0));
        let mut shape = lambert + retro;
        if self.flatness > 0.0 {
            let at = |f: f32| 1.0 + (0.5 * rr - 1.0) * f;
            let ss = at(fo) * at(fi);
            let flat = 1.25 * (ss * (1.0 / (cos_o + cos_i) - 0.5) + 0.5);
            shape += (flat - shape) * self.flatness;
        }
        self.color * (shape * FRAC_1_PI)
    }

    /// Share of light from everywhere that [`Base::diffuse`] reflects: both of its shapes are polynomials in the
    /// roughness, whose coefficients were integrated over both hemispheres. Rough white reflects up to 7 % more than
    /// all.
    pub(super) fn diffuse_albedo(&self) -> Rgb {
        let r = self.roughness;
        let burley = 0.952_948 + r * (0.108_702 + r * 0.003_519);
        let flat = 0.939_110 + r * (0.043_684 + r * 0.002_135);
        self.color * (burley + (flat - burley) * self.flatness)
    }

    /// Sheen in 1/sr (Burley 2012, section 5.6).
    #[inline]
    pub(super) fn sheen(&self, cos_d: f32) -> Rgb {
        if self.sheen > 0.0 {
            let hue = Rgb::WHITE.lerp(self.tint(), self.sheen_tint);
            hue * (self.sheen * schlick_weight(cos_d))
        } else {
            Rgb::BLACK
        }
    }

    /// About the share of light that diffuse lobe and sheen together reflect: for choosing lobes.
    #[inline]
    pub(super) fn diffuse_share(&self, cos_o: f32) -> f32 {
        self.color.mean() + 0.3 * self.sheen * (schlick_weight(cos_o) + 0.01)
    }
}

/// About the cosine at which facets of this roughness are met from a direction of cosine `cos`: along the
/// surface only those are seen that lean towards it. Within some per cent of the mean over visible normals,
/// which is 2/3 at `cos` 0 and roughness 1.
#[inline]
pub(super) fn facet_cos(cos: f32, roughness: f32) -> f32 {
    let c2 = sqr(cos);
    (c2 + 0.45 * sqr(sqr(roughness)) * (1.0 - c2))
        .clamp(0.0, 1.0)
        .sqrt()
}

/// `(1 - cos)^5` (Schlick 1994, equation 15).
#[inline]
pub(super) fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    sqr(sqr(m)) * m
}

/// Schlick's reflectance that rises from `r0` to 1. `cos` on the side of the light, `cos_t` beyond (0 under
/// total reflection): the one in the thinner medium counts. `eta` is the index beyond over that here.
#[inline]
pub(super) fn schlick(r0: Rgb, cos: f32, cos_t: f32, eta: f32) -> Rgb {
    r0.lerp(
        Rgb::WHITE,
        schlick_weight(if eta > 1.0 { cos } else { cos_t }),
    )
}

/// Reflectance at normal incidence.
#[inline]
pub(super) fn r0(eta: f32) -> f32 {
    sqr((eta - 1.0) / (eta + 1.0))
}

/// Reflectance of a dielectric whose normal reflectance has the tint of `base`, as far as `spec_tint`
/// says. Also the cosine beyond the interface.
#[inline]
pub(super) fn tinted(base: &Base, cos: f32, eta: f32) -> (Rgb, f32) {
    let (f, cos_t) = fresnel::dielectric(cos, eta);
    let plain = Rgb::splat(f);
    if base.spec_tint > 0.0 {
        let hued = schlick(base.tint() * r0(eta), cos, cos_t, eta);
        (plain.lerp(hued, base.spec_tint), cos_t)
    } else {
        (plain, cos_t)
    }
}

/// The half vector of a reflection: the facet that mirrors `wo` into `wi`, both above the surface, and the
/// cosine it has with either. Half the sum of two unit vectors has the length of that cosine.
#[inline]
pub(super) fn half_vector(wo: Vec3, wi: Vec3) -> (Vec3, f32) {
    let h = wo + wi;
    let length = h.length().max(f32::MIN_POSITIVE);
    (h / length, (0.5 * length).min(1.0))
}

/// The clear coat: normals with the long tails of GTR with exponent 1 (Burley 2012, appendix B.2).
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    /// In (0, 1).
    pub alpha: f32,
}

impl Coat {
    /// `gloss` in 0..1.
    #[inline]
    pub fn new(gloss: f32) -> Coat {
        Coat {
            alpha: 0.1 + (0.001 - 0.1) * gloss,
        }
    }

    /// D(m), equation 4 of the appendix.
    #[inline]
    pub fn d(&self, m: Vec3) -> f32 {
        let a2 = sqr(self.alpha);
        // 1 - (1 - a²) cos², from the sine: near the normal the difference would cancel.
        let sin2 = sqr(m.x) + sqr(m.y);
        (1.0 - a2) * FRAC_1_PI / (-a2.ln() * (a2 * (1.0 - sin2).max(0.0) + sin2))
    }

    /// Smith's masking of GGX at a fixed roughness.
    #[inline]
    pub fn g1(&self, w: Vec3) -> f32 {
        let (a2, z2) = (sqr(COAT_MASKING), sqr(w.z));
        2.0 * w.z / (w.z + (a2 + z2 - a2 * z2).sqrt())
    }

    /// A facet normal with density `d(m) m.z` per steradian (equation 5 of the appendix, inverted).
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let disk = concentric_disk(u);
        let t = disk.length_squared();
        if t == 0.0 {
            return Vec3::Z;
        }
        let a2 = sqr(self.alpha);
        let sin2 = (a2 * (-t * a2.ln()).exp_m1() / (1.0 - a2)).clamp(0.0, 1.0);
        (disk * (sin2 / t).sqrt()).extend((1.0 - sin2).max(f32::MIN_POSITIVE).sqrt())
    }

    /// Density per steradian of the direction that [`Coat::sample`] reflects `wo` into; `cos_d` to `m`.
    #[inline]
    pub fn reflected_pdf(&self, m: Vec3, cos_d: f32) -> f32 {
        self.d(m) * m.z / (4.0 * cos_d)
    }
}

/// Rates as [`choose`] takes them: of at least [`RATE_MIN`].
#[inline]
pub(super) fn rates<const N: usize>(rates: [f32; N]) -> [f32; N] {
    rates.map(|r| r.max(RATE_MIN))
}

/// Probabilities from weights; all zero when no lobe carries anything.
#[inline]
pub(super) fn probabilities<const N: usize>(weights: [f32; N]) -> [f32; N] {
    let sum: f32 = weights.iter().sum();
    if sum > 0.0 {
        weights.map(|w| w / sum)
    } else {
        [0.0; N]
    }
}

/// The lobe that `u` falls on, and where within its share, in [0,1). `None` when all are zero.
#[inline]
pub(super) fn choose<const N: usize>(probs: [f32; N], u: f32) -> Option<(usize, f32)> {
    let last = probs.iter().rposition(|&p| p > 0.0)?;
    let mut rest = u;
    for (i, &p) in probs.iter().enumerate().take(last) {
        if rest < p {
            return Some((i, within(rest, p)));
        }
        rest = (rest - p).max(0.0);
    }
    Some((last, within(rest, probs[last])))
}

#[inline]
pub(super) fn within(part: f32, whole: f32) -> f32 {
    (part / whole).min(1.0 - 0.5 * f32::EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed form against the mean over pairs of directions by their cosines.
    #[test]
    fn diffuse_albedo_is_the_integral_of_the_lobe() {
        let n = 48;
        let at = |i: u32| (i as f32 + 0.5) / n as f32;
        for (roughness, flatness) in [(0.0, 0.0), (0.5, 0.0), (1.0, 0.3), (0.2, 1.0), (1.0, 1.0)] {
            let base = Base {
                flatness,
                ..Base::new(Rgb::WHITE, roughness, 0.0)
            };
            let mut sum = 0.0;
            for (a, b, c) in (0..n * n * n).map(|k| (at(k % n), at(k / n % n), at(k / n / n))) {
                // Equal steps in the square of the cosine: both are distributed by their cosines.
                let (cos_o, cos_i) = (a.sqrt(), b.sqrt());
                let sines = ((1.0 - a) * (1.0 - b)).sqrt();
                let between = cos_o * cos_i + sines * (c * std::f32::consts::PI).cos();
                let cos_d = (0.5 * (1.0 + between)).max(0.0).sqrt();
                sum += f64::from(base.diffuse(cos_o, cos_i, cos_d).r / FRAC_1_PI);
            }
            let mean = sum / f64::from(n * n * n);
            let closed = f64::from(base.diffuse_albedo().r);
            assert!(
                (mean / closed - 1.0).abs() < 2e-3,
                "{mean} {closed} {roughness} {flatness}"
            );
        }
    }
}

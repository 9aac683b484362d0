//! Distributions of the normals of a rough surface, with Smith's masking.
//!
//! Both are shapes of one kind: a unit-roughness distribution of slopes, stretched by `alpha` along x and
//! y. So visible normals are sampled at unit roughness and stretched back (Heitz 2014, section 5).

use crate::math::special::{erf, erf_inv};
use crate::math::warp::{concentric_disk, uniform_cone};
use crate::math::{PI, Vec2, Vec3, sqr};

/// Below this roughness the lobe is narrower than f32 directions resolve.
pub const ALPHA_MIN: f32 = 1e-4;

const FRAC_1_SQRT_PI: f32 = 0.564_189_6;

/// The shape of the distribution of slopes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Gaussian slopes (Beckmann & Spizzichino 1963).
    Beckmann,
    /// Long tails (Trowbridge & Reitz 1975; Walter et al. 2007).
    Ggx,
}

/// A distribution of microfacet normals in the local frame, m.z > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Microfacet {
    pub shape: Shape,
    /// Roughness along x and y, in [`ALPHA_MIN`]..: for Beckmann the root mean square slope times sqrt 2.
    pub alpha: Vec2,
    /// Sample the normals visible from `wo`; else all of them, by D cos.
    pub visible: bool,
}

impl Microfacet {
    /// `alpha_u`, `alpha_v` are raised to [`ALPHA_MIN`] (also from NaN); visible normals are sampled.
    #[inline]
    pub fn new(shape: Shape, alpha_u: f32, alpha_v: f32) -> Microfacet {
        Microfacet {
            shape,
            alpha: Vec2::new(alpha_u.max(ALPHA_MIN), alpha_v.max(ALPHA_MIN)),
            visible: true,
        }
    }

    /// D(m): area of the facets of normal `m` per area of surface and per steradian. `m` of unit length.
    ///
    /// Walter et al. 2007, equations 25 and 33, with elliptic roughness (Burley 2012, appendix B.2).
    #[inline]
    pub fn d(&self, m: Vec3) -> f32 {
        if m.z <= 0.0 {
            return 0.0;
        }
        let slope2 = sqr(m.x / self.alpha.x) + sqr(m.y / self.alpha.y);
        let area = PI * self.alpha.x * self.alpha.y;
        match self.shape {
            Shape::Ggx => 1.0 / (area * sqr(slope2 + m.z * m.z)),
            Shape::Beckmann => {
                let cos2 = m.z * m.z;
                let exponent = slope2 / cos2;
                // Beyond, the exponential underflows and 1/cos⁴ may overflow: 0, not NaN.
                if exponent < 80.0 {
                    (-exponent).exp() / (area * cos2 * cos2)
                } else {
                    0.0
                }
            }
        }
    }

    /// Smith's masking over the cosine, G1(w) / w.z, which stays finite at grazing angles.
    ///
    /// `w` of unit length, w.z > 0, and on the visible side of the facet (which holds in a reflection).
    /// Walter et al. 2007, equation 34; for Beckmann the exact form (Heitz 2014, appendix A), so that visible
    /// normals have exactly the density [`Microfacet::pdf`]. The rational fit that Walter et al. give, and
    /// Mitsuba uses, differs by up to 0.31 % where `w.z` is below 1.6 of the spread of slopes along `w`.
    #[inline]
    pub fn g1_over_cos(&self, w: Vec3) -> f32 {
        let spread = stretch(w, self.alpha).truncate().length();
        match self.shape {
            Shape::Ggx => 2.0 / (w.z + (w.z * w.z + spread * spread).sqrt()),
            Shape::Beckmann => 2.0 / projected_area(w.z, spread),
        }
    }

    /// A facet normal for the direction `wo` (unit length, wo.z > 0), with density [`Microfacet::pdf`].
    #[inline]
    pub fn sample(&self, wo: Vec3, u: Vec2) -> Vec3 {
        let m = if self.visible {
            let w = stretch(wo, self.alpha).normalize();
            match self.shape {
                Shape::Ggx => ggx_visible(w, u),
                Shape::Beckmann => beckmann_visible(w, u),
            }
        } else {
            // All slopes: the squared radius of the disk is the cumulative share.
            let d = concentric_disk(u);
            let left = (1.0 - d.length_squared()).max(0.5 * f32::EPSILON);
            match self.shape {
                Shape::Ggx => d.extend(left.sqrt()),
                Shape::Beckmann => {
                    let r2 = 1.0 - left;
                    let scale = if r2 > 0.0 {
                        (-left.ln() / r2).sqrt()
                    } else {
                        1.0
                    };
                    (d * scale).extend(1.0)
                }
            }
        };
        stretch(m, self.alpha).normalize()
    }

    /// Density per steradian of the facet normal `m` from [`Microfacet::sample`].
    #[inline]
    pub fn pdf(&self, wo: Vec3, m: Vec3) -> f32 {
        if self.visible {
            self.g1_over_cos(wo) * wo.dot(m).max(0.0) * self.d(m)
        } else {
            self.d(m) * m.z
        }
    }
}

/// The facet normal that reflects two directions into each other.
pub(super) struct HalfVector {
    pub m: Vec3,
    /// D(m), > 0.
    pub d: f32,
    /// Cosine between `m` and either direction.
    pub cos: f32,
}

/// Reflection at the facets.
impl Microfacet {
    /// `None` unless both directions are above the surface and some facets reflect one into the other.
    #[inline]
    pub(super) fn half_vector(&self, wo: Vec3, wi: Vec3) -> Option<HalfVector> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let h = wo + wi;
        let length = h.length();
        let m = h / length;
        let d = self.d(m);
        // Half the sum of two unit vectors has the length of the cosine: the same from both ends, so that
        // the value is reciprocal to the last digits also where both graze the surface.
        (length > 0.0 && d > 0.0).then_some(HalfVector {
            m,
            d,
            cos: (0.5 * length).min(1.0),
        })
    }

    /// Density of the reflected direction: that of the facet normal over 4 cos (Walter et al. 2007,
    /// equation 14). `masking` is G1(wo) / wo.z, `cos` the angle between facet normal and `wo`.
    #[inline]
    pub(super) fn reflected_pdf(&self, d: f32, masking: f32, m_z: f32, cos: f32) -> f32 {
        if self.visible {
            0.25 * d * masking
        } else {
            0.25 * d * m_z / cos
        }
    }
}

/// To the frame in which the roughness is 1. Directions and normals stretch alike here: normals scale by
/// the inverse of the inverse.
#[inline]
fn stretch(v: Vec3, alpha: Vec2) -> Vec3 {
    Vec3::new(v.x * alpha.x, v.y * alpha.y, v.z)
}

/// Twice the area of unit-roughness Beckmann facets projected along a direction of cosine `cos` and sine
/// `sin`, or of a multiple of both.
#[inline]
fn projected_area(cos: f32, sin: f32) -> f32 {
    let cot = cos / sin;
    if cot > 4.0 {
        return 2.0 * cos; // within 2e-9: no facet is masked
    }
    cos * (1.0 + erf(cot)) + sin * FRAC_1_SQRT_PI * (-cot * cot).exp()
}

/// The normals of a hemisphere visible along `w` reflect it uniformly into a spherical cap, of height
/// 1 + w.z (Dupuy & Benyoub 2023, "Sampling visible GGX normals with spherical caps").
#[inline]
fn ggx_visible(w: Vec3, u: Vec2) -> Vec3 {
    let h = uniform_cone(u, 1.0 + w.z) + w;
    // Below the horizon by rounding only.
    Vec3::new(h.x, h.y, h.z.max(1e-7))
}

/// Visible Beckmann normals: the slope in the plane of incidence by inversion of its cumulative share, the
/// other slope is Gaussian (Jakob 2014, "An improved visible normal sampling routine for the Beckmann
/// distribution").
fn beckmann_visible(w: Vec3, u: Vec2) -> Vec3 {
    let sin = w.truncate().length();
    let across = w.truncate() / sin;
    let (x, y) = (beckmann_slope(w.z, sin, u.x), gaussian_slope(u.y));
    if sin < 1e-6 {
        return Vec3::new(-x, -y, 1.0);
    }
    Vec3::new(
        -(across.x * x - across.y * y),
        -(across.y * x + across.x * y),
        1.0,
    )
}

#[inline]
fn gaussian_slope(u: f32) -> f32 {
    erf_inv(2.0 * u.clamp(0.5 * f32::EPSILON, 1.0 - 0.5 * f32::EPSILON) - 1.0)
}

/// The slope below which lies the share `u` of the visible slopes, whose density is proportional to
/// `(cos - sin x) exp(-x²)` for x < cot. Newton's method in b = erf(x), where that function is nearly a
/// parabola, kept in a bracket that shrinks.
fn beckmann_slope(cos: f32, sin: f32, u: f32) -> f32 {
    if sin < 1e-6 {
        return gaussian_slope(u);
    }
    let area = projected_area(cos, sin);
    let target = u.max(0.5 * f32::EPSILON) * area;
    let end = erf(cos / sin).min(1.0 - 0.5 * f32::EPSILON);
    let (mut lo, mut hi) = (-1.0 + 0.5 * f32::EPSILON, end);
    // First guess: the power law that Jakob fitted over the angle of incidence.
    let theta = cos.min(1.0).acos();
    let power = 1.0 + theta * (-0.876 + theta * (0.4265 - 0.0594 * theta));
    let mut b = end - (1.0 + end) * (1.0 - u).powf(power);
    let mut x = 0.0;
    for _ in 0..10 {
        if !(b >= lo && b <= hi) {
            b = 0.5 * (lo + hi);
        }
        x = erf_inv(b);
        let gauss = (-x * x).exp();
        let excess = cos * (1.0 + b) + sin * FRAC_1_SQRT_PI * gauss - target;
        let step = excess / (cos - sin * x);
        // The same step in x: when it is short it leaves an error of its square, so it is the last one.
        let step_x = step / (2.0 * FRAC_1_SQRT_PI * gauss);
        if step_x.abs() < 1e-3 {
            return x - step_x;
        }
        if excess.abs() < 2.0 * f32::EPSILON * area {
            break; // far out in the tail, where the sum resolves no more
        }
        if excess > 0.0 {
            hi = b;
        } else {
            lo = b;
        }
        b -= step;
    }
    x
}

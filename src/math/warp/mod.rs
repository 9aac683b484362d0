//! Maps from the unit square to the places where integrals live, each beside its density.
//!
//! Everything here is a pure function of numbers in [0,1): nothing knows what is sampled or why. Maps
//! keep strata compact (close points of the square stay close), since the numbers are usually stratified.

mod spherical;
mod tabulated;

pub use spherical::{SphericalRectangle, SphericalTriangle};
pub use tabulated::{AliasTable, Pick, Tabulated1, Tabulated2};

use super::{PI, Vec2, Vec3, safe_sqrt};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4};

/// Density of [`concentric_disk`] per unit of area.
pub const DISK_PDF: f32 = FRAC_1_PI;
/// Density of [`uniform_sphere`] per steradian.
pub const SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;
/// Density of [`uniform_hemisphere`] per steradian.
pub const HEMISPHERE_PDF: f32 = 0.5 * FRAC_1_PI;
/// Density of [`triangle`] in the plane of the two barycentric weights (area 1/2).
pub const TRIANGLE_PDF: f32 = 2.0;

/// A point of the unit disk, uniform by area ([`DISK_PDF`]).
///
/// Method: Shirley & Chiu 1997, "A low distortion map between disk and square".
#[inline]
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    // Each of the four wedges of the square: the radius is its longer coordinate, the angle the ratio.
    if p.x.abs() > p.y.abs() {
        let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (p.y / p.x));
        p.x * Vec2::new(cos, sin)
    } else if p.y != 0.0 {
        let (sin, cos) = sin_cos_eighth(FRAC_PI_4 * (p.x / p.y));
        p.y * Vec2::new(sin, cos)
    } else {
        Vec2::ZERO
    }
}

/// Sine and cosine of an angle of at most pi/4, to 1e-7 (polynomials of Moshier's Cephes library). Several
/// times faster than the general functions, which reduce the angle first; this is in every bounce.
#[inline]
fn sin_cos_eighth(x: f32) -> (f32, f32) {
    let x2 = x * x;
    let sin = x + x * x2 * (-0.166_666_55 + x2 * (8.332_161e-3 - x2 * 1.951_529_6e-4));
    let cos =
        1.0 - 0.5 * x2 + x2 * x2 * (4.166_664_6e-2 + x2 * (-1.388_731_6e-3 + x2 * 2.443_315_7e-5));
    (sin, cos)
}

/// A direction of the upper hemisphere (z = normal) with density [`cosine_hemisphere_pdf`].
///
/// `u` in [0,1)², result of unit length with z > 0. Method: Malley (lift of a uniform disk).
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = concentric_disk(u);
    // On the rim z would be 0, a direction of density 0: it is raised by less than its rounding error.
    d.extend((1.0 - d.length_squared()).max(f32::MIN_POSITIVE).sqrt())
}

/// Density per steradian of [`cosine_hemisphere`] at an angle of cosine `cos`; 0 below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// A direction uniform on the sphere ([`SPHERE_PDF`]).
#[inline]
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    uniform_cone(u, 2.0)
}

/// A direction uniform on the upper hemisphere ([`HEMISPHERE_PDF`]).
#[inline]
pub fn uniform_hemisphere(u: Vec2) -> Vec3 {
    uniform_cone(u, 1.0)
}

/// A direction uniform in the cone around +z whose half-angle has the cosine `1 - h_max`, with density
/// [`uniform_cone_pdf`].
///
/// `h_max` in (0, 2] is the height of the cap. It is not given as a cosine, since in f32 every cone of
/// less than 3e-4 rad has cosine 1; [`cap_height`] makes it from a sine. The disk map gives the azimuth
/// and, by its squared radius, the height (Archimedes: zones of equal height have equal area).
#[inline]
pub fn uniform_cone(u: Vec2, h_max: f32) -> Vec3 {
    let d = concentric_disk(u);
    let h = d.length_squared().min(1.0) * h_max;
    // sin = sqrt(h (2 - h)), and |d| = sqrt(h / h_max): the quotient needs no division.
    let scale = safe_sqrt(h_max * (2.0 - h));
    Vec3::new(d.x * scale, d.y * scale, 1.0 - h)
}

/// Density per steradian of [`uniform_cone`] inside its cone.
#[inline]
pub fn uniform_cone_pdf(h_max: f32) -> f32 {
    1.0 / (2.0 * PI * h_max)
}

/// `1 - cos` of an angle of at most a right angle from its squared sine in 0..1, without cancellation.
#[inline]
pub fn cap_height(sin2: f32) -> f32 {
    sin2 / (1.0 + safe_sqrt(1.0 - sin2))
}

/// Weights of the second and third corner of a triangle, uniform by area ([`TRIANGLE_PDF`]).
///
/// Method: Heitz 2019, "A low-distortion map between triangle and square". Against the square-root map it
/// leaves the cells of a grid compact, and costs no root.
#[inline]
pub fn triangle(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let b1 = 0.5 * u.x;
        Vec2::new(b1, u.y - b1)
    } else {
        let b2 = 0.5 * u.y;
        Vec2::new(u.x - b2, b2)
    }
}

/// The `u` for which [`triangle`] returns the weights `b`.
#[inline]
pub fn triangle_inverse(b: Vec2) -> Vec2 {
    if b.y > b.x {
        Vec2::new(2.0 * b.x, b.x + b.y)
    } else {
        Vec2::new(b.x + b.y, 2.0 * b.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_sine_and_cosine_are_right() {
        for i in -1000..=1000 {
            let x = FRAC_PI_4 * i as f32 / 1000.0;
            let (sin, cos) = sin_cos_eighth(x);
            let (s, c) = f64::from(x).sin_cos();
            assert!((f64::from(sin) - s).abs() < 1e-7 && (f64::from(cos) - c).abs() < 1e-7);
        }
    }
}

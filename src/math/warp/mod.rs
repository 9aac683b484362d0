//! Maps from the unit square to the places where integrals live, each beside its density.
//!
//! Everything here is a pure function of numbers in [0,1): nothing knows what is sampled or why. Maps
//! keep strata compact (close points of the square stay close), since the numbers are usually stratified.

mod spherical;
mod tabulated;

pub use spherical::{SphericalRectangle, SphericalTriangle};
pub use tabulated::{AliasTable, Pick, Tabulated1, Tabulated2};

use super::{PI, Vec2, Vec3, safe_sqrt};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

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
    let (r, phi) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else if p.y != 0.0 {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    } else {
        return Vec2::ZERO;
    };
    let (sin, cos) = phi.sin_cos();
    r * Vec2::new(cos, sin)
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

/// `1 - cos` of an angle of at most a right angle from its squared sine in [0,1], without cancellation.
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

//! Rectangles and triangles as seen from a point, sampled uniformly by solid angle.
//!
//! Solid angles come from the triple product of van Oosterom & Strackee 1983, which does not cancel; the
//! maps work in f64. Below [`TINY`] steradians their angle sums lose what is being mapped, and a sample is
//! taken uniformly by area instead, whose density in solid angle is then nearly constant anyway.

use super::triangle;
use crate::math::{DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};

/// Below this solid angle (sr) points are uniform by area.
const TINY: f64 = 1e-6;

/// Solid angle of the triangle with corners `a`, `b`, `c` as seen from the origin, in [0, 2 pi]
/// (van Oosterom & Strackee 1983, equation 8). `det` is the triple product of the corners.
fn solid_angle(det: f64, a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let den = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * det.abs().atan2(den)
}

/// Density per steradian of a point uniform on a flat `area`, at `d` from the eye.
fn area_pdf(d: DVec3, normal: DVec3, area: f64) -> f32 {
    let cos_times_d = d.dot(normal).abs();
    (d.length_squared() * d.length() / (cos_times_d * area)) as f32
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    // Kahan's form: as precise for small angles as for right ones.
    2.0 * (a - b).length().atan2((a + b).length())
}

/// A rectangle seen from a point.
///
/// Method: Ureña, Fajardo & King 2013, "An area-preserving parametrization for spherical rectangles".
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    /// Unit normal, towards the eye.
    normal: DVec3,
    /// Extent in the local frame of the rectangle around the foot of the eye.
    x: [f64; 2],
    y: [f64; 2],
    /// Distance of the plane, > 0.
    z: f64,
    solid_angle: f64,
    /// z of the edge normals n0 and n2, and 2 pi - g2 - g3 (names of the paper).
    b: [f64; 2],
    k: f64,
}

impl SphericalRectangle {
    /// The rectangle `corner + s ex + t ey` with s, t in 0..1 and `ex` at right angles to `ey`, seen from
    /// `eye`. `None` when it has no area or is seen edge on.
    pub fn new(corner: Vec3, ex: Vec3, ey: Vec3, eye: Vec3) -> Option<SphericalRectangle> {
        let (ex, ey) = (ex.as_dvec3(), ey.as_dvec3());
        let (width, height) = (ex.length(), ey.length());
        let normal = ex.cross(ey).try_normalize()?;
        let d = corner.as_dvec3() - eye.as_dvec3();
        let z = d.dot(normal);
        let (x0, y0) = (d.dot(ex) / width, d.dot(ey) / height);
        let (x, y) = ([x0, x0 + width], [y0, y0 + height]);
        let (normal, z) = if z > 0.0 { (-normal, z) } else { (normal, -z) };

        // Both halves have the same triple product: distance times the area of the rectangle.
        let det = z * width * height;
        let at = |i: usize, j: usize| DVec3::new(x[i], y[j], z);
        let solid_angle = solid_angle(det, at(0, 0), at(1, 0), at(1, 1))
            + solid_angle(det, at(0, 0), at(1, 1), at(0, 1));
        if !(solid_angle > 0.0 && solid_angle.is_finite()) {
            return None;
        }
        // Inward normals of the planes through the eye and three edges (the eye looks along -z), and the
        // interior angles g2, g3 at the ends of the edge x = x0.
        let [n0, n2, n3] = [
            DVec3::new(0.0, -z, -y[0]),
            DVec3::new(0.0, z, y[1]),
            DVec3::new(-z, 0.0, -x[0]),
        ]
        .map(DVec3::normalize);
        let g2 = PI - angle(n2, n3);
        let g3 = PI - angle(n3, n0);
        Some(SphericalRectangle {
            normal,
            x,
            y,
            z,
            solid_angle,
            b: [n0.z, n2.z],
            k: TAU - g2 - g3,
        })
    }

    /// Solid angle in steradians, in (0, 2 pi].
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// The parameters (s, t) in `[0,1]²` of a point, with density [`SphericalRectangle::pdf`].
    pub fn sample(&self, u: Vec2) -> Vec2 {
        if self.solid_angle < TINY {
            return u;
        }
        let (width, height) = (self.x[1] - self.x[0], self.y[1] - self.y[0]);
        // The x that cuts off the share u.x of the solid angle.
        let (sin, cos) = (f64::from(u.x) * self.solid_angle + self.k).sin_cos();
        let [b0, b1] = self.b;
        let f = (cos * b0 - b1) / sin;
        let c = (1.0 / (f * f + b0 * b0).sqrt()).copysign(f);
        let x = c * self.z / (1.0 - c * c).max(f64::MIN_POSITIVE).sqrt();
        // `max` also replaces the NaN of 0/0 at the very end of the arc.
        let x = x.max(self.x[0]).min(self.x[1]);
        // Along that line equal shares of the solid angle are equal steps of the height on the sphere.
        let d = x.hypot(self.z);
        let [h0, h1] = self.y.map(|y| y / d.hypot(y));
        let h = h0 + f64::from(u.y) * (h1 - h0);
        let y = h * d / (1.0 - h * h).max(f64::MIN_POSITIVE).sqrt();
        let y = y.clamp(self.y[0], self.y[1]);
        Vec2::new(
            ((x - self.x[0]) / width) as f32,
            ((y - self.y[0]) / height) as f32,
        )
    }

    /// Density per steradian with which the point at `d` from the eye is sampled; that the point lies on
    /// the rectangle is not checked.
    pub fn pdf(&self, d: Vec3) -> f32 {
        if self.solid_angle < TINY {
            let area = (self.x[1] - self.x[0]) * (self.y[1] - self.y[0]);
            area_pdf(d.as_dvec3(), self.normal, area)
        } else {
            (1.0 / self.solid_angle) as f32
        }
    }
}

/// A triangle seen from a point.
///
/// Method: Arvo 1995, "Stratified sampling of spherical triangles".
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    /// Corners seen from the eye, and the unit directions to them.
    corners: [DVec3; 3],
    dirs: [DVec3; 3],
    solid_angle: f64,
    /// Interior angle at the first corner, and the cosine of the side opposite the third.
    sin_cos_alpha: (f64, f64),
    alpha: f64,
    cos_c: f64,
}

impl SphericalTriangle {
    /// The triangle `a`, `b`, `c` seen from `eye`. `None` when it has no area or is seen edge on.
    pub fn new(a: Vec3, b: Vec3, c: Vec3, eye: Vec3) -> Option<SphericalTriangle> {
        let corners = [a, b, c].map(|p| p.as_dvec3() - eye.as_dvec3());
        let [a, b, c] = corners;
        // The triple product from the edges: the plane's distance times twice the area.
        let det = a.dot((b - a).cross(c - a));
        let solid_angle = solid_angle(det, a, b, c);
        if !(det != 0.0 && solid_angle > 0.0 && solid_angle.is_finite()) {
            return None;
        }
        let dirs = [a.try_normalize()?, b.try_normalize()?, c.try_normalize()?];
        let n_ab = dirs[0].cross(dirs[1]).try_normalize()?;
        let n_ca = dirs[2].cross(dirs[0]).try_normalize()?;
        let alpha = PI - angle(n_ab, n_ca);
        Some(SphericalTriangle {
            corners,
            dirs,
            solid_angle,
            sin_cos_alpha: alpha.sin_cos(),
            alpha,
            cos_c: dirs[0].dot(dirs[1]),
        })
    }

    /// Solid angle in steradians, in (0, 2 pi].
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle as f32
    }

    /// The weights of the second and third corner of a point, with density [`SphericalTriangle::pdf`].
    pub fn sample(&self, u: Vec2) -> Vec2 {
        if self.solid_angle < TINY {
            return triangle(u);
        }
        let [a, b, c] = self.dirs;
        let (sin_alpha, cos_alpha) = self.sin_cos_alpha;
        // The corner c' on the arc from a to c that cuts off the share u.x of the solid angle.
        let (s, t) = (f64::from(u.x) * self.solid_angle - self.alpha).sin_cos();
        let p = t - cos_alpha;
        let q = s + sin_alpha * self.cos_c;
        let den = (q * s + p * t) * sin_alpha;
        let cos_b = if den == 0.0 {
            1.0
        } else {
            (((q * t - p * s) * cos_alpha - q) / den).clamp(-1.0, 1.0)
        };
        let c_new = along(a, c, cos_b);
        // The point on the arc from b to c': equal shares are equal steps of the cosine.
        let z = 1.0 - f64::from(u.y) * (1.0 - c_new.dot(b));
        self.weights(along(b, c_new, z.clamp(-1.0, 1.0)))
    }

    /// Density per steradian with which the point at `d` from the eye is sampled; that the point lies on
    /// the triangle is not checked.
    pub fn pdf(&self, d: Vec3) -> f32 {
        if self.solid_angle < TINY {
            let [a, b, c] = self.corners;
            let n = (b - a).cross(c - a);
            let length = n.length();
            area_pdf(d.as_dvec3(), n / length, 0.5 * length)
        } else {
            (1.0 / self.solid_angle) as f32
        }
    }

    /// Where the ray along `w` meets the triangle.
    fn weights(&self, w: DVec3) -> Vec2 {
        let [a, b, c] = self.corners;
        let (e1, e2) = (b - a, c - a);
        // Cramer's rule on a + b1 e1 + b2 e2 = t w.
        let wa = w.cross(a);
        let det = w.dot(e1.cross(e2));
        let b1 = (-e2.dot(wa) / det).clamp(0.0, 1.0);
        let b2 = (e1.dot(wa) / det).clamp(0.0, 1.0 - b1);
        Vec2::new(b1 as f32, b2 as f32)
    }
}

/// The unit vector in the plane of the unit vectors `x` and `y`, at the angle of cosine `cos` from `x`
/// towards `y`.
fn along(x: DVec3, y: DVec3, cos: f64) -> DVec3 {
    let across = (y - x * x.dot(y)).normalize_or_zero();
    x * cos + across * (1.0 - cos * cos).sqrt()
}

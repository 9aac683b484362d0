//! Sphere, disk and cylinder: intersections in f64, points on the exact surface.
//!
//! A shape is the image of a unit shape under an affine map. Everything is computed in object space in
//! f64, about 1e9 times finer than the f32 coordinates around it, so the error of a point is the
//! rounding of its coordinates to f32 and nothing else worth counting.

use super::{Ray, SurfaceSample};
use crate::math::{Aabb, DVec2, DVec3, Transform, Vec2, Vec3, fp};
use std::f64::consts::{PI, TAU};

/// The unit sphere under translation, rotation, reflection and uniform scale.
///
/// `u` = longitude / 2π around object z, `v` = angle from object +z / π.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    to_world: Transform,
    center: DVec3,
    radius: f64,
    inward: bool,
}

/// The unit disk at z = 0 facing +z under any affine map. `u` = radius, `v` = angle / 2π.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    to_world: Transform,
    normal: DVec3,
    flip_normals: bool,
    area: f64,
}

/// The open cylinder of radius 1 around the z axis from z = 0 to 1, under any affine map. `u` = angle / 2π,
/// `v` = z.
#[derive(Clone, Copy, Debug)]
pub struct Cylinder {
    to_world: Transform,
    flip_normals: bool,
    area: f64,
    even: bool,
}

/// An exact point of a surface and its derivatives, in world space.
pub(super) struct SurfacePoint {
    pub p: DVec3,
    pub p_err: Vec3,
    pub n: Vec3,
    pub uv: Vec2,
    pub dp_du: DVec3,
    pub dp_dv: DVec3,
}

/// A ray in f64 and object space. `d` is not normalised, so distances stay those of the world ray.
struct ObjectRay {
    o: DVec3,
    d: DVec3,
}

impl ObjectRay {
    fn new(to_world: &Transform, ray: &Ray) -> ObjectRay {
        let inv = to_world.inverse();
        ObjectRay {
            o: inv.point(ray.o.as_dvec3()),
            d: inv.vector(ray.d.as_dvec3()),
        }
    }

    fn at(&self, t: f64) -> DVec3 {
        self.o + self.d * t
    }

    /// The roots of |o + t d|² = 1, near one first. The discriminant is taken from the point of
    /// closest approach, which does not cancel for a distant origin (Haines et al. 2019, "Precision
    /// Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter 7).
    fn unit_roots(o: DVec3, d: DVec3) -> Option<[f64; 2]> {
        let a = d.length_squared();
        let b = o.dot(d);
        let closest = o - d * (b / a);
        let discriminant = a * (1.0 - closest.length_squared());
        if !(discriminant >= 0.0 && a > 0.0) {
            return None;
        }
        let q = -(b + b.signum() * discriminant.sqrt());
        let (t0, t1) = (q / a, (o.length_squared() - 1.0) / q);
        Some(if t0 <= t1 { [t0, t1] } else { [t1, t0] })
    }
}

/// f64 distance as f32, if the ray reaches it: positive and not beyond `t_max` also after rounding.
pub(super) fn in_reach(t: f64, t_max: f32) -> Option<f32> {
    let t32 = t as f32;
    (t > 0.0 && t <= t_max as f64).then(|| t32.clamp(f32::MIN_POSITIVE, t_max))
}

/// `p` rounded to f32 with its error bound. `reach` bounds the size of what was summed to get `p`:
/// where that cancels, the f64 error can exceed the rounding of the small result.
fn rounded(p: DVec3, reach: f64) -> (Vec3, Vec3) {
    let rounded = p.as_vec3();
    let f64_error = (reach * (16.0 * f64::EPSILON)) as f32;
    (
        rounded,
        rounded.abs() * fp::gamma(3) + Vec3::splat(f64_error),
    )
}

fn sign(flip: bool) -> f64 {
    if flip { -1.0 } else { 1.0 }
}

/// Largest length that a unit vector can be mapped to, at most √3 too large; plus the translation.
fn reach(m: &Transform) -> f64 {
    let a = m.matrix();
    let size: f64 =
        a.matrix3.col(0).length() + a.matrix3.col(1).length() + a.matrix3.col(2).length();
    size + a.translation.length()
}

/// Angle around z of a point, as a share of the full turn in [0,1).
fn turn(x: f64, y: f64) -> f64 {
    let t = y.atan2(x) / TAU;
    if t < 0.0 { t + 1.0 } else { t }
}

/// [0,1)² to the unit disk, by radius and angle.
fn polar_disk(u: Vec2) -> DVec2 {
    let (r, phi) = ((u.x as f64).sqrt(), u.y as f64 * TAU);
    DVec2::new(r * phi.cos(), r * phi.sin())
}

impl Sphere {
    /// `None` when the map is not a similarity: the image would be an ellipsoid. Relative tolerance
    /// 1e-5, so that matrices written with seven digits pass.
    pub fn new(to_world: Transform, flip_normals: bool) -> Option<Sphere> {
        let m = to_world.matrix().matrix3;
        let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
        let radius = m.determinant().abs().cbrt();
        let r2 = radius * radius;
        let off = [x.dot(y), y.dot(z), z.dot(x)]
            .into_iter()
            .chain([x, y, z].map(|a| a.length_squared() - r2))
            .fold(0f64, |m, v| m.max(v.abs()));
        (off <= 1e-5 * r2).then(|| Sphere {
            to_world,
            center: to_world.matrix().translation,
            radius,
            // Mitsuba lets a reflection turn the sphere inside out.
            inward: flip_normals != to_world.swaps_handedness(),
        })
    }

    pub fn center(&self) -> DVec3 {
        self.center
    }

    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// True when the normals point to the centre.
    pub fn inward(&self) -> bool {
        self.inward
    }

    pub fn bounds(&self) -> Aabb {
        let (c, r) = (self.center, DVec3::splat(self.radius));
        outward_box(c - r, c + r)
    }

    pub fn area(&self) -> f64 {
        2.0 * TAU * self.radius * self.radius
    }

    fn roots(&self, ray: &Ray) -> Option<([f64; 2], DVec3, DVec3)> {
        let (o, d) = (
            (ray.o.as_dvec3() - self.center) / self.radius,
            ray.d.as_dvec3() / self.radius,
        );
        ObjectRay::unit_roots(o, d).map(|t| (t, o, d))
    }

    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<(f32, Vec2)> {
        let ([t0, t1], ..) = self.roots(ray)?;
        in_reach(t0, t_max)
            .or_else(|| in_reach(t1, t_max))
            .map(|t| (t, Vec2::ZERO))
    }

    pub(super) fn at_hit(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let n = match self.roots(ray) {
            Some((ts, o, d)) => o + d * nearest(ts, t),
            None => (ray.at(t).as_dvec3() - self.center) / self.radius,
        };
        self.at_normal(n)
    }

    /// The surface where the outward normal is `n`, of any positive length.
    pub(super) fn at_normal(&self, n: DVec3) -> SurfacePoint {
        let n = n.normalize_or(DVec3::Z);
        let (p, p_err) = rounded(
            self.center + n * self.radius,
            self.radius + self.center.length(),
        );
        // The parametrisation lives in object space; the map is a similarity.
        let l = self
            .to_world
            .inverse()
            .vector(n * self.radius)
            .normalize_or(DVec3::Z);
        let (sin_theta, theta) = {
            let s = l.x.hypot(l.y);
            (s, s.atan2(l.z))
        };
        let (cos_phi, sin_phi) = if sin_theta > 0.0 {
            (l.x / sin_theta, l.y / sin_theta)
        } else {
            (1.0, 0.0)
        };
        SurfacePoint {
            p: p.as_dvec3(),
            p_err,
            n: (n * sign(self.inward)).as_vec3(),
            uv: DVec2::new(turn(l.x, l.y), theta / PI).as_vec2(),
            // At a pole dp/du vanishes; its direction is kept so that the frame stays defined.
            dp_du: self
                .to_world
                .vector(DVec3::new(-sin_phi, cos_phi, 0.0) * TAU * sin_theta.max(f64::EPSILON)),
            dp_dv: self
                .to_world
                .vector(DVec3::new(l.z * cos_phi, l.z * sin_phi, -sin_theta) * PI),
        }
    }

    /// The surface where the outward normal is along `n`, with the density of uniform area sampling.
    pub(crate) fn surface_sample(&self, n: DVec3) -> SurfaceSample {
        self.at_normal(n).sampled(self.area())
    }

    /// The surface next to the point `p`.
    pub(super) fn at_point(&self, p: Vec3) -> SurfacePoint {
        self.at_normal(p.as_dvec3() - self.center)
    }

    /// The point at these parameters.
    pub(super) fn at_uv(&self, uv: DVec2) -> DVec3 {
        let ((sin, cos), (r, z)) = ((uv.x * TAU).sin_cos(), (uv.y * PI).sin_cos());
        self.to_world.point(DVec3::new(r * cos, r * sin, z))
    }

    /// Uniform over the area.
    pub(super) fn sample_area(&self, u: Vec2) -> SurfaceSample {
        let z = 1.0 - 2.0 * u.x as f64;
        let (r, phi) = ((1.0 - z * z).max(0.0).sqrt(), u.y as f64 * TAU);
        self.surface_sample(DVec3::new(r * phi.cos(), r * phi.sin(), z))
    }
}

impl Disk {
    pub fn new(to_world: Transform, flip_normals: bool) -> Disk {
        let m = to_world.matrix().matrix3;
        Disk {
            to_world,
            normal: to_world.normal(DVec3::Z).normalize_or(DVec3::Z) * sign(flip_normals),
            flip_normals,
            area: PI * m.x_axis.cross(m.y_axis).length(),
        }
    }

    pub fn flip_normals(&self) -> bool {
        self.flip_normals
    }

    /// Unit normal of the side that counts as outside.
    pub fn normal(&self) -> Vec3 {
        self.normal.as_vec3()
    }

    pub fn bounds(&self) -> Aabb {
        let m = self.to_world.matrix();
        let r = circle_extent(m.matrix3.x_axis, m.matrix3.y_axis);
        outward_box(m.translation - r, m.translation + r)
    }

    pub fn area(&self) -> f64 {
        self.area
    }

    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<(f32, Vec2)> {
        let r = ObjectRay::new(&self.to_world, ray);
        let t = -r.o.z / r.d.z;
        let p = r.at(t);
        (p.x * p.x + p.y * p.y <= 1.0)
            .then(|| in_reach(t, t_max))
            .flatten()
            .map(|t| (t, Vec2::ZERO))
    }

    pub(super) fn at_hit(&self, ray: &Ray) -> SurfacePoint {
        let r = ObjectRay::new(&self.to_world, ray);
        let p = r.at(-r.o.z / r.d.z);
        self.at_local(DVec2::new(p.x, p.y))
    }

    fn at_local(&self, l: DVec2) -> SurfacePoint {
        let (p, p_err) = rounded(self.to_world.point(l.extend(0.0)), reach(&self.to_world));
        let r = l.length();
        let radial = if r > 0.0 { l / r } else { DVec2::X };
        SurfacePoint {
            p: p.as_dvec3(),
            p_err,
            n: self.normal(),
            uv: DVec2::new(r.min(1.0), turn(l.x, l.y)).as_vec2(),
            dp_du: self.to_world.vector(radial.extend(0.0)),
            dp_dv: self.to_world.vector(DVec3::new(-l.y, l.x, 0.0) * TAU),
        }
    }

    pub(super) fn at_point(&self, p: Vec3) -> SurfacePoint {
        let l = self.to_world.inverse().point(p.as_dvec3());
        self.at_local(DVec2::new(l.x, l.y))
    }

    /// The point at these parameters.
    pub(super) fn at_uv(&self, uv: DVec2) -> DVec3 {
        let (sin, cos) = (uv.y * TAU).sin_cos();
        self.to_world.point(DVec3::new(cos, sin, 0.0) * uv.x)
    }

    pub(super) fn sample_area(&self, u: Vec2) -> SurfaceSample {
        self.at_local(polar_disk(u)).sampled(self.area)
    }
}

impl Cylinder {
    pub fn new(to_world: Transform, flip_normals: bool) -> Cylinder {
        let m = to_world.matrix().matrix3;
        let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
        let (rx, ry, h) = (x.length(), y.length(), z.length());
        let round = (rx - ry).abs() <= 1e-5 * rx && x.dot(y).abs() <= 1e-5 * rx * ry;
        let upright = x.dot(z).abs() <= 1e-5 * rx * h && y.dot(z).abs() <= 1e-5 * ry * h;
        Cylinder {
            to_world,
            flip_normals,
            area: TAU * (rx * ry).sqrt() * h,
            even: round && upright,
        }
    }

    /// False when the map squeezes circles about the axis into ellipses or shears the axis: then area is
    /// not uniform in the parameters, and neither [`Cylinder::area`] nor samples of it are right. Relative
    /// tolerance 1e-5.
    pub fn is_even(&self) -> bool {
        self.even
    }

    pub fn flip_normals(&self) -> bool {
        self.flip_normals
    }

    /// Centre of the end at v = 0, and from there to the other end.
    pub fn axis(&self) -> (DVec3, DVec3) {
        let m = self.to_world.matrix();
        (m.translation, m.matrix3.z_axis)
    }

    pub fn bounds(&self) -> Aabb {
        let m = self.to_world.matrix();
        let r = circle_extent(m.matrix3.x_axis, m.matrix3.y_axis);
        let (a, b) = (m.translation, m.translation + m.matrix3.z_axis);
        outward_box(a.min(b) - r, a.max(b) + r)
    }

    pub fn area(&self) -> f64 {
        self.area
    }

    fn roots(&self, r: &ObjectRay) -> Option<[f64; 2]> {
        ObjectRay::unit_roots(r.o.with_z(0.0), r.d.with_z(0.0))
    }

    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<(f32, Vec2)> {
        let r = ObjectRay::new(&self.to_world, ray);
        self.roots(&r)?.into_iter().find_map(|t| {
            let z = r.at(t).z;
            (0.0..=1.0)
                .contains(&z)
                .then(|| in_reach(t, t_max))
                .flatten()
                .map(|t| (t, Vec2::ZERO))
        })
    }

    pub(super) fn at_hit(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let r = ObjectRay::new(&self.to_world, ray);
        let t = self.roots(&r).map_or(t as f64, |ts| nearest(ts, t));
        self.at_local(r.at(t))
    }

    /// The surface in the direction of `l.x, l.y` at height `l.z`.
    fn at_local(&self, l: DVec3) -> SurfacePoint {
        let radial = DVec2::new(l.x, l.y).normalize_or(DVec2::X);
        let z = l.z.clamp(0.0, 1.0);
        let (p, p_err) = rounded(self.to_world.point(radial.extend(z)), reach(&self.to_world));
        let n = self.to_world.normal(radial.extend(0.0));
        SurfacePoint {
            p: p.as_dvec3(),
            p_err,
            n: (n.normalize_or(DVec3::Z) * sign(self.flip_normals)).as_vec3(),
            uv: DVec2::new(turn(radial.x, radial.y), z).as_vec2(),
            dp_du: self
                .to_world
                .vector(DVec3::new(-radial.y, radial.x, 0.0) * TAU),
            dp_dv: self.to_world.vector(DVec3::Z),
        }
    }

    pub(super) fn at_point(&self, p: Vec3) -> SurfacePoint {
        self.at_local(self.to_world.inverse().point(p.as_dvec3()))
    }

    /// The point at these parameters.
    pub(super) fn at_uv(&self, uv: DVec2) -> DVec3 {
        let (sin, cos) = (uv.x * TAU).sin_cos();
        self.to_world.point(DVec3::new(cos, sin, uv.y))
    }

    pub(super) fn sample_area(&self, u: Vec2) -> SurfaceSample {
        let (sin, cos) = (u.x as f64 * TAU).sin_cos();
        self.at_local(DVec3::new(cos, sin, u.y as f64))
            .sampled(self.area)
    }
}

impl SurfacePoint {
    fn sampled(&self, area: f64) -> SurfaceSample {
        SurfaceSample {
            p: self.p.as_vec3(),
            p_err: self.p_err,
            ng: self.n,
            ns: self.n,
            uv: self.uv,
            pdf_a: super::reciprocal_density(area),
        }
    }
}

/// Which of two roots the f32 distance `t` was rounded from.
fn nearest([t0, t1]: [f64; 2], t: f32) -> f64 {
    let t = t as f64;
    if (t0 - t).abs() <= (t1 - t).abs() {
        t0
    } else {
        t1
    }
}

/// Half-widths of the box around the ellipse `x cos φ + y sin φ`.
fn circle_extent(x: DVec3, y: DVec3) -> DVec3 {
    (x * x + y * y).map(f64::sqrt)
}

/// The smallest f32 box that holds the f64 box and the f32 roundings of its points.
pub(super) fn outward_box(min: DVec3, max: DVec3) -> Aabb {
    Aabb {
        min: min.as_vec3().map(f32::next_down),
        max: max.as_vec3().map(f32::next_up),
    }
}

//! How photons near a point count for the light that arrives there, and which of them do at all.

use std::f32::consts::PI;

use super::map::clamped;
use crate::geom::Hit;
use crate::math::Vec3;

/// How a photon's weight falls with its distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KernelShape {
    /// Alike up to the radius.
    Uniform,
    /// 1 - (d/r)^2: of all shapes that of least error where density is smooth (Epanechnikov 1969).
    Epanechnikov,
}

/// A weight per unit of area whose integral over the disk is 1.
///
/// Distances are those through space. On a sphere, the part that is nearer than d to a point has the area pi d^2,
/// as on a plane: a kernel of the distance through space has the integral 1 there too.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    radius: f32,
    /// At distance 0.
    peak: f32,
    /// What the squared distance takes off the peak, times `peak`.
    fall: f32,
}

impl Kernel {
    /// Of a disk with a radius in the range of [`super::RADII`]; others are taken as the end of the range.
    pub fn new(shape: KernelShape, radius: f32) -> Kernel {
        let radius = clamped(radius);
        let inv = 1.0 / radius;
        let flat = inv * inv / PI;
        let (peak, fall) = match shape {
            KernelShape::Uniform => (flat, 0.0),
            KernelShape::Epanechnikov => (2.0 * flat, inv * inv),
        };
        Kernel { radius, peak, fall }
    }

    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Weight per unit of area of a photon at the squared distance `d2`, which is at most that of the radius.
    #[inline]
    pub fn eval(&self, d2: f32) -> f32 {
        self.peak * (1.0 - self.fall * d2).max(0.0)
    }

    /// Whether a photon counts for the surface at `eye`: `offset` leads there from `eye`, `normal` is the
    /// geometric normal on the outside of the photon's surface.
    ///
    /// What belongs to one smooth surface is told from walls beyond a corner and from layers below by the
    /// sphere with the kernel's radius: at most as far out of the tangent plane, and with a normal turned at
    /// most as far, as on a sphere that curved. Which side the light came from is the BSDF's to judge; back
    /// and front of a thin solid have opposite normals.
    #[inline]
    pub fn accepts(&self, eye: &Hit, normal: Vec3, offset: Vec3) -> bool {
        // On the sphere, a distance d turns the normal by cos = 1 - d^2 / 2 r^2 and leaves the plane by
        // d^2 / 2 r. Rounding moves the points; the kernel is not smaller than that at its rim.
        let rounding = 4.0 * eye.ng.abs().dot(eye.p_err);
        eye.ng.dot(normal) >= LEAST_COS && eye.ng.dot(offset).abs() <= 0.5 * self.radius + rounding
    }
}

/// Half, less what rounding takes of a normal.
const LEAST_COS: f32 = 0.5 * (1.0 - 8.0 * f32::EPSILON);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{PlaceId, ShapeId};
    use crate::math::{Frame, Vec2};
    use crate::sampler::{Sampler, SamplerKind};

    const SHAPES: [KernelShape; 2] = [KernelShape::Uniform, KernelShape::Epanechnikov];

    fn hit(p: Vec3, ng: Vec3) -> Hit {
        Hit {
            p,
            p_err: p.abs() * 1e-6,
            ng,
            frame: Frame::from_normal(ng),
            uv: Vec2::ZERO,
            wo: ng,
            time: 0.0,
            shape: ShapeId(0),
            prim: 0,
            bary: Vec2::ZERO,
            place: PlaceId::NONE,
        }
    }

    #[test]
    fn kernels_integrate_to_one_at_any_radius() {
        for shape in SHAPES {
            for radius in [0.0, 1e-18, 1e-7, 0.3, 1e6, 1e18, f32::INFINITY] {
                let kernel = Kernel::new(shape, radius);
                let r = f64::from(kernel.radius());
                let n = 1000;
                // Rings of equal area.
                let ring = |i| {
                    let d2 = r * r * (f64::from(i) + 0.5) / f64::from(n);
                    f64::from(kernel.eval(d2 as f32))
                };
                let integral =
                    (0..n).map(ring).sum::<f64>() / f64::from(n) * (r * r * std::f64::consts::PI);
                assert!(
                    (integral - 1.0).abs() < 1e-5,
                    "{shape:?} {radius:e}: {integral}"
                );
                assert!(kernel.eval(kernel.radius().powi(2)) >= 0.0);
            }
        }
    }

    /// Photons spread evenly over a sphere, gathered at one of its points with a radius up to its own.
    #[test]
    fn density_on_a_sphere_is_right_up_to_its_radius() {
        let n = 400_000;
        let at = |i| {
            let [u, v, ..] = Sampler::new(SamplerKind::Independent, 5, 0, i, 1).get4(0);
            let z = 1.0 - 2.0 * u;
            let (sin, cos) = (2.0 * PI * v).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            Vec3::new(r * cos, r * sin, z)
        };
        let normals: Vec<Vec3> = (0..n).map(at).collect();
        for scale in [1e-6, 1.0, 1e6] {
            let eye = hit(Vec3::new(0.6, 0.0, 0.8) * scale, Vec3::new(0.6, 0.0, 0.8));
            for (shape, radius) in SHAPES.into_iter().flat_map(|s| [(s, 0.3), (s, 1.0)]) {
                let kernel = Kernel::new(shape, radius * scale);
                let mut sum = 0.0;
                for &normal in &normals {
                    let offset = normal * scale - eye.p;
                    let d2 = offset.length_squared();
                    if d2 <= kernel.radius().powi(2) && kernel.accepts(&eye, normal, offset) {
                        sum += f64::from(kernel.eval(d2));
                    }
                }
                let density = sum / n as f64 * f64::from(scale).powi(2);
                let expected = 0.25 / std::f64::consts::PI;
                // 9,000 (100,000) photons found: standard error 1.2 % (0.4 %) at most; four of them.
                let bound = if radius < 1.0 { 0.05 } else { 0.015 };
                assert!(
                    (density / expected - 1.0).abs() < bound,
                    "{shape:?} {radius} {density}"
                );
            }
        }
    }

    #[test]
    fn walls_beyond_corners_and_layers_below_do_not_count() {
        let eye = hit(Vec3::new(1.0, 2.0, 3.0), Vec3::Z);
        let kernel = Kernel::new(KernelShape::Uniform, 0.1);
        let flat = Vec3::new(0.05, 0.02, 0.0);
        assert!(kernel.accepts(&eye, Vec3::Z, flat));
        assert!(!kernel.accepts(&eye, Vec3::X, flat), "beyond a corner");
        assert!(!kernel.accepts(&eye, -Vec3::Z, flat), "back of a thin wall");
        assert!(
            !kernel.accepts(&eye, Vec3::Z, flat - 0.06 * Vec3::Z),
            "a layer below"
        );
        let turned = Vec3::new(0.5, 0.0, 0.75f32.sqrt());
        assert!(
            kernel.accepts(&eye, turned, flat - 0.02 * Vec3::Z),
            "a curved surface"
        );
    }
}

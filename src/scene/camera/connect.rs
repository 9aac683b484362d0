//! From a point of the scene to the picture: what light tracing asks of a camera.
//!
//! Light that leaves a point towards the camera adds to the measurement of each pixel j
//! `intensity * importance * h_j(film)`, with the intensity in W/sr, [`Sight::importance`] per square unit of the
//! scene and the pixel's normalised filter h_j per square pixel (Veach 1997, section 8.3.2, for a sensor that
//! responds to radiance alike from every point of its lens).

use super::{Camera, Kind, Orthographic, Perspective, Pose};
use crate::film::FilmSpec;
use crate::geom::Endpoint;
use crate::math::{Vec2, Vec3};

/// A point of the scene as the camera sees it.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Where it appears in the picture, in pixels from the top left corner.
    pub film: Vec2,
    /// Unit direction from the point towards the camera.
    pub wi: Vec3,
    /// Where the camera ray begins: on the near plane.
    pub end: Endpoint,
    /// Area of the picture, in square pixels, per unit of area at the point across `wi`. Finite and above 0.
    pub importance: f32,
}

/// The full picture, in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent(Vec2);

impl Extent {
    pub(super) fn new(film: &FilmSpec) -> Extent {
        Extent(Vec2::new(film.width as f32, film.height as f32))
    }

    /// Whether `film` lies in it or within `margin` pixels around it; false for a NaN.
    #[inline]
    fn holds(&self, film: Vec2, margin: f32) -> bool {
        film.cmpge(Vec2::splat(-margin)).all() && film.cmple(self.0 + margin).all()
    }
}

impl Camera {
    /// Whether points of the scene can be connected to it: not to meters, which see along single rays or from
    /// points of a surface.
    pub fn can_be_connected(&self) -> bool {
        matches!(self.0, Kind::Perspective(..) | Kind::Orthographic(..))
    }

    /// How the point `p` is seen at `time` through the point of the lens that `lens` in [0,1)² chooses, as
    /// [`Camera::ray`] does; `None` where it is not seen whatever stands in between: outside of the picture
    /// with a margin of `margin` pixels around it, before the near or behind the far plane.
    #[inline]
    pub fn connect(&self, p: Vec3, time: f32, lens: Vec2, margin: f32) -> Option<Sight> {
        let sight = match &self.0 {
            Kind::Perspective(view, c) => c.connect(&view.at(time), p, lens, margin)?,
            Kind::Orthographic(view, c) => c.connect(&view.at(time), p, margin)?,
            Kind::RadianceMeter(..) | Kind::IrradianceMeter(..) | Kind::Distant(..) => return None,
        };
        // At the ends of the range of floats, and on the near plane itself, there is no telling.
        let known = sight.importance > 0.0 && sight.importance.is_finite() && sight.wi.is_finite();
        (known && sight.end.p != p).then_some(sight)
    }

    /// [`Sight::importance`] of the point `p` that a ray of [`Camera::ray`] in direction `d` meets at `time`;
    /// 0 for sensors that cannot be connected to.
    #[inline]
    pub fn importance(&self, p: Vec3, d: Vec3, time: f32) -> f32 {
        match &self.0 {
            Kind::Perspective(view, c) => {
                let pose = view.at(time);
                let axis = pose.axes.z_axis;
                // The whole lens is at depth 0.
                let depth = axis.dot(p - pose.origin);
                c.importance(1.0 / axis.dot(d), depth)
            }
            Kind::Orthographic(view, c) => c.importance(&view.at(time)),
            Kind::RadianceMeter(..) | Kind::IrradianceMeter(..) | Kind::Distant(..) => 0.0,
        }
    }
}

/// A point of free space.
fn free(p: Vec3) -> Endpoint {
    Endpoint {
        p,
        p_err: Vec3::ZERO,
        ng: Vec3::ZERO,
    }
}

impl Perspective {
    fn connect(&self, pose: &Pose, p: Vec3, lens: Vec2, margin: f32) -> Option<Sight> {
        let (start, shift) = self.through_lens(pose, lens);
        let from_lens = p - start;
        let local = pose.axes.transpose() * from_lens;
        let depth = local.z;
        if !(depth > self.near && depth <= self.far) {
            return None;
        }
        let d = local.truncate() / depth + shift;
        let film = (d - self.corner) / self.per_pixel;
        if !self.extent.holds(film, margin) {
            return None;
        }
        // To unit depth.
        let unit = from_lens / depth;
        let slant = unit.length();
        Some(Sight {
            film,
            wi: -unit / slant,
            end: free(start + unit * self.near),
            importance: self.importance(slant, depth),
        })
    }

    /// A pixel at unit depth has the area A and spans the solid angle A / slant³, where `slant` is the distance
    /// per unit of depth. With the distance slant * depth, the area that it sees there, across the ray, is
    /// A depth² / slant.
    fn importance(&self, slant: f32, depth: f32) -> f32 {
        let [x, y, depth] = [self.per_pixel.x, self.per_pixel.y, depth].map(f64::from);
        (f64::from(slant) / (x * y * depth * depth)) as f32
    }
}

impl Orthographic {
    fn connect(&self, pose: &Pose, p: Vec3, margin: f32) -> Option<Sight> {
        let d = pose.axes.z_axis;
        let local = pose.axes.inverse() * (p - pose.origin);
        let t = local.z - self.near * pose.scale.z;
        if !(t > 0.0 && t <= self.length) {
            return None;
        }
        let film = (local.truncate() / pose.scale.truncate() - self.corner) / self.per_pixel;
        if !self.extent.holds(film, margin) {
            return None;
        }
        Some(Sight {
            film,
            wi: -d,
            end: free(p - d * t),
            importance: self.importance(pose),
        })
    }

    /// One over the area of a pixel, across the rays.
    fn importance(&self, pose: &Pose) -> f32 {
        let [x, y] = [
            self.per_pixel.x * pose.scale.x,
            self.per_pixel.y * pose.scale.y,
        ];
        let pixel = f64::from(pose.axes.determinant()) * f64::from(x) * f64::from(y);
        (1.0 / pixel.abs()) as f32
    }
}

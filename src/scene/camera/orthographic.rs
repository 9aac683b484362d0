//! The orthographic camera: parallel rays.

use super::connect::Extent;
use super::{CameraSample, Pose};
use crate::film::FilmSpec;
use crate::geom::Ray;
use crate::math::Vec2;

/// What makes an orthographic camera.
#[derive(Clone, Copy, Debug)]
pub struct OrthographicSpec {
    /// In units of the camera's third axis, which a scale may stretch.
    pub near_clip: f64,
    /// In scene units: rays are `far_clip - near_clip` long, as Mitsuba has it.
    pub far_clip: f64,
}

/// A camera that sees from -1 to 1 along its x axis, and as much along y as the shape of the picture
/// gives; a scale in its transform enlarges that.
#[derive(Clone, Copy, Debug)]
pub struct Orthographic {
    /// Top left corner of the picture in the camera's coordinates, and the change per pixel.
    pub(super) corner: Vec2,
    pub(super) per_pixel: Vec2,
    pub(super) near: f32,
    pub(super) length: f32,
    pub(super) extent: Extent,
}

impl Orthographic {
    pub fn new(spec: &OrthographicSpec, film: &FilmSpec) -> Orthographic {
        let (w, h) = (f64::from(film.width), f64::from(film.height));
        let per_pixel = -2.0 / w;
        Orthographic {
            corner: Vec2::new(1.0, (h / w) as f32),
            per_pixel: Vec2::splat(per_pixel as f32),
            near: spec.near_clip as f32,
            length: (spec.far_clip - spec.near_clip) as f32,
            extent: Extent::new(film),
        }
    }

    /// The ray of a point of the picture, from the near plane on.
    #[inline]
    pub fn ray(&self, pose: &Pose, sample: &CameraSample) -> Ray {
        let p = (self.corner + self.per_pixel * sample.film).extend(self.near);
        Ray {
            o: pose.origin + pose.axes * (p * pose.scale),
            d: pose.axes.z_axis,
            t_max: self.length,
            time: 0.0,
        }
    }
}

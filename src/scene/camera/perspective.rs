//! The perspective camera: pinhole or thin lens.

use super::connect::Extent;
use super::{CameraSample, Lens, Pose};
use crate::film::FilmSpec;
use crate::geom::Ray;
use crate::math::{Vec2, Vec3};

/// Which side of the picture the field of view spans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FovAxis {
    X,
    Y,
    Diagonal,
    Smaller,
    Larger,
}

impl FovAxis {
    /// Half the width, at unit depth, of a picture of `width` by `height` that `fov_deg` spans along this.
    pub fn half_width(self, fov_deg: f64, width: f64, height: f64) -> f64 {
        let (w, h) = (width, height);
        (0.5 * fov_deg.to_radians()).tan()
            * match self {
                FovAxis::X => 1.0,
                FovAxis::Y => w / h,
                FovAxis::Diagonal => w / w.hypot(h),
                FovAxis::Smaller => (w / h).max(1.0),
                FovAxis::Larger => (w / h).min(1.0),
            }
    }
}

/// What makes a perspective camera; distances in scene units.
#[derive(Clone, Copy, Debug)]
pub struct PerspectiveSpec {
    pub fov_deg: f64,
    pub fov_axis: FovAxis,
    /// Shift of the picture, as a fraction of its width and height.
    pub principal_point_offset: [f64; 2],
    pub near_clip: f64,
    pub far_clip: f64,
    pub lens: Lens,
}

/// A camera whose rays meet the plane of the picture from one opening.
#[derive(Clone, Copy, Debug)]
pub struct Perspective {
    /// Direction (at unit depth) of the picture's top left corner from the middle of the lens, and its
    /// change per pixel.
    pub(super) corner: Vec2,
    pub(super) per_pixel: Vec2,
    pub(super) near: f32,
    pub(super) far: f32,
    pub(super) extent: Extent,
    lens: Lens,
}

impl Perspective {
    pub fn new(spec: &PerspectiveSpec, film: &FilmSpec) -> Perspective {
        let (w, h) = (f64::from(film.width), f64::from(film.height));
        let half_width = spec.fov_axis.half_width(spec.fov_deg, w, h);
        // x = half_width (1 - 2 (px / w + offset)), likewise y with half_width h / w.
        let [ox, oy] = spec.principal_point_offset;
        let half_height = half_width * h / w;
        let corner = Vec2::new(
            (half_width * (1.0 - 2.0 * ox)) as f32,
            (half_height * (1.0 - 2.0 * oy)) as f32,
        );
        let per_pixel = Vec2::new(
            (-2.0 * half_width / w) as f32,
            (-2.0 * half_height / h) as f32,
        );
        Perspective {
            corner,
            per_pixel,
            near: spec.near_clip as f32,
            far: spec.far_clip as f32,
            extent: Extent::new(film),
            lens: spec.lens,
        }
    }

    pub fn lens(&self) -> Lens {
        self.lens
    }

    /// How far a ray may go per unit of depth, over the whole picture and lens.
    pub fn largest_slope(&self, film: &FilmSpec) -> f32 {
        let size = Vec2::new(film.width as f32, film.height as f32);
        let opposite = self.corner + self.per_pixel * size;
        let lens = match self.lens {
            Lens::Pinhole => 0.0,
            Lens::Thin { slope, .. } => slope,
        };
        1.0 + lens + self.corner.abs().max(opposite.abs()).length()
    }

    /// The point of the lens that `lens` chooses, and how far a ray from there is turned, at unit depth, so
    /// that it meets the plane of focus where that from the middle does.
    #[inline]
    pub(super) fn through_lens(&self, pose: &Pose, lens: Vec2) -> (Vec3, Vec2) {
        match self.lens {
            Lens::Pinhole => (pose.origin, Vec2::ZERO),
            Lens::Thin {
                radius,
                slope,
                aperture,
            } => {
                let point = aperture.sample(lens);
                let on_lens = radius * (pose.axes.x_axis * point.x + pose.axes.y_axis * point.y);
                // At unit depth, whatever the focal distance: it may be beyond all numbers.
                (pose.origin + on_lens, slope * point)
            }
        }
    }

    /// The ray from a point of the lens to where the plane of focus shows the point of the picture. It
    /// begins on the near plane and ends on the far plane.
    #[inline]
    pub fn ray(&self, pose: &Pose, sample: &CameraSample) -> Ray {
        let (start, shift) = self.through_lens(pose, sample.lens);
        let d = self.corner + self.per_pixel * sample.film - shift;
        let d = d.extend(1.0);
        let length = d.length();
        let d = pose.axes * (d / length);
        let near = self.near * length;
        Ray {
            o: start + d * near,
            d,
            t_max: self.far * length - near,
            time: 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Camera, View};
    use super::*;
    use crate::film::{Filter, Window};
    use crate::math::{DVec3, Motion, Transform, Vec3};

    fn film() -> FilmSpec {
        let crop = Window {
            x: 0,
            y: 0,
            width: 200,
            height: 100,
        };
        FilmSpec {
            width: 200,
            height: 100,
            crop,
            filter: Filter::Box { radius: 0.5 },
        }
    }

    fn spec() -> PerspectiveSpec {
        PerspectiveSpec {
            fov_deg: 40.0,
            fov_axis: FovAxis::X,
            principal_point_offset: [0.0; 2],
            near_clip: 1e-2,
            far_clip: 1e4,
            lens: Lens::Pinhole,
        }
    }

    fn ray(spec: &PerspectiveSpec, center: DVec3) -> Ray {
        let view = View::new(&Motion::still(Transform::IDENTITY), center);
        let camera = Camera::perspective(view, Perspective::new(spec, &film()));
        camera
            .ray(&CameraSample::central(Vec2::new(60.0, 20.0)))
            .ray
    }

    #[test]
    fn rays_match_measured_ones() {
        // Directions through the point (0.3, 0.2) of the picture, measured with Mitsuba 3.9.1.
        let table = [
            (spec(), [0.143_235_5, 0.107_426_7, 0.983_841]),
            (
                PerspectiveSpec {
                    fov_axis: FovAxis::Y,
                    ..spec()
                },
                [0.273_616_1, 0.205_212_1, 0.939_692_6],
            ),
            (
                PerspectiveSpec {
                    fov_axis: FovAxis::Smaller,
                    ..spec()
                },
                [0.273_616_1, 0.205_212_1, 0.939_692_6],
            ),
            (
                PerspectiveSpec {
                    fov_axis: FovAxis::Larger,
                    ..spec()
                },
                [0.143_235_5, 0.107_426_7, 0.983_841],
            ),
            (
                PerspectiveSpec {
                    fov_axis: FovAxis::Diagonal,
                    ..spec()
                },
                [0.128_526_5, 0.096_394_8, 0.987_010_2],
            ),
            (
                PerspectiveSpec {
                    principal_point_offset: [0.1, -0.2],
                    ..spec()
                },
                [0.071_434_8, 0.178_587, 0.981_327_6],
            ),
        ];
        for (spec, want) in table {
            let ray = ray(&spec, DVec3::ZERO);
            assert!(
                (ray.d - Vec3::from_array(want)).length() < 2e-6,
                "{spec:?}: {}",
                ray.d
            );
        }
    }

    #[test]
    fn rays_run_from_the_near_to_the_far_plane() {
        let spec = PerspectiveSpec {
            near_clip: 1.0,
            far_clip: 10.0,
            ..spec()
        };
        let ray = ray(&spec, DVec3::new(0.0, 0.0, -3.0));
        assert!(
            (ray.o - Vec3::new(0.145_588, 0.109_191, 4.0)).length() < 1e-5,
            "{}",
            ray.o
        );
        assert!((ray.t_max - 9.147_82).abs() < 1e-4);
    }
}

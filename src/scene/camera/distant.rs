//! The distant sensor: light that leaves the scene, or a part of it, in one direction.

use super::{CameraSample, Pose, Surface};
use crate::geom::Ray;
use crate::math::{Frame, Vec3, warp};

/// What the parallel rays are aimed at.
#[derive(Clone, Debug)]
pub enum Target {
    /// The disk that the sphere around the scene covers.
    Scene,
    /// A point, in scene coordinates.
    Point(Vec3),
    /// All points of a surface, uniform over its area.
    Surface(Box<Surface>),
}

/// Measures the mean radiance along parallel rays, which run along the third axis of the pose.
#[derive(Clone, Debug)]
pub struct Distant {
    target: Target,
    /// A sphere around the scene.
    center: Vec3,
    radius: f32,
}

impl Distant {
    /// `center` and `radius` are of a sphere around the scene: rays begin outside of it where the target
    /// lies within.
    pub fn new(target: Target, center: Vec3, radius: f32) -> Distant {
        Distant {
            target,
            center,
            radius,
        }
    }

    /// The ray and its weight.
    #[inline]
    pub fn ray(&self, pose: &Pose, sample: &CameraSample) -> (Ray, f32) {
        let d = pose.axes.z_axis;
        let (p, weight) = match &self.target {
            Target::Point(p) => (*p, 1.0),
            Target::Scene => {
                let disk = self.radius * warp::concentric_disk(sample.lens);
                let frame = Frame::from_normal(d);
                (self.center + frame.to_world(disk.extend(0.0)), 1.0)
            }
            Target::Surface(surface) => {
                let (point, weight) = surface.sample(sample.lens);
                (point.p, weight)
            }
        };
        (Ray::new(p - d * (2.0 * self.radius), d), weight)
    }
}

//! The radiance meter: light that arrives at a point from one direction.

use super::Pose;
use crate::geom::Ray;

/// A sensor of a single ray, along the third axis of its pose.
#[derive(Clone, Copy, Debug)]
pub struct RadianceMeter;

impl RadianceMeter {
    #[inline]
    pub fn ray(&self, pose: &Pose) -> Ray {
        Ray::new(pose.origin, pose.axes.z_axis)
    }
}

//! From a point of the scene to the picture: what light tracing asks of a camera.

use super::Camera;
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
    /// Area of the picture, in square pixels, per unit of area at the point across `wi`.
    pub importance: f32,
}

impl Camera {
    /// Whether points of the scene can be connected to it: not to meters, which see along single rays or from
    /// points of a surface.
    pub fn can_be_connected(&self) -> bool {
        false
    }

    /// How the point `p` is seen at `time` through the point of the lens that `lens` in [0,1)² chooses, as
    /// [`Camera::ray`] does; `None` where it is not seen whatever stands in between: outside of the picture
    /// with a margin of `margin` pixels around it, before the near or behind the far plane.
    pub fn connect(&self, _p: Vec3, _time: f32, _lens: Vec2, _margin: f32) -> Option<Sight> {
        None
    }

    /// [`Sight::importance`] of the point `p` that a ray of [`Camera::ray`] in direction `d` meets at `time`;
    /// 0 for sensors that cannot be connected to.
    pub fn importance(&self, _p: Vec3, _d: Vec3, _time: f32) -> f32 {
        0.0
    }
}

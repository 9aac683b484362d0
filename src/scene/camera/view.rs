//! Where a camera stands and which way it looks.

use glam::Mat3;

use crate::math::{DVec3, Motion, Transform, Vec3};

/// Place and axes of a camera at one time, in scene coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    pub origin: Vec3,
    /// Columns: the camera's axes, unit vectors. It looks along the third, up is the second.
    pub axes: Mat3,
    /// Scene units per unit of each axis.
    pub scale: Vec3,
}

impl Pose {
    /// `to_world` takes the camera's coordinates to the world's, `center` is the point of the world that
    /// the scene's coordinates are relative to.
    pub fn new(to_world: &Transform, center: DVec3) -> Pose {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|v| to_world.vector(v));
        let [x, y, z] = axes.map(|v| v.normalize().as_vec3());
        let [sx, sy, sz] = axes.map(|v| v.length() as f32);
        Pose {
            origin: (to_world.point(DVec3::ZERO) - center).as_vec3(),
            axes: Mat3::from_cols(x, y, z),
            scale: Vec3::new(sx, sy, sz),
        }
    }
}

/// The pose over the shutter.
#[derive(Clone, Debug, PartialEq)]
pub struct View(Kind);

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Still(Pose),
    /// Camera to scene.
    Moving(Motion),
}

impl View {
    /// See [`Pose::new`].
    pub fn new(to_world: &Motion, center: DVec3) -> View {
        View(match to_world.as_still() {
            Some(transform) => Kind::Still(Pose::new(transform, center)),
            None => Kind::Moving(to_world.prepend(&Transform::translate(-center))),
        })
    }

    #[inline]
    pub fn at(&self, time: f32) -> Pose {
        match &self.0 {
            Kind::Still(pose) => *pose,
            Kind::Moving(motion) => Pose::new(&motion.at(time), DVec3::ZERO),
        }
    }

    pub fn moves(&self) -> bool {
        matches!(self.0, Kind::Moving(_))
    }
}

//! The projector: a point that throws a picture, the reverse of a pinhole camera.

use super::spot::{Directions, mean_luminance};
use super::tree::LightBounds;
use crate::math::{Aabb, DVec3, PI, Rgb, Transform, Vec2, Vec3};
use crate::texture::{At, Texture};

/// What makes a projector.
#[derive(Clone, Debug)]
pub struct ProjectorSpec {
    /// As of a camera: it stands at the image of the origin, looks along +z, +y up, +x to the left. A scale
    /// along z multiplies the light, as in Mitsuba 3.9 (measured).
    pub to_world: Transform,
    /// The picture.
    pub irradiance: Texture,
    pub scale: f32,
    /// Half the width and height of the picture at unit depth.
    pub half_extent: [f64; 2],
}

/// A point that throws a picture. At a distance d and an angle θ to the axis, a surface at right angles to
/// the light receives π scale irradiance(uv) / (d² cos³ θ), as in Mitsuba 3.9 (measured).
#[derive(Clone, Debug)]
pub struct Projector {
    p: Vec3,
    to_local: Directions,
    irradiance: Texture,
    /// π and all scales.
    factor: f32,
    half_extent: Vec2,
}

impl Projector {
    /// `center` is the point of the world that the scene's coordinates are relative to.
    pub fn new(spec: ProjectorSpec, center: DVec3) -> Projector {
        let depth = spec.to_world.vector(DVec3::Z).length() as f32;
        let [x, y] = spec.half_extent;
        Projector {
            p: (spec.to_world.point(DVec3::ZERO) - center).as_vec3(),
            to_local: Directions::new(&spec.to_world),
            irradiance: spec.irradiance,
            factor: PI * spec.scale * depth,
            half_extent: Vec2::new(x as f32, y as f32),
        }
    }

    pub fn position(&self) -> Vec3 {
        self.p
    }

    /// In W/sr towards the unit vector `d`, which leads away from the light.
    pub fn intensity(&self, d: Vec3) -> Rgb {
        let l = self.to_local.local(d);
        let cos = d.dot(self.to_local.axis);
        if !(l.z > 0.0 && cos > 0.0) {
            return Rgb::BLACK;
        }
        let q = Vec2::new(l.x, l.y) / (l.z * self.half_extent);
        if !(q.x.abs() <= 1.0 && q.y.abs() <= 1.0) {
            return Rgb::BLACK;
        }
        let uv = 0.5 - 0.5 * q;
        self.irradiance.eval(&At {
            uv,
            ..At::default()
        }) * (self.factor / (cos * cos * cos))
    }

    /// In W, luminance; exact under a rigid map, but for the mean of the picture.
    pub fn power(&self) -> f32 {
        // The solid angle of a piece of the plane at unit depth is its area times cos³, which cancels.
        let area = 4.0 * self.half_extent.x * self.half_extent.y;
        let mean = mean_luminance(&self.irradiance);
        (mean * self.factor * area).min(f32::MAX)
    }

    pub(super) fn bounds(&self) -> LightBounds {
        let corner = self.half_extent.x.hypot(self.half_extent.y).atan();
        let (axis, cos_spread, cos_reach) = self.to_local.cone(corner);
        LightBounds {
            bounds: Aabb {
                min: self.p,
                max: self.p,
            },
            axis,
            cos_spread,
            cos_reach,
            power: self.power(),
        }
    }
}

//! The spot light: a point that shines into a cone, brightest along its axis.

use glam::DMat3;

use super::tree::LightBounds;
use crate::math::{Aabb, DVec3, PI, Rgb, Transform, Vec2, Vec3};
use crate::texture::{At, Texture};

/// What makes a spot light.
#[derive(Clone, Debug)]
pub struct SpotSpec {
    /// The light stands at the image of the origin and shines along +z. Any affine map: what is not rigid
    /// deforms the cone.
    pub to_world: Transform,
    /// In W/sr along the axis.
    pub intensity: Rgb,
    /// Angle from the axis, 0 to π, at which the light ends.
    pub cutoff: f32,
    /// Angle up to which it has its full intensity; between the two it falls linearly with the angle.
    pub beam: f32,
    /// Multiplies the intensity; its unit square lies around the cone. For a cutoff below π/2.
    pub texture: Option<Texture>,
}

/// A point that shines into a cone. Meaning of the parameters as in Mitsuba 3.9 (measured).
#[derive(Clone, Debug)]
pub struct Spot {
    p: Vec3,
    to_local: Directions,
    intensity: Rgb,
    cutoff: f32,
    beam: f32,
    tan: f32,
    texture: Option<Texture>,
}

/// Takes directions of the world into the space of a light that stands at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Directions {
    to_local: glam::Mat3,
    /// Of the world, unit length.
    pub axis: Vec3,
    /// Whether angles stay what they are.
    pub conformal: bool,
}

impl Directions {
    pub fn new(to_world: &Transform) -> Directions {
        let m = to_world.matrix().matrix3;
        let inverse = to_world.inverse().matrix().matrix3;
        // Only the direction of the image counts, and squares of it must stay in range.
        let size = inverse
            .to_cols_array()
            .iter()
            .fold(0f64, |a, v| a.max(v.abs()));
        let inverse = if size > 0.0 {
            inverse * (1.0 / size)
        } else {
            DMat3::IDENTITY
        };
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
        let r2 = z.length_squared();
        let off = [x.dot(y), y.dot(z), z.dot(x)]
            .into_iter()
            .chain([x.length_squared() - r2, y.length_squared() - r2])
            .fold(0f64, |m, v| m.max(v.abs()));
        Directions {
            to_local: inverse.as_mat3(),
            axis: z.normalize_or(DVec3::Z).as_vec3(),
            conformal: off <= 1e-5 * r2,
        }
    }

    /// Of no particular length.
    #[inline]
    pub fn local(&self, d: Vec3) -> Vec3 {
        self.to_local * d
    }

    /// Axis, and cosines of the spread of axes and of the reach around it, for [`LightBounds`].
    pub fn cone(&self, angle: f32) -> (Vec3, f32, f32) {
        match self.conformal {
            true => (self.axis, 1.0, (angle + 1e-3).min(PI).cos()),
            false => (self.axis, -1.0, -1.0),
        }
    }
}

impl Spot {
    /// `center` is the point of the world that the scene's coordinates are relative to.
    pub fn new(spec: SpotSpec, center: DVec3) -> Spot {
        Spot {
            p: (spec.to_world.point(DVec3::ZERO) - center).as_vec3(),
            to_local: Directions::new(&spec.to_world),
            intensity: spec.intensity,
            cutoff: spec.cutoff.clamp(0.0, PI),
            beam: spec.beam.clamp(0.0, PI),
            tan: spec.cutoff.tan(),
            texture: spec.texture,
        }
    }

    pub fn position(&self) -> Vec3 {
        self.p
    }

    /// In W/sr towards the unit vector `d`, which leads away from the light.
    pub fn intensity(&self, d: Vec3) -> Rgb {
        let l = self.to_local.local(d);
        // Accurate also next to the axis, where the cosine is not.
        let angle = l.x.hypot(l.y).atan2(l.z);
        if angle >= self.cutoff {
            return Rgb::BLACK;
        }
        let falloff = match angle <= self.beam {
            true => 1.0,
            false => (self.cutoff - angle) / (self.cutoff - self.beam),
        };
        match &self.texture {
            Some(texture) => {
                let q = Vec2::new(l.x, l.y) / (l.z * self.tan);
                let uv = q * 0.5 + 0.5;
                self.intensity
                    * texture.eval(&At {
                        uv,
                        ..At::default()
                    })
                    * falloff
            }
            None => self.intensity * falloff,
        }
    }

    /// In W, luminance: exact under a conformal map and without texture.
    pub fn power(&self) -> f32 {
        let (c, b) = (f64::from(self.cutoff), f64::from(self.beam));
        // Integral of the falloff over the solid angle.
        let cone = match b < c {
            true => 1.0 - (c.sin() - b.sin()) / (c - b),
            false => 1.0 - c.cos(),
        };
        let mean = self.texture.as_ref().map_or(1.0, mean_luminance);
        (2.0 * std::f64::consts::PI * cone) as f32 * self.intensity.luminance() * mean
    }

    pub(super) fn bounds(&self) -> LightBounds {
        let (axis, cos_spread, cos_reach) = self.to_local.cone(self.cutoff);
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

/// Mean over the unit square of the luminance of `texture`, by 32 x 32 samples.
pub(super) fn mean_luminance(texture: &Texture) -> f32 {
    const N: usize = 32;
    let sum: f32 = (0..N * N)
        .map(|i| {
            let uv = (Vec2::new((i % N) as f32, (i / N) as f32) + 0.5) / N as f32;
            texture
                .eval(&At {
                    uv,
                    ..At::default()
                })
                .luminance()
        })
        .sum();
    sum / (N * N) as f32
}

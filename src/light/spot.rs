//! The spot light: a point that shines into a cone, brightest along its axis.

use glam::DMat3;

use super::emission::Outlook;
use super::tree::LightBounds;
use crate::math::{Aabb, DVec2, DVec3, PI, Rgb, Transform, Vec2, Vec3, warp};
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
    /// Its inverse.
    to_world: DMat3,
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
            to_world: match size > 0.0 {
                true => m * size,
                false => DMat3::IDENTITY,
            },
            axis: z.normalize_or(DVec3::Z).as_vec3(),
            conformal: off <= 1e-5 * r2,
        }
    }

    /// Of no particular length.
    #[inline]
    pub fn local(&self, d: Vec3) -> Vec3 {
        self.to_local * d
    }

    /// The unit vector of the world along the direction `l` of the light's own space.
    pub fn world(&self, l: DVec3) -> Option<Vec3> {
        (self.to_world * l).try_normalize().map(|d| d.as_vec3())
    }

    /// For the unit vector `d` of the world: the direction in the light's space, of no particular length, and
    /// what a density per steradian of the world is over the cube of that length and over one per steradian
    /// there. (Solid angles go as the volumes of thin cones.)
    pub fn density(&self, d: Vec3) -> (DVec3, f64) {
        let l = self.to_local.as_dmat3() * d.as_dvec3();
        (l, 1.0 / self.to_world.determinant().abs())
    }

    /// What of the world light within `angle` of the axis can reach.
    pub fn outlook(&self, angle: f32) -> Outlook {
        match self.conformal {
            true => Outlook {
                axis: self.axis,
                // As for the light tree: f32 directions are no better.
                reach: (angle + 1e-3).min(PI),
                by_cosine: false,
            },
            false => Outlook::ALL_AROUND,
        }
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
        let cone = self.falloff().integral();
        let mean = self.texture.as_ref().map_or(1.0, mean_luminance);
        (2.0 * std::f64::consts::PI * cone) as f32 * self.intensity.luminance() * mean
    }

    pub(super) fn outlook(&self) -> Outlook {
        self.to_local.outlook(self.cutoff)
    }

    /// A direction in proportion to the falloff, with density [`Spot::pdf_direction`].
    pub(super) fn sample_direction(&self, u: Vec2) -> Option<Vec3> {
        let disk = warp::concentric_disk(u).as_dvec2();
        // The squared radius is uniform, the angle around independent of it.
        let angle = self.falloff().invert(disk.length_squared().min(1.0));
        let around = disk.try_normalize().unwrap_or(DVec2::X) * angle.sin();
        self.to_local.world(around.extend(angle.cos()))
    }

    /// Density per steradian of [`Spot::sample_direction`] at the unit vector `d`.
    pub(super) fn pdf_direction(&self, d: Vec3) -> f64 {
        let (l, jacobian) = self.to_local.density(d);
        let angle = l.x.hypot(l.y).atan2(l.z);
        let falloff = self.falloff();
        let pdf = falloff.at(angle) / (std::f64::consts::TAU * falloff.integral());
        pdf * jacobian / l.length().powi(3)
    }

    fn falloff(&self) -> Falloff {
        let (beam, cutoff) = (f64::from(self.beam), f64::from(self.cutoff));
        Falloff {
            beam: beam.min(cutoff),
            cutoff,
        }
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

/// How the light falls off with the angle: 1 up to `beam`, then linearly down to 0 at `cutoff`.
struct Falloff {
    beam: f64,
    cutoff: f64,
}

/// `x - sin x`, also where the two nearly cancel.
fn beyond_sine(x: f64) -> f64 {
    match x < 0.1 {
        true => {
            x * x * x / 6.0 * (1.0 - x * x / 20.0 * (1.0 - x * x / 42.0 * (1.0 - x * x / 72.0)))
        }
        false => x - x.sin(),
    }
}

/// `1 - cos x`, without cancellation.
fn below_one(x: f64) -> f64 {
    2.0 * (0.5 * x).sin().powi(2)
}

impl Falloff {
    fn at(&self, angle: f64) -> f64 {
        if angle >= self.cutoff {
            0.0
        } else if angle <= self.beam {
            1.0
        } else {
            (self.cutoff - angle) / (self.cutoff - self.beam)
        }
    }

    /// Integral of the falloff times the sine, from the axis to `angle` of at most the cutoff; times 2π, over
    /// the solid angle.
    fn up_to(&self, angle: f64) -> f64 {
        let (b, c) = (self.beam, self.cutoff);
        if angle <= b || b >= c {
            return below_one(angle);
        }
        // Of (c - x) sin x: -(c - x) cos x - sin x, with what cancels taken out.
        let part = |x: f64| beyond_sine(x) + (c - x) * below_one(x);
        below_one(b) + ((part(angle) - part(b)) / (c - b)).max(0.0)
    }

    fn integral(&self) -> f64 {
        self.up_to(self.cutoff)
    }

    /// The angle within which the share `u` of the light goes: Newton's method, kept in a bracket.
    fn invert(&self, u: f64) -> f64 {
        let target = u * self.integral();
        let (mut lo, mut hi) = (0.0, self.cutoff);
        // As if the light did not fall off.
        let mut x = 2.0 * (0.5 * target).clamp(0.0, 1.0).sqrt().asin();
        for _ in 0..32 {
            let gap = self.up_to(x) - target;
            match gap > 0.0 {
                true => hi = x,
                false => lo = x,
            }
            let newton = x - gap / (self.at(x) * x.sin());
            let next = match newton > lo && newton < hi {
                true => newton,
                false => 0.5 * (lo + hi),
            };
            if (next - x).abs() <= 1e-9 * hi {
                return next;
            }
            x = next;
        }
        x
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

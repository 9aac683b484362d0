//! The projector: a point that throws a picture, the reverse of a pinhole camera.

use super::emission::Outlook;
use super::spot::{Directions, mean_luminance};
use super::tree::LightBounds;
use crate::math::fp::ONE_MINUS_EPSILON;
use crate::math::warp::Tabulated2;
use crate::math::{Aabb, DVec2, DVec3, PI, Rgb, Transform, Vec2, Vec3};
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
    /// Brightness of the picture, by which directions are drawn; `None` for a constant one.
    table: Option<Tabulated2>,
}

impl Projector {
    /// `center` is the point of the world that the scene's coordinates are relative to.
    pub fn new(spec: ProjectorSpec, center: DVec3) -> Projector {
        let depth = spec.to_world.vector(DVec3::Z).length() as f32;
        let [x, y] = spec.half_extent;
        Projector {
            table: tabulate(&spec.irradiance),
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

    /// Angle from the axis to the corners of the picture.
    fn corner(&self) -> f32 {
        self.half_extent.x.hypot(self.half_extent.y).atan()
    }

    pub(super) fn outlook(&self) -> Outlook {
        self.to_local.outlook(self.corner())
    }

    /// A direction through the picture by its brightness, with density [`Projector::pdf_direction`].
    pub(super) fn sample_direction(&self, u: Vec2) -> Option<Vec3> {
        let uv = self.table.as_ref().map_or(u, |table| table.sample(u).0);
        let at = (DVec2::ONE - 2.0 * uv.as_dvec2()) * self.half_extent.as_dvec2();
        self.to_local.world(at.extend(1.0))
    }

    /// Density per steradian of [`Projector::sample_direction`] at the unit vector `d`.
    pub(super) fn pdf_direction(&self, d: Vec3) -> f64 {
        let (l, jacobian) = self.to_local.density(d);
        let half = self.half_extent.as_dvec2();
        let q = l.truncate() / (l.z * half);
        if !(l.z > 0.0 && q.abs().max_element() <= 1.0) {
            return 0.0;
        }
        let density = self.table.as_ref().map_or(1.0, |table| {
            let uv = (0.5 - 0.5 * q).as_vec2();
            f64::from(table.pdf(uv.min(Vec2::splat(ONE_MINUS_EPSILON))))
        });
        // Per area of the plane at unit depth, which is cos³ steradians each.
        density / (4.0 * half.x * half.y) * jacobian / l.z.powi(3)
    }

    pub(super) fn bounds(&self) -> LightBounds {
        let (axis, cos_spread, cos_reach) = self.to_local.cone(self.corner());
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

/// Most cells of the table along each side, and samples along each side of a cell.
const MAX_SIDE: usize = 512;
const FINE: usize = 3;
/// Weight that each cell gets of the mean over the picture: the table is made of samples, which may have
/// missed a bright spot.
const FLOOR: f32 = 0.02;

fn tabulate(picture: &Texture) -> Option<Tabulated2> {
    let [w, h] = match picture {
        Texture::Constant(_) => return None,
        Texture::Bitmap(b) => [b.texels.width, b.texels.height],
        // Of unknown grain.
        _ => [128; 2],
    }
    .map(|n| (n as usize).clamp(1, MAX_SIDE));
    let step = Vec2::new((w * FINE) as f32, (h * FINE) as f32).recip();
    let mut weights = vec![0f32; w * h];
    for y in 0..h * FINE {
        for x in 0..w * FINE {
            let uv = (Vec2::new(x as f32, y as f32) + 0.5) * step;
            let at = At {
                uv,
                ..At::default()
            };
            let value = picture.eval(&at).luminance();
            weights[y / FINE * w + x / FINE] += match value.is_finite() {
                true => value.max(0.0) / (FINE * FINE) as f32,
                false => 0.0,
            };
        }
    }
    let mean = weights.iter().map(|&w| f64::from(w)).sum::<f64>() / (w * h) as f64;
    let floor = (FLOOR * mean as f32).max(f32::MIN_POSITIVE);
    weights.iter_mut().for_each(|w| *w += floor);
    Tabulated2::new(&weights, w, h)
}

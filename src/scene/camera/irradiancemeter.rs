//! The irradiance meter: light that arrives at a shape from all directions above it.

use super::{CameraSample, Surface};
use crate::geom::Ray;
use crate::math::{Frame, PI, Vec2, fp, warp};

/// Measures the mean over a surface of the irradiance on its outer side. Points are uniform over the
/// area, directions by the cosine, so every radiance counts pi.
#[derive(Clone, Debug)]
pub struct IrradianceMeter {
    surface: Surface,
}

impl IrradianceMeter {
    pub fn new(surface: Surface) -> IrradianceMeter {
        IrradianceMeter { surface }
    }

    /// The film has one pixel: the point of it chooses that of the surface, that of the lens the
    /// direction. The result is the ray and its weight.
    #[inline]
    pub fn ray(&self, sample: &CameraSample) -> (Ray, f32) {
        let u = sample
            .film
            .clamp(Vec2::ZERO, Vec2::splat(fp::ONE_MINUS_EPSILON));
        let (point, weight) = self.surface.sample(u);
        let d = Frame::from_normal(point.ns).to_world(warp::cosine_hemisphere(sample.lens));
        let o = fp::offset_origin(point.p, point.p_err, point.ng, d);
        (Ray::new(o, d), PI * weight)
    }
}

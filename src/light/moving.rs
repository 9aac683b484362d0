//! Shining surfaces that move: a receiver sees them from their own coordinates, as they stand at its time.

use super::local::Towards;
use super::tree::LightBounds;
use super::{EmitterId, EmitterSample, Item, Lights, What, connection, place_of, textured};
use crate::geom::world::{normal, point};
use crate::geom::{Endpoint, Geometry, Hit};
use crate::math::{DVec3, Motion, Transform, Vec2, Vec3};

/// A surface at one time.
pub(super) struct Moved {
    to_world: Transform,
    to_local: Transform,
}

impl Moved {
    pub fn new(motion: &Motion, time: f32) -> Moved {
        let to_world = motion.at(time);
        Moved {
            to_world,
            to_local: to_world.inverse(),
        }
    }

    /// A point of the world in the coordinates of the surface.
    pub fn into(&self, p: Vec3) -> Vec3 {
        self.to_local.point(p.as_dvec3()).as_vec3()
    }

    /// A unit normal of the world there.
    pub fn normal_into(&self, n: Vec3) -> Vec3 {
        normal(&self.to_local, n)
    }

    /// A point of the surface in the world, with the bound on its error.
    pub fn point_out(&self, p: Vec3, p_err: Vec3) -> (Vec3, Vec3) {
        point(&self.to_world, p, p_err)
    }

    /// A unit normal of the surface in the world.
    pub fn normal_out(&self, n: Vec3) -> Vec3 {
        normal(&self.to_world, n)
    }

    /// Area in the world of a unit of area of the surface where its unit normal, in its own coordinates, is
    /// `n`: an area is the volume of a prism over its height.
    pub fn area_scale(&self, n: Vec3) -> f64 {
        let det = self.to_world.matrix().matrix3.determinant().abs();
        det * self.to_world.normal(n.as_dvec3()).length()
    }

    /// A connection found there, in the world for the receiver at `eye`. `None` as for
    /// [`Part::sample`](super::local::Part::sample).
    pub fn out(&self, local: &Towards, eye: Vec3) -> Option<Towards> {
        let (p, p_err) = point(&self.to_world, local.end.p, local.end.p_err);
        let d = (p - eye).as_dvec3();
        let wi = d.try_normalize()?.as_vec3();
        let pdf = (f64::from(local.pdf) * self.density(local.wi.as_dvec3())) as f32;
        (pdf > 0.0 && pdf < f32::MAX).then(|| Towards {
            end: Endpoint {
                p,
                p_err,
                ng: normal(&self.to_world, local.end.ng),
            },
            wi,
            dist: d.length() as f32,
            pdf,
        })
    }

    /// A density per steradian of the surface's coordinates, in the direction of `w` there, as one of the
    /// world.
    pub fn pdf_out(&self, pdf: f32, w: Vec3) -> f32 {
        let w = w.as_dvec3().normalize_or_zero();
        let pdf = f64::from(pdf) * self.density(w);
        match pdf > 0.0 {
            true => pdf.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32,
            false => 0.0,
        }
    }

    /// The factor of that, for the unit vector `w`: dω_world = |det M| / |M w|³ dω_local, as the volume of
    /// a thin cone shows.
    fn density(&self, w: DVec3) -> f64 {
        let m = self.to_world.matrix().matrix3;
        (m * w).length().powi(3) / m.determinant().abs()
    }
}

impl Lights {
    /// How the surface of an item stands at the time of `from`, if it moves.
    #[inline]
    pub(super) fn moved(&self, what: &What, from: &Hit) -> Option<Moved> {
        if self.motions.is_empty() {
            return None;
        }
        match what {
            What::Part { part, .. } | What::Textured { part, .. } | What::Beam { part, .. } => {
                Some(Moved::new(self.motion(part.shape())?, from.time))
            }
            What::Point => None,
        }
    }

    /// A connection from `eye` to an item that moves. Apart from the one for those that do not, so that
    /// they pay nothing for it.
    #[inline(never)]
    pub(super) fn sample_moved(
        &self,
        geoms: &[Geometry],
        item: &Item,
        moved: &Moved,
        eye: Vec3,
        u: Vec2,
        prob: f32,
    ) -> Option<EmitterSample> {
        let local = moved.into(eye);
        let (towards, le) = match item.what {
            What::Part { part, radiance } => {
                let g = geoms.get(part.shape().0 as usize)?;
                (part.sample(g, local, u)?, radiance)
            }
            What::Textured { part, table } => {
                let g = geoms.get(part.shape().0 as usize)?;
                let (towards, at) = textured::sample(&part, g, self.table(table), local, u)?;
                (towards, self.textured(item.emitter, &at))
            }
            // Beams do not move.
            What::Beam { .. } | What::Point => return None,
        };
        connection(moved.out(&towards, eye)?, le, prob, EmitterId(item.emitter))
    }

    /// Density per steradian at `eye` of the point `met` of an item that moves.
    #[inline(never)]
    pub(super) fn pdf_moved(
        &self,
        g: &Geometry,
        what: &What,
        moved: &Moved,
        eye: Vec3,
        met: &Hit,
    ) -> f32 {
        let (eye, p) = (moved.into(eye), moved.into(met.p));
        let ng = moved.normal_into(met.ng);
        moved.pdf_out(self.pdf_of(g, what, eye, (p, ng, &place_of(met))), p - eye)
    }
}

/// What the choice of a light is to know of a part that is `bounds` in its own coordinates.
pub(super) fn bounds(motion: &Motion, bounds: LightBounds) -> LightBounds {
    let middle = motion.at(0.5);
    // The area grows as the square of the scale does; the power only guides the choice.
    let scale = middle.matrix().matrix3.determinant().abs().cbrt();
    let flat = bounds.cos_spread == 1.0 && motion.only_translates();
    let (axis, cos_spread) = match flat {
        true => (normal(&middle, bounds.axis), 1.0),
        false => (Vec3::Z, -1.0),
    };
    let power = f64::from(bounds.power) * scale * scale;
    LightBounds {
        bounds: motion.bounds(bounds.bounds, 0.0, 1.0),
        axis,
        cos_spread,
        power: power.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32,
        ..bounds
    }
}

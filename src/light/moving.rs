//! Shining surfaces that move: sampled in their own coordinates at the time of the receiver.

use super::local::{Part, Towards};
use super::tree::LightBounds;
use crate::geom::world::{normal, point};
use crate::geom::{Endpoint, Geometry, Hit};
use crate::math::{DVec3, Motion, Transform, Vec2, Vec3};

/// A point of `part` to connect to from `from`, at the time of `from`. `None` as for [`Part::sample`].
pub(super) fn sample(
    part: &Part,
    g: &Geometry,
    motion: &Motion,
    from: &Hit,
    u: Vec2,
) -> Option<Towards> {
    let to_world = motion.at(from.time);
    let local = part.sample(g, into(&to_world, from.p), u)?;
    let (p, p_err) = point(&to_world, local.end.p, local.end.p_err);
    let d = (p - from.p).as_dvec3();
    let wi = d.try_normalize()?.as_vec3();
    let pdf = f64::from(local.pdf) * density(&to_world, local.wi.as_dvec3());
    let pdf = pdf as f32;
    (pdf > 0.0 && pdf < f32::MAX).then(|| Towards {
        end: Endpoint {
            p,
            p_err,
            ng: normal(&to_world, local.end.ng),
        },
        wi,
        dist: d.length() as f32,
        pdf,
    })
}

/// Density per steradian at `from` with which [`sample`] returns the point of `met`.
pub(super) fn pdf(part: &Part, g: &Geometry, motion: &Motion, from: &Hit, met: &Hit) -> f32 {
    let to_world = motion.at(from.time);
    let (eye, p) = (into(&to_world, from.p), into(&to_world, met.p));
    let Some(w) = (p - eye).as_dvec3().try_normalize() else {
        return 0.0;
    };
    let pdf = part.pdf(g, eye, p, normal(&to_world.inverse(), met.ng));
    let pdf = f64::from(pdf) * density(&to_world, w);
    match pdf > 0.0 {
        true => pdf.clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX)) as f32,
        false => 0.0,
    }
}

fn into(to_world: &Transform, p: Vec3) -> Vec3 {
    to_world.inverse().point(p.as_dvec3()).as_vec3()
}

/// What a density per steradian of object space, at the unit direction `w` there, is multiplied by to be one
/// of world space: dω_world = |det M| / |M w|³ dω_object, as the volume of a thin cone shows.
fn density(to_world: &Transform, w: DVec3) -> f64 {
    let m = to_world.matrix().matrix3;
    (m * w).length().powi(3) / m.determinant().abs()
}

/// What the light tree is to know of a part that is `bounds` in its own coordinates.
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
    }
}

//! A group of shapes at one place, or on its way: rays into its coordinates, hits out of them.

use super::{GroupId, PlaceId};
use crate::geom::{Geometry, Hit, RawHit, Ray};
use crate::math::{DVec3, Frame, Motion, Transform, Vec3, fp};

/// Where a group stands: the map from its coordinates to those of the world, over the shutter.
#[derive(Clone, Debug)]
pub struct Placement {
    pub group: GroupId,
    pub motion: Motion,
}

impl Placement {
    /// `ray` in the coordinates of the group. The direction is not normalised, so that distances along it
    /// stay those of the world.
    #[inline]
    pub(super) fn ray(&self, ray: &Ray) -> Ray {
        match self.motion.as_still() {
            Some(still) => into(still, ray),
            None => into(&self.motion.at(ray.time), ray),
        }
    }

    /// All that shading needs at the meeting `raw` of `ray`, which is in world coordinates, with
    /// `geometry` of the group. Normals keep their side when the map mirrors, as Mitsuba has it for
    /// instances.
    pub(super) fn hit(
        &self,
        geometry: &Geometry,
        ray: &Ray,
        raw: &RawHit,
        id: PlaceId,
        tangents: bool,
    ) -> Hit {
        let to_world = &self.motion.at(ray.time);
        let hit = geometry.hit(&into(to_world, ray), raw, tangents);
        let (p, p_err) = point(to_world, hit.p, hit.p_err);
        let ng = normal(to_world, hit.ng);
        let ns = match hit.frame.n == hit.ng {
            true => ng,
            false => normal(to_world, hit.frame.n),
        };
        let frame = match tangents {
            true => Frame::from_tangent(ns, vector(to_world, geometry.dp_duv(&hit).0)),
            false if geometry.is_mesh() => Frame::from_normal(ns),
            false => Frame::from_tangent(ns, vector(to_world, hit.frame.s)),
        };
        Hit {
            p,
            p_err,
            ng,
            frame,
            wo: -ray.d,
            place: id,
            ..hit
        }
    }

    /// dp/du and dp/dv in the world at a hit on `geometry` of the group.
    pub(super) fn dp_duv(&self, geometry: &Geometry, hit: &Hit) -> (Vec3, Vec3) {
        let to_world = self.motion.at(hit.time);
        let p = to_world.inverse().point(hit.p.as_dvec3()).as_vec3();
        let (du, dv) = geometry.dp_duv(&Hit { p, ..*hit });
        (vector(&to_world, du), vector(&to_world, dv))
    }
}

fn into(to_world: &Transform, ray: &Ray) -> Ray {
    let inverse = to_world.inverse();
    Ray {
        o: inverse.point(ray.o.as_dvec3()).as_vec3(),
        d: inverse.vector(ray.d.as_dvec3()).as_vec3(),
        ..*ray
    }
}

/// A point of an object in the world, with the bound on its error.
///
/// A ray that leaves the point is rounded twice more than one that leaves a shape of the world: its origin
/// when it is offset there, and again when it comes back to the coordinates of the object, by one rounding
/// of `p` each. Both must stay on the side of the surface that the offset chose; so the box that the
/// offset leaves is the image of the object's box, grown by that second rounding (and one for those of the
/// matrix product, which f64 makes tiny).
pub(crate) fn point(to_world: &Transform, p: Vec3, p_err: Vec3) -> (Vec3, Vec3) {
    let m = to_world.matrix().matrix3;
    let world = to_world.point(p.as_dvec3()).as_vec3();
    let e = (p_err + p.abs() * fp::gamma(2)).as_dvec3();
    let spread: DVec3 = m.x_axis.abs() * e.x + m.y_axis.abs() * e.y + m.z_axis.abs() * e.z;
    (world, spread.as_vec3() + world.abs() * fp::gamma(3))
}

/// A unit normal in the world.
pub(crate) fn normal(to_world: &Transform, n: Vec3) -> Vec3 {
    let n = to_world.normal(n.as_dvec3());
    n.normalize_or(DVec3::Z).as_vec3()
}

fn vector(to_world: &Transform, v: Vec3) -> Vec3 {
    to_world.vector(v.as_dvec3()).as_vec3()
}

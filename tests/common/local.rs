//! Directions and hits in the local frame, where z is the normal.
#![allow(dead_code)] // each test binary uses a part

use luxel::geom::{Hit, PlaceId, ShapeId};
use luxel::math::{DVec3, Frame, Vec2, Vec3};

/// The direction of this angle from the normal and this azimuth from x towards y.
pub fn direction(polar_deg: f64, azimuth_deg: f64) -> Vec3 {
    let (st, ct) = polar_deg.to_radians().sin_cos();
    let (sp, cp) = azimuth_deg.to_radians().sin_cos();
    DVec3::new(st * cp, st * sp, ct).as_vec3()
}

/// Where a mirror sends what comes from `wo`.
pub fn mirror(wo: Vec3) -> Vec3 {
    Vec3::new(-wo.x, -wo.y, wo.z)
}

/// A hit on the plane z = 0 with tangents x and y, seen from `wo`.
pub fn seen_from(wo: Vec3, uv: Vec2) -> Hit {
    Hit {
        p: Vec3::ZERO,
        p_err: Vec3::ZERO,
        ng: Vec3::Z,
        frame: Frame {
            s: Vec3::X,
            t: Vec3::Y,
            n: Vec3::Z,
        },
        uv,
        wo,
        time: 0.0,
        shape: ShapeId(0),
        prim: 0,
        bary: Vec2::ZERO,
        place: PlaceId::NONE,
    }
}

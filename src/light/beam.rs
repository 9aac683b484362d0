//! Surfaces that shine along their normals only.
//!
//! A receiver sees at most one point of a flat or convex part of such a surface: the one whose normal
//! leads to it. So the connection is a delta one, and a ray never meets such light by chance.

use super::local::Part;
use super::textured;
use crate::geom::{Endpoint, Geometry, Hit, Mesh, RawHit, Ray};
use crate::math::{DVec3, Vec2, Vec3};
use crate::texture::At;

/// The point of a part that shines at a receiver.
pub(super) struct Foot {
    pub end: Endpoint,
    /// Unit direction from the receiver.
    pub wi: Vec3,
    pub dist: f32,
    pub at: At,
    /// What is left of the radiant exitance at the receiver: normals of a curved surface spread.
    pub factor: f32,
}

/// Whether [`foot`] can be told for all of a shape: it is flat by pieces, or a sphere or cylinder whose
/// normals spread.
pub(crate) fn has_feet(g: &Geometry) -> bool {
    match g {
        Geometry::Mesh(m) => {
            m.normals().is_empty() || (0..m.indices().len() as u32).all(|i| is_flat(m, i))
        }
        Geometry::Sphere(s) => !s.inward(),
        Geometry::Cylinder(s) => !s.flip_normals(),
        Geometry::Disk(_) => true,
        Geometry::Deforming(_) | Geometry::Sdf(_) => false,
    }
}

const CORNERS: [Vec2; 3] = [Vec2::ZERO, Vec2::X, Vec2::Y];

fn is_flat(m: &Mesh, prim: u32) -> bool {
    let ng = m.face_normal(prim);
    let cos = CORNERS.map(|b| m.shading_normal(prim, b, ng).dot(ng));
    let same = |c: f32| c * cos[0].signum() > 1.0 - 1e-5;
    cos.into_iter().all(same) || m.triangle_area(prim) == 0.0
}

/// The point that shines at `eye`, if there is one.
pub(super) fn foot(part: &Part, g: &Geometry, from: &Hit) -> Option<Foot> {
    let eye = from.p;
    match g {
        Geometry::Deforming(_) | Geometry::Sdf(_) => None,
        Geometry::Mesh(m) => part.prims().find_map(|prim| on_triangle(m, prim, eye)),
        Geometry::Disk(s) => along(g, from, -s.normal().as_dvec3(), |_| 1.0),
        Geometry::Sphere(s) => {
            let to = s.center() - eye.as_dvec3();
            let share = s.radius() / to.length();
            along(g, from, to, |_| share * share)
        }
        Geometry::Cylinder(s) => {
            let (base, axis) = s.axis();
            let to = base - eye.as_dvec3();
            let to = to - axis * (to.dot(axis) / axis.length_squared());
            let distance = to.length();
            along(g, from, to, |dist| 1.0 - f64::from(dist) / distance)
        }
    }
}

fn on_triangle(m: &Mesh, prim: u32, eye: Vec3) -> Option<Foot> {
    let ng = m.face_normal(prim);
    let side = m.shading_normal(prim, Vec2::splat(1.0 / 3.0), ng).dot(ng);
    let n = (ng * side.signum()).as_dvec3();
    let height = (eye.as_dvec3() - m.triangle(prim)[0].as_dvec3()).dot(n);
    if height <= 0.0 {
        return None;
    }
    let bary = textured::weights_at(m, prim, (eye.as_dvec3() - n * height).as_vec3());
    let inside = bary.min_element() >= 0.0 && bary.x + bary.y <= 1.0;
    let surface = m.surface_sample(prim, bary);
    inside.then_some(Foot {
        end: Endpoint {
            p: surface.p,
            p_err: surface.p_err,
            ng,
        },
        wi: -n.as_vec3(),
        dist: height as f32,
        at: At {
            uv: surface.uv,
            prim,
            bary,
        },
        factor: 1.0,
    })
}

/// The first point in the direction `to`, if its normal leads back; `factor` of its distance.
fn along(g: &Geometry, from: &Hit, to: DVec3, factor: impl Fn(f32) -> f64) -> Option<Foot> {
    let wi = to.try_normalize()?.as_vec3();
    let ray = Ray {
        time: from.time,
        ..Ray::new(from.p, wi)
    };
    let (t, uv) = g.intersect_analytic(&ray, f32::INFINITY)?;
    // Which shape and primitive it is does not matter here.
    let raw = RawHit {
        t,
        shape: from.shape,
        prim: 0,
        uv,
    };
    let met = g.hit(&ray, &raw, false);
    let factor = factor(t) as f32;
    let shines = met.frame.n.dot(wi) < 0.0 && factor > 0.0 && factor.is_finite();
    shines.then_some(Foot {
        end: Endpoint {
            p: met.p,
            p_err: met.p_err,
            ng: met.ng,
        },
        wi,
        dist: t,
        at: At {
            uv: met.uv,
            ..At::default()
        },
        factor,
    })
}

//! Shapes for tests, and their intersection by brute force.
#![allow(dead_code)] // each test binary uses a part

use luxel::geom::{Cylinder, Disk, Geometry, Hit, Mesh, PlaceId, RawHit, Ray, ShapeId, Sphere};
use luxel::math::{DVec3, Frame, Transform, Vec2, Vec3};

/// Nearest triangle by brute force in f64, or the analytic intersection.
pub fn intersect_as(shape: u32, g: &Geometry, ray: &Ray) -> Option<Hit> {
    let raw = |t, prim, uv| RawHit {
        t,
        shape: ShapeId(shape),
        prim,
        uv,
    };
    let Geometry::Mesh(m) = g else {
        let (t, uv) = g.intersect_analytic(ray, ray.t_max)?;
        return Some(g.hit(ray, &raw(t, 0, uv), true));
    };
    let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let mut best: Option<RawHit> = None;
    for prim in 0..m.indices().len() as u32 {
        let [p0, p1, p2] = m.triangle(prim).map(|p| p.as_dvec3());
        let (e1, e2) = (p1 - p0, p2 - p0);
        let det = d.cross(e2).dot(e1);
        let b1 = d.cross(e2).dot(o - p0) / det;
        let b2 = (o - p0).cross(e1).dot(d) / det;
        let t = (o - p0).cross(e1).dot(e2) / det;
        let inside = b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 && t > 0.0;
        if inside && best.is_none_or(|b| (t as f32) < b.t) {
            best = Some(raw(t as f32, prim, Vec2::new(b1 as f32, b2 as f32)));
        }
    }
    best.map(|b| g.hit(ray, &b, true))
}

pub fn scale(x: f64, y: f64, z: f64) -> Transform {
    Transform::scale(DVec3::new(x, y, z)).unwrap()
}

pub fn turned() -> Transform {
    Transform::translate(DVec3::new(0.2, 0.1, 0.3))
        * Transform::rotate(DVec3::new(0.0, 0.6, 0.8), 40.0).unwrap()
        * scale(1.3, 1.3, 1.3)
}

pub fn sphere(t: Transform, flip: bool) -> Geometry {
    Geometry::Sphere(Sphere::new(t, flip).unwrap())
}

pub fn cylinder(t: Transform, flip: bool) -> Geometry {
    Geometry::Cylinder(Cylinder::new(t, flip))
}

pub fn disk(t: Transform, flip: bool) -> Geometry {
    Geometry::Disk(Disk::new(t, flip))
}

/// The nearest of several shapes.
pub fn nearest(geoms: &[Geometry], ray: &Ray) -> Option<Hit> {
    let hits = geoms
        .iter()
        .enumerate()
        .filter_map(|(i, g)| intersect_as(i as u32, g, ray));
    hits.min_by(|a, b| (a.p - ray.o).length().total_cmp(&(b.p - ray.o).length()))
}

pub fn intersect(g: &Geometry, ray: &Ray) -> Option<Hit> {
    intersect_as(0, g, ray)
}

/// A mesh of one triangle.
pub fn triangle(corners: [[f32; 3]; 3]) -> Geometry {
    let p = corners.map(Vec3::from_array).to_vec();
    Geometry::Mesh(Mesh::new(p, vec![], vec![], vec![[0, 1, 2]], false).unwrap())
}

/// A receiver at `p` with normal `n`, seen from above.
pub fn receiver(p: Vec3, n: Vec3) -> Hit {
    Hit {
        p,
        p_err: p.abs() * 1e-6,
        ng: n,
        frame: Frame::from_normal(n),
        uv: Vec2::ZERO,
        wo: n,
        time: 0.0,
        shape: ShapeId(u32::MAX),
        prim: 0,
        bary: Vec2::ZERO,
        place: PlaceId::NONE,
    }
}

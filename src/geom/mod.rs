//! Geometry: rays, the shapes they meet, and what is known about the point of a meeting.
//!
//! Traversal returns little ([`RawHit`]); shading data ([`Hit`]) is computed once, for the hit that won.
//! All coordinates are f32 and relative to the centre of the scene (see `format::compile`).

pub mod accel;
pub mod analytic;
pub mod mesh;
pub mod sdf;
pub mod wide;
pub mod world;

pub use accel::{Accel, Hooks, MeshRef};
pub use analytic::{Cylinder, Disk, Sphere};
pub use mesh::{Mesh, MeshError};
pub use sdf::{Sdf, SdfGrid};
pub use world::{Deforming, GroupId, PlaceId, Placement, World};

use crate::math::{Aabb, DVec2, DVec3, Frame, Vec2, Vec3, fp, warp};

/// A half-line or segment. In the world `d` has unit length, so `t_max` is a distance; in the coordinates
/// of a group of shapes it has any length, so that `t` remains that of the world.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub o: Vec3,
    pub d: Vec3,
    pub t_max: f32,
    /// When the light travels, 0 to 1 over the shutter.
    pub time: f32,
}

impl Ray {
    /// An endless ray at time 0.
    pub fn new(o: Vec3, d: Vec3) -> Ray {
        Ray {
            o,
            d,
            t_max: f32::INFINITY,
            time: 0.0,
        }
    }

    pub fn at(&self, t: f32) -> Vec3 {
        self.o + self.d * t
    }
}

/// Index of a shape of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ShapeId(pub u32);

/// What traversal knows of the nearest meeting of a ray with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawHit {
    /// Distance along the ray.
    pub t: f32,
    pub shape: ShapeId,
    /// Triangle of a mesh; 0 for other shapes.
    pub prim: u32,
    /// Barycentric weights of the second and third corner of a triangle; the surface parameters of
    /// any other shape.
    pub uv: Vec2,
}

/// A point on a surface and what shading needs there.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub p: Vec3,
    /// Bound on the error of `p`, per axis.
    pub p_err: Vec3,
    /// Geometric unit normal, on the side the shape calls its outside.
    pub ng: Vec3,
    /// Shading frame: `n` is the (interpolated) shading normal, `s` follows dp/du.
    pub frame: Frame,
    /// Texture coordinates.
    pub uv: Vec2,
    /// Unit direction towards where the ray came from.
    pub wo: Vec3,
    /// When the surface was met, 0 to 1 over the shutter.
    pub time: f32,
    pub shape: ShapeId,
    pub prim: u32,
    /// Barycentric weights of the second and third corner of a triangle.
    pub bary: Vec2,
    /// The placement of the shape's group.
    pub place: PlaceId,
}

impl From<&Hit> for Endpoint {
    fn from(hit: &Hit) -> Endpoint {
        Endpoint {
            p: hit.p,
            p_err: hit.p_err,
            ng: hit.ng,
        }
    }
}

impl Hit {
    /// A ray that leaves the surface along the unit vector `wi`.
    #[inline]
    pub fn spawn(&self, wi: Vec3) -> Ray {
        Ray {
            time: self.time,
            ..Ray::new(fp::offset_origin(self.p, self.p_err, self.ng, wi), wi)
        }
    }

    /// The segment from here to `q`, free of both surfaces it connects.
    #[inline]
    pub fn spawn_to(&self, q: &Endpoint) -> Ray {
        Endpoint::from(self).segment_to(q, self.time)
    }
}

/// The far end of a connection: a point on a surface (`ng` its geometric normal), or in free space
/// (`ng` and `p_err` zero).
#[derive(Clone, Copy, Debug)]
pub struct Endpoint {
    pub p: Vec3,
    pub p_err: Vec3,
    pub ng: Vec3,
}

impl Endpoint {
    /// The segment from here to `q` at `time`, free of both surfaces it connects. Its direction is NaN where both
    /// points are the same.
    #[inline]
    pub fn segment_to(&self, q: &Endpoint, time: f32) -> Ray {
        let o = fp::offset_origin(self.p, self.p_err, self.ng, q.p - self.p);
        let to = q.offset_towards(o);
        let d = to - o;
        let len = d.length();
        Ray {
            o,
            d: d / len,
            t_max: fp::connection_t_max(len),
            time,
        }
    }

    /// The point, moved towards `o` so far that a ray from there does not meet the surface of the point.
    #[inline]
    pub fn offset_towards(&self, o: Vec3) -> Vec3 {
        let d = o - self.p;
        let p_err = self.p_err + d.length() * fp::PLANE_ERROR;
        fp::offset_origin(self.p, p_err, self.ng, d)
    }
}

/// A point drawn on a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceSample {
    pub p: Vec3,
    /// Bound on the error of `p`, per axis.
    pub p_err: Vec3,
    /// Geometric and shading normal, as in [`Hit`].
    pub ng: Vec3,
    pub ns: Vec3,
    pub uv: Vec2,
    /// Density per unit of area.
    pub pdf_a: f32,
}

/// Any shape of the scene, in centred world coordinates.
#[derive(Clone, Debug)]
pub enum Geometry {
    Mesh(Mesh),
    Sphere(Sphere),
    Disk(Disk),
    Cylinder(Cylinder),
    /// A mesh that changes its form over the shutter.
    Deforming(Deforming),
    /// Gives no light: it has no area to sample.
    Sdf(Sdf),
}

impl Geometry {
    pub fn bounds(&self) -> Aabb {
        match self {
            Geometry::Mesh(s) => s.bounds(),
            Geometry::Sphere(s) => s.bounds(),
            Geometry::Disk(s) => s.bounds(),
            Geometry::Cylinder(s) => s.bounds(),
            Geometry::Deforming(s) => s.bounds(),
            Geometry::Sdf(s) => s.bounds(),
        }
    }

    /// Area, 0 for a grid of distances.
    pub fn area(&self) -> f64 {
        match self {
            Geometry::Mesh(s) => s.area(),
            Geometry::Sphere(s) => s.area(),
            Geometry::Disk(s) => s.area(),
            Geometry::Cylinder(s) => s.area(),
            Geometry::Deforming(s) => s.area(),
            Geometry::Sdf(_) => 0.0,
        }
    }

    /// Whether the shape is made of triangles.
    pub fn is_mesh(&self) -> bool {
        matches!(self, Geometry::Mesh(_) | Geometry::Deforming(_))
    }

    /// Whether the whole shape lies in a plane, as far as rounded coordinates tell: no part of it sees another.
    pub fn is_flat(&self) -> bool {
        match self {
            Geometry::Disk(_) => true,
            Geometry::Mesh(mesh) => {
                let corners = |i: u32| mesh.triangle(i).map(Vec3::as_dvec3);
                let mut normal = DVec3::ZERO;
                let mut size = 0.0;
                for [a, b, c] in (0..mesh.indices().len() as u32).map(corners) {
                    // The largest triangle's: its own rounding tilts it least.
                    let n = (b - a).cross(c - a);
                    if n.length() > normal.length() {
                        normal = n;
                    }
                    size = f64::max(size, a.abs().max(b.abs()).max(c.abs()).max_element());
                }
                let rounding = 8.0 * f64::from(f32::EPSILON) * size;
                let normal = normal.normalize_or_zero();
                let origin = match mesh.indices().is_empty() {
                    true => DVec3::ZERO,
                    false => corners(0)[0],
                };
                (0..mesh.indices().len() as u32)
                    .flat_map(corners)
                    .all(|p| (p - origin).dot(normal).abs() <= rounding)
            }
            _ => false,
        }
    }

    /// Triangles of a mesh; 1 for any other shape.
    pub fn prim_count(&self) -> u32 {
        match self {
            Geometry::Mesh(s) => s.indices().len() as u32,
            Geometry::Deforming(s) => s.open().indices().len() as u32,
            _ => 1,
        }
    }

    /// Area of triangle `prim` of a mesh, or of the whole of any other shape.
    pub fn prim_area(&self, prim: u32) -> f64 {
        match self {
            Geometry::Mesh(s) => s.triangle_area(prim),
            Geometry::Deforming(s) => s.triangle_area(prim, 0.5),
            _ => self.area(),
        }
    }

    /// Distance of the first meeting in (0, t_max] and the surface parameters to keep for
    /// [`Geometry::hit`]. For meshes always `None`: their triangles belong to the acceleration structure.
    /// The direction of `ray` may have any length.
    #[inline]
    pub fn intersect_analytic(&self, ray: &Ray, t_max: f32) -> Option<(f32, Vec2)> {
        match self {
            Geometry::Mesh(_) | Geometry::Deforming(_) => None,
            Geometry::Sphere(s) => s.intersect(ray, t_max),
            Geometry::Disk(s) => s.intersect(ray, t_max),
            Geometry::Cylinder(s) => s.intersect(ray, t_max),
            Geometry::Sdf(s) => s.intersect(ray, t_max),
        }
    }

    /// All that shading needs at the meeting `raw` of `ray` with this shape. Only with `tangents` does
    /// the frame follow dp/du, which nothing but an anisotropic material can tell.
    #[inline]
    pub fn hit(&self, ray: &Ray, raw: &RawHit, tangents: bool) -> Hit {
        let point = match self {
            Geometry::Mesh(m) => return m.hit(ray, raw, tangents),
            Geometry::Sphere(s) => s.at_hit(ray, raw.t),
            Geometry::Disk(s) => s.at_hit(ray),
            Geometry::Cylinder(s) => s.at_hit(ray, raw.t),
            Geometry::Deforming(s) => return s.hit(ray, raw, tangents),
            Geometry::Sdf(s) => return s.hit(ray, raw),
        };
        Hit {
            p: point.p.as_vec3(),
            p_err: point.p_err,
            ng: point.n,
            frame: Frame::from_tangent(point.n, point.dp_du.as_vec3()),
            uv: point.uv,
            wo: -ray.d,
            time: ray.time,
            shape: raw.shape,
            prim: raw.prim,
            bary: raw.uv,
            place: PlaceId::NONE,
        }
    }

    /// dp/du and dp/dv at a hit on this shape, for bump maps; either is zero where it is undefined.
    pub fn dp_duv(&self, hit: &Hit) -> (Vec3, Vec3) {
        let point = match self {
            Geometry::Mesh(m) => return m.dp_duv(hit.prim),
            Geometry::Sphere(s) => s.at_point(hit.p),
            Geometry::Disk(s) => s.at_point(hit.p),
            Geometry::Cylinder(s) => s.at_point(hit.p),
            Geometry::Deforming(s) => return s.dp_duv(hit.prim, hit.time),
            Geometry::Sdf(_) => return (Vec3::ZERO, Vec3::ZERO),
        };
        (point.dp_du.as_vec3(), point.dp_dv.as_vec3())
    }

    /// Texture coordinates at the point `p` of a shape that is no mesh; zero for one.
    pub fn uv_at(&self, p: Vec3) -> Vec2 {
        match self {
            Geometry::Mesh(_) | Geometry::Deforming(_) | Geometry::Sdf(_) => Vec2::ZERO,
            Geometry::Sphere(s) => s.at_point(p).uv,
            Geometry::Disk(s) => s.at_point(p).uv,
            Geometry::Cylinder(s) => s.at_point(p).uv,
        }
    }

    /// The point with texture coordinates `uv`, both in [0,1], of a shape that is no mesh; zero for one.
    pub fn at_uv(&self, uv: DVec2) -> DVec3 {
        match self {
            Geometry::Mesh(_) | Geometry::Deforming(_) | Geometry::Sdf(_) => DVec3::ZERO,
            Geometry::Sphere(s) => s.at_uv(uv),
            Geometry::Disk(s) => s.at_uv(uv),
            Geometry::Cylinder(s) => s.at_uv(uv),
        }
    }

    /// A point of triangle `prim` (of the whole shape if it is no mesh), uniform over the area.
    /// Of what deforms, in the middle of the shutter.
    pub fn sample_area(&self, prim: u32, u: Vec2) -> SurfaceSample {
        match self {
            Geometry::Mesh(m) => m.surface_sample(prim, warp::triangle(u)),
            Geometry::Sphere(s) => s.sample_area(u),
            Geometry::Disk(s) => s.sample_area(u),
            Geometry::Cylinder(s) => s.sample_area(u),
            Geometry::Deforming(s) => s.surface_sample(prim, warp::triangle(u)),
            Geometry::Sdf(s) => s.no_sample(),
        }
    }
}

/// Density of the uniform distribution over `area`, kept finite for areas that f32 cannot hold.
fn reciprocal_density(area: f64) -> f32 {
    (1.0 / area).min(f32::MAX as f64) as f32
}

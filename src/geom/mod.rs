//! Geometry: rays, the shapes they meet, and what is known about the point of a meeting.
//!
//! Traversal returns little ([`RawHit`]); shading data ([`Hit`]) is computed once, for the hit that won.
//! All coordinates are f32 and relative to the centre of the scene (see `format::compile`).

pub mod accel;
pub mod wide;

use crate::math::{Frame, Vec2, Vec3, fp};

/// A half-line or segment. `d` has unit length, so `t_max` is a distance.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub o: Vec3,
    pub d: Vec3,
    pub t_max: f32,
}

impl Ray {
    pub fn new(o: Vec3, d: Vec3) -> Ray {
        Ray {
            o,
            d,
            t_max: f32::INFINITY,
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
    pub shape: ShapeId,
    pub prim: u32,
}

impl Hit {
    /// A ray that leaves the surface along the unit vector `wi`.
    #[inline]
    pub fn spawn(&self, wi: Vec3) -> Ray {
        Ray::new(fp::offset_origin(self.p, self.p_err, self.ng, wi), wi)
    }

    /// The segment from here to `q`, free of both surfaces it connects.
    #[inline]
    pub fn spawn_to(&self, q: &Endpoint) -> Ray {
        let o = fp::offset_origin(self.p, self.p_err, self.ng, q.p - self.p);
        let to = q.offset_towards(o);
        let d = to - o;
        let len = d.length();
        Ray {
            o,
            d: d / len,
            t_max: fp::connection_t_max(len),
        }
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
    #[inline]
    pub fn offset_towards(&self, o: Vec3) -> Vec3 {
        fp::offset_origin(self.p, self.p_err, self.ng, o - self.p)
    }
}

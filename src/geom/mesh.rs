//! Triangle meshes: what is known at a point of a triangle, and the meshes of simple shapes.
//!
//! The intersection test itself belongs to the acceleration structure; it hands over a triangle and
//! barycentric weights, and everything else about the point is computed here, once, in f64.

use super::{Hit, RawHit, Ray, SurfaceSample};
use crate::math::{Aabb, DVec3, Frame, Transform, Vec2, Vec3, fp};
use std::fmt;

/// Triangles with shared vertices, in world space.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    positions: Vec<Vec3>,
    /// Empty, or one per vertex; need not have unit length.
    normals: Vec<Vec3>,
    /// Empty, or one per vertex.
    uvs: Vec<Vec2>,
    indices: Vec<[u32; 3]>,
    /// Turn geometric and shading normals around.
    flip_normals: bool,
}

/// Why arrays do not make a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum MeshError {
    /// Triangle `triangle` names vertex `index` of `vertices`.
    IndexOutOfRange {
        triangle: usize,
        index: u32,
        vertices: usize,
    },
    /// There are `found` of what there should be one of per vertex.
    WrongCount {
        what: &'static str,
        found: usize,
        vertices: usize,
    },
    /// A position that is infinite or NaN.
    NotFinite { vertex: usize },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MeshError::IndexOutOfRange {
                triangle,
                index,
                vertices,
            } => write!(
                f,
                "triangle {triangle} names vertex {index}, but the mesh has {vertices} vertices"
            ),
            MeshError::WrongCount {
                what,
                found,
                vertices,
            } => write!(f, "{found} {what} for {vertices} vertices"),
            MeshError::NotFinite { vertex } => {
                write!(f, "the position of vertex {vertex} is not a finite number")
            }
        }
    }
}

impl std::error::Error for MeshError {}

impl Mesh {
    /// Checks that every index and every position can be used. `normals` and `uvs` are empty or have
    /// one entry per vertex.
    pub fn new(
        positions: Vec<Vec3>,
        normals: Vec<Vec3>,
        uvs: Vec<Vec2>,
        indices: Vec<[u32; 3]>,
        flip_normals: bool,
    ) -> Result<Mesh, MeshError> {
        let vertices = positions.len();
        for (what, found) in [
            ("normals", normals.len()),
            ("texture coordinates", uvs.len()),
        ] {
            if found != 0 && found != vertices {
                return Err(MeshError::WrongCount {
                    what,
                    found,
                    vertices,
                });
            }
        }
        if let Some(vertex) = positions.iter().position(|p| !p.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        for (triangle, tri) in indices.iter().enumerate() {
            if let Some(&index) = tri.iter().find(|&&i| i as usize >= vertices) {
                return Err(MeshError::IndexOutOfRange {
                    triangle,
                    index,
                    vertices,
                });
            }
        }
        Ok(Mesh {
            positions,
            normals,
            uvs,
            indices,
            flip_normals,
        })
    }

    /// Memory that the arrays take.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + size_of_val(&self.uvs[..])
            + size_of_val(&self.indices[..])
    }

    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Vertex normals as given, before `flip_normals`; empty when the mesh is shaded flat.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    pub fn uvs(&self) -> &[Vec2] {
        &self.uvs
    }

    pub fn indices(&self) -> &[[u32; 3]] {
        &self.indices
    }

    pub fn flip_normals(&self) -> bool {
        self.flip_normals
    }

    /// Replaces the vertex normals by the angle-weighted mean of the normals of the faces around each
    /// vertex (Thürmer & Wüthrich 1998), which is what Mitsuba gives an OBJ or PLY file that brings no
    /// normals, unless `face_normals` is set. Vertices of no or only degenerate faces get zero and are
    /// shaded flat.
    pub fn compute_vertex_normals(&mut self) {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for tri in &self.indices {
            let p = tri.map(|i| self.positions[i as usize].as_dvec3());
            let Some(n) = (p[1] - p[0]).cross(p[2] - p[0]).try_normalize() else {
                continue;
            };
            for k in 0..3 {
                let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                sums[tri[k] as usize] += n * a.cross(b).length().atan2(a.dot(b));
            }
        }
        self.normals = sums
            .iter()
            .map(|s| s.normalize_or_zero().as_vec3())
            .collect();
    }

    pub fn bounds(&self) -> Aabb {
        let mut b = Aabb::EMPTY;
        for &p in &self.positions {
            b.grow(p);
        }
        b
    }

    /// The three corners of triangle `prim`.
    #[inline]
    pub fn triangle(&self, prim: u32) -> [Vec3; 3] {
        self.indices[prim as usize].map(|i| self.positions[i as usize])
    }

    /// Area of triangle `prim`, from f64 edges: right also for edges of 1e-9 beside coordinates of 1.
    pub fn triangle_area(&self, prim: u32) -> f64 {
        0.5 * self.scaled_normal(prim).length()
    }

    pub fn area(&self) -> f64 {
        (0..self.indices.len() as u32)
            .map(|i| self.triangle_area(i))
            .sum()
    }

    /// Unit normal of triangle `prim` by its winding, turned by `flip_normals`; +z when degenerate.
    #[inline]
    pub fn face_normal(&self, prim: u32) -> Vec3 {
        let [p0, p1, p2] = self.triangle(prim);
        let n = self.unit_normal(p1 - p0, p2 - p0, prim);
        if self.flip_normals { -n } else { n }
    }

    /// The direction of `e1` x `e2`, the edges of triangle `prim`.
    #[inline]
    fn unit_normal(&self, e1: Vec3, e2: Vec3, prim: u32) -> Vec3 {
        let n = e1.cross(e2);
        let (len2, edges2) = (
            n.length_squared(),
            e1.length_squared() * e2.length_squared(),
        );
        // In f32 the direction errs by about the rounding over the sine of the angle between the edges,
        // and squares of areas leave the range early.
        if len2 > 1e-4 * edges2 && len2 > 1e-30 && len2 < 1e30 {
            n / len2.sqrt()
        } else {
            self.scaled_normal(prim).normalize_or(DVec3::Z).as_vec3()
        }
    }

    /// Normal times twice the area.
    #[cold]
    fn scaled_normal(&self, prim: u32) -> DVec3 {
        let [p0, p1, p2] = self.triangle(prim).map(|p| p.as_dvec3());
        (p1 - p0).cross(p2 - p0)
    }

    /// Interpolated normal at weights `(b1, b2)`, turned by `flip_normals`; `ng` where there is none.
    #[inline]
    pub fn shading_normal(&self, prim: u32, b: Vec2, ng: Vec3) -> Vec3 {
        if self.normals.is_empty() {
            return ng;
        }
        let n = self.interpolate(prim, b, |i| self.normals[i]);
        match n.try_normalize() {
            Some(n) if self.flip_normals => -n,
            Some(n) => n,
            None => ng,
        }
    }

    #[inline]
    fn interpolate<T>(&self, prim: u32, b: Vec2, at: impl Fn(usize) -> T) -> T
    where
        T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        let [i0, i1, i2] = self.indices[prim as usize].map(|i| i as usize);
        at(i0) * (1.0 - b.x - b.y) + at(i1) * b.x + at(i2) * b.y
    }

    /// Texture coordinates at weights `(b1, b2)`: interpolated, or the weights themselves without any.
    #[inline]
    pub(super) fn uv(&self, prim: u32, b: Vec2) -> Vec2 {
        if self.uvs.is_empty() {
            b
        } else {
            self.interpolate(prim, b, |i| self.uvs[i])
        }
    }

    /// Position and its error bound from a corner, the edges from it and the weights `(b1, b2)`.
    ///
    /// The sum takes four roundings of numbers no larger than corner plus edges, its use as an origin a
    /// fifth; errors of the weights
    /// move the point within the plane, which does no harm. The bound also covers [`fp::PLANE_ERROR`]: a
    /// ray that starts on a large triangle must not meet it again, even where a coordinate of the whole
    /// triangle, and with it the rounding, is zero.
    #[inline]
    fn point(p0: Vec3, e1: Vec3, e2: Vec3, b: Vec2) -> (Vec3, Vec3) {
        let at = p0 + (e1 * b.x + e2 * b.y);
        let extent = e1.abs().max(e2.abs());
        let p_err = (p0.abs() + extent) * fp::gamma(5) + extent.max_element() * fp::PLANE_ERROR;
        (at, p_err)
    }

    /// dp/du and dp/dv of triangle `prim`: constant over it. Without texture coordinates the two edges
    /// from the first corner; zero where the texture coordinates are degenerate.
    #[inline]
    pub fn dp_duv(&self, prim: u32) -> (Vec3, Vec3) {
        let [p0, p1, p2] = self.triangle(prim);
        self.dp_duv_of(prim, p1 - p0, p2 - p0)
    }

    /// The same for a triangle whose edges from the first corner are `e1` and `e2`.
    #[inline]
    pub(super) fn dp_duv_of(&self, prim: u32, e1: Vec3, e2: Vec3) -> (Vec3, Vec3) {
        if self.uvs.is_empty() {
            return (e1, e2);
        }
        let [t0, t1, t2] = self.indices[prim as usize].map(|i| self.uvs[i as usize]);
        let (d1, d2) = (t1 - t0, t2 - t0);
        let det = d1.x * d2.y - d1.y * d2.x;
        let inverse = 1.0 / det;
        if det == 0.0 || !inverse.is_finite() {
            return (Vec3::ZERO, Vec3::ZERO);
        }
        (
            (e1 * d2.y - e2 * d1.y) * inverse,
            (e2 * d1.x - e1 * d2.x) * inverse,
        )
    }

    #[inline]
    pub(super) fn hit(&self, ray: &Ray, raw: &RawHit, tangents: bool) -> Hit {
        let [p0, p1, p2] = self.triangle(raw.prim);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let (p, p_err) = Mesh::point(p0, e1, e2, raw.uv);
        let n = self.unit_normal(e1, e2, raw.prim);
        let ng = if self.flip_normals { -n } else { n };
        let ns = self.shading_normal(raw.prim, raw.uv, ng);
        let frame = if tangents {
            Frame::from_tangent(ns, self.dp_duv(raw.prim).0)
        } else {
            Frame::from_normal(ns)
        };
        Hit {
            p,
            p_err,
            ng,
            frame,
            uv: self.uv(raw.prim, raw.uv),
            wo: -ray.d,
            time: ray.time,
            shape: raw.shape,
            prim: raw.prim,
            bary: raw.uv,
            place: super::PlaceId::NONE,
        }
    }

    /// The surface at weights `(b1, b2)` of triangle `prim`, drawn with density 1/area per m².
    pub(crate) fn surface_sample(&self, prim: u32, b: Vec2) -> SurfaceSample {
        let [p0, p1, p2] = self.triangle(prim);
        let (p, p_err) = Mesh::point(p0, p1 - p0, p2 - p0, b);
        let ng = self.face_normal(prim);
        SurfaceSample {
            p,
            p_err,
            ng,
            ns: self.shading_normal(prim, b, ng),
            uv: self.uv(prim, b),
            pdf_a: super::reciprocal_density(self.triangle_area(prim)),
        }
    }

    /// Mitsuba's `rectangle`: [-1,1]² at z = 0 facing +z, uv over [0,1]².
    pub fn rectangle(to_world: &Transform, flip_normals: bool) -> Mesh {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        Mesh::from_quads(
            to_world,
            flip_normals,
            &[(DVec3::Z, corners.map(|(x, y)| DVec3::new(x, y, 0.0)))],
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)],
        )
    }

    /// Mitsuba's `cube`: [-1,1]³ facing outwards, each face with uv over [0,1]².
    pub fn cube(to_world: &Transform, flip_normals: bool) -> Mesh {
        // Per face: the outward normal and the corner of uv (0, 1), then those of (1, 1), (1, 0).
        // The fourth completes the square. Orientation of the texture as measured in Mitsuba 3.9.
        const FACES: [[[i8; 3]; 4]; 6] = [
            [[0, -1, 0], [1, -1, -1], [1, -1, 1], [-1, -1, 1]],
            [[0, 1, 0], [1, 1, -1], [-1, 1, -1], [-1, 1, 1]],
            [[1, 0, 0], [1, -1, -1], [1, 1, -1], [1, 1, 1]],
            [[0, 0, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
            [[-1, 0, 0], [-1, -1, 1], [-1, 1, 1], [-1, 1, -1]],
            [[0, 0, -1], [1, 1, -1], [1, -1, -1], [-1, -1, -1]],
        ];
        let faces = FACES.map(|face| {
            let [n, a, b, c] = face.map(|v| DVec3::from(v.map(f64::from)));
            (n, [a, b, c, a + c - b])
        });
        Mesh::from_quads(
            to_world,
            flip_normals,
            &faces,
            [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)],
        )
    }

    /// Two triangles per quad. Under a mirroring transform the winding turns the geometric normal
    /// around while the shading normal goes with the transform, as in Mitsuba; only then are vertex
    /// normals stored, since otherwise both are the same.
    fn from_quads(
        to_world: &Transform,
        flip_normals: bool,
        quads: &[(DVec3, [DVec3; 4])],
        uvs: [(f32, f32); 4],
    ) -> Mesh {
        let mut mesh = Mesh {
            flip_normals,
            ..Mesh::default()
        };
        for (n, corners) in quads {
            let first = mesh.positions.len() as u32;
            mesh.indices.push([first, first + 1, first + 2]);
            mesh.indices.push([first, first + 2, first + 3]);
            mesh.uvs.extend(uvs.map(|(u, v)| Vec2::new(u, v)));
            mesh.positions
                .extend(corners.map(|c| to_world.point(c).as_vec3()));
            if to_world.swaps_handedness() {
                let n = to_world.normal(*n).normalize_or(DVec3::Z).as_vec3();
                mesh.normals.extend([n; 4]);
            }
        }
        mesh
    }
}

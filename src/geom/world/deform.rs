//! Meshes whose vertices move on straight lines while the shutter is open.
//!
//! Each triangle is a box of its own for each stretch of time. The intersection test is that of
//! `wide` (Woop, Benthin & Wald 2013) in double precision: two triangles that share an edge compute the
//! same positions of its ends and, up to the sign, the same edge function, so no ray slips between them.

use super::split::{self, Piece};
use super::{Stretch, What};
use crate::geom::wide::binary::half_area;
use crate::geom::{Hit, Mesh, RawHit, Ray, ShapeId, SurfaceSample};
use crate::math::{Aabb, DVec3, Frame, Vec2, Vec3, fp};
use std::fmt;

/// A mesh as it is when the shutter opens, and where its vertices are when it closes.
#[derive(Clone, Debug)]
pub struct Deforming {
    open: Mesh,
    positions: Vec<Vec3>,
    /// As many as the mesh has: none, or one per vertex.
    normals: Vec<Vec3>,
}

/// Why two meshes are not one that deforms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeformError {
    /// Numbers of vertices.
    Vertices { open: usize, close: usize },
    /// Numbers of triangles.
    Triangles { open: usize, close: usize },
    /// Triangle `triangle`, counted from 0, has other corners.
    Corners { triangle: usize },
    /// One has normals and the other has none.
    Normals,
}

impl fmt::Display for DeformError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DeformError::Vertices { open, close } => {
                write!(f, "it has {close} vertices where the mesh has {open}")
            }
            DeformError::Triangles { open, close } => {
                write!(f, "it has {close} triangles where the mesh has {open}")
            }
            DeformError::Corners { triangle } => write!(
                f,
                "its triangle {triangle} has other corners than that of the mesh"
            ),
            DeformError::Normals => {
                write!(f, "only one of it and the mesh has vertex normals")
            }
        }
    }
}

impl std::error::Error for DeformError {}

/// A triangle at one time.
struct Snapshot {
    corners: [DVec3; 3],
}

impl Deforming {
    /// From the mesh at the opening and at the closing of the shutter. Texture coordinates and the side of
    /// the normals are those of `open`.
    pub fn new(open: Mesh, close: Mesh) -> Result<Deforming, DeformError> {
        let (vertices, triangles) = (open.positions().len(), open.indices().len());
        if close.positions().len() != vertices {
            let close = close.positions().len();
            return Err(DeformError::Vertices {
                open: vertices,
                close,
            });
        }
        if close.indices().len() != triangles {
            let close = close.indices().len();
            return Err(DeformError::Triangles {
                open: triangles,
                close,
            });
        }
        let mut corners = open.indices().iter().zip(close.indices());
        if let Some(triangle) = corners.position(|(a, b)| a != b) {
            return Err(DeformError::Corners { triangle });
        }
        if open.normals().len() != close.normals().len() {
            return Err(DeformError::Normals);
        }
        Ok(Deforming {
            positions: close.positions().to_vec(),
            normals: close.normals().to_vec(),
            open,
        })
    }

    /// The mesh when the shutter opens.
    pub fn open(&self) -> &Mesh {
        &self.open
    }

    /// Whether nothing changes: the mesh is the same at all times.
    pub fn is_still(&self) -> bool {
        self.open.positions() == self.positions && self.open.normals() == self.normals
    }

    /// Memory that the arrays take.
    pub fn bytes(&self) -> usize {
        self.open.bytes() + size_of_val(&self.positions[..]) + size_of_val(&self.normals[..])
    }

    /// The box over the whole shutter.
    pub fn bounds(&self) -> Aabb {
        let mut bounds = self.open.bounds();
        for &p in &self.positions {
            bounds.grow(p);
        }
        bounds
    }

    fn at(&self, prim: u32, time: f32) -> Snapshot {
        let time = f64::from(time);
        Snapshot {
            corners: self.open.indices()[prim as usize].map(|i| {
                let (a, b) = (
                    self.open.positions()[i as usize],
                    self.positions[i as usize],
                );
                a.as_dvec3().lerp(b.as_dvec3(), time)
            }),
        }
    }

    /// Area of triangle `prim` at a time.
    pub fn triangle_area(&self, prim: u32, time: f32) -> f64 {
        0.5 * self.at(prim, time).scaled_normal().length()
    }

    /// Area in the middle of the shutter.
    pub fn area(&self) -> f64 {
        let count = self.open.indices().len() as u32;
        (0..count).map(|prim| self.triangle_area(prim, 0.5)).sum()
    }

    /// Box of a triangle during `[t0, t1]`: that of its corners at both ends, between which they move
    /// straight on.
    fn triangle_bounds(&self, prim: u32, (t0, t1): (f32, f32)) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for p in [t0, t1].iter().flat_map(|&t| self.at(prim, t).corners) {
            bounds.grow(p.as_vec3().map(f32::next_down));
            bounds.grow(p.as_vec3().map(f32::next_up));
        }
        bounds
    }

    /// What the tree is built over.
    pub(super) fn boxes(&self, shape: ShapeId) -> Vec<(Stretch, Aabb)> {
        let count = self.open.indices().len() as u32;
        let pieces = |prim: u32, n: u32| -> Vec<Piece> {
            let piece = |i| split::piece(self.triangle_bounds(prim, split::part(i, n)), i, n);
            (0..n).map(piece).collect()
        };
        (0..count)
            .flat_map(|prim| {
                let area = |p: Piece| f64::from(half_area(&p.bounds));
                let n = split::parts(|n| pieces(prim, n).into_iter().map(area).sum());
                let what = What::Triangle { shape, prim };
                pieces(prim, n).into_iter().map(move |p| p.stretch(what))
            })
            .collect()
    }

    /// Distance, `0 < t <= ray.t_max`, of the meeting with triangle `prim` at the time of the ray, and the
    /// weights of its second and third corner.
    pub(super) fn intersect(&self, prim: u32, ray: &Ray) -> Option<(f32, Vec2)> {
        let d = ray.d.as_dvec3();
        let z = d.abs().max_position();
        let (x, y) = [(1, 2), (2, 0), (0, 1)][z];
        let (sx, sy, sz) = (d[x] / d[z], d[y] / d[z], 1.0 / d[z]);
        let o = ray.o.as_dvec3();
        let [a, b, c] = self.at(prim, ray.time).corners.map(|p| {
            let p = p - o;
            [p[x] - sx * p[z], p[y] - sy * p[z], p[z]]
        });
        let edge = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
        let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        let det = u + v + w;
        let mixed = u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0;
        if mixed || det == 0.0 {
            return None;
        }
        let t = (sz * (u * a[2] + v * b[2] + w * c[2]) / det) as f32;
        let uv = Vec2::new((v / det) as f32, (w / det) as f32);
        // In this form a NaN is no meeting.
        (t > 0.0 && t <= ray.t_max).then_some((t, uv))
    }

    /// Shading normal of triangle `prim` at weights `b` and a time; `ng` where the mesh has none.
    fn shading_normal(&self, prim: u32, b: Vec2, time: f32, ng: Vec3) -> Vec3 {
        if self.normals.is_empty() {
            return ng;
        }
        let [n0, n1, n2] = self.open.indices()[prim as usize]
            .map(|i| self.open.normals()[i as usize].lerp(self.normals[i as usize], time));
        let n = n0 * (1.0 - b.x - b.y) + n1 * b.x + n2 * b.y;
        match n.try_normalize() {
            Some(n) if self.open.flip_normals() => -n,
            Some(n) => n,
            None => ng,
        }
    }

    /// As [`Geometry::hit`](crate::geom::Geometry::hit).
    pub(in crate::geom) fn hit(&self, ray: &Ray, raw: &RawHit, tangents: bool) -> Hit {
        let at = self.at(raw.prim, ray.time);
        let (p, p_err) = at.point(raw.uv);
        let ng = at.normal(self.open.flip_normals());
        let ns = self.shading_normal(raw.prim, raw.uv, ray.time, ng);
        let frame = match tangents {
            true => Frame::from_tangent(ns, self.derivatives(raw.prim, &at).0),
            false => Frame::from_normal(ns),
        };
        Hit {
            p,
            p_err,
            ng,
            frame,
            uv: self.open.uv(raw.prim, raw.uv),
            wo: -ray.d,
            time: ray.time,
            shape: raw.shape,
            prim: raw.prim,
            bary: raw.uv,
            place: super::PlaceId::NONE,
        }
    }

    fn derivatives(&self, prim: u32, at: &Snapshot) -> (Vec3, Vec3) {
        let [p0, p1, p2] = at.corners;
        self.open
            .dp_duv_of(prim, (p1 - p0).as_vec3(), (p2 - p0).as_vec3())
    }

    /// dp/du and dp/dv of triangle `prim` at a time.
    pub fn dp_duv(&self, prim: u32, time: f32) -> (Vec3, Vec3) {
        self.derivatives(prim, &self.at(prim, time))
    }

    /// The surface at weights `b` of triangle `prim` in the middle of the shutter.
    pub(in crate::geom) fn surface_sample(&self, prim: u32, b: Vec2) -> SurfaceSample {
        let at = self.at(prim, 0.5);
        let (p, p_err) = at.point(b);
        let ng = at.normal(self.open.flip_normals());
        SurfaceSample {
            p,
            p_err,
            ng,
            ns: self.shading_normal(prim, b, 0.5, ng),
            uv: self.open.uv(prim, b),
            pdf_a: crate::geom::reciprocal_density(0.5 * at.scaled_normal().length()),
        }
    }
}

impl Snapshot {
    fn scaled_normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    fn normal(&self, flip: bool) -> Vec3 {
        let n = self.scaled_normal().normalize_or(DVec3::Z).as_vec3();
        if flip { -n } else { n }
    }

    /// The point at weights `b`, and its error: the rounding of the result, and once more where it serves
    /// as an origin. Errors of the weights move it within the plane.
    fn point(&self, b: Vec2) -> (Vec3, Vec3) {
        let [p0, p1, p2] = self.corners;
        let p = p0 + (p1 - p0) * f64::from(b.x) + (p2 - p0) * f64::from(b.y);
        let reach = p0.abs().max(p1.abs()).max(p2.abs()).max_element();
        let (p, f64_error) = (p.as_vec3(), (reach * 32.0 * f64::EPSILON) as f32);
        (p, p.abs() * fp::gamma(3) + f64_error)
    }
}

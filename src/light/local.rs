//! Emitting surfaces as seen from a point: what is sampled as one part, how, and with what density.
//!
//! The methods sample the solid angle that a part covers where that is closed-form (sphere, rectangle,
//! triangle) and the part is near enough for it to matter, its area otherwise. Density and sample make
//! that choice from the same numbers, so they always agree.

use super::rectangle::Rectangle;
use crate::geom::{Disk, Endpoint, Geometry, ShapeId, Sphere, SurfaceSample};
use crate::math::warp::{self, SphericalTriangle};
use crate::math::{Aabb, DVec3, Frame, Vec2, Vec3};

/// A part of an emitting surface that is sampled as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Part {
    Triangle {
        shape: ShapeId,
        prim: u32,
    },
    /// Triangles `prim` and `prim + 1` of a mesh, which make up a rectangle.
    Rectangle {
        shape: ShapeId,
        prim: u32,
        rectangle: Rectangle,
    },
    /// A sphere, disk or cylinder.
    Whole {
        shape: ShapeId,
    },
}

/// A shining point of a part, chosen for a receiver.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Towards {
    pub end: Endpoint,
    /// Unit direction from the receiver.
    pub wi: Vec3,
    pub dist: f32,
    /// Per steradian at the receiver; positive and finite.
    pub pdf: f32,
}

/// Parts whose extent is below a tenth of their distance are sampled by area: their solid angle density
/// then varies by about that much over the part, which costs less variance than the better map costs time.
const FAR2: f32 = 0.01;

/// Density per steradian at a receiver of a density `pdf_a` per area, for a point at `d` from it with
/// unit normal `ng`. In f64: squares of distances leave the range of f32 early.
pub(crate) fn pdf_a_to_sr(pdf_a: f32, d: Vec3, ng: Vec3) -> f32 {
    let d = d.as_dvec3();
    let d2 = d.length_squared();
    let cos = d.dot(ng.as_dvec3()).abs() / d2.sqrt();
    bounded(pdf_a as f64 * d2 / cos)
}

/// Kept within the positive f32 range. Zero distance gives zero, an edge-on view the largest number.
pub(super) fn bounded(pdf: f64) -> f32 {
    if pdf > 0.0 {
        pdf.clamp(f32::MIN_POSITIVE as f64, f32::MAX as f64) as f32
    } else {
        0.0
    }
}

/// The parts of shape `shape`.
pub(crate) fn parts_of(shape: ShapeId, geometry: &Geometry) -> Vec<Part> {
    let mesh = match geometry {
        Geometry::Mesh(mesh) => mesh,
        // What changes its form is met, but not aimed at.
        Geometry::Deforming(_) => return vec![],
        _ => return vec![Part::Whole { shape }],
    };
    let count = mesh.indices().len() as u32;
    let mut parts = Vec::new();
    let mut prim = 0;
    while prim < count {
        if let Some(rectangle) = Rectangle::of_mesh(mesh, prim) {
            parts.push(Part::Rectangle {
                shape,
                prim,
                rectangle,
            });
            prim += 2;
        } else {
            parts.push(Part::Triangle { shape, prim });
            prim += 1;
        }
    }
    parts
}

fn seen_triangle([a, b, c]: [Vec3; 3], eye: Vec3) -> Option<SphericalTriangle> {
    let d = (a + b + c) / 3.0 - eye;
    let extent2 = (b - a)
        .length_squared()
        .max((c - a).length_squared())
        .max((c - b).length_squared());
    (extent2 > FAR2 * d.length_squared())
        .then(|| SphericalTriangle::new(a, b, c, eye))
        .flatten()
}

impl Part {
    pub fn shape(&self) -> ShapeId {
        match *self {
            Part::Triangle { shape, .. }
            | Part::Rectangle { shape, .. }
            | Part::Whole { shape } => shape,
        }
    }

    /// The primitives that it covers.
    pub fn prims(&self) -> std::ops::Range<u32> {
        match *self {
            Part::Triangle { prim, .. } => prim..prim + 1,
            Part::Rectangle { prim, .. } => prim..prim + 2,
            Part::Whole { .. } => 0..1,
        }
    }

    pub fn area(&self, g: &Geometry) -> f64 {
        self.prims().map(|i| g.prim_area(i)).sum()
    }

    /// A point to connect to from `eye`. `None` when the part cannot be seen from there at this point.
    #[inline]
    pub fn sample(&self, g: &Geometry, eye: Vec3, u: Vec2) -> Option<Towards> {
        match (*self, g) {
            (Part::Triangle { prim, .. }, Geometry::Mesh(m)) => {
                match seen_triangle(m.triangle(prim), eye) {
                    Some(seen) => connect(m.surface_sample(prim, seen.sample(u)), eye, |_, d| {
                        seen.pdf(d)
                    }),
                    None => connect(m.surface_sample(prim, warp::triangle(u)), eye, by_area),
                }
            }
            (Part::Rectangle { rectangle, .. }, _) => {
                let s = rectangle.sample(eye, u)?;
                Some(Towards {
                    end: Endpoint {
                        p: s.p,
                        p_err: rectangle.p_err,
                        ng: rectangle.ng,
                    },
                    wi: s.wi,
                    dist: s.dist,
                    pdf: s.pdf,
                })
            }
            (Part::Whole { .. }, Geometry::Sphere(s)) => sample_sphere(s, eye, u),
            _ => connect(g.sample_area(0, u), eye, by_area),
        }
    }

    /// Density per steradian at `eye` with which [`Part::sample`] returns the point `p` with normal `ng`.
    pub fn pdf(&self, g: &Geometry, eye: Vec3, p: Vec3, ng: Vec3) -> f32 {
        let d = p - eye;
        let by_area = |area: f64| pdf_a_to_sr(bounded(1.0 / area), d, ng);
        match (*self, g) {
            (Part::Triangle { prim, .. }, Geometry::Mesh(m)) => {
                match seen_triangle(m.triangle(prim), eye) {
                    Some(seen) => bounded(seen.pdf(d) as f64),
                    None => by_area(m.triangle_area(prim)),
                }
            }
            (Part::Rectangle { rectangle, .. }, _) => rectangle.pdf(eye, p),
            (Part::Whole { .. }, Geometry::Sphere(s)) => match sphere_view(s, eye) {
                SphereView::Outside { height, .. } => bounded(cone_pdf(height)),
                SphereView::Inside => UNIFORM_SPHERE as f32,
                SphereView::Dark => 0.0,
            },
            _ => by_area(g.area()),
        }
    }

    /// Whether [`Part::sample`] is uniform over the area for a receiver at `eye`.
    pub fn is_by_area(&self, g: &Geometry, eye: Vec3) -> bool {
        match (*self, g) {
            (Part::Triangle { prim, .. }, Geometry::Mesh(m)) => {
                seen_triangle(m.triangle(prim), eye).is_none()
            }
            (Part::Rectangle { rectangle, .. }, _) => rectangle.is_by_area(eye),
            (Part::Whole { .. }, Geometry::Sphere(_)) => false,
            _ => true,
        }
    }

    /// Box, axis and cosine of the spread of the shading normals, for the light tree.
    pub fn bounds(&self, g: &Geometry) -> (Aabb, Vec3, f32) {
        match g {
            Geometry::Mesh(m) => {
                let mut bounds = Aabb::EMPTY;
                let mut normals = Vec::with_capacity(6);
                for prim in self.prims() {
                    let ng = m.face_normal(prim);
                    for (k, p) in m.triangle(prim).into_iter().enumerate() {
                        bounds.grow(p);
                        let b = [Vec2::ZERO, Vec2::X, Vec2::Y][k];
                        normals.push(m.shading_normal(prim, b, ng));
                    }
                }
                let sum: Vec3 = normals.iter().sum();
                let axis = sum.normalize_or(Vec3::Z);
                let spread = normals.iter().fold(1f32, |c, n| c.min(n.dot(axis)));
                // Interpolated normals lie in the cone as long as it is convex.
                (bounds, axis, if spread > 0.0 { spread } else { -1.0 })
            }
            Geometry::Disk(s) => (s.bounds(), Disk::normal(s), 1.0),
            _ => (g.bounds(), Vec3::Z, -1.0),
        }
    }
}

pub(super) fn by_area(at: &SurfaceSample, d: Vec3) -> f32 {
    pdf_a_to_sr(at.pdf_a, d, at.ng)
}

pub(super) fn end_of(at: &SurfaceSample) -> Endpoint {
    Endpoint {
        p: at.p,
        p_err: at.p_err,
        ng: at.ng,
    }
}

/// The connection from `eye` to a sampled point. `None` where the density is not an ordinary number:
/// seen edge on, where nothing is emitted, or at no distance.
pub(super) fn connect(
    at: SurfaceSample,
    eye: Vec3,
    pdf: impl Fn(&SurfaceSample, Vec3) -> f32,
) -> Option<Towards> {
    let d = at.p - eye;
    let wi = d.as_dvec3().try_normalize()?.as_vec3();
    let pdf = pdf(&at, d);
    let shines = at.ns.dot(wi) < 0.0;
    (shines && pdf > 0.0 && pdf < f32::MAX).then(|| Towards {
        end: end_of(&at),
        wi,
        dist: d.as_dvec3().length() as f32,
        pdf,
    })
}

/// Density of directions uniform over the sphere.
const UNIFORM_SPHERE: f64 = 0.25 * std::f64::consts::FRAC_1_PI;

enum SphereView {
    /// `to_center` leads from the eye to the centre; `height` is that of the cap of directions that
    /// meet the sphere, 1 - cos of the half-angle, and `sin2_max` the squared sine.
    Outside {
        to_center: DVec3,
        height: f64,
        sin2_max: f64,
    },
    Inside,
    /// The emitting side cannot be seen.
    Dark,
}

/// A sphere that shines outwards is seen from outside only; one that shines inwards lights what is in it.
fn sphere_view(s: &Sphere, eye: Vec3) -> SphereView {
    let to_center = s.center() - eye.as_dvec3();
    let (d2, r2) = (to_center.length_squared(), s.radius() * s.radius());
    if s.inward() {
        // Points on the sphere itself, which shine at each other, may lie outside by their rounding.
        let bound = s.radius() + eye.abs().max_element() as f64 * 1e-6;
        return if d2 <= bound * bound {
            SphereView::Inside
        } else {
            SphereView::Dark
        };
    }
    let sin2_max = r2 / d2;
    if sin2_max < 1.0 {
        SphereView::Outside {
            to_center,
            height: sin2_max / (1.0 + (1.0 - sin2_max).sqrt()),
            sin2_max,
        }
    } else {
        SphereView::Dark
    }
}

fn cone_pdf(height: f64) -> f64 {
    1.0 / (std::f64::consts::TAU * height)
}

/// From outside uniform over the cone of directions that meet the sphere (Shirley, Wang & Zimmerman
/// 1996; the angle at the centre as in Pharr, Jakob & Humphreys, section 6.2.4), from inside uniform over
/// all directions, whose density is bounded where that of area sampling is not.
fn sample_sphere(s: &Sphere, eye: Vec3, u: Vec2) -> Option<Towards> {
    let (normal, wi, pdf) = match sphere_view(s, eye) {
        SphereView::Dark => return None,
        SphereView::Outside {
            to_center,
            height,
            sin2_max,
        } => {
            let axis = to_center.normalize();
            let disk = warp::concentric_disk(u).as_dvec2();
            let q = disk.length_squared().min(1.0);
            let h = q * height;
            let (cos, sin2) = (1.0 - h, h * (2.0 - h));
            let sin = sin2.sqrt();
            let side = disk.normalize_or_zero();
            // Angle at the surface by the law of sines, at the centre as what remains.
            let sin_s = (sin2 / sin2_max).min(1.0).sqrt();
            let cos_s = (1.0 - sin_s * sin_s).max(0.0).sqrt();
            let (sin_c, cos_c) = (sin_s * cos - cos_s * sin, cos_s * cos + sin_s * sin);
            let frame = Frame::from_normal(axis.as_vec3());
            let across = frame.s.as_dvec3() * side.x + frame.t.as_dvec3() * side.y;
            // The f32 frame is orthogonal to the axis to its own precision only.
            let across = (across - axis * across.dot(axis)).normalize_or_zero();
            (
                across * sin_c - axis * cos_c,
                axis * cos + across * sin,
                cone_pdf(height),
            )
        }
        SphereView::Inside => {
            let wi = warp::uniform_sphere(u).as_dvec3();
            let o = (eye.as_dvec3() - s.center()) / s.radius();
            let b = o.dot(wi);
            let root = (b * b + (1.0 - o.length_squared())).max(0.0).sqrt();
            (o + wi * (root - b), wi, UNIFORM_SPHERE)
        }
    };
    let at = s.surface_sample(normal);
    let dist = (at.p - eye).as_dvec3().length() as f32;
    let (wi, pdf) = (wi.as_vec3(), bounded(pdf));
    let shines = at.ns.dot(wi) < 0.0;
    (shines && dist > 0.0 && pdf < f32::MAX).then(|| Towards {
        end: end_of(&at),
        wi,
        dist,
        pdf,
    })
}

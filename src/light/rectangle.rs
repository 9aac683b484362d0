//! Rectangles that shine: the commonest lamp, so everything about one is worked out beforehand and the
//! sampling is in f32.

use crate::geom::Mesh;
use crate::math::{Vec2, Vec3, fp};

/// A rectangle `corner + s width x + t height y`, s and t in [0,1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    corner: Vec3,
    /// Unit vectors along the edges, and their lengths.
    x: Vec3,
    y: Vec3,
    width: f32,
    height: f32,
    /// Geometric normal, as of the mesh.
    pub ng: Vec3,
    /// Whether the side of `ng` shines (else the other one).
    front: bool,
    /// Bound on the error of a point.
    pub p_err: Vec3,
}

/// A point of the rectangle, chosen for a receiver.
#[derive(Clone, Copy, Debug)]
pub struct RectangleSample {
    pub p: Vec3,
    /// Unit direction from the receiver.
    pub wi: Vec3,
    pub dist: f32,
    /// Per steradian at the receiver; positive and finite.
    pub pdf: f32,
}

/// Rectangles whose squared diagonal is below this share of their squared distance are sampled by area:
/// their density per steradian then varies so little over them that the better map does not pay.
const FAR2: f32 = 0.5;

/// Solid angles below this are sampled by area: f32 no longer resolves places in them.
const TINY: f32 = 1e-3;

/// The rectangle as seen from a receiver, lengths in units of its distance (Ureña, Fajardo & King 2013,
/// "An area-preserving parametrization for spherical rectangles"; names of the paper).
struct Seen {
    x0: f32,
    x1: f32,
    y0: f32,
    y1: f32,
    /// Distance of the plane, > 0.
    z: f32,
    solid_angle: f32,
}

impl Rectangle {
    /// The rectangle that triangles `prim` and `prim + 1` of `mesh` make up, if they do, to a few
    /// roundings of its corners, and if it shines to the side of its geometric normal or of the other,
    /// but nothing between.
    pub fn of_mesh(mesh: &Mesh, prim: u32) -> Option<Rectangle> {
        if prim as usize + 1 >= mesh.indices().len() {
            return None;
        }
        let (a, b) = (mesh.triangle(prim), mesh.triangle(prim + 1));
        let at = |t: &[Vec3; 3], k: usize| t[k % 3].as_dvec3();
        let corner = |i: usize| {
            (
                at(&a, i),
                at(&a, i + 1) - at(&a, i),
                at(&a, i + 2) - at(&a, i),
            )
        };
        let (q, ex, ey) = (0..9).map(|i| (i / 3, i % 3)).find_map(|(i, j)| {
            let (q, ex, ey) = corner(i);
            let (lx, ly) = (ex.length(), ey.length());
            // A few roundings of the corners' coordinates, which may be much larger than the edges.
            let tolerance = f64::from(fp::gamma(8)) * (q.abs().max_element() + lx + ly);
            let right = ex.dot(ey).abs() <= tolerance * (lx + ly) && tolerance < 1e-4 * lx.min(ly);
            let same = |p: glam::DVec3, q: glam::DVec3| (p - q).length() <= tolerance;
            let fits = same(at(&b, j), q + ex + ey)
                && same(at(&b, j + 1), q + ey)
                && same(at(&b, j + 2), q + ex);
            (right && fits).then_some((q, ex, ey))
        })?;
        let ng = mesh.face_normal(prim);
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
        let sides =
            [prim, prim + 1].map(|p| corners.map(|c| mesh.shading_normal(p, c, ng).dot(ng)));
        let side = sides[0][0].signum();
        if sides.iter().flatten().any(|cos| cos * side < 1.0 - 1e-6) {
            return None;
        }
        let (width, height) = (ex.length() as f32, ey.length() as f32);
        let reach = q
            .abs()
            .max((q + ex).abs())
            .max((q + ey).abs())
            .max((q + ex + ey).abs());
        Some(Rectangle {
            corner: q.as_vec3(),
            x: ex.normalize().as_vec3(),
            y: ey.normalize().as_vec3(),
            width,
            height,
            ng,
            front: side > 0.0,
            p_err: reach.as_vec3() * fp::gamma(5)
                + width.max(height) * (fp::PLANE_ERROR + fp::gamma(4)),
        })
    }

    #[cfg(test)]
    fn corners(&self) -> [Vec3; 4] {
        let (x, y) = (self.x * self.width, self.y * self.height);
        [
            self.corner,
            self.corner + x,
            self.corner + y,
            self.corner + x + y,
        ]
    }

    /// Whether a receiver at `eye` is on the side that shines.
    #[inline]
    fn shines_on(&self, eye: Vec3) -> bool {
        ((eye - self.corner).dot(self.ng) > 0.0) == self.front
    }

    /// Whether [`Rectangle::sample`] is uniform over the area for a receiver at `eye`.
    pub fn is_by_area(&self, eye: Vec3) -> bool {
        self.seen(eye).is_none()
    }

    /// The point at the parameters `st` in [0,1]².
    pub fn at(&self, st: Vec2) -> Vec3 {
        self.corner + self.x * (self.width * st.x) + self.y * (self.height * st.y)
    }

    /// The parameters of the point `p` of the rectangle.
    pub fn locate(&self, p: Vec3) -> Vec2 {
        let d = p - self.corner;
        Vec2::new(d.dot(self.x) / self.width, d.dot(self.y) / self.height)
    }

    /// Normal of the side that shines.
    #[cfg(test)]
    fn shining_normal(&self) -> Vec3 {
        if self.front { self.ng } else { -self.ng }
    }

    /// How it looks from `eye`, where that is worth sampling by solid angle.
    #[inline]
    fn seen(&self, eye: Vec3) -> Option<Seen> {
        let d = self.corner - eye;
        let (x0, y0, z) = (d.dot(self.x), d.dot(self.y), d.dot(self.ng).abs());
        let middle = Vec2::new(x0 + 0.5 * self.width, y0 + 0.5 * self.height);
        let extent2 = self.width * self.width + self.height * self.height;
        let d2 = middle.length_squared() + z * z;
        if extent2 < FAR2 * d2 {
            return None;
        }
        // In units of distance no product below leaves the range of f32.
        let scale = 1.0 / (d2 + extent2).sqrt();
        let (x0, y0, z) = (x0 * scale, y0 * scale, z * scale);
        let (width, height) = (self.width * scale, self.height * scale);
        let (x1, y1) = (x0 + width, y0 + height);
        // Both triangles by van Oosterom & Strackee 1983: tan(Ω/2) = det / den; the angles of the two
        // complex numbers den + i det add up.
        let z2 = z * z;
        let length = |x: f32, y: f32| (x * x + y * y + z2).sqrt();
        let (l00, l10, l11, l01) = (
            length(x0, y0),
            length(x1, y0),
            length(x1, y1),
            length(x0, y1),
        );
        let dot = |ax: f32, ay: f32, bx: f32, by: f32| ax * bx + ay * by + z2;
        let diagonal = dot(x0, y0, x1, y1);
        let det = z * width * height;
        let den_a = l00 * l10 * l11
            + dot(x0, y0, x1, y0) * l11
            + dot(x1, y0, x1, y1) * l00
            + diagonal * l10;
        let den_b = l00 * l11 * l01
            + diagonal * l01
            + dot(x1, y1, x0, y1) * l00
            + dot(x0, y0, x0, y1) * l11;
        let solid_angle = 2.0 * (det * (den_a + den_b)).atan2(den_a * den_b - det * det);
        (solid_angle > TINY && solid_angle.is_finite()).then_some(Seen {
            x0,
            x1,
            y0,
            y1,
            z,
            solid_angle,
        })
    }

    /// A point for a receiver at `eye`. `None` where it does not shine.
    #[inline]
    pub fn sample(&self, eye: Vec3, u: Vec2) -> Option<RectangleSample> {
        if !self.shines_on(eye) {
            return None;
        }
        let seen = self.seen(eye);
        let st = match &seen {
            Some(seen) => seen.sample(u),
            None => u,
        };
        let p = self.corner + self.x * (self.width * st.x) + self.y * (self.height * st.y);
        let d = p - eye;
        let dist = d.length();
        let wi = d / dist;
        let pdf = match &seen {
            Some(seen) => 1.0 / seen.solid_angle,
            None => self.pdf_by_area(d, dist),
        };
        // A receiver within rounding of the plane may be given its own point.
        let sound = dist > 0.0 && pdf > 0.0 && pdf < f32::MAX;
        sound.then_some(RectangleSample { p, wi, dist, pdf })
    }

    /// Density per steradian at `eye` with which [`Rectangle::sample`] returns its point `p`.
    #[inline]
    pub fn pdf(&self, eye: Vec3, p: Vec3) -> f32 {
        match self.seen(eye) {
            Some(seen) => 1.0 / seen.solid_angle,
            None => {
                let d = p - eye;
                self.pdf_by_area(d, d.length())
            }
        }
    }

    #[inline]
    fn pdf_by_area(&self, d: Vec3, dist: f32) -> f32 {
        // In this order no intermediate result leaves the range of f32 before the density does.
        let cos = (d / dist).dot(self.ng).abs();
        ((dist / self.width) * (dist / self.height) / cos).clamp(f32::MIN_POSITIVE, f32::MAX)
    }
}

impl Seen {
    /// The parameters (s, t) of the point at `u`, uniform in solid angle.
    #[inline]
    fn sample(&self, u: Vec2) -> Vec2 {
        let Seen {
            x0,
            x1,
            y0,
            y1,
            z,
            solid_angle,
        } = *self;
        // Inward normals of the planes through the eye and three edges: n0 = (0, -z, -y0) / r0 and so on.
        let (r0, r2, r3) = (
            1.0 / (z * z + y0 * y0).sqrt(),
            1.0 / (z * z + y1 * y1).sqrt(),
            1.0 / (z * z + x0 * x0).sqrt(),
        );
        let (b0, b1) = (-y0 * r0, y1 * r2);
        // k = 2π - g2 - g3 is the sum of the angles between n2 and n3 and between n3 and n0: as complex
        // numbers of length one their product. |a x b| is the sine, written out without cancellation.
        let angle = |a: [f32; 2], b: [f32; 2], c: f32| {
            let (p, q, r) = (a[0] * b[1], a[1] * b[0], a[0] * b[0]);
            (c, (p * p + q * q + r * r).sqrt())
        };
        let (n0, n2, n3) = ([-z * r0, -y0 * r0], [z * r2, y1 * r2], [-z * r3, -x0 * r3]);
        let (c23, s23) = angle(n2, n3, n2[1] * n3[1]);
        let (c30, s30) = angle(n0, n3, n3[1] * n0[1]);
        let (cos_k, sin_k) = (c23 * c30 - s23 * s30, s23 * c30 + c23 * s30);
        // The x that cuts off the share u.x of the solid angle.
        let (sin_u, cos_u) = (u.x * solid_angle).sin_cos();
        let (sin, cos) = (sin_k * cos_u + cos_k * sin_u, cos_k * cos_u - sin_k * sin_u);
        let f = (cos * b0 - b1) / sin;
        let c = (1.0 / (f * f + b0 * b0).sqrt()).copysign(f);
        let x = c * z / (1.0 - c * c).max(f32::MIN_POSITIVE).sqrt();
        // `max` also replaces the NaN of 0/0 at the very end of the arc.
        let x = x.max(x0).min(x1);
        // Along that line equal shares of the solid angle are equal steps of the height on the sphere.
        let d2 = x * x + z * z;
        let (h0, h1) = (y0 / (d2 + y0 * y0).sqrt(), y1 / (d2 + y1 * y1).sqrt());
        let h = h0 + u.y * (h1 - h0);
        let y = (h * d2.sqrt() / (1.0 - h * h).max(f32::MIN_POSITIVE).sqrt())
            .max(y0)
            .min(y1);
        Vec2::new((x - x0) / (x1 - x0), (y - y0) / (y1 - y0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Transform;
    use crate::math::warp::SphericalRectangle;
    use glam::DVec3;

    fn rectangle(width: f64, height: f64) -> Rectangle {
        let place = Transform::translate(DVec3::new(0.3, -0.2, 0.0) * width)
            * Transform::rotate(DVec3::new(1.0, 0.4, 0.2), 40.0).unwrap()
            * Transform::scale(DVec3::new(width / 2.0, height / 2.0, 1.0)).unwrap();
        Rectangle::of_mesh(&Mesh::rectangle(&place, false), 0).unwrap()
    }

    /// Receivers on the shining side, from near to far, in front and from aside.
    fn eyes(r: &Rectangle) -> Vec<Vec3> {
        let center = 0.5 * (r.corners()[0] + r.corners()[3]);
        let places = [
            (0.0, 0.0, 0.05),
            (0.4, 0.1, 0.3),
            (0.0, 1.5, 0.2),
            (-2.0, 1.0, 2.0),
            (3.0, 0.0, 0.01),
        ];
        places
            .iter()
            .map(|(a, b, c)| center + r.x * *a + r.y * *b + r.shining_normal() * *c)
            .collect()
    }

    #[test]
    fn the_map_agrees_with_the_one_in_double_precision() {
        for (w, h) in [(1.0, 1.0), (0.3, 2.0), (5.0, 0.1)] {
            let r = rectangle(w, h);
            for eye in eyes(&r) {
                let Some(seen) = r.seen(eye) else { continue };
                let exact =
                    SphericalRectangle::new(r.corner, r.x * r.width, r.y * r.height, eye).unwrap();
                let ratio = seen.solid_angle / exact.solid_angle();
                // Close to the plane the solid angle nears a half space and its tangent loses digits.
                assert!((ratio - 1.0).abs() < 5e-4, "{w} x {h} from {eye}: {ratio}");
                for i in 0..100 {
                    let u = Vec2::new((i % 10) as f32 / 10.0 + 0.03, (i / 10) as f32 / 10.0 + 0.07);
                    let (got, want) = (seen.sample(u), exact.sample(u));
                    assert!(
                        (got - want).length() < 2e-3,
                        "{w} x {h} from {eye}, {u}: {got} {want}"
                    );
                }
            }
        }
    }

    #[test]
    fn densities_agree_with_samples_at_every_size() {
        for scale in [1e-6, 1e-3, 1.0, 1e6] {
            let r = rectangle(scale, 0.7 * scale);
            let center = 0.5 * (r.corners()[0] + r.corners()[3]);
            for distance in [1e-4, 0.1, 1.0, 3.0, 1e3, 1e6] {
                let eye = center + (r.shining_normal() + 0.3 * r.x) * (distance * scale) as f32;
                for i in 0..64 {
                    let u = Vec2::new((i % 8) as f32 / 8.0 + 0.05, (i / 8) as f32 / 8.0 + 0.05);
                    let s = r.sample(eye, u).unwrap();
                    assert!(s.pdf.is_finite() && s.pdf > 0.0 && (s.wi.length() - 1.0).abs() < 1e-5);
                    let pdf = r.pdf(eye, s.p);
                    assert!(
                        (pdf / s.pdf - 1.0).abs() < 1e-4,
                        "scale {scale}, distance {distance}: {pdf} {}",
                        s.pdf
                    );
                }
            }
        }
    }

    #[test]
    fn receivers_on_the_rectangle_get_no_nan() {
        let r = rectangle(2.4, 1.4);
        for i in 0..64 {
            let place = Vec2::new((i % 8) as f32 / 8.0 + 0.05, (i / 8) as f32 / 8.0 + 0.05);
            let eye = r.at(place);
            let samples = (0..64).filter_map(|k| {
                let u = Vec2::new((k % 8) as f32 / 8.0 + 0.03, (k / 8) as f32 / 8.0 + 0.01);
                r.sample(eye, u)
            });
            for s in samples {
                assert!(s.wi.is_finite() && s.dist > 0.0 && s.pdf > 0.0, "{s:?}");
            }
        }
    }

    #[test]
    fn only_one_side_shines() {
        let r = rectangle(1.0, 1.0);
        let center = 0.5 * (r.corners()[0] + r.corners()[3]);
        assert!(
            r.sample(center + r.shining_normal(), Vec2::splat(0.5))
                .is_some()
        );
        assert!(
            r.sample(center - r.shining_normal(), Vec2::splat(0.5))
                .is_none()
        );
    }
}

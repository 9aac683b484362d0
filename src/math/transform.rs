//! Affine maps, composed and inverted in f64 so that a chain of them loses nothing that f32 geometry
//! could notice.

use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};

/// An invertible affine map of space together with its inverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    m: DAffine3,
    inv: DAffine3,
}

impl Default for Transform {
    fn default() -> Self {
        Transform::IDENTITY
    }
}

impl Transform {
    pub const IDENTITY: Transform = Transform {
        m: DAffine3::IDENTITY,
        inv: DAffine3::IDENTITY,
    };

    /// `None` when the map is singular, not finite, or so close to singular that its inverse is noise.
    pub fn new(m: DAffine3) -> Option<Transform> {
        let inv = m.inverse();
        let norm = |a: DMat3| {
            a.x_axis
                .abs()
                .max(a.y_axis.abs())
                .max(a.z_axis.abs())
                .max_element()
        };
        let condition = norm(m.matrix3) * norm(inv.matrix3);
        // Beyond this the inverse has no correct digit left in f64.
        (m.is_finite() && inv.is_finite() && condition < 1e15).then_some(Transform { m, inv })
    }

    /// From a map and its inverse, which the caller knows.
    pub(super) fn with_inverse(m: DAffine3, inv: DAffine3) -> Transform {
        Transform { m, inv }
    }

    /// From a row-major 4x4 matrix. `None` when it is not affine or not invertible.
    pub fn from_rows(rows: [[f64; 4]; 4]) -> Option<Transform> {
        let m = DMat4::from_cols_array_2d(&rows).transpose();
        (m.row(3) == DVec4::W)
            .then(|| DAffine3::from_mat4(m))
            .and_then(Transform::new)
    }

    pub fn translate(v: DVec3) -> Transform {
        Transform {
            m: DAffine3::from_translation(v),
            inv: DAffine3::from_translation(-v),
        }
    }

    /// `None` when a factor is zero.
    pub fn scale(v: DVec3) -> Option<Transform> {
        Transform::new(DAffine3::from_scale(v))
    }

    /// Counter-clockwise about `axis` by `degrees`. `None` for a zero axis.
    pub fn rotate(axis: DVec3, degrees: f64) -> Option<Transform> {
        let axis = axis.try_normalize()?;
        Transform::new(DAffine3::from_axis_angle(axis, degrees.to_radians()))
    }

    /// Camera to world: +z towards `target`, +y near `up`, +x to the left, as Mitsuba has it.
    /// `None` when origin and target coincide or `up` is parallel to the view direction.
    pub fn look_at(origin: DVec3, target: DVec3, up: DVec3) -> Option<Transform> {
        let dir = (target - origin).try_normalize()?;
        let left = up.cross(dir).try_normalize()?;
        let new_up = dir.cross(left);
        Transform::new(DAffine3::from_mat3_translation(
            DMat3::from_cols(left, new_up, dir),
            origin,
        ))
    }

    pub fn matrix(&self) -> DAffine3 {
        self.m
    }

    pub fn inverse(&self) -> Transform {
        Transform {
            m: self.inv,
            inv: self.m,
        }
    }

    pub fn point(&self, p: DVec3) -> DVec3 {
        self.m.transform_point3(p)
    }

    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.m.transform_vector3(v)
    }

    /// A normal (covector), not renormalised.
    pub fn normal(&self, n: DVec3) -> DVec3 {
        self.inv.matrix3.transpose() * n
    }

    /// True when the map turns right-handed coordinates into left-handed ones.
    pub fn swaps_handedness(&self) -> bool {
        self.m.matrix3.determinant() < 0.0
    }
}

impl std::ops::Mul for Transform {
    type Output = Transform;
    /// `(a * b)(p) = a(b(p))`.
    fn mul(self, b: Transform) -> Transform {
        Transform {
            m: self.m * b.m,
            inv: b.inv * self.inv,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_undoes_a_long_chain() {
        let step = Transform::rotate(DVec3::new(1.0, 2.0, 3.0), 31.0).unwrap()
            * Transform::translate(DVec3::new(1e6, -3.0, 0.1))
            * Transform::scale(DVec3::new(2.0, 0.5, 1.0)).unwrap();
        let chain = step * step * step;
        let p = DVec3::new(0.3, 0.2, -0.7);
        let back = chain.inverse().point(chain.point(p));
        // Coordinates reach 1e7, so f64 keeps about 1e-9 of them.
        assert!((back - p).length() < 1e-8, "{back}");
    }

    #[test]
    fn singular_maps_are_refused() {
        assert!(Transform::scale(DVec3::new(1.0, 0.0, 1.0)).is_none());
        assert!(Transform::scale(DVec3::new(1.0, f64::NAN, 1.0)).is_none());
        assert!(Transform::rotate(DVec3::ZERO, 10.0).is_none());
        assert!(Transform::look_at(DVec3::ZERO, DVec3::Z, DVec3::Z).is_none());
        // A small but regular scale is not singular.
        assert!(Transform::scale(DVec3::splat(1e-9)).is_some());
    }

    #[test]
    fn look_at_faces_its_target() {
        let t = Transform::look_at(DVec3::new(0.0, 0.0, -5.0), DVec3::ZERO, DVec3::Y).unwrap();
        assert!((t.vector(DVec3::Z) - DVec3::Z).length() < 1e-12);
        assert!((t.vector(DVec3::X) - DVec3::X).length() < 1e-12);
    }
}

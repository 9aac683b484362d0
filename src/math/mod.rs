//! Numbers that everything else is made of: colours, frames, boxes and careful scalar functions.
//!
//! Vectors are glam's `Vec2`, `Vec3` (f32, world and local space) and `DVec3` (f64, composition of
//! transforms and analytic intersections).

pub mod fp;
pub mod motion;
pub mod special;
pub mod transform;
pub mod warp;

pub use glam::{DVec2, DVec3, Vec2, Vec3, Vec3A, Vec4};
pub use motion::Motion;
pub use std::f32::consts::PI;
pub use transform::Transform;

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, MulAssign, Neg, Sub, SubAssign};

/// A linear colour (Rec. 709 primaries, D65 white): radiance, reflectance, or any per-channel number.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Rgb {
    pub r: f32,
    pub g: f32,
    pub b: f32,
}

impl Rgb {
    pub const BLACK: Rgb = Rgb::splat(0.0);
    pub const WHITE: Rgb = Rgb::splat(1.0);

    #[inline]
    pub const fn new(r: f32, g: f32, b: f32) -> Rgb {
        Rgb { r, g, b }
    }

    #[inline]
    pub const fn splat(v: f32) -> Rgb {
        Rgb { r: v, g: v, b: v }
    }

    #[inline]
    pub const fn from_array([r, g, b]: [f32; 3]) -> Rgb {
        Rgb { r, g, b }
    }

    #[inline]
    pub const fn to_array(self) -> [f32; 3] {
        [self.r, self.g, self.b]
    }

    #[inline]
    pub fn map(self, mut f: impl FnMut(f32) -> f32) -> Rgb {
        Rgb::new(f(self.r), f(self.g), f(self.b))
    }

    #[inline]
    pub fn zip(self, o: Rgb, mut f: impl FnMut(f32, f32) -> f32) -> Rgb {
        Rgb::new(f(self.r, o.r), f(self.g, o.g), f(self.b, o.b))
    }

    /// `self` at `t = 0`, `o` at `t = 1`.
    #[inline]
    pub fn lerp(self, o: Rgb, t: f32) -> Rgb {
        self * (1.0 - t) + o * t
    }

    /// CIE Y of a linear Rec. 709 colour.
    #[inline]
    pub fn luminance(self) -> f32 {
        0.212_671 * self.r + 0.715_160 * self.g + 0.072_169 * self.b
    }

    #[inline]
    pub fn max_component(self) -> f32 {
        self.r.max(self.g).max(self.b)
    }

    #[inline]
    pub fn min_component(self) -> f32 {
        self.r.min(self.g).min(self.b)
    }

    #[inline]
    pub fn mean(self) -> f32 {
        (self.r + self.g + self.b) * (1.0 / 3.0)
    }

    /// True when no channel carries anything. A NaN is not black: it must be seen, not skipped.
    #[inline]
    pub fn is_black(self) -> bool {
        self.r == 0.0 && self.g == 0.0 && self.b == 0.0
    }

    #[inline]
    pub fn is_finite(self) -> bool {
        self.r.is_finite() && self.g.is_finite() && self.b.is_finite()
    }
}

macro_rules! rgb_op {
    ($($Op:ident $op:ident $OpAssign:ident $op_assign:ident $sym:tt;)*) => {$(
        impl $Op for Rgb {
            type Output = Rgb;
            #[inline]
            fn $op(self, o: Rgb) -> Rgb {
                Rgb::new(self.r $sym o.r, self.g $sym o.g, self.b $sym o.b)
            }
        }
        impl $OpAssign for Rgb {
            #[inline]
            fn $op_assign(&mut self, o: Rgb) {
                *self = *self $sym o;
            }
        }
    )*};
}
rgb_op! {
    Add add AddAssign add_assign +;
    Sub sub SubAssign sub_assign -;
    Mul mul MulAssign mul_assign *;
}

impl Mul<f32> for Rgb {
    type Output = Rgb;
    #[inline]
    fn mul(self, s: f32) -> Rgb {
        Rgb::new(self.r * s, self.g * s, self.b * s)
    }
}

impl Mul<Rgb> for f32 {
    type Output = Rgb;
    #[inline]
    fn mul(self, c: Rgb) -> Rgb {
        c * self
    }
}

impl MulAssign<f32> for Rgb {
    #[inline]
    fn mul_assign(&mut self, s: f32) {
        *self = *self * s;
    }
}

impl Div<f32> for Rgb {
    type Output = Rgb;
    #[inline]
    fn div(self, s: f32) -> Rgb {
        Rgb::new(self.r / s, self.g / s, self.b / s)
    }
}

impl Div for Rgb {
    type Output = Rgb;
    #[inline]
    fn div(self, o: Rgb) -> Rgb {
        Rgb::new(self.r / o.r, self.g / o.g, self.b / o.b)
    }
}

impl Neg for Rgb {
    type Output = Rgb;
    #[inline]
    fn neg(self) -> Rgb {
        self.map(|v| -v)
    }
}

impl Sum for Rgb {
    fn sum<I: Iterator<Item = Rgb>>(iter: I) -> Rgb {
        iter.fold(Rgb::BLACK, Add::add)
    }
}

impl Index<usize> for Rgb {
    type Output = f32;
    #[inline]
    fn index(&self, i: usize) -> &f32 {
        match i {
            0 => &self.r,
            1 => &self.g,
            _ => &self.b,
        }
    }
}

impl IndexMut<usize> for Rgb {
    #[inline]
    fn index_mut(&mut self, i: usize) -> &mut f32 {
        match i {
            0 => &mut self.r,
            1 => &mut self.g,
            _ => &mut self.b,
        }
    }
}

/// A right-handed orthonormal basis; `n` is the local z axis.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    pub s: Vec3,
    pub t: Vec3,
    pub n: Vec3,
}

impl Frame {
    /// A basis around the unit vector `n`, continuous but at n.z = 0 (Duff et al. 2017, listing 3).
    #[inline]
    pub fn from_normal(n: Vec3) -> Frame {
        let sign = 1.0f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Frame {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// A basis whose `s` lies along `dp_du` as far as that is possible: anisotropic lobes follow the
    /// parametrisation. Falls back to [`Frame::from_normal`] where `dp_du` is parallel to `n` or zero.
    #[inline]
    pub fn from_tangent(n: Vec3, dp_du: Vec3) -> Frame {
        let s = dp_du - n * n.dot(dp_du);
        let len2 = s.length_squared();
        // The projection is all rounding once it is this much shorter than what was projected.
        if len2 > 1e-10 * dp_du.length_squared() && len2.is_normal() {
            let s = s / len2.sqrt();
            Frame {
                s,
                t: n.cross(s),
                n,
            }
        } else {
            Frame::from_normal(n)
        }
    }

    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

/// An axis-aligned box; empty when `min > max` on any axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    pub min: Vec3,
    pub max: Vec3,
}

impl Aabb {
    pub const EMPTY: Aabb = Aabb {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    #[inline]
    pub fn grow(&mut self, p: Vec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    #[inline]
    pub fn union(self, o: Aabb) -> Aabb {
        Aabb {
            min: self.min.min(o.min),
            max: self.max.max(o.max),
        }
    }

    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    pub fn center(&self) -> Vec3 {
        0.5 * (self.min + self.max)
    }

    pub fn diagonal(&self) -> Vec3 {
        self.max - self.min
    }
}

/// `sqrt` of a number that rounding may have made slightly negative.
#[inline]
pub fn safe_sqrt(x: f32) -> f32 {
    x.max(0.0).sqrt()
}

#[inline]
pub fn sqr(x: f32) -> f32 {
    x * x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        let third = 1.0 / 3f32.sqrt();
        for n in [
            Vec3::Z,
            -Vec3::Z,
            Vec3::X,
            Vec3::splat(third),
            Vec3::new(third, -third, -third),
        ] {
            for f in [
                Frame::from_normal(n),
                Frame::from_tangent(n, Vec3::new(0.3, 2.0, -0.1)),
                Frame::from_tangent(n, n),
            ] {
                assert!((f.s.length() - 1.0).abs() < 1e-6 && (f.t.length() - 1.0).abs() < 1e-6);
                assert!(f.s.dot(f.t).abs() < 1e-6 && f.s.dot(n).abs() < 1e-6);
                assert!((f.s.cross(f.t) - n).length() < 1e-6);
                let v = Vec3::new(0.2, -0.7, 0.4);
                assert!((f.to_world(f.to_local(v)) - v).length() < 1e-6);
            }
        }
    }
}

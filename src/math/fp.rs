//! Every error bound of the geometry, in one place. No absolute epsilon: each bound scales with the
//! coordinates it guards, so a ring of a millimetre and a planet of a thousand kilometres work alike.

use super::Vec3;

/// Bound on the relative error after `n` roundings, `n u / (1 - n u)` with u = 2^-24
/// (Higham 2002, "Accuracy and Stability of Numerical Algorithms", section 3.1).
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f32 * (f32::EPSILON / 2.0);
    nu / (1.0 - nu)
}

/// The largest float below one: what a number from [0,1) must not exceed.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

/// Bound on how far from the plane of a triangle the triangle test may believe a ray to pass that in
/// truth passes within it, relative to the largest offset of a corner from the ray's origin. An edge
/// function errs by about eight roundings of the product of two offsets (subtraction, shear and product
/// of each), and so do the barycentric weights that mix the corners' distances; the bound doubles that.
/// It is an error along the normal: along the ray it grows with one over the cosine, as it does for the
/// offset of an origin.
pub const PLANE_ERROR: f32 = gamma(16);

/// The origin of a ray that leaves the surface at `p` towards `w`: moved along `ng` out of the box of
/// half-width `p_err` around `p`, to the side of `w`, so that the ray cannot meet the surface it
/// leaves (Pharr, Jakob & Humphreys, section 6.8.6). The rounding of the sum must be part of `p_err`:
/// one `gamma(1)` of each coordinate.
#[inline]
pub fn offset_origin(p: Vec3, p_err: Vec3, ng: Vec3, w: Vec3) -> Vec3 {
    let d = ng.abs().dot(p_err);
    p + ng * d.copysign(w.dot(ng))
}

/// How far along a connection of length `len` between two offset points a blocker may lie. The end
/// point already stands clear of its surface by that surface's own error bound; what remains is the
/// rounding of the direction, of its length and of the blocker's distance, a few units in the last place.
#[inline]
pub fn connection_t_max(len: f32) -> f32 {
    len * (1.0 - gamma(8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offset_leaves_the_error_box_on_the_right_side() {
        for scale in [1e-6f32, 1.0, 1e6] {
            let p = Vec3::new(0.3, -1.7, 12.0) * scale;
            let p_err = p.abs() * gamma(7);
            let rounding = p.abs() * gamma(1);
            let ng = Vec3::new(0.6, 0.0, 0.8);
            for w in [ng, -ng] {
                let moved = offset_origin(p, p_err, ng, w) - p;
                let least = ng.abs().dot(p_err - rounding);
                assert!(moved.dot(w) >= least, "scale {scale}");
            }
        }
    }
}

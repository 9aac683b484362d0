//! The sRGB curve and the matrices between linear Rec. 709 and CIE XYZ.

use crate::math::Rgb;

/// Linear Rec. 709 (D65 at x = 0.3127, y = 0.3290) to CIE XYZ with Y = 1 for white; from the primaries
/// of IEC 61966-2-1.
pub const RGB_TO_XYZ: [[f64; 3]; 3] = [
    [0.4123907992659594, 0.35758433938387796, 0.1804807884018343],
    [0.2126390058715103, 0.7151686787677559, 0.07219231536073371],
    [0.01933081871559186, 0.1191947797946261, 0.9505321522496607],
];

/// Inverse of [`RGB_TO_XYZ`].
pub const XYZ_TO_RGB: [[f64; 3]; 3] = [
    [3.2409699419045213, -1.537383177570093, -0.4986107602930032],
    [-0.9692436362808794, 1.8759675015077202, 0.04155505740717556],
    [
        0.05563007969699364,
        -0.20397695888897668,
        1.0569715142428784,
    ],
];

/// `matrix * v`.
pub fn apply(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// CIE XYZ (Y = 1 for D65 white) to linear Rec. 709.
pub fn xyz_to_rgb(xyz: Rgb) -> Rgb {
    let rgb = apply(&XYZ_TO_RGB, xyz.to_array().map(f64::from));
    Rgb::from_array(rgb.map(|v| v as f32))
}

/// The sRGB curve, IEC 61966-2-1: encoded 0..1 to linear 0..1.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.040_45 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

/// Inverse of [`srgb_to_linear`]; the argument is not clamped.
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_matrices_and_the_curves_are_inverses() {
        for v in [[1.0, 0.0, 0.0], [0.2, 0.5, 3.0]] {
            let back = apply(&XYZ_TO_RGB, apply(&RGB_TO_XYZ, v));
            (0..3).for_each(|c| assert!((back[c] - v[c]).abs() < 1e-14));
        }
        for i in 0..=255u8 {
            let v = f32::from(i) / 255.0;
            assert!((linear_to_srgb(srgb_to_linear(v)) - v).abs() < 1e-5);
        }
    }
}

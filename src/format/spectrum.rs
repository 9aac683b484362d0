//! Spectra as a scene file writes them, and what RGB they are.
//!
//! A reflectance or an index of refraction is seen under D65 and divided by what white gives; an
//! emission is seen as it is, so that 1 at every wavelength is the slightly reddish equal-energy
//! white (about 1.205, 0.948, 0.909). Both match what Mitsuba 3 does in its RGB modes.

use super::cie;
use super::plugins::Role;
use crate::math::Rgb;

/// A quantity over the wavelength.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    Uniform(f64),
    /// (nm, value) by increasing wavelength, at least two; linear between, 0 outside.
    Sampled(Vec<(f64, f64)>),
}

/// Linear Rec. 709 (IEC 61966-2-1) from CIE XYZ.
const XYZ_TO_RGB: [[f64; 3]; 3] = [
    [3.240479, -1.537150, -0.498535],
    [-0.969256, 1.875991, 0.041556],
    [0.055648, -0.204043, 1.057311],
];

/// Step of the integration in nm; the tables are interpolated.
const STEP: f64 = 1.0;

impl Spectrum {
    /// The colour, no channel below 0, and none above 1 for a reflectance.
    pub fn to_rgb(&self, role: Role) -> Rgb {
        let rgb = match (self, role) {
            (Spectrum::Uniform(value), Role::Reflectance | Role::Unbounded) => [*value; 3],
            (_, Role::Emission) => xyz_to_rgb(self.integrate(|_| 1.0)),
            (_, Role::Reflectance | Role::Unbounded) => xyz_to_rgb(self.integrate(d65)),
        };
        let top = match role {
            Role::Reflectance => 1.0,
            Role::Unbounded | Role::Emission => f64::INFINITY,
        };
        Rgb::from_array(rgb.map(|c| c.clamp(0.0, top) as f32))
    }

    /// Value at a wavelength in nm.
    pub fn value(&self, nm: f64) -> f64 {
        let samples = match self {
            Spectrum::Uniform(value) => return *value,
            Spectrum::Sampled(samples) => samples,
        };
        let next = samples.partition_point(|&(at, _)| at <= nm);
        match (
            next.checked_sub(1).and_then(|i| samples.get(i)),
            samples.get(next),
        ) {
            (Some(&(a, value)), Some(&(b, other))) => value + (other - value) * (nm - a) / (b - a),
            // The last sample belongs to the spectrum, what lies after it does not.
            (Some(&(a, value)), None) if a == nm => value,
            _ => 0.0,
        }
    }

    /// XYZ under a light, relative to the luminance of that light.
    fn integrate(&self, light: impl Fn(f64) -> f64) -> [f64; 3] {
        let steps = ((cie::XYZ.len() - 1) as f64 * cie::STEP_NM / STEP) as usize;
        let mut xyz = [0.0; 3];
        let mut white = 0.0;
        for i in 0..steps {
            // Midpoint rule: a spectrum that jumps to 0 at its ends is not counted there twice.
            let nm = cie::FIRST_NM + (i as f64 + 0.5) * STEP;
            let observer = matching(nm);
            let power = light(nm);
            white += power * observer[1];
            for (sum, o) in xyz.iter_mut().zip(observer) {
                *sum += power * self.value(nm) * o;
            }
        }
        xyz.map(|sum| sum / white)
    }
}

fn matching(nm: f64) -> [f64; 3] {
    let (i, t) = row(nm);
    std::array::from_fn(|c| cie::XYZ[i][c] * (1.0 - t) + cie::XYZ[i + 1][c] * t)
}

fn d65(nm: f64) -> f64 {
    let (i, t) = row(nm);
    cie::D65[i] * (1.0 - t) + cie::D65[i + 1] * t
}

/// Row of the tables at or before a wavelength inside them, and the share of the next one.
fn row(nm: f64) -> (usize, f64) {
    let x = (nm - cie::FIRST_NM) / cie::STEP_NM;
    let i = (x as usize).min(cie::XYZ.len() - 2);
    (i, x - i as f64)
}

fn xyz_to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    XYZ_TO_RGB.map(|row| row.iter().zip(xyz).map(|(m, x)| m * x).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(samples: &[(f64, f64)]) -> Spectrum {
        Spectrum::Sampled(samples.to_vec())
    }

    /// What Mitsuba 3.9.1 (scalar_rgb) answers for the same spectra.
    #[test]
    fn colours_agree_with_mitsuba() {
        let flat = sampled(&[(400.0, 0.78), (500.0, 0.78), (600.0, 0.78), (700.0, 0.78)]);
        let lamp = sampled(&[(400.0, 0.0), (500.0, 8.0), (600.0, 15.6), (700.0, 18.4)]);
        let hill = sampled(&[(360.0, 0.2), (550.0, 0.9), (830.0, 0.1)]);
        let narrow = sampled(&[(500.0, 1.0), (520.0, 1.0)]);
        let everywhere = sampled(&[(300.0, 1.0), (900.0, 1.0)]);
        for (spectrum, role, expected) in [
            (&flat, Role::Reflectance, [0.776367, 0.779810, 0.776029]),
            (&flat, Role::Emission, [0.935761, 0.740626, 0.704686]),
            (&lamp, Role::Reflectance, [1.0, 1.0, 1.0]),
            (&lamp, Role::Unbounded, [17.714712, 11.354429, 3.304508]),
            (&lamp, Role::Emission, [20.710836, 10.854634, 2.771152]),
            (&hill, Role::Reflectance, [0.698954, 0.849679, 0.510980]),
            (&hill, Role::Emission, [0.843536, 0.810607, 0.456356]),
            (&everywhere, Role::Emission, [1.204884, 0.948228, 0.909267]),
            (
                &everywhere,
                Role::Reflectance,
                [0.998985, 0.998874, 0.998802],
            ),
            (
                &Spectrum::Uniform(0.5),
                Role::Emission,
                [0.602397, 0.474146, 0.454458],
            ),
            (&Spectrum::Uniform(0.5), Role::Reflectance, [0.5, 0.5, 0.5]),
        ] {
            let rgb = spectrum.to_rgb(role).to_array();
            for (a, b) in rgb.iter().zip(expected) {
                assert!((a - b).abs() < 0.005 * b, "{spectrum:?} {role:?}: {rgb:?}");
            }
        }
        // Where the spectrum jumps, quadratures differ: the exact integral here is 0.19129.
        let rgb = narrow.to_rgb(Role::Reflectance);
        assert!(rgb.r == 0.0 && (rgb.g - 0.19129).abs() < 0.001 * 0.19129);
    }

    #[test]
    fn values_are_linear_between_samples_and_zero_outside() {
        let s = sampled(&[(400.0, 1.0), (500.0, 3.0)]);
        let at = [399.9, 400.0, 450.0, 500.0, 500.1].map(|nm| s.value(nm));
        assert_eq!(at, [0.0, 1.0, 2.0, 3.0, 0.0]);
    }
}

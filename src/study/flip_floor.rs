//! How much FLIP the reference's own noise makes. FLIP is no mean of squares, from which noise could be taken off: what
//! can be done is to say where it is too small to be told from that noise.

use super::Picture;
use super::flip;
use super::statistics::Reference;
use crate::math::Rgb;
use crate::sampler::mix;

/// A FLIP of fewer times the floor is not resolved. FLIP of picture against truth and against noisy reference differ
/// by about the floor at most (differences of colours obey the triangle inequality; FLIP nearly does): at three times
/// it, by a third at worst; by some 5 % where the two add like independent noise.
pub const RESOLVED: f64 = 3.0;

/// HDR-FLIP of the reference against itself with as much normal noise more as it has by its own account, which makes
/// of it what an independent reference of twice the variance is to the truth of this one; so, that of a reference
/// against the truth. The channels of a pixel get the same noise, as they nearly have. `None` where the
/// reference's noise is not known.
pub fn floor(reference: &Reference) -> Option<f64> {
    let variance = reference.variance.as_ref()?;
    let picture = &reference.picture;
    let pairs = picture.pixels.iter().zip(variance).enumerate();
    let noisy = |(i, (p, v)): (usize, (&Rgb, &Rgb))| {
        let z = normal(i as u64);
        let channel = |c: usize| p[c] + z * v[c].max(0.0).sqrt();
        // As renderers, it makes no light below zero.
        Rgb::new(channel(0), channel(1), channel(2)).map(|x| x.max(0.0))
    };
    let noisy = Picture {
        width: picture.width,
        height: picture.height,
        pixels: pairs.map(noisy).collect(),
    };
    Some(flip::hdr(&noisy, picture, flip::DEFAULT_PPD).mean)
}

/// The i-th of independent numbers of mean 0 and variance 1 (Box and Muller 1958).
fn normal(i: u64) -> f32 {
    let unit = |k: u64| ((mix(2 * i + k) >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
    let (a, b) = (unit(0), unit(1));
    ((-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ramp with noise of its own: `shift` picks the numbers.
    fn noisy(sd: f32, shift: u64) -> Picture {
        let pixel = |i: u64| Rgb::splat(0.2 + 0.0002 * i as f32 + sd * normal(shift + i));
        Picture {
            width: 48,
            height: 40,
            pixels: (0..48 * 40).map(pixel).collect(),
        }
    }

    #[test]
    fn the_floor_is_what_noise_makes_against_the_truth() {
        let truth = noisy(0.0, 0);
        for sd in [0.003f32, 0.01, 0.03] {
            let reference = Reference {
                picture: noisy(sd, 1 << 20),
                variance: Some(vec![Rgb::splat(sd * sd); 48 * 40]),
            };
            let floor = floor(&reference).unwrap();
            let actual = flip::hdr(&truth, &reference.picture, flip::DEFAULT_PPD).mean;
            // Two draws of 1,920 pixels each, and the exposures that noise changes.
            assert!(
                (0.8..1.25).contains(&(floor / actual)),
                "{sd}: {floor} {actual}"
            );
        }
    }

    #[test]
    fn an_exact_reference_has_floor_zero_and_an_unknown_one_none() {
        let picture = noisy(0.0, 0);
        assert_eq!(floor(&Reference::exact(picture.clone())), None);
        let variance = Some(vec![Rgb::BLACK; picture.pixels.len()]);
        let exact = Reference { picture, variance };
        assert_eq!(floor(&exact), Some(0.0));
    }
}

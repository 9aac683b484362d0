//! Pictures made of formulas and of noise that other languages reproduce exactly.

use luxel::math::Rgb;
use luxel::study::Picture;

/// A fixed mixing of 32 bits (Wellons' "lowbias32"): noise that other languages reproduce exactly.
fn hash(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Uniform in [0, 1), f64 as numpy computes it.
pub fn noise(i: usize) -> f64 {
    f64::from(hash(i as u32)) / 4_294_967_296.0
}

pub fn make(width: usize, height: usize, colour: impl Fn(usize, usize) -> [f64; 3]) -> Picture {
    let pixel = |i: usize| Rgb::from_array(colour(i % width, i / width).map(|v| v as f32));
    Picture {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
    }
}

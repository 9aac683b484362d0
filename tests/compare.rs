//! Comparison figures against values computed once by other programs, and the command's verdicts.

use luxel::math::Rgb;
use luxel::study::{Picture, flip};

/// A fixed mixing of 32 bits (Wellons' "lowbias32"): noise that other languages reproduce exactly.
fn hash(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Uniform in [0, 1), f64 as numpy computes it.
fn noise(i: usize) -> f64 {
    f64::from(hash(i as u32)) / 4_294_967_296.0
}

fn make(width: usize, height: usize, colour: impl Fn(usize, usize) -> [f64; 3]) -> Picture {
    let pixel = |i: usize| Rgb::from_array(colour(i % width, i / width).map(|v| v as f32));
    Picture {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
    }
}

const WIDTH: usize = 96;
const HEIGHT: usize = 64;

fn pattern(x: usize, y: usize) -> [f64; 3] {
    let check = ((x / 8 + y / 8) % 2) as f64 * 0.8;
    [x as f64 / WIDTH as f64, y as f64 / HEIGHT as f64, check]
}

fn noise_at(x: usize, y: usize, c: usize) -> f64 {
    noise((y * WIDTH + x) * 3 + c)
}

/// Pictures of `width x height` with a range of 8 stops, and the same times noise of 0.5 to 1.5.
fn ramp(width: usize, height: usize, black_until: usize) -> (Picture, Picture) {
    let reference = |x: usize, y: usize| {
        let gain = if x < black_until { 0.0 } else { 1.0 };
        let f = (x as f64 / WIDTH as f64 * 8.0 - 3.0).exp2();
        pattern(x, y).map(|v| gain * f64::from((f64::from(v as f32) * f + 0.01) as f32))
    };
    let noisy = |x: usize, y: usize| {
        let lit = reference_lit(x, y);
        let gain = if x < black_until { 0.1f32 } else { 1.0 };
        let c = |c: usize| f64::from((lit[c] * (0.5 + noise_at(x, y, c))) as f32 * gain);
        [c(0), c(1), c(2)]
    };
    (make(width, height, reference), make(width, height, noisy))
}

fn reference_lit(x: usize, y: usize) -> [f64; 3] {
    let f = (x as f64 / WIDTH as f64 * 8.0 - 3.0).exp2();
    pattern(x, y).map(|v| f64::from((f64::from(v as f32) * f + 0.01) as f32))
}

#[track_caller]
fn close(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-4, "{a} is not {b}");
}

#[test]
fn flip_agrees_with_the_authors_program() {
    // Figures of flip-evaluator 1.7 for the same numbers.
    let reference = make(WIDTH, HEIGHT, pattern);
    let noisy = make(WIDTH, HEIGHT, |x, y| {
        let base = pattern(x, y);
        let c = |c: usize| {
            (f64::from(base[c] as f32) + 0.3 * (noise_at(x, y, c) - 0.5)).clamp(0.0, 1.0)
        };
        [c(0), c(1), c(2)]
    });
    let ldr = flip::ldr(&noisy, &reference, flip::DEFAULT_PPD);
    close(ldr.mean, 0.165_516);
    close(ldr.map[10 * WIDTH + 20].into(), 0.300_923);
    close(ldr.map[40 * WIDTH + 70].into(), 0.131_604);

    let (reference, noisy) = ramp(WIDTH, HEIGHT, 0);
    let hdr = flip::hdr(&noisy, &reference, flip::DEFAULT_PPD);
    close(hdr.mean, 0.162_910);
    close(hdr.map[10 * WIDTH + 20].into(), 0.223_614);
    close(hdr.map[40 * WIDTH + 70].into(), 0.120_282);
    // An odd number of pixels has another median.
    let (reference, noisy) = ramp(95, 63, 0);
    close(
        flip::hdr(&noisy, &reference, flip::DEFAULT_PPD).mean,
        0.162_905,
    );
    // Mostly black: the median has no exposure of its own.
    let (reference, noisy) = ramp(WIDTH, HEIGHT, 60);
    close(
        flip::hdr(&noisy, &reference, flip::DEFAULT_PPD).mean,
        0.697_800,
    );
}

#[test]
fn flip_of_small_and_constant_pictures() {
    let grey = make(8, 8, |_, _| [0.5; 3]);
    let dot = make(8, 8, |x, y| match (x, y) {
        (4, 4) => [1.0, 0.0, 0.0],
        _ => [0.5; 3],
    });
    let flip = flip::ldr(&dot, &grey, flip::DEFAULT_PPD);
    close(flip.mean, 0.059_382);
    close(flip.map[4 * 8 + 4].into(), 0.301_774);
    close(flip.map[0].into(), 0.008_186);
    assert_eq!(flip::hdr(&grey, &grey, flip::DEFAULT_PPD).mean, 0.0);
    let black = make(8, 8, |_, _| [0.0; 3]);
    let seen = flip::hdr(&grey, &black, flip::DEFAULT_PPD).mean;
    assert!(seen > 0.5 && seen <= 1.0, "{seen}");
}

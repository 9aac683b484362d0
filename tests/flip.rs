//! FLIP against figures of the program of its authors.

#[path = "common/pictures.rs"]
mod pictures;

use luxel::study::{Picture, flip};
use pictures::{make, noise};

const WIDTH: usize = 96;
const HEIGHT: usize = 64;

fn pattern(x: usize, y: usize) -> [f64; 3] {
    let check = ((x / 8 + y / 8) % 2) as f64 * 0.8;
    [x as f64 / WIDTH as f64, y as f64 / HEIGHT as f64, check]
}

fn noise_at(x: usize, y: usize, c: usize) -> f64 {
    noise((y * WIDTH + x) * 3 + c)
}

/// Pictures of `width x height` with a range of 8 stops, and the same times noise of 0.5 to 1.5. Left
/// of column `black_until` the reference is black and the other a tenth as bright.
fn ramp(width: usize, height: usize, black_until: usize) -> (Picture, Picture) {
    let lit = |x: usize, y: usize| {
        let gain = (x as f64 / WIDTH as f64 * 8.0 - 3.0).exp2();
        pattern(x, y).map(|v| (f64::from(v as f32) * gain + 0.01) as f32)
    };
    let reference = |x: usize, y: usize| match x < black_until {
        true => [0.0; 3],
        false => lit(x, y).map(f64::from),
    };
    let noisy = |x: usize, y: usize| {
        let gain = if x < black_until { 0.1f32 } else { 1.0 };
        let lit = lit(x, y);
        let c = |c: usize| (f64::from(lit[c]) * (0.5 + noise_at(x, y, c))) as f32 * gain;
        [c(0), c(1), c(2)].map(f64::from)
    };
    (make(width, height, reference), make(width, height, noisy))
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

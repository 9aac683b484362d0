use super::*;
use crate::sampler::mix;

/// Independent numbers of mean 0 and variance 1 (a sum of twelve uniform ones, Irwin-Hall).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f32 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 += 1;
            sum += (mix(self.0) >> 40) as f64 / (1u64 << 24) as f64;
        }
        (sum - 6.0) as f32
    }

    fn picture(&mut self, size: usize, mean: impl Fn(usize) -> f32, sd: f32) -> Picture {
        let pixels = (0..size).map(|i| {
            let mut channel = || mean(i) + sd * self.next();
            Rgb::new(channel(), channel(), channel())
        });
        Picture {
            width: size,
            height: 1,
            pixels: pixels.collect(),
        }
    }
}

const PIXELS: usize = 40;

fn truth(i: usize) -> f32 {
    0.5 + 0.01 * i as f32
}

/// A study of runs with known bias and noise, judged by a reference with noise of its own.
fn moments(noise: &mut Noise, runs: usize, bias: f32, sd: f32, of_reference: f32) -> Moments {
    let picture = noise.picture(PIXELS, truth, of_reference);
    let variance = vec![Rgb::splat(of_reference * of_reference); PIXELS];
    let reference = Reference {
        picture,
        variance: Some(variance),
    };
    // A bias of either sign.
    let wrong = |i: usize| truth(i) + if i.is_multiple_of(2) { bias } else { -bias };
    let pictures: Vec<Picture> = (0..runs)
        .map(|_| noise.picture(PIXELS, wrong, sd))
        .collect();
    let gram = Gram::of(&pictures, &reference, Weighing::Absolute);
    let mean = mean_picture(&pictures);
    Moments::of(&gram, &reference, &mean, Weighing::Absolute)
}

/// How often each interval (error, bias², variance) holds the truth, and the means of the figures.
fn coverage(
    studies: usize,
    runs: usize,
    bias: f32,
    sd: f32,
    of_reference: f32,
) -> ([f64; 3], [f64; 3]) {
    let mut noise = Noise(77);
    let (bias2, variance) = (f64::from(bias).powi(2), f64::from(sd).powi(2));
    let truth = [bias2 + variance, bias2, variance];
    let (mut held, mut mean) = ([0.0; 3], [0.0; 3]);
    for _ in 0..studies {
        let m = moments(&mut noise, runs, bias, sd, of_reference);
        for (k, e) in [m.mse, m.bias2, m.variance].iter().enumerate() {
            held[k] += f64::from(u8::from(e.low <= truth[k] && truth[k] <= e.high));
            mean[k] += e.value / studies as f64;
        }
    }
    (held.map(|h| h / studies as f64), mean)
}

#[test]
fn intervals_hold_the_truth() {
    // Without bias, with some, with much; with an exact and with a noisy reference; with few runs and many.
    for (runs, bias, sd, of_reference) in [
        (8, 0.0, 0.1, 0.0),
        (8, 0.0, 0.1, 0.03),
        (8, 0.03, 0.1, 0.01),
        (4, 0.1, 0.1, 0.0),
        (4, 0.0, 0.1, 0.0),
        (3, 0.05, 0.1, 0.0),
        (24, 0.02, 0.1, 0.0),
    ] {
        let (held, mean) = coverage(400, runs, bias, sd, of_reference);
        for (name, share) in ["error", "bias", "variance"].iter().zip(held) {
            // 400 intervals of 95 %: standard deviation 1.1 %. More is allowed, as the reference's part is a
            // bound and as Student's t of few runs is wide where pairs, which are more, decide.
            assert!(
                share >= 0.92,
                "{runs} runs, bias {bias}, {of_reference}: {name} {share}"
            );
        }
        // The figures themselves are not biased: their means over 400 studies, within 4 standard errors
        // (one study of this many values knows a square of size s to about s sqrt(2 / values)).
        let values = (runs * PIXELS * 3) as f64;
        let size = f64::from(bias).powi(2) + f64::from(sd).powi(2);
        let close = 4.0 * size * (6.0 / values).sqrt() / 20.0;
        assert!(
            (mean[1] - f64::from(bias).powi(2)).abs() < close,
            "{mean:?}"
        );
        assert!((mean[2] - f64::from(sd).powi(2)).abs() < close, "{mean:?}");
    }
}

#[test]
fn intervals_are_not_wider_than_they_need_to_be() {
    // Pairs of 8 runs know a bias² of 0 to sd² sqrt(2 / (56 * 120)); Student's t makes 2.36 of it.
    let mut noise = Noise(5);
    let widths: Vec<f64> = (0..200)
        .map(|_| {
            let m = moments(&mut noise, 8, 0.0, 0.1, 0.0);
            (m.bias2.high - m.bias2.low) / 2.0
        })
        .collect();
    let mean = widths.iter().sum::<f64>() / 200.0;
    let expected = 2.36 * 0.01 * (2.0f64 / (56.0 * 120.0)).sqrt();
    assert!(
        (0.8..1.4).contains(&(mean / expected)),
        "{}",
        mean / expected
    );
}

#[test]
fn equal_pictures_have_no_error() {
    let grey = Picture {
        width: 4,
        height: 1,
        pixels: vec![Rgb::splat(0.25); 4],
    };
    let reference = Reference {
        picture: grey.clone(),
        variance: Some(vec![Rgb::BLACK; 4]),
    };
    let pictures = vec![grey; 5];
    let gram = Gram::of(&pictures, &reference, Weighing::Relative);
    let m = Moments::of(
        &gram,
        &reference,
        &mean_picture(&pictures),
        Weighing::Relative,
    );
    let zero = Estimate::exact(0.0);
    assert_eq!((m.mse, m.bias2, m.variance), (zero, zero, zero));
    assert_eq!(brightness(&pictures, &reference), Some(zero));
}

#[test]
fn slopes_have_honest_intervals() {
    // Noise that falls by the root: 150 studies of 5 settings with 6 runs each.
    let mut noise = Noise(1234);
    let mut held = 0;
    for _ in 0..150 {
        let points: Vec<_> = (0..5)
            .map(|k| {
                let spp = f64::from(1 << k);
                let m = moments(&mut noise, 6, 0.0, 0.2 / spp.sqrt() as f32, 0.0);
                (spp, m.mse, 6)
            })
            .collect();
        let slope = crate::study::fit::line(points.into_iter()).unwrap().slope;
        held += u32::from(slope.low <= -0.5 && -0.5 <= slope.high);
    }
    // Binomial(150, 0.95): standard deviation 2.7; three of them below the mean.
    assert!(held >= 134, "{held} of 150");
}

#[test]
fn a_noisy_reference_does_not_bias_what_is_judged_by_it() {
    // A reference only twice as good as one run, some of the pixels as dark as its noise: the weights of relMSE, too,
    // are noisy then. Truth is the same study judged by the exact picture.
    let dark = |i: usize| 0.02 + 0.03 * i as f32;
    let exact = Reference::exact(Picture {
        width: PIXELS,
        height: 1,
        pixels: (0..PIXELS).map(|i| Rgb::splat(dark(i))).collect(),
    });
    let of_reference = 0.025f32;
    let mut noise = Noise(4711);
    for weighing in [Weighing::Absolute, Weighing::Relative] {
        for bias in [0.0, 0.04] {
            let (mut held, mut sums, mut off) = ([0; 2], [0.0; 2], [0.0; 2]);
            const STUDIES: usize = 400;
            for _ in 0..STUDIES {
                let wrong = |i: usize| dark(i) + if i % 4 < 2 { bias } else { -bias };
                let runs: Vec<Picture> =
                    (0..8).map(|_| noise.picture(PIXELS, wrong, 0.05)).collect();
                let noisy = Reference {
                    picture: noise.picture(PIXELS, dark, of_reference),
                    variance: Some(vec![Rgb::splat(of_reference * of_reference); PIXELS]),
                };
                let mean = mean_picture(&runs);
                let by =
                    |r: &Reference| Moments::of(&Gram::of(&runs, r, weighing), r, &mean, weighing);
                let (m, best) = (by(&noisy), by(&exact));
                for (k, (e, best)) in [(m.mse, best.mse), (m.bias2, best.bias2)]
                    .iter()
                    .enumerate()
                {
                    sums[k] += best.value / STUDIES as f64;
                    off[k] += (e.value - best.value) / STUDIES as f64;
                }
                // Truth: noise of all runs is the same, the bias squared in the mean of the weights.
                let weights: f64 = (0..PIXELS)
                    .map(|i| weighing.weight(f64::from(dark(i)), 0.0))
                    .sum::<f64>()
                    / PIXELS as f64;
                let square = f64::from(bias).powi(2);
                let truths = [weights * (square + 0.0025), weights * square];
                for (k, e) in [m.mse, m.bias2].iter().enumerate() {
                    held[k] += usize::from(e.low <= truths[k] && truths[k] <= e.high);
                }
            }
            println!("{weighing:?} {bias}: held {held:?}, off {off:?} of {sums:?}");
            for k in 0..2 {
                // Binomial(400, 0.95): 13 is three standard deviations below the mean of 380, and little more.
                assert!(held[k] >= 365, "{weighing:?}, bias {bias}: {held:?}");
                // Of the error; without the reference's noise taken off it would be 25 % of it.
                assert!(
                    off[k].abs() < 0.02 * sums[0],
                    "{weighing:?}, bias {bias}: {off:?} of {sums:?}"
                );
            }
        }
    }
}

#[test]
fn few_runs_say_little_but_no_nonsense() {
    let mut noise = Noise(9);
    for runs in 1..=2 {
        let m = moments(&mut noise, runs, 0.0, 0.1, 0.01);
        for e in [m.mse, m.bias2, m.variance] {
            assert!(
                e.value.is_finite() && e.low == 0.0 && e.high > e.value,
                "{runs}: {e:?}"
            );
        }
        let point = crate::study::fit::FitPoint {
            spp: 4.0,
            seconds: 0.1,
            runs,
            mse: m.mse,
            bias2: m.bias2,
            variance: m.variance,
        };
        let c = crate::study::fit::Convergence::of(
            &[point, crate::study::fit::FitPoint { spp: 8.0, ..point }],
            false,
        );
        if let Some(line) = c.error {
            assert!(line.slope.value.is_finite(), "{line:?}");
        }
        assert!(!format!("{:?}", c.forecast(0.01)).contains("NaN"));
    }
}

#[test]
fn ends_of_errors_are_not_below_zero() {
    // Three numbers of a wide spread: Student's t alone would end below zero.
    let squares = Estimate::mean_of_squares(&[0.1, 1.0, 4.0]);
    assert!(
        squares.low > 0.0 && squares.low < 1.0 && squares.high > 4.0,
        "{squares:?}"
    );
    let seconds = Estimate::mean_of(&[0.001, 0.2, 0.003]);
    assert!(seconds.low < 0.0 && seconds.above_zero().low > 0.0);
    assert_eq!(seconds.above_zero().high, seconds.high);
    // An error that is lost in the reference's noise.
    let mut noise = Noise(3);
    for _ in 0..50 {
        let m = moments(&mut noise, 4, 0.0, 0.003, 0.1);
        assert!(m.mse.low >= 0.0 && m.mse.low <= m.mse.value, "{:?}", m.mse);
    }
}

#[test]
fn squares_far_below_zero_do_not_prove_a_small_root() {
    // -3 ± 2 standard deviations: the whole interval is below zero.
    let root = Estimate::new(-3e-4, 1e-4, 2.0).root();
    assert_eq!((root.value, root.low), (0.0, 0.0));
    assert!((root.high - 1.96e-4f64.sqrt()).abs() < 1e-12, "{root:?}");
    assert_eq!(Estimate::exact(0.0).root().high, 0.0);
    // What is known to be above zero keeps its interval.
    let seen = Estimate::new(4e-4, 1e-4, 2.0).root();
    assert!((seen.high - 6e-4f64.sqrt()).abs() < 1e-12);
}

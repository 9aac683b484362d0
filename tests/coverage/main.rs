//! How often what is said about an error is true: the interval that `luxel render` prints for a picture, and the
//! intervals of studies, on ten scenes. The truth is a render of many more samples, whose own error is taken off.

#[path = "../common/render.rs"]
mod render;
mod scenes;

use luxel::film::Film;
use luxel::format::{Compiled, Overrides};
use luxel::math::Rgb;
use luxel::study::Picture;
use luxel::study::fit::line;
use luxel::study::statistics::Estimate;
use luxel::study::statistics::{Gram, Moments, Reference, Weighing, mean_picture};
use scenes::{Case, SIDE, cases, hard_cases};

fn compiled(case: &Case, seed: u64) -> Compiled {
    let overrides = Overrides {
        integrator: Some(case.integrator.to_string()),
        sampler: Some(case.sampler.to_string()),
        seed: Some(seed),
        ..Overrides::default()
    };
    render::compile_with(&case.xml, &overrides)
}

fn film(case: &Case, spp: u64, seed: u64) -> Film {
    render::render(&compiled(case, seed), spp).0
}

fn to_picture(pixels: &[[f64; 3]]) -> Picture {
    Picture {
        width: SIDE as usize,
        height: SIDE as usize,
        pixels: pixels
            .iter()
            .map(|p| Rgb::from_array(p.map(|v| v as f32)))
            .collect(),
    }
}

/// A much longer render, with its own variance.
fn truth(case: &Case, spp: u64) -> Reference {
    let film = film(case, spp, 1 << 40);
    let squares = film
        .standard_error()
        .iter()
        .map(|s| Rgb::from_array(s.map(|s| (s * s) as f32)))
        .collect();
    Reference {
        picture: to_picture(&film.mean()),
        variance: Some(squares),
    }
}

/// relMSE of a picture, less what the reference's own noise adds.
fn relmse(picture: &Picture, truth: &Reference) -> f64 {
    let gram = Gram::of(std::slice::from_ref(picture), truth, Weighing::Relative);
    gram.squares()[0] - truth.error(Weighing::Relative)
}

/// Of the printed intervals of relMSE, how many hold the actual one; and the root of the mean of what is printed over
/// that of what is true.
fn printed(case: &Case, truth: &Reference, spp: u64, seeds: u64) -> (u64, f64) {
    let (mut held, mut told, mut found) = (0, 0.0, 0.0);
    for seed in 0..seeds {
        let film = film(case, spp, seed);
        let estimate = film.estimate_error().expect("enough samples for an error");
        let actual = relmse(&to_picture(&film.mean()), truth);
        held += u64::from(estimate.ci95[0] <= actual && actual <= estimate.ci95[1]);
        told += estimate.relmse;
        found += actual;
    }
    (held, (told / found).sqrt())
}

/// Share of the studies whose interval holds the truth: of RMSE, of relative error, of bias, of the slope.
fn studies(case: &Case, truth: &Reference, studies: u64, runs: u64) -> [f64; 4] {
    let amounts = [4u64, 8, 16, 32];
    let mut of_amounts = Vec::new();
    for spp in amounts {
        let pictures: Vec<Picture> = (0..studies * runs)
            .map(|i| to_picture(&film(case, spp, (spp << 32) + i).mean()))
            .collect();
        of_amounts.push(pictures);
    }
    let weighings = [Weighing::Absolute, Weighing::Relative];
    let true_mse: Vec<[f64; 2]> = of_amounts
        .iter()
        .map(|pictures| {
            weighings.map(|w| {
                let mut sum = 0.0;
                for p in pictures {
                    sum += Gram::of(std::slice::from_ref(p), truth, w).squares()[0];
                }
                sum / pictures.len() as f64 - truth.error(w)
            })
        })
        .collect();
    let mut held = [0.0; 4];
    let mut slopes = Vec::new();
    for s in 0..studies as usize {
        let of = |pictures: &[Picture], w| {
            let own = &pictures[s * runs as usize..(s + 1) * runs as usize];
            let gram = Gram::of(own, truth, w);
            Moments::of(&gram, truth, &mean_picture(own), w)
        };
        let mut points = Vec::new();
        for (k, pictures) in of_amounts.iter().enumerate() {
            let absolute = of(pictures, Weighing::Absolute);
            let relative = of(pictures, Weighing::Relative);
            let holds = |e: Estimate, t: f64| e.low <= t && t <= e.high;
            held[0] += f64::from(u8::from(holds(absolute.mse, true_mse[k][0]))) / 4.0;
            held[1] += f64::from(u8::from(holds(relative.mse, true_mse[k][1]))) / 4.0;
            // What is printed is cut off at zero.
            held[2] += f64::from(u8::from(relative.bias2.low <= 0.0)) / 4.0;
            points.push((amounts[k] as f64, relative.mse, runs as usize));
        }
        slopes.push(line(points.into_iter()).expect("a slope").slope);
    }
    // Of all runs together, every amount alike.
    let of_all = true_mse.iter().zip(amounts).map(|(m, n)| {
        let e = Estimate::new(m[1], 0.1 * m[1], 1.96);
        (n as f64, e, 8)
    });
    let slope = match case.sampler {
        "independent" => -0.5,
        _ => line(of_all).expect("a slope").slope.value,
    };
    for s in slopes {
        held[3] += f64::from(u8::from(s.low <= slope && slope <= s.high));
    }
    held.map(|h| h / studies as f64)
}

#[test]
fn what_is_printed_of_the_error_is_true() {
    let (mut held, mut all) = (0, 0);
    for case in cases() {
        // Where a few pixels at edges make the error, it takes more pictures to know it; walks from both ends have
        // noise everywhere, and cost most.
        let seeds = match (case.integrator, case.name) {
            ("bdpt", _) => 12,
            (_, "room") => 24,
            _ => 40,
        };
        let truth = truth(&case, 2048);
        let (of_case, ratio) = printed(&case, &truth, 256, seeds);
        println!(
            "{}: {of_case} of {seeds}, printed / true {ratio:.3}",
            case.name
        );
        // Binomial(12, 0.95) is below 8 once in 4,000, Binomial(40, 0.95) below 32 once in 2,500.
        assert!(
            3 * of_case >= 2 * seeds,
            "{}: {of_case} of {seeds}",
            case.name
        );
        // What is promised. Pictures of 100 pixels, a tenth of which counts, know their true error to
        // √(2 / (10 * 40)) / 2 = 4 %.
        assert!((ratio - 1.0).abs() < 0.1, "{}: {ratio}", case.name);
        (held, all) = (held + of_case, all + seeds);
    }
    // Binomial(328, 0.95): 312 with a standard deviation of 3.9. These do not hold that: where a few pixels make most of
    // the error (plastic, many lamps), no symmetric interval suits. 285, 87 %, is what is promised instead; 296 were
    // measured, with a standard deviation of 5.4.
    assert_eq!(all, 328);
    assert!(held >= 285, "{held} of {all}");
}

/// The table of the shares of intervals that hold, printed. A minute or two: `cargo test --release --test coverage --
/// --ignored --nocapture`.
#[test]
#[ignore = "takes minutes; prints a table"]
fn measure() {
    println!(
        "scene | printed 64 spp | 256 spp | told/true 64 | 256 || RMSE | error | bias | slope"
    );
    for case in cases().into_iter().chain(hard_cases()) {
        let start = std::time::Instant::now();
        let truth = truth(&case, 16 * 1024);
        let t1 = start.elapsed().as_secs_f64();
        let (a, ra) = printed(&case, &truth, 64, 40);
        let (b, rb) = printed(&case, &truth, 256, 40);
        let s = studies(&case, &truth, 40, 8);
        println!(
            "{:24} | {:5.1} % | {:5.1} % | {ra:.3} | {rb:.3} || {:.1} | {:.1} | {:.1} | {:.1}   ({t1:.1} + {:.1} s; mean {:.3}, error {:.4})",
            case.name,
            100.0 * a as f64 / 40.0,
            100.0 * b as f64 / 40.0,
            100.0 * s[0],
            100.0 * s[1],
            100.0 * s[2],
            100.0 * s[3],
            start.elapsed().as_secs_f64() - t1,
            truth
                .picture
                .pixels
                .iter()
                .map(|p| f64::from(p.luminance()))
                .sum::<f64>()
                / f64::from(SIDE * SIDE),
            truth.error(Weighing::Relative).sqrt(),
        );
    }
}

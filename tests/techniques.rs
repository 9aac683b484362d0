//! Statistics of techniques: they add up to the picture, and do not depend on threads.

mod common;
#[path = "common/render.rs"]
mod render;

use common::Rng;
use luxel::film::{Film, PartMoments, Window};
use luxel::format::Overrides;
use luxel::math::Rgb;
use luxel::render::{Stop, TechniqueStats};

const SCENE: &str = include_str!("../scenes/cornell-balls.xml");

/// The Cornell box by `integrator`: mean luminance of the picture, and its parts.
fn rendered(integrator: &str, spp: u64, threads: usize) -> (f64, Vec<(f64, TechniqueStats)>) {
    let overrides = Overrides {
        integrator: Some(integrator.to_string()),
        resolution: Some([24, 24]),
        ..Overrides::default()
    };
    let compiled = render::compile_with(SCENE, &overrides);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let (film, stats) = pool.unwrap().install(|| {
        let mut film = compiled.job.new_film(Stop::Spp(spp));
        let stats = compiled.job.add_samples(&mut film, spp).unwrap();
        (film, stats)
    });
    let luminance = |v: &[f64; 3]| f64::from(Rgb::from_array(v.map(|v| v as f32)).luminance());
    let mean = film.mean();
    let mean = mean.iter().map(luminance).sum::<f64>() / mean.len() as f64;
    let techniques = compiled.job.technique_stats(&film, &stats);
    assert_eq!(film.parts(), techniques.len());
    let parts = (0..techniques.len()).map(|i| film.part_moments(i).mean);
    (mean, parts.zip(techniques).collect())
}

#[test]
fn techniques_add_up_to_the_picture() {
    for integrator in ["bdpt", "ptracer", "vcm", "sppm", "combined"] {
        let (mean, parts) = rendered(integrator, 16, 2);
        assert!(parts.len() >= 2, "{integrator}");
        let sum: f64 = parts.iter().map(|(part, _)| part).sum();
        let ratio = sum / mean;
        assert!((ratio - 1.0).abs() < 1e-4, "{integrator}: {ratio}");
        let shares: f64 = parts.iter().map(|(_, t)| t.energy_share).sum();
        assert!((shares - 1.0).abs() < 1e-12, "{integrator}: {shares}");
        for (_, t) in &parts {
            assert!(
                t.energy_share > 0.0 && t.variance > Some(0.0),
                "{integrator}: {t:?}"
            );
            let alone = !["emission", "path"].contains(&t.name);
            assert_eq!(t.rays > 0, alone, "{integrator}: {t:?}");
        }
    }
}

#[test]
fn a_single_technique_is_not_told_apart() {
    for integrator in ["path", "direct"] {
        assert!(rendered(integrator, 2, 1).1.is_empty());
    }
}

#[test]
fn threads_change_no_statistic() {
    for integrator in ["vcm", "combined"] {
        let one = rendered(integrator, 4, 1);
        assert!(one == rendered(integrator, 4, 3), "{integrator}");
    }
}

/// Samples of known mean and variance, different from pixel to pixel.
#[test]
fn moments_are_those_of_the_samples() {
    let window = Window {
        x: 0,
        y: 0,
        width: 40,
        height: 30,
    };
    let mut film = Film::new(window, 4, 0).with_parts(2);
    assert_eq!(
        film.part_moments(1),
        PartMoments {
            mean: 0.0,
            variance: None
        }
    );
    let mut rng = Rng::new(8);
    let n = 200;
    for _ in 0..n {
        // Uniform over an interval as long as the row is far down, from 3 on.
        let values: Vec<f64> = (0..40 * 30)
            .map(|i| 3.0 + f64::from(rng.f32()) * (i / 40) as f64)
            .collect();
        film.add_part_everywhere(1, &values);
        film.finish_pass(1);
    }
    let rows = |f: fn(f64) -> f64| (0..30).map(|y| f(f64::from(y))).sum::<f64>() / 30.0;
    let PartMoments { mean, variance } = film.part_moments(1);
    // 240,000 numbers: both are right to a tenth of a percent, with four standard errors to spare.
    let (expected, expected_variance) = (rows(|y| 3.0 + 0.5 * y), rows(|y| y * y / 12.0));
    assert!((mean / expected - 1.0).abs() < 4e-3, "{mean} {expected}");
    let variance = variance.unwrap();
    assert!(
        (variance / expected_variance - 1.0).abs() < 1e-2,
        "{variance} {expected_variance}"
    );
    assert_eq!(film.part_moments(0).variance, Some(0.0));
}

//! What choosing by the light tree gains over choosing all lights alike, on ten thousand of them.

#[path = "common/render.rs"]
mod render;

use std::path::Path;

use luxel::format::{self, Compiled, Overrides};
use luxel::light::Strategy;
use luxel::transport::IntegratorSpec;

fn scene(strategy: Strategy, res: u32, seed: u64) -> Compiled {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/many-lights.xml");
    let defines = [("res".to_string(), res.to_string())];
    let desc = format::load(&path, &defines).unwrap_or_else(|e| panic!("{e}"));
    let overrides = Overrides {
        seed: Some(seed),
        ..Overrides::default()
    };
    let mut compiled = format::compile(&desc, &overrides).unwrap_or_else(|e| panic!("{e}"));
    compiled.job.scene.choose_lights_by(strategy);
    // The outlines of the lanterns are as rough with any choice.
    if let IntegratorSpec::Path(path) = &mut compiled.job.integrator {
        path.hide_emitters = true;
    }
    compiled
}

/// Green of a picture, and the seconds it took.
fn picture(strategy: Strategy, res: u32, spp: u64, seed: u64) -> (Vec<f64>, f64) {
    let compiled = scene(strategy, res, seed);
    let begun = std::time::Instant::now();
    let film = render::render(&compiled, spp).0;
    let seconds = begun.elapsed().as_secs_f64();
    (film.mean().iter().map(|c| c[1]).collect(), seconds)
}

/// Variance of a picture relative to the square of `reference`, mean over the pixels, from two independent
/// ones; and seconds per picture.
fn noise(strategy: Strategy, res: u32, spp: u64, reference: &[f64]) -> (f64, f64) {
    let (a, seconds_a) = picture(strategy, res, spp, 1);
    let (b, seconds_b) = picture(strategy, res, spp, 2);
    let sum: f64 = a
        .iter()
        .zip(&b)
        .zip(reference)
        // Where nothing but the background shows there is no noise to speak of.
        .map(|((a, b), mean)| 0.5 * (a - b).powi(2) / (mean * mean + 1e-4))
        .sum();
    (sum / a.len() as f64, 0.5 * (seconds_a + seconds_b))
}

#[test]
fn the_tree_is_far_ahead_of_a_choice_of_all_alike() {
    let reference = picture(Strategy::Auto, 40, 48, 3).0;
    let (tree, _) = noise(Strategy::Auto, 40, 8, &reference);
    let (uniform, _) = noise(Strategy::Uniform, 40, 8, &reference);
    println!("variance: all alike / tree = {}", uniform / tree);
    assert!(uniform > 3.0 * tree, "{uniform} against {tree}");
}

/// Run with `cargo test --release --test many_lights -- --ignored --nocapture`.
#[test]
#[ignore = "measures and prints; it checks nothing"]
fn measure_the_gain_at_equal_time() {
    let reference = picture(Strategy::Auto, 128, 256, 3).0;
    for spp in [16, 64] {
        let (tree, tree_s) = noise(Strategy::Auto, 128, spp, &reference);
        for strategy in [Strategy::Uniform, Strategy::Power] {
            let (other, other_s) = noise(strategy, 128, spp, &reference);
            println!(
                "{spp} samples, {strategy:?}: variance {:.1} times that of the tree, seconds {other_s:.2} against \
                 {tree_s:.2}, at equal time {:.1}",
                other / tree,
                other / tree * other_s / tree_s
            );
        }
    }
}

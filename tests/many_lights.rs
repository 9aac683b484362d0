//! What choosing by the light tree gains over choosing all lights alike, on ten thousand of them.

#[path = "common/render.rs"]
mod render;

use std::path::Path;

use luxel::format::{self, Compiled, Overrides};
use luxel::light::Strategy;

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
    compiled
}

/// Relative variance of a picture, mean over the pixels, from two independent ones; and seconds per picture.
fn noise(strategy: Strategy, res: u32, spp: u64) -> (f64, f64) {
    let mut seconds = 0.0;
    let [a, b] = [1, 2].map(|seed| {
        let compiled = scene(strategy, res, seed);
        let begun = std::time::Instant::now();
        let film = render::render(&compiled, spp).0;
        seconds += 0.5 * begun.elapsed().as_secs_f64();
        film.mean()
    });
    let relative = |(a, b): (&[f64; 3], &[f64; 3])| {
        let mean = 0.5 * (a[1] + b[1]);
        // What shows a lamp, or nothing at all, has no noise to speak of.
        0.5 * (a[1] - b[1]).powi(2) / (mean * mean + 1e-6)
    };
    let sum: f64 = a.iter().zip(&b).map(relative).sum();
    (sum / a.len() as f64, seconds)
}

#[test]
fn the_tree_is_far_ahead_of_a_choice_of_all_alike() {
    let (tree, _) = noise(Strategy::Auto, 48, 8);
    let (uniform, _) = noise(Strategy::Uniform, 48, 8);
    println!("variance: all alike / tree = {}", uniform / tree);
    assert!(uniform > 3.0 * tree, "{uniform} against {tree}");
}

/// Run with `cargo test --release --test many_lights -- --ignored --nocapture`.
#[test]
#[ignore = "measures and prints; it checks nothing"]
fn measure_the_gain_at_equal_time() {
    for spp in [16, 64, 256] {
        let (tree, tree_s) = noise(Strategy::Auto, 160, spp);
        for strategy in [Strategy::Uniform, Strategy::Power] {
            let (other, other_s) = noise(strategy, 160, spp);
            println!(
                "{spp} samples, {strategy:?}: variance {:.1} times that of the tree, seconds {other_s:.2} against \
                 {tree_s:.2}, at equal time {:.1}",
                other / tree,
                other / tree * other_s / tree_s
            );
        }
    }
}

//! The hierarchical solver against the direct solution of the same scene with the same squares.

#[path = "../common/render.rs"]
mod render;

mod furnace;
mod rooms;

use luxel::math::DVec2;
use luxel::radiosity::{self, FormFactorMethod, Rgb64, Solution, SolveSpec, Solver};
use luxel::scene::Scene;
use std::ops::ControlFlow;

fn solve(scene: &Scene, spec: &SolveSpec) -> Solution {
    let go = &mut |_: &radiosity::Progress| ControlFlow::Continue(());
    radiosity::solve(scene, spec, go).unwrap_or_else(|e| panic!("{e}"))
}

fn direct(scene: &Scene, size: f64, samples: u32) -> Solution {
    solve(
        scene,
        &SolveSpec {
            solver: Solver::GaussSeidel,
            form_factors: FormFactorMethod::Analytic { samples },
            patch_size: Some(size),
            residual: 1e-9,
            ..SolveSpec::default()
        },
    )
}

fn hierarchical(scene: &Scene, error: f64, patch_size: Option<f64>, min_size: f64) -> Solution {
    solve(
        scene,
        &SolveSpec {
            error,
            patch_size,
            min_size: Some(min_size),
            residual: 1e-6,
            ..SolveSpec::default()
        },
    )
}

/// What `found` says of each patch of `goal`: irradiance, averaged.
fn on_patches_of(scene: &Scene, goal: &Solution, found: &Solution) -> Vec<Rgb64> {
    const N: u32 = 4;
    let mean = |patch: u32| {
        let outline = goal.mesh.patches[patch as usize].piece.outline;
        let at = |i: u32| {
            let u = DVec2::new(f64::from(i % N), f64::from(i / N)) + 0.5;
            let hit = goal
                .mesh
                .hit(scene, patch, outline.sample(u / f64::from(N)));
            found.irradiance[found.mesh.locate(&hit).unwrap().patch as usize]
        };
        (0..N * N).map(at).sum::<Rgb64>() / f64::from(N * N)
    };
    (0..goal.mesh.len() as u32).map(mean).collect()
}

#[derive(Debug)]
struct Off {
    /// Root of the mean square of the difference of irradiance, by area, over the mean irradiance.
    rms: f64,
    /// Mean difference over mean irradiance.
    bias: f64,
    /// The mean of the absolute difference over what is there.
    relative: f64,
    largest: f64,
}

fn off(goal: &Solution, found: &[Rgb64]) -> Off {
    let (mut area, mut mean, mut square, mut sum) = (0.0, 0.0, 0.0, 0.0);
    let (mut relative, mut largest) = (0.0, 0.0f64);
    for ((patch, e), f) in goal.mesh.patches.iter().zip(&goal.irradiance).zip(found) {
        if patch.albedo == Rgb64::ZERO {
            continue;
        }
        let (e, f) = (e.element_sum() / 3.0, f.element_sum() / 3.0);
        let a = patch.area;
        area += a;
        mean += a * e;
        sum += a * (f - e);
        square += a * (f - e) * (f - e);
        if e > 0.0 {
            relative += a * ((f - e) / e).abs();
        }
        largest = largest.max((f - e).abs());
    }
    mean /= area;
    Off {
        rms: (square / area).sqrt() / mean,
        bias: sum / area / mean,
        relative: relative / area,
        largest: largest / mean,
    }
}

#[test]
#[ignore = "measures"]
fn measure() {
    let size: f64 = std::env::var("SIZE").map_or(0.25, |s| s.parse().unwrap());
    let samples: u32 = std::env::var("SAMPLES").map_or(36, |s| s.parse().unwrap());
    let flat = std::env::var("FLAT").is_ok();
    for room in rooms::ALL {
        let scene = room.scene();
        let goal = direct(&scene, size, samples);
        let r = &goal.report;
        println!(
            "{room:?} direct: {} patches {:.2} s, escaped {:.5}",
            r.patches,
            r.form_factor_seconds,
            r.escaped.element_sum() / r.emitted.element_sum()
        );
        for error in [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6] {
            let found = hierarchical(&scene, error, flat.then_some(size), size);
            let o = off(&goal, &on_patches_of(&scene, &goal, &found));
            let r = &found.report;
            println!(
                "  {error:.0e}: {} patches {} links {:.2} s rms {:.5} bias {:+.5} relative {:.5} largest {:.4} {:?}",
                r.patches,
                r.links,
                r.form_factor_seconds + r.solve_seconds,
                o.rms,
                o.bias,
                o.relative,
                o.largest,
                r.warnings
            );
        }
    }
}

#[test]
#[ignore = "measures"]
fn occluded() {
    for room in [rooms::Room::Body, rooms::Room::Door, rooms::Room::SmallLamp] {
        let scene = room.scene();
        let goal = direct(&scene, 0.25, 256);
        println!(
            "{room:?} escaped {} warnings {:?}",
            goal.report.escaped.y / goal.report.emitted.y,
            goal.report.warnings
        );
        for samples in [4, 16, 36, 64] {
            let other = direct(&scene, 0.25, samples);
            println!("  reference {samples}: {:?}", off(&goal, &other.irradiance));
        }
        for (error, flat) in [
            (1e-5, None),
            (1e-6, None),
            (1e-5, Some(0.25)),
            (1e-6, Some(0.25)),
            (1e-7, Some(0.25)),
        ] {
            let found = hierarchical(&scene, error, flat, 0.25);
            let f = on_patches_of(&scene, &goal, &found);
            println!(
                "  {error:.0e} {flat:?} {} links: {:?}",
                found.report.links,
                off(&goal, &f)
            );
            let mut direct = off(
                &Solution {
                    irradiance: goal.direct.clone(),
                    ..direct(&scene, 0.25, 1)
                },
                &on_patches_of(
                    &scene,
                    &goal,
                    &Solution {
                        irradiance: found.direct.clone(),
                        ..hierarchical(&scene, error, flat, 0.25)
                    },
                ),
            );
            direct.largest = 0.0;
            println!("     direct {direct:?}");
            let mut worst: Vec<(f64, usize)> = goal
                .irradiance
                .iter()
                .zip(&f)
                .enumerate()
                .filter(|(i, _)| goal.mesh.patches[*i].albedo.y > 0.0)
                .map(|(i, (a, b))| ((b.y - a.y), i))
                .collect();
            worst.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
            let total: f64 = worst.iter().map(|w| w.0 * w.0).sum();
            let mut sum = 0.0;
            for (k, (d, i)) in worst.iter().enumerate() {
                sum += d * d;
                if k < 8 || k == 15 || k == 31 || k == 63 {
                    println!(
                        "    {k} {:.2} {d:+.4} of {:.4} direct {:.4} at {} n {}",
                        sum / total,
                        goal.irradiance[*i].y,
                        goal.direct[*i].y,
                        goal.mesh.patches[*i].piece.center(),
                        goal.mesh.patches[*i].piece.normal()
                    );
                }
            }
        }
    }
}

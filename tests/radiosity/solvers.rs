//! Every solver against closed forms and against the others.

use crate::rooms::*;
use luxel::radiosity::{self, Progress, Rgb64, SolveError, SolveSpec, Solver};
use std::ops::ControlFlow;

#[test]
fn a_furnace_is_as_bright_as_its_walls_allow() {
    for albedo in [0.5, 0.9, 0.99, 0.999] {
        let scene = scene(&box_inside(1.0, &(diffuse(albedo) + &shining(2.0))));
        for solver in FLAT {
            let solution = solve(&scene, &exact(solver, 1.0, 1e-9));
            // The scene is held in f32.
            let (rho, e) = (f64::from(albedo as f32), 2.0);
            let expected = e / (1.0 - rho);
            for b in &solution.radiosity {
                let off = (*b / expected - 1.0).abs().max_element();
                assert!(off < 1e-3, "{solver:?} {albedo}: {b}, not {expected}");
            }
            assert!(solution.report.converged && solution.report.warnings.is_empty());
        }
    }
}

#[test]
fn all_solvers_agree() {
    let scene = scene(&room_of_blocks(1.0, 0.3));
    let spec = |solver| spec(solver, 0.26, 1e-7);
    let first = solve(&scene, &spec(Solver::Gauss));
    let n = first.mesh.len();
    assert!((450..650).contains(&n), "{n}");
    for solver in FLAT {
        let other = solve(&scene, &spec(solver));
        let off = difference(&first, &other);
        assert!(off < 1e-4, "{solver:?}: {off}");
        let pairs = first.direct.iter().zip(&other.direct);
        let off = pairs.map(|(a, b)| (*a - *b).abs().max_element() / a.max_element());
        assert!(off.fold(0.0, f64::max) < 1e-4, "{solver:?}");
        // The walls take in all: some per cent is the error of form factors from four rays each.
        let r = &other.report;
        let escaped = r.escaped.abs().element_sum() / r.emitted.element_sum();
        assert!(escaped < 0.05, "{escaped}");
    }
}

#[test]
fn shooting_comes_nearer_with_every_step_and_ambient_light_is_nearer_early_on() {
    let scene = scene(&room_of_blocks(1.0, 0.3));
    let goal = solve(&scene, &spec(Solver::Gauss, 0.5, 1e-9));
    let patches = &goal.mesh.patches;
    let (mut errors, mut corrected) = (Vec::new(), Vec::new());
    let mut watch = |progress: &Progress| {
        let error = |ambient: Rgb64| -> f64 {
            let all = patches.iter().zip(progress.radiosity).zip(&goal.radiosity);
            all.map(|((p, b), exact)| {
                p.area * (*b + p.albedo * ambient - *exact).abs().element_sum()
            })
            .sum()
        };
        errors.push(error(Rgb64::ZERO));
        corrected.push(error(progress.ambient));
        ControlFlow::Continue(())
    };
    let spec = spec(Solver::Shooting, 0.5, 1e-6);
    let solution = radiosity::solve(&scene, &spec, &mut watch).unwrap();
    assert_eq!(solution.report.steps, errors.len() as u64);
    let rounding = 1e-12 * errors[0];
    assert!(errors.windows(2).all(|e| e[1] <= e[0] + rounding));
    assert!(errors[errors.len() - 1] < 1e-5 * errors[0]);
    for step in [0, 1, 4, 16, 32] {
        let (plain, better) = (errors[step], corrected[step]);
        assert!(better < 0.7 * plain, "step {step}: {better} {plain}");
    }
}

/// Two unit squares at distance 1: form factor by Howell's catalogue, C-11.
#[test]
fn two_squares_have_their_closed_form() {
    let s = std::f64::consts::SQRT_2;
    let f = 2.0 / std::f64::consts::PI
        * ((4.0f64 / 3.0).sqrt().ln() + 2.0 * s * (1.0 / s).atan() - 2.0 * 1.0f64.atan());
    let (e, a, b) = (3.0, 0.25, 0.75);
    let square = |turn: &str, z: f64, more: &str| {
        let place = format!("<scale value='0.5'/>{turn}<translate z='{z}'/>");
        shape("rectangle", &place, more)
    };
    let scene = scene(
        &(square("", 0.0, &(diffuse(a) + &shining(e)))
            + &square("<rotate x='1' angle='180'/>", 1.0, &diffuse(b))),
    );
    for solver in FLAT {
        let solution = solve(&scene, &exact(solver, 1.0, 1e-12));
        let lower = e / (1.0 - a * b * f * f);
        for (found, expected) in solution.radiosity.iter().zip([lower, b * f * lower]) {
            assert!(
                (found.y / expected - 1.0).abs() < 1e-6,
                "{solver:?} {found} {expected}"
            );
        }
        assert!((solution.direct[1].y / (f * e) - 1.0).abs() < 1e-6);
        assert_eq!(solution.direct[0], Rgb64::ZERO);
        let escaped = (1.0 - f) * (lower + b * f * lower);
        assert!((solution.report.escaped.y / escaped - 1.0).abs() < 1e-6);
    }
}

#[test]
fn what_absorbs_nothing_is_told_apart_from_what_is_open() {
    let closed = scene(&box_inside(1.0, &(diffuse(1.0) + &shining(1.0))));
    // Without a lid, light gets out.
    let open = (0..5).map(|i| {
        let turns = ["x='1' angle='0'", "x='1' angle='90'", "x='1' angle='-90'"];
        let turns = [
            turns[0],
            turns[1],
            turns[2],
            "y='1' angle='90'",
            "y='1' angle='-90'",
        ];
        let place = format!("<translate z='-1'/><rotate {}/>", turns[i]);
        shape("rectangle", &place, &(diffuse(1.0) + &shining(1.0)))
    });
    let open = scene(&open.collect::<String>());
    for solver in FLAT {
        let spec = spec(solver, 1.0, 1e-6);
        let error = try_solve(&closed, &spec).map(|s| s.report).unwrap_err();
        assert_eq!(error, SolveError::NoAbsorption, "{solver:?}");
        let solution = solve(&open, &spec);
        assert!(solution.report.converged, "{solver:?}");
        // All that is emitted gets out.
        let r = &solution.report;
        assert!(r.absorbed.element_sum() <= 1e-6 * r.emitted.element_sum());
    }
}

#[test]
fn an_observer_can_stop_and_steps_can_be_counted() {
    let scene = scene(&room_of_blocks(1.0, 0.3));
    for solver in [Solver::GaussSeidel, Solver::Jacobi, Solver::Shooting] {
        let spec = spec(solver, 0.5, 1e-9);
        let mut seen = 0;
        let mut third = |p: &Progress| {
            seen += 1;
            assert_eq!(p.step, seen);
            match p.step {
                3 => ControlFlow::Break(()),
                _ => ControlFlow::Continue(()),
            }
        };
        let stopped = radiosity::solve(&scene, &spec, &mut third).unwrap();
        assert!(!stopped.report.converged && stopped.report.steps == 3);
        assert_eq!(
            stopped.report.warnings.len(),
            1,
            "{:?}",
            stopped.report.warnings
        );
        let limited = SolveSpec {
            max_steps: Some(3),
            ..spec
        };
        let limited = solve(&scene, &limited);
        assert_eq!(limited.radiosity, stopped.radiosity);
    }
}

#[test]
fn meshes_have_about_as_many_patches_as_their_solver_takes() {
    let scene = scene(&room_of_blocks(1.0, 0.3));
    let solved = |spec: SolveSpec| radiosity::solve(&scene, &spec, &mut |_| ControlFlow::Break(()));
    let spec = SolveSpec {
        max_steps: Some(1),
        patch_size: None,
        ..spec(Solver::Shooting, 1.0, 1.0)
    };
    let n = solved(spec.clone()).unwrap().mesh.len();
    assert!((9_000..=10_000).contains(&n), "{n}");
    let few = SolveSpec {
        max_patches: 5_000,
        ..spec.clone()
    };
    let error = solved(few).map(|s| s.report).unwrap_err();
    let patches = n as u64;
    assert_eq!(
        error,
        SolveError::TooManyPatches {
            patches,
            limit: 5_000
        }
    );
    for size in [1e-3, 1e-9, 1e-300] {
        let fine = SolveSpec {
            patch_size: Some(size),
            ..spec.clone()
        };
        let error = solved(fine).map(|s| s.report).unwrap_err();
        assert!(matches!(error, SolveError::TooManyPatches { .. }));
    }
}

#[test]
fn threads_change_nothing() {
    let scene = scene(&room_of_blocks(1.0, 0.3));
    for solver in FLAT {
        let spec = spec(solver, 0.4, 1e-5);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| solve(&scene, &spec))
        };
        let (one, four) = (with(1), with(4));
        assert_eq!(one.radiosity, four.radiosity, "{solver:?}");
        assert_eq!(one.direct, four.direct, "{solver:?}");
        assert_eq!(one.report.residual, four.report.residual, "{solver:?}");
        assert_eq!(one.report.escaped, four.report.escaped, "{solver:?}");
    }
}

/// Where form factors decide how bright all is, a bad one is doubted.
#[test]
fn form_factors_that_decide_the_brightness_are_doubted() {
    let scene = scene(&box_inside(1.0, &(diffuse(0.999) + &shining(2.0))));
    let warnings = |spec| solve(&scene, &spec).report.warnings;
    let crude = warnings(spec(Solver::GaussSeidel, 1.0, 1e-6));
    assert_eq!(crude.len(), 1, "{crude:?}");
    assert!(
        crude[0].contains("gets out at each reflection"),
        "{crude:?}"
    );
    assert_eq!(warnings(exact(Solver::GaussSeidel, 1.0, 1e-6)).len(), 0);
}

/// Patches that follow the edges of shadows are solved for like others.
#[test]
fn meshes_with_edges_of_shadows_have_about_the_same_light() {
    let scene = scene(&room_of_blocks(1.0, 0.3));
    let plain = spec(Solver::GaussSeidel, 0.4, 1e-6);
    let cut = SolveSpec {
        discontinuities: true,
        ..plain.clone()
    };
    let (plain, cut) = (solve(&scene, &plain), solve(&scene, &cut));
    assert!(cut.mesh.len() > plain.mesh.len());
    let ratio = cut.report.absorbed / plain.report.absorbed;
    assert!((ratio - 1.0).abs().max_element() < 0.05, "{ratio}");
}

//! Scenes that are not meant well: numbers stay finite, and nothing hangs.

use crate::rooms::*;
use crate::surfaces::{file, obj};
use luxel::radiosity::{Rgb64, SolveError, SolveSpec, Solver};

#[test]
fn scale_does_not_matter() {
    let at = |scale: f64, solver| {
        let scene = scene(&room_of_blocks(scale, 0.3));
        solve(&scene, &spec(solver, 0.5 * scale, 1e-7))
    };
    for solver in [Solver::GaussSeidel, Solver::Shooting] {
        let one = at(1.0, solver);
        for scale in [1e-6, 1e6] {
            let other = at(scale, solver);
            // Rays that graze an edge may end on either side of it.
            let off = mean_difference(&one, &other);
            assert!(off < 3e-3, "{solver:?} {scale}: {off}");
        }
    }
}

#[test]
fn a_light_of_a_millionth_of_the_room_is_seen() {
    // 4 W from a lamp of an area of 4e-6 to one of 24; the bright spots on the wall keep their power.
    let power = |lamp: f64| {
        let scene = scene(&room_of_blocks(1.0, lamp));
        let solution = solve(&scene, &spec(Solver::GaussSeidel, 0.5, 1e-6));
        solution.report.absorbed
    };
    let (large, small) = (power(0.1), power(1e-3));
    let off = (small / large - 1.0).abs().max_element();
    assert!(off < 0.02, "{large} {small}");
}

/// A shining, reflecting mesh.
fn mesh(name: &str, text: &str) -> String {
    let two = format!("<bsdf type='twosided'>{}</bsdf>", diffuse(0.8));
    obj(&file(name, text), &(two + &shining(1.0)))
}

#[test]
fn odd_geometry_gives_finite_numbers() {
    let needles = "v 0 0 0\nv 1 0 0\nv 1 1e-7 0\nv 0 0 1\nv 1e-3 0 1\nv 500 1e-3 1\nf 1 2 3\nf 4 5 6\n\
                   f 1 2 2\nf 1 1 1\nf 1 2 4\n";
    let twice = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\nf 1 2 3 4\nf 4 3 2 1\n";
    let sizes = "v 0 0 0\nv 1e-6 0 0\nv 1e-6 1e-6 0\nv 0 1e-6 0\nv 0 0 1\nv 0 1e3 1\nv 1e3 1e3 1\n\
                 v 1e3 0 1\nf 1 2 3 4\nf 5 6 7 8\n";
    let two = format!("<bsdf type='twosided'>{}</bsdf>", diffuse(0.9));
    let cubes = shape("cube", "", &two)
        + &shape(
            "cube",
            "<rotate x='1' y='1' angle='40'/>",
            &(two.clone() + &shining(1.0)),
        )
        + &shape("cube", "<translate x='2'/>", &two);
    for (body, size) in [
        (mesh("radiosity_needles.obj", needles), 60.0),
        (mesh("radiosity_twice.obj", twice), 0.5),
        (mesh("radiosity_sizes.obj", sizes), 200.0),
        (cubes, 0.7),
    ] {
        let scene = scene(&body);
        for solver in FLAT {
            // Finite, and balanced: see `solve`.
            let spec = SolveSpec {
                max_steps: Some(2_000),
                ..spec(solver, size, 1e-4)
            };
            match try_solve(&scene, &spec) {
                Ok(s) => assert!(s.radiosity.iter().sum::<Rgb64>().min_element() > 0.0),
                // Four rays do not tell how much of a patch is inside of another body.
                Err(e) => assert!(matches!(e, SolveError::Diverges { .. }), "{e}"),
            }
        }
    }
}

#[test]
fn scenes_without_light_or_surfaces() {
    let dark = scene(&box_inside(1.0, &diffuse(0.5)));
    for solver in FLAT {
        let solution = solve(&dark, &spec(solver, 1.0, 1e-4));
        assert_eq!(solution.radiosity.iter().sum::<Rgb64>(), Rgb64::ZERO);
        assert!(solution.report.converged && solution.report.residual == 0.0);
        assert_eq!(solution.report.warnings, ["no light arrives at any patch"]);
        let glass = scene(&shape("sphere", "", "<bsdf type='dielectric'/>"));
        let error = try_solve(&glass, &spec(solver, 1.0, 1e-4)).map(|s| s.report);
        assert_eq!(error.unwrap_err(), SolveError::NoPatches);
    }
}

#[test]
fn impossible_settings_end() {
    let scene = scene(&room_of_blocks(1.0, 0.3));
    for solver in FLAT {
        for residual in [0.0, -1.0, f64::NAN] {
            let spec = SolveSpec {
                max_steps: Some(100_000),
                ..spec(solver, 1.0, residual)
            };
            let solution = solve(&scene, &spec);
            assert!(solution.report.residual < 1.0);
        }
    }
}

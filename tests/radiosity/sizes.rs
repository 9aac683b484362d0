//! Surfaces of very different sizes in one scene.

use crate::rooms::*;
use luxel::radiosity::{Rgb64, SolveSpec, Solver};

/// A lamp of 0.16 units² two units above a floor of 4e6, an unlit speck of 4e-12, and a speck of a lamp that shines as
/// brightly as the other does in all, just above the floor.
fn specks() -> String {
    let at = |scale: &str, place: &str, more: &str| {
        shape(
            "rectangle",
            &format!("<scale value='{scale}'/>{place}"),
            more,
        )
    };
    let down = "<rotate x='1' angle='180'/>";
    let power = 0.16;
    [
        at("1000", "<translate z='-1'/>", &diffuse(0.5)),
        at(
            "0.2",
            &format!("{down}<translate z='0.98'/>"),
            &(diffuse(0.0) + &shining(power / 0.16)),
        ),
        at("1e-6", "<translate y='0.2' z='-0.5'/>", &diffuse(0.5)),
        at(
            "1e-6",
            &format!("{down}<translate y='0.5' z='-0.9'/>"),
            &(diffuse(0.5) + &shining(power / 4e-12)),
        ),
    ]
    .concat()
}

/// All light goes down to the floor, which takes in half of it; the rest gets out.
#[test]
fn specks_that_shine_beside_a_wide_floor_bring_what_they_have() {
    let scene = scene(&specks());
    for walks in [0, 1 << 14, 1 << 18] {
        let spec = SolveSpec {
            walks,
            ..SolveSpec::default()
        };
        let solution = solve(&scene, &spec);
        let r = &solution.report;
        assert!(r.converged);
        let all = solution.irradiance.iter().chain(&solution.radiosity);
        assert!(
            all.into_iter()
                .all(|e| e.is_finite() && e.cmpge(Rgb64::ZERO).all())
        );
        let share = r.absorbed.x / r.emitted.x;
        // Form factors of patches as wide as the lamps are far above them err by much, but give no light away that
        // there is not.
        assert!(share < 0.5 * 1.01, "{walks}: {share} {:?}", r.warnings);
    }
}

/// A lamp of a hundredth of the area among patches of a floor and a table: links alone bring all of its light. 2 % is
/// the error of both solvers' form factors at the table's shadow.
#[test]
fn a_small_lamp_is_found_among_much_else() {
    let body = [
        shape("rectangle", "<scale value='2'/>", &diffuse(0.3)),
        shape(
            "rectangle",
            "<scale value='0.5'/><rotate z='1' angle='20'/><translate z='1'/>",
            &diffuse(0.3),
        ),
        shape(
            "rectangle",
            "<scale value='0.2'/><rotate x='1' angle='180'/><translate z='3'/>",
            &(diffuse(0.3) + &shining(30.0)),
        ),
    ];
    let scene = scene(&body.concat());
    let goal = solve(&scene, &spec(Solver::GaussSeidel, 0.25, 1e-6));
    for discontinuities in [false, true] {
        let spec = SolveSpec {
            patch_size: Some(0.25),
            error: 1e-4,
            walks: 0,
            discontinuities,
            ..SolveSpec::default()
        };
        let found = solve(&scene, &spec);
        let ratio = found.report.absorbed.x / goal.report.absorbed.x;
        assert!((ratio - 1.0).abs() < 0.02, "{discontinuities}: {ratio}");
    }
}

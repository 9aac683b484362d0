//! Light that goes through masks: it arrives at what lies behind, and is not taken in.

use crate::rooms::*;
use luxel::radiosity::{Solution, SolveSpec, Solver};

/// A closed room that shines, cut in two by a sheet that covers `opacity` of what is behind it.
fn room_with_sheet(opacity: f64) -> String {
    let walls = box_inside(1.0, &(diffuse(0.5) + &shining(1.0)));
    let inside = format!("<bsdf type='twosided'>{}</bsdf>", diffuse(0.4));
    let mask =
        format!("<bsdf type='mask'><float name='opacity' value='{opacity}'/>{inside}</bsdf>");
    let sheet = shape("rectangle", "<rotate y='1' angle='90'/>", &mask);
    format!("{walls}{sheet}")
}

fn solved(body: &str, solver: Solver) -> Solution {
    let flat = spec(solver, 0.25, 1e-6);
    let spec = match solver {
        Solver::Hierarchical => SolveSpec {
            error: 1e-4,
            walks: 1 << 17,
            ..SolveSpec::default()
        },
        _ => flat,
    };
    solve(&scene(body), &spec)
}

#[test]
fn what_goes_through_a_mask_is_not_absorbed() {
    for opacity in [0.25, 0.75] {
        let room = room_with_sheet(opacity);
        for solver in [Solver::GaussSeidel, Solver::Shooting, Solver::Hierarchical] {
            let solution = solved(&room, solver);
            let r = &solution.report;
            assert!(r.converged, "{solver:?}");
            // All that is not reflected diffusely goes straight on, and the solvers follow it.
            assert_eq!(r.other, 0.0, "{solver:?}");
            let said = r.warnings.iter().filter(|w| w.contains("mirrors"));
            assert_eq!(said.count(), 0, "{:?}", r.warnings);
            // Of a closed room: 2 % is the error of form factors from sixteen rays, through a sheet of 4 of 28 units.
            let share = r.absorbed / r.emitted;
            let off = (share - 1.0).abs().max_element();
            assert!(off < 0.02, "{solver:?} {opacity}: {share}");
            assert!((r.absorbed + r.escaped - r.emitted).abs().max_element() < 1e-2 * r.emitted.x);
        }
    }
}

#[test]
fn a_mask_that_covers_all_or_nothing_is_none() {
    let absorbed = |body: &str| solved(body, Solver::GaussSeidel).report.absorbed;
    let walls = box_inside(1.0, &(diffuse(0.5) + &shining(1.0)));
    let none = absorbed(&walls);
    let clear = absorbed(&room_with_sheet(0.0));
    assert!(
        (clear / none - 1.0).abs().max_element() < 1e-2,
        "{clear} {none}"
    );
    let sheet = shape(
        "rectangle",
        "<rotate y='1' angle='90'/>",
        &format!("<bsdf type='twosided'>{}</bsdf>", diffuse(0.4)),
    );
    let solid = absorbed(&format!("{walls}{sheet}"));
    let covering = absorbed(&room_with_sheet(1.0));
    assert!(
        (covering / solid - 1.0).abs().max_element() < 1e-2,
        "{covering} {solid}"
    );
}

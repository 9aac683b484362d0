//! Small scenes for radiosity.

use crate::render;
use luxel::radiosity::{self, FormFactorMethod, Progress, Solution, SolveError, SolveSpec, Solver};
use luxel::scene::Scene;
use std::f64::consts::PI;
use std::ops::ControlFlow;

/// All solvers on flat meshes.
pub const FLAT: [Solver; 4] = [
    Solver::Gauss,
    Solver::GaussSeidel,
    Solver::Jacobi,
    Solver::Shooting,
];

pub fn scene(body: &str) -> Scene {
    let xml = format!(
        "<scene version='3.0.0'><sensor type='perspective'><float name='shutter_close' value='1'/></sensor>{body}</scene>"
    );
    render::compile(&xml).job.scene
}

pub fn diffuse(albedo: f64) -> String {
    colored(&[albedo; 3])
}

pub fn colored([r, g, b]: &[f64; 3]) -> String {
    format!("<bsdf type='diffuse'><rgb name='reflectance' value='{r}, {g}, {b}'/></bsdf>")
}

/// An emitter with this exitance in W/m².
pub fn shining(exitance: f64) -> String {
    let radiance = exitance / PI;
    format!("<emitter type='area'><rgb name='radiance' value='{radiance}'/></emitter>")
}

/// A shape of a type with transforms and children.
pub fn shape(kind: &str, transform: &str, more: &str) -> String {
    format!("<shape type='{kind}'><transform name='to_world'>{transform}</transform>{more}</shape>")
}

/// The inside of the cube from -1 to 1, times `scale`.
pub fn box_inside(scale: f64, more: &str) -> String {
    let flip = "<boolean name='flip_normals' value='true'/>";
    shape(
        "cube",
        &format!("<scale value='{scale}'/>"),
        &format!("{flip}{more}"),
    )
}

/// A closed room with walls of two colours, two blocks in it and a lamp below its ceiling; times `scale`.
pub fn room_of_blocks(scale: f64, lamp: f64) -> String {
    let scaled = format!("<scale value='{scale}'/>");
    let wall = |turn: &str, color: &[f64; 3]| {
        let place = format!("<translate z='-1'/>{turn}{scaled}");
        shape("rectangle", &place, &colored(color))
    };
    let (white, red, green) = ([0.7, 0.7, 0.7], [0.6, 0.1, 0.1], [0.1, 0.5, 0.2]);
    let mut body = String::new();
    for (turn, color) in [
        ("", &white),
        ("<rotate x='1' angle='90'/>", &white),
        ("<rotate x='1' angle='-90'/>", &white),
        ("<rotate x='1' angle='180'/>", &white),
        ("<rotate y='1' angle='90'/>", &red),
        ("<rotate y='1' angle='-90'/>", &green),
    ] {
        body += &wall(turn, color);
    }
    for (size, angle, x, z) in [(0.25, 17.0, 0.35, 0.3), (0.3, -20.0, -0.4, -0.3)] {
        let place = format!(
            "<scale x='{size}' y='{}' z='{size}'/><rotate y='1' angle='{angle}'/>\
             <translate x='{x}' y='{}' z='{z}'/>{scaled}",
            2.0 * size,
            2.0 * size - 1.0
        );
        body += &shape("cube", &place, &colored(&white));
    }
    let place =
        format!("<scale value='{lamp}'/><rotate x='1' angle='90'/><translate y='0.95'/>{scaled}");
    let power = 4.0 / (lamp * lamp);
    body + &shape("rectangle", &place, &(diffuse(0.0) + &shining(power)))
}

/// The same with form factors that are as exact as they get.
pub fn exact(solver: Solver, patch_size: f64, residual: f64) -> SolveSpec {
    SolveSpec {
        form_factors: FormFactorMethod::Analytic { samples: 144 },
        ..spec(solver, patch_size, residual)
    }
}

/// Patches of about this size, solved to this residual, with few rays.
pub fn spec(solver: Solver, patch_size: f64, residual: f64) -> SolveSpec {
    SolveSpec {
        solver,
        residual,
        patch_size: Some(patch_size),
        form_factors: FormFactorMethod::Analytic { samples: 4 },
        ..SolveSpec::default()
    }
}

pub fn go(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

pub fn try_solve(scene: &Scene, spec: &SolveSpec) -> Result<Solution, SolveError> {
    let solution = radiosity::solve(scene, spec, &mut go)?;
    assert_sound(&solution);
    Ok(solution)
}

#[track_caller]
pub fn solve(scene: &Scene, spec: &SolveSpec) -> Solution {
    try_solve(scene, spec).unwrap_or_else(|e| panic!("{e}"))
}

/// Finite numbers everywhere, B = E + ρ irradiance, and all power accounted for.
#[track_caller]
fn assert_sound(solution: &Solution) {
    let patches = &solution.mesh.patches;
    for (i, patch) in patches.iter().enumerate() {
        let (b, e) = (solution.radiosity[i], solution.irradiance[i]);
        assert!(b.is_finite() && e.is_finite(), "patch {i}: {b} {e}");
        assert!(solution.direct[i].is_finite(), "patch {i}");
        let expected = patch.emission + patch.albedo * e;
        assert!((b - expected).abs().max_element() <= 1e-12 * b.max_element());
        assert!(e.min_element() >= 0.0 && solution.direct[i].min_element() >= 0.0);
    }
    let r = &solution.report;
    let (given, taken) = (r.emitted + r.external, r.absorbed + r.escaped);
    let off = (given - taken).abs().element_sum() / given.element_sum().max(f64::MIN_POSITIVE);
    assert!(off <= r.residual + 1e-9, "{given} {taken}: {off} {r:?}");
}

/// Mean difference of two solutions on a mesh, relative to the mean radiosity.
pub fn mean_difference(a: &Solution, b: &Solution) -> f64 {
    assert_eq!(a.mesh.len(), b.mesh.len());
    let (mut off, mut all) = (0.0, 0.0);
    for (i, patch) in a.mesh.patches.iter().enumerate() {
        let difference = a.radiosity[i] - b.radiosity[i];
        off += patch.area * difference.abs().element_sum();
        all += patch.area * a.radiosity[i].element_sum();
    }
    off / all
}

/// Largest difference of two solutions on a mesh, relative to the radiosity of the first.
pub fn difference(a: &Solution, b: &Solution) -> f64 {
    assert_eq!(a.mesh.len(), b.mesh.len());
    let pairs = a.radiosity.iter().zip(&b.radiosity);
    let off = pairs.flat_map(|(a, b)| (0..3).map(|c| ((a[c] - b[c]) / a[c].max(1e-300)).abs()));
    off.fold(0.0, f64::max)
}

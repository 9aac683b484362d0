//! How seconds and links grow with the number of patches: each solver on finer and finer meshes of a box with two
//! blocks, and the exponents of power laws through them. Not for criterion: one run of each, some of minutes.
//!
//! `cargo bench --bench radiosity_growth` goes up to 10^5 patches (hierarchical), 4,000 (matrix) and 2,000 (gauss);
//! with `LARGE=1` before it ten times, two times and two times as many. Words behind `--` choose among the solvers.

use std::ops::ControlFlow;
use std::path::Path;

use luxel::format::{self, Overrides};
use luxel::radiosity::{self, FormFactorMethod, Report, SolveSpec, Solver};
use luxel::scene::Scene;

const BOX: &str = r#"<scene version="3.0.0"><sensor type="perspective"/>
    <shape type="cube"><boolean name="flip_normals" value="true"/><bsdf type="diffuse"/></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.6" z="0.3"/><rotate y="1" angle="17"/>
    <translate x="-0.35" y="-0.4" z="-0.3"/></transform><bsdf type="diffuse"/></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.3" z="0.3"/><rotate y="1" angle="-16"/>
    <translate x="0.35" y="-0.7" z="0.35"/></transform><bsdf type="diffuse"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="0.3"/><rotate x="1" angle="90"/>
    <translate y="0.99"/></transform><emitter type="area"><rgb name="radiance" value="10"/></emitter></shape></scene>"#;

/// Area of all surfaces: edges of squares for so many patches.
const AREA: f64 = 24.0 + 2.88 + 0.36 + 2.16 + 0.36;

fn scene() -> Scene {
    let desc = format::load_str("bench.xml", BOX, Path::new("."), &[]).unwrap();
    let compiled = format::compile(&desc, &Overrides::default()).unwrap();
    compiled.job.scene
}

/// Something that grows with the number of patches.
type Cost = (&'static str, fn(&Report) -> f64);

const ALL: Cost = ("seconds", |r| {
    r.mesh_seconds + r.form_factor_seconds + r.solve_seconds
});
const FACTORS: Cost = ("form factors", |r| r.form_factor_seconds);
const SOLVING: Cost = ("solving", |r| r.solve_seconds);
const LINKS: Cost = ("links", |r| r.links as f64);

/// Solves by all of `specs` and prints the costs and their exponents: slopes of lines of least squares through the
/// logarithms, of all runs and of the larger half of them.
fn grow(scene: &Scene, what: &str, costs: &[Cost], specs: impl Iterator<Item = SolveSpec>) {
    let words = || std::env::args().skip(1).filter(|a| !a.starts_with('-'));
    if words().count() > 0 && !words().any(|word| what.contains(&word)) {
        return;
    }
    println!("{what}");
    let mut runs: Vec<Report> = Vec::new();
    for spec in specs {
        let go = &mut |_: &radiosity::Progress| ControlFlow::Continue(());
        match radiosity::solve(scene, &spec, go) {
            Ok(solution) => {
                let report = solution.report;
                print!("  {:8} patches", report.patches);
                for (name, cost) in costs {
                    print!("  {name} {:.4}", cost(&report));
                }
                println!("  steps {}", report.steps);
                runs.push(report);
            }
            Err(error) => println!("  {error}"),
        }
    }
    for (name, cost) in costs {
        let exponent = |runs: &[Report]| {
            let points = runs.iter().map(|r| (r.patches as f64, cost(r)));
            slope(points.map(|(n, c)| (n.ln(), c.max(1e-9).ln())))
        };
        let later = &runs[runs.len() / 2..];
        println!(
            "  exponent of {name}: {:.2}, of the larger half {:.2}",
            exponent(&runs),
            exponent(later)
        );
    }
}

fn slope(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let all: Vec<_> = points.collect();
    let n = all.len() as f64;
    let (x, y) = all.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    let (x, y) = (x / n, y / n);
    let along = |p: &(f64, f64)| (p.0 - x) * (p.0 - x);
    let both = |p: &(f64, f64)| (p.0 - x) * (p.1 - y);
    all.iter().map(both).sum::<f64>() / all.iter().map(along).sum::<f64>()
}

/// Edges of squares that make about so many patches.
fn edge(patches: f64) -> Option<f64> {
    Some((AREA / patches).sqrt())
}

fn main() {
    // Not as a part of the tests.
    if !std::env::args().any(|a| a == "--bench") {
        return;
    }
    let large = std::env::var_os("LARGE").is_some();
    let scene = scene();
    let flat = |solver, most: f64| {
        let counts = [250.0, 500.0, 1e3, 2e3, 4e3, 8e3];
        let few = counts.into_iter().filter(move |n| *n <= most);
        few.map(move |n| SolveSpec {
            solver,
            form_factors: FormFactorMethod::MonteCarlo { samples: 1 },
            patch_size: edge(n),
            residual: 1e-4,
            ..SolveSpec::default()
        })
    };
    let times = if large { 2.0 } else { 1.0 };
    let matrix = [ALL, FACTORS, SOLVING];
    grow(&scene, "gauss", &matrix, flat(Solver::Gauss, 2e3 * times));
    for solver in [Solver::GaussSeidel, Solver::Jacobi] {
        grow(&scene, solver.name(), &matrix, flat(solver, 4e3 * times));
    }
    let shots = flat(Solver::Shooting, 8e3).map(|spec| SolveSpec {
        max_steps: Some(250),
        ..spec
    });
    grow(&scene, "shooting, 250 shots", &[ALL], shots);
    let most = if large { 1e6 } else { 1e5 };
    let counts = [1e3, 3e3, 1e4, 3e4, 1e5, 3e5, 1e6];
    let meshes = counts
        .into_iter()
        .filter(|n| *n <= most)
        .map(|n| SolveSpec {
            patch_size: edge(n),
            error: 1e-3,
            ..SolveSpec::default()
        });
    let costs = [ALL, FACTORS, SOLVING, LINKS];
    grow(
        &scene,
        "hierarchical, patches given, error 1e-3",
        &costs,
        meshes,
    );
    // As small as the error asks for.
    let errors = [
        1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8, 2e-8,
    ];
    let fine = errors.into_iter().take(if large { 11 } else { 7 });
    let fine = fine.map(|error| SolveSpec {
        error,
        min_size: Some(1e-4),
        ..SolveSpec::default()
    });
    grow(&scene, "hierarchical, by error", &costs, fine);
}

//! Solving radiosity: each solver on meshes of a box with two blocks, form factors by themselves and included.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion};
use luxel::format::{self, Overrides};
use luxel::radiosity::{self, FormFactorMethod, SolveSpec, Solver};
use luxel::scene::Scene;

const BOX: &str = r#"<scene version="3.0.0"><sensor type="perspective"/>
    <shape type="cube"><boolean name="flip_normals" value="true"/><bsdf type="diffuse"/></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.6" z="0.3"/><rotate y="1" angle="17"/>
    <translate x="-0.35" y="-0.4" z="-0.3"/></transform><bsdf type="diffuse"/></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.3" z="0.3"/><rotate y="1" angle="-16"/>
    <translate x="0.35" y="-0.7" z="0.35"/></transform><bsdf type="diffuse"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="0.3"/><rotate x="1" angle="90"/>
    <translate y="0.99"/></transform><emitter type="area"><rgb name="radiance" value="10"/></emitter></shape></scene>"#;

fn scene() -> Scene {
    let desc = format::load_str("bench.xml", BOX, Path::new("."), &[]).unwrap();
    format::compile(&desc, &Overrides::default())
        .unwrap()
        .job
        .scene
}

/// Links and solving together: what refinement does depends on the light that there is.
fn hierarchical(criterion: &mut Criterion, scene: &Scene) {
    let mut group = criterion.benchmark_group("hierarchical radiosity");
    for error in [1e-3, 1e-4] {
        let spec = SolveSpec {
            error,
            ..SolveSpec::default()
        };
        let solve = || radiosity::solve(scene, &spec, &mut |_| ControlFlow::Continue(())).unwrap();
        let r = solve().report;
        println!(
            "error {error:e}: {} patches, {} links, {:.0} links/s, solving {:.4} s in {} steps",
            r.patches,
            r.links,
            r.links as f64 / r.form_factor_seconds,
            r.solve_seconds,
            r.steps
        );
        group.bench_function(BenchmarkId::from_parameter(error), |b| b.iter(&solve));
    }
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .measurement_time(Duration::from_secs(3))
        .warm_up_time(Duration::from_millis(500))
        .configure_from_args();
    let scene = scene();
    for size in [0.26, 0.13] {
        let spec = SolveSpec {
            form_factors: FormFactorMethod::Hemicube { resolution: 64 },
            patch_size: Some(size),
            residual: 1e-4,
            ..SolveSpec::default()
        };
        let solve = |solver| {
            let spec = SolveSpec {
                solver,
                ..spec.clone()
            };
            radiosity::solve(&scene, &spec, &mut |_| ControlFlow::Continue(())).unwrap()
        };
        let n = solve(Solver::GaussSeidel).mesh.len();
        let mut group = criterion.benchmark_group(format!("radiosity of {n} patches"));
        for solver in Solver::ALL {
            if solver == Solver::Hierarchical {
                continue;
            }
            let own = solve(solver).report;
            println!(
                "{}: form factors {:.3} s, solving {:.4} s in {} steps",
                solver.name(),
                own.form_factor_seconds,
                own.solve_seconds,
                own.steps
            );
            group.bench_function(BenchmarkId::from_parameter(solver.name()), |b| {
                b.iter(|| solve(solver));
            });
        }
        group.finish();
    }
    hierarchical(&mut criterion, &scene);
    criterion.final_summary();
}

//! The solvers on equations whose solution is known, with form factors that are given.

use super::*;
use crate::format::{self, Overrides};
use crate::radiosity::FormFactorMethod;
use std::path::Path;

/// A matrix as form factors.
struct Given(Matrix);

impl Exchange for Given {
    fn row(&self, i: u32, out: &mut [f64]) {
        out.copy_from_slice(self.0.row(i as usize));
    }

    fn matrix(&self) -> (Matrix, Option<Quality>) {
        (self.0.clone(), None)
    }
}

const ALL: [Solver; 4] = [
    Solver::Gauss,
    Solver::GaussSeidel,
    Solver::Jacobi,
    Solver::Shooting,
];

fn scene(body: &str) -> Scene {
    let xml = format!("<scene version='3.0.0'><sensor type='perspective'/>{body}</scene>");
    let desc = format::load_str("a.xml", &xml, Path::new("."), &[]);
    let compiled = desc.and_then(|d| format::compile(&d, &Overrides::default()));
    compiled.unwrap_or_else(|e| panic!("{e}")).job.scene
}

/// A cube that is seen from inside, with this reflectance, all of it shining with this exitance.
fn furnace(albedo: f64, exitance: f64) -> Scene {
    scene(&format!(
        "<shape type='cube'><boolean name='flip_normals' value='true'/>\
         <bsdf type='diffuse'><spectrum name='reflectance' value='{albedo}'/></bsdf>\
         <emitter type='area'><rgb name='radiance' value='{}'/></emitter></shape>",
        exitance / std::f64::consts::PI
    ))
}

fn spec(solver: Solver, residual: f64) -> SolveSpec {
    SolveSpec {
        solver,
        residual,
        form_factors: FormFactorMethod::Analytic { samples: 4 },
        ..SolveSpec::default()
    }
}

fn go(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Form factors that hand on more than they get are told by name, and harm nothing where enough is absorbed.
#[test]
fn rows_that_sum_to_more_than_one_are_named() {
    for (albedo, diverges) in [(0.999, true), (0.9, false)] {
        let scene = furnace(albedo, 1.0);
        let mesh = PatchMesh::uniform(&scene, Arc::new(Surfaces::new(&scene, 0.02)), 1.0);
        let n = mesh.len();
        let factors = Given(Matrix {
            n,
            f: vec![1.01 / n as f64; n * n],
        });
        let system = System::new(&mesh, vec![Rgb64::ZERO; n]);
        for solver in ALL {
            let spec = spec(solver, 1e-9);
            let run = Run {
                residual: spec.residual,
                max_steps: u64::MAX,
                observe: &mut go,
            };
            let solved = by_factors(&system, &factors, &spec, run);
            let Err(error) = solved else {
                let solved = solved.ok().unwrap();
                let albedo = f64::from(albedo as f32);
                let expected = 1.0 / (1.0 - 1.01 * albedo);
                assert!(!diverges && (solved.radiosity[0].x / expected - 1.0).abs() < 1e-6);
                assert!((solved.row_sum - 1.01).abs() < 1e-12);
                continue;
            };
            let text = error.to_string();
            assert!(diverges, "{text}");
            let expected = format!(
                "the solver {} does not converge: form factors of a patch sum to 1.010000, which a reflectance of \
                 0.9990000",
                solver.name()
            );
            assert!(text.starts_with(&expected), "{text}");
        }
    }
}

//! The solvers on equations whose solution is known, with form factors that are given.

use super::*;
use crate::format::{self, Overrides};
use crate::radiosity::FormFactorMethod;
use std::path::Path;

/// A matrix as form factors.
struct Given(Dense);

impl Exchange for Given {
    fn row(&self, i: u32, out: &mut [f64]) {
        out.copy_from_slice(self.0.row(i as usize));
    }

    fn column(&self, i: u32, out: &mut [f64]) {
        for (j, f) in out.iter_mut().enumerate() {
            *f = self.0.f[j * self.0.n + i as usize];
        }
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
         <emitter type='area'><spectrum name='radiance' value='{}'/></emitter></shape>",
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

#[test]
fn a_furnace_is_as_bright_as_its_walls_allow() {
    for albedo in [0.5, 0.9, 0.99, 0.999] {
        let scene = furnace(albedo, 2.0);
        for solver in ALL {
            let spec = SolveSpec {
                patch_size: Some(1.0),
                ..spec(solver, 1e-10)
            };
            let solution = crate::radiosity::solve(&scene, &spec, &mut go).unwrap();
            let albedo = f64::from(albedo as f32);
            let expected = 2.0 / (1.0 - albedo);
            for b in &solution.radiosity {
                // The scene holds f32.
                assert!(
                    (b.x / expected - 1.0).abs() < 1e-4,
                    "{solver:?} {albedo} {b}"
                );
            }
            assert!(
                solution.report.converged,
                "{solver:?} {:?}",
                solution.report
            );
        }
    }
}

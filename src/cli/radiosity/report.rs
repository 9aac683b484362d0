//! What is told of a solution: a table for people, JSON for programs.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::Seconds;
use crate::radiosity::{FormFactorMethod, Rgb64, Solution, SolveSpec, Solver};
use crate::study::memory;

/// Lines of a name and what is to be said of it.
pub(super) fn table(spec: &SolveSpec, solution: &Solution, seconds: &Seconds) -> String {
    let r = &solution.report;
    let mut lines = vec![
        (
            "patches",
            format!("{} of {:.4} units² in all", r.patches, solution.mesh.area()),
        ),
        ("solver", spec.solver.name().to_string()),
    ];
    match spec.solver {
        Solver::Hierarchical => lines.push(("links", r.links.to_string())),
        _ => lines.push(("form factors", form_factors(spec.form_factors))),
    }
    if let Some(quality) = &r.quality {
        let names = ["closure", "", ""];
        let said = quality.to_string();
        let said = said.lines().map(str::to_string);
        lines.extend(names.into_iter().zip(said));
    }
    let reached = match r.converged || r.residual <= spec.residual {
        true => String::new(),
        false => format!(", {:e} was asked for and not reached", spec.residual),
    };
    lines.push(("steps", r.steps.to_string()));
    lines.push((
        "residual",
        format!("{:.2e} of the emitted power{reached}", r.residual),
    ));
    lines.extend(balance(spec, solution));
    lines.push((
        "seconds",
        format!(
            "{:.2} scene, {:.2} patches, {:.2} form factors, {:.2} solving, {:.2} pictures, {:.2} mesh",
            (seconds.load + seconds.build).as_secs_f64(),
            r.mesh_seconds,
            r.form_factor_seconds,
            r.solve_seconds,
            seconds.snapshots.as_secs_f64(),
            seconds.write.as_secs_f64(),
        ),
    ));
    let line = |(name, value): (&str, String)| format!("  {name:<13} {value}\n");
    lines.into_iter().map(line).collect()
}

fn form_factors(method: FormFactorMethod) -> String {
    let name = method.name();
    match method {
        FormFactorMethod::Hemicube { resolution } => format!("{name}, {resolution} pixels wide"),
        FormFactorMethod::MonteCarlo { samples } | FormFactorMethod::Analytic { samples } => {
            format!("{name}, {samples} samples per pair of patches")
        }
    }
}

/// Where the energy comes from and where it goes, summed over the channels.
fn balance(spec: &SolveSpec, solution: &Solution) -> Vec<(&'static str, String)> {
    let r = &solution.report;
    let watts = |x: Rgb64| x.element_sum();
    let all = watts(r.emitted) + watts(r.external);
    let mut from = format!("{:.4e} W by patches", watts(r.emitted));
    if watts(r.external) > 0.0 {
        from += &format!(", {:.4e} W by other lights", watts(r.external));
    }
    if all <= 0.0 {
        return vec![("emitted", from)];
    }
    let share = |x: Rgb64| 100.0 * watts(x) / all;
    let (absorbed, escaped) = (share(r.absorbed), share(r.escaped));
    let swallows = solution.mesh.surfaces.left_out.share() > 0.0 || r.other > 0.0;
    let to = match (spec.solver, swallows) {
        // What escapes is known by what did not stay.
        (Solver::Hierarchical, false) => {
            format!("{absorbed:.2} % absorbed, {escaped:.2} % escaped or missing")
        }
        (Solver::Hierarchical, true) => format!(
            "{absorbed:.2} % absorbed, {escaped:.2} % escaped, missing, or met what has no patches"
        ),
        _ => format!(
            "{absorbed:.2} % absorbed, {escaped:.2} % escaped, {:+.2} % missing",
            100.0 - absorbed - escaped
        ),
    };
    vec![("emitted", from), ("balance", to)]
}

/// Prints as much as the reader takes: a pipe that closes early is no fault.
pub(super) fn show(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// Says which files there are now.
pub(super) fn written(outputs: &[PathBuf], pictures: usize, folder: Option<&Path>) {
    let files: Vec<String> = outputs.iter().map(|p| p.display().to_string()).collect();
    let mut text = format!("wrote {}", files.join(", "));
    if let Some(folder) = folder {
        text += &format!("; {pictures} pictures are in {}", folder.display());
    }
    eprintln!("{text}");
}

/// The file that `--stats` writes.
pub(super) fn statistics(
    scene: &str,
    spec: &SolveSpec,
    solution: &Solution,
    seconds: &Seconds,
    threads: usize,
) -> Value {
    let r = &solution.report;
    let flat = spec.solver != Solver::Hierarchical;
    let method = flat.then(|| match spec.form_factors {
        FormFactorMethod::Hemicube { resolution } => {
            json!({ "method": "hemicube", "resolution": resolution })
        }
        FormFactorMethod::MonteCarlo { samples } | FormFactorMethod::Analytic { samples } => {
            json!({ "method": spec.form_factors.name(), "samples": samples })
        }
    });
    let quality = r.quality.as_ref().map(|q| {
        json!({
            "row_sum": [q.row_sum_min, q.row_sum_mean, q.row_sum_max],
            "rows_off": q.rows_off,
            "row_tolerance": q.row_tolerance,
            "reciprocity_rms": q.reciprocity_rms,
            "reciprocity_max": q.reciprocity_max,
            "self_max": q.self_max,
            "lost_pairs": q.lost_pairs,
            "lost_share": q.lost_share,
            "lost_patches": q.lost_patches,
        })
    });
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "scene": scene,
        "solver": spec.solver.name(),
        "form_factors": method,
        "closure": quality,
        "discontinuities": spec.discontinuities,
        "threads": threads,
        "patches": r.patches,
        "links": r.links,
        "area": solution.mesh.area(),
        "steps": r.steps,
        "residual": r.residual,
        "converged": r.converged,
        "watts": {
            "emitted": r.emitted.to_array(),
            "external": r.external.to_array(),
            "absorbed": r.absorbed.to_array(),
            "escaped": r.escaped.to_array(),
        },
        "other": r.other,
        "warnings": r.warnings,
        "seconds": {
            "load": seconds.load.as_secs_f64(),
            "build": seconds.build.as_secs_f64(),
            "mesh": r.mesh_seconds,
            "form_factors": r.form_factor_seconds,
            "solve": r.solve_seconds,
            "snapshots": seconds.snapshots.as_secs_f64(),
            "write": seconds.write.as_secs_f64(),
        },
        "peak_memory_bytes": memory::peak(),
    })
}

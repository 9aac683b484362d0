//! What is told of a rendering at its end.

use std::path::PathBuf;
use std::time::Duration;

use serde_json::json;

use super::Failure;
use super::progress::human_seconds;
use crate::film::Film;
use crate::image_io::Image;
use crate::render::{Job, Metadata, Stats, Stop, TechniqueStats, percent};
use crate::study::memory;

pub(super) struct Seconds {
    pub load: Duration,
    pub build: Duration,
    pub write: Duration,
}

/// Writes to every output even if one fails: what took long to render must not be lost to one bad path.
pub(super) fn write_all(image: &Image, outputs: &[PathBuf]) -> Result<(), Failure> {
    let results: Vec<_> = outputs.iter().map(|path| image.write(path)).collect();
    results
        .into_iter()
        .collect::<Result<(), _>>()
        .map_err(Failure::from)
}

/// Bias that reading radiosity gave to the mean of the picture, and its standard error, relative to that mean.
pub(super) fn cache_bias(film: &Film, stats: &Stats) -> Option<[f64; 2]> {
    let window = film.window();
    let pixels = f64::from(window.width) * f64::from(window.height);
    let luminance = |[r, g, b]: &[f64; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let mean = film.mean().iter().map(luminance).sum::<f64>() / pixels;
    let bias = stats.bias.mean(film.samples())?;
    (mean > 0.0).then(|| bias.map(|b| b / mean))
}

/// Bias, as a share of the picture's mean, and standard errors of it, from which on it is worth a warning.
const MUCH_BIAS: [f64; 2] = [0.05, 4.0];

/// Says so where reading radiosity made the picture much brighter or darker.
pub(super) fn warn_of_bias(bias: Option<[f64; 2]>) {
    let [much, sure] = MUCH_BIAS;
    if let Some([mean, stderr]) = bias
        && mean.abs() > much.max(sure * stderr)
    {
        eprintln!(
            "warning: the picture is too {} by {:.0} % in the mean, since radiosity is too coarse: give it more walks, or \
             use --indirect guide or none",
            if mean > 0.0 { "bright" } else { "dark" },
            100.0 * mean.abs()
        );
    }
}

/// One line: what was done, how fast, and how large the error is.
pub(super) fn summary(film: &Film, stats: &Stats, outputs: &[PathBuf]) -> String {
    let error = match film.estimate_error() {
        Some(e) => {
            let [value, low, high] = percent(&e);
            format!(
                "estimated relMSE {:.3e} (95 %: {:.3e} to {:.3e}), a relative error of {value:.2} % ({low:.2} % to {high:.2} %) per pixel",
                e.relmse, e.ci95[0], e.ci95[1]
            )
        }
        None => format!(
            "{} samples per pixel give no estimate of the error",
            film.spp()
        ),
    };
    let bias = match cache_bias(film, stats) {
        Some([mean, stderr]) => format!(
            "; bias by radiosity {:+.2} % (standard error {:.2} %) of the picture's mean",
            100.0 * mean,
            100.0 * stderr
        ),
        None => String::new(),
    };
    let files = outputs
        .iter()
        .map(|p| p.display().to_string())
        .collect::<Vec<_>>()
        .join(", ");
    let range = match film.range() {
        Some(_) => String::new(),
        None => {
            let counts = film.counts();
            let (least, most) = (counts.iter().min(), counts.iter().max());
            format!(
                " in the mean ({} to {})",
                least.unwrap_or(&0),
                most.unwrap_or(&0)
            )
        }
    };
    format!(
        "{} samples per pixel{range} in {}, {:.2} Mrays/s; {error}{bias}; wrote {files}",
        film.spp(),
        human_seconds(stats.seconds),
        stats.rays_per_second() / 1e6
    )
}

pub(super) fn report_invalid(stats: &Stats) {
    if let Some((x, y, sample, value)) = stats.invalid.first {
        eprintln!(
            "warning: {} samples were NaN, infinite or negative and are left out: a fault of luxel, please report it; \
             the first: pixel ({x}, {y}), sample {sample}, value {:?}",
            stats.invalid.count,
            value.to_array()
        );
    }
}

/// The file that `--stats` writes.
pub(super) fn statistics(
    job: &Job,
    film: &Film,
    stats: &Stats,
    metadata: &Metadata,
    seconds: &Seconds,
    threads: usize,
) -> serde_json::Value {
    let plan = job.scene.plan().entries.iter();
    let plan: Vec<_> = plan
        .map(|e| json!({ "subject": e.subject, "decision": e.decision, "reason": e.reason }))
        .collect();
    let phases = &stats.phases;
    let mut clock = json!({
        "load": seconds.load.as_secs_f64(),
        "build": seconds.build.as_secs_f64(),
        "precompute": phases.precompute(),
        "render": stats.seconds - phases.precompute(),
        "write": seconds.write.as_secs_f64(),
    });
    let techniques = job.technique_stats(film, stats);
    if !techniques.is_empty() {
        clock["photons"] = json!(phases.photons);
        clock["map"] = json!(phases.map);
        clock["camera"] = json!(phases.samples);
        clock["splats"] = json!(phases.splats);
    }
    if let Some(report) = &stats.solution {
        clock["radiosity"] = json!(phases.radiosity);
        clock["radiosity_mesh"] = json!(report.mesh_seconds);
        clock["radiosity_form_factors"] = json!(report.form_factor_seconds);
        clock["radiosity_solve"] = json!(report.solve_seconds);
    }
    let describe = |t: &TechniqueStats| {
        json!({
            "name": t.name,
            "energy_share": t.energy_share,
            "variance": t.variance,
            "rays": t.rays,
        })
    };
    let techniques: Vec<_> = techniques.iter().map(describe).collect();
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "scene": metadata.scene,
        "integrator": job.integrator.name(),
        "resolution": [film.window().width, film.window().height],
        "spp": film.spp(),
        "seed": job.seed,
        "threads": threads,
        "seconds": clock,
        "rays": {
            "camera": stats.rays.camera,
            "shadow": stats.rays.shadow,
            "indirect": stats.rays.indirect,
            "photon": stats.rays.photon,
        },
        "rays_per_second": stats.rays_per_second(),
        "peak_memory_bytes": memory::peak(),
        "estimated_error": film.estimate_error().map(|e| json!({ "relmse": e.relmse, "ci95": e.ci95 })),
        "invalid_samples": stats.invalid.count,
        "techniques": techniques,
        "radiosity": stats.solution.as_ref().map(|r| json!({
            "patches": r.patches,
            "links": r.links,
            "steps": r.steps,
            "residual": r.residual,
            "converged": r.converged,
            "other": r.other,
        })),
        "bias": cache_bias(film, stats).map(|[mean, stderr]| json!({
            "of": "light between diffuse surfaces read from radiosity, relative to the picture's mean",
            "mean": mean,
            "stderr": stderr,
            "reads": stats.bias.reads,
            "compared": stats.bias.compared,
        })),
        "plan": plan,
    })
}

/// Says so where the picture is not as good as was asked for.
pub(super) fn warn_of_target(job: &Job, stop: Stop, film: &Film) {
    if let Stop::Error { target, .. } = stop
        && !job.is_good_enough(film, &target)
    {
        eprintln!(
            "warning: the picture is not as good as the {} that was asked for: go on by --resume",
            shown_target(&target)
        );
    }
}

fn shown_target(target: &crate::render::Target) -> String {
    let error = 100.0 * target.error;
    match target.quantile {
        None => format!("{error} %"),
        Some(q) => format!("{error} % at {} % of the pixels", 100.0 * q),
    }
}

//! `luxel render`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde_json::json;

use super::numbers::whole;
use super::progress::{Progress, ProgressMode, human_seconds};
use super::{Failure, Outcome};
use crate::film::{Film, Window};
use crate::format::{self, Overrides};
use crate::image_io::{self, Image};
use crate::render::{Job, Metadata, Stats, Stop, TechniqueStats, percent};
pub(super) use crate::study::memory::peak as peak_memory;

#[derive(Args, Debug)]
pub struct RenderArgs {
    /// Scene file in Mitsuba's XML; without it, the scene built into the program
    pub scene: Option<PathBuf>,
    /// Image to write: .exr (all layers), .png, .jpg, .hdr or .pfm; may be given several times
    /// [default: SCENE.exr and SCENE.png in the current folder]
    #[arg(short, long = "output", value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Use this integrator in place of the scene's
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<String>,
    /// How a path tracer finds light between diffuse surfaces: none (by itself), gather (read from radiosity,
    /// biased), guide (radiosity says where walks go, unbiased)
    #[arg(long, value_name = "WAY")]
    pub indirect: Option<String>,
    /// Use this sampler in place of the scene's: sobol, independent
    #[arg(long, value_name = "NAME")]
    pub sampler: Option<String>,
    /// Samples per pixel [default: what the scene's sampler says, else 4]
    #[arg(long, value_name = "N", conflicts_with = "time", allow_negative_numbers = true, value_parser = whole(1..=u64::MAX))]
    pub spp: Option<u64>,
    /// Render for this long: 500ms, 90s, 5m, 1h; at least one sample per pixel is taken
    #[arg(long, value_name = "TIME", allow_negative_numbers = true, value_parser = parse_duration)]
    pub time: Option<Duration>,
    /// Seed of the random numbers [default: that of the scene's sampler, else 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(0..=u64::MAX))]
    pub seed: Option<u64>,
    /// Threads to render with [default: one per processor]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=u16::MAX))]
    pub threads: Option<u16>,
    /// Size of the full picture, in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_resolution)]
    pub resolution: Option<[u32; 2]>,
    /// Part of the picture to render, in pixels of the full picture
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_window)]
    pub crop: Option<Window>,
    /// Longest path: 1 shows emitters only, 2 adds direct light, -1 sets no limit
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(-1..=1_000_000i64))]
    pub max_depth: Option<i64>,
    /// Set a parameter of the scene that it names with <default>
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_define)]
    pub define: Vec<(String, String)>,
    /// Layers to add to the EXR: albedo, normal, depth, position, uv, shape_id
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub aov: Vec<String>,
    /// How to show progress
    #[arg(long, value_enum, default_value_t = ProgressMode::Auto)]
    pub progress: ProgressMode,
    /// Write statistics to this file, as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
}

pub fn parse_duration(text: &str) -> Result<Duration, String> {
    let split = text
        .find(|c: char| c.is_ascii_alphabetic())
        .unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let factor = match unit {
        "ms" => 1e-3,
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(format!("unknown unit \"{unit}\": use ms, s, m or h")),
    };
    let seconds = number
        .trim()
        .parse::<f64>()
        .map_err(|_| "expected a time such as 90s or 5m".to_string())?;
    Duration::try_from_secs_f64(seconds * factor)
        .ok()
        .filter(|d| !d.is_zero())
        .ok_or_else(|| "expected a time above zero".to_string())
}

fn parse_numbers<const N: usize>(
    text: &str,
    separator: char,
    form: &str,
) -> Result<[u32; N], String> {
    let numbers: Result<Vec<u32>, _> = text.split(separator).map(|n| n.trim().parse()).collect();
    numbers
        .ok()
        .and_then(|n| n.try_into().ok())
        .ok_or_else(|| format!("expected {form}"))
}

pub fn parse_resolution(text: &str) -> Result<[u32; 2], String> {
    parse_numbers(text, 'x', "a size such as 640x480")
}

fn parse_window(text: &str) -> Result<Window, String> {
    let [x, y, width, height] = parse_numbers(text, ',', "X,Y,W,H such as 100,50,64,64")?;
    Ok(Window {
        x,
        y,
        width,
        height,
    })
}

pub fn parse_define(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    Ok((name.to_string(), value.to_string()))
}

pub fn run(args: &RenderArgs, command_line: &str) -> Result<Outcome, Failure> {
    let stopped = Arc::new(AtomicBool::new(false));
    watch_for_interrupt(&stopped, "pass")?;
    let pool = pool(args.threads)?;
    let outputs = outputs(args);
    if let Some(unknown) = outputs.iter().find(|p| !Image::can_write_extension(p)) {
        let what = format!(
            "-o {}: the extension is not .exr, .png, .jpg, .hdr or .pfm",
            unknown.display()
        );
        return Err(Failure::Usage(what));
    }
    let start = Instant::now();
    let desc = match &args.scene {
        Some(path) => format::load(path, &args.define)?,
        None => format::load_built_in(&args.define)?,
    };
    let load = start.elapsed();
    let overrides = Overrides {
        integrator: args.integrator.clone(),
        indirect: args.indirect.clone(),
        sampler: args.sampler.clone(),
        max_depth: args.max_depth,
        resolution: args.resolution,
        crop: args.crop,
        aovs: args.aov.clone(),
        seed: args.seed,
    };
    let compiled = pool.install(|| format::compile(&desc, &overrides))?;
    let build = start.elapsed() - load;
    for warning in &compiled.warnings {
        eprintln!("warning: {warning}");
    }
    // Better before a long rendering than after it.
    outputs.iter().try_for_each(Image::check_target)?;
    args.stats
        .iter()
        .try_for_each(|path| image_io::check_writable(path))?;
    let stop = match (args.spp, args.time) {
        (Some(n), _) => Stop::Spp(n),
        (None, Some(time)) => Stop::Time(time),
        (None, None) => Stop::Spp(compiled.spp),
    };
    let job = &compiled.job;
    let mut progress = Progress::new(args.progress);
    let rendered = pool.install(|| {
        job.render(stop, |film, stats| {
            progress.update(film, stats, stop);
            match stopped.load(Ordering::Relaxed) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        })
    });
    progress.finish();
    let (film, stats) = rendered.map_err(|e| Failure::Input(e.to_string()))?;
    let warnings = stats.solution.iter().flat_map(|report| &report.warnings);
    warnings.for_each(|warning| eprintln!("warning: {warning}"));
    let threads = pool.current_num_threads();

    let write_start = Instant::now();
    let metadata = Metadata {
        scene: scene_name(args.scene.as_deref()),
        scene_hash: compiled.hash.clone(),
        command_line: command_line.to_string(),
    };
    let image = job.picture(&film, &stats, &metadata);
    write_all(&image, &outputs)?;
    let seconds = Seconds {
        load,
        build,
        write: write_start.elapsed(),
    };
    if let Some(path) = &args.stats {
        let text = format!(
            "{:#}\n",
            statistics(job, &film, &stats, &metadata, &seconds, threads)
        );
        image_io::write_atomic(path, text.as_bytes())?;
    }
    warn_of_bias(cache_bias(&film, &stats));
    eprintln!("{}", summary(&film, &stats, &outputs));
    report_invalid(&stats);
    Ok(if stopped.load(Ordering::Relaxed) {
        Outcome::Interrupted
    } else {
        Outcome::Done
    })
}

struct Seconds {
    load: Duration,
    build: Duration,
    write: Duration,
}

/// First Ctrl-C: finish the pass, or whatever the `work` is made of, and write. Second: end at once.
pub(super) fn watch_for_interrupt(
    stopped: &Arc<AtomicBool>,
    work: &'static str,
) -> Result<(), Failure> {
    let flag = Arc::clone(stopped);
    let handler = move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        eprintln!(
            "\nstopping after this {work} and writing what is done; press Ctrl-C again to end at once"
        );
    };
    ctrlc::set_handler(handler).map_err(|e| Failure::Input(format!("cannot watch for Ctrl-C: {e}")))
}

/// The threads that were asked for.
pub(super) fn pool(threads: Option<u16>) -> Result<ThreadPool, Failure> {
    let count = threads.map_or(0, usize::from);
    let pool = ThreadPoolBuilder::new().num_threads(count).build();
    pool.map_err(|e| Failure::Usage(format!("cannot start {count} threads: {e}")))
}

/// The scene's file name without folder and extension.
pub(super) fn scene_name(scene: Option<&Path>) -> String {
    let stem = scene
        .and_then(Path::file_stem)
        .map(|s| s.to_string_lossy().into_owned());
    stem.unwrap_or_else(|| format::BUILT_IN_NAME.to_string())
}

fn outputs(args: &RenderArgs) -> Vec<PathBuf> {
    if !args.output.is_empty() {
        return args.output.clone();
    }
    let name = scene_name(args.scene.as_deref());
    ["exr", "png"]
        .iter()
        .map(|e| PathBuf::from(format!("{name}.{e}")))
        .collect()
}

/// Writes to every output even if one fails: what took long to render must not be lost to one bad path.
fn write_all(image: &Image, outputs: &[PathBuf]) -> Result<(), Failure> {
    let results: Vec<_> = outputs.iter().map(|path| image.write(path)).collect();
    results
        .into_iter()
        .collect::<Result<(), _>>()
        .map_err(Failure::from)
}

/// Bias that reading radiosity gave to the mean of the picture, and its standard error, relative to that mean.
fn cache_bias(film: &Film, stats: &Stats) -> Option<[f64; 2]> {
    let window = film.window();
    let pixels = u64::from(window.width) * u64::from(window.height);
    let luminance = |[r, g, b]: &[f64; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let mean = film.mean().iter().map(luminance).sum::<f64>() / pixels as f64;
    let bias = stats.bias.mean(pixels * film.spp())?;
    (mean > 0.0).then(|| bias.map(|b| b / mean))
}

/// Bias, as a share of the picture's mean, and standard errors of it, from which on it is worth a warning.
const MUCH_BIAS: [f64; 2] = [0.05, 4.0];

/// Says so where reading radiosity made the picture much brighter or darker.
fn warn_of_bias(bias: Option<[f64; 2]>) {
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
fn summary(film: &Film, stats: &Stats, outputs: &[PathBuf]) -> String {
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
    format!(
        "{} samples per pixel in {}, {:.2} Mrays/s; {error}{bias}; wrote {files}",
        film.spp(),
        human_seconds(stats.seconds),
        stats.rays_per_second() / 1e6
    )
}

fn report_invalid(stats: &Stats) {
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
fn statistics(
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
        "peak_memory_bytes": peak_memory(),
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

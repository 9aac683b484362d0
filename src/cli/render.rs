//! `luxel render`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::numbers::whole;
use super::preview::{self, Viewer};
use super::progress::{Progress, ProgressMode};
use super::resume::{self, Checkpoints, Interval, Rendering, parse_interval};
use super::told::{self, Seconds};
use super::{Failure, Outcome, choosing};
use crate::film::Window;
use crate::format::{self, Overrides};
use crate::image_io::{self, Image};
use crate::render::{Metadata, Shard, Stats, Stop, Target, Work};

#[derive(Args, Debug)]
pub struct RenderArgs {
    /// Scene file in Mitsuba's XML; without it, the scene built into the program
    pub scene: Option<PathBuf>,
    /// Image to write: .exr (all layers), .png, .jpg, .hdr or .pfm; may be given several times
    /// [default: SCENE.exr and SCENE.png in the current folder]
    #[arg(short, long = "output", value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Use this integrator in place of the scene's; auto tries those that find all light of the scene, and takes the
    /// most efficient one
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
    /// Render until the error is no more than this: 1% (relative root mean square error of the picture), or 2%@p95
    /// (that of 95 % of the pixels); samples go where the error is. With --time, no longer than that
    #[arg(long, value_name = "ERROR", conflicts_with = "spp", value_parser = parse_target)]
    pub target_error: Option<Target>,
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
    /// Show the picture while it is rendered, in the viewer tev that listens there (by itself on 127.0.0.1:14158)
    #[arg(long, value_name = "HOST:PORT", value_parser = preview::parse_address)]
    pub preview: Option<String>,
    /// Go on from the checkpoint beside the first output, or from the shard that is there; without one, from the start
    #[arg(long)]
    pub resume: bool,
    /// How often to write a checkpoint beside the first output, as NAME.checkpoint.exr: 60s, 10m, never
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = parse_interval)]
    pub checkpoint: Interval,
    /// Render only part I of N of the samples, to be joined by `luxel merge`: every output must be an EXR file
    #[arg(long, value_name = "I/N", value_parser = parse_shard, conflicts_with_all = ["time", "target_error"])]
    pub shard: Option<Shard>,
    /// How to show progress
    #[arg(long, value_enum, default_value_t = ProgressMode::Auto)]
    pub progress: ProgressMode,
    /// Write statistics to this file, as JSON
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
}

pub(super) fn parse_duration(text: &str) -> Result<Duration, String> {
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

/// `1%`, `0.01`, `2%@p95`.
fn parse_target(text: &str) -> Result<Target, String> {
    let expected = "expected an error such as 1% or 2%@p95";
    let (error, quantile) = match text.split_once('@') {
        None => (text, None),
        Some((error, quantile)) => (error, Some(quantile)),
    };
    let number = |text: &str| {
        text.trim()
            .parse::<f64>()
            .ok()
            .filter(|x| *x > 0.0 && x.is_finite())
    };
    let error = match error.trim().strip_suffix('%') {
        Some(percent) => number(percent).map(|p| p / 100.0),
        None => number(error),
    };
    let quantile = match quantile {
        None => None,
        Some(text) => {
            let percent = text.trim().strip_prefix('p').and_then(number);
            let share = percent.map(|p| p / 100.0).filter(|share| *share < 1.0);
            Some(share.ok_or(expected)?)
        }
    };
    Ok(Target {
        error: error.ok_or(expected)?,
        quantile,
    })
}

/// `2/8`.
fn parse_shard(text: &str) -> Result<Shard, String> {
    /// More shards than samples make no sense.
    const MOST: u64 = 1 << 32;
    let numbers = text
        .split_once('/')
        .map(|(i, n)| (i.trim().parse(), n.trim().parse()));
    match numbers {
        Some((Ok(number), Ok(of))) if number >= 1 && number <= of && of <= MOST => {
            Ok(Shard { number, of })
        }
        _ => Err("expected I/N with I from 1 to N, such as 2/8".to_string()),
    }
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
    // Who asked for a viewer wants to know before all else that it is not there.
    let viewer = args.preview.as_deref().map(Viewer::connect).transpose()?;
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
    let mut compiled = pool.install(|| format::compile(&desc, &overrides))?;
    let build = start.elapsed() - load;
    for warning in &compiled.warnings {
        eprintln!("warning: {warning}");
    }
    // Better before a long rendering than after it.
    outputs.iter().try_for_each(Image::check_target)?;
    let is_exr = |path: &&PathBuf| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    };
    if args.shard.is_some()
        && let Some(other) = outputs.iter().find(|path| !is_exr(path))
    {
        let what = format!(
            "-o {}: a shard is an EXR file: use -o NAME.exr",
            other.display()
        );
        return Err(Failure::Usage(what));
    }
    if compiled.choice.is_some() && args.shard.is_some() {
        let what = "--integrator auto: each shard would choose for itself: choose by a render without --shard, and give \
                    all shards the integrator that it names";
        return Err(Failure::Usage(what.to_string()));
    }
    args.stats
        .iter()
        .try_for_each(|path| image_io::check_writable(path))?;
    let work = Work {
        stop: match (args.target_error, args.spp, args.time) {
            (Some(target), _, within) => Stop::Error { target, within },
            (None, Some(n), _) => Stop::Spp(n),
            (None, None, Some(time)) => Stop::Time(time),
            (None, None, None) => Stop::Spp(compiled.spp),
        },
        shard: args.shard,
    };
    let stop = work.stop;
    let name = scene_name(args.scene.as_deref());
    let preview = viewer.map(|v| v.open(&name, compiled.job.film.crop));
    let mut preview = preview.transpose()?;
    let metadata = Metadata {
        scene: name,
        scene_hash: compiled.hash.clone(),
        command_line: command_line.to_string(),
    };
    let mut progress = Progress::new(args.progress);
    let is_stopped = || stopped.load(Ordering::Relaxed);
    let mut choice = None;
    let mut begun = None;
    if let Some(candidates) = compiled.choice.take() {
        let job = &mut compiled.job;
        let checkpoint = resume::beside(&outputs[0]);
        if !(args.resume && choosing::goes_on(job, &candidates, &checkpoint, &work, &desc)?) {
            let chosen = pool
                .install(|| choosing::choose(job, candidates, &work, &mut progress, is_stopped));
            let (chosen, film, stats) = chosen?;
            (choice, begun) = (Some(chosen), Some((film, stats)));
        }
    }
    let job = &compiled.job;
    let rendering = Rendering::new(job, work, &desc, &metadata);
    let mut checkpoints = Checkpoints::new(&outputs[0], args.checkpoint.0, &rendering);
    let (film, stats) = match begun {
        Some(begun) => begun,
        None if args.resume => checkpoints.resume()?,
        None => (job.film_for(&work), Stats::default()),
    };
    let rendered = pool.install(|| {
        job.go_on(&work, film, stats, |film, stats| {
            progress.update(film, stats, stop);
            let warning = checkpoints.update(film, stats);
            warning.iter().for_each(|w| progress.warn(w));
            let warning = preview.as_mut().and_then(|p| p.update(film));
            warning.iter().for_each(|w| progress.warn(w));
            match is_stopped() {
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
    let interrupted = is_stopped();
    let image = match work.shard {
        None => job.picture(&film, &stats, &metadata),
        Some(_) => rendering.image(&film, &stats)?,
    };
    if let Err(failure) = told::write_all(&image, &outputs) {
        // What took long must not be lost to a bad path.
        let kept = checkpoints.write(&film, &stats);
        return Err(match kept {
            Ok(path) => Failure::Output(format!(
                "{failure}; what was rendered is kept in {}: go on by --resume",
                path.display()
            )),
            Err(_) => failure,
        });
    }
    let seconds = Seconds {
        load,
        build,
        write: write_start.elapsed(),
    };
    if let Some(path) = &args.stats {
        let mut told = told::statistics(job, &film, &stats, &metadata, &seconds, threads);
        if let Some(choice) = &choice {
            told["auto"] = choice.to_json();
        }
        let text = format!("{told:#}\n");
        image_io::write_atomic(path, text.as_bytes())?;
    }
    // Only now that all is written: the viewer may keep it waiting.
    let warning = preview.and_then(|p| p.finish(&film));
    warning.iter().for_each(|w| progress.warn(w));
    told::warn_of_bias(told::cache_bias(&film, &stats));
    told::warn_of_target(job, stop, &film);
    eprintln!("{}", told::summary(&film, &stats, &outputs));
    told::report_invalid(&stats);
    // A picture that was interrupted, or ran out of time, may be gone on with. It is written already: what fails
    // now loses nothing.
    let is_late = |target: &Target| !job.is_good_enough(&film, target);
    // Who stopped the choice of an integrator made none.
    let is_chosen = choice.as_ref().is_none_or(|choice| !choice.stopped);
    let may_go_on = interrupted || args.target_error.as_ref().is_some_and(is_late);
    match may_go_on && is_chosen {
        true => {
            let warning = checkpoints.keep(&film, &stats);
            warning.iter().for_each(|w| progress.warn(w));
        }
        false => checkpoints.remove(),
    }
    Ok(match interrupted {
        true => Outcome::Interrupted,
        false => Outcome::Done,
    })
}

/// First Ctrl-C: finish the pass, or whatever the `work` is made of, and write. Second: end at once; but not in the same
/// moment, since programs that end others may signal a process and then its whole group.
pub(super) fn watch_for_interrupt(
    stopped: &Arc<AtomicBool>,
    work: &'static str,
) -> Result<(), Failure> {
    const SAME_MOMENT: Duration = Duration::from_millis(500);
    let flag = Arc::clone(stopped);
    let mut first: Option<Instant> = None;
    let handler = move || {
        if first.is_some_and(|first| first.elapsed() > SAME_MOMENT) {
            std::process::exit(130);
        }
        flag.store(true, Ordering::Relaxed);
        if first.is_some() {
            return;
        }
        first = Some(Instant::now());
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

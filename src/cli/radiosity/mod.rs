//! `luxel radiosity`.

mod args;
mod report;
mod snapshots;

pub use args::RadiosityArgs;

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rayon::ThreadPool;

use super::progress::Steps;
use super::render::{pool, scene_name, watch_for_interrupt};
use super::{Failure, Outcome};
use crate::format::{self, Overrides};
use crate::image_io;
use crate::radiosity::export::{ColoredMesh, ExportSpec, MeshFormat};
use crate::radiosity::{self, Display, Solution};
use crate::scene::Scene;
use crate::transport::{Indirect, IntegratorSpec};
use snapshots::Snapshots;

/// Seconds of what goes around solving.
#[derive(Clone, Copy, Debug, Default)]
struct Seconds {
    load: Duration,
    build: Duration,
    snapshots: Duration,
    write: Duration,
}

pub fn run(args: &RadiosityArgs, command_line: &str) -> Result<Outcome, Failure> {
    let stopped = Arc::new(AtomicBool::new(false));
    watch_for_interrupt(&stopped, "step")?;
    let pool = pool(args.threads)?;
    let outputs = outputs(args);
    if let Some(unknown) = outputs.iter().find(|p| MeshFormat::of(p).is_none()) {
        let what = format!(
            "-o {}: the extension is not {}",
            unknown.display(),
            MeshFormat::EXTENSIONS
        );
        return Err(Failure::Usage(what));
    }
    let start = Instant::now();
    let desc = match &args.scene {
        Some(path) => format::load(path, &args.define)?,
        None => format::load_built_in(&args.define)?,
    };
    let mut seconds = Seconds {
        load: start.elapsed(),
        ..Seconds::default()
    };
    let compile = || pool.install(|| format::compile(&desc, &Overrides::default()));
    let compiled = compile()?;
    seconds.build = start.elapsed() - seconds.load;
    for warning in &compiled.warnings {
        eprintln!("warning: {warning}");
    }
    let spec = args.spec(&compiled.job.integrator)?;
    // Better before long work than after it.
    for path in outputs.iter().chain(&args.stats) {
        image_io::check_writable(path)?;
    }
    let mut snapshots = match &args.snapshots {
        // Pictures are another job on the same scene, whose integrator changes from one to the next.
        Some(folder) => Some(Snapshots::new(folder, args, compile()?.job, command_line)?),
        None => None,
    };
    let mut steps = Steps::new(args.progress);
    let scene = &compiled.job.scene;
    let mut failure = None;
    let solved = pool.install(|| {
        radiosity::solve(scene, &spec, &mut |progress| {
            steps.update(progress);
            if let Some(snapshots) = &mut snapshots
                && let Err(error) = snapshots.see(progress, spec.ambient)
            {
                failure = Some(error);
                return ControlFlow::Break(());
            }
            match stopped.load(Ordering::Relaxed) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        })
    });
    steps.finish();
    if let Some(failure) = failure {
        return Err(failure);
    }
    let solution = Arc::new(solved.map_err(|e| Failure::Input(e.to_string()))?);
    for warning in &solution.report.warnings {
        eprintln!("warning: {warning}");
    }
    if let Some(snapshots) = &mut snapshots {
        pool.install(|| snapshots.finish(&solution))?;
        seconds.snapshots = snapshots.spent();
    }
    let writing = Instant::now();
    write_meshes(args, &pool, scene, &solution, &outputs)?;
    seconds.write = writing.elapsed();
    if let Some(path) = &args.stats {
        let threads = pool.current_num_threads();
        let name = scene_name(args.scene.as_deref());
        let text = report::statistics(&name, &spec, &solution, &seconds, threads);
        image_io::write_atomic(path, format!("{text:#}\n").as_bytes())?;
    }
    let pictures = snapshots.map_or(0, |s| s.written());
    report::show(&report::table(&spec, &solution, &seconds));
    report::written(&outputs, pictures, args.snapshots.as_deref());
    Ok(match stopped.load(Ordering::Relaxed) {
        true => Outcome::Interrupted,
        false => Outcome::Done,
    })
}

/// Where meshes go: as asked for, else to the current folder.
fn outputs(args: &RadiosityArgs) -> Vec<PathBuf> {
    match args.output.is_empty() {
        true => vec![PathBuf::from(format!(
            "{}.glb",
            scene_name(args.scene.as_deref())
        ))],
        false => args.output.clone(),
    }
}

/// Writes to every output even if one fails: what took long must not be lost to one bad path.
fn write_meshes(
    args: &RadiosityArgs,
    pool: &ThreadPool,
    scene: &Scene,
    solution: &Solution,
    outputs: &[PathBuf],
) -> Result<(), Failure> {
    let spec = ExportSpec {
        shading: args.show.into(),
        exposure: args.exposure,
        up: args.up.into(),
    };
    let mesh = pool.install(|| {
        let display = Display::new(scene, &solution.mesh);
        ColoredMesh::new(
            &solution.mesh,
            &display,
            &solution.radiosity,
            scene.center(),
            &spec,
        )
    });
    let glb = |p: &PathBuf| MeshFormat::of(p) == Some(MeshFormat::Glb);
    if mesh.clipped > 0.01 && outputs.iter().any(glb) {
        eprintln!(
            "warning: {:.0} % of the area is brighter than 1, the brightest that glTF has, and is written as 1: \
             use an --exposure below {}",
            100.0 * mesh.clipped,
            args.exposure
        );
    }
    let results: Vec<_> = outputs
        .iter()
        .map(|path: &PathBuf| mesh.write(Path::new(path), spec.up))
        .collect();
    results
        .into_iter()
        .collect::<Result<(), _>>()
        .map_err(Failure::from)
}

/// What the scene asks for, where its integrator solves for radiosity.
fn of_scene(integrator: &IntegratorSpec) -> Option<radiosity::SolveSpec> {
    match integrator {
        IntegratorSpec::Radiosity(spec) => Some(spec.solve.clone()),
        // Where nothing is read, its settings are not meant for looking at.
        other => (other.cache())
            .filter(|cache| cache.indirect != Indirect::None)
            .map(|cache| cache.solve),
    }
}

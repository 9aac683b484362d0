//! What a checkpoint costs: the time to write one, for pictures of several sizes, and the share of the rendering time
//! that is at the interval of `luxel render` (60 s, or a hundred times what the last one took, if that is longer; only
//! before the first one is it not known what it takes).

use std::ops::ControlFlow;
use std::path::Path;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion};
use luxel::format::{self, Overrides};
use luxel::render::{Identity, Metadata, Stop, Work};

/// As many that all replicates hold something, for what is empty is written sooner.
const SPP: u64 = 16;
/// Of `--checkpoint`, unless another is given.
const INTERVAL: f64 = 60.0;
/// `luxel render` waits this many times what the last checkpoint took.
const TIMES: f64 = 100.0;

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .measurement_time(Duration::from_secs(5))
        .warm_up_time(Duration::from_millis(500))
        .configure_from_args();
    let mut group = criterion.benchmark_group("checkpoint");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let file = folder.join("bench.checkpoint.exr");
    for resolution in [[320, 180], [640, 360], [1280, 720]] {
        let overrides = Overrides {
            resolution: Some(resolution),
            // Sooner rendered; what is written is as long.
            max_depth: Some(2),
            ..Overrides::default()
        };
        let desc = format::load_built_in(&[]).unwrap();
        let job = format::compile(&desc, &overrides).unwrap().job;
        let work = Work {
            stop: Stop::Spp(SPP),
            shard: None,
        };
        let go = |_: &_, _: &_| ControlFlow::Continue(());
        let (film, stats) = job.render(work.stop, go).unwrap();
        let write = || {
            // As the program does: the scene's files are read once, the rest is done each time.
            let identity = Identity::new(&job, work.stop, "hash");
            let image = job.to_be_saved(&identity, &work, &film, &stats, &Metadata::default());
            image.write(&file).unwrap();
        };
        let start = Instant::now();
        write();
        let took = start.elapsed().as_secs_f64();
        let share = took / (took + INTERVAL.max(TIMES * took));
        let [width, height] = resolution;
        println!(
            "{width}x{height}: {took:.3} s, {:.1} MB, {:.3} % of the time",
            std::fs::metadata(&file).unwrap().len() as f64 * 1e-6,
            share * 100.0
        );
        let name = format!("{width}x{height}");
        group.bench_function(BenchmarkId::from_parameter(name), |b| b.iter(write));
    }
    let _ = std::fs::remove_file(&file);
    group.finish();
    criterion.final_summary();
}

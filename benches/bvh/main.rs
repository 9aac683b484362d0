//! Tracing single rays, one thread. With the feature `embree` the same rays also go through Embree 3,
//! default and robust mode, turn by turn in one run: the ratios are what to look at.

mod scenes;

#[cfg(feature = "embree")]
mod embree;

use criterion::{Criterion, Throughput};
use luxel::geom::Ray;
use luxel::geom::accel::Accel;
use std::hint::black_box;
use std::time::{Duration, Instant};

fn nearest(accel: &Accel, rays: &[Ray]) -> usize {
    rays.iter().filter(|r| accel.intersect(r).is_some()).count()
}

fn any(accel: &Accel, rays: &[Ray]) -> usize {
    rays.iter().filter(|r| accel.occluded(r)).count()
}

fn main() {
    let mut c = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(600))
        .configure_from_args();
    for (scene, mesh) in scenes::all() {
        let start = Instant::now();
        let accel = mesh.accel();
        let seconds = start.elapsed().as_secs_f64();
        let n = mesh.indices.len();
        let (nodes, packs, children, triangles) = accel.wide().stats();
        println!(
            "{scene}: {n} triangles, built in {seconds:.3} s, {:.1} bytes each, depth {}, \
             {nodes} nodes of {children:.2}, {packs} packs of {triangles:.2}",
            accel.bytes() as f64 / n as f64,
            accel.depth(),
        );
        let sets = scenes::rays(&mesh, &accel);
        #[cfg(feature = "embree")]
        compare(scene, &mesh, &accel, &sets);
        if cfg!(feature = "embree") {
            continue;
        }
        let mut group = c.benchmark_group(scene);
        for (name, rays) in &sets {
            group.throughput(Throughput::Elements(rays.len() as u64));
            let f = if *name == "shadow" { any } else { nearest };
            group.bench_function(*name, |b| b.iter(|| f(&accel, black_box(rays))));
        }
        group.finish();
    }
}

/// One line per set: million rays per second, ratio to Embree, ratio to its robust mode.
///
/// Each tracer goes through all rays in turn, seven times; the time of each chunk of rays is the least
/// of the seven, so that other work on the machine does not show.
#[cfg(feature = "embree")]
fn compare(scene: &str, mesh: &scenes::Mesh, accel: &Accel, sets: &[(&str, Vec<Ray>)]) {
    const CHUNK: usize = 2000;
    let fast = embree::Embree::build(mesh, false);
    let robust = embree::Embree::build(mesh, true);
    for (name, rays) in sets {
        let shadow = *name == "shadow";
        let through = |e: &embree::Embree, rays: &[Ray]| {
            let hit = |r: &&Ray| {
                if shadow {
                    e.occluded(r)
                } else {
                    e.intersect(r).is_some()
                }
            };
            rays.iter().filter(hit).count()
        };
        let ours = |rays: &[Ray]| {
            if shadow {
                any(accel, rays)
            } else {
                nearest(accel, rays)
            }
        };
        type Run<'a> = &'a dyn Fn(&[Ray]) -> usize;
        let runs: [Run<'_>; 3] = [&ours, &|r| through(&fast, r), &|r| through(&robust, r)];
        let mut best = [const { Vec::new() }; 3];
        let mut hits = [0; 3];
        for round in 0..7 {
            for (i, run) in runs.iter().enumerate() {
                best[i].resize(rays.len().div_ceil(CHUNK), f64::INFINITY);
                for (chunk, best) in rays.chunks(CHUNK).zip(&mut best[i]) {
                    let start = Instant::now();
                    let met = black_box(run(chunk));
                    *best = best.min(start.elapsed().as_secs_f64());
                    hits[i] += if round == 0 { met } else { 0 };
                }
            }
        }
        let seconds = best.map(|chunks| chunks.iter().sum::<f64>());
        let [own, default, robust] = seconds.map(|s| rays.len() as f64 / s * 1e-6);
        println!(
            "{scene:<14}{name:<20}{own:>7.2} M/s  {:>5.2} x default  {:>5.2} x robust   hits {hits:?}",
            own / default,
            own / robust,
        );
    }
}

//! Photons: how fast they are shot, stored and found again. The hash grid against the kd-tree, with photons on
//! the walls of a room, on a ball and in a bright spot, sought where they are.

use std::hint::black_box;
use std::num::NonZeroUsize;
use std::path::Path;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput};
use luxel::format::{self, Overrides};
use luxel::light::Aim;
use luxel::math::{PI, Vec3};
use luxel::sampler::{Sampler, SamplerKind};
use luxel::transport::light_walk::LightWalk;
use luxel::transport::mis::Techniques;
use luxel::transport::photons::{NearestMap, PhotonMap, Shoot};
use luxel::transport::{Ledger, Setting};
use rayon::prelude::*;

/// As many bytes as a photon of vertex connection and merging.
type Photon = [f32; 13];

/// 60 % on the walls of a unit box, 30 % on a sphere, 10 % in a spot on the floor.
fn photon(i: u64, seed: u64) -> Vec3 {
    let numbers = Sampler::new(SamplerKind::Independent, seed, 0, i, 1);
    let ([u, v, kind, side], [a, b, ..]) = (numbers.get4(0), numbers.get4(1));
    match kind {
        k if k < 0.6 => {
            let wall = (6.0 * side) as usize;
            let mut p = [u, v, (wall / 3) as f32];
            p.rotate_right(wall % 3);
            Vec3::from_array(p)
        }
        k if k < 0.9 => {
            let (z, phi) = (1.0 - 2.0 * u, 2.0 * PI * v);
            let r = (1.0 - z * z).sqrt();
            Vec3::splat(0.4) + 0.25 * Vec3::new(r * phi.cos(), r * phi.sin(), z)
        }
        _ => {
            let (r, phi) = (0.05 * (-2.0 * (1.0 - a).ln()).sqrt(), 2.0 * PI * b);
            Vec3::new(0.7 + r * phi.cos(), 0.0, 0.6 + r * phi.sin())
        }
    }
}

fn photons(n: u64) -> Vec<(Vec3, Photon)> {
    (0..n).map(|i| (photon(i, 1), [i as f32; 13])).collect()
}

const QUERIES: u64 = 20_000;

/// Queries in the order of a picture: neighbours follow each other.
fn queries() -> Vec<Vec3> {
    let mut queries: Vec<Vec3> = (0..QUERIES).map(|i| photon(i, 2)).collect();
    let key = |p: &Vec3| (*p * 16.0).as_ivec3().to_array();
    queries.sort_by_key(key);
    queries
}

/// The radius with which the queries find `wanted` photons on average.
fn radius_for(photons: &[(Vec3, Photon)], queries: &[Vec3], wanted: f64) -> f32 {
    let map = NearestMap::new(photons.to_vec());
    let (mut low, mut high) = (1e-5f32, 0.5f32);
    for _ in 0..12 {
        let radius = (low * high).sqrt();
        let mut found = 0u64;
        for p in queries.iter().step_by(20) {
            map.within(*p, radius, |_, _| found += 1);
        }
        match found as f64 > wanted * queries.len() as f64 / 20.0 {
            true => high = radius,
            false => low = radius,
        }
    }
    low
}

/// What a gathering does with what it finds.
fn sum_of(query: impl Fn(Vec3, &mut dyn FnMut(&Photon, f32)) + Sync, queries: &[Vec3]) -> f32 {
    let one = |p: &Vec3| {
        let mut sum = 0.0;
        query(*p, &mut |photon, d2| sum += photon[0] * photon[7] * d2);
        sum
    };
    queries.par_iter().map(one).sum()
}

fn pools() -> Vec<(usize, rayon::ThreadPool)> {
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build();
    [1, 2].into_iter().map(|n| (n, pool(n).unwrap())).collect()
}

fn bench_maps(criterion: &mut Criterion) {
    let queries = queries();
    for n in [100_000u64, 1_000_000] {
        let photons = photons(n);
        let mut group = criterion.benchmark_group(format!("build {n:e}"));
        group.throughput(Throughput::Elements(n));
        for (threads, pool) in pools() {
            let id = |name: &str| BenchmarkId::new(name, format!("{threads} threads"));
            group.bench_function(id("grid"), |b| {
                b.iter(|| pool.install(|| PhotonMap::new(photons.clone(), 0.005)));
            });
            group.bench_function(id("kd-tree"), |b| {
                b.iter(|| pool.install(|| NearestMap::new(photons.clone())));
            });
        }
        group.finish();
        let tree = NearestMap::new(photons.clone());
        for wanted in [20, 70, 350] {
            let radius = radius_for(&photons, &queries, f64::from(wanted));
            let grid = PhotonMap::new(photons.clone(), radius);
            let mut group = criterion.benchmark_group(format!("query {n:e}, {wanted} found"));
            group.throughput(Throughput::Elements(QUERIES));
            for (threads, pool) in pools() {
                let id = |name: &str| BenchmarkId::new(name, format!("{threads} threads"));
                let mut run = |name: &str, query: &(dyn Fn() -> f32 + Sync)| {
                    group.bench_function(id(name), |b| {
                        b.iter(|| pool.install(|| black_box(query())));
                    });
                };
                run("grid", &|| {
                    sum_of(|p, visit| grid.within(p, visit), &queries)
                });
                run("kd-tree", &|| {
                    sum_of(|p, visit| tree.within(p, radius, visit), &queries)
                });
                let k = NonZeroUsize::new(wanted as usize).unwrap();
                run("kd-tree, nearest", &|| {
                    let nearest = |p, visit: &mut dyn FnMut(&Photon, f32)| {
                        tree.nearest(p, k, 2.0 * radius, visit);
                    };
                    sum_of(nearest, &queries)
                });
            }
            group.finish();
        }
    }
}

fn bench_shooting(criterion: &mut Criterion) {
    const COUNT: u64 = 200_000;
    let xml = include_str!("../scenes/cornell-balls.xml");
    let desc = format::load_str("bench.xml", xml, Path::new("."), &[]).unwrap();
    let job = format::compile(&desc, &Overrides::default()).unwrap().job;
    let aim = Aim::default();
    let mut group = criterion.benchmark_group("shoot");
    group.throughput(Throughput::Elements(COUNT));
    for (name, specular_only) in [("all light", false), ("caustics", true)] {
        let shoot = Shoot {
            setting: Setting {
                scene: &job.scene,
                camera: &job.camera,
                film: &job.film,
                sampler: SamplerKind::Sobol,
                seed: 0,
                replicates: 1,
                planned: None,
            },
            walk: LightWalk {
                scene: &job.scene,
                aim: &aim,
                techniques: Techniques::default(),
                max_edges: 1000,
                specular_only,
            },
            count: COUNT,
            iteration: 0,
            time: 0.0,
        };
        for (threads, pool) in pools() {
            group.bench_function(BenchmarkId::new(name, format!("{threads} threads")), |b| {
                b.iter(|| {
                    let mut ledger = Ledger::default();
                    pool.install(|| {
                        shoot.trace(&mut ledger, |v| {
                            (v.scattered > 0).then_some([v.power.r; 13])
                        })
                    })
                });
            });
        }
    }
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .measurement_time(Duration::from_secs(2))
        .warm_up_time(Duration::from_millis(500))
        .configure_from_args();
    bench_shooting(&mut criterion);
    bench_maps(&mut criterion);
    criterion.final_summary();
}

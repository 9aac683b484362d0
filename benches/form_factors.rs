//! Form factors: how many a second, by each method, in a box of about 500 patches with two blocks.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use criterion::{Criterion, Throughput};
use luxel::format::{self, Overrides};
use luxel::radiosity::FormFactorMethod::{Analytic, Hemicube, MonteCarlo};
use luxel::radiosity::{FormFactors, PatchMesh, Surfaces};
use luxel::scene::Scene;

const BOX: &str = r#"<scene version="3.0.0"><sensor type="perspective"/><emitter type="constant"/>
    <shape type="cube"><boolean name="flip_normals" value="true"/><bsdf type="diffuse"/></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.6" z="0.3"/><rotate y="1" angle="17"/>
    <translate x="-0.35" y="-0.4" z="-0.3"/></transform><bsdf type="diffuse"/></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.3" z="0.3"/><rotate y="1" angle="-16"/>
    <translate x="0.35" y="-0.7" z="0.35"/></transform><bsdf type="diffuse"/></shape></scene>"#;

fn scene() -> Scene {
    let desc = format::load_str("bench.xml", BOX, Path::new("."), &[]).unwrap();
    format::compile(&desc, &Overrides::default())
        .unwrap()
        .job
        .scene
}

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(10)
        .measurement_time(Duration::from_secs(3))
        .warm_up_time(Duration::from_millis(500))
        .configure_from_args();
    let scene = scene();
    let surfaces = Arc::new(Surfaces::new(&scene, 1e-3));
    let mesh = PatchMesh::uniform(&scene, surfaces, 0.26);
    let n = mesh.len() as u64;
    let mut group = criterion.benchmark_group(format!("matrix of {n} patches"));
    group.throughput(Throughput::Elements(n * n));
    for (name, method) in [
        ("analytic 16", Analytic { samples: 16 }),
        ("montecarlo 16", MonteCarlo { samples: 16 }),
        ("hemicube 64", Hemicube { resolution: 64 }),
        ("hemicube 256", Hemicube { resolution: 256 }),
    ] {
        group.bench_function(name, |b| {
            b.iter(|| FormFactors::new(&scene, &mesh, method, 0).matrix());
        });
    }
    group.finish();
    criterion.final_summary();
}

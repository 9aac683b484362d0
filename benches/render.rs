//! Whole pictures, small: samples per second of a plain scene, and of the same scene with one thing
//! changed, so that the cost of what a scene does not use can be seen to be none.

use std::path::Path;
use std::time::Duration;

use criterion::{Criterion, Throughput};
use luxel::format::{self, Compiled, Overrides};
use luxel::render::Stop;

const SIDE: u32 = 64;
const SPP: u64 = 4;

fn compile(xml: &str) -> Compiled {
    let overrides = Overrides {
        resolution: Some([SIDE; 2]),
        ..Overrides::default()
    };
    let desc = format::load_str("bench.xml", xml, Path::new("."), &[]).unwrap();
    format::compile(&desc, &overrides).unwrap()
}

fn main() {
    let balls = include_str!("../scenes/cornell-balls.xml");
    let boxed = |shape: &str| {
        let start = balls
            .find(r#"<shape type="sphere" id="glass-ball">"#)
            .unwrap();
        format!("{}{shape}</scene>", &balls[..start])
    };
    let cube = |material: &str| {
        boxed(&format!(
            r#"<shape type="cube"><transform name="to_world"><scale value="0.15"/><translate y="0.15"/></transform>
            {material}</shape>"#
        ))
    };
    let plain = cube(r#"<ref id="white"/>"#);
    const PLACE: &str = r#"<scale value="0.15"/><translate y="0.15"/>"#;
    let instance = boxed(&format!(
        r#"<shape type="shapegroup" id="group"><shape type="cube"><ref id="white"/></shape></shape>
        <shape type="instance"><ref id="group"/><transform name="to_world">{PLACE}</transform></shape>"#
    ));
    let moving = |way: &str| {
        let moving = boxed(&format!(
            r#"<shape type="cube"><animation name="to_world"><transform time="0">{PLACE}</transform>
            <transform time="1">{PLACE}{way}</transform></animation><ref id="white"/></shape>"#
        ));
        let shutter = r#"<sensor type="perspective"><float name="shutter_close" value="1"/>"#;
        moving.replace(r#"<sensor type="perspective">"#, shutter)
    };
    let scenes = [
        ("plain", plain.clone()),
        (
            "sobol",
            plain.replace(r#"sampler type="independent""#, r#"sampler type="sobol""#),
        ),
        ("glass cube", cube(r#"<ref id="glass"/>"#)),
        ("gold cube", cube(r#"<ref id="gold"/>"#)),
        (
            "anisotropic cube",
            cube(
                r#"<bsdf type="roughconductor"><float name="alpha_u" value="0.05"/>
                <float name="alpha_v" value="0.3"/></bsdf>"#,
            ),
        ),
        (
            "checkered cube",
            cube(
                r#"<bsdf type="diffuse"><texture type="checkerboard" name="reflectance"/></bsdf>"#,
            ),
        ),
        (
            "ball in place of the cube",
            boxed(
                r#"<shape type="sphere"><point name="center" x="0" y="0.15" z="0"/><float name="radius" value="0.15"/>
                <ref id="white"/></shape>"#,
            ),
        ),
        (
            "masked cube",
            cube(
                r#"<bsdf type="mask"><float name="opacity" value="0.5"/><ref id="white"/></bsdf>"#,
            ),
        ),
        (
            "cube with a normal map",
            cube(
                r#"<bsdf type="normalmap"><texture type="checkerboard" name="normalmap">
                <rgb name="color0" value="0.5, 0.5, 1"/><rgb name="color1" value="0.6, 0.5, 0.9"/></texture>
                <ref id="white"/></bsdf>"#,
            ),
        ),
        (
            "through a lens",
            plain.replace(
                r#"sensor type="perspective">"#,
                r#"sensor type="thinlens"><float name="aperture_radius" value="0.01"/>
                <float name="focus_distance" value="3"/>"#,
            ),
        ),
        ("instance in place of the cube", instance),
        ("cube that turns", moving(r#"<rotate y="1" angle="40"/>"#)),
        ("cube that flies", moving(r#"<translate x="0.5" y="0.4"/>"#)),
        (
            "cube that flies fast",
            moving(r#"<translate x="30" y="20"/>"#),
        ),
        ("cube that does not move", moving("")),
        ("balls of glass and gold", balls.to_string()),
    ];
    let mut criterion = Criterion::default()
        .sample_size(20)
        .measurement_time(Duration::from_secs(3))
        .warm_up_time(Duration::from_secs(1))
        .configure_from_args();
    let mut group = criterion.benchmark_group("render");
    group.throughput(Throughput::Elements(u64::from(SIDE * SIDE) * SPP));
    for (name, xml) in scenes {
        let compiled = compile(&xml);
        group.bench_function(name, |b| {
            b.iter(|| {
                let mut film = compiled.job.new_film(Stop::Spp(SPP));
                compiled.job.add_samples(&mut film, SPP)
            });
        });
    }
    group.finish();
    criterion.final_summary();
}

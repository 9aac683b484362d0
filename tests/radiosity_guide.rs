//! Walks that radiosity guides: the means of pictures are those of plain path tracing, on all that could part them,
//! and the same for any number of threads.

#[path = "common/render.rs"]
mod render;

use luxel::film::Film;
use luxel::format::{Compiled, Overrides};
use luxel::render::{Stats, Stop};
use luxel::transport::{CacheSpec, CachedSpec, Indirect, IntegratorSpec, PathSpec};
use render::{camera, compile_with, mean_of, scene};
use std::ops::ControlFlow;

/// A room, open to the camera, with a block that throws a shadow.
fn room(content: &str) -> String {
    let wall = |place: &str, rgb: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/>{place}</transform>
            <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{rgb}"/></bsdf></bsdf></shape>"#
        )
    };
    let content = format!(
        r#"{}{}{}{}
        <shape type="cube"><transform name="to_world"><scale value="0.5"/><rotate y="1" angle="20"/>
            <translate x="0.7" y="-1.5" z="-0.4"/></transform>
            <bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf></shape>
        {content}"#,
        wall(
            r#"<rotate x="1" angle="-90"/><translate y="-2"/>"#,
            "0.7, 0.7, 0.7"
        ),
        wall(r#"<translate z="-2"/>"#, "0.7, 0.7, 0.7"),
        wall(
            r#"<rotate y="1" angle="90"/><translate x="-2"/>"#,
            "0.6, 0.1, 0.1"
        ),
        wall(
            r#"<rotate y="1" angle="-90"/><translate x="2"/>"#,
            "0.8, 0.5, 0.1"
        ),
    );
    scene(-1, &camera(16, 55.0), &content)
}

/// Shines upwards: all that the camera sees but the lamp's side is lit by other surfaces. It reflects too.
const LAMP: &str = r#"<shape type="rectangle"><transform name="to_world">
    <scale value="0.4"/><rotate x="1" angle="-90"/><translate x="-0.6" y="-0.5"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></bsdf>
    <emitter type="area"><rgb name="radiance" value="20"/></emitter></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="2"/>
    <rotate x="1" angle="90"/><translate y="2"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf></shape>"#;

fn compiled(xml: &str, indirect: Indirect, seed: u64) -> Compiled {
    let overrides = Overrides {
        seed: Some(seed),
        ..Overrides::default()
    };
    let mut compiled = compile_with(xml, &overrides);
    let path = PathSpec::default();
    compiled.job.integrator = match indirect {
        Indirect::None => IntegratorSpec::Path(path),
        other => IntegratorSpec::Cached(CachedSpec {
            path,
            cache: CacheSpec {
                always: true,
                ..CacheSpec::of(other)
            },
        }),
    };
    compiled
}

fn mean_and_error(xml: &str, indirect: Indirect, seed: u64, spp: u64) -> (f64, f64) {
    let compiled = compiled(xml, indirect, seed);
    let (film, stats) = render::render(&compiled, spp);
    let solved = stats.solution.is_some();
    assert_eq!(solved, indirect != Indirect::None, "nothing was solved");
    let variances = film.standard_error().into_iter().map(|s| s[0] * s[0]);
    let picture = film.mean();
    let stderr = variances.sum::<f64>().sqrt() / picture.len() as f64;
    (mean_of(&picture), stderr)
}

/// Means may differ by 4.5 standard errors (once in 150,000), which are small enough that 1 % shows.
fn agrees(content: &str, spp: u64) {
    let xml = room(content);
    let (a, da) = mean_and_error(&xml, Indirect::None, 1, spp);
    let (b, db) = mean_and_error(&xml, Indirect::Guide, 2, spp);
    let noise = da.hypot(db);
    assert!(noise < 2.2e-3 * a, "{noise} says too little of {a}");
    assert!((a - b).abs() < 4.5 * noise, "{a} {b} +- {noise}");
}

#[test]
fn diffuse_rooms_keep_their_mean() {
    agrees(LAMP, 2048);
}

#[test]
fn curved_and_glossy_bodies_keep_it() {
    let bodies = r#"<shape type="sphere"><point name="center" x="-0.9" y="-1.4" z="-0.5"/><float name="radius" value="0.5"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.8"/></bsdf></shape>
        <shape type="cylinder"><point name="p0" x="1.5" y="-2" z="-1.4"/><point name="p1" x="1.5" y="1" z="-1.4"/>
        <float name="radius" value="0.3"/><bsdf type="twosided"><bsdf type="roughconductor">
        <float name="alpha" value="0.3"/></bsdf></bsdf></shape>"#;
    agrees(&format!("{LAMP}{bodies}"), 2048);
}

#[test]
fn a_window_and_a_mask_keep_it() {
    let bodies = r#"<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
        <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/><translate y="0.5"/></transform>
        <bsdf type="mask"><float name="opacity" value="0.5"/><bsdf type="twosided">
        <bsdf type="diffuse"><rgb name="reflectance" value="0.8"/></bsdf></bsdf></bsdf></shape>"#;
    agrees(bodies, 1024);
}

#[test]
fn threads_make_no_difference() {
    let xml = room(LAMP);
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let work = || {
            render::render(&compiled(&xml, Indirect::Guide, 3), 4)
                .0
                .mean()
        };
        pool.unwrap().install(work)
    };
    assert_eq!(by(1), by(4));
}

/// By default, a few walks decide.
fn rendered(xml: &str, threads: usize) -> (Vec<[f64; 3]>, bool) {
    let mut compiled = compiled(xml, Indirect::Guide, 5);
    if let IntegratorSpec::Cached(spec) = &mut compiled.job.integrator {
        spec.cache.always = false;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    // Samples that may be followed by any number.
    let mut film = compiled.job.new_film(Stop::Spp(4));
    let stats = pool
        .unwrap()
        .install(|| compiled.job.add_samples(&mut film, 4));
    (film.mean(), stats.unwrap().solution.is_some())
}

#[test]
fn nothing_is_solved_for_direct_light() {
    let plates = |albedo: f32| {
        let content = format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-2"/></transform>
            <bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf></shape>
            <shape type="rectangle"><transform name="to_world"><scale value="2"/><rotate x="1" angle="-90"/>
            <translate y="-2"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf></shape>
            <emitter type="point"><point name="position" x="0" y="1" z="1"/>
            <rgb name="intensity" value="10"/></emitter>"#
        );
        scene(-1, &camera(16, 55.0), &content)
    };
    assert!(!rendered(&plates(0.02), 2).1);
    // Nearly all that the camera sees is lit by other surfaces. Pixels are so small that few have edges.
    let lamp = room(LAMP).replace("\"16\"", "\"48\"");
    let (picture, solved) = rendered(&lamp, 1);
    assert!(solved);
    assert_eq!(picture, rendered(&lamp, 4).0);
}

#[test]
fn nothing_is_solved_for_a_short_picture() {
    let lamp = room(LAMP).replace("\"16\"", "\"48\"");
    let solved = |spp: u64| {
        let mut compiled = compiled(&lamp, Indirect::Guide, 5);
        if let IntegratorSpec::Cached(spec) = &mut compiled.job.integrator {
            spec.cache.always = false;
        }
        let on_pass = |film: &Film, _: &Stats| match film.spp() {
            0 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        };
        let (_, stats) = compiled.job.render(Stop::Spp(spp), on_pass).unwrap();
        stats.solution.is_some()
    };
    // What is solved takes as long as some 6,000 samples of such small pictures.
    assert!(!solved(500));
    assert!(solved(100_000));
}

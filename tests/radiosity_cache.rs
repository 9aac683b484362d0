//! Radiosity as the camera sees it, and as the path tracer's cache: against closed forms where the solution is known,
//! and against path tracing where it is solved for.

#[path = "common/render.rs"]
mod render;

use std::sync::Arc;

use luxel::format::{Compiled, Overrides};
use luxel::radiosity::{
    PatchMesh, Report, Rgb64, Solution, SolveError, SolveSpec, Solver, Surfaces,
};
use luxel::render::{RenderError, Stats, Stop};
use luxel::scene::Scene;
use luxel::transport::radiosity::Show;
use luxel::transport::{
    CacheSpec, CachedSpec, CombinedSpec, Indirect, IntegratorSpec, PathSpec, RadiositySpec, Solved,
};
use render::{assert_explained, camera, compile, mean_of, scene};
use std::f64::consts::PI;
use std::ops::ControlFlow;

/// A closed box around the camera whose walls shine with radiance 1, of reflectance 0.5.
fn furnace(material: &str) -> String {
    let shape = format!(
        r#"<shape type="cube"><transform name="to_world"><scale value="5"/></transform>
        <boolean name="flip_normals" value="true"/>{material}
        <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#
    );
    scene(-1, &camera(8, 80.0), &shape)
}

const HALF: &str = r#"<bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>"#;

/// A room of diffuse walls, open to the camera, with a block and what is given.
fn room(content: &str) -> String {
    let wall = |place: &str, rgb: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/>{place}</transform>
            <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{rgb}"/></bsdf></bsdf></shape>"#
        )
    };
    let content = format!(
        r#"{}{}{}{}{}
        <shape type="cube"><transform name="to_world"><scale value="0.5"/><rotate y="1" angle="20"/>
            <translate x="0.6" y="-1.5" z="-0.4"/></transform>
            <bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf></shape>
        {content}"#,
        wall(r#"<rotate x="1" angle="-90"/><translate y="-2"/>"#, "0.7"),
        wall(r#"<rotate x="1" angle="90"/><translate y="2"/>"#, "0.7"),
        wall(r#"<translate z="-2"/>"#, "0.7"),
        wall(
            r#"<rotate y="1" angle="90"/><translate x="-2"/>"#,
            "0.6, 0.1, 0.1"
        ),
        wall(
            r#"<rotate y="1" angle="-90"/><translate x="2"/>"#,
            "0.1, 0.5, 0.1"
        ),
    );
    scene(-1, &camera(12, 60.0), &content)
}

const LAMP: &str = r#"<shape type="rectangle"><transform name="to_world">
    <scale value="0.6"/><rotate x="1" angle="90"/><translate y="1.9"/></transform>
    <emitter type="area"><rgb name="radiance" value="8"/></emitter></shape>"#;
const MIRROR: &str = r#"<shape type="sphere"><point name="center" x="-0.8" y="-1.2" z="0"/>
    <float name="radius" value="0.7"/><bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>"#;

/// A solution in which all patches receive `irradiance`, and `direct` of it from emitters.
fn known(scene: &Scene, size: f64, irradiance: f64, direct: f64) -> Solved {
    let mesh = PatchMesh::uniform(scene, Arc::new(Surfaces::new(scene, 0.02)), size);
    let n = mesh.len();
    let patches = mesh.patches.iter();
    Solved(Arc::new(Solution {
        radiosity: patches
            .map(|p| p.emission + p.albedo * irradiance)
            .collect(),
        irradiance: vec![Rgb64::splat(irradiance); n],
        direct: vec![Rgb64::splat(direct); n],
        hierarchy: None,
        report: Report::default(),
        mesh,
    }))
}

fn shown(show: Show, given: Option<Solved>) -> IntegratorSpec {
    IntegratorSpec::Radiosity(RadiositySpec {
        show,
        given,
        ..RadiositySpec::default()
    })
}

fn gather(given: Option<Solved>) -> CacheSpec {
    CacheSpec {
        indirect: Indirect::Gather,
        given,
        ..CacheSpec::default()
    }
}

fn cached(cache: CacheSpec) -> IntegratorSpec {
    IntegratorSpec::Cached(CachedSpec {
        cache,
        ..CachedSpec::default()
    })
}

fn combined(cache: CacheSpec) -> IntegratorSpec {
    IntegratorSpec::Combined(CombinedSpec {
        cache,
        ..CombinedSpec::default()
    })
}

/// Picture, mean of channel 0 and its standard error, and statistics.
fn look(
    compiled: &mut Compiled,
    integrator: IntegratorSpec,
    spp: u64,
) -> (Vec<[f64; 3]>, (f64, f64), Stats) {
    compiled.job.integrator = integrator;
    let (film, stats) = render::render(compiled, spp);
    let variances = film.standard_error().into_iter().map(|s| s[0] * s[0]);
    let picture = film.mean();
    let stderr = variances.sum::<f64>().sqrt() / picture.len() as f64;
    let mean = mean_of(&picture);
    (picture, (mean, stderr), stats)
}

#[test]
fn a_furnace_is_the_same_however_its_radiosity_is_used() {
    let mut compiled = compile(&furnace(HALF));
    // L = Le / (1 - albedo), everywhere and from everywhere.
    let given = Some(known(&compiled.job.scene, 1.0, 2.0 * PI, PI));
    for show in [Show::Flat, Show::Gouraud] {
        let (flat, ..) = look(&mut compiled, shown(show, given.clone()), 4);
        assert!(
            flat.iter().flatten().all(|v| (v - 2.0).abs() < 1e-5),
            "{flat:?}"
        );
    }
    for (integrator, reads) in [
        (shown(Show::Gather, given.clone()), false),
        (cached(gather(given.clone())), true),
        (combined(gather(given)), true),
    ] {
        let name = format!("{integrator:?}");
        let (_, mean, stats) = look(&mut compiled, integrator, 256);
        assert_explained(mean, 2.0, &name);
        assert_eq!(
            reads,
            stats.bias.reads > 8 * 8 * 256 / 2,
            "{:?}",
            stats.bias
        );
    }
    for (integrator, tolerance) in [
        (shown(Show::Flat, None), 0.01),
        (cached(gather(None)), 0.003),
    ] {
        let (_, (mean, stderr), _) = look(&mut compiled, integrator, 256);
        assert!(
            (mean - 2.0).abs() < 2.0 * tolerance + 4.5 * stderr,
            "{mean} +- {stderr}"
        );
    }
}

#[test]
fn a_clear_coat_is_walked_by_and_its_base_is_shown() {
    for (material, spp) in [("plastic", 512), ("roughplastic", 512)] {
        let xml = furnace(&format!(
            r#"<bsdf type="{material}"><rgb name="diffuse_reflectance" value="0.3"/></bsdf>"#
        ));
        let mut compiled = compile(&xml);
        // The furnace of a surface whose reflectance depends on the angle has no closed form: radiance that is the
        // same everywhere is put in, and the same light must come out of any use of it.
        let given = Some(known(&compiled.job.scene, 1.0, 1.5 * PI, PI));
        let (_, flat, _) = look(&mut compiled, shown(Show::Flat, given), spp);
        let (_, path, _) = look(
            &mut compiled,
            IntegratorSpec::Path(PathSpec::default()),
            spp,
        );
        // Reflectance of the whole is 0.3 to 0.4: 1.5 is near.
        assert!(
            (flat.0 / path.0 - 1.0).abs() < 0.05,
            "{material} {flat:?} {path:?}"
        );
    }
}

#[test]
fn a_final_gather_agrees_with_path_tracing() {
    let mut compiled = compile(&room(LAMP));
    let spp = 512;
    let (path, mean, _) = look(
        &mut compiled,
        IntegratorSpec::Path(PathSpec::default()),
        spp,
    );
    for integrator in [cached(gather(None)), shown(Show::Gather, None)] {
        let (picture, found, _) = look(&mut compiled, integrator, spp);
        let noise = 4.5 * mean.1.hypot(found.1);
        assert!(
            (found.0 - mean.0).abs() < 0.01 * mean.0 + noise,
            "{found:?} {mean:?}"
        );
        // Whole walls too.
        for rows in [0..4, 4..8, 8..12] {
            let sum = |p: &[[f64; 3]]| {
                p[rows.start * 12..rows.end * 12]
                    .iter()
                    .map(|p| p[1])
                    .sum::<f64>()
            };
            let ratio = sum(&picture) / sum(&path);
            assert!((ratio - 1.0).abs() < 0.03, "{rows:?}: {ratio}");
        }
    }
}

/// Links alone would not be made: no surface has light by them.
#[test]
fn a_room_lit_through_a_pane_alone_has_its_light() {
    let wall = |place: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world">{place}</transform>
            <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.8"/></bsdf></bsdf></shape>"#
        )
    };
    // Low, with a window as high as a wall.
    let walls = [
        r#"<rotate x="1" angle="-90"/><scale x="2" y="1" z="2"/><translate y="-1"/>"#,
        r#"<rotate x="1" angle="90"/><scale x="2" y="1" z="2"/><translate y="1"/>"#,
        r#"<rotate y="1" angle="90"/><scale x="1" y="1" z="2"/><translate x="-2"/>"#,
        r#"<rotate y="1" angle="-90"/><scale x="1" y="1" z="2"/><translate x="2"/>"#,
        r#"<scale x="2" y="1" z="1"/><translate z="-2"/>"#,
        r#"<scale x="0.8" y="1" z="1"/><translate x="1.2" z="2"/>"#,
        r#"<scale x="0.8" y="1" z="1"/><translate x="-1.2" z="2"/>"#,
    ];
    let pane = r#"<shape type="rectangle"><transform name="to_world"><scale x="0.4" y="1" z="1"/>
        <translate z="2"/></transform><bsdf type="thindielectric"/></shape>
        <emitter type="constant"><rgb name="radiance" value="1"/></emitter>"#;
    let camera = camera(12, 60.0).replace(
        r#"origin="0, 0, 4" target="0, 0, 0""#,
        r#"origin="1.8, 0.5, 1.8" target="0, 0, 0""#,
    );
    let mut compiled = compile(&scene(-1, &camera, &(walls.map(wall).concat() + pane)));
    let spp = 4096;
    let path = IntegratorSpec::Path(PathSpec::default());
    let (_, mean, _) = look(&mut compiled, path, spp);
    let (_, found, _) = look(&mut compiled, cached(gather(None)), spp);
    let noise = 4.5 * mean.1.hypot(found.1);
    assert!(
        (found.0 - mean.0).abs() < 0.01 * mean.0 + noise,
        "{found:?} {mean:?}"
    );
    assert!(noise < 0.02 * mean.0, "{noise} says too little");
}

#[test]
fn the_bias_that_is_reported_is_the_one_there_is() {
    for (content, integrator) in [
        (LAMP.to_string(), cached as fn(CacheSpec) -> IntegratorSpec),
        (LAMP.to_string() + MIRROR, cached),
        (LAMP.to_string() + MIRROR, combined),
    ] {
        let mut compiled = compile(&room(&content));
        let spp = 1024;
        // Too much light by far, so that there is something to see.
        let given = Some(known(&compiled.job.scene, 0.5, 3.0, 0.5));
        let luminance = |p: &[[f64; 3]]| {
            let sum = |c: usize| p.iter().map(|p| p[c]).sum::<f64>() / p.len() as f64;
            0.2126 * sum(0) + 0.7152 * sum(1) + 0.0722 * sum(2)
        };
        let (path, (mean, a), _) = look(&mut compiled, integrator(CacheSpec::default()), spp);
        let (read, (_, b), stats) = look(&mut compiled, integrator(gather(given)), spp);
        let excess = luminance(&read) - luminance(&path);
        let [bias, stderr] = stats.bias.mean(12 * 12 * spp).unwrap();
        // Noise of the three, that of the pictures by their first channel.
        let noise = stderr.hypot(a).hypot(b);
        assert!(
            excess > 0.1 * mean && (bias - excess).abs() < 4.5 * noise,
            "{bias} +- {stderr}, {excess} +- {}",
            a.hypot(b)
        );
        assert!(noise < 0.1 * excess, "{noise} says too little");
    }
}

#[test]
fn what_photons_bring_is_not_read_too() {
    // Half of the room's light comes by way of the mirror: to count that twice would show.
    let mirror = r#"<shape type="rectangle"><transform name="to_world"><scale value="1.9"/>
        <rotate x="1" angle="-90"/><translate y="-1.98"/></transform>
        <bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>"#;
    let mut compiled = compile(&room(&(LAMP.to_string() + mirror)));
    let (_, all, _) = look(&mut compiled, combined(CacheSpec::default()), 256);
    let (_, read, _) = look(
        &mut compiled,
        combined(CacheSpec::of(Indirect::Gather)),
        256,
    );
    let noise = 4.5 * all.1.hypot(read.1);
    assert!(
        read.0 < 1.005 * all.0 + noise && noise < 0.02 * all.0,
        "{read:?} {all:?}"
    );
}

#[test]
fn threads_do_not_change_the_picture() {
    for integrator in [
        cached(gather(None)),
        combined(gather(None)),
        shown(Show::Flat, None),
        shown(Show::Gouraud, None),
        shown(Show::Gather, None),
    ] {
        let mut integrator = integrator;
        integrator.solve().unwrap().walks = 1 << 14;
        let mut compiled = compile(&room(&(LAMP.to_string() + MIRROR)));
        let mut with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().unwrap();
            pool.install(|| look(&mut compiled, integrator.clone(), 4).0)
        };
        assert!(with(1) == with(4), "{integrator:?}");
    }
}

#[test]
fn odd_scenes_are_rendered_without_a_fault() {
    let moving = r#"<shape type="sphere"><float name="radius" value="0.6"/>
        <bsdf type="diffuse"/><animation name="to_world">
            <transform time="0"><translate x="-0.9"/></transform>
            <transform time="1"><translate x="0.9"/></transform></animation></shape>"#;
    let moving_lamp = format!(
        r#"{moving}<shape type="sphere"><float name="radius" value="0.2"/>
        <emitter type="area"><rgb name="radiance" value="8"/></emitter><animation name="to_world">
            <transform time="0"><translate y="1"/></transform>
            <transform time="1"><translate y="1.5"/></transform></animation></shape>"#
    );
    let mask = r#"<shape type="rectangle"><bsdf type="mask"><float name="opacity" value="0.4"/>
        <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf></shape>"#;
    let point = r#"<emitter type="point"><rgb name="intensity" value="4"/></emitter>"#;
    let sky = r#"<emitter type="constant"/>"#;
    let scenes = [
        room(""),
        room(point),
        room(sky),
        room(&(LAMP.to_string() + moving)),
        room(&moving_lamp),
        room(&(LAMP.to_string() + mask)),
        // Nothing that reflects diffusely.
        scene(-1, &camera(8, 60.0), &(MIRROR.to_string() + sky)),
        scene(-1, &camera(8, 60.0), LAMP),
        scene(-1, &camera(8, 60.0), ""),
    ];
    for xml in scenes {
        for integrator in [
            cached(gather(None)),
            combined(gather(None)),
            shown(Show::Flat, None),
            shown(Show::Gouraud, None),
            shown(Show::Gather, None),
        ] {
            let mut compiled = compile(&xml);
            for depth in [None, Some(0), Some(1), Some(2), Some(3), Some(4)] {
                let mut integrator = integrator.clone();
                *integrator.hide_emitters() = depth == Some(4);
                *integrator.max_depth().unwrap() = depth;
                let solve = integrator.solve().unwrap();
                (solve.error, solve.walks) = (1e-2, 1 << 12);
                look(&mut compiled, integrator, 1);
            }
        }
    }
}

#[test]
fn what_moves_is_lit_and_light_is_right_in_the_mean() {
    let xml = room(
        r#"<shape type="sphere"><float name="radius" value="0.6"/><bsdf type="diffuse"/>
        <animation name="to_world"><transform time="0"><translate x="-0.9"/></transform>
            <transform time="1"><translate x="0.9"/></transform></animation></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="0.6"/><rotate x="1" angle="90"/>
            <translate y="1.9"/></transform><emitter type="area"><rgb name="radiance" value="8"/></emitter></shape>"#,
    );
    let mut compiled = compile(&xml);
    let (_, path, _) = look(
        &mut compiled,
        IntegratorSpec::Path(PathSpec::default()),
        256,
    );
    let (_, read, _) = look(&mut compiled, cached(gather(None)), 256);
    // The ball reflects light that the cache does not know of.
    assert!((read.0 / path.0 - 1.0).abs() < 0.05, "{read:?} {path:?}");
}

#[test]
fn a_scene_without_use_for_it_is_not_solved_and_paths_are_as_before() {
    let flat = r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/></transform></shape>
        <emitter type="point"><point name="position" x="0" y="0" z="2"/></emitter>"#;
    let mut compiled = compile(&scene(-1, &camera(8, 60.0), flat));
    let (path, ..) = look(&mut compiled, IntegratorSpec::Path(PathSpec::default()), 4);
    let (read, _, stats) = look(&mut compiled, cached(gather(None)), 4);
    assert!(path == read && stats.solution.is_none());

    let mut short = cached(gather(None));
    *short.max_depth().unwrap() = Some(3);
    let mut compiled = compile(&room(LAMP));
    let (_, _, stats) = look(&mut compiled, short, 1);
    assert!(stats.solution.is_none() && stats.phases.radiosity < 0.1);
}

#[test]
fn what_cannot_be_solved_is_an_error_before_rendering() {
    let mut compiled = compile(&room(LAMP));
    let mut integrator = shown(Show::Flat, None);
    *integrator.solve().unwrap() = SolveSpec {
        patch_size: Some(1e-3),
        max_patches: 1000,
        solver: Solver::Hierarchical,
        ..SolveSpec::default()
    };
    compiled.job.integrator = integrator;
    let mut seen = 0;
    let rendered = compiled.job.render(Stop::Spp(1), |film, _| {
        seen += film.spp();
        ControlFlow::Continue(())
    });
    let Err(RenderError::Radiosity(SolveError::TooManyPatches { limit: 1000, .. })) = rendered
    else {
        panic!("{rendered:?}");
    };
    assert_eq!(seen, 0);
}

#[test]
fn the_scene_language_and_the_command_line_ask_for_it() {
    let with = |params: &str| {
        room(LAMP).replace(
            r#"<integer name="max_depth" value="-1"/>"#,
            &format!("<integer name=\"max_depth\" value=\"-1\"/>{params}"),
        )
    };
    let asked = compile(&with(
        r#"<string name="indirect" value="gather"/><float name="error" value="0.01"/>
        <float name="patch_size" value="0.3"/>"#,
    ));
    let IntegratorSpec::Cached(spec) = &asked.job.integrator else {
        panic!("{:?}", asked.job.integrator);
    };
    assert_eq!(spec.cache.indirect, Indirect::Gather);
    assert_eq!(
        (spec.cache.solve.error, spec.cache.solve.patch_size),
        (0.01, Some(0.3))
    );
    assert!(asked.job.integrator.biased());
    let entries = &asked.job.scene.plan().entries;
    assert!(entries.iter().any(|e| e.subject == "radiosity"));

    let overrides = |integrator: Option<&str>, indirect: Option<&str>| Overrides {
        integrator: integrator.map(str::to_string),
        indirect: indirect.map(str::to_string),
        ..Overrides::default()
    };
    let plain = render::compile_with(
        &with(r#"<string name="indirect" value="gather"/>"#),
        &overrides(None, Some("none")),
    );
    assert!(matches!(plain.job.integrator, IntegratorSpec::Path(_)));
    let both = render::compile_with(&room(LAMP), &overrides(Some("combined"), Some("gather")));
    let IntegratorSpec::Combined(spec) = &both.job.integrator else {
        panic!("{:?}", both.job.integrator);
    };
    assert_eq!(spec.cache.indirect, Indirect::Gather);
    let view = render::compile_with(&room(LAMP), &overrides(Some("radiosity"), None));
    assert_eq!(view.job.integrator.name(), "radiosity");
}

/// What the scene says of a solution holds whether it or the command line asks for one.
#[test]
fn settings_of_the_scene_meet_the_way_of_the_command_line() {
    let solved = |kind: &str, params: &str, indirect: &str| {
        let integrator = format!(
            r#"<integrator type="{kind}"><integer name="max_depth" value="-1"/>{params}</integrator>"#
        );
        let overrides = Overrides {
            indirect: Some(indirect.to_string()),
            ..Overrides::default()
        };
        let scene = room(LAMP);
        let (start, end) = (scene.find("<integrator"), scene.find("</integrator>"));
        let rest = &scene[end.unwrap() + "</integrator>".len()..];
        let scene = format!("{}{integrator}{rest}", &scene[..start.unwrap()]);
        let mut spec = render::compile_with(&scene, &overrides).job.integrator;
        let cache = spec.cache().unwrap();
        assert_eq!(cache.indirect.name(), indirect);
        spec.solve().cloned()
    };
    let walks = r#"<integer name="walks" value="65536"/>"#;
    let gather = r#"<string name="indirect" value="gather"/>"#;
    let error = r#"<float name="error" value="0.003"/>"#;
    for kind in ["path", "combined"] {
        for before in ["", gather] {
            for indirect in [Indirect::Gather, Indirect::Guide] {
                let usual = CacheSpec::of(indirect).solve.error;
                let with = |params: String| solved(kind, &params, indirect.name()).unwrap();
                let found = with(format!("{before}{walks}"));
                assert_eq!((found.walks, found.error), (65_536, usual), "{kind}");
                let found = with(format!("{before}{walks}{error}"));
                assert_eq!((found.walks, found.error), (65_536, 0.003), "{kind}");
            }
        }
        let none = solved(kind, walks, "none");
        assert_eq!(none.is_some(), kind == "combined");
    }
}

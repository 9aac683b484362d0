//! Every path of light is found by exactly one estimator: classes of paths that are rendered apart agree with
//! what path tracing says of each, and sum to it.

#[path = "common/render.rs"]
mod render;
#[path = "common/stats.rs"]
#[allow(dead_code)] // a part of it is used
mod stats;

use luxel::transport::{
    CombinedSpec, IntegratorSpec, PathSpec, PhotonMapperSpec, PhotonSpec, Show,
};
use render::compile;
use stats::{Running, normal_p_value, sidak};

/// An open room with a glass and a mirror ball, a mask in front, a plastic wall and one that is half a mirror, lit by
/// what path tracing finds the caustics of too. `ball` is a third ball.
fn room(ball: &str, light: &str) -> String {
    let wall = |place: &str, material: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world"><scale value="2"/>{place}</transform>
            <ref id="{material}"/></shape>"#
        )
    };
    format!(
        r#"<scene version="3.0.0">
        <sensor type="perspective"><float name="fov" value="60"/>
            <float name="shutter_open" value="0"/><float name="shutter_close" value="1"/>
            <transform name="to_world">
                <lookat origin="0, 0.2, 3.4" target="0, -0.2, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/>
                <rfilter type="box"/></film>
        </sensor>
        <bsdf type="twosided" id="wall"><bsdf type="diffuse">
            <rgb name="reflectance" value="0.6, 0.55, 0.5"/></bsdf></bsdf>
        <bsdf type="plastic" id="plastic"><rgb name="diffuse_reflectance" value="0.2, 0.5, 0.3"/></bsdf>
        <bsdf type="blendbsdf" id="blend"><float name="weight" value="0.5"/>
            <bsdf type="conductor"><string name="material" value="none"/></bsdf>
            <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.2, 0.2"/></bsdf></bsdf>
        <bsdf type="mask" id="mask"><float name="opacity" value="0.4"/>
            <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf>
        {}{}{}{}
        {ball}
        <shape type="sphere"><point name="center" x="0.6" y="-0.65" z="-0.4"/>
            <float name="radius" value="0.35"/>
            <bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>
        <shape type="rectangle"><transform name="to_world">
            <scale value="0.5"/><translate x="0.5" y="0.2" z="1.2"/></transform><ref id="mask"/></shape>
        {light}
        </scene>"#,
        wall(r#"<rotate x="1" angle="-90"/><translate y="-1"/>"#, "wall"),
        wall(r#"<translate z="-1.5"/>"#, "wall"),
        wall(
            r#"<rotate y="1" angle="90"/><translate x="-1.5"/>"#,
            "plastic"
        ),
        wall(
            r#"<rotate y="1" angle="-90"/><translate x="1.5"/>"#,
            "blend"
        ),
    )
}

const LAMP: &str = r#"<shape type="rectangle"><transform name="to_world">
    <scale value="1.2"/><rotate x="1" angle="90"/><translate y="1.4"/></transform>
    <emitter type="area"><rgb name="radiance" value="2"/></emitter></shape>"#;
const SKY: &str = r#"<emitter type="constant"/>"#;
const GLASS: &str = r#"<shape type="sphere"><point name="center" x="-0.5" y="-0.5" z="0"/>
    <float name="radius" value="0.4"/><bsdf type="dielectric"/></shape>"#;
const MOVING_GLASS: &str = r#"<shape type="sphere"><float name="radius" value="0.4"/>
    <animation name="to_world">
        <transform time="0"><translate x="-0.9" y="-0.5"/></transform>
        <transform time="1"><translate x="0.1" y="-0.3" z="0.3"/></transform>
    </animation><bsdf type="dielectric"/></shape>"#;

fn path(max_depth: u32) -> PathSpec {
    PathSpec {
        max_depth: Some(max_depth),
        ..PathSpec::default()
    }
}

fn combined(max_depth: u32, show: Show, radius: f32) -> IntegratorSpec {
    IntegratorSpec::Combined(CombinedSpec {
        path: path(max_depth),
        photons: PhotonSpec {
            count: Some(8000),
            radius: Some(radius),
            ..PhotonSpec::default()
        },
        show,
        ..CombinedSpec::default()
    })
}

/// The mean picture.
fn picture(xml: &str, integrator: IntegratorSpec, spp: u64, seed: u64) -> Vec<[f64; 3]> {
    let mut compiled = compile(xml);
    compiled.job.integrator = integrator;
    compiled.job.seed = seed;
    render::render(&compiled, spp).0.mean()
}

/// Means over all channels of the tiles of 4 x 4 pixels of a picture 16 wide.
fn tiles(picture: &[[f64; 3]]) -> Vec<f64> {
    let mut sums = vec![0.0; 4 * picture.len() / (16 * 4)];
    for (i, p) in picture.iter().enumerate() {
        sums[i % 16 / 4 + 4 * (i / 64)] += p.iter().sum::<f64>() / 48.0;
    }
    sums
}

/// Compares what path tracing finds of caustics with what photons do, tile by tile and in the whole. Returns the
/// standard error of the whole, relative.
fn check_caustics(xml: &str, max_depth: u32, runs: u64, spp: u64) -> f64 {
    let mut by_path = vec![Running::default(); 13];
    let mut by_photons = by_path.clone();
    for seed in 0..runs {
        let all = picture(xml, IntegratorSpec::Path(path(max_depth)), spp, seed);
        let rest = picture(
            xml,
            combined(max_depth, Show::WithoutCaustics, 0.06),
            spp,
            seed,
        );
        let alone = picture(
            xml,
            combined(max_depth, Show::CausticsAlone, 0.06),
            spp,
            seed,
        );
        let all: Vec<f64> = tiles(&all)
            .iter()
            .zip(tiles(&rest))
            .map(|(a, b)| a - b)
            .collect();
        for (runs, tiles) in [(&mut by_path, all), (&mut by_photons, tiles(&alone))] {
            let mean = tiles.iter().sum::<f64>() / tiles.len() as f64;
            for (run, v) in runs.iter_mut().zip(tiles.iter().chain([&mean])) {
                run.add(*v);
            }
        }
    }
    let whole = by_path[12].mean;
    assert!(whole > 0.0, "no caustics");
    for (i, (a, b)) in by_path.iter().zip(&by_photons).enumerate() {
        // Disks reach over rims of surfaces, where photons end: by their radius, 0.06, of sizes about 1.
        let bias = if i == 12 { 0.02 } else { 0.05 };
        let error = ((a.mean - b.mean).abs() - bias * a.mean).max(0.0);
        let stderr = a.stderr().hypot(b.stderr());
        let p = normal_p_value(error / stderr.max(1e-9 * whole));
        assert!(
            p > sidak(1e-5, 13),
            "depth {max_depth}, tile {i}: {} by path tracing, {} by photons, standard error {stderr}, p = {p:.1e}",
            a.mean,
            b.mean
        );
    }
    println!(
        "{} by path tracing, {} by photons",
        by_path[12].mean, by_photons[12].mean
    );
    by_path[12].stderr().hypot(by_photons[12].stderr()) / whole
}

#[test]
fn photons_find_the_caustics_that_path_tracing_finds() {
    // Of edges: light, glass or mirror, receiver, eye; one inside of the glass; many.
    for (light, max_depth, runs, largest) in
        [(SKY, 3, 12, 0.06), (SKY, 9, 16, 0.04), (LAMP, 9, 12, 0.06)]
    {
        let relative = check_caustics(&room(GLASS, light), max_depth, runs, 16);
        println!("depth {max_depth}: standard error {relative:.4}");
        assert!(relative < largest, "{largest} could hide: {relative}");
    }
}

#[test]
fn photons_and_eye_share_the_time_of_what_moves() {
    let relative = check_caustics(&room(MOVING_GLASS, SKY), 8, 12, 16);
    println!("standard error {relative:.4}");
    assert!(relative < 0.04, "{relative}");
}

#[test]
fn classes_sum_to_the_picture() {
    let xml = room(GLASS, LAMP);
    let [all, rest, caustics] = [Show::All, Show::WithoutCaustics, Show::CausticsAlone]
        .map(|show| picture(&xml, combined(8, show, 0.05), 16, 3));
    for ((all, rest), caustics) in all.iter().zip(&rest).zip(&caustics) {
        for c in 0..3 {
            let sum = rest[c] + caustics[c];
            assert!((all[c] - sum).abs() <= 1e-5 * all[c], "{} {sum}", all[c]);
        }
    }
}

#[test]
fn without_photons_combined_is_path_bit_for_bit() {
    // No delta lobe, nothing else, paths too short, and switched off.
    let diffuse =
        r#"<shape type="sphere"><bsdf type="diffuse"/></shape><emitter type="constant"/>"#;
    let mirror =
        r#"<shape type="sphere"><bsdf type="conductor"/></shape><emitter type="constant"/>"#;
    let camera = render::camera(8, 40.0);
    let small = |content| render::scene(-1, &camera, content);
    for (xml, depth, show) in [
        (small(diffuse), 6, Show::All),
        (small(mirror), 6, Show::All),
        (room(GLASS, LAMP), 2, Show::All),
        (room(GLASS, LAMP), 6, Show::AllByPath),
    ] {
        let got = picture(&xml, combined(depth, show, 0.1), 16, 1);
        let expected = picture(&xml, IntegratorSpec::Path(path(depth)), 16, 1);
        assert!(got == expected, "depth {depth}, {show:?}");
    }
}

/// A spot throws its light onto a plane mirror, which throws it onto a floor: as if it came from behind. Radiance
/// of the floor, and whatever the camera looks through, is `factor` times that of a white floor.
fn check_beam(floor: &str, mirror: &str, before: &str, factor: f64, spp: u64) {
    // The spot at (1, 0, 1) aims at the middle between the floor's origin and the image at (3, 0, 1).
    let xml = format!(
        r#"<scene version="3.0.0">
        <sensor type="orthographic">
            <transform name="to_world"><scale x="0.5" y="0.5"/>
                <lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="12"/>
                <rfilter type="box"/></film>
        </sensor>
        <shape type="rectangle"><transform name="to_world"><scale value="20"/></transform>{floor}</shape>
        <shape type="rectangle"><transform name="to_world"><scale value="20"/>
            <rotate y="1" angle="-90"/><translate x="2"/></transform>{mirror}</shape>
        {before}
        <emitter type="spot"><rgb name="intensity" value="3"/>
            <float name="cutoff_angle" value="10.5"/><float name="beam_width" value="10.49"/>
            <transform name="to_world"><lookat origin="1, 0, 1" target="2, 0, 0.66667" up="0, 1, 0"/></transform>
        </emitter>
        </scene>"#
    );
    let found = picture(&xml, IntegratorSpec::Path(path(5)), 4, 1);
    assert!(found.iter().all(|p| p[0] == 0.0), "{mirror}");
    let mut whole = Running::default();
    for seed in 0..12 {
        let picture = picture(&xml, combined(5, Show::All, 0.05), spp, seed);
        whole.add(render::mean_of(&picture));
    }
    // The long side of the picture is one unit.
    let at = |i: usize| {
        let x = ((i % 160) as f64 + 0.5) / 160.0 - 0.5;
        let y = ((i / 160) as f64 + 0.5) / 160.0 - 0.375;
        let d2 = (3.0 - x).powi(2) + y * y + 1.0;
        3.0 * factor / std::f64::consts::PI / (d2 * d2.sqrt())
    };
    let expected = (0..160 * 120).map(at).sum::<f64>() / (160.0 * 120.0);
    println!("{} +- {}, expected {expected}", whole.mean, whole.stderr());
    assert!(
        whole.stderr() < 0.0025 * expected,
        "1 % could hide: {whole:?}"
    );
    // Of 11 degrees of freedom: chance goes further once in 500 times.
    assert!((whole.mean - expected).abs() < 4.1 * whole.stderr());
}

#[test]
fn beams_throw_caustics_that_no_path_from_the_eye_finds() {
    let white = r#"<bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf>"#;
    let mirror = r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#;
    let half = |weight: f64| {
        format!(
            r#"<bsdf type="blendbsdf"><float name="weight" value="{weight}"/>{white}{mirror}</bsdf>"#
        )
    };
    check_beam(white, mirror, "", 1.0, 24);
    // Of the wall, the part that is no mirror throws light on too, but no caustic. Of the floor, the part that is
    // one throws light back up, which nothing sees. Before the camera hangs a veil, which the light, half-way
    // between its image at (3, 0, 1) and the floor, passes by.
    let dark = half(0.8).replace(r#"value="1""#, r#"value="0""#);
    let veil = r#"<shape type="rectangle"><transform name="to_world"><scale value="0.8"/>
        <translate z="0.5" x="-0.1"/></transform><bsdf type="mask"><float name="opacity" value="0.2"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf></bsdf></shape>"#;
    check_beam(&half(0.2), &dark, veil, 0.8 * 0.8 * 0.8, 64);
}

#[test]
fn bias_falls_with_the_radius() {
    let xml = room(GLASS, LAMP);
    let of = |radius| {
        let mut integrator = combined(4, Show::CausticsAlone, radius);
        if let IntegratorSpec::Combined(spec) = &mut integrator {
            spec.photons.count = Some(20_000);
            // No reduction, so that the radius is what it is.
            spec.photons.alpha = 1.0;
        }
        picture(&xml, integrator, 48, 1)
    };
    let reference = of(0.05);
    let error = |radius| {
        let picture = of(radius);
        let squares = picture
            .iter()
            .zip(&reference)
            .map(|(a, b)| (a[0] - b[0]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let errors = [0.8, 0.4, 0.2].map(error);
    println!("{errors:?}");
    assert!(
        errors[1] < 0.8 * errors[0] && errors[2] < 0.7 * errors[1],
        "{errors:?}"
    );
}

fn photon_mapper(max_depth: u32) -> PhotonMapperSpec {
    PhotonMapperSpec {
        path: path(max_depth),
        direct_samples: 2,
        gather_samples: 4,
        glossy_samples: 4,
        global_photons: 40_000,
        caustic_photons: 40_000,
        global_lookup: 40,
        caustic_lookup: 40,
        ..PhotonMapperSpec::default()
    }
}

#[test]
fn photon_maps_agree_with_path_tracing_within_their_bias() {
    for (name, xml) in [
        ("still", room(GLASS, LAMP)),
        ("moving", room(MOVING_GLASS, LAMP)),
    ] {
        let spec = PhotonMapperSpec {
            global_photons: if name == "still" { 40_000 } else { 4000 },
            caustic_photons: if name == "still" { 40_000 } else { 4000 },
            ..photon_mapper(8)
        };
        let got = tiles(&picture(&xml, IntegratorSpec::PhotonMapper(spec), 16, 1));
        let expected = tiles(&picture(&xml, IntegratorSpec::Path(path(8)), 1024, 1));
        for (i, (a, b)) in got.iter().zip(&expected).enumerate() {
            assert!(
                (a / b - 1.0).abs() < 0.08,
                "{name}, tile {i}: {a}, path tracing {b}"
            );
        }
        let ratio = got.iter().sum::<f64>() / expected.iter().sum::<f64>();
        println!("{name}: {ratio}");
        assert!((ratio - 1.0).abs() < 0.02, "{name}: {ratio}");
    }
}

#[test]
fn threads_change_nothing() {
    let xml = room(GLASS, LAMP);
    for integrator in [
        combined(8, Show::All, 0.05),
        IntegratorSpec::PhotonMapper(photon_mapper(8)),
    ] {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| picture(&xml, integrator.clone(), 3, 1))
        };
        assert!(with(1) == with(4), "{}", integrator.name());
    }
}

#[test]
fn photons_that_would_not_fit_are_refused_before_rendering() {
    let message = |integrator: &str| {
        let scene = r#"<scene version="3.0.0">"#;
        let xml = room(GLASS, LAMP).replace(scene, &format!("{scene}{integrator}"));
        let folder = std::path::Path::new(".");
        let desc = luxel::format::load_str("test.xml", &xml, folder, &[]).unwrap();
        let overrides = luxel::format::Overrides::default();
        let error = luxel::format::compile(&desc, &overrides).expect_err(integrator);
        error.to_string()
    };
    let combined = message(
        r#"<integrator type="combined"><integer name="photon_count" value="1000000000"/>
        <integer name="memory" value="64"/></integrator>"#,
    );
    assert!(
        combined.contains("photon_count 1000000000 makes about"),
        "{combined}"
    );
    let maps = message(
        r#"<integrator type="photonmapper"><integer name="global_photons" value="1000000"/>
        <integer name="memory" value="64"/></integrator>"#,
    );
    assert!(maps.contains("maps of 1250000 photons may take"), "{maps}");
}

//! Ten small scenes of different kinds of noise, for what is said about errors.

use super::render::{camera, scene};

/// Pixels of a side of the pictures.
pub const SIDE: u32 = 10;

/// A scene, what renders it, and by which points.
pub struct Case {
    pub name: &'static str,
    pub xml: String,
    pub integrator: &'static str,
    pub sampler: &'static str,
}

const LAMP: &str = r#"<shape type="sphere"><point name="center" x="0.5" y="3" z="0"/><float name="radius" value="0.9"/>
    <emitter type="area"><rgb name="radiance" value="4, 3.5, 3"/></emitter></shape>"#;
const ROOM: &str = r#"<shape type="cube"><transform name="to_world"><scale value="5"/></transform>
    <boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.4, 0.3"/></bsdf></shape>"#;
const FLOOR: &str = r#"<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="-90"/>
    <scale value="8"/><translate y="-1.2"/></transform><bsdf type="diffuse"/></shape>"#;
const SKY: &str =
    r#"<emitter type="constant"><rgb name="radiance" value="0.4, 0.6, 1"/></emitter>"#;
/// Small and bright, as the sun through a window.
const SPOT: &str = r#"<emitter type="point"><point name="position" x="2" y="3" z="2"/>
    <rgb name="intensity" value="30"/></emitter>"#;

/// A ball before the camera, of `bsdf`.
fn ball(bsdf: &str) -> String {
    format!(
        r#"<shape type="sphere"><point name="center" x="0" y="-0.5" z="0"/><float name="radius" value="0.7"/>{bsdf}</shape>"#
    )
}

fn case(
    name: &'static str,
    [integrator, sampler]: [&'static str; 2],
    depth: i32,
    parts: &[&str],
) -> Case {
    let camera = camera(SIDE, 50.0);
    let xml = scene(depth, &camera, &parts.concat());
    Case {
        name,
        xml,
        integrator,
        sampler,
    }
}

/// Small lamps beside each other at this height: 1.6 is in view.
fn lamps(y: f64) -> String {
    let lamp = |i: i32| {
        let (x, z) = (f64::from(i % 3) - 1.0, f64::from(i / 3) - 1.0);
        format!(
            r#"<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/><float name="radius" value="0.08"/>
            <emitter type="area"><rgb name="radiance" value="{}"/></emitter></shape>"#,
            20 + 15 * i
        )
    };
    (0..9).map(lamp).collect()
}

const GOLD: &str = r#"<bsdf type="roughconductor"><string name="material" value="Au"/><float name="alpha" value="0.3"/></bsdf>"#;

/// What no estimate from few samples tells right, to be measured and not promised. Lamps smaller than a pixel in view
/// make nearly black pixels that few samples find bright, whose relative error is told too small until these are many.
/// A room lit through glass has noise with long tails, in the reference too.
pub fn hard_cases() -> Vec<Case> {
    let (gold, glass) = (ball(GOLD), ball(GLASS));
    vec![
        case(
            "lamps in view",
            ["direct", "sobol"],
            2,
            &[FLOOR, &gold, &lamps(1.6)],
        ),
        case(
            "room with glass",
            ["bdpt", "sobol"],
            6,
            &[ROOM, &glass, LAMP],
        ),
    ]
}

const GLASS: &str = r#"<bsdf type="dielectric"/>"#;

/// All by integrators without bias.
pub fn cases() -> Vec<Case> {
    let matte =
        ball(r#"<bsdf type="diffuse"><rgb name="reflectance" value="0.8, 0.2, 0.2"/></bsdf>"#);
    let mirror = ball(r#"<bsdf type="conductor"><string name="material" value="none"/></bsdf>"#);
    let gold = ball(GOLD);
    let plastic = ball(r#"<bsdf type="plastic"/>"#);
    let glass = ball(GLASS);
    let checks = FLOOR.replace(
        r#"<bsdf type="diffuse"/>"#,
        r#"<bsdf type="diffuse"><texture type="checkerboard" name="reflectance">
            <transform name="to_uv"><scale value="6"/></transform></texture></bsdf>"#,
    );
    let many = lamps(3.0);
    let lens = r#"<sensor type="thinlens"><float name="aperture_radius" value="0.25"/><float name="focus_distance" value="4"/>"#;
    let mut blurred = case(
        "out of focus",
        ["path", "sobol"],
        3,
        &[&checks, &matte, LAMP],
    );
    blurred.xml = blurred.xml.replace(r#"<sensor type="perspective">"#, lens);
    vec![
        case(
            "soft shadows",
            ["path", "independent"],
            2,
            &[FLOOR, &matte, LAMP],
        ),
        case(
            "soft shadows, sobol",
            ["path", "sobol"],
            2,
            &[FLOOR, &matte, LAMP],
        ),
        case("room", ["path", "independent"], 6, &[ROOM, &matte, LAMP]),
        case(
            "room with a mirror",
            ["bdpt", "independent"],
            6,
            &[ROOM, &mirror, LAMP],
        ),
        case(
            "gold below a sky",
            ["path", "sobol"],
            4,
            &[FLOOR, &gold, SKY],
        ),
        case(
            "plastic",
            ["path", "independent"],
            4,
            &[FLOOR, &plastic, LAMP, SPOT],
        ),
        case(
            "glass below a sky",
            ["path", "sobol"],
            6,
            &[FLOOR, &glass, SKY],
        ),
        case("many lamps", ["direct", "sobol"], 2, &[FLOOR, &gold, &many]),
        blurred,
        case(
            "room, light tracing too",
            ["bdpt", "sobol"],
            5,
            &[ROOM, &matte, LAMP],
        ),
    ]
}

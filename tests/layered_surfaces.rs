//! Pictures of glass and plastic: light sampling, surface sampling and both together agree.

#[path = "common/render.rs"]
mod render;

use render::{assert_explained, camera, mean_and_error, mean_of, picture, scene};

/// A plane of that material under a lamp, seen at the origin.
fn plane(material: &str, light: &str, integrator: &str) -> String {
    format!(
        r#"<scene version="3.0.0">{integrator}{}
        <shape type="rectangle"><transform name="to_world"><scale value="50"/></transform>{material}</shape>
        {light}</scene>"#,
        camera(8, 0.02)
    )
}

fn direct(emitter_samples: u32, bsdf_samples: u32) -> String {
    format!(
        r#"<integrator type="direct">
            <integer name="emitter_samples" value="{emitter_samples}"/>
            <integer name="bsdf_samples" value="{bsdf_samples}"/>
        </integrator>"#
    )
}

const PATH: &str = r#"<integrator type="path"><integer name="max_depth" value="2"/></integrator>"#;

/// A lamp in the mirror direction of the camera's, and off it; behind the plane too.
const LAMPS: &str = r#"
    <shape type="sphere"><point name="center" x="0" y="0" z="6"/><float name="radius" value="0.5"/>
        <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>
    <shape type="sphere"><point name="center" x="2" y="1" z="2"/><float name="radius" value="0.7"/>
        <emitter type="area"><rgb name="radiance" value="2"/></emitter></shape>
    <shape type="sphere"><point name="center" x="0.3" y="0" z="-3"/><float name="radius" value="0.8"/>
        <emitter type="area"><rgb name="radiance" value="3"/></emitter></shape>"#;

const MATERIALS: [&str; 3] = [
    r#"<bsdf type="plastic"><rgb name="diffuse_reflectance" value="0.4"/></bsdf>"#,
    r#"<bsdf type="roughplastic"><float name="alpha" value="0.2"/><rgb name="diffuse_reflectance" value="0.4"/></bsdf>"#,
    r#"<bsdf type="roughdielectric"><float name="alpha" value="0.2"/><string name="distribution" value="ggx"/></bsdf>"#,
];

#[test]
fn strategies_agree() {
    for material in MATERIALS {
        let xml = |integrator: &str| plane(material, LAMPS, integrator);
        let (expected, error) = mean_and_error(&xml(&direct(0, 16)), 1024, 1);
        assert!(error < 3e-3 * expected, "{expected} +- {error}");
        for integrator in [PATH.to_string(), direct(2, 3)] {
            let (mean, stderr) = mean_and_error(&xml(&integrator), 1024, 2);
            assert!(
                (mean - expected).abs() < 4.5 * error.hypot(stderr),
                "{material} {integrator}: {mean} +- {stderr}, expected {expected} +- {error}"
            );
        }
    }
}

/// Under a sky of radiance 1 a surface shows its albedo.
#[test]
fn sky_shows_the_albedo() {
    let sky = r#"<emitter type="constant"/>"#;
    // Schlick's R0 of 1.5, and the base under the closed form of what diffuse light meets.
    let (r0, entering) = (0.04f64, 1.0 - 0.091_777_959);
    for (nonlinear, a) in [(false, 0.5f64), (true, 0.5), (true, 1.0)] {
        let material = format!(
            r#"<bsdf type="plastic"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/>
            <rgb name="diffuse_reflectance" value="{a}"/><boolean name="nonlinear" value="{nonlinear}"/></bsdf>"#
        );
        let white = if nonlinear { a } else { 1.0 };
        let body = a / (2.25 * (1.0 - white) + white * entering);
        let expected = r0 + (1.0 - r0) * entering * body;
        let xml = plane(&material, sky, PATH);
        assert_explained(mean_and_error(&xml, 1024, 1), expected, &material);
    }
}

/// Thin panes, and boundaries between equal media, however rough, let the sky through.
#[test]
fn clear_panes_show_what_is_behind() {
    let sky = r#"<emitter type="constant"/>"#;
    for material in [
        r#"<bsdf type="thindielectric"/>"#,
        r#"<bsdf type="roughdielectric"><float name="int_ior" value="1.3"/><float name="ext_ior" value="1.3"/></bsdf>"#,
        r#"<bsdf type="null"/>"#,
    ] {
        let body = format!(r#"<shape type="rectangle">{material}</shape>{sky}"#);
        let picture = picture(&scene(-1, &camera(8, 10.0), &body), 16, 1);
        assert!((mean_of(&picture) - 1.0).abs() < 1e-5, "{material}");
    }
}

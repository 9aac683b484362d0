//! Pictures whose values are known in closed form, to what chance leaves of 0.15 %.

#[path = "common/render.rs"]
mod render;

use render::{assert_explained, camera, mean_and_error, mean_of, picture, scene};

const PI: f64 = std::f64::consts::PI;

/// A Lambertian plane z = 0 of albedo 0.6 under a light, seen at the origin.
fn plane_scene(light: &str, integrator: &str) -> String {
    let plane = r#"<shape type="rectangle">
        <transform name="to_world"><scale value="50"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.6"/></bsdf>
    </shape>"#;
    format!(
        r#"<scene version="3.0.0">{integrator}{}{plane}{light}</scene>"#,
        // So narrow that the irradiance does not vary over the picture by 1e-5.
        camera(8, 0.02)
    )
}

/// Radiance of the plane and its standard error.
fn plane_under(light: &str, integrator: &str) -> (f64, f64) {
    mean_and_error(&plane_scene(light, integrator), 1024, 1)
}

/// Camera samples of a picture of a plane at 1024 per pixel.
const SAMPLES: f64 = 8.0 * 8.0 * 1024.0;

const PATH: &str = r#"<integrator type="path"><integer name="max_depth" value="2"/></integrator>"#;

fn direct(emitter_samples: u32, bsdf_samples: u32) -> String {
    format!(
        r#"<integrator type="direct">
            <integer name="emitter_samples" value="{emitter_samples}"/>
            <integer name="bsdf_samples" value="{bsdf_samples}"/>
        </integrator>"#
    )
}

/// Compares all strategies with the irradiance under a light of radiance 5.
fn check(light: &str, irradiance: f64) {
    let expected = 0.6 * irradiance / PI;
    let strategies = [PATH.to_string(), direct(1, 1), direct(1, 0), direct(3, 2)];
    for integrator in strategies {
        assert_explained(plane_under(light, &integrator), expected, &integrator);
    }
    // BSDF sampling alone finds the light with probability p = E / (pi L): the number of finds is
    // binomial. 4 standard errors fail by chance once in 16,000; stratification only narrows it.
    let xml = plane_scene(light, &direct(0, 4));
    let got = mean_of(&picture(&xml, 1024, 1));
    let p = irradiance / (PI * 5.0);
    let stderr = ((1.0 - p) / (p * 4.0 * SAMPLES)).sqrt();
    assert!(
        (got / expected - 1.0).abs() < 4.0 * stderr,
        "bsdf samples only: {got}, expected {expected} +- {}",
        stderr * expected
    );
}

#[test]
fn sphere_light_over_a_plane() {
    // A sphere of radius r at distance d, its axis at angle t to the normal and wholly above the
    // horizon: E = pi L (r / d)^2 cos t. All stand beside the camera's line of sight.
    for (x, z, r) in [(1.5, 2.0, 0.7), (3.0, 1.2, 1.1), (0.4, 3.0, 0.05f64)] {
        let d2: f64 = x * x + z * z;
        let light = format!(
            r#"<shape type="sphere"><point name="center" x="{x}" y="0" z="{z}"/><float name="radius" value="{r}"/>
                <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
                <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>"#
        );
        check(&light, PI * 5.0 * r * r / d2 * (z / d2.sqrt()));
    }
}

/// Irradiance at the origin, normal +z, under a polygon of radiance 1 wholly above the horizon
/// (Lambert 1760): half the sum of the edges' angles times the cosines of their planes' normals.
fn polygon_irradiance(corners: &[[f64; 3]]) -> f64 {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let edge = |i: usize| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        let n = cross(a, b);
        let len = dot(n, n).sqrt();
        len.atan2(dot(a, b)) * n[2] / len
    };
    0.5 * (0..corners.len()).map(edge).sum::<f64>().abs()
}

#[test]
fn rectangle_light_over_a_plane() {
    // Half-widths, height, offset in x; the rectangle faces down.
    for (hx, hy, z, x) in [
        (0.5, 0.4, 2.0, 1.2),
        (3.0, 0.2, 1.0, 3.5),
        (0.01, 0.01, 2.5, 0.5f64),
    ] {
        let corners = [
            [x - hx, -hy, z],
            [x + hx, -hy, z],
            [x + hx, hy, z],
            [x - hx, hy, z],
        ];
        let light = format!(
            r#"<shape type="rectangle">
                <transform name="to_world"><scale x="{hx}" y="{hy}"/><rotate x="1" angle="180"/>
                    <translate x="{x}" z="{z}"/></transform>
                <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
                <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>"#
        );
        check(&light, 5.0 * polygon_irradiance(&corners));
    }
}

#[test]
fn disk_light_over_a_plane() {
    // A disk of radius r, parallel to the plane at height z, its centre at distance x from the normal:
    // E = pi L / 2 (1 - (x^2 + z^2 - r^2) / sqrt((x^2 + z^2 + r^2)^2 - 4 x^2 r^2)).
    for (x, z, r) in [(1.2, 2.0, 0.6), (2.0, 1.0, 1.8f64)] {
        let (x2, z2, r2) = (x * x, z * z, r * r);
        let root = ((x2 + z2 + r2) * (x2 + z2 + r2) - 4.0 * x2 * r2).sqrt();
        let light = format!(
            r#"<shape type="disk">
                <transform name="to_world"><scale value="{r}"/><rotate x="1" angle="180"/>
                    <translate x="{x}" z="{z}"/></transform>
                <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
                <emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>"#
        );
        check(&light, 5.0 * PI / 2.0 * (1.0 - (x2 + z2 - r2) / root));
    }
}

#[test]
fn point_light_and_constant_sky_over_a_plane() {
    let point = r#"<emitter type="point"><point name="position" x="1" y="2" z="3"/>
        <rgb name="intensity" value="7"/></emitter>"#;
    let d2 = 14.0f64;
    let expected = 0.6 * 7.0 * 3.0 / d2.powf(1.5) / PI;
    assert_explained(plane_under(point, PATH), expected, "point");
    let sky = r#"<emitter type="constant"><rgb name="radiance" value="2"/></emitter>"#;
    assert_explained(plane_under(sky, PATH), 1.2, "sky");
}

#[test]
fn furnace_of_a_closed_sphere() {
    // Inside a closed emitter of radiance e and albedo a the radiance is e / (1 - a) everywhere.
    for albedo in [0.2, 0.5, 0.8] {
        let content = format!(
            r#"<shape type="sphere"><float name="radius" value="5"/><boolean name="flip_normals" value="true"/>
                <bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf>
                <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#
        );
        // Roulette makes the noise.
        let got = mean_and_error(&scene(-1, &camera(16, 60.0), &content), 256, 2);
        assert_explained(got, 1.0 / (1.0 - albedo), &format!("albedo {albedo}"));
    }
}

#[test]
fn furnace_of_bright_walls() {
    let content = r#"<shape type="sphere"><float name="radius" value="5"/><boolean name="flip_normals" value="true"/>
            <bsdf type="diffuse"><rgb name="reflectance" value="0.99"/></bsdf>
            <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#;
    let (film, _) = render::render(
        &render::compile(&scene(-1, &camera(16, 60.0), content)),
        256,
    );
    let pixels = film.mean().len() as f64;
    let mean = film.mean().iter().map(|m| m[0]).sum::<f64>() / pixels;
    let stderr = film
        .standard_error()
        .iter()
        .map(|s| s[0] * s[0])
        .sum::<f64>()
        .sqrt()
        / pixels;
    assert!((mean - 100.0).abs() < 4.5 * stderr, "{mean} +- {stderr}");
    // Roulette with a constant bound of 0.95, whose variance is infinite here, gives 1.9; this one 0.8.
    assert!(stderr < 1.2, "{stderr}");
}

#[test]
fn path_depth_counts_edges() {
    // The same furnace cut after n edges: the geometric series cut after n terms.
    for depth in 1..5 {
        let content = r#"<shape type="sphere"><float name="radius" value="5"/><boolean name="flip_normals" value="true"/>
                <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
                <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"#;
        let got = mean_and_error(&scene(depth, &camera(16, 60.0), content), 256, 3);
        let expected = 2.0 * (1.0 - 0.5f64.powi(depth));
        assert_explained(got, expected, &format!("depth {depth}"));
    }
}

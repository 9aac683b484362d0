//! Cameras and meters: their rays as measured with Mitsuba, how they see points, what a lens blurs, and
//! what meters read.

mod rays;
#[path = "../common/render.rs"]
mod render;
#[path = "../common/mod.rs"]
mod rng;
mod sights;

use luxel::math::Vec2;
use luxel::scene::camera::Aperture;
use render::{assert_explained, mean_and_error, picture};
use std::f64::consts::PI;

fn film(width: u32, height: u32) -> String {
    format!(
        r#"<film type="hdrfilm">
            <integer name="width" value="{width}"/><integer name="height" value="{height}"/>
            <rfilter type="box"/>
        </film>"#
    )
}

#[test]
fn radius_0_is_the_pinhole_bit_for_bit() {
    let xml =
        include_str!("../../scenes/cornell-balls.xml").replace(r#"value="512""#, r#"value="24""#);
    let pinhole = picture(&xml, 8, 0);
    let lens = |radius: &str| {
        let thin = format!(
            "<sensor type=\"thinlens\"><float name=\"aperture_radius\" value=\"{radius}\"/>"
        );
        picture(&xml.replace("<sensor type=\"perspective\">", &thin), 8, 0)
    };
    assert!(lens("0") == pinhole);
    assert!(lens("0.1") != pinhole);
}

/// Pixels along each side of the picture of a small disk, and the tangent of half its field of view.
const SIZE: usize = 48;
const TAN: f64 = 0.13;
/// Radius and distance of the disk, and its radiance.
const DISK: f64 = 0.07;
const DISTANCE: f64 = 4.0;
const RADIANCE: f64 = 1000.0;

/// The disk as seen by a lens: light summed over the pixels, its mean place and variance along each axis,
/// in pixels, and how many pixels are brighter than `level`.
struct Blur {
    sum: f64,
    mean: [f64; 2],
    variance: [f64; 2],
    lit: f64,
}

fn blur(lens: &str, level: f64) -> Blur {
    let fov = 2.0 * TAN.atan().to_degrees();
    let xml = format!(
        r#"<scene version="3.0.0">
            <integrator type="path"><integer name="max_depth" value="1"/></integrator>
            <sensor type="thinlens"><float name="fov" value="{fov}"/>{lens}
                <transform name="to_world"><lookat origin="0, 0, {DISTANCE}" target="0, 0, 0" up="0, 1, 0"/></transform>
                {}
            </sensor>
            <shape type="disk">
                <transform name="to_world"><scale value="{DISK}"/></transform>
                <emitter type="area"><rgb name="radiance" value="{RADIANCE}"/></emitter>
            </shape>
        </scene>"#,
        film(SIZE as u32, SIZE as u32)
    );
    let picture = picture(&xml, 1024, 3);
    let sum: f64 = picture.iter().map(|p| p[0]).sum();
    let mean_of = |f: &dyn Fn([f64; 2]) -> f64| {
        let at = |i: usize| [i % SIZE, i / SIZE].map(|v| v as f64 + 0.5);
        let terms = picture.iter().enumerate().map(|(i, p)| p[0] * f(at(i)));
        terms.sum::<f64>() / sum
    };
    let mean = [mean_of(&|p| p[0]), mean_of(&|p| p[1])];
    let variance = [0, 1].map(|axis| mean_of(&|p| (p[axis] - mean[axis]).powi(2)));
    Blur {
        sum,
        mean,
        variance,
        lit: picture.iter().filter(|p| p[0] > level).count() as f64,
    }
}

/// A point at distance z seen through a lens of radius r focused at F is a disk of radius r |1/z - 1/F| at
/// unit depth: the circle of confusion.
#[test]
fn blur_has_the_size_of_the_circle_of_confusion() {
    let per_pixel = 2.0 * TAN / SIZE as f64;
    let (radius, focus) = (0.4, 2.0);
    let circle = radius * (1.0 / DISTANCE - 1.0 / focus).abs() / per_pixel;
    let lens = format!(
        "<float name='aperture_radius' value='{radius}'/><float name='focus_distance' value='{focus}'/>"
    );
    // The disk itself and the pixel widen the blur.
    let own = DISK / DISTANCE / per_pixel;
    let widening = own * own / 4.0 + 1.0 / 12.0;
    // Blur spreads light and loses none: radiance times the solid angle, in pixels.
    let light = RADIANCE * PI * own * own;
    let near = |a: f64, b: f64, share: f64| (a / b - 1.0).abs() < share;
    for blades in [0u32, 3, 6] {
        let n = f64::from(blades);
        // Area of the opening, and its second moment along any axis over the area, for a circle of 1.
        let (cut, aperture, area, moment) = match blades {
            0 => (String::new(), Aperture::Disk, PI, 0.25),
            _ => (
                format!("<integer name='aperture_blades' value='{blades}'/>"),
                Aperture::Polygon {
                    blades,
                    rotation: 0.0,
                },
                0.5 * n * (2.0 * PI / n).sin(),
                (2.0 + (2.0 * PI / n).cos()) / 12.0,
            ),
        };
        assert!(near(f64::from(aperture.area()), area, 1e-6));
        let covered = area * circle * circle;
        let seen = blur(&format!("{lens}{cut}"), 0.5 * light / covered);
        assert!(
            near(seen.sum, light, 0.01),
            "{blades}: {} {light}",
            seen.sum
        );
        // The disk rounds the corners of the triangle off.
        let rounding = if blades == 3 { 0.1 } else { 0.04 };
        assert!(
            near(seen.lit, covered, rounding),
            "{blades}: {} {covered}",
            seen.lit
        );
        let variance = moment * circle * circle + widening;
        for axis in 0..2 {
            let middle = 0.5 * SIZE as f64;
            assert!(
                (seen.mean[axis] - middle).abs() < 0.1,
                "{blades}: {:?}",
                seen.mean
            );
            let found = seen.variance[axis];
            assert!(near(found, variance, 0.012), "{blades}: {found} {variance}");
        }
    }
}

#[test]
fn blades_turn_with_their_rotation() {
    for (degrees, corner) in [
        (0.0f32, Vec2::X),
        (90.0, Vec2::Y),
        (-30.0, Vec2::new(0.75f32.sqrt(), -0.5)),
    ] {
        let aperture = Aperture::Polygon {
            blades: 5,
            rotation: degrees.to_radians(),
        };
        // How far the opening reaches: to the circle at the corner, less on the other side.
        let reach = |axis: Vec2| {
            let grid =
                (0..512 * 512).map(|i| Vec2::new((i % 512) as f32, (i / 512) as f32) / 511.0);
            grid.map(|u| aperture.sample(u).dot(axis))
                .fold(0.0, f32::max)
        };
        assert!((reach(corner) - 1.0).abs() < 0.01, "{degrees}");
        assert!(
            (reach(-corner) - 36f32.to_radians().cos()).abs() < 0.01,
            "{degrees}"
        );
    }
}

#[test]
fn orthographic_size_is_that_of_its_scale() {
    // A disk of radius 1 before a black world, seen by a square 2 s wide: it fills pi / (4 s^2) of it,
    // however far away it is.
    for (scale, distance) in [(1.5, 3.0), (4.0, 300.0)] {
        let xml = format!(
            r#"<scene version="3.0.0">
                <integrator type="path"><integer name="max_depth" value="1"/></integrator>
                <sensor type="orthographic">
                    <transform name="to_world">
                        <scale x="{scale}" y="{scale}"/>
                        <lookat origin="0, 0, {distance}" target="0, 0, 0" up="0, 1, 0"/>
                    </transform>
                    {}
                </sensor>
                <shape type="disk"><emitter type="area"><rgb name="radiance" value="2"/></emitter></shape>
            </scene>"#,
            film(64, 64)
        );
        let expected = 2.0 * PI / (4.0 * scale * scale);
        assert_explained(mean_and_error(&xml, 256, 1), expected, "orthographic");
    }
}

/// A meter's scene under a sky of radiance 3, with one pixel.
fn meter(sensor: &str, content: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
            <integrator type="path"><integer name="max_depth" value="2"/></integrator>
            {sensor} {content}
            <emitter type="constant"><rgb name="radiance" value="3"/></emitter>
        </scene>"#
    )
}

#[test]
fn irradiance_meters_read_pi_times_the_sky() {
    let film = film(1, 1);
    let inside = format!(r#"<sensor type="irradiancemeter">{film}</sensor>"#);
    let shapes = [
        r#"type="rectangle"><transform name="to_world"><scale x="3"/><rotate x="1" angle="50"/></transform>"#,
        r#"type="disk"><boolean name="flip_normals" value="true"/>"#,
        r#"type="sphere"><float name="radius" value="1000"/>"#,
        r#"type="cube">"#,
        r#"type="cylinder">"#,
    ];
    for shape in shapes {
        let xml = meter("", &format!("<shape {shape}{inside}</shape>"));
        assert_explained(mean_and_error(&xml, 64, 1), 3.0 * PI, shape);
    }
    // A lamp of radiance 8 that covers a share sin^2 = 1/4 of the disk's projected hemisphere, from so far
    // away that all its points see it alike: 3 pi (1 - 1/4) + 8 pi / 4.
    let r = 1e5 * (1.0 / 3f64).sqrt();
    let lamp = format!(
        r#"<shape type="disk"><boolean name="flip_normals" value="true"/>
            <transform name="to_world"><scale value="{r}"/><translate z="1e5"/></transform>
            <emitter type="area"><rgb name="radiance" value="8"/></emitter>
        </shape>"#
    );
    let xml = meter("", &format!("<shape type=\"disk\">{inside}</shape>{lamp}"));
    assert_explained(mean_and_error(&xml, 4096, 1), 4.25 * PI, "lamp and sky");
}

#[test]
fn meters_of_radiance_read_what_they_look_at() {
    let film = film(1, 1);
    let lamp = r#"<shape type="rectangle"><emitter type="area"><rgb name="radiance" value="5"/></emitter></shape>"#;
    let read =
        |sensor: &str| mean_and_error(&meter(&format!("{sensor}{film}</sensor>"), lamp), 64, 1);
    let at = r#"<sensor type="radiancemeter"><point name="origin" x="0.5" y="0.5" z="7"/>"#;
    let down = r#"<vector name="direction" x="0" y="0" z="-1"/>"#;
    let up = r#"<vector name="direction" x="0" y="0" z="1"/>"#;
    assert_explained(read(&format!("{at}{down}")), 5.0, "towards the lamp");
    assert_explained(read(&format!("{at}{up}")), 3.0, "towards the sky");
    let distant = format!("<sensor type=\"distant\">{down}");
    // The square fills 2 / pi of the disk around it.
    assert_explained(read(&distant), 3.0 + 2.0 * 2.0 / PI, "distant");
    let target =
        |shape: &str| format!("{distant}<shape name=\"target\" type=\"rectangle\">{shape}</shape>");
    assert_explained(read(&target("")), 5.0, "distant, on the lamp");
    let wide = r#"<transform name="to_world"><scale x="4"/></transform>"#;
    assert_explained(
        read(&target(wide)),
        3.0 + 2.0 / 4.0,
        "distant, around the lamp",
    );
    let beside = format!("{distant}<point name=\"target\" x=\"3\" y=\"0\" z=\"0\"/>");
    assert_explained(read(&beside), 3.0, "distant, beside the lamp");
}

#[test]
fn a_filter_does_not_weigh_what_a_meter_reads() {
    let inside = |filter: &str| {
        let film = film(1, 1).replace(r#"type="box""#, &format!(r#"type="{filter}""#));
        meter(
            "",
            &format!(
                r#"<shape type="rectangle"><sensor type="irradiancemeter">{film}</sensor></shape>"#
            ),
        )
    };
    assert_eq!(
        picture(&inside("box"), 16, 1),
        picture(&inside("mitchell"), 16, 1)
    );
}

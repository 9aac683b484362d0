//! Cameras and meters: their rays as measured with Mitsuba, what a lens blurs, and what meters read.

#[path = "common/render.rs"]
mod render;

use luxel::format::Compiled;
use luxel::geom::Ray;
use luxel::math::{Vec2, Vec3};
use luxel::scene::CameraSample;
use luxel::scene::camera::Aperture;
use render::{assert_explained, compile, mean_and_error, picture};
use std::f64::consts::PI;

const LOOK: &str = "<lookat origin='1, 2, 3' target='0.5, 0, -1' up='0, 1, 0'/>";

/// A scene with a ball around (1, 2, 0) of radius 2 and a sensor, its film of 200 x 100 pixels.
fn with_sensor(kind: &str, content: &str, width: u32, height: u32) -> Compiled {
    compile(&format!(
        r#"<scene version="3.0.0">
            <shape type="sphere"><point name="center" x="1" y="2" z="0"/><float name="radius" value="2"/></shape>
            <sensor type="{kind}">{content}{}</sensor>
        </scene>"#,
        film(width, height)
    ))
}

fn film(width: u32, height: u32) -> String {
    format!(
        r#"<film type="hdrfilm">
            <integer name="width" value="{width}"/><integer name="height" value="{height}"/>
            <rfilter type="box"/>
        </film>"#
    )
}

/// What Mitsuba's sensors make of the points below of film and lens.
struct Measured {
    o: [f32; 3],
    d: [f32; 3],
    t_max: f32,
}

/// Share of the film's width and height, and numbers for the lens.
const POINTS: [([f32; 2], [f32; 2]); 3] = [
    ([0.3, 0.2], [0.7, 0.1]),
    ([0.9, 0.6], [0.25, 0.5]),
    ([0.5, 0.5], [0.9, 0.9]),
];

const fn ray(o: [f32; 3], d: [f32; 3], t_max: f32) -> Measured {
    Measured { o, d, t_max }
}

fn ray_of(compiled: &Compiled, point: usize) -> Ray {
    let film = &compiled.job.film;
    let ([x, y], lens) = POINTS[point];
    let sample = CameraSample {
        film: Vec2::new(x * film.width as f32, y * film.height as f32),
        lens: Vec2::from_array(lens),
        time: 0.0,
    };
    let seen = compiled.job.camera.ray(&sample);
    assert_eq!(seen.weight, 1.0);
    seen.ray
}

#[track_caller]
fn assert_rays(kind: &str, content: &str, size: [u32; 2], expected: &[Measured; 3]) {
    let compiled = with_sensor(kind, content, size[0], size[1]);
    for (i, want) in expected.iter().enumerate() {
        let got = ray_of(&compiled, i);
        let [o, d] = [want.o, want.d].map(Vec3::from_array);
        assert!(
            (got.o - o).length() < 3e-6 * (1.0 + o.length()),
            "{kind} {i}: {} {o}",
            got.o
        );
        assert!((got.d - d).length() < 2e-6, "{kind} {i}: {} {d}", got.d);
        let relative = (got.t_max - want.t_max).abs() / want.t_max;
        assert!(relative < 1e-5, "{kind} {i}: {} {}", got.t_max, want.t_max);
    }
}

/// Measured with Mitsuba 3.9.1 (scalar_rgb, sample_ray).
#[test]
fn rays_are_those_of_mitsuba() {
    let placed = format!("<transform name='to_world'>{LOOK}</transform>");
    let lens = "<float name='fov' value='40'/><float name='aperture_radius' value='0.3'/>";
    assert_rays(
        "thinlens",
        &format!("{lens}{placed}<float name='focus_distance' value='5'/>"),
        [200, 100],
        &[
            ray(
                [0.9186303, 1.7983028, 3.0997698],
                [-0.24106649, -0.30097982, -0.9226582],
                10196.844,
            ),
            ray(
                [1.1503422, 1.9952295, 2.9723425],
                [0.14509463, -0.46128047, -0.8753102],
                10341.835,
            ),
            ray(
                [0.8214939, 2.1472747, 2.937426],
                [-0.07547416, -0.47430304, -0.87712044],
                10011.503,
            ),
        ],
    );
    // The plane of focus is the far plane.
    assert_rays(
        "thinlens",
        &format!("{lens}{placed}"),
        [200, 100],
        &[
            ray(
                [0.9184725, 1.7979057, 3.099988],
                [-0.25735915, -0.3410093, -0.9041454],
                10164.245,
            ),
            ray(
                [1.1506398, 1.9952295, 2.9723053],
                [0.17253384, -0.45774996, -0.87217957],
                10421.599,
            ),
            ray(
                [0.8211386, 2.1475787, 2.9373186],
                [-0.11109336, -0.44445965, -0.88888353],
                9999.99,
            ),
        ],
    );
    let clips = "<float name='near_clip' value='1'/><float name='far_clip' value='10'/>";
    let axis = "<string name='fov_axis' value='y'/><float name='focus_distance' value='5'/>";
    assert_rays(
        "thinlens",
        &format!("{lens}{placed}{clips}{axis}"),
        [200, 100],
        &[
            ray(
                [0.5247932, 1.5922811, 2.1382604],
                [-0.37060407, -0.19553572, -0.90797496],
                9.6239,
            ),
            ray(
                [1.5898304, 1.4903462, 2.056098],
                [0.385236, -0.44522002, -0.8083146],
                10.302511,
            ),
            ray(
                [0.7466884, 1.6771742, 2.068077],
                [-0.07547419, -0.47430304, -0.87712044],
                9.010362,
            ),
        ],
    );
    let d = [-0.11111111, -0.44444445, -0.8888889];
    assert_rays(
        "orthographic",
        &placed,
        [200, 100],
        &[
            ray([0.58543974, 2.2642975, 2.9084213], d, 9999.99),
            ray([1.7982235, 1.9059749, 2.9359846], d, 9999.99),
            ray([0.9988888, 1.9955555, 2.991111], d, 9999.99),
        ],
    );
    let scaled =
        format!("<transform name='to_world'><scale x='10' y='20' z='5'/>{LOOK}</transform>");
    assert_rays(
        "orthographic",
        &format!("{scaled}{clips}"),
        [200, 100],
        &[
            ray([-3.8554268, 5.152617, -3.5943804], d, 9.0),
            ray([8.492918, -2.0138345, -1.5546978], d, 9.0),
            ray([0.44444317, -0.22222137, -1.4444449], d, 9.0),
        ],
    );
    assert_rays(
        "orthographic",
        &scaled,
        [100, 200],
        &[
            ray([-4.2977047, 23.477135, -7.132604], d, 9999.99),
            ray([9.373677, -5.1886706, 5.4913754], d, 9999.99),
            ray([0.994443, 1.977782, 2.9555535], d, 9999.99),
        ],
    );
}

#[test]
fn meters_aim_as_in_mitsuba() {
    let aimed = |kind: &str, content: &str, i: usize| ray_of(&with_sensor(kind, content, 1, 1), i);
    let near = |a: Vec3, b: [f32; 3]| (a - Vec3::from_array(b)).length() < 1e-3;
    let placed = format!("<transform name='to_world'>{LOOK}</transform>");
    let turned = [-0.11111111, -0.44444445, -0.8888889];
    let direction = "<vector name='direction' x='0' y='1' z='-2'/>";
    let d = [0.0, 0.44721365, -0.8944273];

    let ray = aimed("radiancemeter", "", 0);
    assert!(near(ray.o, [0.0; 3]) && near(ray.d, [0.0, 0.0, 1.0]));
    let ray = aimed("radiancemeter", &placed, 0);
    assert!(near(ray.o, [1.0, 2.0, 3.0]) && near(ray.d, turned));
    let ray = aimed(
        "radiancemeter",
        &format!("<point name='origin' x='1' y='2' z='3'/>{direction}"),
        1,
    );
    assert!(near(ray.o, [1.0, 2.0, 3.0]) && near(ray.d, d));

    // All of the scene: its bounding sphere has the radius sqrt 12 (Mitsuba: 1 + 9e-5 times that) and its
    // rays begin where they may, so compare where they pass the middle.
    let passing = |ray: Ray| ray.o + ray.d * (Vec3::new(1.0, 2.0, 0.0) - ray.o).dot(ray.d);
    let ray = aimed("distant", "", 0);
    assert!(near(passing(ray), [2.0606184, -0.5605589, 0.0]) && near(ray.d, [0.0, 0.0, 1.0]));
    let ray = aimed("distant", &placed, 1);
    assert!(near(ray.d, turned));
    let offset = (passing(ray) - Vec3::new(1.0, 2.0, 0.0)).length();
    assert!((offset - 0.5 * 12f32.sqrt()).abs() < 1e-5, "{offset}");
    // A point and a shape; sqrt 12 twice before them.
    let ray = aimed(
        "distant",
        &format!("{direction}<point name='target' x='1' y='2' z='3'/>"),
        0,
    );
    assert!(
        near(ray.o, [1.0, -1.098664, 9.197328]) && near(ray.d, d),
        "{}",
        ray.o
    );
    let disk = format!("{direction}<shape name='target' type='disk'/>");
    // Which point of the disk is a matter of the map, but it is one of the disk.
    for i in 0..3 {
        let ray = aimed("distant", &disk, i);
        let p = ray.o + ray.d * (2.0 * 12f32.sqrt());
        assert!(
            near(ray.d, d) && p.z.abs() < 1e-5 && p.length() <= 1.0,
            "{p}"
        );
    }
}

#[test]
fn radius_0_is_the_pinhole_bit_for_bit() {
    let xml =
        include_str!("../scenes/cornell-balls.xml").replace(r#"value="512""#, r#"value="24""#);
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

//! Rays of cameras and meters as measured with Mitsuba.

use crate::film;
use crate::render::compile;
use luxel::format::Compiled;
use luxel::geom::Ray;
use luxel::math::{Vec2, Vec3};
use luxel::scene::CameraSample;

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

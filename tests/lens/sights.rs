//! Points of the scene as cameras see them: what light tracing asks is what camera rays answer.

use crate::film;
use crate::render::compile;
use crate::rng::Rng;
use luxel::format::Compiled;
use luxel::math::{Vec2, Vec3};
use luxel::scene::camera::Sight;
use luxel::scene::{Camera, CameraSample};

const LOOK: &str = "<lookat origin='1, 2, 3' target='0.5, 0, -1' up='0, 1, 0'/>";
const WIDTH: u32 = 200;
const HEIGHT: u32 = 100;

fn sensor(kind: &str, content: &str) -> Compiled {
    compile(&format!(
        r#"<scene version="3.0.0">
            <shape type="sphere"><point name="center" x="1" y="2" z="0"/><float name="radius" value="2"/></shape>
            <sensor type="{kind}">{content}{}</sensor>
        </scene>"#,
        film(WIDTH, HEIGHT)
    ))
}

/// One of each kind, with whatever changes its rays.
fn cameras() -> Vec<(&'static str, Compiled)> {
    let placed = format!("<transform name='to_world'>{LOOK}</transform>");
    let skewed = format!(
        "<transform name='to_world'><scale x='4' y='6' z='5'/>{LOOK}<scale x='1' y='2' z='1'/></transform>"
    );
    let moving = "<animation name='to_world'>
        <transform time='0'><lookat origin='1, 2, 3' target='0.5, 0, -1' up='0, 1, 0'/></transform>
        <transform time='1'><lookat origin='0, 3, 3' target='0.3, 0, -1' up='0.3, 1, 0'/></transform>
    </animation><float name='shutter_close' value='1'/>";
    let clips = "<float name='near_clip' value='0.7'/><float name='far_clip' value='20'/>";
    let wide = "<float name='fov' value='100'/>";
    let lens =
        "<float name='aperture_radius' value='0.3'/><float name='focus_distance' value='5'/>";
    let blades =
        "<integer name='aperture_blades' value='5'/><float name='blade_rotation' value='20'/>";
    let shifted = "<float name='principal_point_offset_x' value='0.1'/>
        <float name='principal_point_offset_y' value='-0.2'/>";
    let all = [
        ("perspective", format!("{placed}{wide}{clips}")),
        (
            "perspective",
            format!("{placed}{shifted}<float name='fov' value='5'/>{clips}"),
        ),
        ("perspective", format!("{moving}{wide}{clips}")),
        ("thinlens", format!("{placed}{lens}{clips}")),
        ("thinlens", format!("{placed}{lens}{wide}{blades}{clips}")),
        ("thinlens", format!("{moving}{lens}{clips}")),
        ("orthographic", format!("{placed}{clips}")),
        ("orthographic", format!("{skewed}{clips}")),
        ("orthographic", format!("{moving}{clips}")),
    ];
    all.into_iter()
        .map(|(kind, content)| (kind, sensor(kind, &content)))
        .collect()
}

fn random_sample(rng: &mut Rng) -> CameraSample {
    CameraSample {
        film: rng.vec2() * Vec2::new(WIDTH as f32, HEIGHT as f32),
        lens: rng.vec2(),
        time: rng.f32(),
    }
}

/// As close as the coordinates of the point, at some hundred parts per 2^24, tell.
fn assert_same(kind: &str, camera: &Camera, at: &CameraSample, share: f32) {
    let ray = camera.ray(at).ray;
    let p = ray.o + ray.d * (ray.t_max * share);
    let sight = camera.connect(p, at.time, at.lens, 0.0);
    // Within rounding of the picture's edge it may be lost.
    let size = Vec2::new(WIDTH as f32, HEIGHT as f32);
    let inside = at.film.cmpgt(Vec2::splat(1e-3)).all() && at.film.cmplt(size - 1e-3).all();
    let Some(sight) = sight else {
        assert!(!inside, "{kind}: {at:?} is lost");
        return;
    };
    let off = (sight.film - at.film).abs().max_element();
    assert!(off < 1e-3, "{kind}: {off} pixels off at {at:?}, {share}");
    assert!((sight.wi + ray.d).length() < 1e-5, "{kind}: {}", sight.wi);
    let end = (sight.end.p - ray.o).length();
    assert!(
        end < 1e-5 * (1.0 + p.length()),
        "{kind}: {end} from the near plane"
    );
    let met = camera.importance(p, ray.d, at.time);
    let ratio = met / sight.importance;
    assert!((ratio - 1.0).abs() < 1e-4, "{kind}: importance {ratio}");
}

#[test]
fn points_of_a_camera_ray_are_seen_where_it_began() {
    for (kind, compiled) in cameras() {
        let camera = &compiled.job.camera;
        assert!(camera.can_be_connected(), "{kind}");
        let mut rng = Rng::new(11);
        for _ in 0..2000 {
            let at = random_sample(&mut rng);
            let share = 0.02 + 0.97 * rng.f32();
            assert_same(kind, camera, &at, share);
        }
    }
}

#[test]
fn points_before_the_near_and_behind_the_far_plane_are_not_seen() {
    for (kind, compiled) in cameras() {
        let camera = &compiled.job.camera;
        let mut rng = Rng::new(12);
        for _ in 0..500 {
            let at = random_sample(&mut rng);
            let ray = camera.ray(&at).ray;
            for t in [-1e-3, -0.5, 1.0 + 1e-4, 3.0] {
                let p = ray.o + ray.d * (t * ray.t_max);
                let sight = camera.connect(p, at.time, at.lens, 0.0);
                assert!(sight.is_none(), "{kind}: {t} of the ray: {sight:?}");
            }
        }
    }
}

#[test]
fn a_margin_around_the_picture_is_seen_if_asked_for() {
    for (kind, compiled) in cameras() {
        let camera = &compiled.job.camera;
        let at = CameraSample::central(Vec2::new(-1.5, HEIGHT as f32 + 1.5));
        let ray = camera.ray(&at).ray;
        let p = ray.o + ray.d * (0.5 * ray.t_max);
        let seen = |margin| camera.connect(p, at.time, at.lens, margin).is_some();
        assert!(!seen(0.0) && !seen(1.4) && seen(1.6), "{kind}");
    }
}

/// A window of the picture, as seen on a plane: the area that importance gives to what the plane shows of it.
fn area_on_a_plane(camera: &Camera, lens: Vec2, time: f32, lo: Vec2, hi: Vec2) -> f64 {
    let ray_at = |film| camera.ray(&CameraSample { film, lens, time }).ray;
    let middle = ray_at(0.5 * (lo + hi));
    let center = middle.o + middle.d * (0.2 * middle.t_max);
    let normal = (Vec3::new(0.2, -0.1, 0.3) - middle.d).normalize();
    let (s, t) = normal.any_orthonormal_pair();
    // Around where the corners of the window are on the plane.
    let mut bounds = [Vec2::splat(f32::MAX), Vec2::splat(f32::MIN)];
    for film in [lo, hi, Vec2::new(lo.x, hi.y), Vec2::new(hi.x, lo.y)] {
        let ray = ray_at(film);
        let p = ray.o + ray.d * ((center - ray.o).dot(normal) / ray.d.dot(normal)) - center;
        let on_plane = Vec2::new(p.dot(s), p.dot(t));
        bounds = [bounds[0].min(on_plane), bounds[1].max(on_plane)];
    }
    const N: u32 = 600;
    let cell = (bounds[1] - bounds[0]) / N as f32;
    let weight = |sight: &Sight| {
        let inside = sight.film.cmpge(lo).all() && sight.film.cmplt(hi).all();
        match inside {
            true => f64::from(sight.importance * sight.wi.dot(normal).abs()),
            false => 0.0,
        }
    };
    let mut sum = 0.0;
    for i in 0..N * N {
        let at = bounds[0] + cell * Vec2::new((i % N) as f32 + 0.5, (i / N) as f32 + 0.5);
        let p = center + s * at.x + t * at.y;
        sum += camera
            .connect(p, time, lens, 0.0)
            .as_ref()
            .map_or(0.0, weight);
    }
    sum * f64::from(cell.x * cell.y)
}

#[test]
fn importance_over_a_plane_is_the_area_of_the_picture() {
    let (lo, hi) = (Vec2::new(20.0, 10.0), Vec2::new(170.0, 60.0));
    let area = f64::from((hi.x - lo.x) * (hi.y - lo.y));
    for (kind, compiled) in cameras() {
        let sum = area_on_a_plane(&compiled.job.camera, Vec2::new(0.9, 0.2), 0.7, lo, hi);
        let ratio = sum / area;
        assert!((ratio - 1.0).abs() < 1e-3, "{kind}: {ratio}");
    }
}

#[test]
fn meters_cannot_be_connected() {
    for kind in ["radiancemeter", "distant"] {
        let compiled = compile(&format!(
            r#"<scene version="3.0.0"><shape type="sphere"/><sensor type="{kind}">{}</sensor></scene>"#,
            film(1, 1)
        ));
        let camera = &compiled.job.camera;
        assert!(!camera.can_be_connected());
        assert!(
            camera
                .connect(Vec3::X, 0.0, Vec2::splat(0.5), 1.0)
                .is_none()
        );
        assert_eq!(camera.importance(Vec3::X, Vec3::Z, 0.0), 0.0);
    }
}

/// Whatever the point: what is seen has finite numbers.
#[test]
fn nothing_seen_is_infinite() {
    let ends = [
        0.0,
        -1.0,
        1e-30,
        1e-12,
        1.0,
        1e12,
        1e30,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
    ];
    for (kind, compiled) in cameras() {
        let camera = &compiled.job.camera;
        for p in (0..1000).map(|i| Vec3::new(ends[i % 10], ends[i / 10 % 10], ends[i / 100])) {
            for lens in [Vec2::ZERO, Vec2::splat(1.0 - f32::EPSILON / 2.0)] {
                let Some(sight) = camera.connect(p, 0.3, lens, 2.0) else {
                    continue;
                };
                let Sight {
                    film,
                    wi,
                    end,
                    importance,
                } = sight;
                let finite =
                    film.is_finite() && end.p.is_finite() && (wi.length() - 1.0).abs() < 1e-5;
                assert!(
                    finite && importance > 0.0 && importance.is_finite(),
                    "{kind} {p}: {sight:?}"
                );
            }
        }
    }
}

//! Maps that move over the shutter, and cameras that do.

mod common;
#[path = "common/render.rs"]
mod render;

use common::Rng;
use luxel::film::Film;
use luxel::math::{Aabb, DVec3, Motion, Transform, Vec3};

fn translate(x: f64, y: f64, z: f64) -> Transform {
    Transform::translate(DVec3::new(x, y, z))
}

fn rotate(axis: DVec3, degrees: f64) -> Transform {
    Transform::rotate(axis, degrees).unwrap()
}

fn scale(x: f64, y: f64, z: f64) -> Transform {
    Transform::scale(DVec3::new(x, y, z)).unwrap()
}

/// Largest difference of two maps, entry by entry.
fn distance(a: &Transform, b: &Transform) -> f64 {
    let (a, b) = (a.matrix().to_cols_array(), b.matrix().to_cols_array());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[track_caller]
fn assert_near(found: &Transform, expected: &Transform) {
    let d = distance(found, expected);
    assert!(
        d < 1e-12,
        "{:?} {:?}: {d}",
        found.matrix(),
        expected.matrix()
    );
    let undone = *found * found.inverse();
    assert!(distance(&undone, &Transform::IDENTITY) < 1e-12);
}

#[test]
fn what_does_not_move_is_still() {
    let (a, b) = (rotate(DVec3::X, 30.0), translate(1.0, 2.0, 3.0));
    let still = |keys: &[(f64, Transform)], shutter| {
        let motion = Motion::new(keys, shutter).unwrap();
        motion.as_still().copied()
    };
    assert_eq!(Motion::still(a).as_still(), Some(&a));
    assert_eq!(still(&[(5.0, a)], [0.0, 1.0]), Some(a));
    assert_eq!(still(&[(0.0, a), (0.4, a), (1.0, a)], [0.0, 1.0]), Some(a));
    // Before the first key, after the last, and between equal ones.
    assert_eq!(still(&[(2.0, a), (3.0, b)], [0.0, 1.0]), Some(a));
    assert_eq!(still(&[(2.0, a), (3.0, b)], [0.0, 2.0]), Some(a));
    assert_eq!(still(&[(2.0, a), (3.0, b)], [3.0, 4.0]), Some(b));
    assert_eq!(still(&[(2.0, a), (3.0, b)], [3.5, 4.0]), Some(b));
    assert_eq!(
        still(&[(0.0, b), (1.0, a), (2.0, a), (3.0, b)], [1.0, 2.0]),
        Some(a)
    );
    assert_eq!(still(&[(0.0, a), (1.0, b)], [0.1, 1.0]), None);
    // An instantaneous shutter, at a key and between two.
    assert_eq!(still(&[(0.0, a), (1.0, b)], [0.0, 0.0]), Some(a));
    assert_eq!(still(&[(0.0, a), (1.0, b)], [1.0, 1.0]), Some(b));
    assert_eq!(still(&[(0.0, a), (1.0, b)], [9.0, 9.0]), Some(b));
    let between = still(&[(0.0, a), (4.0, b)], [1.0, 1.0]).unwrap();
    assert_near(
        &between,
        &(translate(0.25, 0.5, 0.75) * rotate(DVec3::X, 22.5)),
    );
}

#[test]
fn keys_that_cannot_be_followed_are_refused() {
    let (a, b) = (Transform::IDENTITY, translate(1.0, 0.0, 0.0));
    let refused = |keys: &[(f64, Transform)], shutter| Motion::new(keys, shutter).is_none();
    assert!(refused(&[], [0.0, 1.0]));
    assert!(refused(&[(1.0, a), (1.0, b)], [0.0, 1.0]));
    assert!(refused(&[(1.0, a), (0.0, b)], [0.0, 1.0]));
    assert!(refused(&[(f64::NAN, a)], [0.0, 1.0]));
    assert!(refused(&[(0.0, a), (f64::INFINITY, b)], [0.0, 1.0]));
    assert!(refused(&[(0.0, a), (1.0, b)], [1.0, 0.0]));
    assert!(refused(&[(0.0, a), (1.0, b)], [f64::NAN, 0.0]));
    // Half way, this one would be flat.
    assert!(refused(
        &[(0.0, a), (1.0, scale(-1.0, 1.0, 1.0))],
        [0.0, 1.0]
    ));
}

#[test]
fn each_part_moves_in_its_own_way() {
    let axis = DVec3::new(1.0, 2.0, -2.0);
    let map = |t: f64| {
        translate(1.0 + 4.0 * t, -t, 2.0)
            * rotate(axis, 20.0 + 100.0 * t)
            * scale(1.0 + t, 2.0 - t, 0.5)
    };
    // Scene times 2 and 4, shutter from 2.5 to 3.5: a quarter to three quarters of the way.
    let motion = Motion::new(&[(2.0, map(0.0)), (4.0, map(1.0))], [2.5, 3.5]).unwrap();
    assert!(motion.as_still().is_none());
    for time in [0.0f32, 0.25, 0.5, 1.0] {
        assert_near(&motion.at(time), &map(0.25 + 0.5 * f64::from(time)));
    }
    // Three keys, the shutter longer than they last: constant at both ends.
    let keys = [(0.0, map(0.0)), (1.0, map(0.5)), (2.0, map(0.0))];
    let motion = Motion::new(&keys, [-1.0, 3.0]).unwrap();
    for (time, share) in [
        (0.0f32, 0.0),
        (0.25, 0.0),
        (0.375, 0.25),
        (0.5, 0.5),
        (0.625, 0.25),
        (1.0, 0.0),
    ] {
        assert_near(&motion.at(time), &map(share));
    }
}

#[test]
fn rotations_take_the_shorter_way() {
    let turn = |degrees: f64| rotate(DVec3::Y, degrees);
    let half = |a: f64, b: f64| {
        let keys = [(0.0, turn(a)), (1.0, turn(b))];
        Motion::new(&keys, [0.0, 1.0]).unwrap().at(0.5)
    };
    assert_near(&half(0.0, 90.0), &turn(45.0));
    assert_near(&half(0.0, 270.0), &turn(-45.0));
    assert_near(&half(350.0, 10.0), &turn(0.0));
    assert_near(&half(100.0, 279.0), &turn(189.5));
    // Too small for the cosine of the angle to show.
    let tiny = half(0.0, 1e-9).vector(DVec3::Z).x;
    assert!((tiny - (0.5e-9f64).to_radians()).abs() < 1e-18, "{tiny}");
    // Half a turn: either way round, but at constant speed.
    let quarter = half(0.0, 180.0).vector(DVec3::Z);
    assert!(
        (quarter.x.abs() - 1.0).abs() < 1e-12 && quarter.y.abs() < 1e-12,
        "{quarter}"
    );
}

#[test]
fn mirrors_and_shears_stay_what_they_are() {
    let shear = Transform::from_rows([
        [1.0, 0.7, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.2, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ])
    .unwrap();
    for inner in [
        scale(-1.0, 1.0, 1.0),
        scale(-2.0, 3.0, 1e-3),
        shear,
        shear * scale(1.0, 1.0, -1e4),
    ] {
        // A rotation from the left commutes with the interpolation.
        let map = |t: f64| translate(0.0, t, 0.0) * rotate(DVec3::X, 80.0 * t) * inner;
        let motion = Motion::new(&[(0.0, map(0.0)), (1.0, map(1.0))], [0.0, 1.0]).unwrap();
        for time in [0.0f32, 0.3, 0.5, 1.0] {
            let (found, expected) = (motion.at(time), map(f64::from(time)));
            let size = inner
                .matrix()
                .matrix3
                .to_cols_array()
                .iter()
                .fold(0.0f64, |m, x| m.max(x.abs()));
            let d = distance(&found, &expected);
            assert!(d < 1e-12 * size, "{inner:?} at {time}: {d}");
            assert_eq!(found.swaps_handedness(), inner.swaps_handedness());
        }
    }
}

fn random_transform(rng: &mut Rng, mirrored: bool) -> Transform {
    let mut signed = |size: f64| size * (2.0 * f64::from(rng.f32()) - 1.0);
    let place = translate(signed(10.0), signed(10.0), signed(10.0));
    let axis = DVec3::new(signed(1.0), signed(1.0), signed(1.0) + 1e-3);
    let turn = rotate(axis, signed(400.0));
    let stretch = scale(signed(2.0).exp(), signed(2.0).exp(), signed(2.0).exp());
    let other = rotate(DVec3::new(1.0, signed(1.0), signed(1.0)), signed(180.0));
    let mirror = scale(if mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
    place * turn * stretch * other * mirror
}

/// Two to four keys at random times around [0, 1].
fn random_motion(rng: &mut Rng) -> Motion {
    let mirrored = rng.f32() < 0.5;
    let only_translation = rng.f32() < 0.2;
    let first = random_transform(rng, mirrored);
    let mut time = -0.5;
    let keys: Vec<_> = (0..2 + (3.0 * rng.f32()) as usize)
        .map(|_| {
            time += 0.1 + 0.9 * f64::from(rng.f32());
            let key = match only_translation {
                true => translate(f64::from(rng.f32()), 5.0 * f64::from(rng.f32()), 0.0) * first,
                false => random_transform(rng, mirrored),
            };
            (time, key)
        })
        .collect();
    let motion = Motion::new(&keys, [0.0, 1.0]).unwrap();
    match (4.0 * rng.f32()) as u32 {
        0 => motion.prepend(&random_transform(rng, false)),
        1 => motion.append(&random_transform(rng, true)),
        _ => motion,
    }
}

#[test]
fn bounds_hold_all_and_little_more() {
    let mut rng = Rng::new(5);
    let mut waste = 0.0f32;
    for trial in 0..300 {
        let motion = random_motion(&mut rng);
        let size = 10f32.powf(6.0 * rng.f32() - 3.0);
        let corner = |rng: &mut Rng| size * (Vec3::new(rng.f32(), rng.f32(), rng.f32()) - 0.5);
        let mut local = Aabb::EMPTY;
        for _ in 0..2 {
            local.grow(corner(&mut rng));
        }
        let (a, b) = (rng.f32(), rng.f32());
        let (t0, t1) = (a.min(b), a.max(b));
        let bounds = motion.bounds(local, t0, t1);
        // What is really covered, as seen at many times.
        let mut seen = Aabb::EMPTY;
        for i in 0..=400 {
            let map = motion.at(t0 + (t1 - t0) * (i as f32 / 400.0));
            for k in 0..9 {
                let pick = |lo: f32, hi: f32, bit: u32| if k >> bit & 1 == 0 { lo } else { hi };
                let x = match k {
                    8 => local.center(),
                    _ => Vec3::new(
                        pick(local.min.x, local.max.x, 0),
                        pick(local.min.y, local.max.y, 1),
                        pick(local.min.z, local.max.z, 2),
                    ),
                };
                let p = map.point(x.as_dvec3());
                let inside = |p: f64, lo: f32, hi: f32| f64::from(lo) <= p && p <= f64::from(hi);
                assert!(
                    inside(p.x, bounds.min.x, bounds.max.x)
                        && inside(p.y, bounds.min.y, bounds.max.y)
                        && inside(p.z, bounds.min.z, bounds.max.z),
                    "trial {trial}: {p} outside of {bounds:?}"
                );
                seen.grow(p.as_vec3());
            }
        }
        let size = seen.diagonal().max_element();
        waste = waste.max((bounds.diagonal() - seen.diagonal()).max_element() / size);
    }
    // Of random motions, which stretch wildly while they turn.
    assert!(waste < 0.06, "{waste}");
    assert!(
        Motion::still(Transform::IDENTITY)
            .bounds(Aabb::EMPTY, 0.0, 1.0)
            .is_empty()
    );
}

#[test]
fn motions_compose() {
    let mut rng = Rng::new(6);
    for _ in 0..50 {
        let motion = random_motion(&mut rng);
        let other = random_transform(&mut rng, false);
        for time in [0.0, 0.4, 1.0] {
            let x = DVec3::new(0.3, -0.2, 0.5);
            let near = |a: DVec3, b: DVec3| (a - b).length() < 1e-11 * (1.0 + b.length());
            let at = motion.at(time);
            assert!(near(
                motion.prepend(&other).at(time).point(x),
                other.point(at.point(x))
            ));
            assert!(near(
                motion.append(&other).at(time).point(x),
                at.point(other.point(x))
            ));
            assert!(near(at.inverse().point(at.point(x)), x));
        }
    }
}

/// A small ball of light at distance 4 on the z axis, seen from the origin by a camera whose `to_world` is
/// `moving`.
fn ball_of_light(sensor: &str, moving: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
            <integrator type="path"><integer name="max_depth" value="1"/></integrator>
            <sensor type="{sensor}"{moving}
                <film type="hdrfilm">
                    <integer name="width" value="64"/><integer name="height" value="16"/>
                    <rfilter type="box"/>
                </film>
            </sensor>
            <shape type="sphere"><point name="center" x="0" y="0" z="4"/><float name="radius" value="{RADIUS}"/>
                <emitter type="area"><rgb name="radiance" value="1000"/></emitter>
            </shape>
        </scene>"#
    )
}

const RADIUS: f64 = 0.1;

/// Sum of the light, and mean and variance of its place along x, in pixels.
fn streak(xml: &str) -> [f64; 3] {
    let (film, _): (Film, _) = render::render(&render::compile(xml), 2048);
    let picture = film.mean();
    let sum: f64 = picture.iter().map(|p| p[0]).sum();
    let mean_of = |f: &dyn Fn(f64) -> f64| {
        let terms = picture.iter().enumerate();
        terms
            .map(|(i, p)| p[0] * f((i % 64) as f64 + 0.5))
            .sum::<f64>()
            / sum
    };
    let mean = mean_of(&|x| x);
    [sum, mean, mean_of(&|x| (x - mean).powi(2))]
}

#[track_caller]
fn assert_streak(found: [f64; 3], expected: [f64; 3]) {
    let near = |i: usize, share: f64| (found[i] / expected[i] - 1.0).abs() < share;
    let good = near(0, 0.01) && (found[1] - expected[1]).abs() < 0.1 && near(2, 0.01);
    assert!(good, "{found:?} {expected:?}");
}

#[test]
fn a_moving_camera_draws_a_straight_streak() {
    let animation = r#"><float name="shutter_open" value="2"/><float name="shutter_close" value="4"/>
        <animation name="to_world">
            <transform time="0"><translate x="-3"/></transform>
            <transform time="6"><translate x="3"/></transform>
        </animation>"#;
    // Over the shutter the camera goes from -1 to 1; +x is to the left, so the light goes right.
    let (pixel, own) = (2.0 / 64.0, RADIUS * RADIUS / 4.0);
    let xml = ball_of_light("orthographic", animation);
    let light = 1000.0 * std::f64::consts::PI * RADIUS * RADIUS / (pixel * pixel);
    // From -0.5 to 0.75: the light stays within the picture.
    let xml = xml.replace(r#"open" value="2"#, r#"open" value="2.5"#);
    let xml = xml.replace(r#"close" value="4"#, r#"close" value="3.75"#);
    let variance = (1.25f64.powi(2) / 12.0 + own) / (pixel * pixel) + 1.0 / 12.0;
    assert_streak(streak(&xml), [light, 32.0 + 0.125 / pixel, variance]);

    // The same from a pinhole: at depth 4 the picture is 8 tan wide.
    let fov = r#"><float name="fov" value="40"/>"#;
    let xml = ball_of_light("perspective", &animation.replacen('>', fov, 1));
    let pixel = 8.0 * 20f64.to_radians().tan() / 64.0;
    let [_, mean, variance] = streak(&xml);
    assert!((mean - 32.0).abs() < 0.1, "{mean}");
    let expected = (4.0 / 12.0 + own) / (pixel * pixel) + 1.0 / 12.0;
    assert!(
        (variance / expected - 1.0).abs() < 0.01,
        "{variance} {expected}"
    );
}

/// Turning by a constant rate, the light is at `tan a` of unit depth, where its image is larger by
/// `1 / cos^3 a` than straight ahead.
#[test]
fn a_turning_camera_draws_a_streak_of_tangents() {
    let (a, b) = ((-5f64).to_radians(), 20f64.to_radians());
    let animation = r#"><float name="fov" value="60"/><float name="shutter_close" value="1"/>
        <animation name="to_world">
            <transform time="0"><rotate y="1" angle="-5"/></transform>
            <transform time="1"><rotate y="1" angle="20"/></transform>
        </animation>"#;
    let xml = ball_of_light("perspective", animation);
    let found = streak(&xml);
    // Moments of tan over the angle with weight 1 / cos^3, by Simpson's rule.
    let n = 1000;
    let moment = |f: &dyn Fn(f64) -> f64| {
        let term = |i: i32| {
            let weight = match i {
                0 => 1.0,
                i if i == n => 1.0,
                i if i % 2 == 1 => 4.0,
                _ => 2.0,
            };
            let angle: f64 = a + (b - a) * f64::from(i) / f64::from(n);
            weight * f(angle.tan()) / angle.cos().powi(3)
        };
        (0..=n).map(term).sum::<f64>() / (3.0 * f64::from(n))
    };
    let pixel = 2.0 * 30f64.to_radians().tan() / 64.0;
    let sin = RADIUS / 4.0;
    let solid_angle = 2.0 * std::f64::consts::PI * (1.0 - (1.0 - sin * sin).sqrt());
    let weight = moment(&|_| 1.0);
    let mean = moment(&|t| t) / weight;
    let variance = moment(&|t| (t - mean).powi(2)) / weight;
    // Turned to the left (+x), it sees the light on the right.
    let expected = [
        1000.0 * solid_angle * weight / (pixel * pixel),
        32.0 + mean / pixel,
        (variance + sin * sin / 4.0) / (pixel * pixel) + 1.0 / 12.0,
    ];
    assert_streak(found, expected);
}

#[test]
fn equal_keyframes_are_the_still_camera_bit_for_bit() {
    let scene =
        include_str!("../scenes/cornell-balls.xml").replace(r#"value="512""#, r#"value="16""#);
    let (start, end) = (
        scene.find("<transform name=\"to_world\">").unwrap(),
        "</transform>",
    );
    let end = start + scene[start..].find(end).unwrap() + end.len();
    let still = &scene[start..end];
    let shutter = |moving: &str| {
        let open =
            r#"<float name="shutter_open" value="1"/><float name="shutter_close" value="3"/>"#;
        scene.replacen(still, &format!("{open}{moving}"), 1)
    };
    let key = |time: f64, more: &str| {
        let steps = still
            .replace("<transform name=\"to_world\">", "")
            .replace("</transform>", more);
        format!("<transform time=\"{time}\">{steps}</transform>")
    };
    let picture = |xml: &str| render::picture(xml, 8, 0);
    let expected = picture(&scene);
    let same = format!(
        "<animation name=\"to_world\">{}{}</animation>",
        key(0.0, ""),
        key(2.0, "")
    );
    assert!(picture(&shutter(still)) == expected);
    assert!(picture(&shutter(&same)) == expected);
    let moved = key(2.0, "<translate x=\"0.1\"/>");
    let moving = format!(
        "<animation name=\"to_world\">{}{moved}</animation>",
        key(0.0, "")
    );
    assert!(picture(&shutter(&moving)) != expected);
    // Closed at once, it is a photograph of the moment.
    let at_once = scene.replacen(still, &moving, 1);
    assert!(picture(&at_once) == expected);
}

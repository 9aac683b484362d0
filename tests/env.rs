//! The image environment against figures measured with Mitsuba 3.9.1, its density and its mean.

mod common;
mod directions;

use common::Rng;
use directions::DirectionCheck;
use luxel::light::{EnvError, EnvMap};
use luxel::math::{DVec3, Rgb, Transform, Vec2, Vec3, warp};
use std::f64::consts::PI;

/// 5 x 4 pixels of one bright spot among noise, and its radiance in Mitsuba's `envmap`.
const WIDTH: usize = 5;
const HEIGHT: usize = 4;
#[rustfmt::skip]
const PIXELS: [[f32; 3]; WIDTH * HEIGHT] = [
    [0.5118216, 0.9504637, 0.14415961], [0.94864947, 0.31183144, 0.42332646], [0.8277026, 0.40919915, 0.5495937], [0.027559113, 0.7535131, 0.53814334], [0.3297317, 0.7884287, 0.30319482],
    [0.4534979, 0.1340417, 0.40311298], [0.20345524, 0.26231334, 0.75036466], [20.0, 20.0, 20.0], [0.9616572, 0.7247899, 0.54122686], [0.2768912, 0.16065201, 0.9699254],
    [0.5160686, 0.11586561, 0.62348974], [0.7766831, 0.6130033, 0.9172977], [0.039592877, 0.52858925, 0.4593359], [0.06234958, 0.64132816, 0.8526328], [0.59294105, 0.26009744, 0.83988154],
    [0.50949585, 0.5108889, 0.7530302], [0.14792204, 0.8196268, 0.6832869], [0.787097, 0.19161625, 0.8023642], [0.19132392, 0.08155262, 0.855227], [0.8612835, 0.8765371, 0.47190973],
];

fn map(to_world: &Transform, scale: f32) -> EnvMap {
    let pixels = PIXELS.map(Rgb::from_array).to_vec();
    EnvMap::new(pixels, WIDTH, HEIGHT, to_world, scale).unwrap()
}

#[test]
fn radiance_is_that_of_mitsuba() {
    let turned = Transform::rotate(DVec3::new(0.0, 0.6, 0.8), 40.0).unwrap();
    let mirrored = Transform::scale(DVec3::new(-1.0, 1.0, 1.0)).unwrap();
    let id = Transform::IDENTITY;
    let rows = [
        (id, 1.0, [0.0, 0.0, 1.0], [10.019796, 10.264295, 10.229668]),
        (id, 1.0, [-1e-6, 0.0, 1.0], [10.019792, 10.26429, 10.229663]),
        (
            id,
            1.0,
            [0.0, 0.0, -1.0],
            [0.4598497, 0.16766419, 0.7091024],
        ),
        (
            id,
            1.0,
            [1e-6, 0.0, -1.0],
            [0.45984975, 0.16766413, 0.709102],
        ),
        (
            id,
            1.0,
            [1e-4, 1.0, 0.0],
            [0.8394425, 0.47148952, 0.35353476],
        ),
        (
            turned,
            2.5,
            [0.3, -0.5, 0.6],
            [0.2943188, 1.2800406, 1.5381056],
        ),
        (
            mirrored,
            1.0,
            [0.3, -0.5, 0.6],
            [0.10596983, 0.5233827, 0.62872225],
        ),
    ];
    for (to_world, scale, d, expected) in rows {
        let le = map(&to_world, scale).eval(Vec3::from(d).normalize());
        for k in 0..3 {
            let gap = (le[k] / expected[k] - 1.0).abs();
            assert!(gap < 1e-4, "{d:?}: {le:?} and not {expected:?}");
        }
    }
}

#[test]
fn directions_follow_their_density() {
    let maps = [
        map(&Transform::rotate(DVec3::X, 50.0).unwrap(), 1.0),
        // Most light next to one pole and along one column.
        EnvMap::new(
            (0..16 * 8)
                .map(|i| Rgb::splat(if i < 16 || i % 16 == 9 { 3.0 } else { 0.1 }))
                .collect(),
            16,
            8,
            &Transform::IDENTITY,
            1.0,
        )
        .unwrap(),
    ];
    for map in &maps {
        let check = DirectionCheck {
            name: "environment",
            alpha: 0.005,
            axis: Vec3::Y,
            sin2: 1.0,
        };
        check.run(
            |rng| map.sample(rng.vec2()).map(|(d, _, pdf)| (d, pdf)),
            |_| true,
        );
    }
}

#[test]
fn density_integrates_to_one_and_the_mean_is_right() {
    let map = map(&Transform::IDENTITY, 1.0);
    let mut rng = Rng::new(1);
    let n = 600;
    let (mut pdf, mut mean) = (0.0, 0.0);
    let mut estimate = 0.0;
    for i in 0..n * n {
        let cell = Vec2::new((i % n) as f32, (i / n) as f32);
        let u = (cell + rng.vec2()) / n as f32;
        let d = warp::uniform_sphere(u.min(Vec2::splat(1.0 - f32::EPSILON)));
        pdf += map.pdf(d) as f64 * 4.0 * PI;
        mean += map.eval(d).g as f64;
        let (_, le, density) = map.sample(rng.vec2()).unwrap();
        estimate += (le.g / density) as f64 / (4.0 * PI);
    }
    let n = (n * n) as f64;
    assert!((pdf / n - 1.0).abs() < 1e-3, "{}", pdf / n);
    let gap = estimate / mean - 1.0;
    assert!(gap.abs() < 2e-3, "{gap}");
}

#[test]
fn a_sun_of_1e12_and_single_pixels_are_sampled_soundly() {
    for (width, height) in [(1, 1), (1, 2), (2, 1), (3, 300), (1000, 2)] {
        let mut pixels = vec![Rgb::splat(1e-6); width * height];
        pixels[width * height / 2] = Rgb::splat(1e6);
        pixels[0] = Rgb::new(-1.0, 0.0, 2.0);
        let map = EnvMap::new(pixels, width, height, &Transform::IDENTITY, 1.0).unwrap();
        let mut rng = Rng::new(2);
        for i in 0..20_000 {
            let u = match i {
                0 => Vec2::ZERO,
                1 => Vec2::splat(1.0 - f32::EPSILON / 2.0),
                _ => rng.vec2(),
            };
            let (d, le, pdf) = map.sample(u).unwrap();
            assert!(pdf > 0.0 && pdf.is_finite() && (d.length() - 1.0).abs() < 1e-5);
            assert!(le.min_component() >= 0.0 && le.is_finite());
            // The ratio never exceeds what the brightest colour has per unit of luminance.
            assert!(le.max_component() as f64 / pdf as f64 <= map.integral() * 14.0);
        }
    }
    let black = EnvMap::new(vec![Rgb::BLACK; 6], 3, 2, &Transform::IDENTITY, 1.0).unwrap();
    assert!(black.sample(Vec2::splat(0.5)).is_none());
    assert_eq!(black.pdf(Vec3::X), 0.0);
}

#[test]
fn images_that_are_no_environment_are_refused() {
    let id = Transform::IDENTITY;
    let e = EnvMap::new(vec![Rgb::WHITE; 5], 3, 2, &id, 1.0).unwrap_err();
    assert_eq!(e.to_string(), "5 pixels for an image of 3 x 2");
    let mut pixels = vec![Rgb::WHITE; 6];
    pixels[4].g = f32::NAN;
    let e = EnvMap::new(pixels, 3, 2, &id, 1.0).unwrap_err();
    assert_eq!(e, EnvError::NotFinite { x: 1, y: 1 });
    let stretched = Transform::scale(DVec3::new(1.0, 2.0, 1.0)).unwrap();
    let e = EnvMap::new(vec![Rgb::WHITE; 6], 3, 2, &stretched, 1.0).unwrap_err();
    assert_eq!(e, EnvError::NotRigid);
}

//! The ends of the range: lights of next to no size, scenes of next to no size and huge ones, and lights
//! beside which others are next to nothing.

use crate::common::{Rng, Running};
use crate::shapes::scale;
use crate::stages::{Stage, area, numbers};
use luxel::geom::{Geometry, Mesh, Sphere, World};
use luxel::light::{Aim, EmissionNumbers, Emitter, Source, Target};
use luxel::math::{DVec3, Rgb, Transform, Vec2, Vec3};
use std::f64::consts::PI;

fn rectangle(p: [f64; 3], size: f64) -> Geometry {
    let t = Transform::translate(DVec3::from(p)) * scale(size, size, size);
    Geometry::Mesh(Mesh::rectangle(&t, false))
}

fn ball(p: [f64; 3], size: f64) -> Geometry {
    let t = Transform::translate(DVec3::from(p)) * scale(size, size, size);
    Geometry::Sphere(Sphere::new(t, false).unwrap())
}

fn mean_power(stage: &Stage, aim: &Aim, n: usize) -> Running {
    let mut rng = Rng::new(41);
    let mut sum = Running::default();
    for _ in 0..n {
        let u = numbers(&mut rng);
        if let Some(e) = stage.emit(aim, &u) {
            let finite = e.power.is_finite() && e.ray.o.is_finite() && e.ray.d.is_finite();
            assert!(finite, "{}: {e:?}", stage.name);
            assert!(e.pdf.start > 0.0 && e.pdf.onward > 0.0, "{e:?}");
            assert!(e.pdf.start < f32::INFINITY && e.pdf.onward < f32::INFINITY);
            let cos = e.pdf.cos;
            assert!(cos > 0.0 && cos <= 1.0 + 1e-6, "{e:?}");
            sum.add(f64::from(e.power.g));
        } else {
            sum.add(0.0);
        }
    }
    sum
}

#[test]
fn tiny_lights_and_scenes_of_any_size() {
    for size in [1e-6, 1.0, 1e6] {
        let shapes = || {
            vec![
                rectangle([0.0, 0.0, 0.0], size),
                ball([0.3 * size, 0.0, 0.8 * size], 0.2 * size),
            ]
        };
        let target = Target {
            center: Vec3::new(0.3, 0.0, 0.8) * size as f32,
            radius: 0.2 * size as f32,
        };
        let aim = Aim {
            share: 0.5,
            targets: vec![target],
        };
        let lit = shapes()[1].area();
        let lamps: Vec<(Emitter, f64)> = vec![
            (area(1, 2.0), 2.0 * PI * lit),
            (
                Emitter::Constant {
                    radiance: Rgb::splat(2.0),
                },
                0.0,
            ),
            (
                Emitter::Directional {
                    d: -Vec3::Z,
                    irradiance: Rgb::splat(2.0),
                },
                2.0 * 4.0 * size * size,
            ),
            (
                Emitter::Point {
                    p: Vec3::new(0.0, 0.1, 0.9) * size as f32,
                    intensity: Rgb::splat(2.0),
                },
                8.0 * PI,
            ),
        ];
        for (i, (lamp, power)) in lamps.into_iter().enumerate() {
            let stage = Stage::new("sizes", World::new(shapes()), vec![lamp]);
            for aim in [&Aim::default(), &aim] {
                let sum = mean_power(&stage, aim, 20_000);
                let off = (sum.mean - power).abs();
                let within = 5.0 * sum.stderr() + 1e-5 * power;
                assert!(
                    power == 0.0 || off <= within,
                    "size {size}, lamp {i}: {} {power}",
                    sum.mean
                );
                assert!(sum.mean > 0.0);
            }
        }
    }
}

#[test]
fn a_light_of_next_to_no_area() {
    for side in [5e-7, 1e-12, 1e-22] {
        let world = World::new(vec![
            rectangle([0.3, 0.2, 0.9], side),
            rectangle([0.0, 0.0, -1.0], 2.0),
        ]);
        let stage = Stage::new("speck", world, vec![area(0, 1.0)]);
        // The corners are rounded to f32 beside coordinates of about 1.
        let area = stage.geoms()[0].area();
        let sum = mean_power(&stage, &Aim::default(), 1000);
        let power = PI * area;
        assert!(
            (sum.mean - power).abs() <= 1e-5 * power,
            "{side}: {}",
            sum.mean
        );
    }
    // At the origin corners may lie as near to each other as f32 can tell.
    for side in [1e-12, 1e-18] {
        let world = World::new(vec![rectangle([0.0; 3], side)]);
        let stage = Stage::new("speck", world, vec![area(0, 1.0)]);
        let sum = mean_power(&stage, &Aim::default(), 1000);
        let power = PI * 4.0 * side * side;
        assert!(
            (sum.mean / power - 1.0).abs() < 1e-5,
            "{side}: {}",
            sum.mean
        );
    }
}

/// The faint light is out of nobody's reach, and its share of the power is right.
#[test]
fn a_light_beside_one_that_is_a_trillion_times_as_strong() {
    let world = World::new(vec![
        rectangle([0.0; 3], 1.0),
        rectangle([0.0, 0.0, 3.0], 1.0),
    ]);
    let stage = Stage::new("two", world, vec![area(0, 1e-6), area(1, 1e6)]);
    let mut met = [false; 2];
    let count = 1u32 << 24;
    // All numbers that choose, at the ends and a few between.
    let picks = (0..1024).chain((0..1024).map(|i| i * (count / 1024)));
    for pick in picks.chain(count - 1024..count) {
        let u = EmissionNumbers {
            pick: pick as f32 / count as f32,
            aim: 0.5,
            place: Vec2::new(0.3, 0.6),
            direction: Vec2::new(0.7, 0.2),
            time: 0.0,
        };
        let e = stage.emit(&Aim::default(), &u).unwrap();
        let Source::Surface(hit) = e.source else {
            panic!("a surface emits");
        };
        let index = hit.shape.0 as usize;
        met[index] = true;
        let power = [4.0 * PI * 1e-6, 4.0 * PI * 1e6][index];
        let prob = f64::from(e.pdf.start) * 4.0;
        let expected = power / prob;
        assert!((f64::from(e.power.g) / expected - 1.0).abs() < 1e-5);
    }
    assert_eq!(met, [true; 2]);
}

#[test]
fn nothing_to_emit_and_nowhere_to_go() {
    let mut rng = Rng::new(43);
    let none = Stage::new("none", World::new(vec![]), vec![]);
    let sky = Emitter::Constant {
        radiance: Rgb::WHITE,
    };
    let empty = Stage::new("empty", World::new(vec![]), vec![sky.clone()]);
    let sun = Emitter::Directional {
        d: Vec3::X,
        irradiance: Rgb::WHITE,
    };
    // Light along a plane misses it.
    let grazing = Stage::new(
        "grazing",
        World::new(vec![rectangle([0.0; 3], 1.0)]),
        vec![sun],
    );
    for _ in 0..1000 {
        for stage in [&none, &empty, &grazing] {
            assert!(stage.emit(&Aim::default(), &numbers(&mut rng)).is_none());
        }
    }
    // Without extent across only: light comes down on a plane.
    let flat = Stage::new(
        "flat",
        World::new(vec![rectangle([0.0; 3], 1.0)]),
        vec![sky],
    );
    let mut met = 0;
    for _ in 0..1000 {
        let e = flat.emit(&Aim::default(), &numbers(&mut rng)).unwrap();
        met += u32::from(flat.meet(&e.ray).is_some());
    }
    assert!(met >= 995, "{met}");
}

#[test]
fn odd_aims_do_no_harm() {
    let world = || World::new(vec![ball([0.0; 3], 1.0), rectangle([0.0, 0.0, -2.0], 2.0)]);
    let stages = [
        Stage::new("ball", world(), vec![area(0, 1.0)]),
        Stage::new(
            "sky",
            world(),
            vec![Emitter::Constant {
                radiance: Rgb::WHITE,
            }],
        ),
        Stage::new(
            "point",
            world(),
            vec![Emitter::Point {
                p: Vec3::new(0.0, 0.0, 3.0),
                intensity: Rgb::WHITE,
            }],
        ),
    ];
    let odd = [
        (Vec3::ZERO, 0.0),
        (Vec3::ZERO, -1.0),
        (Vec3::ZERO, f32::NAN),
        (Vec3::ZERO, 1e-30),
        (Vec3::ZERO, 1e30),
        (Vec3::new(0.0, 0.0, 3.0), 0.1),
        (Vec3::new(0.0, 0.0, 3.0), 1e-20),
        (Vec3::splat(1e30), 1.0),
    ];
    for stage in &stages {
        let free = mean_power(stage, &Aim::default(), 4000);
        for (center, radius) in odd {
            for share in [f32::NAN, -1.0, 0.5] {
                let targets = vec![Target { center, radius }];
                let sum = mean_power(stage, &Aim { share, targets }, 4000);
                // Rays that are aimed at next to nothing carry next to nothing.
                let within = 6.0 * (sum.stderr() + free.stderr()) + 1e-5 * free.mean;
                let off = (sum.mean - free.mean).abs();
                let (name, mean) = (stage.name, sum.mean);
                assert!(
                    off < within,
                    "{name}, {radius}, {share}: {mean} and not {}",
                    free.mean
                );
            }
        }
    }
}

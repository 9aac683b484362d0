//! Spots, projectors, directional light, beams and textured surfaces: against figures measured with Mitsuba
//! 3.9.1, against closed forms, and sampling against its density.

#[path = "../common/mod.rs"]
mod common;
#[path = "../directions/mod.rs"]
mod directions;
#[path = "../shapes/mod.rs"]
mod shapes;
mod textured;

use std::f64::consts::PI;
use std::sync::Arc;

use common::Rng;
use glam::Affine2;
use luxel::bsdf::Density;
use luxel::geom::{Geometry, Mesh, Ray, ShapeId};
use luxel::light::{Emitter, Lights, Projector, ProjectorSpec, Spot, SpotSpec, Strategy};
use luxel::math::{DVec3, Rgb, Transform, Vec2, Vec3, warp};
use luxel::texture::{Bitmap, Interpolation, Picture, Texels, Texture, Wrap};
use shapes::{cylinder, disk, nearest, receiver, scale, sphere};

fn bitmap(width: u32, height: u32, texel: impl Fn(u32) -> [f32; 3], to_uv: Affine2) -> Texture {
    Texture::Bitmap(Bitmap {
        texels: Arc::new(Picture {
            width,
            height,
            texels: Texels::Floats((0..width * height).map(texel).collect()),
        }),
        interpolation: Interpolation::Bilinear,
        wrap: Wrap::Repeat,
        to_uv,
    })
}

/// A few bright texels among dim ones, and some that are black.
fn spotted(to_uv: Affine2) -> Texture {
    let texel = |i: u32| match i {
        61 | 62 => [30.0, 20.0, 10.0],
        i if i % 12 < 3 => [0.0; 3],
        i => [0.1 + (i * 7 % 13) as f32 / 13.0; 3],
    };
    bitmap(12, 10, texel, to_uv)
}

fn turned_uv() -> Affine2 {
    Affine2::from_scale_angle_translation(Vec2::new(1.5, 0.8), 0.4, Vec2::new(0.1, 0.2))
}

/// 4 x 2 pixels; channel c of pixel i is 0.1 + (3 i + c) / 10.
fn ramp() -> Texture {
    let channel = |i: u32, c: u32| 0.1 + (3 * i + c) as f32 / 10.0;
    let texel = |i| [channel(i, 0), channel(i, 1), channel(i, 2)];
    bitmap(4, 2, texel, Affine2::IDENTITY)
}

fn looking() -> Transform {
    Transform::look_at(DVec3::new(1.0, 2.0, 5.0), DVec3::ZERO, DVec3::Y).unwrap()
}

/// What a surface at `p`, turned to the light, receives.
fn received(light: Emitter, p: [f32; 3]) -> Rgb {
    let lights = Lights::new(vec![light], &[]);
    let from = receiver(Vec3::from(p), Vec3::Z);
    let sample = lights.sample(&[], &from, 0.5, Vec2::splat(0.5));
    sample.map_or(Rgb::BLACK, |s| {
        assert_eq!(s.density, Density::Delta);
        s.weight()
    })
}

fn check_received(name: &str, light: &Emitter, table: &[([f32; 3], [f32; 3])]) {
    for &(p, expected) in table {
        let got = received(light.clone(), p).to_array();
        for (a, b) in got.iter().zip(expected) {
            let close = (a - b).abs() <= 3e-5 * b;
            assert!(close, "{name} at {p:?}: {got:?} and not {expected:?}");
        }
    }
}

fn spot(to_world: Transform, cutoff: f32, beam: f32, texture: Option<Texture>) -> Spot {
    let spec = SpotSpec {
        to_world,
        intensity: Rgb::new(1.0, 2.0, 3.0),
        cutoff: cutoff.to_radians(),
        beam: beam.to_radians(),
        texture,
    };
    Spot::new(spec, DVec3::ZERO)
}

#[test]
fn spots_are_those_of_mitsuba() {
    let plain = Emitter::Spot(spot(looking(), 20.0, 10.0, None));
    let table = [
        ([0.0, 0.0, 0.0], [0.0333333, 0.0666667, 0.1]),
        ([0.3, 0.1, 2.0], [0.0734606, 0.146921, 0.220382]),
        ([0.1, 0.05, -1.0], [0.024623, 0.0492459, 0.0738689]),
        ([1.2, 0.0, 0.0], [0.0253215, 0.0506429, 0.0759644]),
        ([1.6, 0.0, 0.0], [0.0106361, 0.0212722, 0.0319083]),
        ([2.0, 3.0, 10.0], [0.0; 3]),
    ];
    check_received("spot", &plain, &table);
    let textured = Emitter::Spot(spot(looking(), 20.0, 15.0, Some(ramp())));
    let table = [
        ([0.0, 0.0, 0.0], [0.0383333, 0.0833333, 0.135]),
        ([0.3, 0.1, 2.0], [0.045691, 0.106649, 0.182875]),
        ([0.8, 0.1, 0.0], [0.0323928, 0.0717664, 0.118121]),
        ([0.0, 0.8, 0.0], [0.0591676, 0.125624, 0.199369]),
        ([1.6, 0.0, 0.0], [0.0164553, 0.0371651, 0.0621293]),
    ];
    check_received("textured spot", &textured, &table);
    let stretched = looking() * scale(2.0, 3.0, 4.0);
    let stretched = Emitter::Spot(spot(stretched, 20.0, 15.0, None));
    let table = [
        ([0.0, 0.0, 0.0], [0.0333333, 0.0666667, 0.1]),
        ([0.8, 0.1, 0.0], [0.0243421, 0.0486842, 0.0730263]),
        ([1.2, 0.0, 0.0], [0.0; 3]),
    ];
    check_received("stretched spot", &stretched, &table);
}

fn projector(to_world: Transform, irradiance: Texture, tan: [f64; 2]) -> Projector {
    let spec = ProjectorSpec {
        to_world,
        irradiance,
        scale: 2.0,
        half_extent: tan,
    };
    Projector::new(spec, DVec3::ZERO)
}

#[test]
fn projectors_are_those_of_mitsuba() {
    let tan = 20f64.to_radians().tan();
    let plain = Emitter::Projector(projector(looking(), ramp(), [tan, 0.5 * tan]));
    let table = [
        ([0.0, 0.0, 0.0], [0.240855, 0.261799, 0.282743]),
        ([0.3, 0.1, 2.0], [0.559842, 0.610238, 0.660633]),
        ([0.8, 0.1, 0.0], [0.30581, 0.328468, 0.351127]),
        ([0.0, 0.8, 0.0], [0.211811, 0.235421, 0.259031]),
        ([1.6, 0.0, 0.0], [0.390583, 0.415005, 0.439427]),
        ([2.0, 3.0, 10.0], [0.0; 3]),
    ];
    check_received("projector", &plain, &table);
    let mirrored = looking() * scale(-1.0, 1.0, 1.0);
    let mirrored = Emitter::Projector(projector(mirrored, ramp(), [tan, 0.5 * tan]));
    let table = [
        ([0.0, 0.0, 0.0], [0.240855, 0.261799, 0.282743]),
        ([0.8, 0.1, 0.0], [0.1951266, 0.217786, 0.240444]),
        ([1.6, 0.0, 0.0], [0.242298, 0.266722, 0.291144]),
    ];
    check_received("mirrored projector", &mirrored, &table);
    let stretched = looking() * scale(2.0, 3.0, 4.0);
    let stretched = Emitter::Projector(projector(stretched, ramp(), [tan, 0.5 * tan]));
    let table = [
        ([0.0, 0.0, 0.0], [0.963422, 1.047196, 1.130974]),
        ([0.1, 0.05, -1.0], [0.470028, 0.532476, 0.594922]),
        ([0.3, 0.1, 2.0], [0.0; 3]),
    ];
    check_received("stretched projector", &stretched, &table);
}

#[test]
fn powers_are_the_integrals_of_the_intensities() {
    let tan = 20f64.to_radians().tan();
    let picture = projector(looking(), ramp(), [tan, 0.5 * tan]);
    let spots = [
        spot(looking(), 20.0, 10.0, None),
        spot(looking(), 60.0, 60.0, None),
        spot(looking(), 130.0, 100.0, None),
        spot(Transform::IDENTITY, 20.0, 80.0, None),
    ];
    let integral = |intensity: &dyn Fn(Vec3) -> Rgb| {
        let mut rng = Rng::new(4);
        let n = 1000;
        let sum: f64 = (0..n * n)
            .map(|i| {
                let cell = Vec2::new((i % n) as f32, (i / n) as f32);
                let u = ((cell + rng.vec2()) / n as f32).min(Vec2::splat(1.0 - f32::EPSILON));
                f64::from(intensity(warp::uniform_sphere(u)).luminance())
            })
            .sum();
        sum * 4.0 * PI / (n * n) as f64
    };
    for s in &spots {
        let gap = f64::from(s.power()) / integral(&|d| s.intensity(d)) - 1.0;
        assert!(gap.abs() < 2e-3, "spot: {gap}");
    }
    let gap = f64::from(picture.power()) / integral(&|d| picture.intensity(d)) - 1.0;
    assert!(gap.abs() < 5e-3, "projector: {gap}");
}

#[test]
fn directional_light_is_the_same_everywhere() {
    let d = Vec3::new(0.6, 0.0, -0.8);
    let irradiance = Rgb::new(1.0, 2.0, 3.0);
    let lights = Lights::new(vec![Emitter::Directional { d, irradiance }], &[]);
    for p in [[0.0; 3], [1e6, -3.0, 1e-3]] {
        let from = receiver(Vec3::from(p), Vec3::Z);
        let s = lights.sample(&[], &from, 0.5, Vec2::ZERO).unwrap();
        assert_eq!(
            (s.wi, s.weight(), s.density),
            (-d, irradiance, Density::Delta)
        );
        assert!(s.end.is_none() && s.shadow_ray(&from).t_max == f32::INFINITY);
        // No ray meets it.
        assert!(lights.le_escaped(-d).is_black() && lights.pdf_escaped(&from, -d) == 0.0);
    }
}

#[test]
fn beams_light_what_stands_before_them() {
    let down = |x, y, z| {
        Transform::translate(DVec3::new(x, y, z)) * Transform::rotate(DVec3::X, 180.0).unwrap()
    };
    let sideways = Transform::translate(DVec3::new(-2.0, 0.1, 3.0))
        * Transform::rotate(DVec3::Y, 90.0).unwrap()
        * scale(0.5, 0.5, 4.0);
    let mesh = |m: Mesh| Geometry::Mesh(m);
    // Shape, and the exitance that is left at the origin and at (1.5, 0, 0).
    let table = [
        (
            "rectangle",
            mesh(Mesh::rectangle(&down(0.2, 0.1, 3.0), false)),
            [1.0, 0.0],
        ),
        (
            "turned away",
            mesh(Mesh::rectangle(&down(0.2, 0.1, 3.0), true)),
            [0.0, 0.0],
        ),
        ("disk", disk(down(0.9, 0.1, 3.0), false), [1.0, 1.0]),
        (
            "cube",
            mesh(Mesh::cube(&down(0.2, 0.1, 3.0), false)),
            [1.0, 0.0],
        ),
        (
            "sphere",
            sphere(down(0.0, 0.0, 3.0) * scale(0.5, 0.5, 0.5), false),
            [0.25 / 9.0, 0.25 / 11.25],
        ),
        (
            "cylinder",
            cylinder(sideways, false),
            [0.5 / 3.001_666f32; 2],
        ),
    ];
    for (name, g, expected) in table {
        let geoms = [g];
        let exitance = Texture::Constant(Rgb::splat(2.0));
        let shape = ShapeId(0);
        let beam = vec![Emitter::Beam { shape, exitance }];
        for strategy in [Strategy::Power, Strategy::Tree, Strategy::Uniform] {
            let lights = Lights::with_strategy(beam.clone(), &geoms, strategy);
            for (p, e) in [Vec3::ZERO, Vec3::new(1.5, 0.0, 0.0)]
                .into_iter()
                .zip(expected)
            {
                let from = receiver(p, Vec3::Z);
                let n = 60_000;
                let sum: f64 = (0..n)
                    .filter_map(|i| {
                        let u = (i as f32 + 0.5) / n as f32;
                        let s = lights.sample(&geoms, &from, u, Vec2::splat(0.5))?;
                        assert_eq!(s.density, Density::Delta);
                        // Another face of the cube may look the same way but lie behind.
                        let met = nearest(&geoms, &Ray::new(p, s.wi))?;
                        assert!((met.p - s.end.unwrap().p).length() < 1e-4, "{name}");
                        assert!(
                            lights.le(&met).is_black() && lights.pdf(&geoms, &from, &met) == 0.0
                        );
                        Some(f64::from(s.weight().g))
                    })
                    .sum();
                let got = sum / f64::from(n);
                let gap = got - 2.0 * f64::from(e);
                assert!(
                    gap.abs() < 2e-3 * got + 1e-9,
                    "{name} at {p}: {got} and not {}",
                    2.0 * e
                );
            }
        }
    }
}

#[test]
fn lights_at_infinity_take_part_by_power() {
    let place = Transform::translate(DVec3::new(0.0, 0.0, 3.0))
        * Transform::rotate(DVec3::X, 180.0).unwrap();
    let geoms = [Geometry::Mesh(Mesh::rectangle(&place, false))];
    let d = Vec3::new(0.0, 0.6, -0.8);
    let emitters = vec![
        Emitter::Area {
            shape: ShapeId(0),
            radiance: Rgb::splat(2.0),
        },
        Emitter::Directional {
            d,
            irradiance: Rgb::splat(3.0),
        },
        Emitter::Constant {
            radiance: Rgb::splat(0.25),
        },
        Emitter::Directional {
            d: -Vec3::Z,
            irradiance: Rgb::splat(300.0),
        },
        Emitter::Spot(spot(place, 60.0, 40.0, None)),
    ];
    let from = receiver(Vec3::ZERO, Vec3::Z);
    let alone = |e: &Emitter, seed| {
        let lights = Lights::new(vec![e.clone()], &geoms);
        mean(&lights, &geoms, &from, 200_000, seed).0
    };
    let truth: f64 = emitters
        .iter()
        .enumerate()
        .map(|(i, e)| alone(e, i as u64))
        .sum();
    let lights = Lights::new(emitters, &geoms);
    let (got, se) = mean(&lights, &geoms, &from, 2_000_000, 20);
    assert!(se < 2.5e-3 * got, "{se}");
    assert!(
        (got - truth).abs() < 4.0 * se + 1e-3 * truth,
        "{got} and not {truth}"
    );
    // The strong sun is chosen most, and nothing less than an eighth of the time.
    let mut rng = Rng::new(21);
    let mut counts = [0; 5];
    for _ in 0..40_000 {
        if let Some(s) = lights.sample(&geoms, &from, rng.f32(), rng.vec2()) {
            counts[s.emitter.0 as usize] += 1;
        }
    }
    assert!(counts[3] > 22_000, "{counts:?}");
    assert!(counts[1] > 4_800 && counts[2] > 4_800, "{counts:?}");
    assert!(counts[0] + counts[4] > 4_800, "{counts:?}");
}

/// Mean irradiance and its standard error by independent samples, without shadows.
fn mean(
    lights: &Lights,
    geoms: &[Geometry],
    from: &luxel::geom::Hit,
    n: usize,
    seed: u64,
) -> (f64, f64) {
    let mut rng = Rng::new(seed);
    let (mut sum, mut sum2) = (0f64, 0f64);
    for _ in 0..n {
        if let Some(s) = lights.sample(geoms, from, rng.f32(), rng.vec2()) {
            let w = f64::from(s.weight().g * s.wi.dot(from.frame.n).max(0.0));
            sum += w;
            sum2 += w * w;
        }
    }
    let mean = sum / n as f64;
    (mean, ((sum2 / n as f64 - mean * mean) / n as f64).sqrt())
}

#[test]
fn extremes_give_ordinary_numbers() {
    let mut rng = Rng::new(30);
    for size in [1e-12f64, 1e-6, 1.0, 1e6] {
        let down = Transform::translate(DVec3::new(0.0, 0.0, size))
            * scale(size, size, size)
            * Transform::rotate(DVec3::X, 180.0).unwrap();
        let geoms = vec![
            Geometry::Mesh(Mesh::rectangle(&down, false)),
            sphere(down * scale(0.4, 0.4, 0.4), false),
            disk(down, false),
            Geometry::Mesh(Mesh::cube(&(down * scale(0.3, 0.3, 0.3)), false)),
            cylinder(down, false),
            Geometry::Mesh(Mesh::rectangle(&down, false)),
            sphere(down * scale(0.4, 0.4, 0.4), false),
        ];
        let shape = |i: u32| ShapeId(i);
        let mut emitters: Vec<_> = (0..5)
            .map(|i| Emitter::TexturedArea {
                shape: shape(i),
                radiance: spotted(turned_uv()),
            })
            .collect();
        let exitance = spotted(turned_uv());
        emitters.extend((5..7).map(|i| Emitter::Beam {
            shape: shape(i),
            exitance: exitance.clone(),
        }));
        emitters.push(Emitter::Spot(spot(down, 180.0, 0.0, None)));
        emitters.push(Emitter::Spot(spot(down, 1e-5, 0.0, None)));
        emitters.push(Emitter::Projector(projector(down, ramp(), [1e3, 1e-3])));
        emitters.push(Emitter::Directional {
            d: Vec3::Z,
            irradiance: Rgb::splat(1e12),
        });
        for strategy in [Strategy::Power, Strategy::Tree, Strategy::Uniform] {
            let lights = Lights::with_strategy(emitters.clone(), &geoms, strategy);
            for k in 0..3000 {
                let p = match k % 4 {
                    0 => Vec3::ZERO,
                    // On the lamps themselves.
                    1 => Vec3::new(rng.f32() - 0.5, rng.f32() - 0.5, 1.0),
                    2 => Vec3::new(0.0, 0.0, 1.0),
                    _ => warp::uniform_sphere(rng.vec2()) * 1e4,
                };
                let from = receiver(p * size as f32, warp::uniform_sphere(rng.vec2()));
                let u = match k % 7 {
                    0 => Vec2::splat(1.0 - f32::EPSILON / 2.0),
                    1 => Vec2::ZERO,
                    _ => rng.vec2(),
                };
                let Some(s) = lights.sample(&geoms, &from, rng.f32(), u) else {
                    continue;
                };
                let w = s.weight();
                assert!(w.is_finite() && w.min_component() >= 0.0, "{s:?}");
                assert!((s.wi.length() - 1.0).abs() < 1e-5 && s.dist > 0.0, "{s:?}");
                if let Density::PerSr(pdf) = s.density {
                    assert!(pdf > 0.0 && pdf.is_finite());
                }
                if let Some(met) = nearest(&geoms, &Ray::new(from.p, s.wi)) {
                    let pdf = lights.pdf(&geoms, &from, &met);
                    assert!(pdf >= 0.0 && pdf.is_finite(), "{pdf}");
                }
            }
        }
    }
}

#[test]
fn the_tree_leaves_spots_alone_that_shine_elsewhere() {
    // Spots in a row, all shining straight down: below one of them only that one is worth choosing.
    let emitters: Vec<_> = (0..64)
        .map(|i| {
            let t = Transform::translate(DVec3::new(f64::from(i), 0.0, 1.0))
                * Transform::rotate(DVec3::X, 180.0).unwrap();
            Emitter::Spot(spot(t, 20.0, 15.0, None))
        })
        .collect();
    let lights = Lights::new(emitters, &[]);
    for i in [0, 31, 63] {
        let from = receiver(Vec3::new(i as f32 + 0.1, 0.0, 0.0), Vec3::Z);
        // Alike, each would have 1/64.
        let prob = lights.choice_prob(&from, i);
        assert!(prob > 0.2, "{i}: {prob}");
        assert!(lights.choice_prob(&from, (i + 30) % 64) == 0.0);
    }
}

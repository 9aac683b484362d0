//! Light sampling against its density, irradiance against closed forms, the light tree against its own
//! probabilities, and the ends of the range.

mod common;
mod directions;
mod shapes;

use common::{Rng, chi2_p_value, sidak};
use directions::DirectionCheck;
use luxel::bsdf::Density;
use luxel::geom::{Geometry, Hit, Mesh, Ray, ShapeId};
use luxel::light::{Emitter, EmitterSample, Lights, Strategy};
use luxel::math::{DVec3, Rgb, Transform, Vec2, Vec3, warp};
use shapes::{cylinder, disk, nearest, receiver, scale, sphere, triangle};
use std::f64::consts::PI;

fn area(shape: u32, radiance: f32) -> Emitter {
    Emitter::Area {
        shape: ShapeId(shape),
        radiance: Rgb::splat(radiance),
    }
}

fn place(p: [f64; 3], size: f64) -> Transform {
    Transform::translate(DVec3::from(p)) * scale(size, size, size)
}

fn rectangle(t: &Transform) -> Geometry {
    Geometry::Mesh(Mesh::rectangle(t, false))
}

fn facing_down() -> Transform {
    Transform::rotate(DVec3::X, 180.0).unwrap()
}

fn pdf_of(s: &EmitterSample) -> f32 {
    match s.density {
        Density::PerSr(pdf) => pdf,
        Density::Delta => panic!("a surface with a delta density"),
    }
}

fn lit_shapes() -> Vec<(&'static str, Geometry)> {
    let tilt = Transform::rotate(DVec3::new(0.96, 0.0, 0.28), 140.0).unwrap();
    let at = |p: [f64; 3], size| place(p, size) * tilt;
    vec![
        ("near sphere", sphere(at([0.3, 0.1, 2.0], 1.5), false)),
        ("far sphere", sphere(at([3.0, 1.0, 20.0], 0.4), false)),
        ("sphere around", sphere(at([0.3, 0.1, 0.2], 1.5), true)),
        ("near disk", disk(at([0.3, 0.1, 1.2], 1.5), false)),
        ("cylinder", cylinder(at([0.3, 0.1, 2.2], 1.0), false)),
        ("near rectangle", rectangle(&at([0.3, 0.1, 1.2], 1.5))),
        ("far rectangle", rectangle(&at([3.0, 1.0, 40.0], 0.4))),
        (
            "triangle",
            triangle([[-1.0, -1.0, 1.0], [0.2, 1.5, 0.7], [1.3, -0.4, 1.8]]),
        ),
        (
            "far triangle",
            triangle([[-1.0, -1.0, 41.0], [0.2, 1.5, 40.7], [1.3, -0.4, 41.8]]),
        ),
        (
            "cube",
            Geometry::Mesh(Mesh::cube(&at([0.3, 0.1, 2.4], 1.0), false)),
        ),
    ]
}

#[test]
fn connections_follow_their_density() {
    let shapes = lit_shapes();
    let alpha = sidak(0.01, shapes.len());
    for (name, g) in shapes {
        let geoms = [g];
        let lights = Lights::new(vec![area(0, 1.0)], &geoms);
        let from = receiver(Vec3::ZERO, Vec3::Z);
        let b = geoms[0].bounds();
        let check = DirectionCheck {
            name,
            alpha,
            axis: b.center().normalize(),
            sin2: 0.25 * (b.diagonal().length_squared() / b.center().length_squared()) as f64,
        };
        check.run(
            |rng| {
                let s = lights.sample(&geoms, &from, rng.f32(), rng.vec2())?;
                Some((s.wi, pdf_of(&s)))
            },
            |d| nearest(&geoms, &Ray::new(from.p, d)).is_some_and(|m| !lights.le(&m).is_black()),
        );
    }
}

#[test]
fn density_of_a_sample_is_the_density_of_its_direction() {
    let mut rng = Rng::new(5);
    for (name, g) in lit_shapes() {
        for strategy in [Strategy::Power, Strategy::Tree] {
            let geoms = [g.clone(), rectangle(&place([0.0, 0.0, -3.0], 1.0))];
            let emitters = vec![area(0, 1.0), area(1, 2.0)];
            let lights = Lights::with_strategy(emitters, &geoms, strategy);
            let from = receiver(Vec3::ZERO, Vec3::Z);
            let (mut seen, mut met_again) = (0, 0);
            for _ in 0..2000 {
                let Some(s) = lights.sample(&geoms, &from, rng.f32(), rng.vec2()) else {
                    continue;
                };
                seen += 1;
                // A direction may round past an edge; that it hardly ever does is counted.
                let Some(met) = nearest(&geoms, &Ray::new(from.p, s.wi)) else {
                    continue;
                };
                let pdf = lights.pdf(&geoms, &from, &met);
                let ratio = pdf_of(&s) / pdf;
                // Where the surface is seen edge on the density changes fast with the direction.
                let oblique = met.wo.dot(met.ng).abs() < 0.1;
                if oblique || (met.p - s.end.unwrap().p).length() < 1e-4 * s.dist {
                    met_again += 1;
                    assert!(oblique || (ratio - 1.0).abs() < 1e-3, "{name}: {ratio}");
                }
            }
            assert!(seen > 300, "{name}: {seen}");
            // What the light around hides cannot be met again.
            let hidden = name == "sphere around";
            assert!(
                hidden || met_again * 100 >= seen * 99,
                "{name}: {met_again} of {seen}"
            );
        }
    }
}

/// Irradiance at the origin on a surface facing +z, by `n`² stratified connections.
fn irradiance(lights: &Lights, geoms: &[Geometry], from: &Hit, n: usize, seed: u64) -> f64 {
    let mut rng = Rng::new(seed);
    let mut sum = 0.0;
    for i in 0..n * n {
        let cell = Vec2::new((i % n) as f32, (i / n) as f32);
        let u = ((cell + rng.vec2()) / n as f32).min(Vec2::splat(1.0 - f32::EPSILON));
        if let Some(s) = lights.sample(geoms, from, rng.f32(), u) {
            let w = s.weight().g * s.wi.dot(from.frame.n).max(0.0);
            assert!(w >= 0.0 && w.is_finite());
            sum += w as f64;
        }
    }
    sum / (n * n) as f64
}

/// Irradiance of a convex polygon of radiance 1 above the horizon (Lambert 1760).
fn lambert(corners: &[Vec3], from: &Hit) -> f64 {
    let n = from.frame.n.as_dvec3();
    let d: Vec<DVec3> = corners
        .iter()
        .map(|c| (*c - from.p).as_dvec3().normalize())
        .collect();
    let sum: f64 = (0..d.len())
        .map(|i| {
            let (a, b) = (d[i], d[(i + 1) % d.len()]);
            let cross = a.cross(b);
            let length = cross.length();
            cross.dot(n) / length * length.atan2(a.dot(b))
        })
        .sum();
    0.5 * sum.abs()
}

#[test]
fn irradiance_is_that_of_the_closed_forms() {
    // Distances on both sides of every switch of method; sizes around them.
    for (seed, unit) in [1e-6f64, 1.0, 1e6].into_iter().enumerate() {
        for h in [0.05, 0.7, 6.0, 19.0, 60.0, 3000.0] {
            let from = receiver(Vec3::ZERO, Vec3::Z);
            let down = place([0.3 * unit, -0.2 * unit, h * unit], unit) * facing_down();
            let check = |name: &str, g: Geometry, expected: f64| {
                let geoms = [g];
                let lights = Lights::new(vec![area(0, 1.0)], &geoms);
                let e = irradiance(&lights, &geoms, &from, 256, seed as u64);
                let gap = e / expected - 1.0;
                assert!(gap.abs() < 2e-3, "{name} at {h}, unit {unit}: off by {gap}");
            };
            let rect = rectangle(&down);
            let Geometry::Mesh(ref mesh) = rect else {
                unreachable!()
            };
            let corners = mesh.positions().to_vec();
            check("rectangle", rect.clone(), lambert(&corners, &from));
            let three = [corners[0], corners[1], corners[2]];
            let tri = triangle(three.map(|c| c.to_array()));
            check("triangle", tri, lambert(&three, &from));
            // A disk parallel to the receiver, off its axis.
            let (a2, h2) = (0.13, h * h);
            let root = ((h2 + a2 + 1.0).powi(2) - 4.0 * a2).sqrt();
            // Area sampling of a disk nearer than that needs more than this many samples.
            if h > 0.5 {
                // R² (root + h² + a² - R²) / root, with the difference rationalised.
                let p = h2 + a2 - 1.0;
                let e = 0.5 * PI * (root * root - p * p) / (root * (root + p));
                check("disk", disk(down, false), e);
            }
            let d2 = h2 + 0.13;
            if h > 1.2 {
                let up = place([0.3 * unit, -0.2 * unit, h * unit], unit);
                check("sphere", sphere(up, false), PI / d2 * h / d2.sqrt());
            }
        }
    }
}

#[test]
fn a_sphere_lights_its_own_inside_evenly() {
    // From everywhere within, and on the wall itself, all directions see the radiance: irradiance π.
    let geoms = [sphere(place([5.0, 5.0, 5.0], 2.0), true)];
    let lights = Lights::new(vec![area(0, 1.0)], &geoms);
    for x in [0.0f32, 1.0, 1.99999, 2.0] {
        let from = receiver(Vec3::new(5.0 + x, 5.0, 5.0), -Vec3::X);
        let e = irradiance(&lights, &geoms, &from, 256, 1);
        assert!((e / PI - 1.0).abs() < 2e-3, "{e} at {x}");
    }
}

/// A hundred small lamps of all kinds, strewn.
fn strewn(count: u32, seed: u64) -> (Vec<Geometry>, Vec<Emitter>) {
    let mut rng = Rng::new(seed);
    let mut geoms = Vec::new();
    let mut emitters = Vec::new();
    for i in 0..count {
        let p: [f64; 3] = std::array::from_fn(|_| (rng.f32() * 10.0 - 5.0) as f64);
        let axis = DVec3::new(1.0, rng.f32() as f64, 0.3);
        let turn = Transform::rotate(axis, 360.0 * rng.f32() as f64).unwrap();
        let t = place(p, 0.02 + 0.2 * rng.f32() as f64) * turn;
        let radiance = 1.0 + 20.0 * rng.f32() * rng.f32();
        if i % 5 == 0 {
            emitters.push(Emitter::Point {
                p: DVec3::from(p).as_vec3(),
                intensity: Rgb::splat(0.1 * radiance),
            });
            continue;
        }
        emitters.push(area(geoms.len() as u32, radiance));
        geoms.push(match i % 5 {
            1 => sphere(t, false),
            2 => disk(t, false),
            3 => cylinder(t, false),
            _ => rectangle(&t),
        });
    }
    (geoms, emitters)
}

#[test]
fn every_choice_gives_the_same_irradiance() {
    // No shadows: the sum over the lights one by one is the truth for any way to choose.
    let (geoms, emitters) = strewn(100, 7);
    let from = receiver(Vec3::new(0.2, 0.1, -0.3), Vec3::new(0.6, 0.0, 0.8));
    let truth: f64 = emitters
        .iter()
        .map(|e| irradiance(&Lights::new(vec![e.clone()], &geoms), &geoms, &from, 64, 3))
        .sum();
    for strategy in [Strategy::Power, Strategy::Tree] {
        let lights = Lights::with_strategy(emitters.clone(), &geoms, strategy);
        // Independent samples, since the choice is not stratified.
        let mut rng = Rng::new(9);
        let (mut sum, mut sum2, n) = (0f64, 0f64, 2_000_000);
        for _ in 0..n {
            if let Some(s) = lights.sample(&geoms, &from, rng.f32(), rng.vec2()) {
                let w = (s.weight().g * s.wi.dot(from.frame.n).max(0.0)) as f64;
                sum += w;
                sum2 += w * w;
            }
        }
        let mean = sum / n as f64;
        let se = ((sum2 / n as f64 - mean * mean) / n as f64).sqrt();
        // A 1 % error would show: the standard error is well below a quarter of that.
        assert!(se < 0.0025 * mean, "{strategy:?}: {se} of {mean}");
        assert!(
            (mean - truth).abs() < 4.0 * se + 1e-3 * truth,
            "{strategy:?}: {mean} and not {truth}"
        );
    }
}

#[test]
fn environments_share_the_choice_with_other_lights() {
    let (geoms, mut emitters) = strewn(9, 8);
    emitters.push(Emitter::Constant {
        radiance: Rgb::splat(0.25),
    });
    emitters.push(Emitter::Constant {
        radiance: Rgb::splat(0.5),
    });
    let from = receiver(Vec3::ZERO, Vec3::Z);
    let lights = Lights::new(emitters, &geoms);
    let mut rng = Rng::new(10);
    let (mut sum, n) = (0f64, 400_000);
    for _ in 0..n {
        let s = lights.sample(&geoms, &from, rng.f32(), rng.vec2());
        if let Some(s) = s.filter(|s| s.dist == f32::INFINITY) {
            // Both share the density of a direction.
            assert!(pdf_of(&s) < lights.pdf_escaped(&from, s.wi));
            sum += (s.weight().g * s.wi.z.max(0.0)) as f64;
        }
    }
    assert!((sum / n as f64 / (0.75 * PI) - 1.0).abs() < 0.01);
    assert_eq!(lights.le_escaped(Vec3::X), Rgb::splat(0.75));
    // At least a sixth for each of the three kinds, and all of it shared out.
    let pdf = lights.pdf_escaped(&from, Vec3::X) * 4.0 * std::f32::consts::PI;
    assert!((1.0 / 3.0..5.0 / 6.0).contains(&pdf), "{pdf}");
}

#[test]
fn the_tree_chooses_with_the_probability_it_states() {
    let (geoms, emitters) = strewn(120, 11);
    let lights = Lights::with_strategy(emitters.clone(), &geoms, Strategy::Tree);
    let mut rng = Rng::new(12);
    for k in 0..5 {
        let p = Vec3::from_array(std::array::from_fn(|_| rng.f32() * 12.0 - 6.0));
        let n = Vec3::from_array(std::array::from_fn(|_| rng.f32() - 0.5)).normalize();
        let from = receiver(p, n);
        let mut probs: Vec<f64> = (0..lights.len())
            .map(|i| lights.choice_prob(&from, i) as f64)
            .collect();
        let samples = 400_000;
        let mut counts = vec![0u32; probs.len() + 1];
        for _ in 0..samples {
            let i = lights.choose(&from, rng.f32()).unwrap_or(probs.len());
            counts[i] += 1;
        }
        // A branch may turn out dark only when entered: that is a choice of no light.
        let dark = 1.0 - probs.iter().sum::<f64>();
        assert!((-1e-5..0.05).contains(&dark), "{dark}");
        probs.push(dark.max(0.0));
        // Rare choices are joined until they are expected five times.
        let (mut chi2, mut dof, mut e, mut o) = (0.0, -1.0, 0.0, 0.0);
        for (i, p) in probs.iter().enumerate() {
            e += p * samples as f64;
            o += counts[i] as f64;
            if e >= 5.0 {
                chi2 += (o - e) * (o - e) / e;
                dof += 1.0;
                (e, o) = (0.0, 0.0);
            }
        }
        let p_value = chi2_p_value(chi2, dof);
        assert!(p_value > sidak(0.01, 5), "point {k}: p = {p_value}");
    }
}

#[test]
fn extremes_give_ordinary_numbers() {
    let mut rng = Rng::new(20);
    for size in [1e-12f64, 1e-6, 1.0, 1e6] {
        for dist in [1e-3f64, 1.0, 1e6] {
            for radiance in [1e-12f32, 1.0, 1e12] {
                let t = place([0.0, 0.0, size * dist], size) * facing_down();
                let mut geoms = vec![
                    sphere(t, false),
                    disk(t, false),
                    cylinder(t, false),
                    rectangle(&t),
                    Geometry::Mesh(Mesh::cube(&t, false)),
                    sphere(t, true),
                    // In the plane of the receiver.
                    rectangle(&place([3.0 * size, 0.0, 0.0], size)),
                ];
                let s = size as f32;
                geoms.push(triangle([[s, 0.0, 0.0], [s, s, 0.0], [s, 0.0, s]]));
                for strategy in [Strategy::Power, Strategy::Tree] {
                    let emitters = (0..geoms.len() as u32)
                        .map(|i| area(i, if i % 2 == 0 { radiance } else { 1.0 }))
                        .collect();
                    let lights = Lights::with_strategy(emitters, &geoms, strategy);
                    let from = receiver(Vec3::ZERO, Vec3::Z);
                    for _ in 0..500 {
                        let u = match rng.f32() {
                            x if x < 0.1 => Vec2::splat(1.0 - f32::EPSILON / 2.0),
                            x if x < 0.2 => Vec2::ZERO,
                            _ => rng.vec2(),
                        };
                        let Some(s) = lights.sample(&geoms, &from, rng.f32(), u) else {
                            continue;
                        };
                        let pdf = pdf_of(&s);
                        assert!(pdf > 0.0 && pdf.is_finite(), "{pdf}");
                        let w = s.weight().g;
                        assert!(w >= 0.0 && w.is_finite(), "{w}");
                        assert!((s.wi.length() - 1.0).abs() < 1e-5 && s.dist > 0.0);
                        let ray = s.shadow_ray(&from);
                        assert!(ray.d.is_finite() && ray.o.is_finite());
                    }
                    for _ in 0..500 {
                        let d = warp::uniform_sphere(rng.vec2());
                        if let Some(met) = nearest(&geoms, &Ray::new(from.p, d)) {
                            let pdf = lights.pdf(&geoms, &from, &met);
                            assert!(pdf >= 0.0 && pdf.is_finite(), "{pdf}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_lamp_of_two_triangles_is_one_rectangle() {
    let quad = |corner: Vec3, bend: f32| {
        let (x, y) = (Vec3::new(0.3, 0.4, 0.0), Vec3::new(-0.8, 0.6, bend));
        let p = vec![corner, corner + x, corner + x + y, corner + y];
        Geometry::Mesh(Mesh::new(p, vec![], vec![], vec![[2, 3, 0], [0, 1, 2]], false).unwrap())
    };
    let count = |g: Geometry| Lights::new(vec![area(0, 1.0)], &[g]).len();
    assert_eq!(count(quad(Vec3::ZERO, 0.0)), 1);
    assert_eq!(count(quad(Vec3::splat(0.7), 0.0)), 1);
    // A rhombus, and the six faces of a cube.
    let p = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.2, 1.0, 0.0],
        [0.2, 1.0, 0.0],
    ];
    let tris = vec![[0, 1, 2], [0, 2, 3]];
    let rhombus = Mesh::new(p.map(Vec3::from).to_vec(), vec![], vec![], tris, false).unwrap();
    assert_eq!(count(Geometry::Mesh(rhombus)), 2);
    let cube = Mesh::cube(&place([3.0, 2.0, 1.0], 0.1), false);
    assert_eq!(count(Geometry::Mesh(cube)), 6);
}

#[test]
fn a_point_light_falls_off_with_the_square_of_the_distance() {
    let p = Vec3::new(0.0, 3.0, 4.0);
    let intensity = Rgb::new(1.0, 2.0, 3.0);
    let lights = Lights::new(vec![Emitter::Point { p, intensity }], &[]);
    let from = receiver(Vec3::ZERO, Vec3::Z);
    let s = lights.sample(&[], &from, 0.5, Vec2::ZERO).unwrap();
    assert_eq!(s.density, Density::Delta);
    assert!((s.weight().b - 3.0 / 25.0).abs() < 1e-7 && s.dist == 5.0);
    assert!(
        lights
            .sample(&[], &receiver(p, Vec3::Z), 0.5, Vec2::ZERO)
            .is_none()
    );
    assert!(
        Lights::new(vec![], &[])
            .sample(&[], &from, 0.5, Vec2::ZERO)
            .is_none()
    );
}

/// Prints what each way to choose costs and gives; the source of [`luxel::light::TREE_FROM`].
/// Run with `cargo test --release --test light -- --ignored --nocapture measure`.
#[test]
#[ignore = "measures and prints; it checks nothing"]
fn measure_where_the_tree_pays() {
    println!("lights  ns power  ns tree  variance power/tree  efficiency tree/power");
    for count in [2, 3, 4, 6, 8, 12, 16, 32, 64, 256, 1024] {
        let (mut ns, mut var) = ([0f64; 2], [0f64; 2]);
        for seed in 0..8 {
            let (geoms, emitters) = strewn(count, 100 + seed);
            for (k, strategy) in [Strategy::Power, Strategy::Tree].into_iter().enumerate() {
                let lights = Lights::with_strategy(emitters.clone(), &geoms, strategy);
                let mut rng = Rng::new(seed);
                for _ in 0..16 {
                    let p = Vec3::from_array(std::array::from_fn(|_| rng.f32() * 10.0 - 5.0));
                    let n = warp::uniform_sphere(rng.vec2());
                    let from = receiver(p, n);
                    let samples = 4000;
                    let (mut sum, mut sum2) = (0f64, 0f64);
                    let start = std::time::Instant::now();
                    for _ in 0..samples {
                        let s = lights.sample(&geoms, &from, rng.f32(), rng.vec2());
                        let w = s.map_or(0.0, |s| (s.weight().g * s.wi.dot(n).max(0.0)) as f64);
                        sum += w;
                        sum2 += w * w;
                    }
                    ns[k] += start.elapsed().as_nanos() as f64 / samples as f64;
                    let (m, m2) = (sum / samples as f64, sum2 / samples as f64);
                    if m > 0.0 {
                        var[k] += (m2 / (m * m) - 1.0).ln_1p() / 128.0;
                    }
                }
            }
        }
        // A shadow ray costs about 300 ns beside the choice.
        let cost = ns.map(|t| t / 128.0 + 300.0);
        let gain = (var[0] - var[1]).exp();
        println!(
            "{count:6}  {:8.0}  {:7.0}  {gain:19.2}  {:21.2}",
            cost[0] - 300.0,
            cost[1] - 300.0,
            gain * cost[0] / cost[1]
        );
    }
}

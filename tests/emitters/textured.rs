//! Surfaces that shine by a texture.

use std::f64::consts::PI;

use super::common::{self, Rng};
use super::directions::DirectionCheck;
use super::shapes::{cylinder, disk, nearest, receiver, scale, sphere, triangle};
use super::{bitmap, spotted, turned_uv};
use glam::Affine2;
use luxel::bsdf::Density;
use luxel::geom::{Geometry, Mesh, Ray, ShapeId};
use luxel::light::{Emitter, EmitterSample, Lights};
use luxel::math::{DVec3, Transform, Vec2, Vec3, warp};

fn pdf_of(s: &EmitterSample) -> f32 {
    match s.density {
        Density::PerSr(pdf) => pdf,
        Density::Delta => panic!("a surface with a delta density"),
    }
}

fn textured_shapes() -> Vec<(&'static str, Geometry)> {
    let tilt = Transform::rotate(DVec3::new(0.96, 0.0, 0.28), 140.0).unwrap();
    let at =
        |p: [f64; 3], size| Transform::translate(DVec3::from(p)) * scale(size, size, size) * tilt;
    let rectangle = |t: Transform| Geometry::Mesh(Mesh::rectangle(&t, false));
    vec![
        ("near sphere", sphere(at([0.3, 0.1, 2.0], 1.5), false)),
        ("far sphere", sphere(at([3.0, 1.0, 20.0], 0.4), false)),
        ("sphere around", sphere(at([0.3, 0.1, 0.2], 1.5), true)),
        ("disk", disk(at([0.3, 0.1, 1.2], 1.5), false)),
        ("cylinder", cylinder(at([0.3, 0.1, 2.2], 1.0), false)),
        ("near rectangle", rectangle(at([0.3, 0.1, 1.2], 1.5))),
        (
            "mirrored rectangle",
            rectangle(at([0.3, 0.1, 1.2], 1.5) * scale(-1.0, 0.4, 1.0)),
        ),
        ("far rectangle", rectangle(at([3.0, 1.0, 40.0], 0.4))),
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
fn textured_connections_follow_their_density() {
    let mut shapes = textured_shapes();
    shapes.retain(|s| !matches!(s.0, "far triangle" | "cube"));
    let alpha = common::sidak(0.01, shapes.len());
    for (name, g) in shapes {
        let geoms = [g];
        // Not too dark anywhere: the check averages over 1 / pdf.
        let texel = |i: u32| [0.3 + (i * 7 % 13) as f32 / 13.0; 3];
        let radiance = bitmap(12, 10, texel, turned_uv());
        let shape = ShapeId(0);
        let lights = Lights::new(vec![Emitter::TexturedArea { shape, radiance }], &geoms);
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
            // Where it is black it is sampled all the same.
            |d| nearest(&geoms, &Ray::new(from.p, d)).is_some_and(|m| m.wo.dot(m.frame.n) > 0.0),
        );
    }
}

#[test]
fn a_textured_sample_agrees_with_the_hit_in_its_direction() {
    let mut rng = Rng::new(5);
    for (name, g) in textured_shapes() {
        let geoms = [g];
        let (shape, radiance) = (ShapeId(0), spotted(turned_uv()));
        let lights = Lights::new(vec![Emitter::TexturedArea { shape, radiance }], &geoms);
        let from = receiver(Vec3::ZERO, Vec3::Z);
        let (mut seen, mut same) = (0, 0);
        for _ in 0..4000 {
            let Some(s) = lights.sample(&geoms, &from, rng.f32(), rng.vec2()) else {
                continue;
            };
            let Some(met) = nearest(&geoms, &Ray::new(from.p, s.wi)) else {
                continue;
            };
            if (met.p - s.end.unwrap().p).length() > 1e-4 * s.dist || met.wo.dot(met.ng).abs() < 0.1
            {
                continue;
            }
            seen += 1;
            let ratio = pdf_of(&s) / lights.pdf(&geoms, &from, &met);
            let gap = (lights.le(&met).g - s.le.g).abs();
            // Next to the edge of a cell the hit may round into the neighbour.
            same += usize::from((ratio - 1.0).abs() < 1e-3 && gap < 1e-2 * (1.0 + s.le.g));
        }
        assert!(
            seen > 300 && same * 100 >= seen * 97,
            "{name}: {same} of {seen}"
        );
    }
}

/// Radiance times cosine over the hemisphere by quadrature with many rays.
fn irradiance_by_rays(lights: &Lights, geoms: &[Geometry], n: usize) -> f64 {
    let from = receiver(Vec3::ZERO, Vec3::Z);
    let mut rng = Rng::new(8);
    let sum: f64 = (0..n * n)
        .map(|i| {
            let cell = Vec2::new((i % n) as f32, (i / n) as f32);
            let u = ((cell + rng.vec2()) / n as f32).min(Vec2::splat(1.0 - f32::EPSILON));
            let d = warp::cosine_hemisphere(u);
            nearest(geoms, &Ray::new(from.p, d)).map_or(0.0, |m| f64::from(lights.le(&m).g))
        })
        .sum();
    sum * PI / (n * n) as f64
}

#[test]
fn textured_surfaces_light_as_much_as_they_are_seen_to() {
    for (name, g) in textured_shapes()
        .into_iter()
        .filter(|s| !s.0.contains("far"))
    {
        let geoms = [g];
        let (shape, radiance) = (ShapeId(0), spotted(turned_uv()));
        let lights = Lights::new(vec![Emitter::TexturedArea { shape, radiance }], &geoms);
        let from = receiver(Vec3::ZERO, Vec3::Z);
        let truth = irradiance_by_rays(&lights, &geoms, 500);
        let mut rng = Rng::new(6);
        let (mut sum, mut sum2, n) = (0f64, 0f64, 500_000);
        for _ in 0..n {
            let Some(s) = lights.sample(&geoms, &from, rng.f32(), rng.vec2()) else {
                continue;
            };
            // A cube and a sphere hide parts of themselves.
            let met = nearest(&geoms, &Ray::new(from.p, s.wi));
            if met.is_some_and(|m| (m.p - from.p).length() < 0.999 * s.dist) {
                continue;
            }
            let w = f64::from(s.weight().g * s.wi.z.max(0.0));
            sum += w;
            sum2 += w * w;
        }
        let mean = sum / n as f64;
        let se = ((sum2 / n as f64 - mean * mean) / n as f64).sqrt();
        assert!(se < 5e-3 * mean, "{name}: {se} of {mean}");
        assert!(
            (mean - truth).abs() < 4.0 * se + 2e-3 * truth,
            "{name}: {mean} +- {se} and not {truth}"
        );
    }
}

#[test]
fn bright_texels_are_found() {
    // One texel in 2,500 shines, a thousandth of the picture being black otherwise.
    let texel = |i| [if i == 1234 { 100.0 } else { 0.0 }; 3];
    let (shape, radiance) = (ShapeId(0), bitmap(50, 50, texel, Affine2::IDENTITY));
    let place = Transform::translate(DVec3::new(0.0, 0.0, 5.0))
        * Transform::rotate(DVec3::X, 180.0).unwrap();
    let geoms = [Geometry::Mesh(Mesh::rectangle(&place, false))];
    let lights = Lights::new(vec![Emitter::TexturedArea { shape, radiance }], &geoms);
    let from = receiver(Vec3::ZERO, Vec3::Z);
    let mut rng = Rng::new(7);
    let hits = (0..1000).filter(|_| {
        let s = lights.sample(&geoms, &from, rng.f32(), rng.vec2());
        s.is_some_and(|s| s.le.g > 0.0)
    });
    // A quarter of what interpolation spreads over the neighbours is black.
    assert!(hits.count() > 700);
}

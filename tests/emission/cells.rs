//! Where light starts and where it goes, cell by cell, against plain sampling by hand.

use std::f64::consts::PI;

use crate::common::{Rng, Running, chi2_p_value, sidak};
use crate::stages::{Stage, aims, all, numbers};
use luxel::geom::{Geometry, Hit};
use luxel::light::{Aim, Emission, Emitter, Source, Target};
use luxel::math::{Frame, Rgb, Vec3, warp};

const SAMPLES: usize = 60_000;

/// Two estimators of the same power in each of `count` cells: chi-square of the differences, and the total.
/// The second takes `plainly` times as many samples.
fn compare(
    (name, alpha): (&str, f64),
    [count, plainly]: [usize; 2],
    mut ours: impl FnMut(&mut Rng) -> Option<(usize, f64)>,
    mut plain: impl FnMut(&mut Rng) -> Option<(usize, f64)>,
) {
    let mut rng = Rng::new(21);
    let gather =
        |sample: &mut dyn FnMut(&mut Rng) -> Option<(usize, f64)>, n: usize, rng: &mut Rng| {
            let mut cells = vec![(0u32, 0f64, 0f64); count];
            let mut total = Running::default();
            for _ in 0..n {
                let found = sample(rng);
                total.add(found.map_or(0.0, |f| f.1));
                if let Some((cell, power)) = found {
                    let c = &mut cells[cell];
                    *c = (c.0 + 1, c.1 + power, c.2 + power * power);
                }
            }
            (cells, total)
        };
    let (a, total_a) = gather(&mut ours, SAMPLES, &mut rng);
    let (b, total_b) = gather(&mut plain, SAMPLES * plainly, &mut rng);
    let moments = |(_, sum, sum2): (u32, f64, f64), n: usize| {
        let n = n as f64;
        let mean = sum / n;
        (mean, (sum2 / n - mean * mean) / n)
    };
    let (mut chi2, mut dof) = (0.0, 0.0);
    for (a, b) in a.into_iter().zip(b) {
        let few = a.0 < 50 || b.0 < 50;
        let ((ma, va), (mb, vb)) = (moments(a, SAMPLES), moments(b, SAMPLES * plainly));
        if !few {
            chi2 += (ma - mb).powi(2) / (va + vb);
            dof += 1.0;
        } else {
            // Cells of little account: but nothing may be in one that is empty for the other.
            let share = ((ma - mb).abs() - 6.0 * (va + vb).sqrt()) / total_b.mean;
            assert!(share < 5e-3, "{name}: a cell of {share} of the power");
        }
    }
    assert!(dof > 1.0, "{name}: {dof} cells");
    let p = chi2_p_value(chi2, dof);
    assert!(p > alpha, "{name}: chi2 {chi2:.1} of {dof}, p = {p:.1e}");
    let error = total_a.stderr().hypot(total_b.stderr());
    let gap = (total_a.mean - total_b.mean).abs();
    assert!(
        gap <= 4.5 * error + 1e-6 * total_b.mean && error < 5e-2 * total_b.mean,
        "{name}: total {} and not {}, error {error}",
        total_a.mean,
        total_b.mean
    );
}

/// One of 32 cells of the sphere.
fn direction_cell(w: Vec3) -> usize {
    let turn = (w.y.atan2(w.x) / std::f32::consts::TAU + 1.0).fract();
    let height = 0.5 - 0.5 * w.z;
    ((height * 4.0) as usize).min(3) * 8 + ((turn * 8.0) as usize).min(7)
}

/// The octant of a point, seen from the middle of the scene.
fn octant(stage: &Stage, p: Vec3) -> usize {
    let above = p.cmpgt(stage.world.bounds().center());
    above.bitmask() as usize
}

fn cell_of(stage: &Stage, e: &Emission) -> usize {
    let place = match &e.source {
        Source::Surface(hit) => octant(stage, hit.p),
        _ => 0,
    };
    place * 32 + direction_cell(e.ray.d)
}

/// Targets that are small where the surfaces and points stand.
fn distant() -> Aim {
    let target = |x: f32, y: f32, z: f32, radius: f32| Target {
        center: Vec3::new(x, y, z),
        radius,
    };
    Aim {
        share: 1.0,
        targets: vec![
            target(9.0, 1.0, -8.0, 4.0),
            target(10.0, 3.0, -9.0, 3.0),
            target(-8.0, -4.0, -9.0, 4.0),
            target(-2.0, 3.0, 12.0, 4.0),
        ],
    }
}

/// Plain samples seldom go where all emission is aimed.
fn plainly(aim: &Aim) -> usize {
    if aim.share < 1.0 { 1 } else { 8 }
}

fn meets(aim: &Aim, o: Vec3, d: Vec3) -> bool {
    aim.targets.iter().any(|t| {
        let v = t.center - o;
        v.dot(d) > 0.0 && (v - d * v.dot(d)).length() <= t.radius
    })
}

/// Light of surfaces that stand still, uniform by area and cosine.
fn plain_surface(stage: &Stage, rng: &mut Rng) -> Option<(Hit, f64)> {
    let g = &stage.geoms()[0];
    let area: f64 = g.area();
    let mut x = f64::from(rng.f32()) * area;
    let mut prim = 0;
    while prim + 1 < g.prim_count() && x >= g.prim_area(prim) {
        x -= g.prim_area(prim);
        prim += 1;
    }
    let s = g.sample_area(prim, rng.vec2());
    let frame = Frame::from_normal(s.ns);
    let w = frame.to_world(warp::uniform_hemisphere(rng.vec2()));
    let mut hit = crate::shapes::receiver(s.p, s.ng);
    (hit.frame, hit.wo, hit.uv) = (frame, w, s.uv);
    hit.shape = luxel::geom::ShapeId(0);
    let le = stage.lights.le(&hit);
    let power = f64::from(le.g) * f64::from(w.dot(s.ng).abs()) * area * 2.0 * PI;
    Some((hit, power))
}

#[test]
fn surfaces_send_light_as_plain_sampling_does() {
    let is_surface = |s: &Stage| {
        s.world.places().is_empty()
            && s.geoms().len() == 1
            && !matches!(s.lights.emitters()[0], Emitter::Beam { .. })
    };
    let stages: Vec<Stage> = all().into_iter().filter(is_surface).collect();
    let distant = distant();
    let mut aims = aims();
    aims.truncate(2);
    aims.push(("all aimed", distant.clone()));
    let alpha = sidak(0.01, stages.len() * aims.len());
    for stage in &stages {
        for (aimed, aim) in &aims {
            let name = format!("{}, {aimed}", stage.name);
            compare(
                (&name, alpha),
                [256, plainly(aim)],
                |rng| {
                    let e = stage.emit(aim, &numbers(rng))?;
                    Some((cell_of(stage, &e), f64::from(e.power.g)))
                },
                |rng| {
                    let (hit, power) = plain_surface(stage, rng)?;
                    let cell = octant(stage, hit.p) * 32 + direction_cell(hit.wo);
                    let sent = aim.share < 1.0 || meets(aim, hit.p, hit.wo);
                    sent.then_some((cell, power))
                },
            );
        }
    }
}

#[test]
fn points_send_light_as_their_intensity_says() {
    let is_point = |s: &Stage| {
        s.lights.emitters().len() == 1
            && matches!(
                s.lights.emitters()[0],
                Emitter::Point { .. } | Emitter::Spot(_) | Emitter::Projector(_)
            )
            && s.name != "needle"
    };
    let stages: Vec<Stage> = all().into_iter().filter(is_point).collect();
    let alpha = sidak(0.01, stages.len() * 3);
    for stage in &stages {
        let p = match &stage.lights.emitters()[0] {
            Emitter::Point { p, .. } => *p,
            Emitter::Spot(s) => s.position(),
            Emitter::Projector(s) => s.position(),
            _ => continue,
        };
        let mut aims = aims();
        aims.swap_remove(2);
        for (aimed, aim) in &aims {
            let name = format!("{}, {aimed}", stage.name);
            // Within 60 degrees of a target's middle nothing is aimed at it.
            let frame = Frame::from_normal((Vec3::new(0.3, 0.1, 0.5) - p).normalize());
            let reach = match stage.name {
                "point" | "wide spot" => 2.0,
                _ => 0.2,
            };
            let cell = |w: Vec3| {
                let l = frame.to_local(w);
                let turn = (l.y.atan2(l.x) / std::f32::consts::TAU + 1.0).fract();
                let row = (((1.0 - l.z) / reach * 12.0) as usize).min(11);
                row * 8 + ((turn * 8.0) as usize).min(7)
            };
            compare(
                (&name, alpha),
                [96, plainly(aim)],
                |rng| {
                    let e = stage.emit(aim, &numbers(rng))?;
                    assert_eq!(e.ray.o, p);
                    Some((cell(e.ray.d), f64::from(e.power.g)))
                },
                |rng| {
                    let w = frame.to_world(warp::uniform_cone(rng.vec2(), reach));
                    let from = crate::shapes::receiver(p + w, -w);
                    let s = stage.lights.sample(&[], &from, 0.5, rng.vec2())?;
                    let power = f64::from(s.weight().g) * 2.0 * PI * f64::from(reach);
                    let sent = aim.share < 1.0 || meets(aim, p, w);
                    sent.then_some((cell(w), power))
                },
            );
        }
    }
}

#[test]
fn light_from_infinity_fills_the_scene_evenly() {
    let is_far = |s: &Stage| matches!(s.name, "directional" | "constant" | "image");
    let stages: Vec<Stage> = all().into_iter().filter(is_far).collect();
    let alpha = sidak(0.01, stages.len() * 3);
    for stage in &stages {
        let bounds = stage.world.bounds();
        let radius = 0.5 * bounds.diagonal().length();
        // Where the light crosses the plane through the middle that it is at right angles to.
        let cell = |w: Vec3, p: Vec3| {
            let frame = Frame::from_normal(w);
            let l = frame.to_local(p - bounds.center()) / radius;
            let place = |x: f32| ((x + 1.0) * 2.0).clamp(0.0, 3.0) as usize;
            direction_cell(w) * 16 + place(l.x) * 4 + place(l.y)
        };
        let enters = |o: Vec3, d: Vec3| {
            let (a, b) = ((bounds.min - o) / d, (bounds.max - o) / d);
            a.min(b).max_element() < a.max(b).min_element()
        };
        let mut aims = aims();
        aims.swap_remove(2);
        for (aimed, aim) in &aims {
            let name = format!("{}, {aimed}", stage.name);
            compare(
                (&name, alpha),
                [512, plainly(aim)],
                |rng| {
                    let e = stage.emit(aim, &numbers(rng))?;
                    assert!(e.ray.o.distance(bounds.center()) >= radius);
                    Some((cell(e.ray.d, e.ray.o), f64::from(e.power.g)))
                },
                |rng| {
                    let (wi, le) = match &stage.lights.emitters()[0] {
                        Emitter::Directional { d, irradiance } => (-*d, *irradiance),
                        Emitter::Image(map) => {
                            let (wi, le, pdf) = map.sample(rng.vec2())?;
                            (wi, le / pdf)
                        }
                        _ => {
                            let wi = warp::uniform_sphere(rng.vec2());
                            (wi, stage.lights.le_escaped(wi) * (4.0 * PI as f32))
                        }
                    };
                    let frame = Frame::from_normal(wi);
                    let q = warp::concentric_disk(rng.vec2()) * radius;
                    let o = bounds.center() + frame.s * q.x + frame.t * q.y;
                    let before = o + wi * (2.0 * radius);
                    let sent = enters(before, -wi) && (aim.share < 1.0 || meets(aim, before, -wi));
                    let power = f64::from(le.g) * PI * f64::from(radius * radius);
                    sent.then(|| (cell(-wi, o), power))
                },
            );
        }
    }
}

#[test]
fn beams_leave_along_the_normal() {
    let stages = all();
    let stage = stages.iter().find(|s| s.name == "beam").unwrap();
    let Geometry::Mesh(m) = &stage.geoms()[0] else {
        panic!("a rectangle is a mesh");
    };
    let n = m.face_normal(0);
    let alpha = 0.01;
    compare(
        ("beam", alpha),
        [8, 1],
        |rng| {
            let e = stage.emit(&Aim::default(), &numbers(rng))?;
            assert!(e.ray.d.distance(n) < 1e-6);
            Some((octant(stage, e.ray.o), f64::from(e.power.g)))
        },
        |rng| {
            // What a receiver right before the surface gets.
            let s = stage.geoms()[0].sample_area(u32::from(rng.f32() < 0.5), rng.vec2());
            let from = crate::shapes::receiver(s.p + n * 0.01, n);
            let lit = stage.lights.sample(stage.geoms(), &from, 0.5, rng.vec2());
            let le = lit.map_or(Rgb::BLACK, |s| s.weight());
            Some((octant(stage, s.p), f64::from(le.g) * m.area()))
        },
    );
}

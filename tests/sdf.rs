//! Grids of signed distances: against values measured with Mitsuba, against plain marching, and that no ray
//! slips through or meets the surface that it leaves.

mod common;

use std::sync::Arc;

use common::Rng;
use luxel::geom::{Geometry, Hit, RawHit, Ray, Sdf, SdfGrid, ShapeId};
use luxel::math::{DVec3, Transform, Vec3, warp};

fn grid(size: [usize; 3], distance: impl Fn(DVec3) -> f64) -> Arc<SdfGrid> {
    let side = |i: usize, n: usize| i as f64 / (n - 1) as f64;
    let [nx, ny, nz] = size;
    let mut values = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                let p = DVec3::new(side(x, nx), side(y, ny), side(z, nz));
                values.push(distance(p) as f32);
            }
        }
    }
    Arc::new(SdfGrid::new(size, values).unwrap())
}

fn ball(p: DVec3) -> f64 {
    (p - DVec3::new(0.5, 0.45, 0.55)).length() - 0.3
}

fn meet(g: &Geometry, ray: &Ray) -> Option<(f32, Hit)> {
    let (t, uv) = g.intersect_analytic(ray, ray.t_max)?;
    let raw = RawHit {
        t,
        shape: ShapeId(0),
        prim: 0,
        uv,
    };
    Some((t, g.hit(ray, &raw, false)))
}

fn ray(o: [f64; 3], d: [f64; 3]) -> Ray {
    Ray::new(
        DVec3::from(o).as_vec3(),
        DVec3::from(d).normalize().as_vec3(),
    )
}

#[test]
fn a_ball_of_8_voxels_is_met_as_measured() {
    let ball = grid([9; 3], ball);
    let close = |a: Vec3, b: [f32; 3]| (a - Vec3::from(b)).abs().max_element() < 2e-5;
    // Origin, direction; distance, normal and smooth normal by Mitsuba 3.9.1.
    let table = [
        (
            [0.52, 0.31, 3.0],
            [0.01, 0.03, -1.0],
            2.170_292_4,
            [0.223_128, -0.046_031, 0.973_702],
            [0.146_064, -0.235_585, 0.960_815],
        ),
        (
            [0.4, 0.5, -3.0],
            [0.01, 0.03, 1.0],
            3.315_064,
            [-0.235_184, 0.445_456, -0.863_862],
            [-0.237_438, 0.504_847, -0.829_911],
        ),
        (
            [-3.0, 0.4, 0.5],
            [1.0, 0.01, 0.02],
            3.215_400_7,
            [-0.998_006, -0.044_646, 0.044_621],
            [-0.996_842, -0.061_209, 0.050_595],
        ),
        (
            [0.3, 5.0, 0.4],
            [0.01, -1.0, 0.02],
            4.312_841_4,
            [-0.564_153, 0.751_417, -0.342_205],
            [-0.520_571, 0.828_691, -0.205_613],
        ),
        // From the inside.
        (
            [0.5, 0.45, 0.5],
            [1.0, 0.2, 0.1],
            0.294_318_5,
            [0.935_975, 0.349_613, 0.041_491],
            [0.981_356, 0.181_630, -0.062_856],
        ),
    ];
    for (o, d, t, ng, ns) in table {
        for smooth in [false, true] {
            let sdf = Geometry::Sdf(Sdf::new(Arc::clone(&ball), Transform::IDENTITY, smooth));
            let (found, hit) = meet(&sdf, &ray(o, d)).unwrap();
            assert!((found - t).abs() < 2e-6, "{found} {t}");
            assert!(close(hit.ng, ng), "{:?}", hit.ng);
            assert!(
                close(hit.frame.n, if smooth { ns } else { ng }),
                "{:?}",
                hit.frame.n
            );
        }
    }
}

#[test]
fn normals_follow_a_squeezing_transform() {
    let place = Transform::translate(DVec3::new(1.0, 2.0, 3.0))
        * Transform::scale(DVec3::new(2.0, 1.0, 3.0)).unwrap();
    let sdf = Geometry::Sdf(Sdf::new(grid([9; 3], ball), place, true));
    let d = [0.02, 0.03, -3.0];
    let (t, hit) = meet(&sdf, &ray([2.04, 2.31, 12.0], d)).unwrap();
    // Measured as above.
    assert!((t - 6.508_094).abs() < 2e-5, "{t}");
    for (n, measured) in [
        (hit.ng, [0.322_180, -0.132_931, 0.937_299]),
        (hit.frame.n, [0.180_666, -0.582_789, 0.792_286]),
    ] {
        assert!((n - Vec3::from(measured)).abs().max_element() < 2e-5, "{n}");
    }
}

/// The first change of sign of the interpolated values, by small steps.
fn march(values: &[f64], n: usize, o: DVec3, d: DVec3, steps: usize) -> Option<f64> {
    let value = |p: DVec3| {
        let q = p * (n - 1) as f64;
        let cell = q.floor().clamp(DVec3::ZERO, DVec3::splat((n - 2) as f64));
        let f = q - cell;
        let [x, y, z] = cell.to_array().map(|v| v as usize);
        (0..8).fold(0.0, |sum, i| {
            let (a, b, c) = (i & 1, i >> 1 & 1, i >> 2);
            let w = |bit: usize, f: f64| if bit == 1 { f } else { 1.0 - f };
            let v = values[((z + c) * n + y + b) * n + x + a];
            sum + v * w(a, f.x) * w(b, f.y) * w(c, f.z)
        })
    };
    let mut sign = None;
    for i in 0..steps {
        let t = 2.0 * (i as f64 + 0.5) / steps as f64;
        let p = o + d * t;
        if p.min_element() < 0.0 || p.max_element() > 1.0 {
            continue;
        }
        let outside = value(p) >= 0.0;
        if *sign.get_or_insert(outside) != outside {
            return Some(t);
        }
    }
    None
}

#[test]
fn random_grids_are_met_where_marching_meets_them() {
    const N: usize = 6;
    const STEPS: usize = 8000;
    let mut rng = Rng::new(3);
    let values: Vec<f32> = (0..N * N * N).map(|_| rng.f32() - 0.35).collect();
    let wide: Vec<f64> = values.iter().map(|v| f64::from(*v)).collect();
    let sdf = SdfGrid::new([N; 3], values).unwrap();
    let sdf = Geometry::Sdf(Sdf::new(Arc::new(sdf), Transform::IDENTITY, false));
    let (mut met, mut apart) = (0, 0);
    for _ in 0..500 {
        let d = warp::uniform_sphere(rng.vec2());
        let through = Vec3::new(rng.f32(), rng.f32(), rng.f32());
        let r = Ray::new(through - d, d);
        let marched = march(&wide, N, r.o.as_dvec3(), r.d.as_dvec3(), STEPS);
        let found = meet(&sdf, &r).map(|(t, _)| f64::from(t));
        met += usize::from(found.is_some());
        // Marching misses what is thinner than a step, and begins half a step into the grid.
        let same = match (found, marched) {
            (Some(a), Some(b)) => (a - b).abs() < 2.0 * 2.0 / STEPS as f64,
            (a, b) => a.is_none() && b.is_none(),
        };
        apart += usize::from(!same);
    }
    assert!(met > 300, "{met}");
    assert!(apart <= 2, "{apart}");
}

#[test]
fn no_ray_leaves_a_closed_surface_unseen() {
    // Rays at corners, edges and faces of voxels, where one ends and the next begins.
    const N: usize = 9;
    let sdf = Geometry::Sdf(Sdf::new(grid([N; 3], ball), Transform::IDENTITY, false));
    let mut rng = Rng::new(4);
    for i in 0..20_000 {
        let snap = |v: f32, to: bool| if to { (v * 8.0).round() / 8.0 } else { v };
        let corner = Vec3::new(
            snap(rng.f32(), i & 1 == 0),
            snap(rng.f32(), i & 2 == 0),
            snap(rng.f32(), i & 4 == 0),
        );
        let o = Vec3::new(0.5, 0.5, 0.5);
        let Some(d) = (corner - o).try_normalize() else {
            continue;
        };
        assert!(meet(&sdf, &Ray::new(o, d)).is_some(), "{corner}");
    }
}

#[test]
fn leaving_rays_do_not_meet_the_surface_again() {
    let n = DVec3::new(0.3, 0.5, 0.8).normalize();
    let plane = grid([5, 7, 4], |p| n.dot(p - DVec3::splat(0.45)));
    let mut rng = Rng::new(5);
    for (scale, offset) in [
        (1.0, 0.0),
        (1e-6, 0.0),
        (1e6, 0.0),
        (1.0, 1e4),
        (1e-3, 10.0),
    ] {
        let place = Transform::translate(DVec3::splat(offset))
            * Transform::scale(DVec3::splat(scale)).unwrap();
        let sdf = Geometry::Sdf(Sdf::new(Arc::clone(&plane), place, false));
        let mut met = 0;
        for _ in 0..2000 {
            let local =
                |rng: &mut Rng| DVec3::new(rng.f32().into(), rng.f32().into(), rng.f32().into());
            let (from, to) = (
                place.point(local(&mut rng) + n),
                place.point(local(&mut rng)),
            );
            let Some(d) = (to - from).as_vec3().try_normalize() else {
                continue;
            };
            let Some((_, hit)) = meet(&sdf, &Ray::new(from.as_vec3(), d)) else {
                continue;
            };
            met += 1;
            assert!((hit.ng - n.as_vec3()).length() < 1e-4);
            // Also at grazing angles.
            let away = warp::uniform_sphere(rng.vec2());
            let away = away - hit.ng * (away.dot(hit.ng) * if met % 3 == 0 { 0.9999 } else { 0.0 });
            let wi = away.normalize();
            assert!(
                meet(&sdf, &hit.spawn(wi)).is_none(),
                "{scale} {offset} {wi} {:?}",
                hit.p
            );
        }
        assert!(met > 500, "{met}");
    }
}

#[test]
fn grids_without_a_surface_are_refused() {
    let refused = |size: [usize; 3], values: Vec<f32>, what: &str| {
        assert_eq!(SdfGrid::new(size, values), Err(what.to_string()));
    };
    refused(
        [2; 3],
        vec![1.0; 8],
        "the grid holds no surface: its values have all one sign",
    );
    refused(
        [2; 3],
        vec![1.0; 9],
        "a grid of 2 x 2 x 2 does not have 9 values",
    );
    refused(
        [1, 2, 2],
        vec![1.0; 4],
        "the grid has 1 x 2 x 2 values: it needs at least 2 along each axis",
    );
    refused(
        [2; 3],
        vec![f32::NAN; 8],
        "value 0 of the grid is not a finite number",
    );
    let huge = [usize::MAX / 2, 2, 2];
    assert!(SdfGrid::new(huge, vec![]).is_err());
}

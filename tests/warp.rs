//! Maps of the unit square against their densities.

mod common;

use common::{Chi2Plan, Domain, Rng, chi2_p_value, sidak};
use luxel::math::warp::*;
use luxel::math::{DVec3, Vec2, Vec3};

fn plane(lo: [f64; 2], hi: [f64; 2]) -> Chi2Plan {
    Chi2Plan {
        samples: 1_000_000,
        alpha: sidak(0.01, 20),
        domain: Domain::Plane { lo, hi },
    }
}

/// The unit disk as a rectangle: squared radius and azimuth. The rim would be a step in x and y, which no
/// quadrature likes.
fn disk_coordinates(p: Vec2) -> Vec3 {
    Vec3::new(p.length_squared(), p.y.atan2(p.x), 0.0)
}

fn disk_plan() -> Chi2Plan {
    let pi = std::f64::consts::PI;
    plane([0.0, -pi], [1.0, pi])
}

/// The triangle as a square: the second coordinate, and how far along its chord the point lies.
fn chord_coordinates(b: Vec2) -> Vec3 {
    Vec3::new((b.x / (1.0 - b.y)).min(1.0), b.y, 0.0)
}

#[test]
fn disk_is_uniform() {
    disk_plan().check(
        "disk",
        1,
        |rng| Some(disk_coordinates(concentric_disk(rng.vec2()))),
        |_| 0.5 * DISK_PDF,
    );
}

#[test]
fn triangle_is_uniform() {
    plane([0.0; 2], [1.0; 2]).check(
        "triangle",
        2,
        |rng| Some(chord_coordinates(triangle(rng.vec2()))),
        |c| TRIANGLE_PDF * (1.0 - c.y),
    );
}

#[test]
fn hemispheres_and_sphere_follow_their_pdf() {
    let [plan, upper] = [2.0, 1.0].map(|height| Chi2Plan::cap(height, sidak(0.01, 20)));
    upper.check(
        "cosine",
        3,
        |rng| Some(cosine_hemisphere(rng.vec2())),
        |w| cosine_hemisphere_pdf(w.z),
    );
    upper.check(
        "hemisphere",
        4,
        |rng| Some(uniform_hemisphere(rng.vec2())),
        |_| HEMISPHERE_PDF,
    );
    plan.check(
        "sphere",
        5,
        |rng| Some(uniform_sphere(rng.vec2())),
        |_| SPHERE_PDF,
    );
}

/// Cones from 1e-7 rad to nearly the whole sphere. A tiny cone is looked at through its tangent plane,
/// where a uniform cap is a uniform disk.
#[test]
fn cones_of_all_sizes_are_uniform() {
    for (seed, radius) in [1e-7f32, 1e-4].into_iter().enumerate() {
        let h = cap_height(radius * radius);
        disk_plan().check(
            "narrow cone",
            10 + seed as u64,
            |rng| {
                Some(disk_coordinates(
                    uniform_cone(rng.vec2(), h).truncate() / radius,
                ))
            },
            |_| 0.5 * uniform_cone_pdf(h) * radius * radius,
        );
    }
    for (seed, h) in [0.02f32, 0.7, 1.3, 1.999].into_iter().enumerate() {
        // The cap ends where the rounding of z still counts as inside.
        Chi2Plan::cap(f64::from(h) + 2e-7, sidak(0.01, 20)).check(
            "cone",
            20 + seed as u64,
            |rng| Some(uniform_cone(rng.vec2(), h)),
            |_| uniform_cone_pdf(h),
        );
    }
}

#[test]
fn directions_have_unit_length() {
    let mut rng = Rng::new(6);
    let edge = |rng: &mut Rng| match rng.f32() {
        v if v < 0.1 => 0.0,
        v if v < 0.2 => 1.0 - f32::EPSILON / 2.0,
        v if v < 0.3 => 0.5,
        _ => rng.f32(),
    };
    for _ in 0..100_000 {
        let u = Vec2::new(edge(&mut rng), edge(&mut rng));
        let h = 2.0 * rng.f32().powi(20);
        for w in [
            cosine_hemisphere(u),
            uniform_sphere(u),
            uniform_hemisphere(u),
            uniform_cone(u, h),
        ] {
            assert!(
                (w.length() - 1.0).abs() < 5e-7,
                "{w} of length {}",
                w.length()
            );
        }
        assert!(cosine_hemisphere(u).z > 0.0 && uniform_hemisphere(u).z >= 0.0);
        let b = triangle(u);
        assert!(b.min_element() >= 0.0 && b.x + b.y <= 1.0, "{b}");
    }
}

/// A rectangle seen from the origin: corner, edges, and the seed of its test.
fn rectangles() -> Vec<(&'static str, Vec3, Vec3, Vec3)> {
    let v = Vec3::new;
    vec![
        (
            "square",
            v(-0.5, -0.5, 1.0),
            v(1.0, 0.0, 0.0),
            v(0.0, 1.0, 0.0),
        ),
        (
            "aside",
            v(1.0, 0.5, 2.0),
            v(3.0, 0.0, 0.0),
            v(0.0, 0.0, 1.0),
        ),
        (
            "huge",
            v(-300.0, -100.0, -0.3),
            v(400.0, 0.0, 0.0),
            v(0.0, 500.0, 0.0),
        ),
        (
            "thin",
            v(-3.0, 0.2, 1.0),
            v(6.0, 0.0, 0.0),
            v(0.0, 0.004, 0.0),
        ),
        (
            "close to its plane",
            v(-1.0, 0.001, 0.5),
            v(2.0, 0.0, 0.0),
            v(0.0, 0.0, 2.0),
        ),
        (
            "small",
            v(10.0, 2.0, 3.0),
            v(0.0, 0.02, 0.0),
            v(0.0, 0.0, 0.02),
        ),
        (
            "tiny",
            v(1000.0, 20.0, 3.0),
            v(0.0, 0.2, 0.0),
            v(0.0, 0.0, 0.2),
        ),
    ]
}

/// Samples of parameters (s, t) follow the density in solid angle, turned into one over the square.
#[test]
fn rectangles_are_uniform_in_solid_angle() {
    for (seed, (name, corner, ex, ey)) in rectangles().into_iter().enumerate() {
        let r = SphericalRectangle::new(corner, ex, ey, Vec3::ZERO).unwrap();
        plane([0.0; 2], [1.0; 2]).check(
            name,
            30 + seed as u64,
            |rng| Some(r.sample(rng.vec2()).extend(0.0)),
            |st| per_area(corner + st.x * ex + st.y * ey, ex.cross(ey), |d| r.pdf(d)),
        );
    }
}

#[test]
fn triangles_are_uniform_in_solid_angle() {
    for (seed, (name, a, ex, ey)) in rectangles().into_iter().enumerate() {
        let t = SphericalTriangle::new(a, a + ex, a + ey, Vec3::ZERO).unwrap();
        plane([0.0; 2], [1.0; 2]).check(
            name,
            40 + seed as u64,
            |rng| Some(chord_coordinates(t.sample(rng.vec2()))),
            |c| {
                let b1 = c.x * (1.0 - c.y);
                (1.0 - c.y) * per_area(a + b1 * ex + c.y * ey, ex.cross(ey), |d| t.pdf(d))
            },
        );
    }
}

/// A density per steradian at `d` as one over parameters whose area element is the vector `da`.
fn per_area(d: Vec3, da: Vec3, pdf: impl Fn(Vec3) -> f32) -> f32 {
    pdf(d) * d.dot(da).abs() / d.length().powi(3)
}

/// Closed form of a centred square, and sums of parts, over eleven decades of size.
#[test]
fn solid_angles_are_right_at_any_size() {
    for e in -5..6 {
        let half = 10f64.powi(e);
        let h = half as f32;
        let exact = 4.0 * (half * half / (1.0 + half * half)).asin();
        let (ex, ey) = (Vec3::X * (2.0 * h), Vec3::Y * (2.0 * h));
        let corner = Vec3::new(-h, -h, 1.0);
        let r = SphericalRectangle::new(corner, ex, ey, Vec3::ZERO).unwrap();
        assert!(
            (f64::from(r.solid_angle()) / exact - 1.0).abs() < 1e-6,
            "{h}"
        );
        let [t0, t1] = [[ex, ex + ey], [ex + ey, ey]].map(|[p, q]| {
            SphericalTriangle::new(corner, corner + p, corner + q, Vec3::ZERO).unwrap()
        });
        let sum = f64::from(t0.solid_angle()) + f64::from(t1.solid_angle());
        assert!((sum / exact - 1.0).abs() < 1e-6, "{h}");
    }
    let flat = SphericalRectangle::new(Vec3::X, Vec3::X, Vec3::Y, Vec3::ZERO);
    assert!(flat.is_none(), "seen edge on");
    assert!(SphericalTriangle::new(Vec3::X, Vec3::X, Vec3::Y, Vec3::ZERO).is_none());
}

/// No NaN and nothing outside, whatever the shape: 20,000 random rectangles and triangles of all sizes.
#[test]
fn solid_angle_samples_stay_inside() {
    let mut rng = Rng::new(7);
    let mut vec = |s: f32| (Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 2.0 - 1.0) * s;
    for i in 0..20_000 {
        let size = 10f32.powi(i % 13 - 6);
        let (corner, ex, other) = (vec(1.0), vec(size), vec(1.0));
        let ey = ex.cross(other);
        let us = [vec(1.0).abs(), Vec3::ZERO, Vec3::ONE - f32::EPSILON / 2.0];
        for u in us.map(Vec3::truncate) {
            if let Some(r) = SphericalRectangle::new(corner, ex, ey, Vec3::ZERO) {
                let st = r.sample(u);
                assert!(
                    st.min_element() >= 0.0 && st.max_element() <= 1.0,
                    "{st} {corner} {ex} {ey}"
                );
            }
            if let Some(t) = SphericalTriangle::new(corner, corner + ex, corner + other, Vec3::ZERO)
            {
                let b = t.sample(u);
                assert!(
                    b.min_element() >= 0.0 && b.x + b.y <= 1.0 + 1e-6,
                    "{b} {corner} {ex} {other}"
                );
            }
        }
    }
}

/// Counts of `n` picks against the probabilities, by chi-square; cells of no weight are never picked.
fn check_picks(
    pick: impl Fn(f32) -> Pick,
    prob: impl Fn(usize) -> f32,
    weights: &[f32],
    seed: u64,
) {
    let n = 1_000_000;
    let total: f64 = weights.iter().map(|&w| f64::from(w)).sum();
    let mut counts = vec![0.0; weights.len()];
    let mut rest = (0.0, 0.0);
    let mut rng = Rng::new(seed);
    for _ in 0..n {
        let p = pick(rng.f32());
        assert_eq!(p.prob, prob(p.index));
        assert!((0.0..1.0).contains(&p.u));
        counts[p.index] += 1.0;
        rest = (rest.0 + f64::from(p.u), rest.1 + f64::from(p.u * p.u));
    }
    let mut chi2 = 0.0;
    let mut sum = 0.0;
    for (i, &count) in counts.iter().enumerate() {
        let p = f64::from(prob(i));
        assert!((p - f64::from(weights[i]) / total).abs() < 1e-5, "cell {i}");
        sum += p;
        if weights[i] == 0.0 {
            assert_eq!((count, p), (0.0, 0.0), "cell {i} has no weight");
        } else {
            chi2 += (count - p * f64::from(n)).powi(2) / (p * f64::from(n));
        }
    }
    assert!((sum - 1.0).abs() < 1e-5);
    let cells = weights.iter().filter(|w| **w > 0.0).count();
    assert!(
        chi2_p_value(chi2, cells as f64 - 1.0) > 0.001,
        "chi2 {chi2} of {cells} cells"
    );
    // What is left of the number is uniform: mean 1/2 and mean square 1/3.
    let n = f64::from(n);
    assert!((rest.0 / n - 0.5).abs() < 5.0 * (1.0 / 12.0 / n).sqrt());
    assert!((rest.1 / n - 1.0 / 3.0).abs() < 5.0 * (4.0 / 45.0 / n).sqrt());
}

#[test]
fn tables_pick_in_proportion() {
    let wavy: Vec<f32> = (0..300)
        .map(|i| (i % 7) as f32 + 0.3 * (i % 3) as f32)
        .collect();
    for (seed, w) in [
        &[2.0, 0.0, 1.0, 0.0][..],
        &[0.0, 5.0, 0.0, 1.0],
        &[7.0],
        &wavy,
    ]
    .into_iter()
    .enumerate()
    {
        let t = Tabulated1::new(w).unwrap();
        check_picks(|u| t.pick(u), |i| t.prob(i), w, 50 + seed as u64);
        let a = AliasTable::new(w).unwrap();
        check_picks(|u| a.pick(u), |i| a.prob(i), w, 60 + seed as u64);
    }
}

#[test]
fn tables_refuse_what_is_no_distribution() {
    for bad in [
        &[][..],
        &[0.0, 0.0],
        &[1.0, -1.0],
        &[f32::NAN, 1.0],
        &[f32::INFINITY],
    ] {
        assert!(
            Tabulated1::new(bad).is_none() && AliasTable::new(bad).is_none(),
            "{bad:?}"
        );
        assert!(Tabulated2::new(bad, bad.len(), 1).is_none(), "{bad:?}");
    }
    assert!(
        Tabulated2::new(&[1.0; 6], 4, 2).is_none(),
        "sizes do not fit"
    );
}

/// The ends of the table: no number picks a cell of no weight or lies outside, also at u = 1 - 2^-24.
#[test]
fn tables_end_exactly() {
    let last = 1.0 - f32::EPSILON / 2.0;
    let t = Tabulated1::new(&[0.0, 1.0, 3.0, 0.0]).unwrap();
    for (u, index) in [(0.0, 1), (0.249, 1), (0.251, 2), (last, 2), (1.0, 2)] {
        assert_eq!(t.pick(u).index, index, "{u}");
    }
    for n in [1, 3, 7, 1000, 8191, 8192] {
        let t = Tabulated1::new(&vec![0.1; n]).unwrap();
        for u in [0.0, 0.1, 0.333, 0.5, 0.999, last] {
            let (x, pdf) = t.sample(u);
            assert!((0.0..1.0).contains(&x) && pdf == t.pdf(x), "{n} {u} {x}");
        }
        assert_eq!((t.pdf(-1e-9), t.pdf(1.0)), (0.0, 0.0));
    }
}

/// Weights a billion times smaller than others are still in reach, and their probability is the share of
/// the numbers that pick them.
#[test]
fn tiny_weights_are_still_sampled() {
    let mut w = vec![1e-9f32; 1000];
    w[500] = 1e9;
    let t = Tabulated1::new(&w).unwrap();
    let steps = 1 << 24;
    let mut counts = vec![0u32; w.len()];
    for i in 0..steps {
        counts[t.pick(i as f32 / steps as f32).index] += 1;
    }
    for (i, &count) in counts.iter().enumerate() {
        assert!(count > 0, "cell {i} is out of reach");
        assert_eq!(t.prob(i) * steps as f32, count as f32, "cell {i}");
    }
}

#[test]
fn a_map_of_two_dimensions_follows_its_pdf() {
    let (w, h) = (37, 20);
    let weights: Vec<f32> = (0..w * h)
        .map(|i| {
            if i % 11 == 0 || i / w == 5 {
                0.0
            } else {
                (i % 13) as f32 + 20.0 * f32::from(i == 333)
            }
        })
        .collect();
    let t = Tabulated2::new(&weights, w, h).unwrap();
    let mut rng = Rng::new(8);
    let n = 1_000_000;
    let (mut counts, mut inverse) = (vec![0.0; w * h], 0.0);
    for _ in 0..n {
        let (p, pdf) = t.sample(rng.vec2());
        assert_eq!(pdf, t.pdf(p));
        counts[(p.y * h as f32) as usize * w + (p.x * w as f32) as usize] += 1.0;
        inverse += 1.0 / f64::from(pdf);
    }
    let total: f32 = weights.iter().sum();
    let mut chi2 = 0.0;
    let cells = weights.iter().filter(|w| **w > 0.0).count();
    for (&count, &weight) in counts.iter().zip(&weights) {
        let e = f64::from(weight / total) * f64::from(n);
        if weight == 0.0 {
            assert_eq!(count, 0.0);
        } else {
            chi2 += (count - e).powi(2) / e;
        }
    }
    assert!(
        chi2_p_value(chi2, cells as f64 - 1.0) > 0.001,
        "chi2 {chi2} of {cells} cells"
    );
    let area = cells as f64 / (w * h) as f64;
    assert!(
        (inverse / f64::from(n) / area - 1.0).abs() < 0.01,
        "{inverse}"
    );
}

/// The size of a large environment map: one bright cell among 33 million dim ones, whose row and the
/// dimmest cells keep their share.
#[test]
fn a_large_map_keeps_sun_and_night() {
    let (w, h) = (8192, 64);
    let mut weights = vec![1e-6f32; w * h];
    weights[7 * w + 4000] = 1e6;
    weights[63 * w..].fill(0.0);
    let t = Tabulated2::new(&weights, w, h).unwrap();
    let cell =
        |x: usize, y: usize| Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
    let sun = t.pdf(cell(4000, 7)) / (w * h) as f32;
    assert!(sun > 0.999, "{sun}");
    for (x, y) in [(0, 0), (8191, 7), (3, 62)] {
        assert!(t.pdf(cell(x, y)) > 0.0, "{x} {y}");
    }
    assert_eq!(t.pdf(cell(5, 63)), 0.0);
}

/// The mean direction of a cap of half-angle a lies at height cos²(a/2); a cheap check of the scale of
/// [`uniform_cone`] that no chart takes part in.
#[test]
fn cone_has_its_mean_height() {
    let mut rng = Rng::new(9);
    for h in [0.1f32, 1.0, 2.0] {
        let n = 100_000;
        let sum: DVec3 = (0..n).map(|_| uniform_cone(rng.vec2(), h).as_dvec3()).sum();
        let mean = sum / f64::from(n);
        let error = mean.z - (1.0 - 0.5 * f64::from(h));
        assert!(
            error.abs() < 5.0 * f64::from(h) / (12.0 * f64::from(n)).sqrt(),
            "{h}: {error}"
        );
    }
}

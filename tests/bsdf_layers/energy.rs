//! How much light comes back.

use super::*;

/// Means of the weights of what is reflected and of what passes, and their standard errors.
fn furnace(bsdf: Bsdf, wo: Vec3, seed: u64, n: u32) -> [(f64, f64); 2] {
    let mut rng = Rng::new(seed);
    let mut sums = [[0.0; 2]; 2];
    for _ in 0..n {
        if let Some(s) = bsdf.sample(wo, rng.f32(), rng.vec2(), P) {
            let (side, w) = (usize::from(s.wi.z * wo.z < 0.0), f64::from(s.weight.g));
            sums[side] = [sums[side][0] + w, sums[side][1] + w * w];
        }
    }
    sums.map(|[sum, sum2]| {
        let (n, mean) = (f64::from(n), sum / f64::from(n));
        (mean, ((sum2 / n - mean * mean).max(0.0) / n).sqrt())
    })
}

/// No glass makes light, from either side; both ways to choose normals scatter the same share of it; and
/// what passes is what the table of a coat says.
#[test]
fn glass_furnace_is_at_most_one() {
    for shape in SHAPES {
        for (i, (alpha, eta)) in [(0.05, 1.5), (0.4, 1.33), (1.0, 2.0), (0.3, 4.0)]
            .into_iter()
            .enumerate()
        {
            let coat = Coat::of(shape, alpha, eta);
            for node in [4, 32, -10, -50] {
                // A direction that the table holds.
                let cos = f64::from(node) / 63.0;
                let wo = direction(cos.acos().to_degrees(), 20.0);
                let seed = (i as i32 + 10 * node).unsigned_abs().into();
                let [r, t] = furnace(glass(shape, [alpha; 2], eta, true), wo, seed, 300_000);
                let [ra, ta] = furnace(glass(shape, [alpha; 2], eta, false), wo, seed + 7, 100_000);
                let name = format!("{shape:?} {alpha} {eta} at {cos}: {r:?} {t:?}, {ra:?} {ta:?}");
                assert!(r.0 + t.0 <= 1.0 + 1e-6, "{name}");
                for (a, b) in [(r, ra), (t, ta)] {
                    assert!((a.0 - b.0).abs() < 4.5 * a.1.hypot(b.1) + 1e-6, "{name}");
                }
                if node > 0 {
                    let through = f64::from(coat.through(cos as f32));
                    assert!(
                        (t.0 - through).abs() < 4.5 * t.1 + 1e-3 * through,
                        "{name}: {through}"
                    );
                    assert!(
                        4.5 * t.1 < 0.012 * through,
                        "{name}: the test would not see 1 %"
                    );
                }
            }
        }
    }
}

/// A white base under a boundary that absorbs nothing, with all reflections below counted.
#[test]
fn white_plastic_returns_everything() {
    for eta in [1.0f32, 1.1, 1.5, 2.0, 0.8] {
        for nonlinear in [false, true] {
            let bsdf = plastic(eta, nonlinear, Rgb::WHITE, Rgb::WHITE);
            for polar in [0.0, 50.0, 75.0] {
                let wo = direction(polar, 20.0);
                let [(mean, error), _] = furnace(bsdf, wo, 11, 100_000);
                assert!(
                    (mean - 1.0).abs() < 4.5 * error + 1e-4,
                    "{eta} {polar}: {mean} {error}"
                );
                assert!((bsdf.albedo(wo).g - 1.0).abs() < 1e-4, "{eta} {polar}");
            }
        }
    }
    // What passes two facets or more is lost, so rough plastic returns less.
    for shape in SHAPES {
        for (alpha, eta) in COATS {
            let facets = Microfacet::new(shape, alpha, alpha);
            let bsdf = rough_plastic(facets, eta, true, Rgb::WHITE, Rgb::WHITE);
            for polar in [0.0, 50.0, 85.0] {
                let [(mean, error), _] = furnace(bsdf, direction(polar, 20.0), 12, 50_000);
                assert!(
                    mean < 1.0 + 4.5 * error + 1e-4,
                    "{bsdf:?} {polar}: {mean} {error}"
                );
                let low = if alpha < 0.05 { 0.95 } else { 0.1 };
                assert!(mean > low || eta < 1.0, "{bsdf:?} {polar}: {mean} {error}");
            }
        }
    }
}

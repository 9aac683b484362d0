//! How fast errors fall: slopes fitted to logarithms of the root of the mean square over several seeds.

use crate::rooms::{self, Room, quad, room};
use luxel::math::DVec3;
use luxel::radiosity::FormFactorMethod::{self, Analytic, Hemicube, MonteCarlo};
use luxel::radiosity::form_factors::analytic::lambert;
use luxel::radiosity::form_factors::polygon::Polygon;

const V: fn(f64, f64, f64) -> DVec3 = DVec3::new;

/// The exponent of the power law through the errors at `counts`, by least squares.
fn slope(name: &str, counts: &[u32], error: impl Fn(u32) -> f64) -> f64 {
    let points: Vec<[f64; 2]> = counts
        .iter()
        .map(|&n| [f64::from(n).ln(), error(n).ln()])
        .collect();
    let mean = |i: usize| points.iter().map(|p| p[i]).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(0), mean(1));
    let xy: f64 = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
    let xx: f64 = points.iter().map(|p| (p[0] - x).powi(2)).sum();
    let errors: Vec<f64> = points.iter().map(|p| p[1].exp()).collect();
    println!("{name}: slope {:.3}, errors {errors:?}", xy / xx);
    xy / xx
}

fn rms(room: &Room, expected: f64, seeds: u64, method: FormFactorMethod) -> f64 {
    let squares =
        (0..seeds).map(|seed| (room.first_to_others(method, seed) / expected - 1.0).powi(2));
    (squares.sum::<f64>() / seeds as f64).sqrt()
}

fn corner() -> (Room, f64) {
    let floor = quad(V(0.0, 0.0, 0.0), V(1.0, 0.0, 0.0), V(0.0, 1.0, 0.0));
    let wall = quad(V(0.0, 0.0, 0.0), V(0.0, 1.0, 0.0), V(0.0, 0.0, 1.0));
    let room = room(&(floor + &wall), f64::INFINITY, 1e-3);
    (room, rooms::perpendicular(1.0, 1.0, 1.0))
}

fn facing(distance: f64) -> (Room, f64) {
    let floor = quad(V(0.0, 0.0, 0.0), V(1.0, 0.0, 0.0), V(0.0, 1.0, 0.0));
    let other = quad(V(0.0, 0.0, distance), V(0.0, 1.0, 0.0), V(1.0, 0.0, 0.0));
    let room = room(&(floor + &other), f64::INFINITY, 1e-3);
    (room, rooms::parallel(1.0, 1.0, distance))
}

/// A square in the middle between two others, which hides just the square of twice its size on the far one from
/// the middle of the near one. It takes no part: from above and below it is black.
fn screened() -> Room {
    let floor = quad(V(0.0, 0.0, 0.0), V(1.0, 0.0, 0.0), V(0.0, 1.0, 0.0));
    let other = quad(V(0.0, 0.0, 3.0), V(0.0, 1.0, 0.0), V(1.0, 0.0, 0.0));
    let screen = quad(V(0.1, 0.25, 1.5), V(0.45, 0.0, 0.2), V(0.0, 0.4, 0.0));
    let black = r#"<bsdf type="conductor"><rgb name="specular_reflectance" value="0"/></bsdf>"#;
    let screen = screen.replace(r#"<bsdf type="diffuse"/>"#, black);
    room(&(floor + &other + &screen), f64::INFINITY, 1e-3)
}

#[test]
fn hemicubes_converge_with_the_resolution() {
    // Far enough for a single hemicube: compared with what its point sees.
    let (room, _) = facing(3.0);
    let [floor, other] = [0, 1].map(|i| room.mesh.patches[i].piece);
    let expected = lambert(
        floor.center(),
        floor.normal(),
        &Polygon::from(&other),
        other.normal(),
    );
    let error = |resolution| rms(&room, expected, 24, Hemicube { resolution });
    let slope = slope("hemicube", &[32, 64, 128, 256], error);
    // A square in a grid errs by its outline: 1/res, and faster when the errors along it cancel.
    assert!((-1.8..-0.9).contains(&slope), "{slope}");
}

#[test]
fn monte_carlo_beats_independent_samples() {
    let counts = [16, 64, 256, 1024];
    let (room, expected) = facing(3.0);
    let by_pairs = slope("pairs", &counts, |samples| {
        rms(&room, expected, 24, MonteCarlo { samples })
    });
    assert!(by_pairs < -0.75, "{by_pairs}");
    let (room, expected) = corner();
    let by_directions = slope("directions", &counts[..3], |samples| {
        rms(&room, expected, 24, MonteCarlo { samples })
    });
    assert!(by_directions < -0.6, "{by_directions}");
    let room = screened();
    let expected = room.first_to_others(MonteCarlo { samples: 1 << 19 }, 99);
    let hidden = slope("hidden", &counts, |samples| {
        rms(&room, expected, 24, MonteCarlo { samples })
    });
    assert!(hidden < -0.55, "{hidden}");
}

#[test]
fn analytic_converges_geometrically_and_like_rays_behind_screens() {
    let (room, expected) = facing(1.6);
    let error = |samples| rms(&room, expected, 1, Analytic { samples });
    let free = slope("analytic", &[1, 4, 9, 16], error);
    // Each further point in a row gains more than (2.27)²: between 1 and 16 points, more than 100.
    assert!(free < -2.0, "{free}");
    let room = screened();
    let expected = room.first_to_others(MonteCarlo { samples: 1 << 19 }, 98);
    let error = |samples| rms(&room, expected, 24, Analytic { samples });
    let hidden = slope("analytic, hidden", &[16, 64, 256, 1024], error);
    assert!(hidden < -0.55, "{hidden}");
}

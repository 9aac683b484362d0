//! Without anything between.

use crate::rooms::{self, quad, room};
use luxel::math::DVec3;
use luxel::radiosity::FormFactorMethod::{self, Analytic};

const V: fn(f64, f64, f64) -> DVec3 = DVec3::new;

/// Content of a scene, size of patches, and the form factor from its first shape to its second.
fn catalogue() -> Vec<(&'static str, String, f64, f64)> {
    let facing = |a: f64, b: f64, c: f64| {
        let low = quad(V(0.0, 0.0, 0.0), V(a, 0.0, 0.0), V(0.0, b, 0.0));
        low + &quad(V(0.0, 0.0, c), V(0.0, b, 0.0), V(a, 0.0, 0.0))
    };
    let corner = |l: f64, w: f64, h: f64| {
        let floor = quad(V(0.0, 0.0, 0.0), V(w, 0.0, 0.0), V(0.0, l, 0.0));
        floor + &quad(V(0.0, 0.0, 0.0), V(0.0, l, 0.0), V(0.0, 0.0, h))
    };
    let whole = f64::INFINITY;
    vec![
        (
            "parallel squares",
            facing(1.0, 1.0, 1.0),
            whole,
            rooms::parallel(1.0, 1.0, 1.0),
        ),
        (
            "near squares",
            facing(1.0, 1.0, 0.01),
            whole,
            rooms::parallel(1.0, 1.0, 0.01),
        ),
        (
            "far squares",
            facing(1.0, 1.0, 300.0),
            whole,
            rooms::parallel(1.0, 1.0, 300.0),
        ),
        (
            "parallel strips",
            facing(2.0, 0.1, 0.7),
            whole,
            rooms::parallel(2.0, 0.1, 0.7),
        ),
        (
            "parallel, in parts",
            facing(1.0, 1.0, 0.3),
            0.26,
            rooms::parallel(1.0, 1.0, 0.3),
        ),
        (
            "corner",
            corner(1.0, 1.0, 1.0),
            whole,
            rooms::perpendicular(1.0, 1.0, 1.0),
        ),
        (
            "low corner",
            corner(1.0, 1.0, 0.01),
            whole,
            rooms::perpendicular(1.0, 1.0, 0.01),
        ),
        (
            "long corner",
            corner(10.0, 1.0, 2.0),
            whole,
            rooms::perpendicular(10.0, 1.0, 2.0),
        ),
        (
            "corner, in parts",
            corner(1.0, 1.0, 1.5),
            0.3,
            rooms::perpendicular(1.0, 1.0, 1.5),
        ),
    ]
}

fn check(method: FormFactorMethod, tolerance: f64) {
    for (name, content, size, expected) in catalogue() {
        let room = room(&content, size, 1e-3);
        let found = room.between(&room.matrix(method, 1), 0, 1);
        println!("{name}: {found} {expected} {:e}", found / expected - 1.0);
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "{name}: {found}, expected {expected}"
        );
    }
}

#[test]
fn analytic_is_exact_between_rectangles() {
    check(Analytic { samples: 16 }, 1e-6);
}

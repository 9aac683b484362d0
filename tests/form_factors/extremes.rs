//! Patches that touch, lie in one plane, are needles, or differ much in size: finite, from 0 to 1, no panic.

use crate::rooms::{block, inside, quad, room};
use luxel::math::DVec3;
use luxel::radiosity::FormFactorMethod::{self, Analytic, Hemicube, MonteCarlo};

const V: fn(f64, f64, f64) -> DVec3 = DVec3::new;

const METHODS: [FormFactorMethod; 5] = [
    Analytic { samples: 16 },
    Analytic { samples: 0 },
    MonteCarlo { samples: 16 },
    MonteCarlo { samples: 0 },
    Hemicube { resolution: 32 },
];

fn check(name: &str, content: &str, size: f64) {
    let room = room(content, size, 1e-2);
    for method in METHODS {
        let matrix = room.matrix(method, 1);
        for i in 0..matrix.n {
            for (j, f) in matrix.row(i).iter().enumerate() {
                let what = format!("{name}, {method:?}: F of {i} to {j} is {f}");
                assert!((0.0..=1.0 + 1e-9).contains(f), "{what}");
            }
            let sum: f64 = matrix.row(i).iter().sum();
            assert!(sum.is_finite(), "{name}, {method:?}");
        }
    }
}

#[test]
fn odd_patches_have_sound_form_factors() {
    let square = |z: f64| quad(V(0.0, 0.0, z), V(1.0, 0.0, 0.0), V(0.0, 1.0, 0.0));
    let turned = |z: f64| quad(V(0.0, 0.0, z), V(0.0, 1.0, 0.0), V(1.0, 0.0, 0.0));
    check("twice the same", &(square(0.0) + &square(0.0)), 0.5);
    check("face to face", &(square(0.0) + &turned(0.0)), 0.5);
    check("nearly face to face", &(square(0.0) + &turned(1e-7)), 0.5);
    let beside = quad(V(1.0, 0.0, 0.0), V(1.0, 0.0, 0.0), V(0.0, 1.0, 1e-7));
    check("in one plane", &(square(0.0) + &beside), 0.5);
    let needle = quad(V(0.0, 0.0, 0.0), V(1.0, 0.3, 0.0), V(1.0, 0.3, 1e-6));
    check(
        "a needle that stands",
        &(square(0.0) + &needle),
        f64::INFINITY,
    );
    let across = quad(V(0.5, -1.0, -0.5), V(0.0, 3.0, 0.1), V(0.3, 0.0, 1.0));
    check("one through another", &(square(0.0) + &across), 0.5);
    let cube = block(
        V(0.3, 0.3, -0.5),
        [V(0.4, 0.1, 0.0), V(-0.1, 0.4, 0.1), V(0.0, 0.0, 1.0)],
    );
    check(
        "a block through the floor",
        &(inside(V(0.0, 0.0, 0.0), V(1.0, 1.0, 1.0)) + &cube),
        0.6,
    );
}

#[test]
fn patches_of_all_sizes_have_sound_form_factors() {
    let large = quad(
        V(-500.0, -500.0, 0.0),
        V(1000.0, 0.0, 0.0),
        V(0.0, 1000.0, 0.0),
    );
    let small = |o: DVec3| quad(o, V(0.0, 1e-6, 0.0), V(1e-6, 0.0, 0.0));
    let standing = quad(V(0.0, 0.0, 0.0), V(0.0, 1e-6, 0.0), V(0.0, 0.0, 1e-6));
    let content = large + &small(V(0.0, 0.0, 1.0)) + &small(V(0.0, 0.0, 1e-6)) + &standing;
    check("area 1e-12 beside 1e6", &content, f64::INFINITY);
    let room = room(&content, f64::INFINITY, 1e-2);
    let matrix = room.matrix(Analytic { samples: 16 }, 1);
    // What hovers sees nothing but the floor; what stands on it sees half of it, less what is beyond.
    assert!((matrix.row(1)[0] - 1.0).abs() < 1e-4, "{:?}", matrix.row(1));
    assert!((matrix.row(3)[0] - 0.5).abs() < 1e-3, "{:?}", matrix.row(3));
}

/// A room of any size has the same form factors, up to the rounding of coordinates.
#[test]
fn form_factors_have_no_unit() {
    for method in [METHODS[0], METHODS[2], METHODS[4]] {
        let matrix = |scale: f64| {
            let high = V(2.0, 1.0, 1.0) * scale;
            let edges = [V(0.4, 0.1, 0.0), V(-0.1, 0.4, 0.0), V(0.0, 0.0, 0.5)].map(|e| e * scale);
            let content = inside(DVec3::ZERO, high) + &block(V(0.6, 0.3, 0.2) * scale, edges);
            room(&content, 0.6 * scale, 1e-3).matrix(method, 1)
        };
        let unit = matrix(1.0);
        for scale in [1e-6, 1e6] {
            let scaled = matrix(scale);
            assert_eq!(unit.n, scaled.n);
            let pairs = unit.f.iter().zip(&scaled.f);
            let off = pairs.map(|(a, b)| (a - b).abs()).sum::<f64>() / unit.n as f64;
            println!("{method:?} {scale:e}: {off:e}");
            // Which of two patches of equal area comes first may change, and with it the points between them.
            assert!(off < 0.02, "{method:?} at {scale}: {off}");
        }
    }
}

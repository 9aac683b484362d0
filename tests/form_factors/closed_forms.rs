//! Without anything between: Howell's catalogue, with each method within its stated error.

use crate::rooms::{self, Room, quad, room};
use luxel::math::DVec3;
use luxel::radiosity::FormFactorMethod::{self, Analytic, Hemicube, MonteCarlo};

const V: fn(f64, f64, f64) -> DVec3 = DVec3::new;

/// Two surfaces, and the form factor from the first to the second.
struct Case {
    name: &'static str,
    room: Room,
    expected: f64,
    /// Of the patches as such, relative: flat ones in the place of curved shapes.
    tolerance: f64,
}

fn facing(a: f64, b: f64, c: f64) -> String {
    let low = quad(V(0.0, 0.0, 0.0), V(a, 0.0, 0.0), V(0.0, b, 0.0));
    low + &quad(V(0.0, 0.0, c), V(0.0, b, 0.0), V(a, 0.0, 0.0))
}

fn corner(l: f64, w: f64, h: f64) -> String {
    let floor = quad(V(0.0, 0.0, 0.0), V(w, 0.0, 0.0), V(0.0, l, 0.0));
    floor + &quad(V(0.0, 0.0, 0.0), V(0.0, l, 0.0), V(0.0, 0.0, h))
}

fn disk(radius: f64, height: f64, up: bool) -> String {
    let turn = if up { 0.0 } else { 180.0 };
    format!(
        r#"<shape type="disk"><transform name="to_world"><scale value="{radius}"/><rotate x="1" angle="{turn}"/>
        <translate z="{height}"/></transform><bsdf type="diffuse"/></shape>"#
    )
}

fn sphere(radius: f64) -> String {
    format!(
        r#"<shape type="sphere"><float name="radius" value="{radius}"/><bsdf type="diffuse"/></shape>"#
    )
}

fn rectangles() -> Vec<Case> {
    let whole = f64::INFINITY;
    let case = |name, content: String, size, expected| Case {
        name,
        room: room(&content, size, 1e-3),
        expected,
        tolerance: 0.0,
    };
    vec![
        case(
            "squares",
            facing(1.0, 1.0, 1.0),
            whole,
            rooms::parallel(1.0, 1.0, 1.0),
        ),
        case(
            "near squares",
            facing(1.0, 1.0, 0.01),
            whole,
            rooms::parallel(1.0, 1.0, 0.01),
        ),
        case(
            "far squares",
            facing(1.0, 1.0, 30.0),
            whole,
            rooms::parallel(1.0, 1.0, 30.0),
        ),
        case(
            "strips",
            facing(2.0, 0.1, 0.7),
            whole,
            rooms::parallel(2.0, 0.1, 0.7),
        ),
        case(
            "squares in parts",
            facing(1.0, 1.0, 0.3),
            0.26,
            rooms::parallel(1.0, 1.0, 0.3),
        ),
        case(
            "corner",
            corner(1.0, 1.0, 1.0),
            whole,
            rooms::perpendicular(1.0, 1.0, 1.0),
        ),
        case(
            "low corner",
            corner(1.0, 1.0, 0.01),
            whole,
            rooms::perpendicular(1.0, 1.0, 0.01),
        ),
        case(
            "long corner",
            corner(10.0, 1.0, 2.0),
            whole,
            rooms::perpendicular(10.0, 1.0, 2.0),
        ),
        case(
            "corner in parts",
            corner(1.0, 1.0, 1.5),
            0.3,
            rooms::perpendicular(1.0, 1.0, 1.5),
        ),
    ]
}

fn curved() -> Vec<Case> {
    let curve_error = 4e-3;
    let case = |name, content: String, size, expected| Case {
        name,
        room: room(&content, size, curve_error),
        expected,
        // The area within the outline of a disk, or what a polyhedron shows of itself: twice the share of the radius
        // for each of both.
        tolerance: 4.0 * curve_error,
    };
    let floor = quad(V(0.0, 0.0, -2.0), V(3.0, 0.0, 0.0), V(0.0, 1.5, 0.0));
    vec![
        case(
            "disks",
            disk(1.0, 0.0, true) + &disk(0.5, 0.8, false),
            f64::INFINITY,
            rooms::disks(1.0, 0.5, 0.8),
        ),
        // From the flat surface: what a sphere gives to it, by reciprocity.
        case(
            "disk and sphere",
            disk(1.5, -2.0, true) + &sphere(0.5),
            f64::INFINITY,
            rooms::sphere_to_disk(1.5, 2.0) * 4.0 * 0.25 / (1.5 * 1.5),
        ),
        case(
            "rectangle and sphere",
            floor + &sphere(0.5),
            1.0,
            rooms::sphere_to_rectangle(3.0, 1.5, 2.0) * std::f64::consts::PI / 4.5,
        ),
    ]
}

fn check(cases: &[Case], method: FormFactorMethod, tolerance: f64) {
    for case in cases {
        let found = case.room.first_to_others(method, 1);
        let off = found / case.expected - 1.0;
        println!(
            "{method:?} {}: {found} {} {off:e}",
            case.name, case.expected
        );
        let tolerance = tolerance + case.tolerance;
        assert!(
            off.abs() < tolerance,
            "{}: {found}, expected {}",
            case.name,
            case.expected
        );
    }
}

#[test]
fn analytic_is_exact_between_rectangles() {
    check(&rectangles(), Analytic { samples: 16 }, 1e-6);
}

#[test]
fn analytic_is_right_for_curved_shapes() {
    check(&curved(), Analytic { samples: 9 }, 1e-3);
}

#[test]
fn hemicubes_are_right_to_their_resolution() {
    // Left out: what points in the middles of cells do not see, what covers few pixels, and what hides below the
    // lowest row of pixels.
    let mut cases = rectangles();
    cases.retain(|case| !["near squares", "far squares", "low corner"].contains(&case.name));
    check(&cases, Hemicube { resolution: 256 }, 0.02);
    check(&curved(), Hemicube { resolution: 128 }, 0.02);
}

/// Means over independent seeds: 4.5 standard errors, which are small enough for an error of 1 % to be seen.
#[test]
fn monte_carlo_is_unbiased() {
    const SEEDS: u32 = 24;
    let cases = rectangles().into_iter().map(|case| (case, 192));
    // The sum over many small patches errs less.
    let ball = curved().pop();
    for (case, samples) in cases.chain(ball.into_iter().map(|case| (case, 24))) {
        let mut seed = 0;
        let (mean, error) = crate::common::mean_and_error(SEEDS, || {
            seed += 1;
            case.room.first_to_others(MonteCarlo { samples }, seed)
        });
        let expected = case.expected;
        println!("{}: {mean} +- {error}, {expected}", case.name);
        assert!(
            error < 2e-3 * expected,
            "{}: {error} says too little",
            case.name
        );
        let bound = 4.5 * error + case.tolerance * expected;
        assert!(
            (mean - expected).abs() < bound,
            "{}: {mean} +- {error}, expected {expected}",
            case.name
        );
    }
}

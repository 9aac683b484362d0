//! Lights that are no patches, and what the report says of a scene.

use crate::rooms::*;
use luxel::radiosity::{Rgb64, Solution, Solver};
use std::f64::consts::PI;

/// A plate of this albedo, one unit square in the plane z = 0, and something that shines on it.
fn plate(albedo: f64, light: &str) -> Solution {
    let plate = shape("rectangle", "<scale value='0.5'/>", &diffuse(albedo));
    solve(
        &scene(&(plate + light)),
        &spec(Solver::GaussSeidel, 0.125, 1e-6),
    )
}

fn mean_irradiance(solution: &Solution) -> Rgb64 {
    let patches = solution.mesh.patches.iter().zip(&solution.irradiance);
    patches.map(|(p, &e)| e * p.area).sum::<Rgb64>() / solution.mesh.area()
}

#[test]
fn a_point_lights_each_patch_by_distance_and_angle() {
    let light = "<emitter type='point'><point name='position' x='0.2' y='-0.1' z='0.5'/>\
                 <rgb name='intensity' value='3'/></emitter>";
    let solution = plate(0.5, light);
    for (patch, e) in solution.mesh.patches.iter().zip(&solution.irradiance) {
        // The mean over the patch, by the midpoint rule.
        let n = 16;
        let at = |i: usize| {
            let u = luxel::math::DVec2::new((i % n) as f64 + 0.5, (i / n) as f64 + 0.5);
            let d = luxel::math::DVec3::new(0.2, -0.1, 0.5) - patch.piece.at(u / n as f64);
            3.0 * d.z / d.length().powi(3)
        };
        let expected = (0..n * n).map(at).sum::<f64>() / (n * n) as f64;
        assert!((e.x / expected - 1.0).abs() < 2e-3, "{e} {expected}");
    }
    let r = &solution.report;
    assert!(r.emitted == Rgb64::ZERO && r.external.x > 0.0);
    assert!((r.absorbed / r.external - 0.5).abs().max_element() < 1e-6);
    assert!((r.escaped / r.external - 0.5).abs().max_element() < 1e-6);
}

#[test]
fn far_lights_have_their_irradiance() {
    let sun = "<emitter type='directional'><vector name='direction' x='3' y='0' z='-4'/>\
               <rgb name='irradiance' value='5'/></emitter>";
    let sky = "<emitter type='constant'><rgb name='radiance' value='0.7'/></emitter>";
    for (light, expected, within) in [(sun, 4.0, 1e-5), (sky, 0.7 * PI, 3e-3)] {
        let found = mean_irradiance(&plate(0.5, light)).x;
        assert!(
            (found / expected - 1.0).abs() < within,
            "{found} {expected}"
        );
    }
    let both = mean_irradiance(&plate(0.5, &format!("{sun}{sky}"))).x;
    assert!((both / (4.0 + 0.7 * PI) - 1.0).abs() < 1e-2, "{both}");
}

#[test]
fn a_spot_and_a_shadow() {
    let spot = "<emitter type='spot'><transform name='to_world'>\
                <lookat origin='0, 0, 2' target='0, 0, 0' up='0, 1, 0'/></transform>\
                <rgb name='intensity' value='2'/><float name='cutoff_angle' value='5'/>\
                <float name='beam_width' value='4.9'/></emitter>";
    let solution = plate(0.5, spot);
    // The cone has a radius of 0.17: no light in the corners, I/d² in the middle.
    for (patch, e) in solution.mesh.patches.iter().zip(&solution.irradiance) {
        let r = patch.piece.center().length();
        match r {
            r if r < 0.09 => assert!((e.x / 0.5 - 1.0).abs() < 0.05, "{e}"),
            r if r > 0.27 => assert_eq!(*e, Rgb64::ZERO),
            _ => {}
        }
    }
    let screen = shape(
        "rectangle",
        "<scale value='0.4'/><translate z='0.5'/>",
        &format!("<bsdf type='twosided'>{}</bsdf>", diffuse(0.0)),
    );
    let shaded = plate(0.5, &format!("{spot}{screen}"));
    assert_eq!(mean_irradiance(&shaded), Rgb64::ZERO);
    assert_eq!(shaded.radiosity.iter().sum::<Rgb64>(), Rgb64::ZERO);
    let said = &shaded.report.warnings;
    assert!(
        said.iter().any(|w| w.starts_with("no light arrives")),
        "{said:?}"
    );
}

#[test]
fn lamps_with_and_without_patches_count_once() {
    // The same square lamp standing still, and in a motion too small to matter.
    let lamp = |place: &str| {
        let inner = "<scale value='0.2'/><rotate x='1' angle='180'/><translate z='0.5'/>";
        let children = format!("{}{}", diffuse(0.0), shining(2.0));
        match place {
            "" => shape("rectangle", inner, &children),
            _ => format!(
                "<shape type='rectangle'><animation name='to_world'>\
                 <transform time='0'>{inner}</transform>\
                 <transform time='1'>{inner}<translate x='1e-4'/></transform>\
                 </animation>{children}</shape>"
            ),
        }
    };
    let still = plate(0.5, &lamp(""));
    let moving = plate(0.5, &lamp("moving"));
    let (a, b) = (mean_irradiance(&still), Rgb64::ZERO);
    assert!(a != b);
    let plate_only = moving.mesh.len();
    assert!(plate_only < still.mesh.len());
    let on_plate: Rgb64 = still.irradiance[..plate_only].iter().sum();
    let all: Rgb64 = moving.irradiance.iter().sum();
    assert!((all.x / on_plate.x - 1.0).abs() < 5e-3, "{all} {on_plate}");
    assert!(still.report.external == Rgb64::ZERO && moving.report.emitted == Rgb64::ZERO);
    let said = &moving.report.warnings;
    assert!(
        said.iter().any(|w| w.starts_with("1 shape in motion")),
        "{said:?}"
    );
}

#[test]
fn other_scattering_is_told_with_its_share() {
    let light = box_inside(2.0, &(diffuse(0.3) + &shining(1.0)));
    let mirror = shape(
        "rectangle",
        "<scale value='0.5'/>",
        "<bsdf type='conductor'/>",
    );
    let plastic = shape(
        "sphere",
        "<translate z='1'/><scale value='0.5'/>",
        "<bsdf type='plastic'/>",
    );
    let spec = spec(Solver::GaussSeidel, 1.0, 1e-6);
    let plain = solve(&scene(&light), &spec);
    assert!(plain.report.other == 0.0 && plain.report.warnings.is_empty());
    let solution = solve(&scene(&format!("{light}{mirror}{plastic}")), &spec);
    let r = &solution.report;
    // Of the ball, which takes some per cent of the light, the coat reflects some per cent.
    assert!(r.other > 1e-4 && r.other < 0.02, "{}", r.other);
    let area = 1.0 / (1.0 + PI + 96.0);
    let share = format!("{:.1} % of the area of all surfaces", 100.0 * area);
    assert!(
        r.warnings.iter().any(|w| w.starts_with(&share)),
        "{:?}",
        r.warnings
    );
}

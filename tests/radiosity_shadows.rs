//! Edges of shadows on patches that follow them are where the path tracer sees them.

#[path = "common/render.rs"]
mod render;

use luxel::radiosity::{FormFactorMethod, SolveSpec, Solver};
use luxel::transport::radiosity::Show;
use luxel::transport::{IntegratorSpec, PathSpec, RadiositySpec};

/// Pixels of a hundredth of the scene's unit: a picture of the whole floor of 4 by 4 would have 400 by 400.
const PIXEL: f64 = 0.01;
const WIDTH: usize = 64;
const HEIGHT: usize = 24;

/// A floor of 4 by 4, a square lamp of 0.4 by 0.4 at height 3 and, turned, a square table of 1 by 1 at height 1. The
/// camera looks down from below the table to where one side of its shadow ends.
fn scene() -> String {
    let square = |transform: &str, more: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world">{transform}</transform>
            <bsdf type="diffuse"><rgb name="reflectance" value="0.3"/></bsdf>{more}</shape>"#
        )
    };
    let lamp = r#"<emitter type="area"><rgb name="radiance" value="10"/></emitter>"#;
    let scale = 0.5 * PIXEL * WIDTH as f64;
    format!(
        r#"<scene version="3.0.0"><integrator type="path"/><sensor type="orthographic">
        <transform name="to_world"><scale x="{scale}" y="{scale}"/>
        <lookat origin="0.8, 0.05, 0.9" target="0.8, 0.05, 0" up="0, 1, 0"/></transform>
        <sampler type="sobol"/><film type="hdrfilm"><integer name="width" value="{WIDTH}"/>
        <integer name="height" value="{HEIGHT}"/><rfilter type="box"/></film></sensor>{}{}{}</scene>"#,
        square(r#"<scale value="2"/>"#, ""),
        square(
            r#"<scale value="0.5"/><rotate z="1" angle="20"/><translate z="1"/>"#,
            ""
        ),
        square(
            r#"<scale value="0.2"/><rotate x="1" angle="180"/><translate z="3"/>"#,
            lamp
        )
    )
}

/// The picture by radiosity, with or without lines.
fn shown(discontinuities: bool) -> Vec<[f64; 3]> {
    let mut compiled = render::compile(&scene());
    compiled.job.integrator = IntegratorSpec::Radiosity(RadiositySpec {
        path: PathSpec::default(),
        solve: SolveSpec {
            solver: Solver::Shooting,
            patch_size: Some(12.0 * PIXEL),
            form_factors: FormFactorMethod::Analytic { samples: 16 },
            discontinuities,
            ..SolveSpec::default()
        },
        show: Show::Gouraud,
        given: None,
    });
    render::render(&compiled, 16).0.mean()
}

/// Where a row first reaches `level` from the left or the right, whichever is dark, in pixels.
fn crossing(row: &[[f64; 3]], level: f64) -> f64 {
    let value = |i: usize| row[i][0];
    let dark_left = value(0) < value(row.len() - 1);
    let over = |i: usize| (value(i) >= level) == dark_left;
    // Noise may cross several times: the middle of the first and the last.
    let at = |i: usize| i as f64 + (level - value(i)) / (value(i + 1) - value(i));
    let crosses: Vec<usize> = (0..row.len() - 1)
        .filter(|&i| over(i) != over(i + 1))
        .collect();
    match (crosses.first(), crosses.last()) {
        (Some(&a), Some(&b)) => 0.5 * (at(a) + at(b)),
        _ => f64::NAN,
    }
}

/// The largest distance between the places where rows of both pictures reach this share of the light, and the root of
/// its mean square, in pixels; NaN if a row does not.
fn apart(goal: &[[f64; 3]], found: &[[f64; 3]], share: f64) -> [f64; 2] {
    let rows = goal.chunks(WIDTH).zip(found.chunks(WIDTH));
    let off: Vec<f64> = rows
        .map(|(goal, found)| {
            let values = || goal.iter().map(|p| p[0]);
            let least = values().fold(f64::INFINITY, f64::min);
            let most = values().fold(0.0, f64::max);
            let level = least + share * (most - least);
            (crossing(goal, level) - crossing(found, level)).abs()
        })
        .collect();
    let square = off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64;
    [
        off.iter().fold(
            0.0,
            |a: f64, b| if b.is_nan() { f64::NAN } else { a.max(*b) },
        ),
        square.sqrt(),
    ]
}

/// The middle of the penumbra is within the pixel in each row, and where it has a quarter and three quarters of the
/// light within a pixel as the mean goes: between two lines light is linear, which it is not quite. Without lines,
/// patches of 12 pixels smear these over several. The level is that of each row of the path traced picture; its noise
/// is below a tenth of a pixel.
#[test]
fn edges_of_shadows_are_within_the_pixel() {
    let goal = render::picture(&scene(), 1024, 1);
    let (with, without) = (shown(true), shown(false));
    let [most, mean] = apart(&goal, &with, 0.5);
    assert!(most < 1.0 && mean < 0.6, "{most} {mean}");
    for share in [0.25, 0.75] {
        let [most, mean] = apart(&goal, &with, share);
        assert!(most < 1.5 && mean < 1.0, "{share}: {most} {mean}");
        let [_, mean] = apart(&goal, &without, share);
        assert!(mean > 2.0, "{share}: {mean} without lines");
    }
}

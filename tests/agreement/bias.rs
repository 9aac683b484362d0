//! The bias of gathered photons vanishes as theory says.
//!
//! A spot shines up at a plane mirror, and its light falls back onto a floor as if it came from above: a caustic
//! whose irradiance h / (h^2 + d^2)^(3/2) at the distance d from its middle is known, and so is its mean over a
//! disk.

use super::common::Running;
use super::{bidirectional, picture, render};
use luxel::sampler::SamplerKind;
use luxel::transport::photons::reduced;
use luxel::transport::{IntegratorSpec, Method, PhotonSpec};

/// Of the spot's image over the floor.
const HEIGHT: f64 = 1.5;
const RADIUS: f32 = 0.5;
const PHOTONS: u64 = 4096;

fn pool(fov: f64) -> String {
    format!(
        r#"<scene version="3.0.0"><integrator type="path"/>
        <sensor type="perspective"><float name="fov" value="{fov}"/>
            <transform name="to_world"><lookat origin="0, 0, 0.4" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/>
                <rfilter type="box"/></film></sensor>
        <shape type="rectangle"><transform name="to_world"><scale value="4"/></transform>
            <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>
        <shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="180"/>
            <translate z="1"/></transform>
            <bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>
        <emitter type="spot"><rgb name="intensity" value="1"/>
            <float name="cutoff_angle" value="30"/><float name="beam_width" value="29.9"/>
            <transform name="to_world"><lookat origin="0, 0, 0.5" target="0, 0, 1" up="0, 1, 0"/></transform>
        </emitter></scene>"#
    )
}

fn integrator(alpha: f32) -> IntegratorSpec {
    let photons = PhotonSpec {
        count: Some(PHOTONS),
        radius: Some(RADIUS),
        alpha,
        ..PhotonSpec::default()
    };
    // Light, mirror, floor, eye.
    bidirectional(Method::Sppm, 3, photons)
}

/// Mean over the disk of this radius, relative to its middle.
fn seen_within(radius: f64) -> f64 {
    let (h, r2) = (HEIGHT, radius * radius);
    2.0 * h * h / r2 * (1.0 - h / (h * h + r2).sqrt())
}

/// Least squares of y over x.
fn slope(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / n;
    let (x, y) = (mean(0), mean(1));
    let both = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>();
    both / points.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>()
}

/// Knaus & Zwicker 2011: the radius squared falls as i^(alpha - 1), and the bias with it, whose mean over n
/// iterations is n^(alpha - 1) too.
#[test]
fn bias_falls_as_theory_says() {
    for (alpha, most) in [(0.5f32, 512u64), (0.75, 512)] {
        let mut compiled = render::compile(&pool(0.5));
        compiled.job.sampler = SamplerKind::Sobol;
        let spec = integrator(alpha);
        // The irradiance of an intensity of 1 W/sr, scattered by an albedo of 0.5.
        let truth = 0.5 / std::f64::consts::PI / (HEIGHT * HEIGHT);
        let radius = |i: u64| f64::from(reduced(RADIUS, alpha, i));
        let (mut found, mut exact) = (Vec::new(), Vec::new());
        let mut n = 8;
        while n <= most {
            let mut runs = Running::default();
            for seed in 0..8 {
                runs.add(render::mean_of(&picture(&mut compiled, &spec, n, seed)));
            }
            let expected = (0..n).map(|i| seen_within(radius(i))).sum::<f64>() / n as f64;
            let (mean, error) = (runs.mean / truth, runs.stderr() / truth);
            let bias = 1.0 - mean;
            println!(
                "alpha {alpha}, n {n}: bias {bias:.5} +- {error:.5}, expected {:.5}",
                1.0 - expected
            );
            // Eight runs: Student's t of seven degrees of freedom exceeds 7 once in 5000.
            assert!(
                (mean - expected).abs() < 7.0 * error + 1e-4,
                "{mean} {expected}"
            );
            assert!(error < 0.02 * bias, "the fit needs less noise: {error}");
            let x = (n as f64).ln();
            found.push([x, bias.ln()]);
            exact.push([x, (1.0 - expected).ln()]);
            n *= 4;
        }
        let (found, exact, rate) = (slope(&found), slope(&exact), f64::from(alpha) - 1.0);
        println!("alpha {alpha}: exponent {found:.4}, of the exact bias {exact:.4}, theory {rate}");
        // Two per cent of noise at the ends of a range of ln 64 = 4.2 tilt the line by less than 0.01.
        assert!((found - exact).abs() < 0.01, "{found} {exact}");
        // The first iterations, whose radii are not yet on the power law, are a part of the mean.
        assert!((found - rate).abs() < 0.06, "{found} {rate}");
    }
}

/// A disk of photons brings all of their power: the picture of the whole pool has what the spot sent.
#[test]
fn all_that_was_sent_arrives() {
    // The pool's radius is 0.866; the camera, 0.4 above the floor, sees 1.5 to each side.
    let fov = 2.0 * (1.5f64 / 0.4).atan().to_degrees();
    let mut compiled = render::compile(&pool(fov));
    compiled.job.sampler = SamplerKind::Sobol;
    // Within the beam: 2 pi (1 - cos 30), and of the rim a tenth of a degree.
    let angle = |deg: f64| 1.0 - deg.to_radians().cos();
    let sent = std::f64::consts::TAU * [angle(29.9), angle(30.0)].iter().sum::<f64>() / 2.0;
    let expected = 0.5 / std::f64::consts::PI * sent / (3.0 * 3.0);
    let mut runs = Running::default();
    for seed in 0..16 {
        runs.add(render::mean_of(&picture(
            &mut compiled,
            &integrator(0.75),
            512,
            seed,
        )));
    }
    let error = runs.stderr() / expected;
    println!("{} +- {error:.4}", runs.mean / expected);
    assert!(error < 3e-3, "1 % could hide: {error}");
    assert!((runs.mean / expected - 1.0).abs() < 4.5 * error + 1e-3);
}

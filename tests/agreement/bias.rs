//! The bias of gathered photons vanishes as theory says.
//!
//! A spot shines up at a plane mirror, and its light falls back onto a floor as if it came from above: a caustic
//! whose irradiance h / (h^2 + d^2)^(3/2) at the distance d from its middle is known, and so is its mean over a
//! disk.

use super::common::Running;
use super::{bidirectional, fixed, picture, render};
use luxel::render::Stop;
use luxel::sampler::SamplerKind;
use luxel::transport::photons::reduced;
use luxel::transport::{IntegratorSpec, Method, PhotonSpec};

/// Of the spot's image over the floor.
const HEIGHT: f64 = 1.5;
/// Of the first disk. The pool of light has a radius of 0.866.
const RADIUS: f32 = 0.8;
const SEEDS: u64 = 8;

/// Ends of the ranges of iterations whose mean bias is measured: each range is the one before, stretched.
const STAGES: [u64; 4] = [4, 16, 64, 256];

fn pool(fov: f64, side: u32) -> String {
    format!(
        r#"<scene version="3.0.0"><integrator type="path"/>
        <sensor type="perspective"><float name="fov" value="{fov}"/>
            <transform name="to_world"><lookat origin="0, 0, 0.4" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="{side}"/><integer name="height" value="{side}"/>
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

fn integrator(alpha: f32, count: u64) -> IntegratorSpec {
    let photons = PhotonSpec {
        count: Some(count),
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

/// Knaus & Zwicker 2011: the radius squared falls as i^(alpha - 1), and the bias with it (section 3).
#[test]
fn bias_falls_as_theory_says() {
    // The slower it falls, the more of it there is to be measured.
    for (alpha, photons) in [(0.5f32, 1024), (0.75, 256)] {
        let mut compiled = render::compile(&pool(0.5, 4));
        compiled.job.sampler = SamplerKind::Sobol;
        // The irradiance of an intensity of 1 W/sr, scattered by an albedo of 0.5.
        let truth = 0.5 / std::f64::consts::PI / (HEIGHT * HEIGHT);
        let radius = |i: u64| f64::from(reduced(RADIUS, alpha, i));
        compiled.job.integrator = integrator(alpha, photons);
        let mut runs = [Running::default(); STAGES.len()];
        for seed in 0..SEEDS {
            compiled.job.seed = seed;
            let mut film = compiled.job.new_film(Stop::Spp(STAGES[STAGES.len() - 1]));
            let mut before = (0, 0.0);
            for (run, n) in runs.iter_mut().zip(STAGES) {
                let stats = compiled.job.add_samples(&mut film, n - before.0).unwrap();
                assert_eq!(stats.invalid.count, 0);
                let sum = render::mean_of(&film.mean()) * n as f64;
                run.add((sum - before.1) / (n - before.0) as f64);
                before = (n, sum);
            }
        }
        let (mut found, mut exact) = (Vec::new(), Vec::new());
        for (k, run) in runs.iter().enumerate() {
            let range = if k > 0 { STAGES[k - 1] } else { 0 }..STAGES[k];
            let n = (range.end - range.start) as f64;
            let expected = range.clone().map(|i| seen_within(radius(i))).sum::<f64>() / n;
            let (mean, error) = (run.mean / truth, run.stderr() / truth);
            let (bias, exact_bias) = (1.0 - mean, 1.0 - expected);
            println!(
                "alpha {alpha}, {range:?}: bias {bias:.5} +- {error:.5}, expected {exact_bias:.5}"
            );
            // Student's t of seven degrees of freedom exceeds 7 once in 5000.
            let explained = 7.0 * error + 1e-4;
            assert!((mean - expected).abs() < explained, "{mean} {expected}");
            assert!(error < 0.03 * bias, "the fit needs less noise: {error}");
            if k > 0 {
                let x = n.ln();
                found.push([x, bias.ln()]);
                exact.push([x, exact_bias.ln()]);
            }
        }
        let (found, exact, rate) = (slope(&found), slope(&exact), f64::from(alpha) - 1.0);
        println!("alpha {alpha}: exponent {found:.4}, of the exact bias {exact:.4}, theory {rate}");
        // Three per cent of noise at either end of a range of ln 16 = 2.8 tilt the line by 0.015.
        assert!((found - exact).abs() < 0.03, "{found} {exact}");
        // The next term, in radius^4, takes 5/6 (radius / height)^2 off the bias of a disk: a tenth of the first
        // range's, which tilts the line by ln 0.9 / 2.8 = 0.04.
        assert!((exact - rate).abs() < 0.045, "{exact} {rate}");
        assert!((found - rate).abs() < 0.06, "{found} {rate}");
    }
}

/// A disk of photons brings all of their power: the picture of the whole pool has what the spot sent.
#[test]
fn all_that_was_sent_arrives() {
    // The pool's radius is 0.866; the camera, 0.4 above the floor, sees 1.5 to each side.
    let fov = 2.0 * (1.5f64 / 0.4).atan().to_degrees();
    let mut compiled = render::compile(&pool(fov, 16));
    compiled.job.sampler = SamplerKind::Sobol;
    // Within the beam: 2 pi (1 - cos 30), and of the rim a tenth of a degree.
    let angle = |deg: f64| 1.0 - deg.to_radians().cos();
    let sent = std::f64::consts::TAU * [angle(29.9), angle(30.0)].iter().sum::<f64>() / 2.0;
    let expected = 0.5 / std::f64::consts::PI * sent / (3.0 * 3.0);
    let spec = bidirectional(Method::Sppm, 3, fixed(2000, 0.3));
    let mut runs = Running::default();
    for seed in 0..16 {
        runs.add(render::mean_of(&picture(&mut compiled, &spec, 16, seed)));
    }
    let error = runs.stderr() / expected;
    println!("{} +- {error:.4}", runs.mean / expected);
    assert!(error < 3e-3, "1 % could hide: {error}");
    assert!((runs.mean / expected - 1.0).abs() < 4.5 * error + 1e-3);
}

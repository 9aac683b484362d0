//! Renders small scenes given as XML text.
#![allow(dead_code)]

use std::ops::ControlFlow;
use std::path::Path;

use luxel::film::Film;
use luxel::format::{self, Compiled, Overrides};
use luxel::render::{Stats, Stop};

pub fn compile(xml: &str) -> Compiled {
    compile_with(xml, &Overrides::default())
}

pub fn compile_with(xml: &str, overrides: &Overrides) -> Compiled {
    let desc =
        format::load_str("test.xml", xml, Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"));
    format::compile(&desc, overrides).unwrap_or_else(|e| panic!("{e}"))
}

/// `spp` samples per pixel; fails when any of them was not a finite, positive number.
pub fn render(compiled: &Compiled, spp: u64) -> (Film, Stats) {
    let (film, stats) = compiled
        .job
        .render(Stop::Spp(spp), |_, _| ControlFlow::Continue(()))
        .unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(stats.invalid.count, 0, "{:?}", stats.invalid);
    (film, stats)
}

/// The mean picture of `xml` at `spp` samples per pixel, random numbers from `seed`.
pub fn picture(xml: &str, spp: u64, seed: u64) -> Vec<[f64; 3]> {
    let overrides = Overrides {
        seed: Some(seed),
        ..Overrides::default()
    };
    render(&compile_with(xml, &overrides), spp).0.mean()
}

/// Mean over the picture of channel 0 and its standard error (pixels are independent), from `spp` samples
/// per pixel or as many times twice that as it takes to see 1 % clearly.
pub fn mean_and_error(xml: &str, spp: u64, seed: u64) -> (f64, f64) {
    let overrides = Overrides {
        seed: Some(seed),
        ..Overrides::default()
    };
    let (film, _) = render(&compile_with(xml, &overrides), spp);
    let variances = film.standard_error().into_iter().map(|s| s[0] * s[0]);
    let mean = mean_of(&film.mean());
    let stderr = variances.sum::<f64>().sqrt() / film.mean().len() as f64;
    if stderr > MAX_ERROR * mean && spp < 1 << 14 {
        return mean_and_error(xml, 2 * spp, seed);
    }
    (mean, stderr)
}

/// Relative standard error of [`mean_and_error`].
const MAX_ERROR: f64 = 1.5e-3;

/// Fails where chance does not explain the distance of a picture's mean from its closed form: beyond 4.5
/// standard errors (once in 150,000) and the rounding of f32; or where an error of 1 % could hide.
#[track_caller]
pub fn assert_explained((mean, stderr): (f64, f64), expected: f64, what: &str) {
    assert!(
        stderr <= 1.1 * MAX_ERROR * expected,
        "{what}: {mean} +- {stderr} says too little"
    );
    assert!(
        (mean - expected).abs() < 4.5 * stderr + 2e-5 * expected,
        "{what}: {mean} +- {stderr}, expected {expected}"
    );
}

/// A camera at (0, 0, 4) that looks down -z, `size` pixels square, box filter.
pub fn camera(size: u32, fov: f64) -> String {
    format!(
        r#"<sensor type="perspective">
            <float name="fov" value="{fov}"/>
            <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm">
                <integer name="width" value="{size}"/><integer name="height" value="{size}"/>
                <rfilter type="box"/>
            </film>
        </sensor>"#
    )
}

/// A scene of the path tracer from its parts.
pub fn scene(max_depth: i32, camera: &str, content: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
            <integrator type="path"><integer name="max_depth" value="{max_depth}"/></integrator>
            {camera} {content}
        </scene>"#
    )
}

/// Mean over all pixels of channel 0.
pub fn mean_of(picture: &[[f64; 3]]) -> f64 {
    picture.iter().map(|p| p[0]).sum::<f64>() / picture.len() as f64
}

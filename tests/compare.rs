//! The Z-test on synthetic pictures of known noise, and the command that prints it.

#[path = "common/pictures.rs"]
mod pictures;

use std::fs;
use std::path::PathBuf;

use clap::Parser;
use luxel::cli::compare::{self, CompareArgs};
use luxel::cli::{Failure, Outcome};
use luxel::image_io::color::{RGB_TO_XYZ, XYZ_TO_RGB, apply};
use luxel::image_io::{Image, Layer, Samples};
use luxel::math::Rgb;
use luxel::study::Picture;
use luxel::study::z_test::{Noise, Rule, z_test};
use pictures::{make, noise};

const WIDTH: usize = 96;
const HEIGHT: usize = 64;

/// A standard normal number (Box and Muller 1958), from a stream of its own per `seed`.
fn normal(seed: usize, i: usize) -> f64 {
    let uniform = |k: usize| noise((seed * 0x0100_0000 + 2 * i + k).wrapping_mul(3) + 1);
    let radius = (-2.0 * (1.0 - uniform(0)).ln()).sqrt();
    radius * (2.0 * std::f64::consts::PI * uniform(1)).cos()
}

const SPP: f64 = 400.0;
const REFERENCE_SPP: f64 = 32_000.0;

/// Noise of one sample, relative to the pixel and besides.
fn sample_deviation(v: f64) -> f64 {
    0.3 * v + 0.05
}

fn truth(x: usize, y: usize) -> [f64; 3] {
    let (u, v) = (x as f64 / WIDTH as f64, y as f64 / HEIGHT as f64);
    [0.05 + u, 0.1 + v, 0.3 + 0.2 * (x as f64 / 5.0).sin()]
}

/// The mean of `spp` samples of the truth times `scale`, with independent noise in X, Y, Z or R, G, B.
fn rendered(seed: usize, spp: f64, scale: f64, in_xyz: bool) -> Picture {
    make(WIDTH, HEIGHT, |x, y| {
        let base = truth(x, y);
        let base = if in_xyz {
            apply(&RGB_TO_XYZ, base)
        } else {
            base
        };
        let at = (y * WIDTH + x) * 3;
        let noisy = std::array::from_fn(|c| {
            scale * base[c] + sample_deviation(base[c]) / spp.sqrt() * normal(seed, at + c)
        });
        if in_xyz {
            apply(&XYZ_TO_RGB, noisy)
        } else {
            noisy
        }
    })
}

/// Variance of one sample in XYZ, carried to RGB.
fn sample_variance() -> Picture {
    make(WIDTH, HEIGHT, |x, y| {
        let xyz = apply(&RGB_TO_XYZ, truth(x, y));
        apply(&XYZ_TO_RGB, xyz.map(|v| sample_deviation(v).powi(2)))
    })
}

/// Variance of a mean of `spp` samples as 8 runs would estimate it.
fn estimated_variance(seed: usize, spp: f64) -> Picture {
    make(WIDTH, HEIGHT, |x, y| {
        let at = (y * WIDTH + x) * 24;
        let base = truth(x, y);
        std::array::from_fn(|c| {
            let chi2: f64 = (0..8).map(|k| normal(seed, at + c * 8 + k).powi(2)).sum();
            sample_deviation(base[c]).powi(2) / spp * chi2 / 8.0
        })
    })
}

/// The three ways to know the noise, with a reference for each and whether it works in XYZ.
fn ways() -> [(Noise, Picture, bool); 3] {
    let noisy = rendered(1, REFERENCE_SPP, 1.0, false);
    let variance = estimated_variance(2, REFERENCE_SPP);
    let (spp, reference_spp) = (SPP, REFERENCE_SPP);
    [
        (
            Noise::Sample {
                variance: sample_variance(),
                spp,
                reference_spp,
            },
            rendered(1, REFERENCE_SPP, 1.0, true),
            true,
        ),
        (
            Noise::Mean {
                variance: variance.clone(),
                spp,
                reference_spp,
            },
            noisy.clone(),
            false,
        ),
        (
            Noise::Both {
                image: estimated_variance(3, SPP),
                reference: variance,
            },
            noisy,
            false,
        ),
    ]
}

/// A right image passes: each bias test errs with probability 1e-4 (3.9 standard errors) and then only
/// if it is off by 0.5 %, the pixel test only if 0.25 % of the values exceed a limit that one in 100
/// pictures exceeds once. One that is 1 % too bright or too dark fails.
#[test]
fn the_z_test_passes_what_is_right_and_sees_one_percent() {
    for (noise, reference, in_xyz) in ways() {
        let judge = |scale: f64, seed: usize| {
            let image = rendered(seed, SPP, scale, in_xyz);
            z_test(&image, &reference, &noise, &Rule::default()).unwrap()
        };
        for seed in 10..20 {
            let right = judge(1.0, seed);
            assert!(right.pass(), "{right:?}");
            // The values of z are those of a standard normal number: the noise is understood. Between
            // estimated variances and floors the kinds of a mean are a little cautious.
            let rms = right.pixel.z_rms;
            assert!(
                (if in_xyz { 0.97 } else { 0.85 }..1.03).contains(&rms),
                "{rms}"
            );
        }
        for scale in [0.99, 1.01] {
            let wrong = judge(scale, 30);
            assert!(!wrong.pass());
            for test in wrong.scale.iter().chain(&wrong.mean) {
                assert!(!test.pass, "{test:?}");
                assert!((test.error - (scale - 1.0)).abs() < 0.0015, "{test:?}");
            }
        }
    }
}

/// Figures of an independent implementation in Python (numpy), which read the same pictures.
#[test]
fn the_z_test_agrees_with_another_implementation() {
    // Share within the limit (%), the limit, largest and rms z; then error (%) and z of the scale
    // tests and of the mean tests.
    let pixels = [
        [99.995, 4.79, 4.8, 1.12],
        [99.045, 4.20, 5.6, 2.03],
        [98.958, 4.20, 5.4, 2.02],
    ];
    let scales = [
        [[1.023, 38.98], [0.998, 38.94], [0.986, 34.35]],
        [[1.021, 38.24], [0.997, 38.37], [0.989, 31.55]],
        [[1.022, 37.87], [0.997, 38.29], [0.986, 31.46]],
    ];
    let means = [
        [[1.025, 38.67], [0.998, 37.70], [0.992, 33.27]],
        [[1.018, 27.10], [0.998, 28.66], [0.996, 24.13]],
        [[1.018, 27.10], [0.998, 28.66], [0.996, 24.13]],
    ];
    let near = |a: f64, b: f64, digit: f64| assert!((a - b).abs() <= 0.51 * digit, "{a} {b}");
    for (i, (noise, reference, in_xyz)) in ways().into_iter().enumerate() {
        let image = rendered(30, SPP, 1.01, in_xyz);
        let found = z_test(&image, &reference, &noise, &Rule::default()).unwrap();
        let [share, limit, largest, rms] = pixels[i];
        near(100.0 * found.pixel.share, share, 1e-3);
        near(found.pixel.z_limit, limit, 1e-2);
        near(found.pixel.z_max, largest, 0.1);
        near(found.pixel.z_rms, rms, 1e-2);
        for (tests, figures) in [(found.scale, scales[i]), (found.mean, means[i])] {
            for (test, [error, z]) in tests.iter().zip(figures) {
                near(100.0 * test.error, error, 1e-3);
                near(test.z, z, 1e-2);
            }
        }
    }
}

/// An error in a small part of the picture that leaves scale and mean within their tolerance.
#[test]
fn the_pixel_test_sees_errors_in_places() {
    for (noise, reference, in_xyz) in ways() {
        let mut image = rendered(10, SPP, 1.0, in_xyz);
        for y in 0..8 {
            for x in 0..8 {
                let factor = if x < 4 { 1.4 } else { 0.6 };
                let pixel = &mut image.pixels[(20 + y) * WIDTH + 48 + x];
                *pixel *= factor;
            }
        }
        let verdict = z_test(&image, &reference, &noise, &Rule::default()).unwrap();
        assert!(!verdict.pixel.pass, "{verdict:?}");
    }
}

#[test]
fn the_z_test_refuses_what_makes_no_sense() {
    let image = rendered(10, SPP, 1.0, true);
    let judge = |variance: Picture, spp: f64, block: Option<usize>| {
        let noise = Noise::Sample {
            variance,
            spp,
            reference_spp: REFERENCE_SPP,
        };
        let rule = Rule {
            block,
            ..Rule::default()
        };
        z_test(&image, &image, &noise, &rule).err()
    };
    let small = make(3, 3, |_, _| [1.0; 3]);
    assert!(judge(small, SPP, None).is_some());
    assert!(judge(image.clone(), 0.0, None).is_some());
    assert!(judge(image.clone(), f64::NAN, None).is_some());
    assert!(judge(image.clone(), SPP, Some(0)).is_some());
    assert!(judge(image.clone(), SPP, Some(65)).is_some());
    assert!(judge(image.clone(), SPP, Some(64)).is_none());
}

#[derive(Parser)]
struct Command {
    #[command(flatten)]
    compare: CompareArgs,
}

/// Files for the command in a folder of their own, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Folder {
        let name = format!("luxel-compare-{}-{test}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn save(&self, name: &str, picture: &Picture) {
        Image::from_rgb(picture.width, picture.height, &picture.pixels)
            .write(self.0.join(name))
            .unwrap();
    }

    /// Arguments in one line; words with a dot are files in the folder.
    fn run(&self, line: &str) -> Result<compare::Report, Failure> {
        let file = |word: &str| self.0.join(word).to_string_lossy().into_owned();
        let words = line
            .split_whitespace()
            .map(|word| match word.contains('.') {
                true => file(word),
                false => word.to_string(),
            });
        let args = std::iter::once("compare".to_string()).chain(words);
        compare::compare(&Command::try_parse_from(args).unwrap().compare)
    }

    /// The message without the path of the folder, and the exit code.
    fn failure(&self, line: &str) -> (String, u8) {
        let failure = self.run(line).unwrap_err();
        let folder = format!("{}{}", self.0.display(), std::path::MAIN_SEPARATOR);
        (
            failure.to_string().replace(&folder, ""),
            failure.exit_code(),
        )
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn the_command_prints_a_table_or_json_and_judges() {
    let folder = Folder::new("judges");
    folder.save("reference.exr", &rendered(1, REFERENCE_SPP, 1.0, true));
    folder.save("variance.exr", &sample_variance());
    folder.save("right.exr", &rendered(10, SPP, 1.0, true));
    folder.save("bright.exr", &rendered(10, SPP, 1.01, true));
    let test = "--reference-variance variance.exr --spp 400";

    let right = folder
        .run(&format!("right.exr reference.exr {test}"))
        .unwrap();
    assert_eq!(right.outcome(), Outcome::Done);
    let json = right.to_json();
    assert_eq!(json["z_test"]["pass"], true);
    assert_eq!(json["width"], WIDTH);
    assert_eq!(json["mse"], right.metrics.mse);
    assert!(right.to_text().contains("pass  scale X"));

    let bright = folder
        .run(&format!("bright.exr reference.exr {test}"))
        .unwrap();
    assert_eq!(bright.outcome().exit_code(), 1);
    assert!(bright.to_text().ends_with("FAIL  overall\n"));
    // Without a test nothing can fail.
    let untested = folder.run("bright.exr reference.exr").unwrap();
    assert_eq!(untested.outcome().exit_code(), 0);
    assert!(!untested.to_text().contains("overall"));
    assert!(untested.to_text().contains("mean ratio     1.01"));
}

#[test]
fn the_command_reads_the_standard_errors_of_our_files() {
    let folder = Folder::new("stderr");
    let save = |name: &str, picture: &Picture, variance: &Picture| {
        let mut image = Image::from_rgb(WIDTH, HEIGHT, &picture.pixels);
        let errors: Vec<Rgb> = variance.pixels.iter().map(|v| v.map(f32::sqrt)).collect();
        image
            .layers
            .push(Layer::from_rgb("stderr", &errors, Samples::Float));
        image.write(folder.0.join(name)).unwrap();
    };
    let [image, reference] = [(3, SPP), (2, REFERENCE_SPP)].map(|(s, n)| estimated_variance(s, n));
    save(
        "reference.exr",
        &rendered(1, REFERENCE_SPP, 1.0, false),
        &reference,
    );
    save("right.exr", &rendered(10, SPP, 1.0, false), &image);
    save("dark.exr", &rendered(10, SPP, 0.99, false), &image);
    folder.save("plain.exr", &rendered(10, SPP, 1.0, false));
    let outcome = |line: &str| folder.run(line).unwrap().outcome();
    assert_eq!(outcome("right.exr reference.exr --stderr"), Outcome::Done);
    assert_eq!(
        outcome("dark.exr reference.exr --stderr"),
        Outcome::TestFailed
    );
    assert_eq!(
        folder.failure("plain.exr reference.exr --stderr"),
        ("--stderr: plain.exr has no layer \"stderr\"".to_string(), 2)
    );
}

#[test]
fn the_command_explains_what_it_cannot_compare() {
    let folder = Folder::new("errors");
    let grey = make(8, 4, |_, _| [0.5; 3]);
    folder.save("a.exr", &grey);
    folder.save("wide.exr", &make(9, 4, |_, _| [0.5; 3]));
    let mut broken = grey.clone();
    broken.pixels[11].g = f32::NAN;
    broken.pixels[12].b = f32::INFINITY;
    folder.save("nan.exr", &broken);
    let cases = [
        (
            "a.exr gone.exr",
            "cannot read gone.exr: no such file or folder",
            1,
        ),
        (
            "a.exr wide.exr",
            "the sizes differ: a.exr has 8 x 4 pixels, wide.exr has 9 x 4",
            1,
        ),
        (
            "nan.exr a.exr",
            "nan.exr: 2 pixels are NaN or infinite, the first at column 3, row 1 (from 0)",
            1,
        ),
        (
            "a.exr a.exr --reference-variance a.exr",
            "--kind sample needs --spp and no --image-variance",
            2,
        ),
        (
            "a.exr a.exr --reference-variance a.exr --kind mean --spp 4",
            "--kind mean needs --image-variance, or --spp and --reference-spp",
            2,
        ),
        (
            "a.exr a.exr -o error.tiff",
            "the picture of the error is written as .png, .jpg or .exr, not as error.tiff",
            2,
        ),
    ];
    for (line, what, code) in cases {
        assert_eq!(folder.failure(line), (what.to_string(), code), "{line}");
    }
    let (what, code) = folder.failure("a.exr a.exr -o none/error.png");
    assert_eq!(
        (what.as_str(), code),
        ("cannot write none/error.png: no such file or folder", 3)
    );
}

#[test]
fn the_picture_of_the_error_is_signed() {
    let folder = Folder::new("picture");
    let reference = make(40, 30, |_, _| [1.0; 3]);
    let image = make(40, 30, |x, _| [if x < 20 { 0.5 } else { 1.25 }; 3]);
    folder.save("a.exr", &image);
    folder.save("b.exr", &reference);
    folder.run("a.exr b.exr -o error.exr").unwrap();
    let difference = Picture::read(folder.0.join("error.exr")).unwrap();
    assert_eq!(difference.pixels[0], Rgb::splat(-0.5));
    assert_eq!(difference.pixels[39], Rgb::splat(0.25));

    let report = folder.run("a.exr b.exr -o error.png").unwrap();
    assert!(
        report
            .to_text()
            .contains("error.png: blue -0.5, white 0, red +0.5")
    );
    let coloured = Picture::read(folder.0.join("error.png")).unwrap();
    assert!(coloured.width > 40 && coloured.height == 30);
    let (dark, bright) = (coloured.pixels[0], coloured.pixels[39]);
    assert!(
        dark.b > 2.0 * dark.r && bright.r > 1.2 * bright.b,
        "{dark:?} {bright:?}"
    );
}

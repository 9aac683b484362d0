//! `luxel compare`: how far an image is from a reference, and whether chance explains it.

use std::fmt::{self, Write as _};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::{Value, json};

use super::numbers::{positive, whole};
use super::{Failure, Outcome};
use crate::image_io::Image;
use crate::study::Picture;
use crate::study::error_map::{error_map, signed_difference};
use crate::study::flip;
use crate::study::metrics::Metrics;
use crate::study::z_test::{BiasTest, Noise, Rule, Verdict, z_test};

/// Samples per pixel of the references that come with a variance per sample, unless told otherwise.
const USUAL_REFERENCE_SPP: f64 = 32_000.0;

/// Compare an image with a reference
///
/// Prints error figures of the picture in IMAGE against the one in REFERENCE (linear colours). With
/// --reference-variance or --stderr it also tests whether noise explains the differences; the exit code
/// is 1 when it does not.
#[derive(Args, Clone, Debug)]
pub struct CompareArgs {
    /// The image to judge: EXR, PNG, JPEG, BMP, TGA, HDR or PFM
    pub image: PathBuf,
    /// What it should look like, of the same size
    pub reference: PathBuf,
    /// Variance of the reference, as an EXR of the same size; asks for the Z-test
    #[arg(long, value_name = "FILE")]
    pub reference_variance: Option<PathBuf>,
    /// Samples per pixel of IMAGE
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = positive, requires = "reference_variance")]
    pub spp: Option<f64>,
    /// What the variance file holds
    #[arg(long, value_enum, default_value_t, requires = "reference_variance")]
    pub kind: Kind,
    /// Samples per pixel of REFERENCE [default for --kind sample: 32000]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = positive, requires = "reference_variance")]
    pub reference_spp: Option<f64>,
    /// Variance of the mean in IMAGE, as an EXR (with --kind mean, instead of --spp)
    #[arg(
        long,
        value_name = "FILE",
        requires = "reference_variance",
        conflicts_with = "spp"
    )]
    pub image_variance: Option<PathBuf>,
    /// Z-test with the standard errors that luxel writes: layer `stderr` of both files
    #[arg(long, conflicts_with = "reference_variance")]
    pub stderr: bool,
    /// Average blocks of N x N pixels before the Z-test [default: 1 with --kind sample, else 4]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(1..=usize::MAX))]
    pub block: Option<usize>,
    /// Print the figures as JSON
    #[arg(long)]
    pub json: bool,
    /// Write a picture of the error: .png or .jpg in false colours (blue: too dark, white: right,
    /// red: too bright), .exr the signed difference
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Error of luminance at the ends of the colour bar [default: from the errors]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = positive, requires = "output")]
    pub error_scale: Option<f64>,
}

/// What a file of variances holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Variance of one sample, carried from XYZ to RGB
    #[default]
    Sample,
    /// Variance of the reference itself, per channel
    Mean,
}

/// Runs the command and prints its findings.
pub fn run(args: &CompareArgs) -> Result<Outcome, Failure> {
    let report = compare(args)?;
    let text = match args.json {
        true => format!("{:#}\n", report.to_json()),
        false => report.to_text(),
    };
    // A reader that closed the pipe has seen enough.
    let _ = io::stdout().write_all(text.as_bytes());
    Ok(report.outcome())
}

/// The findings of a comparison.
#[derive(Clone, Debug)]
pub struct Report {
    image: PathBuf,
    reference: PathBuf,
    size: [usize; 2],
    pub metrics: Metrics,
    pub flip_hdr: f64,
    pub flip_ldr: f64,
    pub verdict: Option<Verdict>,
    /// The picture of the error and, in false colours, its scale.
    error_picture: Option<(PathBuf, Option<f64>)>,
}

/// Compares, and writes the picture of the error if one is asked for, but prints nothing.
pub fn compare(args: &CompareArgs) -> Result<Report, Failure> {
    let false_colours = args.output.as_deref().map(wants_false_colours);
    let false_colours = false_colours.transpose()?;
    let image = Picture::read(&args.image)?;
    let reference = Picture::read_like(&args.reference, &image, &args.image)?;
    let rule = Rule {
        block: args.block,
        ..Rule::default()
    };
    let verdict = noise(args, &reference)?
        .map(|noise| z_test(&image, &reference, &noise, &rule).map_err(Failure::Usage))
        .transpose()?;
    let error_picture = match (&args.output, false_colours) {
        (Some(path), Some(coloured)) => {
            let (picture, scale) = if coloured {
                let map = error_map(&image, &reference, args.error_scale);
                (map.picture, Some(map.scale))
            } else {
                (signed_difference(&image, &reference), None)
            };
            Image::from_rgb(picture.width, picture.height, &picture.pixels).write(path)?;
            Some((path.clone(), scale))
        }
        _ => None,
    };
    Ok(Report {
        image: args.image.clone(),
        reference: args.reference.clone(),
        size: [image.width, image.height],
        metrics: Metrics::of(&image, &reference),
        flip_hdr: flip::hdr(&image, &reference, flip::DEFAULT_PPD).mean,
        flip_ldr: flip::ldr(&image, &reference, flip::DEFAULT_PPD).mean,
        verdict,
        error_picture,
    })
}

fn wants_false_colours(path: &Path) -> Result<bool, Failure> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "png" | "jpg" | "jpeg" => Ok(true),
        "exr" => Ok(false),
        _ => Err(Failure::Usage(format!(
            "the picture of the error is written as .png, .jpg or .exr, not as {}",
            path.display()
        ))),
    }
}

/// What the arguments say about the noise; `None` when no test is asked for.
fn noise(args: &CompareArgs, reference: &Picture) -> Result<Option<Noise>, Failure> {
    let usage = |what: &str| Err(Failure::Usage(what.to_string()));
    if args.stderr {
        return Ok(Some(Noise::Both {
            image: stderr_squared(&args.image)?,
            reference: stderr_squared(&args.reference)?,
        }));
    }
    let Some(path) = &args.reference_variance else {
        return Ok(None);
    };
    let like = |path: &Path| Picture::read_like(path, reference, &args.reference);
    let noise = match (
        args.kind,
        args.spp,
        &args.image_variance,
        args.reference_spp,
    ) {
        (Kind::Sample, Some(spp), None, reference_spp) => Noise::Sample {
            variance: like(path)?,
            spp,
            reference_spp: reference_spp.unwrap_or(USUAL_REFERENCE_SPP),
        },
        (Kind::Sample, ..) => return usage("--kind sample needs --spp and no --image-variance"),
        (Kind::Mean, None, Some(image), _) => Noise::Both {
            image: like(image)?,
            reference: like(path)?,
        },
        (Kind::Mean, Some(spp), None, Some(reference_spp)) => Noise::Mean {
            variance: like(path)?,
            spp,
            reference_spp,
        },
        (Kind::Mean, ..) => {
            return usage("--kind mean needs --image-variance, or --spp and --reference-spp");
        }
    };
    Ok(Some(noise))
}

/// The variance of the picture in a file of ours: its layer `stderr`, squared.
fn stderr_squared(path: &Path) -> Result<Picture, Failure> {
    let Some(mut picture) = Picture::read_layer(path, "stderr")? else {
        return Err(Failure::Usage(format!(
            "--stderr: {} has no layer \"stderr\"",
            path.display()
        )));
    };
    picture.pixels.iter_mut().for_each(|e| *e = *e * *e);
    Ok(picture)
}

impl Report {
    /// `TestFailed` when a test was asked for and failed.
    pub fn outcome(&self) -> Outcome {
        match &self.verdict {
            Some(verdict) if !verdict.pass() => Outcome::TestFailed,
            _ => Outcome::Done,
        }
    }

    /// The findings as a table for people.
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_text(&mut out);
        out
    }

    fn write_text(&self, out: &mut String) -> fmt::Result {
        let m = &self.metrics;
        let ratio = |r: Option<f64>| r.map_or("-".to_string(), |r| format!("{r:.5}"));
        let [r, g, b] = m.ratio().map(ratio);
        writeln!(out, "image          {}", self.image.display())?;
        writeln!(out, "reference      {}", self.reference.display())?;
        writeln!(out, "pixels         {} x {}", self.size[0], self.size[1])?;
        writeln!(
            out,
            "mean ratio     {}  (R {r}, G {g}, B {b})",
            ratio(m.ratio_all())
        )?;
        writeln!(out, "MSE            {:.5e}", m.mse)?;
        writeln!(out, "RMSE           {:.5e}", m.rmse)?;
        writeln!(out, "relMSE         {:.5e}", m.rel_mse)?;
        writeln!(
            out,
            "  trimmed      {:.5e}  (without the worst 0.1 % of the pixels)",
            m.rel_mse_trimmed
        )?;
        writeln!(
            out,
            "largest error  {:.5e}  (column {}, row {})",
            m.max_error, m.max_at[0], m.max_at[1]
        )?;
        writeln!(
            out,
            "FLIP           {:.5} HDR, {:.5} LDR",
            self.flip_hdr, self.flip_ldr
        )?;
        match &self.error_picture {
            Some((path, Some(scale))) => writeln!(
                out,
                "error picture  {}: blue -{scale}, white 0, red +{scale} (luminance)",
                path.display()
            )?,
            Some((path, None)) => {
                writeln!(out, "error picture  {}: image - reference", path.display())?;
            }
            None => {}
        }
        match &self.verdict {
            Some(verdict) => write_verdict(out, verdict),
            None => Ok(()),
        }
    }

    /// The findings for programs. The names of the keys are stable.
    pub fn to_json(&self) -> Value {
        let m = &self.metrics;
        json!({
            "image": self.image.to_string_lossy(),
            "reference": self.reference.to_string_lossy(),
            "width": self.size[0],
            "height": self.size[1],
            "mse": m.mse,
            "rmse": m.rmse,
            "rel_mse": m.rel_mse,
            "rel_mse_trimmed": m.rel_mse_trimmed,
            "max_error": m.max_error,
            "max_error_at": m.max_at,
            "mean_image": m.mean_image,
            "mean_reference": m.mean_reference,
            "mean_ratio": m.ratio_all(),
            "mean_ratio_rgb": m.ratio(),
            "flip_hdr": self.flip_hdr,
            "flip_ldr": self.flip_ldr,
            "error_picture": self.error_picture.as_ref().map(|(path, scale)| json!({
                "file": path.to_string_lossy(),
                "scale": scale,
            })),
            "z_test": self.verdict.as_ref().map(verdict_json),
        })
    }
}

fn word(pass: bool) -> &'static str {
    if pass { "pass" } else { "FAIL" }
}

fn write_verdict(out: &mut String, verdict: &Verdict) -> fmt::Result {
    let p = &verdict.pixel;
    let [width, height] = verdict.size;
    writeln!(out)?;
    match verdict.block {
        1 => writeln!(out, "Z-test over {width} x {height} pixels")?,
        n => writeln!(
            out,
            "Z-test over {width} x {height} blocks of {n} x {n} pixels"
        )?,
    }
    writeln!(
        out,
        "{}  pixels   {:.3} % of {} values within z < {:.2} (99.75 % needed); largest z {:.1}, rms {:.2}",
        word(p.pass),
        100.0 * p.share,
        p.values,
        p.z_limit,
        p.z_max,
        p.z_rms
    )?;
    for (what, tests) in [("scale", &verdict.scale), ("mean ", &verdict.mean)] {
        for (name, t) in verdict.channels.iter().zip(tests) {
            writeln!(
                out,
                "{}  {what} {name}  {:+.3} %, z {:+.2}; could see {:.2} %",
                word(t.pass),
                100.0 * t.error,
                t.z,
                100.0 * t.power
            )?;
        }
    }
    writeln!(out, "{}  overall", word(verdict.pass()))
}

fn verdict_json(verdict: &Verdict) -> Value {
    let p = &verdict.pixel;
    let bias = |tests: &[BiasTest; 3]| -> Value {
        let test = |(name, t): (&&str, &BiasTest)| {
            let value = json!({ "pass": t.pass, "error": t.error, "z": t.z, "power": t.power });
            (name.to_string(), value)
        };
        Value::Object(verdict.channels.iter().zip(tests).map(test).collect())
    };
    json!({
        "pass": verdict.pass(),
        "block": verdict.block,
        "width": verdict.size[0],
        "height": verdict.size[1],
        "pixel": {
            "pass": p.pass,
            "share": p.share,
            "values": p.values,
            "z_limit": p.z_limit,
            "z_max": p.z_max,
            "z_rms": p.z_rms,
        },
        "scale": bias(&verdict.scale),
        "mean": bias(&verdict.mean),
    })
}

//! The picture that errors are measured against: given, or made by the study itself and made better until
//! its own error is small beside those that are studied.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::Picture;
use super::plan::{FORMAT, Method, Plan, StudyError, hash, slug};
use super::runs::{check_size, to_rgb};
use super::statistics::{Reference, Weighing};
use crate::film::{Film, Window};
use crate::image_io::{Image, Layer, Samples, read_metadata};
use crate::math::Rgb;
use crate::render::{Stop, Target};

/// The reference's error is to be this much below the smallest one studied.
pub const TIMES_BELOW: f64 = 10.0;

/// A reference with what is known of its making.
#[derive(Clone, Debug)]
pub struct Known {
    pub reference: Reference,
    pub path: PathBuf,
    /// Its own relMSE, where it is known.
    pub rel_mse: Option<f64>,
    /// Samples per pixel, if it was made here.
    pub spp: Option<u64>,
    /// Label of the method that made it, if it was made here.
    pub method: Option<String>,
    /// Seconds that its making has taken.
    pub seconds: f64,
}

impl Known {
    /// A picture from elsewhere: its layer `stderr`, which luxel writes, tells its error.
    ///
    /// # Errors
    /// It cannot be read, or has another size than `window`.
    pub fn read(path: &Path, window: Window) -> Result<Known, StudyError> {
        let input = |e: super::CompareError| StudyError::Input(e.to_string());
        let picture = Picture::read(path).map_err(input)?;
        check_size(path, &picture, window)?;
        let stderr = Picture::read_layer(path, "stderr").map_err(input)?;
        let variance = stderr.map(|s| s.pixels.iter().map(|e| *e * *e).collect());
        let reference = Reference { picture, variance };
        let known = reference.variance.is_some();
        Ok(Known {
            rel_mse: known.then(|| reference.error(Weighing::Relative)),
            reference,
            path: path.to_path_buf(),
            spp: None,
            method: None,
            seconds: 0.0,
        })
    }
}

/// A reference in the making: the mean of parts rendered one after the other, each with its own seed.
pub struct Maker<'a> {
    plan: &'a Plan,
    label: String,
    /// Hash of what determines it, but for the number of samples.
    name: String,
    window: Window,
    path: PathBuf,
    spp: u64,
    seconds: f64,
    mean: Vec<[f64; 3]>,
    variance: Vec<[f64; 3]>,
}

/// Samples of the first part, per pixel: enough for its spread to tell an error.
const FIRST_PART: u64 = 64;

/// A part takes at most this many times the samples that there are, as long as the reference's own error is not small
/// beside the errors studied: what these are is not known well then.
const GROWTH: f64 = 3.0;

/// What a part brings relMSE to is aimed at this much below the target, so as not to miss by a hair again and again.
const AIM: f64 = 1.1;

/// A reference whose relMSE is below this share of the smallest one studied knows that one well.
const KNOWS: f64 = 0.25;

/// What a part of a reference is to bring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Samples per pixel, where all pixels get alike.
    pub spp: u64,
    /// relMSE of the part alone, where pixels get samples by their error; `None` in the first part.
    pub rel_mse: Option<f64>,
}

impl<'a> Maker<'a> {
    /// What is kept in the folder from an earlier time, or nothing yet.
    pub fn new(plan: &'a Plan, method: &Method) -> Maker<'a> {
        let name = hash(&format!("{}|seed {}", method.settings, plan.base_seed));
        let file = format!("reference-{}-{name}.exr", slug(&method.label));
        let mut maker = Maker {
            plan,
            label: method.label.clone(),
            name,
            window: method.job.film.crop,
            path: plan.folder.join(file),
            spp: 0,
            seconds: 0.0,
            mean: Vec::new(),
            variance: Vec::new(),
        };
        // What cannot be read is made anew.
        let _ = maker.take_up();
        maker
    }

    fn take_up(&mut self) -> Option<()> {
        let text = read_metadata(&self.path).ok()??;
        let v: Value = serde_json::from_str(&text).ok()?;
        if v["luxel_study"] != FORMAT || v["hash"] != *self.name {
            return None;
        }
        let (spp, seconds) = (v["spp"].as_u64()?, v["seconds"].as_f64()?);
        let known = Known::read(&self.path, self.window).ok()?;
        let wide = |p: &Rgb| p.to_array().map(f64::from);
        self.variance = known.reference.variance?.iter().map(wide).collect();
        self.mean = known.reference.picture.pixels.iter().map(wide).collect();
        (self.spp, self.seconds) = (spp, seconds);
        Some(())
    }

    /// The reference as it is, once there is any.
    pub fn known(&self) -> Option<Known> {
        if self.spp == 0 {
            return None;
        }
        let window = self.window;
        let reference = Reference {
            picture: Picture {
                width: window.width as usize,
                height: window.height as usize,
                pixels: self.mean.iter().map(to_rgb).collect(),
            },
            variance: Some(self.variance.iter().map(to_rgb).collect()),
        };
        Some(Known {
            rel_mse: Some(reference.error(Weighing::Relative)),
            reference,
            path: self.path.clone(),
            spp: Some(self.spp),
            method: Some(self.label.clone()),
            seconds: self.seconds,
        })
    }

    /// The part that brings relMSE from `now` to `target`, if it falls as one over the samples, or as near to it as is
    /// wise to go at once. All in one, if possible: well-spread points are better the more of them belong together.
    pub fn next_part(&self, now: f64, target: f64) -> Part {
        if self.spp == 0 {
            return Part {
                spp: FIRST_PART,
                rel_mse: None,
            };
        }
        let target = target.max(f64::MIN_POSITIVE);
        let knows = now <= KNOWS * TIMES_BELOW * TIMES_BELOW * target;
        let most = if knows { 1e6 } else { GROWTH };
        // So many times the samples that there are.
        let times = (AIM * now / target - 1.0).clamp(0.0, most);
        let spp = (times * self.spp as f64).min(1e15) as u64;
        Part {
            spp: spp.max(FIRST_PART.min(self.spp)),
            rel_mse: Some(now / times.max(1e-3)),
        }
    }

    /// Adds a part, or what is done of it until `limit` or `stopped`, and keeps the result. Where the integrator
    /// allows it, the part has samples where the error is. Only a part whose spread tells an error counts.
    ///
    /// # Errors
    /// The scene cannot be rendered so, or the file cannot be written.
    pub fn extend(
        &mut self,
        method: &mut Method,
        part: Part,
        limit: Duration,
        stopped: &dyn Fn() -> bool,
    ) -> Result<(), StudyError> {
        method.job.seed = self.plan.reference_seed(self.spp);
        let stop = match part.rel_mse {
            Some(rel_mse) if method.job.is_adaptive() && rel_mse > 0.0 => Stop::Error {
                target: Target {
                    error: rel_mse.sqrt(),
                    quantile: None,
                },
                within: Some(limit),
            },
            _ => Stop::Spp(part.spp),
        };
        let start = Instant::now();
        let rendered = method.job.render(stop, |film, _| {
            let enough = start.elapsed() >= limit && film.has_error();
            match enough || stopped() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        });
        let (film, stats) =
            rendered.map_err(|e| StudyError::Input(format!("the reference: {e}")))?;
        self.seconds += stats.seconds;
        if film.has_error() {
            self.add(&film);
            self.write()?;
        }
        Ok(())
    }

    /// Means weighed by samples, not by estimated variances: those know whether a part was lucky, and would count the
    /// lucky ones more. Variances of independent parts add by the squares of the weights.
    fn add(&mut self, film: &Film) {
        let all = (self.spp + film.spp()) as f64;
        let (old, new) = (self.spp as f64 / all, film.spp() as f64 / all);
        let (mean, stderr) = (film.mean(), film.standard_error());
        self.mean.resize(mean.len(), [0.0; 3]);
        self.variance.resize(mean.len(), [0.0; 3]);
        for (i, (m, s)) in mean.iter().zip(&stderr).enumerate() {
            for c in 0..3 {
                self.mean[i][c] = old * self.mean[i][c] + new * m[c];
                self.variance[i][c] = old * old * self.variance[i][c] + new * new * s[c] * s[c];
            }
        }
        self.spp += film.spp();
    }

    fn write(&self) -> Result<(), StudyError> {
        let window = self.window;
        let mean: Vec<Rgb> = self.mean.iter().map(to_rgb).collect();
        let stderr: Vec<Rgb> = self
            .variance
            .iter()
            .map(|v| to_rgb(&v.map(f64::sqrt)))
            .collect();
        let mut image = Image::from_rgb(window.width as usize, window.height as usize, &mean);
        image
            .layers
            .push(Layer::from_rgb("stderr", &stderr, Samples::Float));
        let metadata = json!({
            "luxel_study": FORMAT,
            "hash": self.name,
            "method": self.label,
            "spp": self.spp,
            "seconds": self.seconds,
            "relmse": self.known().and_then(|k| k.rel_mse),
        });
        image.metadata = Some(metadata.to_string());
        Ok(image.write(&self.path)?)
    }
}

//! The runs of one method at one amount, judged by the reference; and the pictures of it.

use rayon::prelude::*;

use super::Picture;
use super::error_map::{choose_scale, false_colours, signed_difference};
use super::fit::FitPoint;
use super::flip;
use super::metrics::Metrics;
use super::plan::{Study, StudyError};
use super::reference::Known;
use super::runs::{self, Record, make_folder};
use super::statistics::{Estimate, Gram, Moments, Weighing, brightness, mean_picture};
use super::sweep::{Findings, picture_of};
use crate::image_io::Image;

/// A method at an amount.
#[derive(Clone, Debug)]
pub struct Row {
    /// Indices into the study's methods and amounts.
    pub method: usize,
    pub amount: usize,
    pub records: Vec<Record>,
    /// Each run's relMSE (the reference's own error still in it) and HDR-FLIP.
    pub each: Vec<[f64; 2]>,
    /// In units of radiance squared.
    pub absolute: Moments,
    /// Weighed as relMSE is.
    pub relative: Moments,
    /// Mean of the picture over that of the reference, less 1; `None` where that is black.
    pub brightness: Option<Estimate>,
    /// HDR-FLIP of one run's picture, mean over the runs. What the reference's noise adds is not taken off.
    pub flip: Estimate,
    pub seconds: Estimate,
    /// Mean samples per pixel.
    pub spp: f64,
    /// Mean rays of a run.
    pub rays: f64,
    /// Most memory that any of the runs took the program to, bytes.
    pub memory: Option<u64>,
    /// No other setting of the study is both faster and better.
    pub front: bool,
    /// Pictures are `images/STEM-…`.
    pub stem: String,
    /// Error of luminance of the first run that 99 % of the pixels are within, rounded up.
    pub scale: f64,
}

impl Row {
    /// Relative error of a picture: the root of relMSE.
    pub fn error(&self) -> Estimate {
        self.relative.mse.root()
    }

    /// 1 / (relMSE x seconds); `None` without error.
    pub fn efficiency(&self) -> Option<Estimate> {
        let (e, s) = (self.relative.mse, self.seconds);
        let of = |e: f64, s: f64| 1.0 / (e * s.max(1e-9));
        (e.value > 0.0).then(|| Estimate {
            value: of(e.value, s.value),
            sd: of(e.value, s.value) * (e.sd / e.value).hypot(s.sd / s.value.max(1e-9)),
            low: of(e.high, s.high),
            // Without an upper end where the error may be zero.
            high: if e.low > 0.0 {
                of(e.low, s.low)
            } else {
                f64::INFINITY
            },
        })
    }

    /// Of how many runs that told an interval of their own relMSE it holds the one measured here, less what
    /// the reference's own adds (`own`); and how many told one.
    pub fn claims_held(&self, own: f64) -> [usize; 2] {
        let pairs = self.records.iter().zip(&self.each);
        let told = pairs.filter_map(|(r, [relmse, _])| Some((r.claimed?, relmse - own)));
        told.fold([0, 0], |[held, all], ([_, low, high], relmse)| {
            [held + usize::from(low <= relmse && relmse <= high), all + 1]
        })
    }

    pub fn fit_point(&self) -> FitPoint {
        FitPoint {
            spp: self.spp,
            seconds: self.seconds.value,
            runs: self.records.len(),
            mse: self.relative.mse,
            bias2: self.relative.bias2,
            variance: self.relative.variance,
        }
    }
}

/// Measures the runs of method and amount `at`, and writes the mean of their pictures and the first of them.
///
/// # Errors
/// A run cannot be read any more, or a picture cannot be written.
pub fn row(
    study: &Study,
    at: [usize; 2],
    records: &[Record],
    known: &Known,
) -> Result<Row, StudyError> {
    let [m, a] = at;
    let (plan, method, amount) = (&study.plan, &study.methods[m], study.plan.amounts[a]);
    let pictures: Result<Vec<Picture>, StudyError> = (0..records.len())
        .map(|run| runs::picture(plan, method, amount, run))
        .collect();
    let pictures = pictures?;
    let reference = &known.reference;
    let mean = mean_picture(&pictures);
    let moments = |weighing| {
        let gram = Gram::of(&pictures, reference, weighing);
        Moments::of(&gram, reference, &mean, weighing)
    };
    let judge = |picture: &Picture| {
        [
            Metrics::of(picture, &reference.picture).rel_mse,
            flip::hdr(picture, &reference.picture, flip::DEFAULT_PPD).mean,
        ]
    };
    let each: Vec<[f64; 2]> = pictures.par_iter().map(judge).collect();
    let of = |f: &dyn Fn(&Record) -> f64| records.iter().map(f).collect::<Vec<f64>>();
    let flips: Vec<f64> = each.iter().map(|[_, flip]| *flip).collect();
    let first = &pictures[0];
    let stem = plan.picture_stem(method, amount);
    let mean = picture_of(first.width, &mean);
    let folder = plan.folder.join("images");
    make_folder(&folder)?;
    to_image(&mean).write(folder.join(format!("{stem}-mean.exr")))?;
    to_image(&mean).write(folder.join(format!("{stem}-mean.png")))?;
    to_image(first).write(folder.join(format!("{stem}-run.png")))?;
    Ok(Row {
        method: m,
        amount: a,
        absolute: moments(Weighing::Absolute),
        relative: moments(Weighing::Relative),
        brightness: brightness(&pictures, reference),
        flip: Estimate::mean_of(&flips).above_zero(),
        seconds: Estimate::mean_of(&of(&|r| r.seconds)).above_zero(),
        spp: Estimate::mean_of(&of(&|r| r.spp as f64)).value,
        rays: Estimate::mean_of(&of(&|r| r.rays as f64)).value,
        memory: records.iter().filter_map(|r| r.memory).max(),
        records: records.to_vec(),
        each,
        front: false,
        stem,
        scale: choose_scale(&signed_difference(first, &reference.picture)),
    })
}

pub fn to_image(picture: &Picture) -> Image {
    Image::from_rgb(picture.width, picture.height, &picture.pixels)
}

/// Marks the settings that no other beats in both time and error.
pub fn mark_front(rows: &mut [Row]) {
    let at: Vec<[f64; 2]> = rows
        .iter()
        .map(|r| [r.seconds.value, r.relative.mse.value])
        .collect();
    for (i, row) in rows.iter_mut().enumerate() {
        let beats = |b: &[f64; 2]| b[0] <= at[i][0] && b[1] <= at[i][1] && *b != at[i];
        row.front = !at.iter().any(beats);
    }
}

/// The scale that the error maps of one amount share, so that methods can be compared.
pub fn common_scale(rows: &[Row], amount: usize) -> f64 {
    let of_amount = rows.iter().filter(|r| r.amount == amount);
    let largest = of_amount.map(|r| r.scale).fold(0.0, f64::max);
    if largest > 0.0 { largest } else { 1.0 }
}

/// Writes the reference as PNG, and for every setting the signed error of the first run and of the mean.
///
/// # Errors
/// A picture cannot be read any more, or not be written.
pub fn write_maps(study: &Study, findings: &Findings) -> Result<(), StudyError> {
    let plan = &study.plan;
    let folder = plan.folder.join("images");
    let reference = &findings.reference.reference.picture;
    to_image(reference).write(folder.join("reference.png"))?;
    for row in &findings.rows {
        let scale = common_scale(&findings.rows, row.amount);
        let (first, mean) = pictures(study, row)?;
        for (picture, what) in [(&first, "error"), (&mean, "bias")] {
            let map = false_colours(picture, reference, scale);
            to_image(&map).write(folder.join(format!("{}-{what}.png", row.stem)))?;
        }
    }
    Ok(())
}

/// The first run's picture and the mean of all.
///
/// # Errors
/// They cannot be read.
pub fn pictures(study: &Study, row: &Row) -> Result<(Picture, Picture), StudyError> {
    let plan = &study.plan;
    let (method, amount) = (&study.methods[row.method], plan.amounts[row.amount]);
    let path = plan
        .folder
        .join("images")
        .join(format!("{}-mean.exr", row.stem));
    let mean = Picture::read(path).map_err(|e| StudyError::Input(e.to_string()))?;
    Ok((runs::picture(plan, method, amount, 0)?, mean))
}

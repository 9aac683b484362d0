//! The runs of a study: each is rendered once and kept as an EXR whose metadata say what it took.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use serde_json::{Value, json};

use super::plan::{Amount, FORMAT, Method, Plan, StudyError};
use super::{Picture, memory};
use crate::film::{Film, Window};
use crate::image_io::{Image, read_metadata};
use crate::math::Rgb;
use crate::render::Stats;

/// What a run took and found, but for its picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    pub seed: u64,
    /// Samples per pixel that were taken.
    pub spp: u64,
    pub seconds: f64,
    pub rays: u64,
    /// Most memory the program held meanwhile, bytes.
    pub memory: Option<u64>,
    /// Samples that were NaN, infinite or negative, and left out.
    pub invalid: u64,
    /// relMSE that the run estimated for itself, with its interval.
    pub claimed: Option<[f64; 3]>,
}

impl Record {
    fn new(seed: u64, film: &Film, stats: &Stats, memory: Option<u64>) -> Record {
        Record {
            seed,
            spp: film.spp(),
            seconds: stats.seconds,
            rays: stats.rays.total(),
            memory,
            invalid: stats.invalid.count,
            claimed: film
                .estimate_error()
                .map(|e| [e.relmse, e.ci95[0], e.ci95[1]]),
        }
    }

    fn to_json(&self, hash: &str) -> Value {
        json!({
            "luxel_study": FORMAT,
            "hash": hash,
            "seed": self.seed,
            "spp": self.spp,
            "seconds": self.seconds,
            "rays": self.rays,
            "peak_memory_bytes": self.memory,
            "invalid_samples": self.invalid,
            "claimed_relmse": self.claimed,
        })
    }

    /// `None` for anything that [`Record::to_json`] has not written for the run of this hash.
    fn from_json(text: &str, hash: &str) -> Option<Record> {
        let v: Value = serde_json::from_str(text).ok()?;
        if v["hash"] != hash || v["luxel_study"] != FORMAT {
            return None;
        }
        let claimed = v["claimed_relmse"].as_array().and_then(|a| {
            let numbers: Option<Vec<f64>> = a.iter().map(Value::as_f64).collect();
            numbers?.try_into().ok()
        });
        Some(Record {
            seed: v["seed"].as_u64()?,
            spp: v["spp"].as_u64()?,
            seconds: v["seconds"].as_f64()?,
            rays: v["rays"].as_u64()?,
            memory: v["peak_memory_bytes"].as_u64(),
            invalid: v["invalid_samples"].as_u64()?,
            claimed,
        })
    }
}

/// What is kept of a run; `None` where there is nothing, or where it cannot be read.
pub fn kept(plan: &Plan, method: &Method, amount: Amount, run: usize) -> Option<Record> {
    let path = plan.run_file(method, amount, run);
    let text = read_metadata(&path).ok()??;
    Record::from_json(&text, &plan.run_hash(method, amount, run))
}

/// The picture of a run that is kept.
///
/// # Errors
/// The file cannot be read, or has another size than the film.
pub fn picture(
    plan: &Plan,
    method: &Method,
    amount: Amount,
    run: usize,
) -> Result<Picture, StudyError> {
    let path = plan.run_file(method, amount, run);
    let read = Picture::read(&path).map_err(|e| StudyError::Input(e.to_string()))?;
    check_size(&path, &read, method.job.film.crop)?;
    Ok(read)
}

/// Whether a picture has the size of what the study renders; if not, the error names both.
pub fn check_size(path: &Path, picture: &Picture, window: Window) -> Result<(), StudyError> {
    let wanted = (window.width as usize, window.height as usize);
    if (picture.width, picture.height) == wanted {
        return Ok(());
    }
    Err(StudyError::Input(format!(
        "{}: {} x {} pixels, but the study renders {} x {}: set the size with --resolution",
        path.display(),
        picture.width,
        picture.height,
        wanted.0,
        wanted.1
    )))
}

/// Renders one run and keeps it; `Ok(None)` when `stopped` said so before it was done: then nothing is kept.
///
/// # Errors
/// The scene cannot be rendered so, or the file cannot be written.
pub fn render(
    plan: &Plan,
    method: &mut Method,
    amount: Amount,
    run: usize,
    stopped: &dyn Fn() -> bool,
) -> Result<Option<Record>, StudyError> {
    let seed = plan.seed(amount, run);
    method.job.seed = seed;
    memory::forget_peak();
    let mut cut_short = false;
    let rendered = method.job.render(amount.stop(), |_, _| {
        cut_short |= stopped();
        match cut_short {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    let (film, stats) =
        rendered.map_err(|e| StudyError::Input(format!("{}: {e}", method.label)))?;
    if cut_short {
        return Ok(None);
    }
    let record = Record::new(seed, &film, &stats, memory::peak());
    let path = plan.run_file(method, amount, run);
    if let Some(folder) = path.parent() {
        make_folder(folder)?;
    }
    let mut image = film_image(&film);
    image.metadata = Some(
        record
            .to_json(&plan.run_hash(method, amount, run))
            .to_string(),
    );
    image.write(&path)?;
    Ok(Some(record))
}

/// The means of the pixels.
pub fn film_image(film: &Film) -> Image {
    let window = film.window();
    let pixels: Vec<Rgb> = film.mean().iter().map(to_rgb).collect();
    Image::from_rgb(window.width as usize, window.height as usize, &pixels)
}

pub fn to_rgb(v: &[f64; 3]) -> Rgb {
    Rgb::from_array(v.map(|v| v as f32))
}

/// # Errors
/// It cannot be made.
pub fn make_folder(path: &Path) -> Result<(), StudyError> {
    fs::create_dir_all(path)
        .map_err(|e| StudyError::Output(format!("cannot make the folder {}: {e}", path.display())))
}

/// Makes the folder ready: what is there belongs to this study, or there is nothing.
///
/// # Errors
/// The folder holds another study, or other things; or cannot be written to.
pub fn claim_folder(plan: &Plan) -> Result<(), StudyError> {
    let folder = &plan.folder;
    let mark = folder.join("study.json");
    let shown = folder.display();
    if let Ok(text) = fs::read_to_string(&mark) {
        let kept: Value = serde_json::from_str(&text).unwrap_or(Value::Null);
        return match plan.identity_json() == kept {
            true => Ok(()),
            false => Err(StudyError::Input(other_study(plan, &kept))),
        };
    }
    if fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(StudyError::Input(format!(
            "{shown} is not empty and holds no study: give -o a folder that is new or empty"
        )));
    }
    make_folder(folder)?;
    let text = format!("{:#}\n", plan.identity_json());
    crate::image_io::write_atomic(&mark, text.as_bytes())?;
    Ok(())
}

fn other_study(plan: &Plan, kept: &Value) -> String {
    let folder = plan.folder.display();
    if kept["luxel_study"] != FORMAT {
        return format!(
            "{folder}/study.json is not of this version of luxel: choose another folder"
        );
    }
    let differs = |(name, text): &&(&str, String)| kept["of"][*name].as_str() != Some(text);
    let differences: Vec<String> = plan
        .identity
        .iter()
        .filter(differs)
        .map(|(name, text)| {
            let there = kept["of"][*name].as_str().unwrap_or("nothing");
            format!("{name} is {there} there and {text} here")
        })
        .collect();
    format!(
        "{folder} holds a study of something else ({}): choose another folder with -o, or remove that one",
        differences.join(", ")
    )
}

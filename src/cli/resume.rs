//! Checkpoints of long renders.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::Failure;
use super::render::parse_duration;
use crate::film::Film;
use crate::format::SceneDesc;
use crate::image_io::Image;
use crate::render::{Identity, Job, Metadata, Saved, Shard, Stats, Work};
use std::sync::OnceLock;

/// Time between two checkpoints; `None`: there are none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interval(pub Option<Duration>);

pub fn parse_interval(text: &str) -> Result<Interval, String> {
    match text {
        "never" => Ok(Interval(None)),
        _ => match parse_duration(text) {
            Ok(time) => Ok(Interval(Some(time))),
            Err(what) => Err(format!("{what}, or never")),
        },
    }
}

/// Where the checkpoint of a render that writes `output` is.
pub fn beside(output: &Path) -> PathBuf {
    output.with_extension("checkpoint.exr")
}

/// What is rendered.
pub struct Rendering<'a> {
    pub job: &'a Job,
    pub work: Work,
    pub desc: &'a SceneDesc,
    pub metadata: &'a Metadata,
    /// Found out when it is needed first: a short render needs it not at all.
    identity: OnceLock<Identity>,
}

impl<'a> Rendering<'a> {
    pub fn new(job: &'a Job, work: Work, desc: &'a SceneDesc, metadata: &'a Metadata) -> Self {
        Rendering {
            job,
            work,
            desc,
            metadata,
            identity: OnceLock::new(),
        }
    }

    pub fn identity(&self) -> Result<&Identity, Failure> {
        if let Some(known) = self.identity.get() {
            return Ok(known);
        }
        let unread = |e| {
            Failure::Input(format!(
                "a file that the scene names cannot be read again: {e}"
            ))
        };
        let hash = self.desc.content_hash().map_err(unread)?;
        Ok((self.identity).get_or_init(|| Identity::new(self.job, self.work.stop, &hash)))
    }

    /// What was done so far, as a file keeps it.
    pub fn image(&self, film: &Film, stats: &Stats) -> Result<Image, Failure> {
        let identity = self.identity()?;
        Ok((self.job).to_be_saved(identity, &self.work, film, stats, self.metadata))
    }
}

/// Time that writing the first checkpoint may take.
fn expected(film: &Film) -> Duration {
    /// Measured on one machine; after the first checkpoint it is known better.
    const BYTES_PER_SECOND: f64 = 2e8;
    let pixels = f64::from(film.window().width) * f64::from(film.window().height);
    let sums = f64::from(film.replicates()) * 3.0 * 16.0;
    Duration::from_secs_f64(pixels * sums / BYTES_PER_SECOND)
}

/// The file beside an output that keeps what was done.
pub struct Checkpoints<'a> {
    path: PathBuf,
    output: &'a Path,
    interval: Option<Duration>,
    of: &'a Rendering<'a>,
    last: Instant,
    /// What the last one took.
    took: Option<Duration>,
    failed: bool,
    /// Whether there is one that this render wrote or went on from.
    exists: bool,
}

impl<'a> Checkpoints<'a> {
    pub fn new(
        output: &'a Path,
        interval: Option<Duration>,
        of: &'a Rendering<'a>,
    ) -> Checkpoints<'a> {
        Checkpoints {
            path: beside(output),
            output,
            interval,
            of,
            last: Instant::now(),
            took: None,
            failed: false,
            exists: false,
        }
    }

    /// What was done before: by the checkpoint, or without one by the shard itself, which holds as much.
    pub fn resume(&mut self) -> Result<(Film, Stats), Failure> {
        let Rendering { job, work, .. } = self.of;
        self.exists = self.path.exists();
        let saved = if self.exists {
            self.read(&self.path)?
        } else if Saved::is_one(self.output) {
            // Without --shard it is refused, not replaced.
            self.read(self.output)?
        } else {
            let shown = self.path.display();
            eprintln!("there is no {shown}: rendering from the start");
            return Ok((job.film_for(work), Stats::default()));
        };
        Ok((saved.film, saved.stats))
    }

    /// What was done of this very render, told to the user.
    fn read(&self, path: &Path) -> Result<Saved, Failure> {
        let shown = path.display();
        let wrong = |what: String| {
            Failure::Input(format!(
                "cannot go on from {shown}: {what}; render with what it was made with, or remove it to begin anew"
            ))
        };
        let saved = Saved::read(path).map_err(wrong)?;
        if let Some(what) = self.of.identity()?.difference(&saved.identity) {
            return Err(wrong(what));
        }
        if saved.shard != self.of.work.shard {
            return Err(wrong(match saved.shard {
                Some(Shard { number, of }) => format!("it is shard {number}/{of}"),
                None => "it is of the whole picture, not of a shard".to_string(),
            }));
        }
        match saved.is_complete() {
            true => eprintln!("{shown} is complete: nothing is left to render"),
            false => eprintln!(
                "going on from {shown}: {} samples per pixel are done",
                saved.film.spp()
            ),
        }
        Ok(saved)
    }

    /// Writes the last one, unless none are wanted: gives a warning if that fails.
    pub fn keep(&mut self, film: &Film, stats: &Stats) -> Option<String> {
        self.interval?;
        let failure = self.write(film, stats).err()?;
        Some(format!("{failure}; there is no checkpoint to go on from"))
    }

    /// Writes one if it is time to: gives a warning if that fails, once.
    pub fn update(&mut self, film: &Film, stats: &Stats) -> Option<String> {
        /// Share of the time that writing may take.
        const SHARE: u32 = 100;
        let took = self.took.unwrap_or_else(|| expected(film));
        let interval = self.interval?.max(took * SHARE);
        if self.last.elapsed() < interval || film.samples() == 0 || stats.solving.is_some() {
            return None;
        }
        let failure = self.write(film, stats).err()?;
        let first = !std::mem::replace(&mut self.failed, true);
        first.then(|| format!("{failure}; rendering goes on without a checkpoint"))
    }

    pub fn write(&mut self, film: &Film, stats: &Stats) -> Result<&Path, Failure> {
        let start = Instant::now();
        let image = self.of.image(film, stats);
        let written = image.and_then(|image| Ok(image.write(&self.path)?));
        (self.last, self.took) = (Instant::now(), Some(start.elapsed()));
        written?;
        self.exists = true;
        Ok(&self.path)
    }

    /// It is needed no more.
    pub fn remove(&self) {
        if self.exists {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

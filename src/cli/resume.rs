//! Checkpoints of long renders.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::Failure;
use super::render::parse_duration;
use crate::film::Film;
use crate::render::{Identity, Job, Metadata, Saved, Stats, Work};

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

/// The file beside an output that keeps what was done.
pub struct Checkpoints<'a> {
    path: PathBuf,
    interval: Option<Duration>,
    of: (&'a Job, &'a Identity, &'a Metadata),
    last: Instant,
    /// What the last one took.
    took: Duration,
    failed: bool,
    /// Whether there is one that this render wrote or went on from.
    exists: bool,
}

impl<'a> Checkpoints<'a> {
    pub fn new(
        output: &Path,
        interval: Option<Duration>,
        of: (&'a Job, &'a Identity, &'a Metadata),
    ) -> Checkpoints<'a> {
        Checkpoints {
            path: output.with_extension("checkpoint.exr"),
            interval,
            of,
            last: Instant::now(),
            took: Duration::ZERO,
            failed: false,
            exists: false,
        }
    }

    /// What was done before.
    pub fn resume(&mut self, work: &Work) -> Result<(Film, Stats), Failure> {
        let (job, identity, _) = self.of;
        let shown = self.path.display();
        if !self.path.exists() {
            eprintln!("there is no {shown}: rendering from the start");
            return Ok((job.film_for(work), Stats::default()));
        }
        let wrong = |what: String| {
            Failure::Input(format!(
                "cannot go on from {shown}: {what}; render with what it was made with, or remove it to begin anew"
            ))
        };
        let saved = Saved::read(&self.path).map_err(wrong)?;
        if let Some(what) = identity.difference(&saved.identity) {
            return Err(wrong(what));
        }
        if saved.shard != work.shard {
            return Err(wrong("it is of another shard".to_string()));
        }
        self.exists = true;
        Ok((saved.film, saved.stats))
    }

    /// Writes one if it is time to: gives a warning if that fails, once.
    pub fn update(&mut self, work: &Work, film: &Film, stats: &Stats) -> Option<String> {
        /// Share of the time that writing may take.
        const SHARE: u32 = 100;
        let interval = self.interval?.max(self.took * SHARE);
        if self.last.elapsed() < interval || film.samples() == 0 || stats.solving.is_some() {
            return None;
        }
        let failure = self.write(work, film, stats).err()?;
        let first = !std::mem::replace(&mut self.failed, true);
        first.then(|| format!("{failure}; rendering goes on without a checkpoint"))
    }

    pub fn write(&mut self, work: &Work, film: &Film, stats: &Stats) -> Result<&Path, Failure> {
        let start = Instant::now();
        let (job, identity, metadata) = self.of;
        let image = job.to_be_saved(identity, work, film, stats, metadata);
        let written = image.write(&self.path);
        (self.last, self.took) = (Instant::now(), start.elapsed());
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

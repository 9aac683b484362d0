//! When to stop, and how much to do until then.

use std::ops::Range;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::pass::Samples;
use crate::film::{Film, Taken};

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// After this many samples per pixel.
    Spp(u64),
    /// After this much time, at the end of a pass; at least one sample per pixel is taken.
    Time(Duration),
    /// When the picture is as good as this, or after that much time.
    Error {
        target: Target,
        within: Option<Duration>,
    },
}

/// How good a picture is to be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Relative error, 0.01 for 1 %: the root of relMSE, the upper end of its 95 % interval.
    pub error: f64,
    /// Share of the pixels whose relative standard error is no more than that, in place of relMSE.
    pub quantile: Option<f64>,
}

/// One of several parts of a picture that are rendered apart: number `number` of `of`, from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    pub number: u64,
    pub of: u64,
}

/// What is to be done of a job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Work {
    /// Of the whole picture.
    pub stop: Stop,
    /// Only this part of its samples; by number of samples alone.
    pub shard: Option<Shard>,
}

impl Stop {
    /// Samples per pixel, where they are known before.
    pub fn spp(self) -> Option<u64> {
        match self {
            Stop::Spp(n) => Some(n),
            Stop::Time(_) | Stop::Error { .. } => None,
        }
    }
}

impl Shard {
    /// Its samples of `spp`.
    pub fn range(&self, spp: u64) -> Range<u64> {
        let end = |i: u64| (u128::from(spp) * u128::from(i) / u128::from(self.of)) as u64;
        end(self.number - 1)..end(self.number)
    }
}

impl Work {
    pub fn whole(stop: Stop) -> Work {
        Work { stop, shard: None }
    }

    /// The samples that each pixel is to get, where that is known before.
    pub fn range(&self) -> Option<Range<u64>> {
        let spp = self.stop.spp()?;
        Some(self.shard.map_or(0..spp, |shard| shard.range(spp)))
    }

    pub(super) fn limit(&self) -> Option<Duration> {
        match self.stop {
            Stop::Spp(_) => None,
            Stop::Time(limit) => Some(limit),
            Stop::Error { within, .. } => within,
        }
    }
}

/// Longest pass: how often progress is shown and a request to stop is heard, memory and samples allowing.
const PASS: Duration = Duration::from_millis(400);

/// How fast it goes.
pub(super) struct Clock {
    start: Instant,
    /// Seconds that were spent before.
    before: f64,
    /// Samples taken since, and the time that they took.
    samples: u64,
    spent: Duration,
}

impl Clock {
    pub fn new(start: Instant, before: f64) -> Clock {
        Clock {
            start,
            before,
            samples: 0,
            spent: Duration::ZERO,
        }
    }

    pub fn count(&mut self, samples: u64, took: Duration) {
        self.samples += samples;
        self.spent += took;
    }

    /// What the next pass takes; `None` to stop.
    pub fn next_pass(&self, work: &Work, film: &Film) -> Option<Samples> {
        let pixels = u64::from(film.window().width) * u64::from(film.window().height);
        let per_sample = self.spent.as_secs_f64() / self.samples.max(1) as f64;
        // Samples of all pixels.
        let affordable = |time: f64| (time / per_sample.max(1e-12)) as u64;
        let mut most = match self.samples {
            0 => pixels,
            // At most doubling: the first passes also pay for warming up.
            done => affordable(PASS.as_secs_f64()).min(done),
        };
        if let Some(limit) = work.limit().filter(|_| film.samples() > 0) {
            let left = limit.as_secs_f64() - self.before - self.start.elapsed().as_secs_f64();
            let left = affordable(left.max(0.0));
            // A sample of all pixels may take longer than a pass should.
            most = most.max(pixels);
            if left < pixels && film.range().is_some() || left == 0 {
                return None;
            }
            most = most.min(left);
        }
        let Some(next) = film.range().map(|range| range.end) else {
            return to_goals(film, most);
        };
        let end = match work.stop {
            Stop::Spp(_) => work.range().map_or(0, |range| range.end),
            Stop::Time(_) => u64::MAX,
            Stop::Error { .. } => film.goal(),
        };
        let n = (most / pixels.max(1)).max(1).min(end.saturating_sub(next));
        (n > 0).then_some(Samples::Range(next..next + n))
    }
}

/// So many samples of each half of a tile that all together are about `most`.
fn to_goals(film: &Film, most: u64) -> Option<Samples> {
    let (mut pixels, mut farthest) = (0, 0);
    for tile in film.tiles() {
        let Taken::Halves(done) = tile.taken() else {
            return None;
        };
        let missing = [0, 1].map(|half| tile.goal()[half].saturating_sub(done[half]));
        farthest = farthest.max(missing[0].max(missing[1]));
        let open = missing.iter().filter(|n| **n > 0).count() as u64;
        pixels += open * u64::from(tile.width * tile.height);
    }
    let n = (most / pixels.max(1)).clamp(1, farthest.max(1));
    (farthest > 0).then_some(Samples::ToGoal(n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_all_samples_and_no_sample_twice() {
        for (spp, of) in [(1, 1), (7, 3), (64, 5), (3, 8), (u64::MAX, 3)] {
            let mut next = 0;
            for number in 1..=of {
                let range = Shard { number, of }.range(spp);
                assert_eq!(range.start, next);
                next = range.end;
            }
            assert_eq!(next, spp);
        }
    }
}

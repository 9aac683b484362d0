//! Which integrator suits a scene best: found out by trying those that may.
//!
//! Each takes a few samples of the whole picture. An integrator is worth 1 / (v s), v the squared error of one sample of
//! each pixel relative to the picture, and s the seconds that it takes; what has to be prepared first is counted beside
//! it. The one that is through first is chosen, and goes on from the samples that it has taken: the picture is the same
//! as if it had been asked for by name.
//!
//! Two things that the spread of few samples does not show are looked at. Light that hardly any sample finds: where
//! another integrator finds significantly more of it, so much is missing. How rarely it is found is not known, only that it
//! is very bright then, so the squared error that its absence makes is not taken to fall at all. And the slower way down
//! where photons are merged: as their radius shrinks by default, variance falls as N^-3/4 and squared bias as N^-1/2 (Knaus &
//! Zwicker 2011), in place of N^-1, so N^-2/3 is taken for both.

use std::ops::ControlFlow;
use std::time::Instant;

use serde_json::{Value, json};

use super::{Job, RenderError, Stats, Stop, Work};
use crate::film::{FEWEST, Film, Glance, PixelGlance};
use crate::transport::IntegratorSpec;
use crate::transport::candidates::Candidate;

/// Share of the time of the whole picture that a trial takes, unless that is too little to see anything; and that it may
/// take at most, beyond so many seconds.
const SHARE: f64 = 0.03;
const MOST: f64 = 0.1;
const SHORT: f64 = 0.1;
/// Samples of each pixel that say enough.
const ENOUGH: f64 = 16.0;
/// Samples after which the relMSE of merged photons has begun to fall more slowly. Measured in the built-in scene: after
/// 64 and 256 samples it was 1.35 and 2.0 times what the spread of the first two promises.
const SLOW_FROM: f64 = 32.0;
/// Standard errors by which the means of two integrators differ when one of them misses light.
const SIGNIFICANT: f64 = 3.0;
/// What is added to a squared mean that an error is relative to.
const FLOOR: f64 = 0.01;

/// What became of an integrator.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Options of the command line that ask for it.
    pub options: &'static str,
    /// What was found, or why it was not tried.
    pub found: Result<Measured, String>,
}

/// What a trial found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Samples of each pixel.
    pub samples: f64,
    /// relMSE of a picture of one sample per pixel, by the spread of the samples.
    pub relmse: f64,
    /// relMSE that light makes which others found and this one did not.
    pub missed: f64,
    /// Seconds for one sample of each pixel.
    pub seconds: f64,
    /// Whether it is biased, as long as photons are merged over some radius.
    pub biased: bool,
    /// Seconds for what is prepared before.
    pub prepared: f64,
    /// Seconds until the picture is as good as is asked for; where a number of samples or a time is, as good as the best
    /// of all would be then.
    pub whole: f64,
}

impl Measured {
    /// 1 / (relMSE × seconds) of what samples show; infinite where there is no error.
    pub fn efficiency(&self) -> f64 {
        1.0 / (self.relmse * self.seconds)
    }

    /// relMSE after so many samples.
    fn after(&self, samples: f64) -> f64 {
        let slower = match self.biased {
            true => (samples / SLOW_FROM).cbrt().max(1.0),
            false => 1.0,
        };
        slower * self.relmse / samples + self.missed
    }

    /// Samples until that relMSE; one, where there is no error. What misses light never gets below it, but what is missed
    /// is not known so well that it should decide alone: it is held to take four times as long where it is as large as what
    /// is wanted, and the more the larger it is.
    fn until(&self, wanted: f64) -> f64 {
        let wanted = wanted.max(f64::MIN_POSITIVE);
        let late = (1.0 + self.missed / wanted).powi(2);
        let n = (self.relmse / wanted * late).max(1.0);
        match self.biased {
            true => n * (n / SLOW_FROM).sqrt().max(1.0),
            false => n,
        }
    }
}

/// Which integrator was chosen, and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    pub trials: Vec<Trial>,
    /// Number of the one that was chosen.
    pub chosen: usize,
    /// Whether the trials were stopped before all were made.
    pub stopped: bool,
}

impl Choice {
    pub fn options(&self) -> &'static str {
        self.trials[self.chosen].options
    }

    pub fn to_json(&self) -> Value {
        let of = |trial: &Trial| match &trial.found {
            Ok(m) => json!({
                "options": trial.options,
                "biased": m.biased,
                "samples": m.samples,
                "relmse_of_one_sample": m.relmse,
                "relmse_of_missed_light": m.missed,
                "seconds_per_sample": m.seconds,
                "seconds_to_prepare": m.prepared,
                "efficiency": m.efficiency(),
                "seconds_to_be_as_good": m.whole,
            }),
            Err(why) => {
                json!({ "options": trial.options, "not_tried": why })
            }
        };
        json!({
            "chosen": self.options(),
            "trials": self.trials.iter().map(of).collect::<Vec<_>>(),
        })
    }
}

/// What was rendered on trial.
struct Flown {
    spec: IntegratorSpec,
    /// Of the best so far only: films are large.
    film: Option<Film>,
    /// Of each pixel.
    samples: f64,
    stats: Stats,
    glance: Option<Vec<Glance>>,
}

impl Flown {
    fn prepared(&self) -> f64 {
        self.stats.phases.setup + self.stats.phases.radiosity
    }

    /// For one sample of each pixel.
    fn seconds(&self) -> f64 {
        (self.stats.seconds - self.prepared()).max(0.0) / self.samples.max(1.0)
    }

    /// relMSE of one sample, by its own means.
    fn relmse(&self) -> Option<f64> {
        let pixels = self.glance.as_ref()?.iter().flat_map(|g| &g.pixels);
        let relative =
            |p: &PixelGlance| f64::from(p.of_sample) / (f64::from(p.mean).powi(2) + FLOOR);
        let (sum, n) = pixels.fold((0.0, 0.0), |(sum, n), p| (sum + relative(p), n + 1.0));
        Some(sum / f64::max(n, 1.0))
    }

    /// Seconds for the picture that `work` asks for.
    fn whole(&self, work: &Work) -> Option<f64> {
        let wanted = match work.stop {
            Stop::Spp(n) => return Some(self.prepared() + self.seconds() * n as f64),
            Stop::Time(limit) => return Some(limit.as_secs_f64()),
            Stop::Error { target, .. } => target.error * target.error,
        };
        let seconds = self.prepared() + self.seconds() * self.relmse()? / wanted;
        let within = work
            .limit()
            .map_or(f64::INFINITY, |limit| limit.as_secs_f64());
        Some(seconds.min(within))
    }
}

fn pixels(film: &Film) -> f64 {
    f64::from(film.window().width) * f64::from(film.window().height)
}

impl Job {
    /// Tries `candidates`, and makes the best of them the job's integrator. What it has rendered of `work` on trial is
    /// to be gone on with by [`Job::go_on`]. `on_pass` sees every pass of every trial, with the options that ask for
    /// what is tried; if it breaks, the choice is made of what is known by then.
    ///
    /// # Errors
    /// None of them can render the scene.
    pub fn choose(
        &mut self,
        candidates: Vec<Candidate>,
        work: &Work,
        mut on_pass: impl FnMut(&str, &Film, &Stats) -> ControlFlow<()>,
    ) -> Result<(Choice, Film, Stats), RenderError> {
        let start = Instant::now();
        let mut stopped = false;
        let mut whole = match work.stop {
            Stop::Time(limit) => Some(limit.as_secs_f64()),
            Stop::Spp(_) | Stop::Error { .. } => None,
        };
        let mut trials: Vec<Trial> = Vec::new();
        let mut flown: Vec<Option<Flown>> = Vec::new();
        for Candidate { options, spec } in candidates {
            let outcome = match spec {
                Err(why) => Err(why.to_string()),
                Ok(_) if stopped => Err("it was stopped before".to_string()),
                Ok(spec) => {
                    self.integrator = spec;
                    let is_first = flown.iter().all(Option::is_none);
                    self.fly(work, whole, is_first, |film, stats| {
                        let flow = on_pass(options, film, stats);
                        stopped |= flow.is_break();
                        flow
                    })
                }
            };
            if let Ok(flown) = &outcome {
                whole = whole.or_else(|| flown.whole(work));
            }
            trials.push(Trial {
                options,
                found: Err(outcome.as_ref().err().cloned().unwrap_or_default()),
            });
            flown.push(outcome.ok());
            judge(&mut trials, &flown, work);
            let best = best(&trials, &flown);
            let others = flown
                .iter_mut()
                .enumerate()
                .filter(|(i, _)| Some(*i) != best);
            others
                .filter_map(|(_, other)| other.as_mut())
                .for_each(|other| other.film = None);
        }
        let Some(chosen) = best(&trials, &flown) else {
            return Err(RenderError::NoChoice(Choice {
                trials,
                chosen: 0,
                stopped,
            }));
        };
        let choice = Choice {
            trials,
            chosen,
            stopped,
        };
        let Some(winner) = flown.swap_remove(chosen) else {
            return Err(RenderError::NoChoice(choice));
        };
        self.integrator = winner.spec;
        for entry in self.integrator.plan(&self.scene) {
            self.scene.decide(entry);
        }
        // One that seemed worse until another showed what to compare with begins anew.
        let (film, mut stats) = match winner.film {
            Some(film) => (film, winner.stats),
            None => (self.film_for(work), Stats::default()),
        };
        let all = start.elapsed().as_secs_f64();
        stats.phases.trials = (all - stats.seconds).max(0.0);
        stats.seconds = stats.seconds.max(all);
        Ok((choice, film, stats))
    }

    /// Tries the job's integrator for as long as a trial may take in a picture of `whole` seconds, if that is known; the
    /// first takes as long as it needs, for something has to be known. Why it is given up, if it is.
    fn fly(
        &self,
        work: &Work,
        whole: Option<f64>,
        is_first: bool,
        mut on_pass: impl FnMut(&Film, &Stats) -> ControlFlow<()>,
    ) -> Result<Flown, String> {
        let film = self.film_for(work);
        let start = Instant::now();
        let transport = self.transport(film.replicates(), work.stop.spp());
        transport.fits()?;
        let mut stats = Stats::default();
        stats.phases.setup = start.elapsed().as_secs_f64();
        stats.seconds = stats.phases.setup;
        let needed = f64::from(film.replicates().min(FEWEST));
        // Seconds or samples, whichever come first.
        let share = whole.map_or(f64::INFINITY, |whole| SHARE * whole);
        let enough = match (whole, work.stop) {
            (None, Stop::Spp(n)) => (SHARE * n as f64).clamp(needed, ENOUGH),
            _ => ENOUGH,
        };
        let most = match (is_first, whole) {
            (false, Some(whole)) => (MOST * whole).max(SHORT),
            _ => f64::INFINITY,
        };
        let mut given_up = None;
        let pass = |film: &Film, stats: &Stats| {
            let flow = on_pass(film, stats);
            let taken = film.samples() as f64 / pixels(film);
            let expected = stats.phases.radiosity
                + (stats.seconds - stats.phases.radiosity) * needed / taken.max(1.0);
            if stats.solving.is_some() {
                given_up = (stats.seconds > most)
                    .then(|| "solving for radiosity takes too long for such a picture".to_string());
            } else if taken < needed && expected > most {
                given_up = Some(format!(
                    "{needed} samples would take {expected:.1} s, too long for such a picture"
                ));
            }
            // Of the samples alone: few of them hide that some are rare and bright.
            let seconds = stats.seconds - stats.phases.setup - stats.phases.radiosity;
            let seen = taken >= needed && (seconds >= share || taken >= enough);
            match given_up.is_some() || seen {
                true => ControlFlow::Break(()),
                false => flow,
            }
        };
        let gone = self.go_on_by(&transport, work, film, stats, pass);
        let (film, stats) = gone.map_err(|e| e.to_string())?;
        if let Some(why) = given_up {
            return Err(why);
        }
        let solution = transport.solution();
        if matches!(self.integrator, IntegratorSpec::Cached(_)) && solution.is_none() {
            return Err("radiosity would not be worth its while".to_string());
        }
        Ok(Flown {
            spec: self.integrator.clone().with_solution(solution),
            glance: film.glance(),
            samples: film.samples() as f64 / pixels(&film),
            film: Some(film),
            stats,
        })
    }
}

/// Why nothing was found of what was tried.
const UNTOLD: &str = "so few samples do not tell its error";

/// Fills in what was found.
fn judge(trials: &mut [Trial], flown: &[Option<Flown>], work: &Work) {
    let seen: Vec<&[Glance]> = (flown.iter().flatten())
        .filter_map(|f| f.glance.as_deref())
        .collect();
    let Some(tiles) = seen.first().map(|s| s.len()) else {
        let untold = trials
            .iter_mut()
            .zip(flown)
            .filter(|(_, flown)| flown.is_some());
        untold.for_each(|(trial, _)| trial.found = Err(UNTOLD.to_string()));
        return;
    };
    // What all errors are relative to: the same for all, so that none is better for finding the picture brighter.
    let count = seen.len() as f64;
    let scale = |mean: f64| 1.0 / (mean.powi(2) + FLOOR);
    let of_tile = |i: usize| scale(seen.iter().map(|s| s[i].mean).sum::<f64>() / count);
    let of_pixel = |i: usize, p: usize| {
        scale(
            seen.iter()
                .map(|s| f64::from(s[i].pixels[p].mean))
                .sum::<f64>()
                / count,
        )
    };
    let pixels: f64 = seen[0].iter().map(|g| g.pixels.len() as f64).sum();
    let relmse = |glance: &[Glance]| {
        let of = |(i, tile): (usize, &Glance)| {
            let of =
                |(p, pixel): (usize, &PixelGlance)| f64::from(pixel.of_sample) * of_pixel(i, p);
            tile.pixels.iter().enumerate().map(of).sum::<f64>()
        };
        glance.iter().enumerate().map(of).sum::<f64>() / pixels
    };
    for (trial, flown) in trials.iter_mut().zip(flown) {
        let Some((flown, glance)) = flown.as_ref().and_then(|f| Some((f, f.glance.as_ref()?)))
        else {
            if flown.is_some() {
                trial.found = Err(UNTOLD.to_string());
            }
            continue;
        };
        let missing = |i: usize| {
            let own = &glance[i];
            let excess = |other: &&[Glance]| {
                let other = &other[i];
                other.mean - own.mean - SIGNIFICANT * (own.variance + other.variance).sqrt()
            };
            let excess = seen.iter().map(excess).fold(0.0, f64::max);
            own.pixels.len() as f64 * excess.powi(2) * of_tile(i)
        };
        trial.found = Ok(Measured {
            samples: flown.samples,
            relmse: relmse(glance),
            missed: (0..tiles).map(missing).sum::<f64>() / pixels,
            seconds: flown.seconds(),
            biased: flown.spec.biased(),
            prepared: flown.prepared(),
            whole: 0.0,
        });
    }
    let measured = || trials.iter().filter_map(|t| t.found.as_ref().ok());
    let least = |value: &dyn Fn(&Measured) -> f64| measured().map(value).fold(f64::MAX, f64::min);
    let wanted = match work.stop {
        Stop::Spp(n) => least(&|m| m.after(n.max(1) as f64)),
        Stop::Time(limit) => least(&|m| {
            let left = limit.as_secs_f64() - m.prepared;
            m.after((left / m.seconds.max(1e-9)).max(1.0))
        }),
        Stop::Error { target, .. } => target.error * target.error,
    };
    for found in trials.iter_mut().filter_map(|t| t.found.as_mut().ok()) {
        found.whole = found.prepared + found.seconds * found.until(wanted);
    }
}

/// The one that is through first; the first of all where nothing is known.
fn best(trials: &[Trial], flown: &[Option<Flown>]) -> Option<usize> {
    let cost = |(i, trial): (usize, &Trial)| trial.found.as_ref().ok().map(|m| (i, m.whole));
    let measured = trials.iter().enumerate().filter_map(cost);
    let best = measured.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map(|(i, _)| i)
        .or_else(|| flown.iter().position(Option::is_some))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_until_an_error_are_those_after_which_it_is_reached() {
        for biased in [false, true] {
            let measured = Measured {
                samples: 4.0,
                relmse: 2.0,
                missed: 0.0,
                seconds: 1.0,
                biased,
                prepared: 0.0,
                whole: 0.0,
            };
            for n in [4.0, 30.0, 1000.0, 1e6] {
                let again = measured.until(measured.after(n));
                assert!((again / n - 1.0).abs() < 1e-9, "{biased} {n}: {again}");
            }
        }
    }

    #[test]
    fn without_an_error_one_sample_is_enough() {
        let perfect = Measured {
            samples: 4.0,
            relmse: 0.0,
            missed: 0.0,
            seconds: 1.0,
            biased: false,
            prepared: 0.0,
            whole: 0.0,
        };
        for wanted in [0.0, 1e-4] {
            assert_eq!(perfect.until(wanted), 1.0);
        }
        assert_eq!(perfect.after(10.0), 0.0);
    }
}

//! A study from its beginning, or from where it stopped, to its results.

use std::time::Duration;

use super::evaluate::{self, Row};
use super::plan::{Method, Plan, ReferenceChoice, Study, StudyError};
use super::reference::{Known, Maker, TIMES_BELOW};
use super::remarks::remarks;
use super::runs::{self, Record};
use super::statistics::{Gram, Reference, Weighing, mean_picture};
use super::{Picture, flip_floor, report, results};
use crate::math::Rgb;

/// What a study found.
#[derive(Debug)]
pub struct Findings {
    pub reference: Known,
    /// How many times the reference's error is below the smallest one studied ([`TIMES_BELOW`] is what it should
    /// be), infinite for an exact one; `None` where its error is not known.
    pub times_below: Option<f64>,
    /// FLIP that the reference's noise makes alone, where that is known.
    pub flip_floor: Option<f64>,
    /// Method by method, and for each by increasing amounts.
    pub rows: Vec<Row>,
    /// What must be known before the figures are believed, in sentences.
    pub remarks: Vec<String>,
}

/// Renders what is not there yet, makes the reference, and writes results, pictures and report. `Ok(None)` when
/// `stopped` said so; what was rendered is kept, and the next call goes on from there. `say` is given a
/// line of progress at a time.
///
/// # Errors
/// See [`StudyError`].
pub fn run(
    study: &mut Study,
    stopped: &dyn Fn() -> bool,
    say: &mut dyn FnMut(&str),
) -> Result<Option<Findings>, StudyError> {
    // Wrong references are better found before long renderings, and before the folder is this study's.
    if let ReferenceChoice::File(path) = &study.reference {
        Known::read(path, study.methods[0].job.film.crop)?;
    }
    runs::claim_folder(&study.plan)?;
    let Some(records) = all_runs(study, stopped, say)? else {
        return Ok(None);
    };
    let Some((reference, times_below)) = reference(study, stopped, say)? else {
        return Ok(None);
    };
    say("measuring errors, and writing results, pictures and report");
    let mut rows = Vec::new();
    for (m, records) in records.iter().enumerate() {
        for (a, records) in records.iter().enumerate() {
            if stopped() {
                return Ok(None);
            }
            rows.push(evaluate::row(study, [m, a], records, &reference)?);
        }
    }
    evaluate::mark_front(&mut rows);
    let findings = Findings {
        remarks: remarks(study, &rows, &reference, times_below)?,
        flip_floor: flip_floor::floor(&reference.reference),
        reference,
        times_below,
        rows,
    };
    evaluate::write_maps(study, &findings)?;
    let json = results::to_json(study, &findings);
    results::write(study, &json)?;
    report::write(study, &findings, &json)?;
    Ok(Some(findings))
}

/// Of each method and amount the records of its runs.
type Records = Vec<Vec<Vec<Record>>>;

/// All runs, by increasing amounts, so that methods can be compared early.
fn all_runs(
    study: &mut Study,
    stopped: &dyn Fn() -> bool,
    say: &mut dyn FnMut(&str),
) -> Result<Option<Records>, StudyError> {
    let mut records = vec![Vec::new(); study.methods.len()];
    let plan = &study.plan;
    for &amount in &plan.amounts {
        for (method, records) in study.methods.iter_mut().zip(&mut records) {
            let mut of_point = Vec::new();
            let mut new = 0;
            for run in 0..plan.runs {
                let record = match runs::kept(plan, method, amount, run) {
                    Some(record) => record,
                    None => {
                        new += 1;
                        match runs::render(plan, method, amount, run, stopped)? {
                            Some(record) => record,
                            None => return Ok(None),
                        }
                    }
                };
                of_point.push(record);
            }
            let seconds = of_point.iter().map(|r| r.seconds).sum::<f64>() / plan.runs as f64;
            let there = plan.runs - new;
            let label = &method.label;
            say(&match there {
                0 => format!("{label}, {amount}: {new} runs of {seconds:.3} s"),
                _ if new == 0 => format!("{label}, {amount}: {there} runs were there"),
                _ => format!("{label}, {amount}: {new} runs of {seconds:.3} s, {there} were there"),
            });
            records.push(of_point);
        }
    }
    Ok(Some(records))
}

/// The reference, and how many times its error is below the smallest one studied.
fn reference(
    study: &mut Study,
    stopped: &dyn Fn() -> bool,
    say: &mut dyn FnMut(&str),
) -> Result<Option<(Known, Option<f64>)>, StudyError> {
    let Study {
        plan,
        methods,
        reference,
    } = study;
    let (method, limit) = match reference {
        ReferenceChoice::File(path) => {
            let known = Known::read(path, methods[0].job.film.crop)?;
            let times = match known.rel_mse {
                Some(own) => Some(times_below(own, target(plan, methods, &known)?)),
                None => None,
            };
            return Ok(Some((known, times)));
        }
        ReferenceChoice::Made { method, limit } => (method, *limit),
    };
    let best = match method {
        Some(_) => 0,
        None => most_efficient(plan, methods)?,
    };
    let mut maker = Maker::new(plan, method.as_deref().unwrap_or(&methods[best]));
    let spent = maker.known().map_or(0.0, |k| k.seconds);
    // The limit is for all calls together.
    let mut left = limit.saturating_sub(Duration::from_secs_f64(spent.max(0.0)));
    loop {
        let (now, target) = match maker.known() {
            None => (f64::INFINITY, f64::INFINITY),
            Some(known) => {
                let now = known.rel_mse.unwrap_or(f64::INFINITY);
                let target = target(plan, methods, &known)?;
                if now <= target || left == Duration::ZERO {
                    return Ok(Some((known, Some(times_below(now, target)))));
                }
                (now, target)
            }
        };
        if stopped() {
            return Ok(None);
        }
        let part = maker.next_part(now, target);
        if now.is_finite() {
            say(&what_is_missing(&maker, times_below(now, target), left));
        }
        let before = maker.known().map_or(0.0, |k| k.seconds);
        let by = match method {
            Some(method) => method,
            None => &mut methods[best],
        };
        maker.extend(by, part, left, stopped)?;
        let Some(known) = maker.known() else {
            continue;
        };
        left = left.saturating_sub(Duration::from_secs_f64((known.seconds - before).max(1e-3)));
        say(&format!(
            "reference: {} spp, relMSE {:.2e}, {:.0} s so far",
            known.spp.unwrap_or(0),
            known.rel_mse.unwrap_or(0.0),
            known.seconds
        ));
    }
}

/// Said before the reference is made better: how good it is, and what is to come.
fn what_is_missing(maker: &Maker, times: f64, left: Duration) -> String {
    let Some(known) = maker.known() else {
        return String::new();
    };
    let own = 100.0 * known.rel_mse.unwrap_or(0.0).sqrt();
    let left = left.as_secs_f64();
    // Below that, the smallest error studied is only guessed.
    if times < 1.0 {
        return format!(
            "reference: its error of {own:.3} % is not yet below the smallest studied; going on for {left:.0} s at most"
        );
    }
    // Noise falls at least as one over the square root of samples.
    let more = known.seconds * ((TIMES_BELOW / times).powi(2) - 1.0);
    format!(
        "reference: its error of {own:.3} % is {times:.1} times below the smallest studied; to be {TIMES_BELOW} times \
         below takes some {more:.0} s more, and it has {left:.0} s"
    )
}

/// How many times an error whose square is `own` is below the smallest one studied, `target` being what it should be.
fn times_below(own: f64, target: f64) -> f64 {
    if own <= 0.0 {
        return f64::INFINITY;
    }
    TIMES_BELOW * (target / own).sqrt()
}

/// The unbiased method whose runs at the largest amount have the least relative variance times seconds; among
/// those that find all light, if there are any. The first method where none is unbiased.
fn most_efficient(plan: &Plan, methods: &[Method]) -> Result<usize, StudyError> {
    let unbiased = |m: &&usize| !methods[**m].job.integrator.biased();
    let whole = |m: &usize| !["direct", "ptracer"].contains(&methods[*m].job.integrator.name());
    let all: Vec<usize> = (0..methods.len()).collect();
    let mut candidates: Vec<usize> = all.iter().filter(unbiased).copied().collect();
    if candidates.iter().any(whole) {
        candidates.retain(whole);
    }
    let Some(&amount) = plan.amounts.last() else {
        return Ok(0);
    };
    let mut best = (f64::INFINITY, candidates.first().copied().unwrap_or(0));
    for m in candidates {
        let runs = 0..plan.runs;
        let pictures = runs
            .clone()
            .map(|run| runs::picture(plan, &methods[m], amount, run));
        let pictures: Vec<Picture> = pictures.collect::<Result<_, _>>()?;
        let records = runs.filter_map(|run| runs::kept(plan, &methods[m], amount, run));
        let seconds: f64 = records.map(|r| r.seconds).sum();
        let mean = Reference::exact(picture_of(pictures[0].width, &mean_picture(&pictures)));
        let spread = Gram::of(&pictures, &mean, Weighing::Relative).squares();
        let cost = seconds * spread.iter().sum::<f64>();
        if cost < best.0 {
            best = (cost, m);
        }
    }
    Ok(best.1)
}

/// The relMSE that the reference should have: that of the best setting, with errors [`TIMES_BELOW`] times
/// smaller. Zero where a setting is as good as the reference itself: then it can never be good enough.
fn target(plan: &Plan, methods: &[Method], known: &Known) -> Result<f64, StudyError> {
    let own = known.rel_mse.unwrap_or(0.0);
    let mut smallest = f64::INFINITY;
    for method in methods {
        for &amount in &plan.amounts {
            let mut sum = 0.0;
            for run in 0..plan.runs {
                let picture = runs::picture(plan, method, amount, run)?;
                sum += super::metrics::Metrics::of(&picture, &known.reference.picture).rel_mse;
            }
            smallest = smallest.min((sum / plan.runs as f64 - own).max(0.0));
        }
    }
    Ok(smallest / (TIMES_BELOW * TIMES_BELOW))
}

/// Pixels in f64 as a picture of this width.
pub fn picture_of(width: usize, pixels: &[[f64; 3]]) -> Picture {
    let pixels: Vec<Rgb> = pixels.iter().map(runs::to_rgb).collect();
    Picture {
        width,
        height: pixels.len() / width.max(1),
        pixels,
    }
}

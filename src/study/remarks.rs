//! What a reader of a study must know before believing its figures: methods that do not show the same thing, and
//! intervals that do not hold.

use super::Picture;
use super::evaluate::Row;
use super::plan::{Method, Plan, Study, StudyError};
use super::reference::Known;
use super::runs;
use super::statistics::{Estimate, Gram, Moments, Reference, Weighing, mean_picture};

/// Mean pictures differ where twice the 95 % interval of their squared distance is above zero: by chance that is so
/// once in 1000 pairs of methods with 8 runs (once in 150 with 3), by Student's t.
const INTERVALS: f64 = 2.0;

/// Relative distance that float arithmetic in another order may explain.
const ARITHMETIC: f64 = 1e-3;

/// The share of intervals that are to hold, and how unlikely (for one setting) a number of those that did not must be.
const CONFIDENCE: f64 = 0.95;
const UNLIKELY: f64 = 1e-3;

/// Below this, the reference's own error decides whether an interval holds.
const REFERENCE_TIMES: f64 = 3.0;

/// Sentences for the report, `results.json` and the terminal. `times_below`: how many times the reference's error is
/// below the smallest one studied, where known.
///
/// # Errors
/// A run cannot be read any more.
pub fn remarks(
    study: &Study,
    rows: &[Row],
    known: &Known,
    times_below: Option<f64>,
) -> Result<Vec<String>, StudyError> {
    let mut all: Vec<String> = disagreement(study, rows, known)?.into_iter().collect();
    if times_below.is_none_or(|t| t >= REFERENCE_TIMES) {
        let own = known.rel_mse.unwrap_or(0.0);
        let of = |m| claims(study, rows, m, own);
        all.extend((0..study.methods.len()).filter_map(of));
    }
    Ok(all)
}

/// Unbiased methods whose mean pictures with the most samples differ from that of the least noisy one of them by
/// more than noise.
fn disagreement(study: &Study, rows: &[Row], known: &Known) -> Result<Option<String>, StudyError> {
    let (plan, methods) = (&study.plan, &study.methods);
    let last = plan.amounts.len().saturating_sub(1);
    let unbiased = |r: &&Row| r.amount == last && !methods[r.method].job.integrator.biased();
    let candidates: Vec<&Row> = rows.iter().filter(unbiased).collect();
    // Against the least noisy one the least difference is seen, and two that differ cannot both be like it.
    let noise = |r: &Row| r.relative.variance.value;
    let Some(best) = (candidates.iter()).min_by(|a, b| noise(a).total_cmp(&noise(b))) else {
        return Ok(None);
    };
    let others: Vec<&&Row> = (candidates.iter())
        .filter(|r| r.method != best.method)
        .collect();
    if others.is_empty() {
        return Ok(None);
    }
    let of_best = pictures(plan, &methods[best.method], last)?;
    let mut differ = Vec::new();
    for row in others {
        let other = pictures(plan, &methods[row.method], last)?;
        if let Some(by) = distance(&other, &of_best, &known.reference.picture) {
            let percent = |v: f64| format!("{:.2} %", 100.0 * v);
            differ.push(format!(
                "{} by {} (95 %: {} to {})",
                methods[row.method].label,
                percent(by.value),
                percent(by.low),
                percent(by.high)
            ));
        }
    }
    if differ.is_empty() {
        return Ok(None);
    }
    Ok(Some(format!(
        "these methods are unbiased, but do not show the same thing: the mean picture at {} differs from that of {}, by more than \
         noise, in {}. What is varied changes what is shown, or some methods leave out light; their errors cannot be \
         compared, and no reference is right for all",
        plan.amounts[last],
        methods[best.method].label,
        differ.join(", ")
    )))
}

fn pictures(plan: &Plan, method: &Method, amount: usize) -> Result<Vec<Picture>, StudyError> {
    let of = |run| runs::picture(plan, method, plan.amounts[amount], run);
    (0..plan.runs).map(of).collect()
}

/// How far apart the means of the pictures are, as a relative error, if that is more than noise. Runs of one number
/// may share their samples, since their seeds are the same: it is their differences that are independent of each
/// other. The reference only weighs.
fn distance(a: &[Picture], b: &[Picture], reference: &Picture) -> Option<Estimate> {
    let shifted = |(a, b): (&Picture, &Picture)| {
        let pixels = a.pixels.iter().zip(&b.pixels).zip(&reference.pixels);
        Picture {
            width: reference.width,
            height: reference.height,
            pixels: pixels.map(|((a, b), r)| *a - *b + *r).collect(),
        }
    };
    let shifted: Vec<Picture> = a.iter().zip(b).map(shifted).collect();
    let reference = Reference::exact(reference.clone());
    let gram = Gram::of(&shifted, &reference, Weighing::Relative);
    let mean = mean_picture(&shifted);
    let square = Moments::of(&gram, &reference, &mean, Weighing::Relative).bias2;
    let surely = square.value - INTERVALS * (square.value - square.low) > 0.0;
    let by = square.root();
    (surely && by.low > ARITHMETIC).then_some(by)
}

/// Where far fewer than 95 % of the intervals that runs told of their own error held.
fn claims(study: &Study, rows: &[Row], method: usize, own: f64) -> Option<String> {
    let (mut settings, mut sum) = (Vec::new(), [0, 0]);
    for row in rows.iter().filter(|r| r.method == method) {
        let [held, told] = row.claims_held(own);
        if at_most(held, told) < UNLIKELY {
            settings.push(study.plan.amounts[row.amount].to_string());
            sum = [sum[0] + held, sum[1] + told];
        }
    }
    if settings.is_empty() {
        return None;
    }
    let method = &study.methods[method];
    let why = match method.job.integrator.biased() {
        true => "bias is not in it",
        false => {
            "a few rare bright samples may make up most of the error, or the reference shows something else"
        }
    };
    Some(format!(
        "{}: the interval of its own error that `luxel render` prints does not hold for this scene at {}: it held in {} of {} \
         runs, not in {:.0} % ({why})",
        method.label,
        settings.join(", "),
        sum[0],
        sum[1],
        100.0 * CONFIDENCE
    ))
}

/// Probability that at most `held` of `told` intervals hold, if each does with [`CONFIDENCE`].
fn at_most(held: usize, told: usize) -> f64 {
    let (n, p) = (told as f64, CONFIDENCE);
    // From all of them downwards: ever less likely, and nothing underflows that counts.
    let (mut term, mut above) = (p.powf(n), 0.0);
    for k in (held + 1..=told).rev() {
        above += term;
        let k = k as f64;
        term *= k / (n - k + 1.0) * (1.0 - p) / p;
    }
    (1.0 - above).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::sampler::mix;

    #[test]
    fn unlikely_numbers_are_those_of_the_binomial_distribution() {
        // 0.05³; three misses or more of 8, by hand: 1 - 0.66342 - 0.27933 - 0.05146.
        assert!((at_most(0, 3) - 1.25e-4).abs() < 1e-12);
        assert!((at_most(5, 8) - 0.005_788).abs() < 1e-5);
        assert_eq!((at_most(0, 0), at_most(8, 8)), (1.0, 1.0));
        assert!(at_most(500, 1000) < 1e-9 && at_most(950, 1000) > 0.4);
    }

    #[test]
    fn means_differ_by_more_than_noise_or_not() {
        let mut state = 0u64;
        let mut noisy = |mean: f32| Picture {
            width: 40,
            height: 1,
            pixels: (0..40)
                .map(|_| {
                    let mut channel = || {
                        state += 1;
                        mean + (mix(state) >> 40) as f32 / (1u64 << 24) as f32 - 0.5
                    };
                    Rgb::new(channel(), channel(), channel())
                })
                .collect(),
        };
        let reference = Picture {
            width: 40,
            height: 1,
            pixels: vec![Rgb::splat(1.0); 40],
        };
        let mut false_alarms = 0;
        for _ in 0..200 {
            let mut runs = |mean| (0..8).map(|_| noisy(mean)).collect::<Vec<_>>();
            let (a, b, c) = (runs(1.0), runs(1.0), runs(1.4));
            false_alarms += usize::from(distance(&a, &b, &reference).is_some());
            let by = distance(&a, &c, &reference).unwrap();
            assert!((by.value / 0.4 - 1.0).abs() < 0.3, "{by:?}");
            assert!(distance(&a, &a, &reference).is_none());
        }
        // One in 1000 is meant; the chance of more than three of 200 is then 5e-5.
        assert!(false_alarms <= 3, "{false_alarms}");
    }
}

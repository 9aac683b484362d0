//! `--integrator auto`: the choice, and what is told of it.

use std::ops::ControlFlow;
use std::path::Path;

use super::Failure;
use super::progress::{Progress, human_seconds};
use crate::film::Film;
use crate::format::SceneDesc;
use crate::render::{Choice, Identity, Job, Saved, Stats, Trial, Work};
use crate::transport::candidates::Candidate;

/// Makes the integrator that the `checkpoint` was rendered with the job's, if it is one of the `candidates`; whether it
/// is.
pub(super) fn goes_on(
    job: &mut Job,
    candidates: &[Candidate],
    checkpoint: &Path,
    work: &Work,
    desc: &SceneDesc,
) -> Result<bool, Failure> {
    // What is wrong with it is told where it is gone on from.
    let Ok(saved) = Saved::read(checkpoint) else {
        return Ok(checkpoint.exists());
    };
    let unread = |e| {
        Failure::Input(format!(
            "a file that the scene names cannot be read again: {e}"
        ))
    };
    let hash = desc.content_hash().map_err(unread)?;
    for candidate in candidates {
        let Ok(spec) = &candidate.spec else { continue };
        job.integrator = spec.clone();
        let identity = Identity::new(job, work.stop, &hash);
        if identity.difference(&saved.identity).is_none() {
            let options = candidate.options;
            eprintln!("nothing is chosen: the checkpoint was rendered with {options}");
            break;
        }
    }
    Ok(true)
}

/// Tries `candidates`, and tells what came of it. `observe` sees what each pass has done, and may break.
pub(super) fn choose(
    job: &mut Job,
    candidates: Vec<Candidate>,
    work: &Work,
    progress: &mut Progress,
    is_stopped: impl Fn() -> bool,
) -> Result<(Choice, Film, Stats), Failure> {
    let chosen = job.choose(candidates, work, |options, film, stats| {
        progress.trying(options, film, stats);
        match is_stopped() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    progress.finish();
    let chosen = chosen.map_err(|e| Failure::Input(e.to_string()))?;
    eprint!("{}", table(&chosen.0));
    Ok(chosen)
}

/// The options without what they all begin with.
fn short(options: &str) -> &str {
    options.trim_start_matches("--integrator ")
}

/// What decided, one line per integrator.
fn table(choice: &Choice) -> String {
    let mut text = format!(
        "{:<22} {:>8} {:>14} {:>12} {:>12} {:>12} {:>12} {:>14}\n",
        "tried",
        "samples",
        "relMSE of one",
        "s per sample",
        "efficiency",
        "missed light",
        "s to prepare",
        "as good in",
    );
    let (tried, left_out): (Vec<&Trial>, Vec<&Trial>) =
        choice.trials.iter().partition(|t| t.found.is_ok());
    for trial in tried {
        let Ok(m) = &trial.found else { continue };
        let biased = if m.biased { " (biased)" } else { "" };
        text += &format!(
            "{:<22} {:>8.0} {:>14.2e} {:>12.3} {:>12.2} {:>12.1e} {:>12.1} {:>14}\n",
            format!("{}{biased}", short(trial.options)),
            m.samples,
            m.relmse,
            m.seconds,
            m.efficiency(),
            m.missed,
            m.prepared,
            human_seconds(m.whole),
        );
    }
    for trial in left_out {
        if let Err(why) = &trial.found {
            text += &format!("{:<22} not tried: {why}\n", short(trial.options));
        }
    }
    let chosen = choice.options();
    let found = &choice.trials[choice.chosen].found;
    let biased = match found.as_ref().is_ok_and(|m| m.biased) {
        true => "; its bias vanishes as samples are added, and no error that is printed holds it",
        false => "",
    };
    text + &format!(
        "chosen: {}; the same picture again by {chosen}{biased}\n",
        short(chosen)
    )
}

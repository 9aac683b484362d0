//! Progressive refinement: the patch with most light to give sends it to all others (Cohen, Chen, Wallace &
//! Greenberg 1988, "A Progressive Refinement Approach to Fast Radiosity Image Generation").

use super::watch::{Watch, grows};
use super::{Exchange, Run, Solved, System};
use crate::radiosity::{Progress, Rgb64, SolveError, Solver};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::time::Instant;

/// Rows that are found at once when one is needed: those of the patches that are next by what they have now.
/// A fixed number keeps all threads busy without letting their number matter.
const AHEAD: usize = 16;

/// Rows that are kept for patches that shoot again: memory stays in proportion to the number of patches.
const KEPT: usize = 512;

/// Shoots until the light that was not shot is a small part of what was emitted: that part bounds the residual.
/// With `ambient`, observers get the light that is not shot yet as if it were spread everywhere.
pub(super) fn shoot(
    system: &System,
    factors: &dyn Exchange,
    ambient: bool,
    run: Run,
) -> Result<Solved, SolveError> {
    let patches = &system.mesh.patches;
    let mut state = State::new(system);
    let mut rows = Rows::new(system.len());
    let mut watch = Watch::new();
    let mut seconds = 0.0;
    let mut residual = system.relative(system.watts(&state.unshot).element_sum());
    let mut steps = 0;
    while residual > run.residual && steps < run.max_steps {
        let Some(shooter) = state.brightest(system) else {
            break;
        };
        if !rows.has(shooter) {
            let start = Instant::now();
            let ahead = (run.max_steps - steps).min(AHEAD as u64) as usize;
            rows.find(factors, &state.next(system, shooter, ahead, &rows));
            seconds += start.elapsed().as_secs_f64();
        }
        let row = rows.get(shooter);
        state.shot(system, shooter, row);
        steps += 1;
        let unshot = system.watts(&state.unshot);
        residual = system.relative(unshot.element_sum());
        let progress = Progress {
            step: steps,
            mesh: system.mesh,
            radiosity: &state.radiosity,
            ambient: match ambient {
                true => spread(system, unshot),
                false => Rgb64::ZERO,
            },
            residual,
        };
        let stop = (run.observe)(&progress).is_break();
        if stop {
            break;
        }
        let round = steps.is_multiple_of(patches.len() as u64);
        if grows(residual) || (round && watch.is_stuck(residual)) {
            return Err(system.growth(Solver::Shooting, state.row_sum));
        }
    }
    Ok(Solved {
        radiosity: state.radiosity,
        irradiance: state.irradiance,
        direct: state.direct,
        steps,
        residual,
        converged: residual <= run.residual,
        row_sum: state.row_sum,
        escaped: state.escaped,
        quality: None,
        form_factor_seconds: seconds,
    })
}

/// Unshot light spread over all surfaces and reflected on and on (section 4.2 of the paper): in W/m², to be
/// multiplied with a patch's reflectance. Where nothing is absorbed, only the first reflection is counted.
fn spread(system: &System, unshot: Rgb64) -> Rgb64 {
    let patches = &system.mesh.patches;
    let area = system.mesh.area();
    let mean: Rgb64 = patches.iter().map(|p| p.albedo * p.area).sum();
    let mean = mean / area;
    let share = |c: usize| match mean[c] < 1.0 {
        true => unshot[c] / area / (1.0 - mean[c]),
        false => unshot[c] / area,
    };
    Rgb64::new(share(0), share(1), share(2))
}

struct State {
    radiosity: Vec<Rgb64>,
    irradiance: Vec<Rgb64>,
    direct: Vec<Rgb64>,
    /// Part of the radiosity that was not sent to others yet.
    unshot: Vec<Rgb64>,
    /// Whether the emission was sent.
    began: Vec<bool>,
    escaped: Rgb64,
    row_sum: f64,
}

impl State {
    fn new(system: &System) -> State {
        State {
            radiosity: system.source.clone(),
            irradiance: system.external.clone(),
            direct: system.external.clone(),
            unshot: system.source.clone(),
            began: vec![false; system.len()],
            escaped: Rgb64::ZERO,
            row_sum: 0.0,
        }
    }

    /// W that patch `i` can send, over the channels.
    fn power(&self, system: &System, i: usize) -> f64 {
        self.unshot[i].element_sum() * system.mesh.patches[i].area
    }

    /// The patch that has most to send, the first of equals; `None` when nothing is left.
    fn brightest(&self, system: &System) -> Option<usize> {
        let mut best = (0.0, None);
        for i in 0..system.len() {
            let power = self.power(system, i);
            if power > best.0 {
                best = (power, Some(i));
            }
        }
        best.1
    }

    /// `shooter`, and those that have most after it and whose rows are not known yet; `count` in all.
    fn next(&self, system: &System, shooter: usize, count: usize, known: &Rows) -> Vec<usize> {
        let wanted = |&i: &usize| i != shooter && !known.has(i) && self.power(system, i) > 0.0;
        let mut others: Vec<(f64, usize)> = (0..system.len())
            .filter(wanted)
            .map(|i| (self.power(system, i), i))
            .collect();
        let by_power = |a: &(f64, usize), b: &(f64, usize)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        let count = count.saturating_sub(1).min(others.len());
        if count > 0 && count < others.len() {
            others.select_nth_unstable_by(count - 1, by_power);
        }
        others.truncate(count);
        // In the order in which they will probably shoot: the last ones are the first to be forgotten.
        others.sort_unstable_by(by_power);
        let first = std::iter::once(shooter);
        first.chain(others.into_iter().map(|(_, i)| i)).collect()
    }

    /// Sends all that patch `i` has to the others. `row` holds F_ij by j; F_ji = F_ij A_i / A_j.
    fn shot(&mut self, system: &System, i: usize, row: &[f64]) {
        let sent = std::mem::take(&mut self.unshot[i]);
        let patches = &system.mesh.patches;
        // Light that was emitted is in the first shot, whole.
        let emitted = match std::mem::replace(&mut self.began[i], true) {
            true => Rgb64::ZERO,
            false => patches[i].emission,
        };
        let area = patches[i].area;
        for (j, (patch, &f)) in patches.iter().zip(row).enumerate() {
            if f > 0.0 {
                let f = f * (area / patch.area);
                let irradiance = sent * f;
                let reflected = patch.albedo * irradiance;
                self.irradiance[j] += irradiance;
                self.direct[j] += emitted * f;
                self.radiosity[j] += reflected;
                self.unshot[j] += reflected;
            }
        }
        let sum: f64 = row.iter().sum();
        self.escaped += sent * (area * (1.0 - sum));
        self.row_sum = self.row_sum.max(sum);
    }
}

/// The rows that were found last.
struct Rows {
    of: Vec<Option<Box<[f64]>>>,
    /// Oldest first.
    order: VecDeque<usize>,
}

impl Rows {
    fn new(n: usize) -> Rows {
        Rows {
            of: vec![None; n],
            order: VecDeque::new(),
        }
    }

    fn has(&self, i: usize) -> bool {
        self.of[i].is_some()
    }

    fn get(&self, i: usize) -> &[f64] {
        self.of[i].as_deref().unwrap_or_default()
    }

    /// Finds those of `patches`, which are not known.
    fn find(&mut self, factors: &dyn Exchange, patches: &[usize]) {
        let n = self.of.len();
        while self.order.len() + patches.len() > KEPT.max(patches.len()) {
            if let Some(old) = self.order.pop_front() {
                self.of[old] = None;
            }
        }
        let found: Vec<Box<[f64]>> = patches
            .par_iter()
            .map(|&i| {
                let mut row = vec![0.0; n].into_boxed_slice();
                factors.row(i as u32, &mut row);
                row
            })
            .collect();
        for (&i, row) in patches.iter().zip(found) {
            self.of[i] = Some(row);
            self.order.push_back(i);
        }
    }
}

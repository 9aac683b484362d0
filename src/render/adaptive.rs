//! Samples where the error is, until the picture is good enough.
//!
//! In rounds: each round looks at what there is, and says how many samples each tile is to have before the next
//! look. Variance times cost is least for a given error if the samples of a tile are in proportion to √(v / c), v the
//! variance of one sample relative to the picture and c its rays (Neyman 1934, with costs).
//!
//! A pixel that stops when it seems good enough stops more often when luck made it dark, and is too dark in the mean.
//! So the replicates are two halves: what one shows decides how many samples the other gets, and the pixel is the mean
//! of both means. The first decision of each half is then independent of its own samples; later ones depend on them
//! only by how many samples the other half had to be judged by, which was measured to make no difference
//! (tests/adaptive.rs). Whether the whole picture is good enough is judged by all samples.
//!
//! Where light is splatted, or photons are shot for each sample, all pixels get the same number.

use super::Target;
use crate::film::{Film, Taken, Tile};

/// Replicates: enough of each half to tell a tile's error, and few enough to leave quasi-random points at their best.
pub const REPLICATES: u32 = 4;
/// Samples per pixel before the first look.
const FIRST: u64 = 64;
/// By which samples of a tile may grow in a round: what little is known may be wrong.
const GROWTH: f64 = 2.0;
/// What is aimed at, as a share of the wanted relMSE: so that the upper end of its interval comes below it.
const AIM: f64 = 0.95;
/// Least growth of all samples in a round: looking takes time too.
const LEAST: f64 = 0.05;
/// Share of a tile's own error in what its samples are decided by; the rest is that of the tiles around.
const OWN: f64 = 0.5;

/// Whether all samples that were planned are taken.
pub fn round_is_done(film: &Film) -> bool {
    match film.range() {
        Some(range) => range.end >= film.goal(),
        None => film.tiles().iter().all(|tile| match tile.taken() {
            Taken::Halves(done) => done == &tile.goal(),
            Taken::Range(_) => true,
        }),
    }
}

pub fn is_good_enough(film: &Film, target: &Target) -> bool {
    film.has_error() && excess(film, target).is_none()
}

/// Plans another round; false where the picture is good enough.
pub fn plan_round(film: &mut Film, target: &Target) -> bool {
    let first = FIRST.div_ceil(u64::from(film.replicates())) * u64::from(film.replicates());
    let is_uniform = film.range().is_some();
    if film.samples() == 0 {
        let goal = if is_uniform { first } else { first / 2 };
        film.tiles_mut()
            .iter_mut()
            .for_each(|tile| tile.set_goal([goal; 2]));
        return true;
    }
    let Some(ratio) = excess(film, target) else {
        return false;
    };
    if is_uniform {
        let range = film.range().unwrap_or(0..0);
        let n = (range.end - range.start) as f64;
        let more = n * (ratio / AIM - 1.0).clamp(LEAST, GROWTH - 1.0);
        let step = u64::from(film.replicates());
        let goal = range.end + (more.ceil() as u64).div_ceil(step) * step;
        film.tiles_mut()
            .iter_mut()
            .for_each(|tile| tile.set_goal([goal; 2]));
    } else {
        let wanted = match target.quantile {
            None => by_variance(film, target),
            Some(quantile) => by_quantile(film, target, quantile),
        };
        set_goals(film, &wanted);
    }
    true
}

/// By what factor the picture's squared error is above the target; `None` where it is not.
fn excess(film: &Film, target: &Target) -> Option<f64> {
    let wanted = target.error * target.error;
    let (judged, estimate) = match target.quantile {
        None => {
            let e = film.estimate_error()?;
            (e.ci95[1], e.relmse)
        }
        Some(quantile) => {
            let mut errors: Vec<f64> = film
                .tiles()
                .iter()
                .flat_map(|t| t.pixel_errors(None))
                .collect();
            let e = of_rank(&mut errors, quantile);
            (e * e, e * e)
        }
    };
    (judged > wanted).then_some((estimate / wanted).max(1.0))
}

/// The value that a share `quantile` of all does not exceed.
fn of_rank(values: &mut [f64], quantile: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let rank = (quantile * values.len() as f64).ceil() as usize;
    let rank = rank.clamp(1, values.len()) - 1;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// Samples that both halves of each tile should have.
fn by_variance(film: &Film, target: &Target) -> Vec<[f64; 2]> {
    // Of one sample, by each half; and its cost.
    let alone: Vec<[f64; 2]> = film.tiles().iter().map(variances).collect();
    let variances = smooth(film, &alone);
    let costs: Vec<f64> = film.tiles().iter().map(cost).collect();
    let pixels = |tile: &Tile| f64::from(tile.width * tile.height);
    let all: f64 = film.tiles().iter().map(pixels).sum();
    // Σ pixels v / n = all τ², n = λ √(v / c).
    let mut lambda = 0.0;
    for ((tile, v), c) in film.tiles().iter().zip(&variances).zip(&costs) {
        lambda += pixels(tile) * (0.5 * (v[0] + v[1]) * c).sqrt();
    }
    lambda /= all * AIM * target.error * target.error;
    let tiles = variances.iter().zip(&costs);
    // What the other half shows.
    tiles
        .map(|(v, c)| [1, 0].map(|other: usize| 0.5 * lambda * (v[other] / c).sqrt()))
        .collect()
}

/// The same for the share of the pixels of each tile that is to be good enough.
fn by_quantile(film: &Film, target: &Target, quantile: f64) -> Vec<[f64; 2]> {
    let of = |tile: &Tile| {
        let n = taken(tile);
        [1, 0].map(|other: usize| {
            // Of the mean of both halves.
            let error = of_rank(&mut tile.pixel_errors(Some(other)), quantile) / 2f64.sqrt();
            n[other] * (error / (AIM * target.error)).powi(2)
        })
    };
    film.tiles().iter().map(of).collect()
}

fn taken(tile: &Tile) -> [f64; 2] {
    match tile.taken() {
        Taken::Halves(done) => done.map(|n| n as f64),
        Taken::Range(range) => [(range.end - range.start) as f64 / 2.0; 2],
    }
}

/// Relative variance of one sample, by each half.
fn variances(tile: &Tile) -> [f64; 2] {
    let n = taken(tile);
    [0, 1].map(|half: usize| {
        let error = tile.error_of_half(half);
        n[half] * error.relative / error.count.max(1.0)
    })
}

/// Rays of one sample of a pixel; at least one.
fn cost(tile: &Tile) -> f64 {
    let samples = tile.taken().count() as f64 * f64::from(tile.width * tile.height);
    (tile.cost() as f64 / samples.max(1.0)).max(1.0)
}

/// Each tile's value partly by those around it: what a rare bright sample shows of one is true of its neighbours.
fn smooth(film: &Film, values: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let across = film.tiles_across().max(1);
    let down = values.len() / across;
    let around = |i: usize| {
        let (x, y) = (i % across, i / across);
        let mut sum = [0.0; 2];
        let mut count = 0.0;
        for y in y.saturating_sub(1)..(y + 2).min(down) {
            for x in x.saturating_sub(1)..(x + 2).min(across) {
                let v = values[y * across + x];
                sum = [sum[0] + v[0], sum[1] + v[1]];
                count += 1.0;
            }
        }
        sum.map(|s| s / count)
    };
    let mixed = |(i, own): (usize, &[f64; 2])| {
        let around = around(i);
        [0, 1].map(|half: usize| OWN * own[half] + (1.0 - OWN) * around[half])
    };
    values.iter().enumerate().map(mixed).collect()
}

/// Goals near `wanted`: none is less than there is, nor much more; together some more.
fn set_goals(film: &mut Film, wanted: &[[f64; 2]]) {
    let step = u64::from(film.replicates() / 2);
    let (mut samples, mut more) = (0.0, 0.0);
    for (tile, wanted) in film.tiles_mut().iter_mut().zip(wanted) {
        let Taken::Halves(done) = *tile.taken() else {
            continue;
        };
        let goal = |half: usize| {
            let most = GROWTH * done[half] as f64;
            let goal = wanted[half].min(most).ceil() as u64;
            // As many of each replicate.
            (goal.div_ceil(step) * step).max(done[half])
        };
        let goal = [goal(0), goal(1)];
        tile.set_goal(goal);
        let pixels = f64::from(tile.width * tile.height);
        samples += pixels * (done[0] + done[1]) as f64;
        more += pixels * (goal[0] + goal[1] - done[0] - done[1]) as f64;
    }
    if more < LEAST * samples {
        // Where the estimates disagree with each other, all go on.
        for tile in film.tiles_mut() {
            let Taken::Halves(done) = *tile.taken() else {
                continue;
            };
            let goal = tile.goal();
            let some = |n: u64| n + ((n as f64 * LEAST) as u64).div_ceil(step).max(1) * step;
            tile.set_goal([0, 1].map(|half: usize| goal[half].max(some(done[half]))));
        }
    }
}

// Each replicate has some samples before the first look.
const _: () = assert!(FIRST >= 2 * REPLICATES as u64);

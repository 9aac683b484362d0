//! Tabulated distributions over cells: piecewise constant in one and two dimensions, and alias tables.
//!
//! Random numbers of an f32 sampler are multiples of 2^-24. The tables therefore round their cumulative
//! sums to that grid, and give every positive cell at least one step of it: the stated probability of a
//! cell is exactly the share of such numbers that choose it, and no positive cell is out of reach.

use crate::math::Vec2;
use crate::math::fp::ONE_MINUS_EPSILON;

/// Steps of the grid that random numbers lie on.
const STEPS: f64 = 16_777_216.0;
/// More positive cells than this would make the smallest step a visible share of the whole.
const MAX_CELLS: usize = 1 << 22;

/// A chosen cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    pub index: usize,
    /// Probability of this choice, > 0.
    pub prob: f32,
    /// What the choice left of the random number: uniform in [0,1) again, with fewer bits.
    pub u: f32,
}

/// Appends to `cdf` the upper ends of the cells and returns the sum of the weights; `None` when a weight
/// is negative or not finite, or there are more than 2^22. All-zero weights give an all-zero table.
fn push_cdf(weights: impl Iterator<Item = f32> + Clone, cdf: &mut Vec<f32>) -> Option<f64> {
    let (mut sum, mut positive) = (0.0f64, 0usize);
    for w in weights.clone() {
        if !(w >= 0.0 && w.is_finite()) {
            return None;
        }
        sum += f64::from(w);
        positive += usize::from(w > 0.0);
    }
    if positive > MAX_CELLS {
        return None;
    }
    // One step for each positive cell, the others in proportion to the weights. Rounding is monotone and
    // the last prefix is the sum itself, so the table ends on exactly 1.
    let free = STEPS - positive as f64;
    let (mut prefix, mut given) = (0.0f64, 0.0f64);
    for w in weights {
        prefix += f64::from(w);
        given += f64::from(u8::from(w > 0.0));
        let share = if sum > 0.0 { prefix / sum } else { 0.0 };
        cdf.push(((given + (free * share).round()) / STEPS) as f32);
    }
    Some(sum)
}

/// The cell of a table of upper ends that `u` falls in. Cells of no width are never returned as long as
/// the table ends on 1.
#[inline]
fn find(cdf: &[f32], u: f32) -> Pick {
    let u = u.clamp(0.0, ONE_MINUS_EPSILON);
    let index = cdf
        .partition_point(|&end| end <= u)
        .min(cdf.len().saturating_sub(1));
    let (lo, prob) = cell(cdf, index);
    // The number stands for the step that it begins: its middle keeps the mean of the rest at 1/2.
    let rest = (u - lo + 0.25 * f32::EPSILON) / prob;
    Pick {
        index,
        prob,
        u: rest.min(ONE_MINUS_EPSILON),
    }
}

/// Lower end and width of a cell.
#[inline]
fn cell(cdf: &[f32], index: usize) -> (f32, f32) {
    let lo = if index == 0 { 0.0 } else { cdf[index - 1] };
    (lo, cdf[index] - lo)
}

/// The point at `rest` in cell `index` of `n` equal cells of [0,1), kept inside that cell.
#[inline]
fn place(index: usize, rest: f32, n: usize) -> f32 {
    let n = n as f32;
    let x = ((index as f32 + rest) / n).min(ONE_MINUS_EPSILON);
    match (x * n) as usize {
        found if found > index => x.next_down(),
        found if found < index => x.next_up(),
        _ => x,
    }
}

#[inline]
fn cell_of(x: f32, n: usize) -> usize {
    ((x * n as f32) as usize).min(n - 1)
}

/// A piecewise constant density over [0,1), given by weights of cells of equal width.
#[derive(Clone, Debug)]
pub struct Tabulated1 {
    cdf: Vec<f32>,
}

impl Tabulated1 {
    /// `None` when the weights are empty, all zero, negative, not finite, or more than 2^22.
    pub fn new(weights: &[f32]) -> Option<Tabulated1> {
        let mut cdf = Vec::with_capacity(weights.len());
        let sum = push_cdf(weights.iter().copied(), &mut cdf)?;
        (sum > 0.0).then_some(Tabulated1 { cdf })
    }

    /// Chooses a cell by `u` in [0,1).
    #[inline]
    pub fn pick(&self, u: f32) -> Pick {
        find(&self.cdf, u)
    }

    /// Probability of cell `index`; 0 for one that is not there.
    #[inline]
    pub fn prob(&self, index: usize) -> f32 {
        if index < self.cdf.len() {
            cell(&self.cdf, index).1
        } else {
            0.0
        }
    }

    /// A point of [0,1) and its density, > 0.
    #[inline]
    pub fn sample(&self, u: f32) -> (f32, f32) {
        let pick = self.pick(u);
        let n = self.cdf.len();
        (place(pick.index, pick.u, n), pick.prob * n as f32)
    }

    /// Density of [`Tabulated1::sample`] at `x`; 0 outside [0,1).
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        if !(0.0..1.0).contains(&x) {
            return 0.0;
        }
        let n = self.cdf.len();
        self.prob(cell_of(x, n)) * n as f32
    }
}

/// A piecewise constant density over the unit square, given by the weights of `width * height` cells in
/// rows: first the row, then the cell in it. Takes 4 bytes per cell.
#[derive(Clone, Debug)]
pub struct Tabulated2 {
    rows: Tabulated1,
    cells: Vec<f32>,
    width: usize,
}

impl Tabulated2 {
    /// `None` when the sizes do not fit the weights, or in the cases of [`Tabulated1::new`].
    pub fn new(weights: &[f32], width: usize, height: usize) -> Option<Tabulated2> {
        if width == 0 || width.checked_mul(height) != Some(weights.len()) {
            return None;
        }
        let mut cells = Vec::with_capacity(weights.len());
        let mut sums = Vec::with_capacity(height);
        for row in weights.chunks_exact(width) {
            sums.push(push_cdf(row.iter().copied(), &mut cells)?);
        }
        // As f32 the sums could overflow, or vanish; relative to the largest they cannot.
        let top = sums.iter().copied().fold(0.0, f64::max);
        let relative =
            |&s: &f64| ((s / top) as f32).max(if s > 0.0 { f32::MIN_POSITIVE } else { 0.0 });
        let sums: Vec<f32> = if top > 0.0 {
            sums.iter().map(relative).collect()
        } else {
            return None;
        };
        Some(Tabulated2 {
            rows: Tabulated1::new(&sums)?,
            cells,
            width,
        })
    }

    /// A point of [0,1)² (x along a row) and its density, > 0.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let row = self.rows.pick(u.y);
        let cell = find(self.row(row.index), u.x);
        let height = self.rows.cdf.len();
        let p = Vec2::new(
            place(cell.index, cell.u, self.width),
            place(row.index, row.u, height),
        );
        (p, self.density(row.prob, cell.prob))
    }

    /// Density of [`Tabulated2::sample`] at `p`; 0 outside [0,1)².
    #[inline]
    pub fn pdf(&self, p: Vec2) -> f32 {
        if !((0.0..1.0).contains(&p.x) && (0.0..1.0).contains(&p.y)) {
            return 0.0;
        }
        let row = cell_of(p.y, self.rows.cdf.len());
        let (_, prob) = cell(self.row(row), cell_of(p.x, self.width));
        self.density(self.rows.prob(row), prob)
    }

    #[inline]
    fn row(&self, row: usize) -> &[f32] {
        &self.cells[row * self.width..][..self.width]
    }

    #[inline]
    fn density(&self, row: f32, cell: f32) -> f32 {
        row * self.rows.cdf.len() as f32 * (cell * self.width as f32)
    }
}

/// A choice among cells in constant time (Walker 1977; tables as Vose 1991 builds them).
///
/// One number chooses the bin and decides inside it. With 24 bits of it the share of a cell is off by up
/// to `n` 2^-24 of the mean share: for more than about 10,000 cells take [`Tabulated1`], which is exact.
#[derive(Clone, Debug)]
pub struct AliasTable {
    bins: Vec<Bin>,
}

#[derive(Clone, Copy, Debug)]
struct Bin {
    /// Below this the bin keeps its own cell.
    keep: f32,
    alias: u32,
    prob: f32,
    alias_prob: f32,
}

impl AliasTable {
    /// `None` when the weights are empty, all zero, negative, not finite, or more than 2^22.
    pub fn new(weights: &[f32]) -> Option<AliasTable> {
        let n = weights.len();
        if n > MAX_CELLS || weights.iter().any(|w| !(*w >= 0.0 && w.is_finite())) {
            return None;
        }
        let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        if sum <= 0.0 {
            return None;
        }
        let probs: Vec<f64> = weights.iter().map(|&w| f64::from(w) / sum).collect();
        let mut left: Vec<f64> = probs.iter().map(|p| p * n as f64).collect();
        let mut bins: Vec<Bin> = (0..n)
            .map(|i| Bin {
                keep: 1.0,
                alias: i as u32,
                prob: probs[i] as f32,
                alias_prob: probs[i] as f32,
            })
            .collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| left[i] < 1.0);
        while let (Some(&l), Some(s)) = (large.last(), small.pop()) {
            bins[s].keep = left[s] as f32;
            bins[s].alias = l as u32;
            bins[s].alias_prob = probs[l] as f32;
            left[l] -= 1.0 - left[s];
            if left[l] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // What rounding leaves over is full to rounding, but a cell of no weight must stay out of reach.
        let heaviest = (0..n).max_by(|&a, &b| probs[a].total_cmp(&probs[b]))?;
        for i in small {
            if probs[i] == 0.0 {
                bins[i].keep = 0.0;
                bins[i].alias = heaviest as u32;
                bins[i].alias_prob = probs[heaviest] as f32;
            }
        }
        Some(AliasTable { bins })
    }

    /// Chooses a cell by `u` in [0,1).
    #[inline]
    pub fn pick(&self, u: f32) -> Pick {
        let n = self.bins.len();
        let scaled = u.clamp(0.0, ONE_MINUS_EPSILON) * n as f32;
        let i = (scaled as usize).min(n - 1);
        let bin = &self.bins[i];
        let rest = (scaled - i as f32).min(ONE_MINUS_EPSILON);
        let (index, prob, u) = if rest < bin.keep {
            (i, bin.prob, rest / bin.keep)
        } else {
            let u = (rest - bin.keep) / (1.0 - bin.keep);
            (bin.alias as usize, bin.alias_prob, u)
        };
        Pick {
            index,
            prob,
            u: u.min(ONE_MINUS_EPSILON),
        }
    }

    /// Probability of cell `index`; 0 for one that is not there.
    #[inline]
    pub fn prob(&self, index: usize) -> f32 {
        self.bins.get(index).map_or(0.0, |bin| bin.prob)
    }
}

//! How good a matrix of form factors is, by what must hold of any.

use super::{FormFactors, Loss, Matrix};
use std::fmt;

/// Identities of form factors, and how far they are off.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Quality {
    pub patches: usize,
    /// Σ_j F_ij: 1 in a closed scene, less where light can leave; mean by area.
    pub row_sum_min: f64,
    pub row_sum_mean: f64,
    pub row_sum_max: f64,
    /// Share of the area on patches whose row sum differs from 1 by more than `row_tolerance`.
    pub rows_off: f64,
    pub row_tolerance: f64,
    /// |A_i F_ij - A_j F_ji| over the mean of both: the largest, among pairs that exchange at least a thousandth of
    /// what the smaller patch gives off, and the root of its mean square over all pairs, weighted by what they
    /// exchange.
    pub reciprocity_max: f64,
    pub reciprocity_rms: f64,
    /// The largest |F_ii|: 0, since patches are flat.
    pub self_max: f64,
    /// Hemicubes: pairs of patches that face each other, one of which covers no pixel of the other one's hemicubes.
    pub lost_pairs: u64,
    /// Which share of all light these would have exchanged, with nothing between them (an estimate).
    pub lost_share: f64,
    /// Patches that cover no pixel of any hemicube, and their share of the area. What they give off reaches nothing.
    pub lost_patches: usize,
    pub lost_area: f64,
}

impl Quality {
    /// Judges a matrix. `losses` by row, empty where the method loses nothing.
    pub fn new(
        factors: &FormFactors,
        matrix: &Matrix,
        losses: &[Loss],
        row_tolerance: f64,
    ) -> Quality {
        let areas: Vec<f64> = factors.faces.iter().map(|face| face.area).collect();
        let all: f64 = areas.iter().sum();
        let mut quality = Quality {
            patches: matrix.n,
            row_sum_min: f64::INFINITY,
            row_sum_max: f64::NEG_INFINITY,
            row_tolerance,
            ..Quality::default()
        };
        if matrix.n == 0 || all <= 0.0 {
            return Quality {
                row_sum_min: 0.0,
                row_sum_max: 0.0,
                ..quality
            };
        }
        for (i, area) in areas.iter().enumerate() {
            let sum: f64 = matrix.row(i).iter().sum();
            quality.row_sum_min = quality.row_sum_min.min(sum);
            quality.row_sum_max = quality.row_sum_max.max(sum);
            quality.row_sum_mean += sum * area / all;
            if (sum - 1.0).abs() > row_tolerance {
                quality.rows_off += area / all;
            }
            quality.self_max = quality.self_max.max(matrix.row(i)[i].abs());
        }
        quality.reciprocity(matrix, &areas);
        quality.losses(losses, &areas, all);
        quality
    }

    fn reciprocity(&mut self, matrix: &Matrix, areas: &[f64]) {
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in 0..matrix.n {
            for j in 0..i {
                let (there, back) = (areas[i] * matrix.row(i)[j], areas[j] * matrix.row(j)[i]);
                let mean = 0.5 * (there + back);
                if mean <= 0.0 {
                    continue;
                }
                let off = (there - back).abs() / mean;
                sum += mean * off * off;
                weights += mean;
                if mean >= 1e-3 * areas[i].min(areas[j]) {
                    self.reciprocity_max = self.reciprocity_max.max(off);
                }
            }
        }
        if weights > 0.0 {
            self.reciprocity_rms = (sum / weights).sqrt();
        }
    }

    fn losses(&mut self, losses: &[Loss], areas: &[f64], all: f64) {
        if losses.is_empty() {
            return;
        }
        let mut met = vec![false; areas.len()];
        let mut faced = vec![false; areas.len()];
        for (loss, area) in losses.iter().zip(areas) {
            self.lost_pairs += loss.lost.len() as u64;
            self.lost_share += loss.share * area / all;
            loss.met.iter().for_each(|&j| met[j as usize] = true);
            loss.lost.iter().for_each(|&j| faced[j as usize] = true);
        }
        for ((met, faced), area) in met.iter().zip(&faced).zip(areas) {
            if *faced && !*met {
                self.lost_patches += 1;
                self.lost_area += area / all;
            }
        }
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "row sums {:.6} to {:.6}, mean {:.6}; off 1 by more than {}: {:.2} % of the area",
            self.row_sum_min,
            self.row_sum_max,
            self.row_sum_mean,
            self.row_tolerance,
            100.0 * self.rows_off
        )?;
        write!(
            f,
            "reciprocity off by {:.2e} (rms), {:.2e} (most); largest F_ii {:.1e}",
            self.reciprocity_rms, self.reciprocity_max, self.self_max
        )?;
        if self.lost_pairs > 0 {
            write!(
                f,
                "\n{} pairs fell between the pixels of hemicubes, with about {:.2e} of the light; {} of {} patches \
                 cover no pixel at all, {:.2e} of the area: raise the resolution",
                self.lost_pairs, self.lost_share, self.lost_patches, self.patches, self.lost_area
            )?;
        }
        Ok(())
    }
}

//! Sampled directions against their density where that has edges or poles, which rules out integrating it.
#![allow(dead_code)] // each test binary uses a part

use crate::common::{Rng, chi2_p_value};
use luxel::bsdf::Density;
use luxel::light::EmitterSample;
use luxel::math::{DVec3, Frame, Vec3};
use std::f64::consts::TAU;

/// Density per steradian of a sample of a surface.
pub fn per_sr(s: &EmitterSample) -> f32 {
    match s.density {
        Density::PerSr(pdf) => pdf,
        Density::Delta => panic!("a surface with a delta density"),
    }
}

/// Cells of equal solid angle around `axis`, out to an angle of squared sine `sin2` (1 or more: all).
pub struct DirectionCheck<'a> {
    pub name: &'a str,
    /// Probability that a correct sampler fails.
    pub alpha: f64,
    pub axis: Vec3,
    pub sin2: f64,
}

const HEIGHTS: usize = 12;
const TURNS: usize = 24;
const CELLS: usize = HEIGHTS * TURNS;
const FINE: usize = 32;
const SAMPLES: usize = 300_000;

impl DirectionCheck<'_> {
    /// The mean of 1/pdf over the samples in a cell estimates the solid angle that is lit there, which
    /// `lit` measures. Sees samples in wrong places and errors of one per cent of the density: the lit
    /// share of all cells together is compared within 0.5 %.
    pub fn run(
        &self,
        mut sample: impl FnMut(&mut Rng) -> Option<(Vec3, f32)>,
        lit: impl Fn(Vec3) -> bool,
    ) {
        let frame = Frame::from_normal(self.axis);
        let top = match self.sin2 {
            s if s < 1.0 => 1.0001 * s / (1.0 + (1.0 - s).sqrt()),
            _ => 2.0,
        };
        let mut rng = Rng::new(1);
        let (mut sum, mut sum2) = ([0f64; CELLS], [0f64; CELLS]);
        let mut count = [0u32; CELLS];
        for _ in 0..SAMPLES {
            if let Some((d, pdf)) = sample(&mut rng) {
                let c = self.cell(&frame, top, d);
                let w = 1.0 / pdf as f64;
                sum[c] += w;
                sum2[c] += w * w;
                count[c] += 1;
            }
        }
        let n = SAMPLES as f64;
        let fine_cell = top * TAU / (CELLS * FINE * FINE) as f64;
        let (mut chi2, mut dof) = (0.0, 0.0);
        let (mut total, mut expected) = (0.0, 0.0);
        for c in 0..CELLS {
            let hits = (0..FINE * FINE)
                .filter(|k| {
                    let (x, y) = (rng.f32() as f64, rng.f32() as f64);
                    let h = ((c / TURNS) as f64 + ((k / FINE) as f64 + x) / FINE as f64)
                        / HEIGHTS as f64;
                    let t =
                        ((c % TURNS) as f64 + ((k % FINE) as f64 + y) / FINE as f64) / TURNS as f64;
                    let (h, phi) = (h * top, t * TAU);
                    let r = (h * (2.0 - h)).max(0.0).sqrt();
                    let l = DVec3::new(r * phi.cos(), r * phi.sin(), 1.0 - h).as_vec3();
                    lit(frame.to_world(l))
                })
                .count();
            let solid_angle = hits as f64 * fine_cell;
            total += sum[c] / n;
            expected += solid_angle;
            // An outline through the cell crosses some 2 FINE fine cells, each right or wrong by chance.
            let partly = hits > 0 && hits < FINE * FINE;
            let outline = if partly {
                0.3 * FINE as f64 * fine_cell * fine_cell
            } else {
                0.0
            };
            let mean = sum[c] / n;
            let variance = (sum2[c] / n - mean * mean) / n + outline;
            if count[c] > 100 && variance > 0.0 {
                chi2 += (mean - solid_angle).powi(2) / variance;
                dof += 1.0;
            } else if hits > FINE * FINE / 4 {
                let few = mean - solid_angle;
                assert!(
                    few.abs() < 0.02 * expected.max(solid_angle),
                    "{}: a lit place without samples",
                    self.name
                );
            }
        }
        let gap = total / expected - 1.0;
        assert!(
            gap.abs() < 5e-3,
            "{}: lit solid angle off by {gap}",
            self.name
        );
        let p = chi2_p_value(chi2, dof);
        let name = self.name;
        assert!(p > self.alpha, "{name}: chi2 {chi2} of {dof}, p = {p:.1e}");
    }

    fn cell(&self, frame: &Frame, top: f64, d: Vec3) -> usize {
        let l = frame.to_local(d);
        let r2 = (l.x * l.x + l.y * l.y) as f64;
        let z = l.z as f64;
        let h = if z > 0.0 { r2 / (1.0 + z) } else { 1.0 - z } / top;
        assert!(
            h < 1.0 + 1e-6,
            "{}: a direction past the light, {h}",
            self.name
        );
        let turn = (l.y.atan2(l.x) as f64 / TAU).rem_euclid(1.0);
        let row = ((h * HEIGHTS as f64) as usize).min(HEIGHTS - 1);
        row * TURNS + ((turn * TURNS as f64) as usize).min(TURNS - 1)
    }
}

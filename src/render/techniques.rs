//! What each technique of an integrator brought, and what it cost.

use super::{Job, Stats};
use crate::film::Film;
use crate::transport::Technique;

/// The share of one technique.
#[derive(Clone, Debug, PartialEq)]
pub struct TechniqueStats {
    pub name: &'static str,
    /// Of the picture's luminance; 0 for a black picture.
    pub energy_share: f64,
    /// Variance of the luminance that it adds to a pixel in one sample, weighted against the others, mean over
    /// the pixels. Samples count as independent. `None` with fewer than two samples per pixel.
    pub variance: Option<f64>,
    /// Rays that it alone needed: shadow rays of connections, walks of photons. Walks that several techniques
    /// share belong to none of them.
    pub rays: u64,
}

impl Job {
    /// Statistics of each technique, for an integrator of several; empty for others.
    pub fn technique_stats(&self, film: &Film, stats: &Stats) -> Vec<TechniqueStats> {
        let techniques = match film.parts() {
            0 => &[],
            _ => self.integrator.techniques(&self.scene),
        };
        let moments: Vec<_> = (0..techniques.len())
            .map(|i| film.part_moments(i))
            .collect();
        let total: f64 = moments.iter().map(|m| m.mean).sum();
        let describe = |(technique, moments): (&Technique, &crate::film::PartMoments)| {
            let connections = stats.connections[*technique as usize];
            TechniqueStats {
                name: technique.name(),
                energy_share: match total > 0.0 {
                    true => moments.mean / total,
                    false => 0.0,
                },
                variance: moments.variance,
                rays: match technique {
                    Technique::Merging => stats.shot,
                    _ => connections,
                },
            }
        };
        techniques.iter().zip(&moments).map(describe).collect()
    }
}

//! Lights at infinity, and the choice between each of them and all lights at finite distance.

use super::Emitter;
use crate::math::PI;
use crate::math::warp::Tabulated1;

/// Share of the choice that goes to all alike: power is blind to shadows and to what is near.
const UNIFORM_SHARE: f64 = 0.5;

/// The emitters at infinity, and how often each is chosen.
#[derive(Clone, Debug, Default)]
pub(super) struct Far {
    /// Numbers of the emitters.
    pub emitters: Vec<u32>,
    /// Of all lights at finite distance together, then of each emitter here; `None` for a single one.
    table: Option<Tabulated1>,
}

impl Far {
    /// `near` is the power of the lights at finite distance, if there are any; `radius` that of the scene.
    pub fn new(all: &[Emitter], emitters: Vec<u32>, near: Option<f64>, radius: f64) -> Far {
        if emitters.is_empty() || (emitters.len() == 1 && near.is_none()) {
            return Far {
                emitters,
                table: None,
            };
        }
        // What crosses the disk that covers the scene.
        let disk = std::f64::consts::PI * radius * radius;
        let far = emitters.iter().map(|&e| match &all[e as usize] {
            Emitter::Constant { radiance } => f64::from(4.0 * PI * radiance.luminance()) * disk,
            Emitter::Directional { irradiance, .. } => f64::from(irradiance.luminance()) * disk,
            Emitter::Image(map) => map.integral() * disk,
            _ => 0.0,
        });
        let powers: Vec<f64> = [near.unwrap_or(0.0)].into_iter().chain(far).collect();
        let total: f64 = powers.iter().sum();
        let count = emitters.len() + usize::from(near.is_some());
        let weights: Vec<f32> = powers
            .iter()
            .enumerate()
            .map(|(i, power)| {
                let equal = match i == 0 && near.is_none() {
                    true => 0.0,
                    false => 1.0 / count as f64,
                };
                // A scene without extent says nothing about powers.
                let share = match total > 0.0 && total.is_finite() {
                    true => power / total,
                    false => equal,
                };
                (UNIFORM_SHARE * equal + (1.0 - UNIFORM_SHARE) * share) as f32
            })
            .collect();
        let table = Tabulated1::new(&weights);
        Far { emitters, table }
    }

    /// Probability of all lights at finite distance together.
    #[inline]
    pub fn near_share(&self) -> f32 {
        match &self.table {
            Some(table) => table.prob(0),
            None if self.emitters.is_empty() => 1.0,
            None => 0.0,
        }
    }

    /// Probability of the emitter at `index` in [`Far::emitters`].
    #[inline]
    pub fn share(&self, index: usize) -> f32 {
        self.table
            .as_ref()
            .map_or(1.0, |table| table.prob(index + 1))
    }

    /// The index of an emitter here, `None` for the lights at finite distance; the probability, and what is
    /// left of `u`.
    #[inline]
    pub fn pick(&self, u: f32) -> (Option<usize>, f32, f32) {
        match &self.table {
            Some(table) => {
                let pick = table.pick(u);
                (pick.index.checked_sub(1), pick.prob, pick.u)
            }
            None if self.emitters.is_empty() => (None, 1.0, u),
            None => (Some(0), 1.0, u),
        }
    }
}

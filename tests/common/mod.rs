//! Statistical tests of sampling code.
//!
//! A sampler and its density are compared in three ways: chi-square over cells of nearly equal
//! probability, t-tests of the means of the coordinates, and the integral of the density against the
//! share of samples that carry something. The first finds samples in wrong places, the others see errors
//! of one per cent of shape or scale. Seeds are fixed and were not chosen.
#![allow(dead_code, unused_imports)] // each test binary uses a part

pub mod local;
pub mod plan;
pub mod quadrature;
pub mod stats;

pub use local::{direction, mirror, seen_from};
pub use plan::{Chi2Plan, Domain};
pub use stats::{Running, chi2_p_value, mean_and_error, sidak};

use luxel::bsdf::{Bsdf, Mode};
use luxel::math::{Vec2, Vec3};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng as _;

/// Independent numbers (PCG XSH RR 64/32): the tests assume independence, so no Sobol points.
pub struct Rng(Pcg32);

impl Rng {
    pub fn new(seed: u64) -> Rng {
        // The stream as well as the state: neighbouring seeds must not run in parallel.
        Rng(Pcg32::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15), seed))
    }

    /// A multiple of 2^-24 in [0,1).
    pub fn f32(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    pub fn vec2(&mut self) -> Vec2 {
        Vec2::new(self.f32(), self.f32())
    }
}

/// Mean weight of `n` samples and its standard error: the share of light from `wo` that is scattered on.
pub fn furnace(bsdf: Bsdf, wo: Vec3, mode: Mode, seed: u64, n: u32) -> (f64, f64) {
    let mut rng = Rng::new(seed);
    mean_and_error(n, || {
        let sample = bsdf.sample(wo, rng.f32(), rng.vec2(), mode);
        f64::from(sample.map_or(0.0, |s| s.weight.g))
    })
}

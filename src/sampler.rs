//! Where random numbers come from. A number is a pure function of its address (seed, pixel, sample,
//! dimension): no generator lives in a thread, so an image depends neither on the number of threads nor
//! on the order of tiles.
//!
//! The samples of a pixel are dealt out to R independently scrambled *replicates*: sample `s` is point
//! `s / R` of replicate `s % R`. The spread of the replicates' means is an honest standard error even for
//! quasi-random points, whose own spread says nothing about their error (Owen 1998, section 1).

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// Dimensions, in blocks of four numbers. Every decision owns its block, so switching a feature on does
/// not shift the numbers of another.
pub mod dim {
    /// Position within the pixel's reconstruction filter (2 numbers), lens position (2).
    pub const CAMERA: u32 = 0;
    /// Time within the shutter (1 number), drawn only when something moves.
    pub const TIME: u32 = 1;
    /// The start of a walk from a light: choice of the light and of the target (2 numbers), and point on the
    /// lens that it is connected to (2); place and direction (2 each) in the block after it.
    pub const EMISSION: u32 = 2;
    /// First block of the path's vertices; each owns [`PER_VERTEX`] blocks.
    pub const VERTEX: u32 = 8;
    pub const PER_VERTEX: u32 = 8;
    /// Offsets within a vertex. Direction (2), point on the light (2): together in one block, whose first
    /// two and last two numbers are each well spread.
    pub const DIRECTIONS: u32 = 0;
    /// Choice of the light (1), of the lobe (1), Russian roulette (1), of the material (1).
    pub const CHOICES: u32 = 1;
    /// Choice of the patch that the walk is sent to, in two parts (2).
    pub const PATCH: u32 = 2;
}

/// How the points of a pixel are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// Independent uniform numbers.
    Independent,
    /// Owen-scrambled Sobol points (Burley 2020), padded: every block of four dimensions is its own
    /// scrambling of the first four Sobol dimensions.
    Sobol,
}

impl SamplerKind {
    pub fn name(self) -> &'static str {
        match self {
            SamplerKind::Independent => "independent",
            SamplerKind::Sobol => "sobol",
        }
    }
}

/// The numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    kind: SamplerKind,
    /// Hash of seed, pixel and replicate.
    stream: u64,
    /// Index of the point within its replicate.
    index: u64,
}

/// Points that one scrambling of `sobol_burley` has; from there on it repeats, so further points come
/// from a new scrambling.
const SOBOL_POINTS: u64 = 1 << 16;

impl Sampler {
    /// `pixel` is any number that is unique to the pixel, `sample` counts all samples of the pixel and
    /// `replicates` is R of the module's description, a power of two.
    #[inline]
    pub fn new(kind: SamplerKind, seed: u64, pixel: u64, sample: u64, replicates: u32) -> Sampler {
        debug_assert!(replicates.is_power_of_two());
        let replicate = sample & u64::from(replicates - 1);
        let stream =
            mix(mix(seed ^ 0x6c75_7865_6c00_0001).wrapping_add(pixel)).wrapping_add(replicate);
        Sampler {
            kind,
            stream: mix(stream),
            index: sample >> replicates.trailing_zeros(),
        }
    }

    /// The same address with independent numbers, which cost a quarter of Sobol points to draw.
    #[inline]
    pub fn independent(self) -> Sampler {
        Sampler {
            kind: SamplerKind::Independent,
            ..self
        }
    }

    /// The numbers of the walk that starts at a light, for the same sample.
    #[inline]
    pub fn of_light(self) -> Sampler {
        Sampler {
            stream: mix(self.stream ^ 0x6c69_6768_7400_0001),
            ..self
        }
    }

    /// Independent numbers for what is tried beside the sample, which does not change it.
    #[inline]
    pub fn of_comparison(self) -> Sampler {
        Sampler {
            kind: SamplerKind::Independent,
            stream: mix(self.stream ^ 0x636f_6d70_6172_6501),
            ..self
        }
    }

    /// Numbers for walks that are tried before the picture, which they do not change.
    #[inline]
    pub fn of_pilot(self) -> Sampler {
        Sampler {
            stream: mix(self.stream ^ 0x7069_6c6f_7400_0001),
            ..self
        }
    }

    /// The numbers of part `i` of `n` that the sample is split into from some vertex on: all parts of all
    /// samples are spread together.
    #[inline]
    pub fn of_part(self, i: u32, n: u32) -> Sampler {
        Sampler {
            stream: mix(self.stream ^ 0x7061_7274_7300_0001),
            index: self.index * u64::from(n) + u64::from(i),
            ..self
        }
    }

    /// Four numbers in [0,1) for the block `dim` (see [`dim`]).
    #[inline]
    pub fn get4(&self, dim: u32) -> [f32; 4] {
        let address = self.stream ^ (u64::from(dim) << 32);
        match self.kind {
            SamplerKind::Sobol => {
                let scrambling = mix(address.wrapping_add(self.index / SOBOL_POINTS)) as u32;
                sobol_burley::sample_4d((self.index % SOBOL_POINTS) as u32, 0, scrambling)
            }
            SamplerKind::Independent => {
                let state = mix(address.wrapping_add(self.index));
                let mut rng =
                    Pcg64Mcg::new((u128::from(state) << 64) | u128::from(mix(state ^ address)));
                let (a, b) = (rng.next_u64(), rng.next_u64());
                [
                    unit(a as u32),
                    unit((a >> 32) as u32),
                    unit(b as u32),
                    unit((b >> 32) as u32),
                ]
            }
        }
    }
}

/// A float in [0,1) from 24 random bits.
#[inline]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014): a bijection that flips half of the bits.
#[inline]
pub fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(kind: SamplerKind, n: u64, replicates: u32, f: impl Fn([f32; 4]) -> f64) -> f64 {
        (0..n)
            .map(|s| f(Sampler::new(kind, 1, 7, s, replicates).get4(dim::VERTEX)))
            .sum::<f64>()
            / n as f64
    }

    /// Variance over pixels of the mean of `n` samples of a smooth integrand.
    fn variance(kind: SamplerKind, n: u64, replicates: u32) -> f64 {
        let pixels = 400;
        let mean_of = |pixel: u64| {
            let f = |[x, y, ..]: [f32; 4]| (f64::from(x) * 3.0).sin() * (1.0 + f64::from(y));
            (0..n)
                .map(|s| f(Sampler::new(kind, 3, pixel, s, replicates).get4(dim::VERTEX)))
                .sum::<f64>()
                / n as f64
        };
        let means: Vec<f64> = (0..pixels).map(mean_of).collect();
        let centre = means.iter().sum::<f64>() / pixels as f64;
        means.iter().map(|m| (m - centre).powi(2)).sum::<f64>() / (pixels - 1) as f64
    }

    #[test]
    fn numbers_are_uniform_and_blocks_are_uncorrelated() {
        for kind in [SamplerKind::Independent, SamplerKind::Sobol] {
            let n = 1 << 16;
            // Standard error of a mean of n independent uniforms is 0.29/sqrt(n) = 1.1e-3; five of them.
            assert!((mean(kind, n, 16, |u| f64::from(u[3])) - 0.5).abs() < 6e-3);
            let product = |s| {
                let sampler = Sampler::new(kind, 1, 7, s, 16);
                let (a, b) = (sampler.get4(dim::VERTEX), sampler.get4(dim::VERTEX + 1));
                f64::from(a[0] - 0.5) * f64::from(b[0] - 0.5)
            };
            let covariance = (0..n).map(product).sum::<f64>() / n as f64;
            // 1/12 / sqrt(n) = 3.3e-4; five of them.
            assert!(covariance.abs() < 1.7e-3, "{kind:?} {covariance}");
        }
    }

    #[test]
    fn sobol_beats_independent_and_replicates_cost_little_of_it() {
        let independent = variance(SamplerKind::Independent, 64, 1);
        let sobol = variance(SamplerKind::Sobol, 64, 1);
        let replicated = variance(SamplerKind::Sobol, 64, 4);
        // Measured: 1/700 and 1/17.
        assert!(sobol < 0.01 * independent, "{sobol} {independent}");
        assert!(replicated < 0.1 * independent, "{replicated} {independent}");
    }

    #[test]
    fn points_do_not_repeat_beyond_the_table() {
        let at = |s| Sampler::new(SamplerKind::Sobol, 1, 1, s, 1).get4(3);
        assert!((0..100).all(|s| at(s) != at(s + SOBOL_POINTS)));
    }
}

//! What few samples say of the noise of an estimator: before each replicate has some.

use super::{Film, Sum, Tile};

/// What is known of a tile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Glance {
    /// Mean over its pixels and their channels.
    pub mean: f64,
    /// Variance of that mean.
    pub variance: f64,
    pub pixels: Vec<PixelGlance>,
}

/// What is known of a pixel: means over its channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelGlance {
    pub mean: f32,
    /// Variance of one sample.
    pub of_sample: f32,
}

/// Replicates that must have samples.
pub const FEWEST: u32 = 2;

impl Film {
    /// What there is to see of each tile; `None` where too few replicates have samples.
    pub fn glance(&self) -> Option<Vec<Glance>> {
        let seen: Option<Vec<(Glance, f64)>> = self.tiles.iter().map(Tile::glance).collect();
        let seen = seen?;
        // The spread of a tile's own mean is known by few replicates, that of its pixels by many pixels: but these err
        // alike where they share photons. How much alike is told by all tiles together.
        let alone: f64 = seen.iter().map(|(glance, _)| glance.variance).sum();
        let together: f64 = seen.iter().map(|(_, variance)| variance).sum();
        let alike = match alone > 0.0 {
            true => (together / alone).max(1.0),
            false => 1.0,
        };
        let glance = |(by_pixels, _): (Glance, f64)| Glance {
            variance: by_pixels.variance * alike,
            ..by_pixels
        };
        Some(seen.into_iter().map(glance).collect())
    }
}

impl Tile {
    /// With the variance of the mean by that of its pixels, as if they were independent; and the same by the mean itself.
    fn glance(&self) -> Option<(Glance, f64)> {
        let all = self.replicates as usize;
        let n_of = |r: usize| self.taken.of_replicate(r, all) as f64;
        let filled: Vec<usize> = (0..all).filter(|r| n_of(*r) > 0.0).collect();
        if filled.len() < FEWEST as usize {
            return None;
        }
        let n: f64 = filled.iter().map(|r| n_of(*r)).sum();
        // A replicate of n_r samples has the variance σ²/n_r: Σ n_r (m_r - m)² / (R - 1) estimates σ².
        let sigma2 = |sum: &dyn Fn(usize) -> f64| {
            let mean = filled.iter().map(|r| sum(*r)).sum::<f64>() / n;
            let square = |r: &usize| (sum(*r) / n_of(*r) - mean).powi(2) * n_of(*r);
            let squares: f64 = filled.iter().map(square).sum();
            [mean, squares / (filled.len() as f64 - 1.0)]
        };
        let count = f64::from(self.width * self.height);
        let mut of_mean = 0.0;
        let mut of_tile = vec![0.0; all];
        let pixel = |sums: &[[Sum; 3]]| {
            let gray = |r: usize| sums[r].iter().map(|sum| sum.value()).sum::<f64>() / 3.0;
            let of_channel = |c: usize| sigma2(&|r| sums[r][c].value())[1];
            let [mean, variance] = sigma2(&gray);
            of_mean += variance / (count * count);
            for (r, sum) in of_tile.iter_mut().enumerate() {
                *sum += gray(r) / count;
            }
            PixelGlance {
                mean: mean as f32,
                of_sample: ((0..3).map(of_channel).sum::<f64>() / 3.0) as f32,
            }
        };
        let pixels = self.rgb.chunks(all).map(pixel).collect();
        let [mean, variance] = sigma2(&|r| of_tile[r]);
        let glance = Glance {
            mean,
            variance: of_mean / n,
            pixels,
        };
        Some((glance, variance / n))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Film, Window};
    use crate::math::Rgb;
    use crate::sampler::{Sampler, SamplerKind};

    /// Uniform noise around 1/2: in each pixel by itself, or in all of a row alike.
    fn film(samples: u64, alike: bool) -> Film {
        let window = Window {
            x: 0,
            y: 0,
            width: 80,
            height: 80,
        };
        let mut film = Film::new(window, 16, 0);
        for tile in film.tiles_mut() {
            for y in 0..tile.height {
                for x in 0..tile.width {
                    let pixel = match alike {
                        true => u64::from(tile.y + y),
                        false => u64::from((tile.y + y) * 80 + tile.x + x),
                    };
                    for s in 0..samples {
                        let u = Sampler::new(SamplerKind::Independent, 3, pixel, s, 1).get4(0);
                        tile.add(x, y, s, Rgb::splat(u[0]));
                    }
                }
            }
        }
        film.finish_pass(samples);
        film
    }

    #[test]
    fn few_samples_tell_the_variance_of_one() {
        for samples in [2, 3, 16] {
            for (alike, together) in [(false, 64.0), (true, 8.0)] {
                let glance = film(samples, alike).glance().unwrap();
                let mean = |f: &dyn Fn(&super::Glance) -> f64| {
                    glance.iter().map(f).sum::<f64>() / glance.len() as f64
                };
                // Of a uniform number: 1/12. Its estimate by 80 independent rows of 2 samples, the fewest there are, has
                // a standard error of 0.13 of itself.
                let of_sample = 12.0
                    * mean(&|g| {
                        let sum: f32 = g.pixels.iter().map(|p| p.of_sample).sum();
                        f64::from(sum) / g.pixels.len() as f64
                    });
                assert!((of_sample - 1.0).abs() < 0.4, "{samples} {of_sample}");
                // Of the mean of so many independent numbers.
                let of_mean = 12.0 * together * samples as f64 * mean(&|g| g.variance);
                assert!((of_mean - 1.0).abs() < 0.5, "{samples} {alike} {of_mean}");
            }
        }
        assert!(film(1, false).glance().is_none());
    }
}

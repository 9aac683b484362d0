//! What each technique of an integrator contributes to the picture: first and second moments per pixel.

use super::{Film, Tile};

/// Sums of a part of each sample's luminance and of its square, per pixel of a tile and part.
#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    count: usize,
    sums: Vec<[f64; 2]>,
}

impl Parts {
    pub(super) fn of_pixel(&self, i: usize) -> &[[f64; 2]] {
        &self.sums[i * self.count..(i + 1) * self.count]
    }

    pub(super) fn of_pixel_mut(&mut self, i: usize) -> &mut [[f64; 2]] {
        &mut self.sums[i * self.count..(i + 1) * self.count]
    }
}

/// What a part of the light contributes to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartMoments {
    /// Mean luminance over the picture.
    pub mean: f64,
    /// Variance of the part's luminance in one sample of a pixel, mean over the pixels. `None` with fewer than
    /// two samples.
    pub variance: Option<f64>,
}

impl Film {
    /// Keeps the moments of `count` parts of each sample from now on: 16 bytes per part and pixel.
    pub fn with_parts(mut self, count: usize) -> Film {
        for tile in &mut self.tiles {
            let pixels = (tile.width * tile.height) as usize;
            tile.parts = Parts {
                count,
                sums: vec![[0.0; 2]; pixels * count],
            };
        }
        self
    }

    /// How many parts' moments are kept.
    pub fn parts(&self) -> usize {
        self.tiles.first().map_or(0, |tile| tile.parts.count)
    }

    /// The moments of part `part`, below the number that [`Film::with_parts`] was told. Each sample counts as
    /// independent of the others: for quasi-random ones that is what a sample is worth alone, not what it adds
    /// beside the others.
    pub fn part_moments(&self, part: usize) -> PartMoments {
        let (mut mean, mut variance, mut pixels) = (0.0, 0.0, 0.0);
        for tile in &self.tiles {
            let n = tile.taken.count() as f64;
            for sums in tile.parts.sums.chunks_exact(tile.parts.count.max(1)) {
                let [first, second] = sums[part];
                mean += first / f64::max(n, 1.0);
                if n >= 2.0 {
                    variance += (second - first * first / n).max(0.0) / (n - 1.0);
                }
                pixels += 1.0;
            }
        }
        let pixels: f64 = f64::max(pixels, 1.0);
        PartMoments {
            mean: mean / pixels,
            variance: (self.spp() >= 2).then(|| variance / pixels),
        }
    }

    /// Adds `values`, row by row, to part `part` of the sample that is under way of every pixel.
    pub fn add_part_everywhere(&mut self, part: usize, values: &[f64]) {
        let width = self.window.width as usize;
        for tile in &mut self.tiles {
            for y in 0..tile.height {
                for x in 0..tile.width {
                    let from = (tile.y + y) as usize * width + (tile.x + x) as usize;
                    tile.add_part(x, y, part, values[from]);
                }
            }
        }
    }
}

impl Tile {
    /// Adds `value`, which must be finite, to the moments of a part of the pixel's sample: all of the part, for
    /// its square counts.
    #[inline]
    pub fn add_part(&mut self, x: u32, y: u32, part: usize, value: f64) {
        let pixel = (y * self.width + x) as usize;
        let sums = &mut self.parts.sums[pixel * self.parts.count + part];
        sums[0] += value;
        sums[1] += value * value;
    }
}

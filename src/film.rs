//! The film: per pixel and replicate the sum of its samples, and what follows from the spread of the replicates:
//! standard errors and the estimated error of the whole image. Sums are exact, so that a picture made in parts is the
//! same as one that was made at once.

mod estimate;
mod exact;
mod filter;
mod glance;
mod parts;
mod planes;
mod splat;
mod taken;

pub use estimate::{ErrorEstimate, TileError, student_t_95};
pub use exact::Sum;
pub use filter::{Filter, FilterSampler};
pub use glance::{FEWEST, Glance, PixelGlance};
pub use parts::PartMoments;
pub use planes::{PlaneError, Planes};
pub use splat::{Splat, SplatBand, SplatBuffer};
pub use taken::Taken;

use crate::math::Rgb;
use std::ops::Range;

/// Side of a square tile, in pixels.
pub const TILE: u32 = 8;

/// The part of the full picture that is rendered, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

/// Size and reconstruction of a picture.
#[derive(Clone, Debug)]
pub struct FilmSpec {
    /// Full size, which the camera's field of view refers to.
    pub width: u32,
    pub height: u32,
    pub crop: Window,
    pub filter: Filter,
}

/// Bounds of the number of replicates. 16 means give a pixel's standard error to within 18 %, 4 to
/// within 41 %; the error of the whole picture, over many pixels, is good with either.
const MIN_REPLICATES: u32 = 4;
const MAX_REPLICATES: u32 = 16;
/// Samples a replicate should have: splitting a few quasi-random points up further would cost more of
/// their accuracy than the better knowledge of it is worth.
const SAMPLES_PER_REPLICATE: u64 = 64;
/// Sums that may stand in memory before the number of replicates is lowered: 64 Mi sums are 3 GiB.
const MAX_SUMS: u64 = 64 << 20;

/// How many replicates the samples of a pixel are dealt out to: 16 from 1024 samples on. `spp` is `None`
/// when it is not known yet. Always a power of two.
pub fn replicates(spp: Option<u64>, pixels: u64) -> u32 {
    let bounded = |n: u64| {
        let n = n.clamp(u64::from(MIN_REPLICATES), u64::from(MAX_REPLICATES));
        1u32 << n.ilog2()
    };
    let affordable = bounded(MAX_SUMS / pixels.max(1));
    let Some(spp) = spp else {
        return affordable;
    };
    // Powers of two keep the replicates' sizes powers of two, where Sobol points are at their best.
    let wanted = bounded((spp / SAMPLES_PER_REPLICATE).next_power_of_two());
    let at_most = spp.clamp(1, u64::from(MAX_REPLICATES)).ilog2();
    wanted.min(affordable).min(1 << at_most)
}

/// Sums over the samples of one pixel.
struct PixelSums<'a> {
    rgb: &'a mut [[Sum; 3]],
    aov: &'a mut [Sum],
}

/// One square of the film; tiles are filled in parallel, each by one thread at a time.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Position of the first pixel, relative to the crop window.
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
    replicates: u32,
    aov_channels: usize,
    rgb: Vec<[Sum; 3]>,
    aov: Vec<Sum>,
    parts: parts::Parts,
    /// Samples that each of its pixels has received.
    taken: Taken,
    /// And that they are to have received next, of both halves; of films whose tiles are alike, the number of the
    /// sample before which to look again.
    goal: [u64; 2],
    /// Rays that its samples took.
    cost: u64,
}

impl Tile {
    pub fn replicates(&self) -> u32 {
        self.replicates
    }

    pub fn taken(&self) -> &Taken {
        &self.taken
    }

    /// Says that each of its pixels has received these samples too.
    pub fn take(&mut self, more: &Taken) {
        self.taken.add(more);
    }

    pub fn goal(&self) -> [u64; 2] {
        self.goal
    }

    pub fn set_goal(&mut self, goal: [u64; 2]) {
        self.goal = goal;
    }

    /// Rays that its samples took so far.
    pub fn cost(&self) -> u64 {
        self.cost
    }

    pub fn add_cost(&mut self, rays: u64) {
        self.cost += rays;
    }

    fn pixel(&mut self, x: u32, y: u32) -> PixelSums<'_> {
        let i = (y * self.width + x) as usize;
        let (r, a) = (self.replicates as usize, self.aov_channels);
        PixelSums {
            rgb: &mut self.rgb[i * r..(i + 1) * r],
            aov: &mut self.aov[i * a..(i + 1) * a],
        }
    }

    /// Adds sample number `sample` of the pixel at (`x`, `y`) within the tile. `value` must be finite.
    #[inline]
    pub fn add(&mut self, x: u32, y: u32, sample: u64, value: Rgb) {
        let replicate = (sample & u64::from(self.replicates - 1)) as usize;
        let sum = &mut self.pixel(x, y).rgb[replicate];
        for (s, v) in sum.iter_mut().zip(value.to_array()) {
            *s += f64::from(v);
        }
    }

    /// Adds to the pixel's arbitrary output variables, one number per channel.
    #[inline]
    pub fn add_aov(&mut self, x: u32, y: u32, values: &[f32]) {
        for (s, v) in self.pixel(x, y).aov.iter_mut().zip(values) {
            *s += f64::from(*v);
        }
    }
}

/// All that changes while rendering.
#[derive(Clone, Debug)]
pub struct Film {
    window: Window,
    replicates: u32,
    aov_channels: usize,
    tiles: Vec<Tile>,
}

impl Film {
    pub fn new(window: Window, replicates: u32, aov_channels: usize) -> Film {
        Film::of(window, replicates, aov_channels, &Taken::Range(0..0))
    }

    /// A film whose first sample will be number `first`.
    pub fn from_sample(mut self, first: u64) -> Film {
        for tile in &mut self.tiles {
            tile.taken = Taken::Range(first..first);
        }
        self
    }

    /// A film whose tiles get as many samples as each needs, by halves that are independent of each other (see
    /// [`Taken::Halves`]). There must be at least four replicates.
    pub fn adaptive(window: Window, replicates: u32, aov_channels: usize) -> Film {
        debug_assert!(replicates >= 4);
        Film::of(window, replicates, aov_channels, &Taken::Halves([0, 0]))
    }

    fn of(window: Window, replicates: u32, aov_channels: usize, taken: &Taken) -> Film {
        let starts =
            |n: u32| (0..n.div_ceil(TILE)).map(move |i| (i * TILE, TILE.min(n - i * TILE)));
        let tiles = starts(window.height)
            .flat_map(|(y, height)| {
                starts(window.width).map(move |(x, width)| {
                    let pixels = (width * height) as usize;
                    Tile {
                        x,
                        y,
                        width,
                        height,
                        replicates,
                        aov_channels,
                        rgb: vec![[Sum::ZERO; 3]; pixels * replicates as usize],
                        aov: vec![Sum::ZERO; pixels * aov_channels],
                        parts: parts::Parts::default(),
                        taken: taken.clone(),
                        goal: [0; 2],
                        cost: 0,
                    }
                })
            })
            .collect();
        Film {
            window,
            replicates,
            aov_channels,
            tiles,
        }
    }

    pub fn window(&self) -> Window {
        self.window
    }

    pub fn replicates(&self) -> u32 {
        self.replicates
    }

    /// Samples that every pixel has received; in the mean, where tiles differ.
    pub fn spp(&self) -> u64 {
        match self.tiles.first().map(|tile| &tile.taken) {
            Some(Taken::Range(range)) => range.end - range.start,
            Some(Taken::Halves(_)) => {
                let pixels = u64::from(self.window.width) * u64::from(self.window.height);
                (self.samples() as f64 / pixels.max(1) as f64).round() as u64
            }
            None => 0,
        }
    }

    /// Samples of all pixels together.
    pub fn samples(&self) -> u64 {
        let of = |tile: &Tile| tile.taken.count() * u64::from(tile.width * tile.height);
        self.tiles.iter().map(of).sum()
    }

    /// Samples of each pixel, row by row.
    pub fn counts(&self) -> Vec<u64> {
        self.gather(|tile, _| tile.taken.count())
    }

    /// Numbers of the samples that every pixel has received; `None` where tiles differ.
    pub fn range(&self) -> Option<Range<u64>> {
        match &self.tiles.first()?.taken {
            Taken::Range(range) => Some(range.clone()),
            Taken::Halves(_) => None,
        }
    }

    /// Number of the sample that is next; 0 where tiles differ.
    pub fn next_sample(&self) -> u64 {
        self.range().map_or(0, |range| range.end)
    }

    /// Number of the sample before which to look whether the picture is good enough, where tiles are alike.
    pub fn goal(&self) -> u64 {
        self.tiles.first().map_or(0, |tile| tile.goal[0])
    }

    /// Tiles that lie beside each other come one after the other, row by row; so many are in a row.
    pub fn tiles_across(&self) -> usize {
        self.window.width.div_ceil(TILE) as usize
    }

    /// The tiles, row by row.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// The tiles, to be given the same samples from `next_sample()` on each; then call [`Film::finish_pass`].
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// Adds `values`, row by row, to the sample that is under way (number `next_sample()`) of every pixel.
    pub fn add_everywhere(&mut self, values: &[[f64; 3]]) {
        let replicate = (self.next_sample() & u64::from(self.replicates - 1)) as usize;
        let width = self.window.width as usize;
        for tile in &mut self.tiles {
            for y in 0..tile.height {
                for x in 0..tile.width {
                    let from = (tile.y + y) as usize * width + (tile.x + x) as usize;
                    let sum = &mut tile.pixel(x, y).rgb[replicate];
                    for (s, v) in sum.iter_mut().zip(values[from]) {
                        *s += v;
                    }
                }
            }
        }
    }

    /// Says that every pixel has received `n` more samples.
    pub fn finish_pass(&mut self, n: u64) {
        let next = self.next_sample();
        for tile in &mut self.tiles {
            tile.take(&Taken::Range(next..next + n));
        }
    }

    /// The mean of every pixel, row by row.
    pub fn mean(&self) -> Vec<[f64; 3]> {
        self.gather(|tile, i| {
            let r = self.replicates as usize;
            let sums = &tile.rgb[i * r..(i + 1) * r];
            std::array::from_fn(|c| tile.taken.mean(|i| sums[i][c], r))
        })
    }

    /// The mean of AOV channel `channel` of every pixel, row by row.
    pub fn aov(&self, channel: usize) -> Vec<f64> {
        self.gather(|tile, i| {
            let n = tile.taken.count().max(1) as f64;
            tile.aov[i * self.aov_channels + channel].value() / n
        })
    }

    /// One value per pixel in row order; `f` gets the tile and the pixel's index within it.
    fn gather<T: Clone + Default>(&self, f: impl Fn(&Tile, usize) -> T) -> Vec<T> {
        let width = self.window.width as usize;
        let mut out = vec![T::default(); width * self.window.height as usize];
        for tile in &self.tiles {
            for y in 0..tile.height {
                for x in 0..tile.width {
                    let to = (tile.y + y) as usize * width + (tile.x + x) as usize;
                    out[to] = f(tile, (y * tile.width + x) as usize);
                }
            }
        }
        out
    }
}

//! Whether it pays to guide walks: found out by a few of them, before the picture is begun.
//!
//! A way to walk is worth the inverse of variance times cost. Walks of each way start at the same pixels,
//! with numbers of their own that the picture never sees, so what is found does not bias it. What they cost is counted
//! in rays, not in seconds, so that it is the same on all machines and for any number of threads.

use super::guide::{Guided, Guiding};
use crate::geom::Ray;
use crate::math::Vec2;
use crate::radiosity::Guide;
use crate::sampler::{Sampler, dim};
use crate::scene::CameraSample;
use crate::transport::path::{Start, WalkOnly};
use crate::transport::{PathSpec, PathStats, Setting};
use rayon::prelude::*;

/// Rows and columns of the places on the film, at most.
const GRID: u32 = 32;
/// Sets of walks of each way from each place, and walks of each: the means of these sets differ by what is left to chance
/// by the points of the sampler.
const SETS: u32 = 4;
const WALKS: u32 = 8;
/// Share of the places, those where walks differ most, that is left out: a few of them would decide by chance.
const LEFT_OUT: f64 = 0.002;
/// Rows and columns of places around one that say what is seen there.
const BLOCK: usize = 4;
/// What differs is relative to what is seen plus this share of its mean over the film, squared.
const DARK: f64 = 0.1;
/// Cost of a ray of a walk that is ended by radiosity, and of one that it also guides, over that of a plain walk:
/// what is met has to be found among the patches, and then in a table. Measured in rooms of 3,000 to 500,000 patches:
/// 1.1 to 1.4, and 1.33 to 1.46.
const ENDED: f64 = 1.25;
const GUIDED: f64 = 1.45;
/// What longer paths add to the variance of direct light must be more than this share of it for a solution to be worth
/// its while: measured, guiding won no more than 1.05 times below, and 1.2 to 2.2 times from a share of 4 on.
const LEAST: f64 = 1.0;

/// How radiosity helps walks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Help {
    /// Not at all.
    None,
    By(Guided),
}

pub struct Pilot<'a> {
    pub path: &'a PathSpec,
    pub setting: Setting<'a>,
}

/// What the walks of one way came to at one place.
#[derive(Clone, Copy, Default)]
struct Found {
    mean: f64,
    variance: f64,
    rays: u64,
}

impl Pilot<'_> {
    /// The way that pays best.
    pub fn choose(&self, guide: &Guide) -> Help {
        let ways = [
            (Help::None, 1.0),
            (Help::By(Guided::EndsOnly), ENDED),
            (Help::By(Guided::Everywhere), GUIDED),
        ];
        let found = ways.map(|(way, _)| {
            self.fly(|ray, sampler, stats| self.walk(way, guide, ray, sampler, stats))
        });
        let waste = self.costs(&found);
        let each = ways
            .iter()
            .zip(waste)
            .map(|((way, ray), waste)| (*way, waste * ray));
        let best = each.min_by(|a, b| a.1.total_cmp(&b.1));
        // Where nothing differs, nothing speaks against guiding.
        match best {
            Some((way, waste)) if waste > 0.0 => way,
            _ => Help::By(Guided::Everywhere),
        }
    }

    /// Whether reflections between surfaces make so much of the noise that guiding may pay.
    pub fn is_worth_a_solution(&self) -> bool {
        let scene = self.setting.scene;
        let direct = PathSpec {
            max_depth: Some(2),
            ..self.path.clone()
        };
        let found = [self.path, &direct].map(|path| {
            self.fly(|ray, sampler, stats| path.li(scene, ray, sampler, stats).radiance.luminance())
        });
        let [all, direct] = self.variances(&found);
        all > (1.0 + LEAST) * direct
    }

    fn walk(
        &self,
        help: Help,
        guide: &Guide,
        ray: Ray,
        sampler: &Sampler,
        stats: &mut PathStats,
    ) -> f32 {
        let scene = self.setting.scene;
        let li = match help {
            Help::None => self.path.li(scene, ray, sampler, stats),
            Help::By(guided) => {
                let mut guiding = Guiding::new(scene, guide, WalkOnly, guided);
                let start = Start::at_camera(ray);
                self.path.walk(scene, start, sampler, stats, &mut guiding)
            }
        };
        li.radiance.luminance()
    }

    /// What walks find at each place: of the whole film, so that what is cropped looks the same.
    fn fly(&self, walk: impl Fn(Ray, &Sampler, &mut PathStats) -> f32 + Sync) -> Vec<Found> {
        let Setting {
            camera,
            film,
            seed,
            sampler,
            ..
        } = self.setting;
        let (nx, ny) = (self.columns(), film.height.min(GRID));
        let at_place = |place: u32| {
            let mut stats = PathStats::default();
            let mut sums = [0.0; SETS as usize];
            for number in 0..SETS * WALKS {
                let numbers =
                    Sampler::new(sampler, seed, u64::from(place), u64::from(number), SETS);
                let numbers = numbers.of_pilot();
                let [u, v, lens_u, lens_v] = numbers.get4(dim::CAMERA);
                let [time, ..] = numbers.get4(dim::TIME);
                let at = |i: u32, n: u32, size: u32| {
                    let pixel = (2 * u64::from(i) + 1) * u64::from(size) / (2 * u64::from(n));
                    pixel as f32
                };
                let pixel = Vec2::new(
                    at(place % nx, nx, film.width),
                    at(place / nx, ny, film.height),
                );
                let sample = CameraSample {
                    film: pixel + Vec2::new(u, v),
                    lens: Vec2::new(lens_u, lens_v),
                    time,
                };
                let seen = camera.ray(&sample);
                let value = f64::from(seen.weight * walk(seen.ray, &numbers, &mut stats));
                if value.is_finite() {
                    sums[(number % SETS) as usize] += value / f64::from(WALKS);
                }
            }
            let n = f64::from(SETS);
            let mean = sums.iter().sum::<f64>() / n;
            Found {
                mean,
                variance: sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / (n - 1.0),
                rays: stats.total(),
            }
        };
        (0..nx * ny).into_par_iter().map(at_place).collect()
    }

    /// What is seen in the mean by all ways around each place. That of one place alone would be ruled by what few walks
    /// happened to find, and large where they differ most.
    fn seen(&self, found: &[Vec<Found>]) -> Vec<f64> {
        let (nx, blocks) = (
            self.columns() as usize,
            (self.columns() as usize).div_ceil(BLOCK),
        );
        let block = |place: usize| place / nx / BLOCK * blocks + place % nx / BLOCK;
        let places = found.first().map_or(0, Vec::len);
        let mut sums = vec![[0.0, 0.0]; if places > 0 { block(places - 1) + 1 } else { 0 }];
        for way in found {
            for (place, found) in way.iter().enumerate() {
                let [sum, count] = &mut sums[block(place)];
                *sum += found.mean;
                *count += 1.0;
            }
        }
        (0..places)
            .map(|place| sums[block(place)])
            .map(|[sum, count]| sum / count)
            .collect()
    }

    fn columns(&self) -> u32 {
        self.setting.film.width.min(GRID)
    }

    /// Of each way: variance relative to the square of what is seen, in the mean over the places.
    fn variances<const N: usize>(&self, found: &[Vec<Found>; N]) -> [f64; N] {
        let seen = self.seen(found);
        let whole = seen.iter().sum::<f64>() / seen.len() as f64;
        let dark = (DARK * whole).powi(2);
        let keep = seen.len() - (LEFT_OUT * seen.len() as f64).ceil() as usize;
        std::array::from_fn(|way| {
            let relative = |(found, seen): (&Found, &f64)| found.variance / (seen * seen + dark);
            let mut each: Vec<f64> = found[way].iter().zip(&seen).map(relative).collect();
            each.sort_by(f64::total_cmp);
            each[..keep].iter().filter(|v| v.is_finite()).sum::<f64>() / seen.len() as f64
        })
    }

    /// Of each way: that variance times the rays that it takes.
    fn costs<const N: usize>(&self, found: &[Vec<Found>; N]) -> [f64; N] {
        let variances = self.variances(found);
        std::array::from_fn(|way| {
            let rays: u64 = found[way].iter().map(|f| f.rays).sum();
            variances[way] * rays as f64
        })
    }
}

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
/// Time of a ray of a plain walk, in a scene of so many triangles: a part that is always the same, and one for each
/// doubling. Measured in three rooms: 180 ns with 38 triangles, 335 ns with 380,000; the unit does not matter.
const RAY: [f64; 2] = [120.0, 11.6];
/// What comes to it where the walk is ended by radiosity, and where that also guides it: what is met has to be found
/// among the patches, and then in a table.
const ENDED: f64 = 80.0;
const GUIDED: f64 = 155.0;
/// What a solution and the tables to guide by take, in rays of plain walks: for each edge of the solution's walks, and
/// for each triangle. Measured in these rooms: 5 to 29 million rays, predicted 5 to 28.
const SOLVED: [f64; 2] = [9.0, 60.0];
/// What is prepared may take this share of what the picture takes: so much is lost if it helps nothing.
const AFFORDABLE: f64 = 0.2;
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
            (Help::By(Guided::EndsOnly), 1.0 + ENDED / self.time_of_ray()),
            (
                Help::By(Guided::Everywhere),
                1.0 + GUIDED / self.time_of_ray(),
            ),
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

    /// Whether reflections between surfaces make so much of the noise that guiding may pay, in a picture that takes
    /// much longer than a solution of `edges` of walks.
    pub fn is_worth_a_solution(&self, edges: u64) -> bool {
        let scene = self.setting.scene;
        let direct = PathSpec {
            max_depth: Some(2),
            ..self.path.clone()
        };
        let found = [self.path, &direct].map(|path| {
            self.fly(|ray, sampler, stats| path.li(scene, ray, sampler, stats).radiance.luminance())
        });
        let [all, direct] = self.variances(&found);
        let crop = &self.setting.film.crop;
        let walks = found[0].len() as f64 * f64::from(SETS * WALKS);
        let rays = found[0].iter().map(|f| f.rays).sum::<u64>() as f64 / walks;
        let pixels = f64::from(crop.width) * f64::from(crop.height);
        let [of_edge, of_triangle] = SOLVED;
        let solved = of_edge * edges as f64 + of_triangle * self.triangles();
        let is_long = |spp: u64| AFFORDABLE * spp as f64 * pixels * rays >= solved;
        all > (1.0 + LEAST) * direct && self.setting.planned.is_none_or(is_long)
    }

    fn triangles(&self) -> f64 {
        self.setting.scene.counts().triangles as f64
    }

    fn time_of_ray(&self) -> f64 {
        RAY[0] + RAY[1] * self.triangles().max(1.0).log2()
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

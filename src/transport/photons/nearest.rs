//! Photons in a kd-tree, to be found by their rank.
//!
//! The tree is kiddo's immutable one. The mutable one refuses photons of which more than a bucket lie in one plane
//! across an axis, as on any wall; the immutable one puts those into large leaves, and takes twice the time there.

use std::num::NonZeroUsize;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

use super::map::{RADII, clamped};
use crate::math::Vec3;

/// Photons in space: the nearest, or those within any distance.
pub struct NearestMap<T> {
    /// `None`: no photons.
    tree: Option<ImmutableKdTree<f32, 3>>,
    /// In the order of the tree's leaves, so that neighbours in space are neighbours in memory.
    photons: Vec<T>,
}

impl<T: Copy + Send + Sync> NearestMap<T> {
    /// Of at most 2^32 - 1 photons; those that have no finite place are left out. Built on all threads of the
    /// current pool; the result is the same for any number of them.
    pub fn new(mut photons: Vec<(Vec3, T)>) -> NearestMap<T> {
        photons.retain(|(p, _)| p.is_finite());
        let (Some(first), count) = (tree_of(photons.par_iter().map(|(p, _)| p)), photons.len())
        else {
            return NearestMap {
                tree: None,
                photons: Vec::new(),
            };
        };
        // Photons move to where the tree has their points, and a tree of the new order takes its place.
        let order: Vec<u32> = first.iter().map(|(item, _)| item).collect();
        debug_assert_eq!(order.len(), count);
        drop(first);
        let tree = tree_of(order.par_iter().map(|&i| &photons[i as usize].0));
        NearestMap {
            photons: order.par_iter().map(|&i| photons[i as usize].1).collect(),
            tree,
        }
    }

    pub fn len(&self) -> usize {
        self.photons.len()
    }

    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Memory that the map takes, but for what the tree keeps above its leaves.
    pub fn bytes(&self) -> u64 {
        self.len() as u64 * (size_of::<[f32; 3]>() + size_of::<u32>() + size_of::<T>()) as u64
    }

    /// Calls `visit` for the `count` photons nearest to `p` within `radius`, the nearest first, with the square of
    /// their distance. Returns the squared radius of the disk that they are spread over: the distance of the
    /// next photon, so that `count` over the disk's area estimates an even density without bias; `radius` where
    /// fewer were found. At least the square of the smallest of [`super::RADII`].
    pub fn nearest(
        &self,
        p: Vec3,
        count: NonZeroUsize,
        radius: f32,
        mut visit: impl FnMut(&T, f32),
    ) -> f32 {
        let radius = clamped(radius);
        let r2 = radius * radius;
        let Some(tree) = self.tree.as_ref().filter(|_| p.is_finite()) else {
            return r2;
        };
        let found = tree
            .query(&p.to_array())
            .nearest_n::<SquaredEuclidean<f32>>(count.saturating_add(1))
            .within(r2)
            .execute();
        for near in found.iter().take(count.get()) {
            visit(&self.photons[near.item as usize], near.distance);
        }
        match found.get(count.get()) {
            Some(next) => next.distance.max(RADII.start() * RADII.start()),
            None => r2,
        }
    }

    /// Calls `visit` for all photons within `radius` of `p`, with the square of their distance, in an order that
    /// depends on the photons and on `p` alone.
    pub fn within(&self, p: Vec3, radius: f32, mut visit: impl FnMut(&T, f32)) {
        let Some(tree) = self.tree.as_ref().filter(|_| p.is_finite()) else {
            return;
        };
        let radius = clamped(radius);
        tree.query(&p.to_array())
            .within::<SquaredEuclidean<f32>>(radius * radius)
            .unsorted()
            .visit(|near| visit(&self.photons[near.item as usize], near.distance));
    }
}

/// A tree whose items are the numbers of the points; `None` where there are none.
fn tree_of<'a>(
    points: impl IndexedParallelIterator<Item = &'a Vec3>,
) -> Option<ImmutableKdTree<f32, 3>> {
    let points: Vec<[f32; 3]> = points.map(|p| p.to_array()).collect();
    match points.is_empty() {
        true => None,
        false => ImmutableKdTree::new_from_slice(&points).ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Sampler, SamplerKind};

    /// A wall, on which many share a coordinate, and a cloud.
    fn points(n: u64, seed: u64, scale: f32) -> Vec<Vec3> {
        let at = |i| {
            let [x, y, z, kind] = Sampler::new(SamplerKind::Independent, seed, 0, i, 1).get4(0);
            Vec3::new(x, y, if kind < 0.5 { 0.25 } else { z }) * scale
        };
        (0..n).map(at).collect()
    }

    fn map_of(points: &[Vec3]) -> NearestMap<u32> {
        NearestMap::new(points.iter().zip(0..).map(|(p, i)| (*p, i)).collect())
    }

    #[test]
    fn finds_what_a_search_through_all_finds() {
        for scale in [1e-6, 1.0, 1e6] {
            for n in [1, 40, 3000] {
                let all = points(n, 1, scale);
                let map = map_of(&all);
                assert_eq!(map.len(), all.len());
                for (p, r) in points(50, 2, scale)
                    .into_iter()
                    .zip([0.0, 0.05, 0.3, 9.0].into_iter().cycle())
                {
                    let radius = r * scale;
                    let mut expected: Vec<f32> =
                        all.iter().map(|q| p.distance_squared(*q)).collect();
                    expected.sort_unstable_by(f32::total_cmp);
                    expected.retain(|d2| *d2 <= clamped(radius).powi(2));
                    let mut got = Vec::new();
                    map.within(p, radius, |&i, d2| {
                        assert_eq!(d2, p.distance_squared(all[i as usize]));
                        got.push(d2);
                    });
                    got.sort_unstable_by(f32::total_cmp);
                    assert_eq!(got, expected);
                    got.clear();
                    let count = NonZeroUsize::new(20).unwrap();
                    let disk = map.nearest(p, count, radius, |_, d2| got.push(d2));
                    assert_eq!(got, expected[..expected.len().min(20)]);
                    assert_eq!(disk, *expected.get(20).unwrap_or(&clamped(radius).powi(2)));
                }
            }
        }
    }

    #[test]
    fn takes_whatever_it_is_given() {
        let mut odd = points(100, 3, 1.0);
        odd.extend([Vec3::INFINITY, Vec3::NAN, Vec3::splat(f32::MAX)]);
        let map = map_of(&odd);
        let many = NonZeroUsize::MAX;
        for p in [Vec3::ZERO, Vec3::INFINITY, Vec3::NAN, Vec3::splat(f32::MAX)] {
            for radius in [0.0, f32::NAN, 1e-45, 1.0, f32::INFINITY] {
                let few = NonZeroUsize::new(3).unwrap();
                let disk = map.nearest(p, few, radius, |_, _| ());
                assert!(disk > 0.0 && disk.is_finite());
            }
        }
        let mut found = 0;
        map.nearest(Vec3::ZERO, many, 1e9, |_, _| found += 1);
        assert_eq!(found, 100);
        let same = map_of(&[Vec3::splat(0.3); 5000]);
        let mut found = 0;
        same.within(Vec3::splat(0.3), 1e-3, |_, _| found += 1);
        assert_eq!(found, 5000);
        assert!(map_of(&[]).is_empty());
        map_of(&[]).within(Vec3::ZERO, 1.0, |_, _| panic!());
    }

    #[test]
    fn order_does_not_depend_on_the_number_of_threads() {
        let points = points(200_000, 4, 1.0);
        let build = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| map_of(&points))
        };
        let (one, four) = (build(1), build(4));
        let found = |map: &NearestMap<u32>, p| {
            let mut found = Vec::new();
            map.within(p, 0.02, |&i, _| found.push(i));
            found
        };
        for &p in &points[..500] {
            assert_eq!(found(&one, p), found(&four, p));
        }
    }

    /// The k nearest of evenly spread photons: their density, without bias.
    #[test]
    fn density_is_unbiased() {
        let (n, k, trials) = (2000u64, NonZeroUsize::new(10).unwrap(), 2000);
        let density = |trial| {
            let flat = |p: Vec3| Vec3::new(p.x, p.y, 0.0);
            let all: Vec<Vec3> = points(n, trial, 1.0).into_iter().map(flat).collect();
            let disk = map_of(&all).nearest(Vec3::new(0.5, 0.5, 0.0), k, 1.0, |_, _| ());
            10.0 / (std::f64::consts::PI * f64::from(disk))
        };
        let mean = (0..trials).map(density).sum::<f64>() / trials as f64;
        // One estimate has a standard deviation of 1 / sqrt(k - 1), a third; 2000 of 0.75 %; four of them.
        assert!((mean / n as f64 - 1.0).abs() < 0.03, "{mean}");
    }
}

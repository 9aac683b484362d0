//! Photons in a hash grid, to be found within one fixed distance.
//!
//! Space is cut into cubic cells (Teschner et al. 2003), and cells are thrown into a table of buckets such that
//! neighbours along x are neighbours in the table: the cells that a query touches are a few runs of photons
//! that lie side by side in memory. No cell's number is stored; the distance tells who belongs.

use rayon::prelude::*;

use crate::math::Vec3;

/// Radii whose squares, and what is divided by them, stay clear of the ends of f32's range. Others are taken as
/// the nearer of these two.
pub const RADII: std::ops::RangeInclusive<f32> = 1e-18..=1e18;

/// Photons that one task sorts. Fixed: the order of photons must not depend on threads.
const CHUNK: usize = 1 << 16;
/// Fewest buckets whose photons one task puts in order, and most tasks.
const SHARE: usize = 1 << 10;
const SHARES: usize = 1 << 8;
/// Cells along an axis that a query touches: two, and one more for rounding.
const ACROSS: usize = 3;
const ROWS: usize = ACROSS * ACROSS;

/// Photons whose distances are computed together.
const BLOCK: usize = 16;

/// Photons in space, to be found within a fixed distance.
pub struct PhotonMap<T> {
    radius: f32,
    /// Cells per unit of length.
    cells: f64,
    /// Number of buckets less one; the former is a power of two.
    mask: u64,
    /// Where the photons of each bucket begin, and where the last end.
    starts: Vec<u32>,
    points: Vec<Vec3>,
    photons: Vec<T>,
}

/// Photons from the first to before the second.
type Run = (u32, u32);

impl<T: Copy + Send + Sync> PhotonMap<T> {
    /// For queries of `radius`, at most 2^32 - 1 photons. Built on all threads of the current pool; the result
    /// is the same for any number of them. Photons without a place (NaN) are never found.
    pub fn new(photons: Vec<(Vec3, T)>, radius: f32) -> PhotonMap<T> {
        let radius = clamped(radius);
        let mask = photons.len().next_power_of_two() as u64 - 1;
        let mut map = PhotonMap {
            radius,
            cells: 0.5 / f64::from(radius),
            mask,
            starts: Vec::new(),
            points: Vec::new(),
            photons: Vec::new(),
        };
        let (starts, order) = map.sorted(&photons);
        map.starts = starts;
        map.points = order.par_iter().map(|&i| photons[i as usize].0).collect();
        map.photons = order.par_iter().map(|&i| photons[i as usize].1).collect();
        map
    }

    pub fn radius(&self) -> f32 {
        self.radius
    }

    pub fn len(&self) -> usize {
        self.photons.len()
    }

    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Memory that the map takes.
    pub fn bytes(&self) -> u64 {
        self.starts.len() as u64 * 4 + self.len() as u64 * PhotonMap::<T>::BYTES_PER_PHOTON
    }

    /// Without what finds it, which takes 4 to 8 bytes more.
    const BYTES_PER_PHOTON: u64 = (size_of::<Vec3>() + size_of::<T>()) as u64;

    /// Most memory that building a map of `photons` takes, what they come in included.
    pub fn bytes_to_build(photons: u64) -> u64 {
        let pair = size_of::<(Vec3, T)>() as u64;
        // The pairs, the map, their order, and who goes into which share of the buckets.
        let each = pair + PhotonMap::<T>::BYTES_PER_PHOTON + 4 + 8;
        let buckets = photons.checked_next_power_of_two().unwrap_or(u64::MAX);
        photons
            .saturating_mul(each)
            .saturating_add(buckets.saturating_mul(4))
    }

    /// Calls `visit` for all photons within the radius of `p`, with the square of their distance. The order
    /// depends on the photons and on `p` alone.
    #[inline]
    pub fn within(&self, p: Vec3, mut visit: impl FnMut(&T, f32)) {
        self.around(p, |photon, _, d2| visit(photon, d2));
    }

    /// The same, with the way from `p` to the photon before the square of its length.
    #[inline]
    pub fn around(&self, p: Vec3, mut visit: impl FnMut(&T, Vec3, f32)) {
        let r2 = self.radius * self.radius;
        let (runs, count) = self.runs(p);
        for &(first, end) in &runs[..count] {
            let range = first as usize..end as usize;
            let photons = &self.photons[range.clone()];
            for (points, photons) in self.points[range].chunks(BLOCK).zip(photons.chunks(BLOCK)) {
                // Whether a photon is near enough is hard to foresee: first all distances, without branches.
                let mut near = 0u32;
                let mut d2s = [0.0; BLOCK];
                for (i, (q, d2)) in points.iter().zip(&mut d2s).enumerate() {
                    *d2 = p.distance_squared(*q);
                    near |= u32::from(*d2 <= r2) << i;
                }
                while near != 0 {
                    let i = near.trailing_zeros() as usize;
                    visit(&photons[i], points[i] - p, d2s[i]);
                    near &= near - 1;
                }
            }
        }
    }

    /// The photons of the cells around `p`, each once.
    #[inline]
    fn runs(&self, p: Vec3) -> ([Run; ROWS * ACROSS], usize) {
        let mut runs = [(0, 0); ROWS * ACROSS];
        let mut count = 0;
        if self.photons.is_empty() {
            return (runs, 0);
        }
        let ([x0, y0, z0], [x1, y1, z1]) = self.box_around(p);
        let len = x1.wrapping_sub(x0) as u64 + 1;
        let mut clear = true;
        for z in z0..=z1 {
            for y in y0..=y1 {
                let bucket = self.bucket([x0, y, z]);
                let last = bucket + len;
                if last > self.mask + 1 {
                    clear = false;
                    break;
                }
                let run = (self.starts[bucket as usize], self.starts[last as usize]);
                if run.0 == run.1 {
                    continue;
                }
                clear &= runs[..count]
                    .iter()
                    .all(|r: &Run| run.1 <= r.0 || r.1 <= run.0);
                runs[count] = run;
                count += 1;
            }
        }
        match clear {
            true => (runs, count),
            false => self.runs_one_by_one([x0, y0, z0], [x1, y1, z1]),
        }
    }

    /// The same where rows of cells share buckets, or reach over the end of the table.
    #[cold]
    fn runs_one_by_one(&self, lo: [i64; 3], hi: [i64; 3]) -> ([Run; ROWS * ACROSS], usize) {
        let mut buckets = [u64::MAX; ROWS * ACROSS];
        let mut count = 0;
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                for x in lo[0]..=hi[0] {
                    let bucket = self.bucket([x, y, z]);
                    if !buckets[..count].contains(&bucket) {
                        buckets[count] = bucket;
                        count += 1;
                    }
                }
            }
        }
        let run = |b: u64| match b {
            u64::MAX => (0, 0),
            _ => (self.starts[b as usize], self.starts[b as usize + 1]),
        };
        (buckets.map(run), count)
    }

    /// Cells of the corners of the box that a query at `p` covers, at most [`ACROSS`] along each axis.
    #[inline]
    fn box_around(&self, p: Vec3) -> ([i64; 3], [i64; 3]) {
        let p = p.as_dvec3().to_array();
        // Squares of distances are rounded: what is just outside may count as inside.
        let r = f64::from(self.radius) * (1.0 + 4.0 * f64::from(f32::EPSILON));
        let lo = p.map(|x| floor((x - r) * self.cells));
        let hi = p.map(|x| floor((x + r) * self.cells));
        let within = |axis: usize| hi[axis].min(lo[axis].saturating_add(ACROSS as i64 - 1));
        (lo, [within(0), within(1), within(2)])
    }

    #[inline]
    fn bucket(&self, [x, y, z]: [i64; 3]) -> u64 {
        let row = (y as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ (z as u64).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let row = (row ^ (row >> 32)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (row >> 32).wrapping_add(x as u64) & self.mask
    }

    fn bucket_of(&self, p: Vec3) -> u64 {
        self.bucket(p.as_dvec3().to_array().map(|x| floor(x * self.cells)))
    }

    /// A counting sort by bucket: where each bucket begins, and the photons in their order.
    fn sorted(&self, photons: &[(Vec3, T)]) -> (Vec<u32>, Vec<u32>) {
        let buckets = self.mask as usize + 1;
        let share = SHARE.max(buckets / SHARES);
        let shares = buckets.div_ceil(share);
        // Each chunk deals its photons out to shares of the table, ...
        let deal = |(chunk, photons): (usize, &[(Vec3, T)])| {
            let bucket_of = |(p, _): &(Vec3, T)| self.bucket_of(*p) as usize;
            let first = (chunk * CHUNK) as u32;
            Dealt::new(photons.iter().map(bucket_of).zip(first..), share, shares)
        };
        let dealt: Vec<Dealt> = photons.par_chunks(CHUNK).enumerate().map(deal).collect();
        let mut starts = vec![0; buckets + 1];
        let mut order = vec![0; photons.len()];
        starts[buckets] = photons.len() as u32;
        // ... and each share sorts what it was dealt, in the order of the chunks.
        let mut tasks = Vec::with_capacity(shares);
        let (mut starts_left, mut order_left) = (&mut starts[..buckets], &mut order[..]);
        let mut before = 0;
        for number in 0..shares {
            let count: usize = dealt.iter().map(|d| d.to(number).len()).sum();
            let (own_starts, rest) = starts_left.split_at_mut(share.min(starts_left.len()));
            starts_left = rest;
            let (own_order, rest) = order_left.split_at_mut(count);
            order_left = rest;
            tasks.push((number, before, own_starts, own_order));
            before += count as u32;
        }
        tasks
            .into_par_iter()
            .for_each(|(number, before, starts, order)| {
                let all = || dealt.iter().flat_map(|d| d.to(number));
                for &(bucket, _) in all() {
                    starts[bucket as usize] += 1;
                }
                let mut sum = 0;
                for start in starts.iter_mut() {
                    (sum, *start) = (sum + *start, sum);
                }
                for &(bucket, photon) in all() {
                    let place = &mut starts[bucket as usize];
                    order[*place as usize] = photon;
                    *place += 1;
                }
                // Each place ran on to where the next bucket begins.
                starts.rotate_right(1);
                starts[0] = 0;
                starts.iter_mut().for_each(|start| *start += before);
            });
        (starts, order)
    }
}

/// The photons of one chunk, dealt out to shares of the table.
struct Dealt {
    /// Bucket within the share, and number of the photon.
    photons: Vec<(u32, u32)>,
    starts: Vec<u32>,
}

impl Dealt {
    fn new(photons: impl Iterator<Item = (usize, u32)>, share: usize, shares: usize) -> Dealt {
        let mut starts = vec![0; shares + 1];
        let all: Vec<(usize, u32)> = photons.collect();
        for (bucket, _) in &all {
            starts[bucket / share + 1] += 1;
        }
        for i in 0..shares {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut photons = vec![(0, 0); all.len()];
        for (bucket, number) in all {
            let place = &mut next[bucket / share];
            photons[*place as usize] = ((bucket % share) as u32, number);
            *place += 1;
        }
        Dealt { photons, starts }
    }

    fn to(&self, share: usize) -> &[(u32, u32)] {
        &self.photons[self.starts[share] as usize..self.starts[share + 1] as usize]
    }
}

/// A radius that can be worked with; see [`RADII`]. NaN is the smallest.
pub(super) fn clamped(radius: f32) -> f32 {
    radius.max(*RADII.start()).min(*RADII.end())
}

/// The largest whole number not above `x`, or the end of the range.
#[inline]
fn floor(x: f64) -> i64 {
    let cut = x as i64;
    cut.saturating_sub(i64::from(x < cut as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Sampler, SamplerKind};

    fn points(n: u64, seed: u64) -> Vec<Vec3> {
        let at = |i| {
            let [x, y, z, kind] = Sampler::new(SamplerKind::Independent, seed, 0, i, 1).get4(0);
            match kind {
                k if k < 0.4 => Vec3::new(x, y, 0.0),
                k if k < 0.6 => Vec3::new(0.25, y, z),
                k if k < 0.8 => Vec3::new(x, y, z) * 0.03,
                _ => Vec3::new(x - 0.5, y - 0.5, z - 0.5),
            }
        };
        (0..n).map(at).collect()
    }

    fn map_of(points: &[Vec3], radius: f32) -> PhotonMap<u32> {
        let pairs = points.iter().zip(0..).map(|(p, i)| (*p, i)).collect();
        PhotonMap::new(pairs, radius)
    }

    fn found(map: &PhotonMap<u32>, p: Vec3) -> Vec<u32> {
        let mut found = Vec::new();
        map.within(p, |&i, d2| {
            assert!(d2 <= map.radius() * map.radius());
            found.push(i);
        });
        found
    }

    fn check(points: &[Vec3], radius: f32, queries: &[Vec3]) {
        let map = map_of(points, radius);
        assert_eq!(map.len(), points.len());
        let r2 = map.radius() * map.radius();
        for &p in queries {
            let mut got = found(&map, p);
            got.sort_unstable();
            let near = |i: &u32| p.distance_squared(points[*i as usize]) <= r2;
            let expected: Vec<u32> = (0..points.len() as u32).filter(near).collect();
            assert_eq!(got, expected, "radius {radius:e} at {p}");
        }
    }

    #[test]
    fn finds_what_a_search_through_all_finds_at_any_radius_and_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            for count in [1, 2, 7, 3000] {
                let points: Vec<Vec3> = points(count, 1).iter().map(|p| *p * scale).collect();
                let mut queries = points.clone();
                queries.truncate(60);
                queries.extend(self::points(60, 2).iter().map(|p| *p * scale));
                for radius in [1e-7, 0.004, 0.05, 0.7, 30.0] {
                    check(&points, radius * scale, &queries);
                }
            }
        }
    }

    #[test]
    fn takes_whatever_it_is_given() {
        let mut odd = points(300, 3);
        odd.extend([
            Vec3::INFINITY,
            Vec3::NEG_INFINITY,
            Vec3::new(f32::NAN, 0.0, 0.0),
            Vec3::splat(f32::MAX),
            Vec3::new(f32::INFINITY, 0.0, f32::NEG_INFINITY),
            Vec3::splat(1e-45),
        ]);
        for radius in [0.0, 1e-45, 1e-30, 1e-3, 1e30, f32::INFINITY, f32::NAN, -1.0] {
            check(&odd, radius, &odd);
        }
        let same = vec![Vec3::splat(0.3); 5000];
        check(&same, 1e-3, &[same[0], Vec3::ZERO, Vec3::splat(0.3004)]);
        check(&[], 0.1, &[Vec3::ZERO, Vec3::INFINITY]);
    }

    #[test]
    fn order_does_not_depend_on_the_number_of_threads() {
        let points = points(100_000, 4);
        let build = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| map_of(&points, 0.01))
        };
        let (one, four) = (build(1), build(4));
        for &p in &points[..500] {
            assert_eq!(found(&one, p), found(&four, p));
        }
        assert!(one.bytes() <= PhotonMap::<u32>::bytes_to_build(points.len() as u64));
    }
}

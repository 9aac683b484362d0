//! The comparison of a sampler with its density.

use super::Rng;
use super::quadrature::{self, Box2, Moments};
use super::stats::{chi2_p_value, normal_p_value, sidak};
use luxel::math::{DVec3, Vec3};
use std::f64::consts::PI;

/// Where samples live. Each domain has two coordinates in which its measure is the plane area.
#[derive(Clone, Copy, Debug)]
pub enum Domain {
    /// Unit directions of height `1 - z` of at most this (2: the sphere, 1: the upper hemisphere), and the
    /// azimuth. A density that ends in a step at the rim needs the rim to be the end of the domain.
    Cap(f64),
    /// x and y in a box, z ignored.
    Plane { lo: [f64; 2], hi: [f64; 2] },
}

impl Domain {
    fn bounds(self) -> Box2 {
        match self {
            Domain::Cap(height) => Box2 {
                lo: [0.0, -PI],
                hi: [height, PI],
            },
            Domain::Plane { lo, hi } => Box2 { lo, hi },
        }
    }

    fn coordinates(self, p: Vec3) -> [f64; 2] {
        let p = p.as_dvec3();
        match self {
            Domain::Cap(_) => {
                // 1 - z without cancellation: lobes around the normal may be 1e-4 wide.
                let r2 = p.x * p.x + p.y * p.y;
                let h = if p.z > 0.0 {
                    r2 / (1.0 + p.z)
                } else {
                    2.0 - r2 / (1.0 - p.z)
                };
                [h, p.y.atan2(p.x)]
            }
            Domain::Plane { .. } => [p.x, p.y],
        }
    }

    fn point(self, [a, b]: [f64; 2]) -> DVec3 {
        match self {
            Domain::Cap(_) => {
                let r = (a * (2.0 - a)).max(0.0).sqrt();
                DVec3::new(r * b.cos(), r * b.sin(), 1.0 - a)
            }
            Domain::Plane { .. } => DVec3::new(a, b, 0.0),
        }
    }
}

/// How many samples, and with what probability a correct pair of functions may fail.
#[derive(Clone, Copy, Debug)]
pub struct Chi2Plan {
    pub samples: usize,
    pub alpha: f64,
    pub domain: Domain,
}

/// Leaves of the partition over which the density is integrated, and cells that they are joined to.
const LEAVES: usize = 8192;
const CELLS: usize = 256;

/// A partition by medians of pilot samples: small boxes where the density is high.
struct Tree {
    /// Axis and position of each split, the root at 1, the children of i at 2i and 2i + 1.
    splits: Vec<(usize, f64)>,
    /// Each leaf, and the bounds of the pilot samples in it.
    leaves: Vec<(Box2, Box2)>,
}

impl Tree {
    fn new(bounds: Box2, pilot: &mut [[f64; 2]], leaves: usize) -> Tree {
        let mut tree = Tree {
            splits: vec![(0, 0.0); leaves],
            leaves: vec![(bounds, bounds); leaves],
        };
        tree.build(1, bounds, pilot);
        tree
    }

    fn build(&mut self, node: usize, bounds: Box2, points: &mut [[f64; 2]]) {
        if node >= self.splits.len() {
            self.leaves[node - self.splits.len()] =
                (bounds, Box2::around(points).unwrap_or(bounds));
            return;
        }
        // Axes by turns: a box long on one axis with all its points at one end would hide its density.
        let axis = (node.ilog2() % 2) as usize;
        let mid = points.len() / 2;
        let mut at = bounds.middle(axis);
        if !points.is_empty() {
            points.select_nth_unstable_by(mid, |a, b| a[axis].total_cmp(&b[axis]));
            let median = points[mid][axis];
            if median > bounds.lo[axis] && median < bounds.hi[axis] {
                at = median;
            }
        }
        self.splits[node] = (axis, at);
        let [below, above] = bounds.split(axis, at);
        let (left, right) = points.split_at_mut(mid);
        self.build(2 * node, below, left);
        self.build(2 * node + 1, above, right);
    }

    fn find(&self, p: [f64; 2]) -> usize {
        let mut node = 1;
        while node < self.splits.len() {
            let (axis, at) = self.splits[node];
            node = 2 * node + usize::from(p[axis] >= at);
        }
        node - self.splits.len()
    }
}

impl Chi2Plan {
    /// 10^6 directions of the cap of this height: 2 is the sphere, 1 the upper hemisphere.
    pub fn cap(height: f64, alpha: f64) -> Chi2Plan {
        Chi2Plan {
            samples: 1_000_000,
            alpha,
            domain: Domain::Cap(height),
        }
    }

    /// Fails the test when `sample` does not follow `pdf` (per unit of the domain's measure). A `None`
    /// counts as a sample that carries nothing: `pdf` then integrates to less than one.
    pub fn check(
        &self,
        name: &str,
        seed: u64,
        mut sample: impl FnMut(&mut Rng) -> Option<Vec3>,
        pdf: impl Fn(Vec3) -> f32,
    ) {
        let mut rng = Rng::new(seed);
        let bounds = self.domain.bounds();
        let mut pilot: Vec<[f64; 2]> = (0..8 * LEAVES)
            .filter_map(|_| sample(&mut rng))
            .map(|p| self.domain.coordinates(p))
            .collect();
        assert!(!pilot.is_empty(), "{name}: no sample carries anything");
        let center = self.domain.point(pilot[0]);
        let tree = Tree::new(bounds, &mut pilot, LEAVES);

        // The expectation of each cell and of the coordinates, relative to a point within the lobe.
        let density = |c: [f64; 2]| -> Moments {
            let p = self.domain.point(c);
            let pdf = f64::from(pdf(p.as_vec3()));
            assert!(pdf >= 0.0 && pdf.is_finite(), "{name}: pdf {pdf} at {p}");
            let d = (p - center) * pdf;
            [pdf, d.x, d.y, d.z]
        };
        let mut expected = vec![0.0; CELLS];
        let mut total = [0.0; 4];
        for (i, &(leaf, focus)) in tree.leaves.iter().enumerate() {
            let m = quadrature::integrate(&density, leaf, focus, 1e-7, 0.4 / LEAVES as f64);
            expected[i * CELLS / LEAVES] += m[0];
            total = quadrature::add(total, m);
        }

        let mut counts = vec![0u64; CELLS];
        let (mut sum, mut sum2, mut n) = (DVec3::ZERO, DVec3::ZERO, 0u64);
        for _ in 0..self.samples {
            if let Some(p) = sample(&mut rng) {
                let c = self.domain.coordinates(p);
                let inside = (0..2).all(|i| c[i] >= bounds.lo[i] && c[i] <= bounds.hi[i]);
                assert!(inside, "{name}: sample {p} lies outside");
                counts[tree.find(c) * CELLS / LEAVES] += 1;
                let d = match self.domain {
                    Domain::Cap(_) => p.as_dvec3() - center,
                    Domain::Plane { .. } => {
                        DVec3::new(f64::from(p.x), f64::from(p.y), 0.0) - center
                    }
                };
                sum += d;
                sum2 += d * d;
                n += 1;
            }
        }
        self.check_share(name, n, total[0]);
        self.check_cells(name, &counts, &expected);
        let means = DVec3::new(total[1], total[2], total[3]) / total[0];
        self.check_means(name, n as f64, [sum, sum2], means);
    }

    /// The density integrates to the share of samples that carry something: within 0.1 %, and within
    /// five standard errors where chance allows more.
    fn check_share(&self, name: &str, n: u64, integral: f64) {
        let total = self.samples as f64;
        let share = n as f64 / total;
        let chance = 5.0 * (share * (1.0 - share) / total).sqrt();
        assert!(
            (integral - share).abs() < chance.max(1e-3 * share),
            "{name}: the pdf integrates to {integral:.5}, the sampled share is {share:.5}"
        );
    }

    fn check_cells(&self, name: &str, counts: &[u64], expected: &[f64]) {
        let (mut chi2, mut dof) = (0.0, -1.0);
        let (mut rare_count, mut rare_expected) = (0.0, 0.0);
        // The samples that carry nothing are a cell like the others.
        let lost = self.samples as f64 - counts.iter().sum::<u64>() as f64;
        let lost_expected = self.samples as f64 * (1.0 - expected.iter().sum::<f64>()).max(0.0);
        let cells = counts
            .iter()
            .zip(expected)
            .map(|(&n, &p)| (n as f64, p * self.samples as f64))
            .chain([(lost, lost_expected)]);
        for (n, e) in cells {
            if e < 5.0 {
                rare_count += n;
                rare_expected += e;
            } else {
                chi2 += (n - e) * (n - e) / e;
                dof += 1.0;
            }
        }
        if rare_expected >= 5.0 {
            chi2 += (rare_count - rare_expected).powi(2) / rare_expected;
            dof += 1.0;
        } else {
            // Poisson: with at most five expected, thirty do not happen.
            assert!(
                rare_count < 30.0,
                "{name}: {rare_count} samples where {rare_expected} belong"
            );
        }
        let p = chi2_p_value(chi2, dof);
        assert!(
            p > self.alpha,
            "{name}: chi2 = {chi2:.1} of {dof} degrees of freedom, p = {p:.2e}"
        );
    }

    fn check_means(&self, name: &str, n: f64, [sum, sum2]: [DVec3; 2], expected: DVec3) {
        let mean = sum / n;
        for (axis, label) in ["x", "y", "z"].into_iter().enumerate() {
            let variance = sum2[axis] / n - mean[axis] * mean[axis];
            // The rounding of f32 directions is no error of the sampler.
            let error = ((mean[axis] - expected[axis]).abs() - 2e-7).max(0.0);
            let scale = (variance.max(1e-30) / n).sqrt();
            let p = normal_p_value(error / scale);
            assert!(
                p > sidak(self.alpha, 3),
                "{name}: mean of {label} is off by {error:.3e}, standard error {scale:.3e}, p = {p:.2e}"
            );
        }
    }
}

//! Form factors by quasi-random points. Both estimators are unbiased over seeds, and for every pair of patches it
//! is decided by their geometry alone which one is used:
//!
//! - *apart* (a gap of at least the radius of the larger one): the mean of cos cos / (π r²) V over pairs of points
//!   on both, which varies by a factor of less than (1 + 2 + 2)² there;
//! - *near*: that kernel has no bound. Instead, directions that are cosine-distributed leave points of the
//!   smaller patch; the form factor is the share that meets the larger one unhindered. [`PER_SAMPLE`] times as many
//!   directions as pairs, since most miss; all near patches share them.

use super::analytic::kernel;
use super::sight::{Role, Sight};
use super::{Face, FormFactors};
use crate::math::{DVec2, DVec3};
use std::cell::OnceCell;
use std::f64::consts::TAU;

/// Directions that leave a patch, for each sample that was asked for.
pub const PER_SAMPLE: u32 = 32;

/// A start on a patch and a direction, both unrelated to what it may meet.
#[derive(Clone, Copy, Debug)]
pub struct Launch {
    st: DVec2,
    x: DVec3,
    /// Unit vector.
    d: DVec3,
}

/// What leaves a patch; made when it is first needed.
pub type Launches = OnceCell<Vec<Launch>>;

impl FormFactors<'_> {
    /// A_i F_ij of patches that face each other, the smaller one first.
    pub(super) fn by_chance(&self, i: u32, j: u32, launches: &Launches) -> f64 {
        let (a, b) = (&self.faces[i as usize], &self.faces[j as usize]);
        match a.is_near(b) {
            true => self.by_directions(i, j, launches.get_or_init(|| self.launches(i))),
            false => self.by_pairs(i, j),
        }
    }

    fn by_pairs(&self, i: u32, j: u32) -> f64 {
        let (a, b) = (&self.faces[i as usize], &self.faces[j as usize]);
        let mut sum = 0.0;
        for k in 0..self.sight.samples {
            let weight = self.weight(i, j, k);
            if weight > 0.0 {
                sum += weight * self.sight.pair(i, j, k);
            }
        }
        // Not from more than there is: a guard for few samples between large patches.
        (sum / f64::from(self.sight.samples) * a.area).min(a.area.min(b.area))
    }

    /// cos cos / (π r²) between pair `k` of points, times the area of the second patch.
    #[inline]
    pub(super) fn weight(&self, i: u32, j: u32, k: u32) -> f64 {
        let (a, b) = (&self.faces[i as usize], &self.faces[j as usize]);
        let piece = |patch: u32| &self.mesh.patches[patch as usize].piece;
        let x = piece(i).at(self.sight.place(i, Role::First, k));
        let y = piece(j).at(self.sight.place(j, Role::Second, k));
        let weight = kernel(x, a.normal, y, b.normal) * b.area;
        if weight.is_finite() { weight } else { 0.0 }
    }

    fn launches(&self, i: u32) -> Vec<Launch> {
        let piece = self.mesh.patches[i as usize].piece;
        let n = self.faces[i as usize].normal;
        let (s, t) = n.any_orthonormal_pair();
        let launch = |k: u32| {
            let st = self.sight.place(i, Role::First, k);
            let u = self.sight.number(i, Role::Second, k);
            let (sin, cos) = (TAU * u.y).sin_cos();
            let r = u.x.sqrt();
            let d = s * (r * cos) + t * (r * sin) + n * (1.0 - u.x).max(0.0).sqrt();
            let x = piece.at(st);
            Launch { st, x, d }
        };
        let count = self.sight.samples.saturating_mul(PER_SAMPLE);
        (0..count).map(launch).collect()
    }

    fn by_directions(&self, i: u32, j: u32, launches: &[Launch]) -> f64 {
        let (a, b) = (&self.faces[i as usize], &self.faces[j as usize]);
        let piece = &self.mesh.patches[j as usize].piece;
        let sight: &Sight = &self.sight;
        let mut sum = 0.0;
        for launch in launches {
            let (height, fall) = ((launch.x - piece.o).dot(b.normal), -launch.d.dot(b.normal));
            if !(height > 0.0 && fall > 0.0) {
                continue;
            }
            let st = piece.locate(launch.x + launch.d * (height / fall));
            if piece.outline.contains(st) {
                let x = sight.at(i, launch.st);
                sum += sight.between(&x, &sight.at(j, st));
            }
        }
        sum / launches.len() as f64 * a.area
    }
}

impl Face {
    /// Whether the gap between both is less than the radius of the larger one.
    #[inline]
    fn is_near(&self, other: &Face) -> bool {
        let apart = self.radius + other.radius + self.radius.max(other.radius);
        (self.center - other.center).length() < apart
    }
}

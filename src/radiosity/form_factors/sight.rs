//! What patches see of each other: points on both and a ray between.

use super::super::PatchMesh;
use crate::geom::Endpoint;
use crate::math::{DVec2, DVec3, fp};
use crate::sampler::mix;
use crate::scene::Scene;
use rayon::prelude::*;

/// Masks that one connection passes at most; what stands behind more of them is not seen.
const PASSES: u32 = 64;

/// Most points that are kept; beyond, they are found anew for each ray. 40 bytes each.
const KEPT: usize = 1 << 22;

/// 1/φ, 1/φ², ... for the real root of φ⁵ = φ + 1: multiples of these, without their integer parts, fill the
/// four-dimensional unit cube evenly, whatever their number (a Kronecker sequence, as the golden ratio is for one
/// dimension; Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences").
const STEPS: [DVec2; 2] = [
    DVec2::new(0.856_674_883_854_502_9, 0.733_891_856_627_126),
    DVec2::new(0.628_706_721_037_808_6, 0.538_597_257_223_61),
];

/// A point on a patch, and how much further the test of rays against its triangles may err there than it says.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    end: Endpoint,
    slack: f32,
}

/// By how much of the height of one point over the other's plane the ends of a ray are moved at most.
const CLEARANCE: f32 = 0.01;

impl Point {
    /// The end of a ray to or from `other`. The error that a hit carries allows for that of the triangle test
    /// along an axis. For rays that are oblique to all axes the test's shear makes larger numbers of the corners:
    /// of rays from a wall to a floor a hundred times as wide as they are long, 1.7e-4 met the floor before its
    /// point. Three times the allowance is as much as the shear can add.
    #[inline]
    fn towards(&self, other: &Point) -> Endpoint {
        let height = (other.end.p - self.end.p).dot(self.end.ng).abs();
        Endpoint {
            p_err: self.end.p_err + self.slack.min(CLEARANCE * height),
            ..self.end
        }
    }
}

/// Which two of the four dimensions of a pair of points a patch has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    First,
    Second,
}

/// Points on all patches. A pair of patches is joined by as many pairs of points: number k of the one, as
/// [`Role::First`], with number k of the other, as [`Role::Second`]. Together these are well spread over both. The
/// points of each patch are shifted by chance, from `seed`: over seeds, each point is uniform.
#[derive(Debug)]
pub struct Sight<'a> {
    scene: &'a Scene,
    mesh: &'a PatchMesh,
    seed: u64,
    pub samples: u32,
    /// By patch, role and number; empty when these would be too many.
    kept: Vec<Point>,
}

impl<'a> Sight<'a> {
    pub fn new(scene: &'a Scene, mesh: &'a PatchMesh, samples: u32, seed: u64) -> Sight<'a> {
        let mut sight = Sight {
            scene,
            mesh,
            seed,
            samples: samples.max(1),
            kept: Vec::new(),
        };
        let of_patch = 2 * sight.samples as usize;
        if mesh.len().saturating_mul(of_patch) <= KEPT {
            let point = |i: usize| {
                let (patch, rest) = ((i / of_patch) as u32, (i % of_patch) as u32);
                match rest < sight.samples {
                    true => sight.make(patch, Role::First, rest),
                    false => sight.make(patch, Role::Second, rest - sight.samples),
                }
            };
            sight.kept = (0..mesh.len() * of_patch)
                .into_par_iter()
                .map(point)
                .collect();
        }
        sight
    }

    /// Two numbers in [0,1): number `k` of a patch in its role.
    #[inline]
    pub fn number(&self, patch: u32, role: Role, k: u32) -> DVec2 {
        let address = (u64::from(patch) << 1) ^ role as u64;
        let hash = mix(mix(self.seed ^ 0x6666_5f73_6967_6874) ^ address);
        let unit = |bits: u64| (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64);
        let shift = DVec2::new(unit(hash), unit(mix(hash)));
        (shift + STEPS[role as usize] * f64::from(k)).fract()
    }

    /// Where point `k` of a patch lies, in the coordinates of its piece.
    #[inline]
    pub fn place(&self, patch: u32, role: Role, k: u32) -> DVec2 {
        let outline = self.mesh.patches[patch as usize].piece.outline;
        outline.sample(self.number(patch, role, k))
    }

    /// The surface at a place of a patch.
    #[inline]
    pub fn at(&self, patch: u32, st: DVec2) -> Point {
        let facet = self.mesh.patches[patch as usize].facet;
        let piece = &self.mesh.surfaces.facets()[facet as usize].piece;
        let across = (piece.e1.length() + piece.e2.length()) as f32;
        Point {
            end: Endpoint::from(&self.mesh.hit(self.scene, patch, st)),
            slack: across * fp::PLANE_ERROR,
        }
    }

    fn make(&self, patch: u32, role: Role, k: u32) -> Point {
        self.at(patch, self.place(patch, role, k))
    }

    #[inline]
    fn endpoint(&self, patch: u32, role: Role, k: u32) -> Point {
        let index = (patch as usize * 2 + role as usize) * self.samples as usize + k as usize;
        match self.kept.get(index) {
            Some(point) => *point,
            None => self.make(patch, role, k),
        }
    }

    /// Share of light that passes between pair `k` of points: 0 or 1, or between where masks are in the way.
    #[inline]
    pub fn pair(&self, first: u32, second: u32, k: u32) -> f64 {
        let x = self.endpoint(first, Role::First, k);
        let y = self.endpoint(second, Role::Second, k);
        self.between(&x, &y)
    }

    /// The same between points of two patches that are given in space.
    pub fn places(&self, first: (u32, DVec3), second: (u32, DVec3)) -> f64 {
        let end = |(patch, p): (u32, DVec3)| {
            let piece = &self.mesh.patches[patch as usize].piece;
            let st = piece.outline.clamp(piece.locate(p));
            self.at(patch, st)
        };
        self.between(&end(first), &end(second))
    }

    /// The same between any two points on surfaces. 1 for points so near that nothing fits between.
    #[inline]
    pub fn between(&self, x: &Point, y: &Point) -> f64 {
        let ray = x.towards(y).segment_to(&y.towards(x), 0.0);
        // Also false for the NaN of two points at the same place.
        if !(ray.t_max > 0.0 && ray.d.is_finite()) {
            return 1.0;
        }
        f64::from(self.scene.transmittance(&ray, PASSES))
    }
}

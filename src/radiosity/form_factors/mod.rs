//! Form factors F_ij: which share of the light that patch i gives off, the same in all directions and from all of
//! its points, arrives at patch j: 1/A_i ∫∫ cos cos / (π r²) V dA dA.
//!
//! Three ways to find them (see [`FormFactorMethod`]), which differ in what they get wrong:
//!
//! - *analytic*: exact between patches that nothing stands between, up to rules of integration (see [`analytic`]);
//!   otherwise times the share of light that rays between `samples` pairs of points let through, each pair
//!   weighted by what it exchanges. Reciprocal: A_i F_ij = A_j F_ji.
//!
//! Only the fronts of patches take part. Patches on one facet do not see each other. Where shapes are curved, the
//! patches are flat, but rays end on the shape itself.

pub mod analytic;
pub mod polygon;
pub mod quadrature;
pub mod sight;

use super::{FormFactorMethod, PatchMesh};
use crate::math::DVec3;
use crate::scene::Scene;
use analytic::{Rules, kernel};
use polygon::Polygon;
use rayon::prelude::*;
use sight::{Role, Sight};

/// All form factors of a scene: `n` rows of `n`.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    pub n: usize,
    /// Row i holds F_i0, F_i1, ...
    pub f: Vec<f64>,
}

impl Matrix {
    pub fn row(&self, i: usize) -> &[f64] {
        &self.f[i * self.n..(i + 1) * self.n]
    }
}

/// What is asked again and again of a patch.
#[derive(Clone, Copy, Debug)]
struct Face {
    polygon: Polygon,
    normal: DVec3,
    area: f64,
    facet: u32,
}

#[derive(Debug)]
enum Engine {
    Analytic(Rules),
}

/// The form factors of the patches of a mesh.
#[derive(Debug)]
pub struct FormFactors<'a> {
    mesh: &'a PatchMesh,
    faces: Vec<Face>,
    sight: Sight<'a>,
    engine: Engine,
}

impl<'a> FormFactors<'a> {
    /// Prepares what all rows share. The result depends on nothing but the arguments.
    pub fn new(
        scene: &'a Scene,
        mesh: &'a PatchMesh,
        method: FormFactorMethod,
        seed: u64,
    ) -> FormFactors<'a> {
        let face = |patch: &super::Patch| Face {
            polygon: Polygon::from(&patch.piece),
            normal: patch.piece.normal(),
            area: patch.area,
            facet: patch.facet,
        };
        let samples = match method {
            FormFactorMethod::Analytic { samples } | FormFactorMethod::MonteCarlo { samples } => {
                samples
            }
            FormFactorMethod::Hemicube { .. } => 16,
        };
        FormFactors {
            mesh,
            faces: mesh.patches.iter().map(face).collect(),
            sight: Sight::new(scene, mesh, samples, seed),
            engine: Engine::Analytic(Rules::new(samples)),
        }
    }

    /// F_ij of patch `i` to all patches j, into `out`, which is as long as the mesh has patches. May be called from
    /// many threads at once; the same every time.
    pub fn row(&self, i: u32, out: &mut [f64]) {
        let area = self.faces[i as usize].area;
        for (j, f) in out.iter_mut().enumerate() {
            *f = self.exchange(i, j as u32) / area;
        }
    }

    /// All rows, in parallel; equal to what [`FormFactors::row`] gives.
    pub fn matrix(&self) -> Matrix {
        let n = self.mesh.len();
        let mut f = vec![0.0; n * n];
        f.par_chunks_mut(n.max(1))
            .enumerate()
            .for_each(|(i, row)| self.row(i as u32, row));
        Matrix { n, f }
    }

    /// A_i F_ij in squared scene units.
    fn exchange(&self, i: u32, j: u32) -> f64 {
        // The smaller one first; in the same order for F_ji.
        let (i, j) = match self.faces[j as usize]
            .area
            .total_cmp(&self.faces[i as usize].area)
        {
            std::cmp::Ordering::Less => (j, i),
            std::cmp::Ordering::Equal => (i.min(j), i.max(j)),
            std::cmp::Ordering::Greater => (i, j),
        };
        let (a, b) = (&self.faces[i as usize], &self.faces[j as usize]);
        if !a.faces(b) {
            return 0.0;
        }
        let Engine::Analytic(rules) = &self.engine;
        let whole = rules.exchange(&a.polygon, a.normal, &b.polygon, b.normal);
        match whole > 0.0 {
            true => whole * self.seen(i, j),
            false => 0.0,
        }
    }

    /// Which share of what two patches would exchange arrives.
    fn seen(&self, i: u32, j: u32) -> f64 {
        let (a, b) = (&self.faces[i as usize], &self.faces[j as usize]);
        let (pa, pb) = (
            self.mesh.patches[i as usize].piece,
            self.mesh.patches[j as usize].piece,
        );
        let (mut sum, mut all) = (0.0, 0.0);
        for k in 0..self.sight.samples {
            let x = pa.at(self.sight.place(i, Role::First, k));
            let y = pb.at(self.sight.place(j, Role::Second, k));
            let weight = kernel(x, a.normal, y, b.normal) * b.area;
            if weight > 0.0 && weight.is_finite() {
                sum += weight * self.sight.pair(i, j, k);
                all += weight;
            }
        }
        if all > 0.0 {
            return (sum / all).min(1.0);
        }
        // Hardly in front of each other: the middles of the parts that are.
        let middle = |of: &Face, over: &Face| {
            let (o, n) = (over.polygon[0], over.normal);
            of.polygon.clip(|p| (p - o).dot(n)).area_and_center().1
        };
        self.sight.places((i, middle(a, b)), (j, middle(b, a)))
    }
}

impl Face {
    /// Whether some points of both fronts see each other, but for what stands between.
    #[inline]
    fn faces(&self, other: &Face) -> bool {
        let above = |of: &Face, over: &Face| {
            let (o, n) = (over.polygon[0], over.normal);
            of.polygon.iter().any(|p| (*p - o).dot(n) > 0.0)
        };
        self.facet != other.facet && above(other, self) && above(self, other)
    }
}

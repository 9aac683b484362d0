//! Form factors F_ij: which share of the light that patch i gives off, the same in all directions and from all of
//! its points, arrives at patch j: 1/A_i ∫∫ cos cos / (π r²) V dA dA.
//!
//! Three ways to find them (see [`FormFactorMethod`]), which differ in what they get wrong:
//!
//! - *analytic*: exact between patches that nothing stands between, up to rules of integration (see [`analytic`]);
//!   otherwise times the share of light that rays between `samples` pairs of points let through, each pair
//!   weighted by what it exchanges;
//! - *montecarlo*: unbiased (see [`monte_carlo`]);
//! - *hemicube*: from single points of a patch to what their pixels show (see [`hemicube`]).
//!
//! The first two find A_i F_ij, the exchange of a pair, once for both directions: reciprocity is exact, and how near
//! row sums of a closed scene come to 1 tells the error. With the third it is the other way around.
//!
//! Only the fronts of patches take part. Patches on one facet do not see each other. Where shapes are curved, the
//! patches are flat, but rays end on the shape itself.

pub mod analytic;
pub mod hemicube;
pub mod monte_carlo;
pub mod polygon;
pub mod quadrature;
pub mod raster;
mod report;
pub mod sight;

pub use report::Quality;

use super::{FormFactorMethod, Patch, PatchMesh};
use crate::math::DVec3;
use crate::scene::Scene;
use analytic::Rules;
use hemicube::Hemicube;
use monte_carlo::Launches;
use polygon::Polygon;
use rayon::prelude::*;
use sight::Sight;
use std::cmp::Ordering;

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

/// What a row of hemicubes did not see because of its resolution.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loss {
    /// Patches in front of the middle of the row's patch that cover the middle of no pixel, whether they would be
    /// hidden or not.
    pub lost: Vec<u32>,
    /// Their form factors from there, with nothing in the way.
    pub share: f64,
    /// Patches that cover a pixel, hidden or not.
    pub met: Vec<u32>,
}

/// What is asked again and again of a patch.
#[derive(Clone, Copy, Debug)]
struct Face {
    polygon: Polygon,
    normal: DVec3,
    center: DVec3,
    /// Of the circle about the centre that holds the patch.
    radius: f64,
    area: f64,
    facet: u32,
}

#[derive(Debug)]
enum Engine {
    Analytic(Rules),
    MonteCarlo,
    Hemicube(Box<Hemicube>),
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
    /// Prepares what all rows share. Numbers of samples and resolutions out of range are brought into it. The
    /// results depend on nothing but the arguments.
    pub fn new(
        scene: &'a Scene,
        mesh: &'a PatchMesh,
        method: FormFactorMethod,
        seed: u64,
    ) -> FormFactors<'a> {
        let (samples, engine) = match method {
            FormFactorMethod::Analytic { samples } => {
                (samples, Engine::Analytic(Rules::new(samples)))
            }
            FormFactorMethod::MonteCarlo { samples } => (samples, Engine::MonteCarlo),
            FormFactorMethod::Hemicube { resolution } => {
                let cube = Hemicube::new(scene, mesh, resolution, seed);
                (0, Engine::Hemicube(Box::new(cube)))
            }
        };
        FormFactors {
            mesh,
            faces: mesh.patches.iter().map(Face::new).collect(),
            sight: Sight::new(scene, mesh, samples, seed),
            engine,
        }
    }

    /// F_ij of patch `i` to all patches j, into `out`, which is as long as the mesh has patches. May be called from
    /// many threads at once; the same every time.
    pub fn row(&self, i: u32, out: &mut [f64]) {
        self.row_and_loss(i, out);
    }

    /// The same; what was lost between the pixels of hemicubes.
    pub fn row_and_loss(&self, i: u32, out: &mut [f64]) -> Loss {
        if let Engine::Hemicube(cube) = &self.engine {
            return self.by_hemicube(cube, i, out);
        }
        let own = Launches::new();
        let area = self.faces[i as usize].area;
        for (j, f) in out.iter_mut().enumerate() {
            *f = match self.order(i, j as u32) {
                (first, second) if first == i => self.exchange(first, second, &own),
                (first, second) => self.exchange(first, second, &Launches::new()),
            } / area;
        }
        Loss::default()
    }

    /// All rows, in parallel; equal to what [`FormFactors::row`] gives.
    pub fn matrix(&self) -> Matrix {
        self.matrix_and_losses().0
    }

    /// The same; and by row, for hemicubes only, what was lost between pixels.
    pub fn matrix_and_losses(&self) -> (Matrix, Vec<Loss>) {
        let n = self.mesh.len();
        let mut f = vec![0.0; n * n];
        let rows = f.par_chunks_mut(n.max(1)).enumerate();
        if let Engine::Hemicube(cube) = &self.engine {
            let losses = rows.map(|(i, row)| self.by_hemicube(cube, i as u32, row));
            let losses = losses.collect();
            return (Matrix { n, f }, losses);
        }
        // Each pair once, in the row of the first one of both; then copied to the other row.
        rows.for_each(|(i, row)| {
            let launches = Launches::new();
            for (j, exchange) in row.iter_mut().enumerate() {
                if self.order(i as u32, j as u32) == (i as u32, j as u32) {
                    *exchange = self.exchange(i as u32, j as u32, &launches);
                }
            }
        });
        for i in 0..n {
            for j in 0..i {
                let (first, second) = self.order(i as u32, j as u32);
                let exchange = f[first as usize * n + second as usize];
                f[i * n + j] = exchange / self.faces[i].area;
                f[j * n + i] = exchange / self.faces[j].area;
            }
        }
        (Matrix { n, f }, Vec::new())
    }

    /// Two patches, the smaller one first; the same whichever of both is asked for first.
    #[inline]
    fn order(&self, i: u32, j: u32) -> (u32, u32) {
        let areas = [i, j].map(|patch| self.faces[patch as usize].area);
        match areas[0].total_cmp(&areas[1]) {
            Ordering::Less => (i, j),
            Ordering::Equal => (i.min(j), i.max(j)),
            Ordering::Greater => (j, i),
        }
    }

    /// A_i F_ij in squared scene units, of patches in order.
    fn exchange(&self, i: u32, j: u32, launches: &Launches) -> f64 {
        let (a, b) = (&self.faces[i as usize], &self.faces[j as usize]);
        if !a.faces(b) {
            return 0.0;
        }
        match &self.engine {
            Engine::MonteCarlo => self.by_chance(i, j, launches),
            Engine::Analytic(rules) => {
                let whole = rules.exchange(&a.polygon, a.normal, &b.polygon, b.normal);
                match whole > 0.0 {
                    true => whole * self.seen(i, j),
                    false => 0.0,
                }
            }
            // Found by rows.
            Engine::Hemicube(_) => 0.0,
        }
    }

    /// Which share of what two patches would exchange arrives.
    fn seen(&self, i: u32, j: u32) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for k in 0..self.sight.samples {
            let weight = self.weight(i, j, k);
            if weight > 0.0 {
                sum += weight * self.sight.pair(i, j, k);
                all += weight;
            }
        }
        if all > 0.0 {
            return (sum / all).min(1.0);
        }
        // Hardly in front of each other: the middles of the parts that are.
        let (a, b) = (&self.faces[i as usize], &self.faces[j as usize]);
        let middle = |of: &Face, over: &Face| {
            let (o, n) = (over.polygon[0], over.normal);
            of.polygon.clip(|p| (p - o).dot(n)).area_and_center().1
        };
        self.sight.places((i, middle(a, b)), (j, middle(b, a)))
    }
}

impl Face {
    fn new(patch: &Patch) -> Face {
        let polygon = Polygon::from(&patch.piece);
        let center = patch.piece.center();
        let radius = |sum: f64, p: &DVec3| sum.max(polygon::length(*p - center));
        Face {
            radius: polygon.iter().fold(0.0, radius),
            polygon,
            normal: patch.piece.normal(),
            center,
            area: patch.area,
            facet: patch.facet,
        }
    }

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

//! Random walks from surface to surface.
//!
//! Each edge of a walk, from a point x in a direction by the cosine to the point y, is a sample of the irradiance at
//! x: E(x) = π ⟨L(y → x)⟩, with L(y → x) = ρ E(y) / π. On the way, mirrors, glass and gloss do to a walk what they do
//! to light.

use super::tree::Tree;
use crate::bsdf::{Bsdf, Density, Mode};
use crate::geom::Hit;
use crate::math::{DVec2, Frame, PI, Rgb, Vec2, Vec3, warp};
use crate::radiosity::mesh::{Located, Patch, on_facet};
use crate::radiosity::{Gloss, PatchMesh, Rgb64, SolveSpec};
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use rayon::prelude::*;

/// Edges of a walk between diffuse surfaces, at most, the first of which does not count.
const LONGEST: u32 = 8;
/// Mirrors, glass and gloss in a row, at most.
const PASSES: u32 = 8;

/// What walks are for.
#[derive(Clone, Copy, PartialEq)]
pub enum Purpose {
    /// To see roughly what comes by mirrors, glass and gloss.
    Stray,
    /// To correct what links bring.
    Correct,
}

impl Purpose {
    fn edges(self, spec: &SolveSpec) -> u64 {
        /// Of all edges, one in so many is worth a first look.
        const LOOK: u64 = 8;
        match self {
            Purpose::Stray => spec.walks.div_ceil(LOOK),
            Purpose::Correct => spec.walks,
        }
    }

    /// Of random numbers.
    fn stream(self) -> u64 {
        match self {
            Purpose::Stray => u64::MAX - 2,
            Purpose::Correct => u64::MAX - 1,
        }
    }
}

/// What walks met, in the order of the walks.
#[derive(Default)]
pub struct Traces {
    pub visits: Vec<Visit>,
    pub terms: Vec<Term>,
}

/// A point that walks left from, and irradiance there, in W/m².
pub struct Visit {
    pub at: Point,
    /// Straight from emitters.
    pub direct: Rgb,
    /// From these by mirrors, glass and gloss.
    pub stray: Rgb,
}

/// A point of a patch, in the coordinates of its piece.
#[derive(Clone, Copy)]
pub struct Point {
    pub patch: u32,
    pub st: [f32; 2],
}

/// An edge from visit number `from` to a point brings `weight` times the irradiance there.
#[derive(Clone, Copy)]
pub struct Term {
    pub from: u32,
    pub to: Point,
    pub weight: [f32; 3],
    /// What comes straight from emitters to that very point, in W/m², times `weight`; `None` where that is not known.
    pub lit: Option<[f32; 3]>,
}

impl Traces {
    /// About as many edges as asked for; fewer where they leave the scene soon.
    ///
    /// Walks start anywhere on patches that are `lit` (by patch), uniformly by area, and go on with equal chances,
    /// however dark a surface is; one that leaves the scene goes on from where it was. So each point is visited as
    /// often as any other: a step takes light's way from all that a point sees, so as many come from there as leave to
    /// there, and as many stay as leave to the sky. The mean over the visits of a patch is then the mean over its area;
    /// walks that followed light would be where it is bright. The first point does not count: it may lie within a
    /// wall or another body, where nothing that is lit is met from.
    pub fn new(
        scene: &Scene,
        tree: &Tree,
        mesh: &PatchMesh,
        lit: &[bool],
        spec: &SolveSpec,
        purpose: Purpose,
    ) -> Traces {
        let (wanted, stream) = (purpose.edges(spec), purpose.stream());
        let mut sum = 0.0;
        let area = |(patch, lit): (&Patch, &bool)| {
            sum += if *lit { patch.area } else { 0.0 };
            sum
        };
        let sums: Vec<f64> = mesh.patches.iter().zip(lit).map(area).collect();
        let walk = |i: u64| {
            let sampler = Sampler::new(SamplerKind::Sobol, spec.seed, stream, i, 1);
            let [x, y, pick, _] = sampler.get4(0);
            let at = f64::from(pick) * sum;
            let patch = sums.partition_point(|s| *s <= at).min(sums.len() - 1);
            let Patch { piece, facet, .. } = mesh.patches[patch];
            let st = (piece.outline).sample(DVec2::new(f64::from(x), f64::from(y)));
            let walker = Walker {
                scene,
                mesh,
                lit,
                gloss: spec.gloss,
                sampler,
                blocks: 0,
                found: Traces::default(),
            };
            let start = Located {
                patch: patch as u32,
                st,
            };
            walker.walk(start, on_facet(scene, &tree.surfaces, facet, &piece, st))
        };
        let mut all = Traces::default();
        if !(sum > 0.0 && sum.is_finite()) {
            return all;
        }
        let (mut made, mut number) = (0, 0);
        while made < wanted && number < wanted {
            // As many as it takes by what walks were so far, but at least a fair part of all.
            let missing = (wanted - made) as f64;
            let each = (made as f64 / number as f64).clamp(0.1, f64::from(LONGEST));
            let round = match number {
                0 => wanted.div_ceil(2 * u64::from(LONGEST)),
                _ => (missing / each).ceil() as u64,
            };
            let found: Vec<Traces> = (number..number + round).into_par_iter().map(walk).collect();
            number += round;
            found.into_iter().for_each(|found| all.add(found));
            made = all.visits.len() as u64;
        }
        all
    }

    /// What comes to each visit but straight from emitters, by the `irradiance` of patches: in W/m², summed over the
    /// channels.
    pub fn brought(&self, irradiance: impl Fn(u32) -> Rgb64) -> Vec<f32> {
        let stray = |visit: &Visit| visit.stray.to_array().iter().sum();
        let mut sums: Vec<f32> = self.visits.iter().map(stray).collect();
        for term in &self.terms {
            let weight = Rgb64::from_array(term.weight.map(f64::from));
            sums[term.from as usize] += (weight * irradiance(term.to.patch)).element_sum() as f32;
        }
        sums
    }

    fn add(&mut self, found: Traces) {
        let before = self.visits.len() as u32;
        self.visits.extend(found.visits);
        let moved = |term: Term| Term {
            from: term.from + before,
            ..term
        };
        self.terms.extend(found.terms.into_iter().map(moved));
    }
}

impl Point {
    fn new(at: Located) -> Point {
        Point {
            patch: at.patch,
            st: at.st.as_vec2().to_array(),
        }
    }
}

/// On its way.
struct Walker<'a> {
    scene: &'a Scene,
    mesh: &'a PatchMesh,
    lit: &'a [bool],
    gloss: Gloss,
    sampler: Sampler,
    /// Numbers that are used up.
    blocks: u32,
    found: Traces,
}

impl Walker<'_> {
    fn numbers(&mut self) -> [f32; 4] {
        self.blocks += 1;
        self.sampler.get4(self.blocks)
    }

    /// From `hit` on, which does not count.
    fn walk(mut self, mut from: Located, mut hit: Hit) -> Traces {
        // The edge that led here.
        let mut last: Option<usize> = None;
        for edge in 0..LONGEST {
            let sampled = lit_straight(self.scene, &hit, self.numbers());
            let [u, v, ..] = self.numbers();
            let wi = direction(&hit, Vec2::new(u, v));
            let first = self.found.terms.len();
            let (shown, next) = self.follow(hit, wi);
            let direct = sampled + shown.straight;
            if let Some(term) = last.map(|last| &mut self.found.terms[last]) {
                let lit = Rgb::from_array(term.weight) * direct;
                term.lit = lit.is_finite().then(|| lit.to_array());
            }
            last = match edge > 0 {
                true => {
                    self.found.visits.push(Visit {
                        at: Point::new(from),
                        direct,
                        stray: shown.stray,
                    });
                    // The first surface that it met leads on.
                    Some(first)
                }
                false => {
                    self.found.terms.clear();
                    None
                }
            };
            match next {
                Next::Surface(next, there) if self.lit[next.patch as usize] => {
                    (from, hit) = (next, there);
                }
                // What no light comes to is within something.
                Next::Surface(..) | Next::Nothing => break,
                Next::Sky => last = None,
            }
        }
        self.found
    }

    /// Looks along `wi` from `hit`, the next visit, by what mirrors and glass show: gives the emitters that are seen,
    /// and the first diffuse surface.
    fn follow(&mut self, mut hit: Hit, mut wi: Vec3) -> (Shown, Next) {
        let (origin, density) = (hit, Density::PerSr(front(&hit).dot(wi) / PI));
        let (mut next, mut shown) = (Next::Nothing, Shown::default());
        let (mut throughput, mut bent) = (Rgb::WHITE, false);
        for _ in 0..PASSES {
            let met = self.scene.intersect(&hit.spawn(wi));
            let le = match &met {
                Some(met) => self.scene.le(met),
                None => self.scene.le_escaped(wi),
            };
            if !le.is_black() {
                let lit = throughput * le * PI;
                match (bent, &met) {
                    (true, _) => shown.stray += lit,
                    (false, Some(met)) => {
                        let rival = self.scene.pdf_light(&origin, met);
                        shown.straight += lit * density.mis_weight(rival);
                    }
                    (false, None) => {
                        let rival = self.scene.pdf_light_escaped(&origin, wi);
                        shown.straight += lit * density.mis_weight(rival);
                    }
                }
            }
            let Some(met) = met else {
                if let Next::Nothing = next {
                    next = Next::Sky;
                }
                break;
            };
            hit = met;
            let [u, v, lobe, mixed] = self.numbers();
            let shading = self.scene.shade(&hit, mixed);
            let diffuse = shading.diffuse_share();
            let found = match diffuse.is_black() {
                true => None,
                false => self.mesh.locate(&hit),
            };
            if let Some(at) = found {
                self.found.terms.push(Term {
                    from: self.found.visits.len() as u32,
                    to: Point::new(at),
                    weight: (throughput * diffuse).to_array(),
                    lit: None,
                });
                if let Next::Nothing = next {
                    next = Next::Surface(at, hit);
                }
            }
            let Some(rest) = shading.without_diffuse() else {
                break;
            };
            let straight = matches!(rest.bsdf, Bsdf::Null(_));
            if self.gloss == Gloss::LeftOut && !straight {
                break;
            }
            let Some(sample) = rest.sample(lobe, Vec2::new(u, v), Mode::Radiance) else {
                break;
            };
            bent |= !straight;
            throughput *= sample.weight;
            wi = sample.wi;
        }
        if self.gloss != Gloss::All || !shown.stray.is_finite() {
            shown.stray = Rgb::BLACK;
        }
        (shown, next)
    }
}

/// Where an edge leads.
enum Next {
    Surface(Located, Hit),
    /// Out of the scene.
    Sky,
    /// To what has no patch.
    Nothing,
}

/// Irradiance in W/m² by the emitters that an edge sees: straight, where these cannot be sampled as well, and by
/// mirrors, glass and gloss.
#[derive(Default)]
struct Shown {
    straight: Rgb,
    stray: Rgb,
}

/// One sample of the irradiance at `hit` straight from emitters, in W/m², where edges do not see them as well.
fn lit_straight(scene: &Scene, hit: &Hit, [u, v, pick, _]: [f32; 4]) -> Rgb {
    let Some(sample) = scene.sample_light(hit, pick, Vec2::new(u, v)) else {
        return Rgb::BLACK;
    };
    let (cos, weight) = (front(hit).dot(sample.wi), sample.weight());
    if cos <= 0.0 || weight.is_black() {
        return Rgb::BLACK;
    }
    let passes = scene.transmittance(&sample.shadow_ray(hit), PASSES);
    let lit = weight * (cos * passes * sample.density.mis_weight(cos / PI));
    if lit.is_finite() { lit } else { Rgb::BLACK }
}

/// A direction away from the front that `hit` is seen from, by its cosine.
pub fn direction(hit: &Hit, u: Vec2) -> Vec3 {
    Frame::from_normal(front(hit)).to_world(warp::cosine_hemisphere(u))
}

/// The normal on the side that `hit` is seen from.
fn front(hit: &Hit) -> Vec3 {
    match hit.ng.dot(hit.wo) < 0.0 {
        true => -hit.ng,
        false => hit.ng,
    }
}

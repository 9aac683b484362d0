//! The camera's walk with a cache of the light that diffuse surfaces send each other.
//!
//! Let D be a scattering by a matte surface, all of whose lobes but delta ones are diffuse, G one by any other lobe
//! that is not a delta one, and S one by a delta lobe; x and y are the first and the second D of a path, counted from
//! the eye E to the light L.
//!
//! | path | found by |
//! | --- | --- |
//! | L (S\|G)* E | the walk |
//! | L D (S\|G)* E, at x | next-event estimation at x and the walk, weighted against each other |
//! | L (S\|G)+ D (S\|G)* E, at x | the walk; caustics by photons around x, if these are shot |
//! | L D (S\|G)* D (S\|G)* E, at y | light samples at y alone: the walk ends there |
//! | L … (S\|G\|D)+ D (S\|G)* D (S\|G)* E, at y | the cache |
//! | L S+ D (S\|G)* D (S\|G)* E, at y | photons around y, if these are shot |
//!
//! So each path is found once at most. What makes the bias is the size of patches, and the noise of the walks that
//! corrected the solution; these also follow light by S and G to y (see
//! [`SolveSpec::gloss`](crate::radiosity::SolveSpec)). Where y lies nearer to x than its patch is large, the patch's
//! mean would show in corners: the walk goes on from y as if it had no patch, and the same holds for surfaces without
//! patches.

use std::ops::{AddAssign, ControlFlow};
use std::sync::OnceLock;
use std::time::Instant;

use super::pilot::{Help, Pilot};
use super::solved::Cache;
use super::{CacheSpec, Guided, Guiding, Indirect, Solving};
use crate::bsdf::{Density, Mode};
use crate::geom::Ray;
use crate::math::{PI, Rgb, Vec2, Vec3};
use crate::radiosity::{Progress, SolveError};
use crate::sampler::{Sampler, dim};
use crate::scene::Scene;
use crate::transport::combined::{Caustics, Gathering};
use crate::transport::path::{
    Departure, Gather, Gathered, Onward, PathSpec, Start, UNBOUNDED, Vertex, WalkOnly,
};
use crate::transport::{Ledger, Li, PathStats, Setting, VertexNumbers};

/// How often the cache was read, and how far it was from the truth where that was tried.
///
/// At a random share of the vertices where the cache is read, light is also found by walking on, as without a cache.
/// The difference, as it counts in the picture, has the bias as its mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Bias {
    pub reads: u64,
    /// Those of them that were compared.
    pub compared: u64,
    /// Sums over the compared reads, as luminance in the picture's units: of the cache's excess over the truth,
    /// already divided by the share that is compared, and of its square.
    pub sum: f64,
    pub sum_squares: f64,
}

impl AddAssign for Bias {
    fn add_assign(&mut self, o: Bias) {
        self.reads += o.reads;
        self.compared += o.compared;
        self.sum += o.sum;
        self.sum_squares += o.sum_squares;
    }
}

impl Bias {
    /// Of a picture that is brighter by `factor`.
    pub fn scaled(self, factor: f64) -> Bias {
        Bias {
            sum: self.sum * factor,
            sum_squares: self.sum_squares * factor * factor,
            ..self
        }
    }

    /// Bias of the picture's mean luminance and its standard error, from `samples` of the picture's plane.
    pub fn mean(&self, samples: u64) -> Option<[f64; 2]> {
        if self.compared < 2 || samples < 2 {
            return None;
        }
        let n = samples as f64;
        let mean = self.sum / n;
        let variance = (self.sum_squares / n - mean * mean).max(0.0) / (n - 1.0);
        Some([mean, variance.sqrt()])
    }
}

/// What is read, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reads {
    /// All light, at the first surface with a diffuse lobe.
    All,
    /// All light, where a walk that a matte surface has scattered meets the next.
    AllBehind,
    /// There, light that diffuse surfaces have reflected before; emitters are sampled.
    ReflectedBehind,
}

/// Reads a cache along one walk of the eye. `CAUSTICS`: these are found by photons, the walk leaves them out.
pub struct Reader<'a, const CAUSTICS: bool> {
    scene: &'a Scene,
    path: &'a PathSpec,
    cache: Option<&'a Cache>,
    reads: Reads,
    pub caustics: Option<&'a Caustics>,
    /// Where a matte surface scattered the walk last.
    from: Option<Vec3>,
    /// What photons brought, as it counts in the picture.
    pub found: Rgb,
    pub bias: Bias,
}

/// Share of the reads that are compared with a walk.
const COMPARED: f32 = 1.0 / 64.0;

impl<'a, const CAUSTICS: bool> Reader<'a, CAUSTICS> {
    pub fn new(
        scene: &'a Scene,
        path: &'a PathSpec,
        cache: Option<&'a Cache>,
        reads: Reads,
    ) -> Reader<'a, CAUSTICS> {
        Reader {
            scene,
            path,
            cache,
            reads,
            caustics: None,
            from: None,
            found: Rgb::BLACK,
            bias: Bias::default(),
        }
    }

    /// Light that patches bring to `vertex`, and how the walk goes on.
    #[inline]
    fn read(&mut self, vertex: &Vertex, stats: &mut PathStats) -> Option<Gathered> {
        let (cache, hit) = (self.cache?, vertex.hit);
        let diffuse = vertex.shading.diffuse_share() * (1.0 / PI);
        if self.reads == Reads::All {
            if diffuse.is_black() {
                return None;
            }
            let read = cache.total(hit)?;
            return Some(Gathered::Diffuse(diffuse * read.irradiance));
        }
        let from = self.from?;
        if !vertex.shading.bsdf.is_matte() {
            return None;
        }
        let read = match self.reads {
            Reads::ReflectedBehind => cache.reflected(hit)?,
            _ => cache.total(hit)?,
        };
        if from.distance_squared(hit.p) < read.near2 {
            return None;
        }
        let lit = diffuse * read.irradiance;
        if self.reads == Reads::AllBehind {
            return Some(Gathered::Instead(lit));
        }
        self.bias.reads += 1;
        self.compare(vertex, lit, stats);
        Some(Gathered::Reflected(lit))
    }

    /// Now and then walks on from where `read` was read, to see how far that is from the truth.
    #[inline]
    fn compare(&mut self, vertex: &Vertex, read: Rgb, stats: &mut PathStats) {
        let sampler = vertex.sampler.of_comparison();
        let [u, ..] = sampler.get4(dim::TIME);
        if u < COMPARED {
            let truth = self.walk_on(vertex, &sampler, stats);
            let excess = vertex.throughput * (read - truth);
            let excess = f64::from(excess.luminance()) / f64::from(COMPARED);
            if excess.is_finite() {
                self.bias.compared += 1;
                self.bias.sum += excess;
                self.bias.sum_squares += excess * excess;
            }
        }
    }

    /// One sample of what the cache stands for: light that does not come straight from an emitter, nor from photons.
    fn walk_on(&self, vertex: &Vertex, sampler: &Sampler, stats: &mut PathStats) -> Rgb {
        let u = VertexNumbers::new(sampler, vertex.edges - 1).draw(true);
        let (hit, scene) = (*vertex.hit, self.scene);
        let sample = match vertex.shading.sample(u.lobe, u.direction, Mode::Radiance) {
            Some(sample) if sample.density != Density::Delta => sample,
            _ => return Rgb::BLACK,
        };
        let start = Start {
            ray: hit.spawn(sample.wi),
            edges: vertex.edges,
            throughput: sample.weight,
            eta2: sample.eta * sample.eta,
            departure: Some(Departure {
                from: hit,
                density: sample.density,
                // Light samples find all that can be found by them.
                light_per_bsdf: f32::MAX,
            }),
        };
        stats.indirect += 1;
        match CAUSTICS {
            false => {
                let walk = self.path.walk(scene, start, sampler, stats, &mut WalkOnly);
                walk.radiance
            }
            true => {
                let mut gathering = Gathering {
                    caustics: self.caustics,
                    max_depth: self.path.max_depth.unwrap_or(UNBOUNDED),
                    alone: false,
                    found: Rgb::BLACK,
                };
                let walk = (self.path).walk(scene, start, sampler, stats, &mut gathering);
                walk.radiance
            }
        }
    }
}

impl<const CAUSTICS: bool> Gather for Reader<'_, CAUSTICS> {
    const TAKES_CAUSTICS: bool = CAUSTICS;

    #[inline]
    fn at(&mut self, vertex: &Vertex, stats: &mut PathStats) -> Gathered {
        let mut lit = Rgb::BLACK;
        if let Some(caustics) = self.caustics {
            lit = caustics.at(vertex, self.path.max_depth.unwrap_or(UNBOUNDED));
            self.found += vertex.throughput * lit;
        }
        match self.read(vertex, stats) {
            Some(Gathered::Reflected(read)) => Gathered::Reflected(lit + read),
            Some(other) => other,
            None if CAUSTICS => Gathered::Also(lit),
            None => Gathered::Nothing,
        }
    }

    #[inline]
    fn scatter(
        &mut self,
        vertex: &Vertex,
        u_lobe: f32,
        u: Vec2,
        _: &mut PathStats,
    ) -> Option<Onward> {
        let sample = vertex.shading.sample(u_lobe, u, Mode::Radiance)?;
        if sample.density != Density::Delta && vertex.shading.bsdf.is_matte() {
            self.from = Some(vertex.hit.p);
        }
        Some(Onward { sample, met: None })
    }
}

/// The path tracer with a cache, without photons.
pub struct CachedPath<'a> {
    path: &'a PathSpec,
    setting: Setting<'a>,
    guides: bool,
    /// See [`CacheSpec::always`].
    always: bool,
    pub solving: Solving<'a>,
    /// How walks are guided, once that is found out.
    help: OnceLock<Help>,
}

impl<'a> CachedPath<'a> {
    pub fn new(path: &'a PathSpec, cache: &'a CacheSpec, setting: Setting<'a>) -> CachedPath<'a> {
        CachedPath {
            path,
            setting,
            guides: cache.indirect == Indirect::Guide,
            always: cache.always,
            solving: Solving::of(setting.scene, cache, path),
            help: OnceLock::new(),
        }
    }

    /// As [`Solving::prepare`]; where walks are to be guided, not if that cannot pay.
    pub fn prepare(
        &self,
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<f64, SolveError> {
        let start = Instant::now();
        let pilot = Pilot {
            path: self.path,
            setting: self.setting,
        };
        let asks = self.guides && !self.always && !self.solving.is_settled();
        if asks && !pilot.is_worth_a_solution(self.solving.walks()) {
            self.solving.skip();
        }
        self.solving.prepare(observe)?;
        let guide = self.solving.get().and_then(|cache| cache.guide.as_ref());
        self.help.get_or_init(|| match guide {
            None => Help::None,
            Some(_) if self.always => Help::By(Guided::Everywhere),
            Some(guide) => pilot.choose(guide),
        });
        Ok(start.elapsed().as_secs_f64())
    }

    /// One sample of the radiance along `ray`.
    #[inline]
    pub fn sample(&self, ray: Ray, sampler: &Sampler, ledger: &mut Ledger) -> Li {
        let (scene, cache) = (self.setting.scene, self.solving.get());
        let start = Start::at_camera(ray);
        if self.guides {
            let guide = cache.and_then(|cache| cache.guide.as_ref());
            let (Some(guide), Some(Help::By(guided))) = (guide, self.help.get()) else {
                return self.path.li(scene, ray, sampler, &mut ledger.rays);
            };
            let mut guiding = Guiding::new(scene, guide, WalkOnly, *guided);
            return (self.path).walk(scene, start, sampler, &mut ledger.rays, &mut guiding);
        }
        let mut reader = Reader::<false>::new(scene, self.path, cache, Reads::ReflectedBehind);
        let li = (self.path).walk(scene, start, sampler, &mut ledger.rays, &mut reader);
        ledger.fresh_bias = reader.bias;
        li
    }
}

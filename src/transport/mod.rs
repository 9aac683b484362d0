//! Light transport: from a ray to the radiance that arrives along it.
//!
//! One camera walk ([`path`]) and one direct-light function ([`direct_light`]) serve every integrator here.

pub mod aov;
mod bidir;
pub mod candidates;
mod combined;
mod ledger;
pub mod light_walk;
pub mod mis;
mod path;
mod photon_mapper;
pub mod photons;
pub mod radiosity;

pub use bidir::{BidirSpec, Method};
pub use combined::{CombinedSpec, Show};
pub use ledger::{Ledger, PathStats, PerTechnique, Technique};
pub use path::{DirectSpec, PathSpec};
pub use photon_mapper::PhotonMapperSpec;
pub use photons::PhotonSpec;
pub use radiosity::{Bias, CacheSpec, CachedSpec, Indirect, RadiositySpec, Solved};

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::bsdf::Mode;
use crate::film::FilmSpec;
use crate::geom::{Hit, Ray};
use crate::material::Shading;
use crate::math::{Rgb, Vec2};
use crate::radiosity::{Progress, Report, SolveError, SolveSpec};
use crate::sampler::{Sampler, SamplerKind, dim};
use crate::scene::{Camera, CameraSample, PlanEntry, Scene};

/// Which estimator computes the picture, and its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum IntegratorSpec {
    Path(PathSpec),
    Direct(DirectSpec),
    /// Light and eye subpaths, joined.
    Bidirectional(BidirSpec),
    /// Path tracing, caustics by photons.
    Combined(CombinedSpec),
    /// Photon maps behind a final gather.
    PhotonMapper(PhotonMapperSpec),
    /// Path tracing, light between diffuse surfaces from a cache.
    Cached(CachedSpec),
    /// Radiosity shown.
    Radiosity(RadiositySpec),
}

impl IntegratorSpec {
    pub fn name(&self) -> &'static str {
        match self {
            IntegratorSpec::Path(_) => "path",
            IntegratorSpec::Direct(_) => "direct",
            IntegratorSpec::Bidirectional(spec) => spec.method.name(),
            IntegratorSpec::Combined(_) => "combined",
            IntegratorSpec::PhotonMapper(_) => "photonmapper",
            IntegratorSpec::Cached(_) => "path",
            IntegratorSpec::Radiosity(_) => "radiosity",
        }
    }

    /// Whether emitters are left out of the camera's straight look.
    pub fn hide_emitters(&mut self) -> &mut bool {
        match self {
            IntegratorSpec::Path(spec) => &mut spec.hide_emitters,
            IntegratorSpec::Direct(spec) => &mut spec.hide_emitters,
            IntegratorSpec::Bidirectional(spec) => &mut spec.hide_emitters,
            IntegratorSpec::Combined(spec) => &mut spec.path.hide_emitters,
            IntegratorSpec::PhotonMapper(spec) => &mut spec.path.hide_emitters,
            IntegratorSpec::Cached(spec) => &mut spec.path.hide_emitters,
            IntegratorSpec::Radiosity(spec) => &mut spec.path.hide_emitters,
        }
    }

    /// Most edges of a path, in estimators that have such a limit.
    pub fn max_depth(&mut self) -> Option<&mut Option<u32>> {
        match self {
            IntegratorSpec::Path(spec) => Some(&mut spec.max_depth),
            IntegratorSpec::Direct(_) => None,
            IntegratorSpec::Bidirectional(spec) => Some(&mut spec.max_depth),
            IntegratorSpec::Combined(spec) => Some(&mut spec.path.max_depth),
            IntegratorSpec::PhotonMapper(spec) => Some(&mut spec.path.max_depth),
            IntegratorSpec::Cached(spec) => Some(&mut spec.path.max_depth),
            IntegratorSpec::Radiosity(spec) => Some(&mut spec.path.max_depth),
        }
    }

    /// Edges from which on Russian roulette may end a walk, in estimators that play it.
    pub fn rr_depth(&mut self) -> Option<&mut u32> {
        match self {
            IntegratorSpec::Path(spec) => Some(&mut spec.rr_depth),
            IntegratorSpec::Direct(_) => None,
            IntegratorSpec::Bidirectional(spec) => Some(&mut spec.rr_depth),
            IntegratorSpec::Combined(spec) => Some(&mut spec.path.rr_depth),
            IntegratorSpec::PhotonMapper(spec) => Some(&mut spec.path.rr_depth),
            IntegratorSpec::Cached(spec) => Some(&mut spec.path.rr_depth),
            IntegratorSpec::Radiosity(spec) => Some(&mut spec.path.rr_depth),
        }
    }

    /// How photons are shot and gathered, in estimators that do.
    pub fn photons(&mut self) -> Option<&mut PhotonSpec> {
        match self {
            IntegratorSpec::Path(_)
            | IntegratorSpec::Direct(_)
            | IntegratorSpec::Cached(_)
            | IntegratorSpec::Radiosity(_)
            | IntegratorSpec::PhotonMapper(_) => None,
            IntegratorSpec::Bidirectional(spec) => Some(&mut spec.photons),
            IntegratorSpec::Combined(spec) => Some(&mut spec.photons),
        }
    }

    /// How radiosity is solved for, in estimators that do.
    pub fn solve(&mut self) -> Option<&mut SolveSpec> {
        match self {
            IntegratorSpec::Combined(spec) => Some(&mut spec.cache.solve),
            IntegratorSpec::Cached(spec) => Some(&mut spec.cache.solve),
            IntegratorSpec::Radiosity(spec) => Some(&mut spec.solve),
            _ => None,
        }
    }

    /// What is made of the light between diffuse surfaces, in path tracers: these can all use a cache of it.
    pub fn cache(&self) -> Option<CacheSpec> {
        match self {
            IntegratorSpec::Path(_) => Some(CacheSpec::default()),
            IntegratorSpec::Cached(spec) => Some(spec.cache.clone()),
            IntegratorSpec::Combined(spec) => Some(spec.cache.clone()),
            _ => None,
        }
    }

    /// The same path tracer with another cache; other estimators stay as they are.
    pub fn with_cache(self, cache: CacheSpec) -> IntegratorSpec {
        match self {
            IntegratorSpec::Path(path) | IntegratorSpec::Cached(CachedSpec { path, .. }) => {
                match cache.indirect {
                    Indirect::None => IntegratorSpec::Path(path),
                    _ => IntegratorSpec::Cached(CachedSpec { path, cache }),
                }
            }
            IntegratorSpec::Combined(spec) => {
                IntegratorSpec::Combined(CombinedSpec { cache, ..spec })
            }
            other => other,
        }
    }

    /// A solution for radiosity to use in place of one of its own; other estimators stay as they are.
    pub fn with_solution(mut self, solution: Option<Solved>) -> IntegratorSpec {
        match &mut self {
            IntegratorSpec::Combined(spec) => spec.cache.given = solution,
            IntegratorSpec::Cached(spec) => spec.cache.given = solution,
            IntegratorSpec::Radiosity(spec) => spec.given = solution,
            _ => {}
        }
        self
    }

    /// What the estimator decides on in `scene`, for the plan.
    pub fn plan(&self, scene: &Scene) -> Vec<PlanEntry> {
        match self {
            IntegratorSpec::Bidirectional(spec) => vec![spec.plan(scene)],
            IntegratorSpec::Combined(spec) => {
                let cache = spec.cache.plan(scene, &spec.path);
                [spec.plan(scene)].into_iter().chain(cache).collect()
            }
            IntegratorSpec::PhotonMapper(spec) => vec![spec.plan(scene)],
            IntegratorSpec::Cached(spec) => {
                spec.cache.plan(scene, &spec.path).into_iter().collect()
            }
            IntegratorSpec::Radiosity(spec) => vec![spec.plan(scene)],
            IntegratorSpec::Path(_) | IntegratorSpec::Direct(_) => Vec::new(),
        }
    }

    /// The techniques whose shares are told apart, where there are several; none for other integrators.
    pub fn techniques(&self, scene: &Scene) -> &'static [Technique] {
        match self {
            IntegratorSpec::Bidirectional(spec) => spec.method.techniques(),
            IntegratorSpec::Combined(spec) if spec.shoots(scene) => {
                &[Technique::Path, Technique::Merging]
            }
            _ => &[],
        }
    }

    /// Whether the estimator is biased at any finite number of samples.
    pub fn biased(&self) -> bool {
        match self {
            IntegratorSpec::Path(_) | IntegratorSpec::Direct(_) => false,
            IntegratorSpec::Bidirectional(spec) => spec.method.merges(),
            IntegratorSpec::Combined(spec) => {
                spec.show != Show::AllByPath || spec.cache.indirect == Indirect::Gather
            }
            IntegratorSpec::Cached(spec) => spec.cache.indirect == Indirect::Gather,
            IntegratorSpec::PhotonMapper(_) | IntegratorSpec::Radiosity(_) => true,
        }
    }
}

/// An integrator at work on a scene.
#[derive(Clone, Copy, Debug)]
pub struct Setting<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub film: &'a FilmSpec,
    pub sampler: SamplerKind,
    pub seed: u64,
    /// That the samples of a pixel are dealt out to (see [`crate::sampler`]).
    pub replicates: u32,
    /// Samples that each pixel is to get, where that is known: what is prepared must be worth its while.
    pub planned: Option<u64>,
}

impl Setting<'_> {
    /// When the light of iteration `number` travels, for integrators whose walks from both sides must agree
    /// on it; `None` in a scene where that makes no difference. Well spread over the iterations of each
    /// replicate.
    pub fn common_time(&self, number: u64) -> Option<f32> {
        /// No pixel has this number.
        const NO_PIXEL: u64 = u64::MAX;
        (self.scene.moves() || self.camera.moves()).then(|| {
            let kind = SamplerKind::Sobol;
            Sampler::new(kind, self.seed, NO_PIXEL, number, self.replicates).get4(dim::TIME)[0]
        })
    }
}

/// An integrator ready to take samples.
pub struct Transport<'a> {
    setting: Setting<'a>,
    work: Work<'a>,
}

enum Work<'a> {
    Path(&'a PathSpec),
    Direct(&'a DirectSpec),
    Bidirectional(bidir::Engine<'a>),
    Combined(combined::Combined<'a>),
    PhotonMapper(photon_mapper::PhotonMapper<'a>),
    Cached(radiosity::CachedPath<'a>),
    Radiosity(radiosity::View<'a>),
}

/// What all samples of one iteration share. A function of scene, seed and the iteration's number alone.
#[derive(Default)]
pub struct Iteration {
    /// When all light of the iteration travels, where light and eye must agree on it.
    pub time: Option<f32>,
    photons: Option<bidir::Photons>,
    caustics: Option<combined::Caustics>,
    maps: Option<Arc<photon_mapper::Maps>>,
}

impl<'a> Transport<'a> {
    /// Prepares what all iterations share.
    pub fn new(spec: &'a IntegratorSpec, setting: Setting<'a>) -> Transport<'a> {
        let work = match spec {
            IntegratorSpec::Path(spec) => Work::Path(spec),
            IntegratorSpec::Direct(spec) => Work::Direct(spec),
            IntegratorSpec::Bidirectional(spec) => {
                Work::Bidirectional(bidir::Engine::new(spec, setting))
            }
            IntegratorSpec::Combined(spec) => match spec.shoots(setting.scene) {
                true => Work::Combined(combined::Combined::new(spec, setting)),
                false => with_cache(&spec.path, &spec.cache, setting),
            },
            IntegratorSpec::Cached(spec) => with_cache(&spec.path, &spec.cache, setting),
            IntegratorSpec::Radiosity(spec) => Work::Radiosity(radiosity::View::new(spec, setting)),
            IntegratorSpec::PhotonMapper(spec) => {
                Work::PhotonMapper(photon_mapper::PhotonMapper::new(spec, setting))
            }
        };
        Transport { setting, work }
    }

    /// Solves for radiosity, if that is asked for and not done yet, on all threads of the current pool; `observe`
    /// sees every step and may stop the work. Seconds on the clock.
    ///
    /// # Errors
    /// Why the scene has no solution. Without this call, [`Transport::begin`] solves, and where that fails walks
    /// find all light by themselves.
    pub fn prepare(
        &self,
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<f64, SolveError> {
        if let Work::Cached(engine) = &self.work {
            return engine.prepare(observe);
        }
        self.solving()
            .map_or(Ok(0.0), |solving| solving.prepare(observe))
    }

    /// What the solution is known to be; `None` where there is none.
    pub fn solution_report(&self) -> Option<&Report> {
        self.solving()?.report()
    }

    /// The solution itself, to be given to another integrator.
    pub fn solution(&self) -> Option<Solved> {
        self.solving()?.solution()
    }

    fn solving(&self) -> Option<&radiosity::Solving<'a>> {
        match &self.work {
            Work::Combined(engine) => engine.solving.as_ref(),
            Work::Cached(engine) => Some(&engine.solving),
            Work::Radiosity(engine) => engine.solving.as_ref(),
            _ => None,
        }
    }

    /// Whether the photons of the integrator fit into the memory that they may take; if not, what is wrong.
    pub fn fits(&self) -> Result<(), String> {
        match &self.work {
            Work::Combined(engine) => engine.fits(),
            Work::PhotonMapper(engine) => engine.fits(),
            Work::Bidirectional(engine) => engine.fits(),
            Work::Path(_) | Work::Direct(_) | Work::Cached(_) | Work::Radiosity(_) => Ok(()),
        }
    }

    /// Whether each sample number is an iteration of its own: photons are shot for it, or light is splatted
    /// all over the picture.
    pub fn iterates(&self) -> bool {
        match &self.work {
            Work::Path(_) | Work::Direct(_) | Work::Cached(_) | Work::Radiosity(_) => false,
            Work::Bidirectional(_) | Work::Combined(_) => true,
            Work::PhotonMapper(engine) => engine.iterates(),
        }
    }

    /// Radius of the disk that photons of iteration `number` are gathered from, in scene units: what blurs the
    /// picture. `None` where none are, or where it differs from place to place.
    pub fn radius(&self, number: u64) -> Option<f32> {
        match &self.work {
            Work::Bidirectional(engine) => Some(engine.radius(number)).filter(|r| *r > 0.0),
            Work::Combined(engine) => Some(engine.radius(number)),
            Work::Path(_) | Work::Direct(_) | Work::PhotonMapper(_) => None,
            Work::Cached(_) | Work::Radiosity(_) => None,
        }
    }

    /// Begins the iteration of sample `number`, on all threads of the current pool.
    pub fn begin(&self, number: u64, ledger: &mut Ledger) -> Iteration {
        // What went wrong is known to who asked for it.
        let _ = self.prepare(&mut |_| ControlFlow::Continue(()));
        match &self.work {
            Work::Path(_) | Work::Direct(_) | Work::Cached(_) | Work::Radiosity(_) => {
                Iteration::default()
            }
            Work::Bidirectional(engine) => engine.begin(number, ledger),
            Work::Combined(engine) => engine.begin(number, ledger),
            Work::PhotonMapper(engine) => engine.begin(number, ledger),
        }
    }

    /// One sample of the radiance along `ray`, which the camera made of `at`; `sampler` is that of sample
    /// `number` of the pixel.
    #[inline]
    pub fn sample(
        &self,
        iteration: &Iteration,
        at: &CameraSample,
        ray: Ray,
        sampler: &Sampler,
        ledger: &mut Ledger,
    ) -> Li {
        let scene = self.setting.scene;
        match &self.work {
            Work::Path(spec) => spec.li(scene, ray, sampler, &mut ledger.rays),
            Work::Direct(spec) => spec.li(scene, ray, sampler, &mut ledger.rays),
            Work::Bidirectional(engine) => engine.sample(iteration, at, ray, sampler, ledger),
            Work::Combined(engine) => engine.sample(iteration, ray, sampler, ledger),
            Work::PhotonMapper(engine) => engine.sample(iteration, ray, sampler, ledger),
            Work::Cached(engine) => engine.sample(ray, sampler, ledger),
            Work::Radiosity(engine) => engine.sample(ray, sampler, ledger),
        }
    }
}

/// The path tracer, with a cache if there is anything to read from it.
fn with_cache<'a>(path: &'a PathSpec, cache: &'a CacheSpec, setting: Setting<'a>) -> Work<'a> {
    match cache.is_used(setting.scene, path) {
        Ok(()) => Work::Cached(radiosity::CachedPath::new(path, cache, setting)),
        Err(_) => Work::Path(path),
    }
}

/// What one camera ray brings.
#[derive(Clone, Copy, Debug)]
pub struct Li {
    pub radiance: Rgb,
    /// Whether anything was seen: a surface that scatters light, or an environment that shines.
    pub seen: bool,
}

/// The rival strategy that a light sample shares the same paths with.
#[derive(Clone, Copy, Debug)]
pub enum Mis {
    /// None: the light sample alone estimates direct light.
    LightOnly,
    /// Sampling the BSDF, with this many BSDF samples per light sample.
    Power { bsdf_per_light: f32 },
}

/// How a connection to a light is made.
#[derive(Clone, Copy, Debug)]
pub struct Connect {
    pub mis: Mis,
    /// Masks and boundaries that are not there, which the connection may pass: each is an edge of the path.
    pub passes: u32,
}

/// Light that arrives at `hit` straight from an emitter and is scattered towards `hit.wo`: one sample of
/// it, chosen by the light side (Veach 1997, section 9.2).
#[inline]
pub fn direct_light(
    scene: &Scene,
    hit: &Hit,
    shading: &Shading,
    plan: Connect,
    u_pick: f32,
    u: Vec2,
    stats: &mut PathStats,
) -> Rgb {
    let Some(light) = scene.sample_light(hit, u_pick, u) else {
        return Rgb::BLACK;
    };
    let (f_cos, bsdf_pdf) = shading.eval_pdf(light.wi, Mode::Radiance);
    if f_cos.is_black() {
        return Rgb::BLACK;
    }
    stats.shadow += 1;
    let seen = scene.transmittance(&light.shadow_ray(hit), plan.passes);
    if seen == 0.0 {
        return Rgb::BLACK;
    }
    let weight = match plan.mis {
        Mis::LightOnly => 1.0,
        Mis::Power { bsdf_per_light } => light.density.mis_weight(bsdf_pdf * bsdf_per_light),
    };
    f_cos * light.weight() * (seen * weight)
}

/// The address of the random numbers of one path vertex, which draws only those that are used.
struct VertexNumbers<'a> {
    sampler: &'a Sampler,
    block: u32,
    /// Those for choices, once drawn.
    choices: Option<[f32; 4]>,
}

/// The random numbers of one path vertex.
struct Drawn {
    light: Vec2,
    direction: Vec2,
    pick: f32,
    lobe: f32,
    roulette: f32,
}

impl<'a> VertexNumbers<'a> {
    #[inline]
    fn new(sampler: &'a Sampler, vertex: u32) -> VertexNumbers<'a> {
        VertexNumbers {
            sampler,
            block: dim::VERTEX + vertex * dim::PER_VERTEX,
            choices: None,
        }
    }

    #[inline]
    fn choices(&mut self) -> [f32; 4] {
        let (sampler, block) = (self.sampler, self.block);
        *self
            .choices
            .get_or_insert_with(|| sampler.get4(block + dim::CHOICES))
    }

    /// The number that decides what a mixed material is; 0 in a scene without any.
    #[inline]
    fn material(&mut self, scene: &Scene) -> f32 {
        match scene.materials_are_mixed() {
            true => self.choices()[3],
            false => 0.0,
        }
    }

    /// The others. Those for choices are zero where there is no `any_choice` to make.
    #[inline]
    fn draw(mut self, any_choice: bool) -> Drawn {
        let [x, y, light_x, light_y] = self.sampler.get4(self.block + dim::DIRECTIONS);
        let [pick, lobe, roulette, _] = match any_choice {
            true => self.choices(),
            false => [0.0; 4],
        };
        Drawn {
            light: Vec2::new(light_x, light_y),
            direction: Vec2::new(x, y),
            pick,
            lobe,
            roulette,
        }
    }
}

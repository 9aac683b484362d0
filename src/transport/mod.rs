//! Light transport: from a ray to the radiance that arrives along it.
//!
//! One camera walk ([`path`]) and one direct-light function ([`direct_light`]) serve every integrator here.

pub mod aov;
mod path;

pub use path::{DirectSpec, PathSpec};

use crate::bsdf::Mode;
use crate::geom::{Hit, Ray};
use crate::material::Shading;
use crate::math::{Rgb, Vec2};
use crate::sampler::{Sampler, dim};
use crate::scene::Scene;

/// Which estimator computes the picture, and its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum IntegratorSpec {
    Path(PathSpec),
    Direct(DirectSpec),
}

impl IntegratorSpec {
    pub fn name(&self) -> &'static str {
        match self {
            IntegratorSpec::Path(_) => "path",
            IntegratorSpec::Direct(_) => "direct",
        }
    }

    /// Whether the estimator is biased: neither of these is.
    pub fn biased(&self) -> bool {
        false
    }

    /// Light that arrives against the direction of `ray`, one sample of it.
    #[inline]
    pub fn li(&self, scene: &Scene, ray: Ray, sampler: &Sampler, stats: &mut PathStats) -> Li {
        match self {
            IntegratorSpec::Path(spec) => spec.li(scene, ray, sampler, stats),
            IntegratorSpec::Direct(spec) => spec.li(scene, ray, sampler, stats),
        }
    }
}

/// What one camera ray brings.
#[derive(Clone, Copy, Debug)]
pub struct Li {
    pub radiance: Rgb,
    /// Whether anything was seen: a surface that scatters light, or an environment that shines.
    pub seen: bool,
}

/// Rays traced, by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PathStats {
    pub camera: u64,
    pub shadow: u64,
    pub indirect: u64,
}

impl PathStats {
    pub fn total(&self) -> u64 {
        self.camera + self.shadow + self.indirect
    }
}

impl std::ops::AddAssign for PathStats {
    fn add_assign(&mut self, o: PathStats) {
        self.camera += o.camera;
        self.shadow += o.shadow;
        self.indirect += o.indirect;
    }
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

//! Light transport: from a ray to the radiance that arrives along it.
//!
//! One camera walk ([`path`]) and one direct-light function ([`direct_light`]) serve every integrator here.

pub mod aov;
mod path;

pub use path::{DirectSpec, PathSpec};

use crate::bsdf::{Bsdf, Mode};
use crate::geom::{Hit, Ray};
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

    /// Radiance that arrives against the direction of `ray`, one sample of it.
    #[inline]
    pub fn li(&self, scene: &Scene, ray: Ray, sampler: &Sampler, stats: &mut PathStats) -> Rgb {
        match self {
            IntegratorSpec::Path(spec) => spec.li(scene, ray, sampler, stats),
            IntegratorSpec::Direct(spec) => spec.li(scene, ray, sampler, stats),
        }
    }
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

/// Light that arrives at `hit` straight from an emitter and is scattered towards `hit.wo`: one sample of
/// it, chosen by the light side (Veach 1997, section 9.2).
#[inline]
pub fn direct_light(
    scene: &Scene,
    hit: &Hit,
    bsdf: &Bsdf,
    mis: Mis,
    u_pick: f32,
    u: Vec2,
    stats: &mut PathStats,
) -> Rgb {
    let Some(light) = scene.sample_light(hit, u_pick, u) else {
        return Rgb::BLACK;
    };
    let (wo, wi) = (hit.frame.to_local(hit.wo), hit.frame.to_local(light.wi));
    let (f, bsdf_pdf) = bsdf.eval_pdf(wo, wi, Mode::Radiance);
    if f.is_black() {
        return Rgb::BLACK;
    }
    stats.shadow += 1;
    if scene.occluded(&light.shadow_ray(hit)) {
        return Rgb::BLACK;
    }
    let weight = match mis {
        Mis::LightOnly => 1.0,
        Mis::Power { bsdf_per_light } => light.density.mis_weight(bsdf_pdf * bsdf_per_light),
    };
    f * light.weight() * (wi.z.abs() * weight)
}

/// The random numbers of one path vertex.
struct VertexNumbers {
    light: Vec2,
    direction: Vec2,
    pick: f32,
    lobe: f32,
    roulette: f32,
}

impl VertexNumbers {
    /// The numbers of vertex `vertex`. Those for choices are drawn only where there is `any_choice`; else
    /// they are zero.
    #[inline]
    fn at(sampler: &Sampler, vertex: u32, any_choice: bool) -> VertexNumbers {
        let block = dim::VERTEX + vertex * dim::PER_VERTEX;
        let [x, y, light_x, light_y] = sampler.get4(block + dim::DIRECTIONS);
        let [pick, lobe, roulette, _] = match any_choice {
            true => sampler.get4(block + dim::CHOICES),
            false => [0.0; 4],
        };
        VertexNumbers {
            light: Vec2::new(light_x, light_y),
            direction: Vec2::new(x, y),
            pick,
            lobe,
            roulette,
        }
    }
}

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
    numbers: [f32; 4],
    stats: &mut PathStats,
) -> Rgb {
    let [u, v, u_pick, _] = numbers;
    let Some(light) = scene.sample_light(hit, u_pick, Vec2::new(u, v)) else {
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

/// The numbers of decision `which` (see [`dim`]) at path vertex `vertex`.
#[inline]
fn numbers_at(sampler: &Sampler, vertex: u32, which: u32) -> [f32; 4] {
    sampler.get4(dim::VERTEX + vertex * dim::PER_VERTEX + which)
}

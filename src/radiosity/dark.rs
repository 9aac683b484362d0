//! Sides of surfaces that no light gets to: the insides of closed bodies.

use crate::bsdf::Mode;
use crate::geom::{Hit, ShapeId};
use crate::light::{Aim, EmissionNumbers};
use crate::math::Vec2;
use crate::sampler::{Sampler, SamplerKind, dim};
use crate::scene::Scene;
use rayon::prelude::*;

/// Walks of light that look for lit sides, and edges of each at most.
const WALKS: u64 = 1 << 14;
const LONGEST: u32 = 32;
/// How often the one side has to be met so that the other, never met, is thought of as dark: where both are lit alike,
/// chance makes that of 0.4 % of the shapes, for which walks of the eye go on as if there were no patches.
const OFTEN: u32 = 8;
/// Scenes of fewer triangles are not looked at: their dark sides cost less than the look.
const MANY: usize = 20_000;

/// Which sides of shapes are dark, as far as is known.
#[derive(Clone, Debug, Default)]
pub struct DarkSides {
    /// By shape, all its places together: outside and inside.
    dark: Vec<[bool; 2]>,
}

impl DarkSides {
    /// Of scenes with many triangles, by random walks of light from all emitters, which no surface absorbs.
    pub fn of(scene: &Scene, seed: u64) -> DarkSides {
        if scene.counts().triangles < MANY {
            return DarkSides::default();
        }
        let aim = Aim::default();
        let walk = |i: u64| {
            let mut met = Vec::new();
            follow(
                scene,
                &aim,
                Sampler::new(SamplerKind::Sobol, seed, u64::MAX - 2, i, 1),
                &mut met,
            );
            met
        };
        let met: Vec<Vec<(ShapeId, usize)>> = (0..WALKS).into_par_iter().map(walk).collect();
        let mut counts = vec![[0u32; 2]; scene.world().geometries().len()];
        for (shape, side) in met.into_iter().flatten() {
            counts[shape.0 as usize][side] += 1;
        }
        let dark = |[a, b]: &[u32; 2]| [*a == 0 && *b >= OFTEN, *b == 0 && *a >= OFTEN];
        DarkSides {
            dark: counts.iter().map(dark).collect(),
        }
    }

    /// Whether no light gets to the outside, or the inside, of a shape.
    pub fn contain(&self, shape: ShapeId, inside: bool) -> bool {
        let sides = self.dark.get(shape.0 as usize);
        sides.is_some_and(|sides| sides[usize::from(inside)])
    }
}

/// Shapes and sides that light meets: 1 is the inside.
fn follow(scene: &Scene, aim: &Aim, sampler: Sampler, met: &mut Vec<(ShapeId, usize)>) {
    let [pick, aim_at, ..] = sampler.get4(dim::EMISSION);
    let [x, y, u, v] = sampler.get4(dim::EMISSION + 1);
    let numbers = EmissionNumbers {
        pick,
        aim: aim_at,
        place: Vec2::new(x, y),
        direction: Vec2::new(u, v),
        time: 0.0,
    };
    let Some(emission) = scene.sample_emission(aim, &numbers) else {
        return;
    };
    let mut ray = emission.ray;
    for edge in 0..LONGEST {
        let Some(hit) = scene.intersect(&ray) else {
            return;
        };
        met.push((hit.shape, side(&hit)));
        let [u, v, lobe, mixed] = sampler.get4(dim::VERTEX + edge);
        let shading = scene.shade(&hit, mixed);
        let Some(sample) = shading.sample(lobe, Vec2::new(u, v), Mode::Importance) else {
            return;
        };
        ray = hit.spawn(sample.wi);
    }
}

fn side(hit: &Hit) -> usize {
    usize::from(hit.wo.dot(hit.ng) < 0.0)
}

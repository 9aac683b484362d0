//! What gets out of a scene, by rays: form factors tell a closed scene from one that is nearly closed only as far
//! as they are exact, and where little is absorbed, that decides how bright everything is.

use super::System;
use crate::geom::Hit;
use crate::math::{DVec2, Frame, Vec2, Vec3, warp};
use crate::radiosity::{Rgb64, SolveError, optics};
use crate::sampler::{Sampler, SamplerKind};
use crate::scene::Scene;
use rayon::prelude::*;

/// Rays in all.
const RAYS: u64 = 1 << 14;

/// Reflectance from which on a patch absorbs nothing: f32 and averages of textures know it no better.
const ALL: f64 = 1.0 - 1e-6;

/// An error of brightness that is worth a warning.
const DOUBT: f64 = 0.05;

/// Masks in a row that a ray passes, at most.
const PASSES: u32 = 8;

/// Refuses scenes that are closed by patches which absorb nothing, in a channel that has light.
pub(super) fn check(scene: &Scene, system: &System, seed: u64) -> Result<(), SolveError> {
    let patches = &system.mesh.patches;
    let lit = system.watts(&system.source);
    let white = |c: usize| lit[c] > 0.0 && patches.iter().all(|p| p.albedo[c] >= ALL);
    let areas: Vec<f64> = patches.iter().map(|p| p.area).collect();
    match (0..3).any(white) && lost(scene, system, &areas, seed) == 0.0 {
        true => Err(SolveError::NoAbsorption),
        false => Ok(()),
    }
}

/// What to say of a solution whose brightness the error of the form factors makes uncertain. `escaped` and
/// `absorbed` in W, over the channels, as the form factors have it.
pub(super) fn doubt(
    scene: &Scene,
    system: &System,
    radiosity: &[Rgb64],
    [absorbed, escaped]: [f64; 2],
    seed: u64,
) -> Option<String> {
    let patches = system.mesh.patches.iter().zip(radiosity);
    let powers: Vec<f64> = patches.map(|(p, b)| p.area * b.element_sum()).collect();
    let all: f64 = powers.iter().sum();
    if !(all > 0.0 && all.is_finite()) {
        return None;
    }
    let rays = lost(scene, system, &powers, seed);
    let sigma = (rays * (1.0 - rays)).sqrt().max(1.0 / RAYS as f64) / (RAYS as f64).sqrt();
    let error = (escaped / all - rays).abs() - 3.0 * sigma;
    // What should fade at each reflection, by absorption and by getting out.
    let fades = absorbed.max(0.0) / all + rays;
    (error > DOUBT * fades).then(|| {
        format!(
            "{:.2} % of the light gets out at each reflection by the form factors, {:.2} % by rays: all is too dark or \
             too bright by about {:.0} %; use more samples or a higher resolution",
            100.0 * escaped / all,
            100.0 * rays,
            (100.0 * error / fades.max(f64::MIN_POSITIVE)).min(999.0)
        )
    })
}

/// Which share of what leaves the patches, with these weights, meets no patch: it gets out, or is lost to what
/// does not reflect diffusely.
fn lost(scene: &Scene, system: &System, weights: &[f64], seed: u64) -> f64 {
    let mut sums = Vec::with_capacity(weights.len());
    let mut sum = 0.0;
    for w in weights {
        sum += w.max(0.0);
        sums.push(sum);
    }
    if !(sum > 0.0 && sum.is_finite()) {
        return 0.0;
    }
    let is_lost = |i: u64| {
        let sampler = Sampler::new(SamplerKind::Sobol, seed, u64::MAX, i, 1);
        let ([x, y, u, v], [pick, ..]) = (sampler.get4(0), sampler.get4(1));
        let at = f64::from(pick) * sum;
        let patch = sums.partition_point(|s| *s <= at).min(sums.len() - 1);
        let outline = system.mesh.patches[patch].piece.outline;
        let st = outline.sample(DVec2::new(f64::from(x), f64::from(y)));
        let hit = system.mesh.hit(scene, patch as u32, st);
        let towards = direction(&hit, Vec2::new(u, v));
        let mut ray = hit.spawn(towards);
        for pass in 0..PASSES {
            let Some(met) = scene.intersect(&ray) else {
                return true;
            };
            // Masks let it pass by chance.
            let [chance, ..] = sampler.get4(2 + pass);
            if optics::at(scene, &met, chance).through == Rgb64::ZERO {
                return system.mesh.locate(&met).is_none();
            }
            ray = met.spawn(towards);
        }
        true
    };
    (0..RAYS).into_par_iter().filter(|&i| is_lost(i)).count() as f64 / RAYS as f64
}

/// A direction away from the front that `hit` is seen from, by its cosine.
fn direction(hit: &Hit, u: Vec2) -> Vec3 {
    let front = match hit.ng.dot(hit.wo) < 0.0 {
        true => -hit.ng,
        false => hit.ng,
    };
    Frame::from_normal(front).to_world(warp::cosine_hemisphere(u))
}

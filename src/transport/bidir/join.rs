//! The ways to join the walks of eye and light.

use super::eye::{EyeWalk, direction};
use super::{Engine, Photons};
use crate::bsdf::{Density, Mode};
use crate::film::Splat;
use crate::geom::{Endpoint, Hit};
use crate::material::Shading;
use crate::math::{PI, Rgb, Vec2, Vec3};
use crate::sampler::{Sampler, dim};
use crate::scene::Scene;
use crate::transport::light_walk::LightVertex;
use crate::transport::mis::{self, State, Techniques};
use crate::transport::{Drawn, Ledger, Technique};

/// Light that was scattered at least once, as it arrives at a surface.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Unit direction to where it came from.
    wi: Vec3,
    ng: Vec3,
    /// In W times the number of walks.
    power: Rgb,
    /// Edges behind it.
    edges: u32,
    /// Weight of the techniques that cut the path just before the photon, and of those before that, over the
    /// power of the density of going back; relative to merging here.
    cut: f32,
    reverse: f32,
}

// A map adds the point: 60 bytes in all, which the README states.
const _: () = assert!(size_of::<Photon>() == 48);

impl Photon {
    /// `merging` as in [`Techniques`].
    pub fn new(vertex: &LightVertex, merging: f64) -> Photon {
        let here = mis::power(vertex.state.pdf * merging);
        Photon {
            wi: vertex.hit.wo,
            ng: vertex.hit.ng,
            power: vertex.power,
            edges: vertex.edges,
            cut: ratio(vertex.state.cut, here),
            reverse: ratio(vertex.state.reverse, here),
        }
    }
}

impl Photon {
    /// Whether it can be merged with a vertex of the eye's walk at `hit`, `offset` away, where paths may have
    /// at most `most` edges more.
    #[inline]
    fn counts(&self, photons: &Photons, hit: &Hit, offset: Vec3, most: u32) -> bool {
        self.edges <= most && photons.kernel.accepts(hit, self.ng, offset) && self.cos(hit) > 0.0
    }

    /// Cosine under which it would have arrived at `hit`.
    #[inline]
    fn cos(&self, hit: &Hit) -> f32 {
        hit.ng.dot(self.wi).abs()
    }
}

/// a / b as f32, 0 where a is.
fn ratio(a: f64, b: f64) -> f32 {
    match a > 0.0 {
        true => (a / b).min(f64::from(f32::MAX)) as f32,
        false => 0.0,
    }
}

/// A vertex of the eye's walk that scatters light.
pub struct EyeVertex {
    pub hit: Hit,
    pub shading: Shading,
    pub u_material: f32,
    pub state: State,
    /// From the camera to here.
    pub edges: u32,
    /// Whether the walk was scattered by a lobe before that is no delta one.
    pub later: bool,
}

impl EyeVertex {
    /// f |cos| towards `wi`, the density per steradian with which the walk goes on there, and
    /// [`EyeVertex::pdf_back`].
    #[inline]
    pub fn eval(&self, scene: &Scene, wi: Vec3) -> (Rgb, f32, f32) {
        match self.shading.is_bent() {
            true => {
                let (f_cos, pdf) = self.shading.eval_pdf(wi, Mode::Radiance);
                (f_cos, pdf, self.pdf_back(scene, wi))
            }
            false => self.shading.eval_both_pdfs(wi),
        }
    }

    /// Density per steradian with which a walk of light that comes against `wi` goes on towards the eye.
    #[inline]
    pub fn pdf_back(&self, scene: &Scene, wi: Vec3) -> f32 {
        let seen = scene.seen_from(&self.hit, &self.shading, self.u_material, wi);
        seen.eval_pdf(self.hit.wo, Mode::Importance).1
    }
}

/// Weight of a connection that is always looked along; of those that weigh less, Russian roulette leaves a part.
const WORTH_A_RAY: f64 = 0.2;

/// Its multiples are spread evenly over the unit interval, whole numbers left out.
const GOLDEN_RATIO: f32 = 0.618_034;

/// The numbers that choose the point of the lens that a walk of light is connected to.
pub fn lens_numbers(sampler: &Sampler) -> Vec2 {
    let [.., x, y] = sampler.get4(dim::EMISSION);
    Vec2::new(x, y)
}

impl Engine<'_> {
    /// Connects a vertex of light to the camera.
    pub fn splat(
        &self,
        techniques: &Techniques,
        vertex: &LightVertex,
        lens: Vec2,
        ledger: &mut Ledger,
    ) {
        let (scene, camera) = (self.setting.scene, self.setting.camera);
        let Some(passes) = self.max_depth.checked_sub(vertex.edges + 1) else {
            return;
        };
        let hit = &vertex.hit;
        let margin = self.setting.film.filter.radius();
        let Some(sight) = camera.connect(hit.p, hit.time, lens, margin) else {
            return;
        };
        let (scattered, back) = vertex.scatter(scene, sight.wi);
        if scattered.is_black() {
            return;
        }
        ledger.connect(Technique::Splat);
        let seen = scene.transmittance(&hit.spawn_to(&sight.end), passes);
        if seen == 0.0 {
            return;
        }
        // The density with which the camera would have met the vertex, relative to all walks of light.
        let cos = f64::from(hit.ng.dot(sight.wi).abs());
        let met = f64::from(sight.importance) * cos / self.walks;
        let merging = vertex.merging(techniques, false);
        let rivals = match techniques.emission {
            true => mis::power(met) * vertex.state.bracket(f64::from(back), merging),
            false => 0.0,
        };
        let weight = seen * sight.importance / ((1.0 + rivals) * self.walks) as f32;
        let value = vertex.power * scattered * weight;
        ledger.splats.push(Splat {
            film: sight.film,
            value,
        });
    }
}

impl EyeWalk<'_> {
    /// Light that arrives at `vertex` in all ways but by walking on, scattered towards the eye. `throughput`
    /// is for the books alone.
    pub fn join(&self, vertex: &EyeVertex, throughput: Rgb, u: &Drawn, ledger: &mut Ledger) -> Rgb {
        let mut sum = Rgb::BLACK;
        let mut add = |technique, lit: Rgb, ledger: &mut Ledger| {
            ledger.record(technique, throughput * lit);
            sum += lit;
        };
        let lit = self.next_event(vertex, u, ledger);
        add(Technique::NextEvent, lit, ledger);
        if self.techniques.connection {
            let mut lit = Rgb::BLACK;
            for (i, light) in self.light.iter().enumerate() {
                // A number of its own for each, as well spread as one number allows.
                let u = (u.roulette + i as f32 * GOLDEN_RATIO).fract();
                lit += self.connect(vertex, light, u, ledger);
            }
            add(Technique::Connection, lit, ledger);
        }
        let merges = self.techniques.merging(vertex.later) > 0.0;
        if let Some(photons) = self.photons.filter(|_| merges) {
            add(Technique::Merging, self.merge(vertex, photons), ledger);
        }
        sum
    }

    /// Light straight from an emitter.
    fn next_event(&self, vertex: &EyeVertex, u: &Drawn, ledger: &mut Ledger) -> Rgb {
        let scene = self.engine.setting.scene;
        let hit = &vertex.hit;
        let aim = &self.engine.aim;
        let sampled = scene.sample_light_both_ways(aim, hit, u.pick, u.light);
        let Some((light, emitted, prob)) = sampled else {
            return Rgb::BLACK;
        };
        let (f_cos, pdf, back) = vertex.eval(scene, light.wi);
        if f_cos.is_black() {
            return Rgb::BLACK;
        }
        ledger.connect(Technique::NextEvent);
        let passes = self.engine.max_depth - vertex.edges - 1;
        let seen = scene.transmittance(&light.shadow_ray(hit), passes);
        if seen == 0.0 {
            return Rgb::BLACK;
        }
        let dist2 = f64::from(light.dist).powi(2);
        let (met, connected) = match light.density {
            Density::Delta => (0.0, f64::from(prob)),
            Density::PerSr(density) => (
                mis::power(f64::from(pdf) / f64::from(density)),
                f64::from(density) * emitted.start_per_sr(dist2),
            ),
        };
        let cos = f64::from(hit.ng.dot(light.wi).abs());
        let walked = f64::from(emitted.start) * emitted.arrival(dist2, cos) / connected;
        // Light straight from an emitter is not merged.
        let ahead = vertex.state.sum_straight(f64::from(back)) / mis::power(vertex.state.pdf);
        let rivals = met + mis::power(walked) * ahead;
        f_cos * light.weight() * (seen / (1.0 + rivals) as f32)
    }

    /// Light that arrives from a vertex of light.
    fn connect(&self, vertex: &EyeVertex, light: &LightVertex, u: f32, ledger: &mut Ledger) -> Rgb {
        let scene = self.engine.setting.scene;
        let edges = vertex.edges + light.edges + 1;
        let Some(passes) = self.engine.max_depth.checked_sub(edges) else {
            return Rgb::BLACK;
        };
        let (hit, from) = (&vertex.hit, &light.hit);
        let Some((wi, dist2)) = direction(from.p - hit.p) else {
            return Rgb::BLACK;
        };
        let (f_cos, pdf, back) = vertex.eval(scene, wi);
        if f_cos.is_black() {
            return Rgb::BLACK;
        }
        let (scattered, light_back) = light.scatter(scene, -wi);
        if scattered.is_black() {
            return Rgb::BLACK;
        }
        let cos_here = f64::from(hit.ng.dot(wi).abs());
        let cos_there = f64::from(from.ng.dot(wi).abs());
        let (_, light_pdf) = light.shading.eval_pdf(-wi, Mode::Importance);
        let there = f64::from(pdf) * cos_there / dist2;
        let here = f64::from(light_pdf) * cos_here / dist2;
        let merging = light.merging(&self.techniques, true);
        let rivals = mis::power(there) * light.state.bracket(f64::from(light_back), merging)
            + mis::power(here)
                * vertex
                    .state
                    .bracket(f64::from(back), self.techniques.merging(vertex.later));
        // What other techniques find better is not worth a ray each time.
        let weight = 1.0 / (1.0 + rivals);
        let survival = (weight / WORTH_A_RAY).min(1.0);
        if f64::from(u) >= survival {
            return Rgb::BLACK;
        }
        let end = Endpoint {
            p: from.p,
            p_err: from.p_err,
            ng: from.ng,
        };
        ledger.connect(Technique::Connection);
        let seen = scene.transmittance(&hit.spawn_to(&end), passes);
        if seen == 0.0 {
            return Rgb::BLACK;
        }
        let weight = f64::from(seen) * weight / (survival * dist2);
        f_cos * light.power * scattered * weight as f32
    }

    /// Light of the photons around `vertex`.
    fn merge(&self, vertex: &EyeVertex, photons: &Photons) -> Rgb {
        let (scene, hit) = (self.engine.setting.scene, &vertex.hit);
        let gather = Gather::new(&self.techniques, vertex);
        let most = self.engine.max_depth - vertex.edges;
        let mut sum = Rgb::BLACK;
        // The most common surface by a short way of its own: what depends on the eye's walk is the same for
        // all photons.
        if let Some((f, normal, back)) = vertex.shading.lambert() {
            let ahead = gather.ahead(vertex, back);
            photons.map.around(hit.p, |photon, offset, _| {
                let cos = normal.dot(photon.wi);
                if cos > 0.0 && photon.counts(photons, hit, offset, most) {
                    let weight = gather.weight(photon, cos * (1.0 / PI), ahead);
                    sum += photon.power * (cos * weight / photon.cos(hit));
                }
            });
            return sum * f * photons.density;
        }
        photons.map.around(hit.p, |photon, offset, _| {
            if photon.counts(photons, hit, offset, most) {
                let (f_cos, pdf, back) = vertex.eval(scene, photon.wi);
                if !f_cos.is_black() {
                    let weight = gather.weight(photon, pdf, gather.ahead(vertex, back));
                    sum += photon.power * f_cos * (weight / photon.cos(hit));
                }
            }
        });
        sum * photons.density
    }
}

/// What the weights of all photons at one vertex of the eye's walk share.
struct Gather {
    /// Power of the density of merging there over that of the walk behind it.
    here: f64,
    /// What turns a photon's weights, for an eye's walk that was not scattered before, into those of this.
    scale: f32,
}

impl Gather {
    fn new(techniques: &Techniques, vertex: &EyeVertex) -> Gather {
        let merging = techniques.merging(vertex.later);
        Gather {
            here: mis::power(vertex.state.pdf * merging),
            scale: mis::power(techniques.merging / merging) as f32,
        }
    }

    /// Sum of the techniques that cut the path on the eye's side, relative to merging here; `back` is the
    /// density with which light goes on to the eye.
    #[inline]
    fn ahead(&self, vertex: &EyeVertex, back: f32) -> f32 {
        ratio(vertex.state.sum(f64::from(back)), self.here)
    }

    /// Weight of merging with `photon`; `pdf` is the density with which the eye's walk goes on to where it
    /// came from.
    #[inline]
    fn weight(&self, photon: &Photon, pdf: f32, ahead: f32) -> f32 {
        let behind = (photon.cut + pdf * pdf * photon.reverse) * self.scale;
        1.0 / (1.0 + behind + ahead)
    }
}

//! The camera walk: unidirectional path tracing with next-event estimation.

use crate::bsdf::{Bsdf, BsdfSample, Density, Mode};
use crate::geom::{Hit, Ray};
use crate::material::Shading;
use crate::math::{Rgb, Vec2};
use crate::sampler::Sampler;
use crate::scene::Scene;

use super::{Connect, Drawn, Li, Mis, PathStats, VertexNumbers, direct_light};

/// Longest path, in path vertices after the camera, when none is asked for: longer ones are cut. Only a
/// closed scene of albedo 1 without Russian roulette gets here.
pub(super) const UNBOUNDED: u32 = 1 << 20;

/// Vertices whose numbers come from the sampler. After these a path depends on so many numbers that the
/// spread of a few of them no longer shows in the picture, and independent ones are cheaper.
pub(super) const SPREAD_VERTICES: u32 = 4;

/// Settings of the path tracer.
#[derive(Clone, Debug, PartialEq)]
pub struct PathSpec {
    /// Most edges of a path from eye to light; 1 sees emitters only, 2 adds direct light. `None`: no limit.
    pub max_depth: Option<u32>,
    /// Edges from which on Russian roulette may end a path.
    pub rr_depth: u32,
    /// Leave emitters black where the camera sees them directly.
    pub hide_emitters: bool,
}

impl Default for PathSpec {
    fn default() -> PathSpec {
        PathSpec {
            max_depth: None,
            rr_depth: 5,
            hide_emitters: false,
        }
    }
}

/// Settings of the direct-light integrator: the light and the BSDF are sampled this often per camera ray.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectSpec {
    pub emitter_samples: u32,
    pub bsdf_samples: u32,
    pub hide_emitters: bool,
}

/// The last vertex of the walk and how the direction away from it was chosen: what MIS needs when that
/// direction meets an emitter.
#[derive(Clone, Copy)]
pub(super) struct Departure {
    pub from: Hit,
    pub density: Density,
    /// Light samples per BSDF sample at that vertex.
    pub light_per_bsdf: f32,
}

impl Departure {
    fn weight(&self, light_pdf: impl FnOnce() -> f32) -> f32 {
        match self.density {
            Density::Delta => 1.0,
            _ if self.light_per_bsdf == 0.0 => 1.0,
            density => density.mis_weight(light_pdf() * self.light_per_bsdf),
        }
    }
}

/// Radiance emitted towards the walk by what `ray` met, weighted against next-event estimation.
#[inline]
pub(super) fn emission(
    scene: &Scene,
    ray: &Ray,
    met: Option<&Hit>,
    departure: Option<&Departure>,
) -> Rgb {
    let le = match met {
        Some(hit) => scene.le(hit),
        None => scene.le_escaped(ray.d),
    };
    match departure {
        Some(departure) if !le.is_black() => {
            le * departure.weight(|| match met {
                Some(hit) => scene.pdf_light(&departure.from, hit),
                None => scene.pdf_light_escaped(&departure.from, ray.d),
            })
        }
        _ => le,
    }
}

/// The first surface that the camera sees along `ray`. Hidden emitters are not there for the camera: it
/// sees through them.
#[inline]
pub(super) fn first_seen(
    scene: &Scene,
    mut ray: Ray,
    hide_emitters: bool,
    stats: &mut PathStats,
) -> Option<Hit> {
    loop {
        stats.camera += 1;
        let hit = scene.intersect(&ray)?;
        if !(hide_emitters && scene.is_emitter(hit.shape)) {
            return Some(hit);
        }
        let t_max = ray.t_max - hit.p.distance(ray.o);
        ray = Ray {
            t_max,
            ..hit.spawn(ray.d)
        };
    }
}

/// What a walk has found out about light at a vertex by other means than its own.
pub(super) enum Gathered {
    /// Nothing: the walk alone finds light.
    Nothing,
    /// Radiance that leaves towards the walk, beside what the walk finds itself.
    Also(Rgb),
    /// All radiance that lobes other than delta ones send towards the walk: delta lobes alone lead on.
    Instead(Rgb),
    /// Of it, what does not come straight from an emitter. The walk samples emitters, and then delta lobes alone lead
    /// on.
    Reflected(Rgb),
    /// All radiance that the diffuse lobe sends towards the walk: the others lead on.
    Diffuse(Rgb),
}

/// A vertex of the walk with a lobe that is not a delta one.
pub(super) struct Vertex<'a> {
    pub hit: &'a Hit,
    pub shading: &'a Shading,
    /// From the camera to here.
    pub edges: u32,
    /// Numbers of the walk; those of this vertex are the block of number `edges - 1`.
    pub sampler: &'a Sampler,
    /// What the radiance that leaves here counts for in the picture.
    pub throughput: Rgb,
}

/// What a walk gathers at its vertices.
pub(super) trait Gather {
    /// Whether caustics are found by other means: light that delta lobes alone bring from an emitter to a
    /// vertex with another lobe. The walk then leaves them out.
    const TAKES_CAUSTICS: bool;

    /// Whether the walk leaves out what it finds by itself, to show what is gathered alone.
    #[inline]
    fn alone(&self) -> bool {
        false
    }

    fn at(&mut self, vertex: &Vertex, stats: &mut PathStats) -> Gathered;

    /// Share of the samples of [`Gather::scatter`] at `vertex` that come from the BSDF, as far as directions to
    /// emitters are concerned.
    #[inline]
    fn bsdf_share(&mut self, _vertex: &Vertex) -> f32 {
        1.0
    }

    /// How the walk goes on from `vertex`; `None` where it ends.
    #[inline]
    fn scatter(
        &mut self,
        vertex: &Vertex,
        u_lobe: f32,
        u: Vec2,
        _stats: &mut PathStats,
    ) -> Option<Onward> {
        let sample = vertex.shading.sample(u_lobe, u, Mode::Radiance)?;
        Some(Onward { sample, met: None })
    }

    /// Whether [`Gather::survival`] may end a walk before roulette is played by default.
    const ENDS_EARLY: bool = false;

    /// Probability, greater than 0, that the walk goes on along an edge that was chosen: `throughput` is what the
    /// radiance along it counts for, `eta2` the squared relative index of refraction that it came through, `met`
    /// what it meets, where that is known. `played`: by default it is played, after so many edges.
    #[inline]
    fn survival(
        &mut self,
        throughput: Rgb,
        eta2: f32,
        _met: Option<&Option<Hit>>,
        played: Option<u32>,
    ) -> f32 {
        played.map_or(1.0, |edges| survival(throughput, eta2, edges))
    }
}

/// Probability that roulette lets a walk go on after `edges` edges: what it counts for, but never more than a bound
/// below 1, without which walks between perfect mirrors would not end.
///
/// A constant bound p would give albedos a with a² > p infinite variance, since the weight of walks that go on would grow
/// by a / p each time. With this one, n edges are passed with a probability that falls as 1/n², so walks are of finite
/// length in the mean, and for every a < 1 the sum over n of a²ⁿ over that probability is finite, too.
#[inline]
pub(super) fn survival(throughput: Rgb, eta2: f32, edges: u32) -> f32 {
    /// Edges after which the bound is far on its way to 1: it begins at 0.95.
    const LONG: f32 = 40.0;
    let bound = 1.0 - 2.0 / (edges as f32 + LONG);
    (throughput.max_component() * eta2).min(bound)
}

/// The next edge of a walk.
pub(super) struct Onward {
    /// Its density is that of the BSDF times [`Gather::bsdf_share`]: what counts where it meets an emitter. The
    /// weight is by the density of all ways to find it.
    pub sample: BsdfSample,
    /// What it meets (`Some(None)`: nothing), where that was found out on the way.
    pub met: Option<Option<Hit>>,
}

/// No other means than the walk itself.
pub(super) struct WalkOnly;

impl Gather for WalkOnly {
    const TAKES_CAUSTICS: bool = false;

    #[inline]
    fn at(&mut self, _: &Vertex, _: &mut PathStats) -> Gathered {
        Gathered::Nothing
    }
}

/// Where a walk begins.
pub(super) struct Start {
    pub ray: Ray,
    /// Edges before.
    pub edges: u32,
    pub throughput: Rgb,
    /// Squared relative index of refraction that it comes through.
    pub eta2: f32,
    /// The vertex that `ray` leaves; `None` for the camera.
    pub departure: Option<Departure>,
}

impl Start {
    pub fn at_camera(ray: Ray) -> Start {
        Start {
            ray,
            edges: 0,
            throughput: Rgb::WHITE,
            eta2: 1.0,
            departure: None,
        }
    }
}

impl PathSpec {
    /// One sample of the radiance along `ray` (Kajiya 1986; MIS as Veach 1997, section 10.3.1).
    pub fn li(&self, scene: &Scene, ray: Ray, sampler: &Sampler, stats: &mut PathStats) -> Li {
        self.walk(scene, Start::at_camera(ray), sampler, stats, &mut WalkOnly)
    }

    /// The same from `start` on, and with what `gather` adds.
    #[inline]
    pub(super) fn walk<G: Gather>(
        &self,
        scene: &Scene,
        start: Start,
        sampler: &Sampler,
        stats: &mut PathStats,
        gather: &mut G,
    ) -> Li {
        let max_depth = self.max_depth.unwrap_or(UNBOUNDED);
        let mut ray = start.ray;
        let (mut lo, mut throughput) = (Rgb::BLACK, start.throughput);
        let mut seen = false;
        // Whether the walk is still the camera's straight look: through masks and panes, but not scattered.
        // Hidden emitters are hidden from that look alone.
        let mut straight = start.departure.is_none();
        // Product of the squared relative indices of refraction: takes the compression of radiance in a
        // dense medium out of the roulette's decision.
        let mut eta2 = start.eta2;
        // Whether a lobe other than a delta one has scattered the walk.
        let mut spread = start.departure.is_some_and(|d| d.density != Density::Delta);
        let mut last = start.departure;
        let mut known = None;
        for depth in start.edges..max_depth {
            let met = match known.take() {
                Some(met) => met,
                None if straight => first_seen(scene, ray, self.hide_emitters, stats),
                None => scene.intersect(&ray),
            };
            let caustic = G::TAKES_CAUSTICS
                && spread
                && last
                    .as_ref()
                    .is_some_and(|last| last.density == Density::Delta);
            if !(straight && self.hide_emitters || caustic || gather.alone()) {
                let le = emission(scene, &ray, met.as_ref(), last.as_ref());
                seen |= straight && !le.is_black();
                lo += throughput * le;
            }
            let Some(hit) = met else {
                break;
            };
            if depth + 1 >= max_depth {
                break;
            }
            let roulette = depth + 1 >= self.rr_depth;
            let sampler = match depth < SPREAD_VERTICES {
                true => *sampler,
                false => sampler.independent(),
            };
            let mut numbers = VertexNumbers::new(&sampler, depth);
            let mut shading = scene.shade(&hit, numbers.material(scene));
            if let Bsdf::Null(passed) = shading.bsdf {
                // The surface is not there, but counts as an edge: what is chosen at the last vertex is
                // still under way.
                throughput *= passed.transmittance;
                ray = hit.spawn(ray.d);
                stats.indirect += 1;
                continue;
            }
            let pane = matches!(shading.bsdf, Bsdf::ThinDielectric(_));
            if !pane {
                straight = false;
                seen = true;
            }
            let any_choice =
                roulette || G::ENDS_EARLY || scene.lights_are_chosen() || shading.bsdf.has_lobes();
            let u = numbers.draw(any_choice);
            let mut settled = false;
            let lit = !shading.bsdf.is_delta() && scene.has_lights();
            if lit {
                let vertex = Vertex {
                    hit: &hit,
                    shading: &shading,
                    edges: depth + 1,
                    sampler: &sampler,
                    throughput,
                };
                let (found, left) = light_at(scene, &vertex, gather, &u, max_depth, stats);
                lo += throughput * found;
                match left {
                    Left::All => {}
                    Left::Delta => settled = true,
                    Left::Others(others) => shading = others,
                    Left::Nothing => break,
                }
            }
            let vertex = Vertex {
                hit: &hit,
                shading: &shading,
                edges: depth + 1,
                sampler: &sampler,
                throughput,
            };
            // The last edge could only meet an emitter.
            if depth + 2 >= max_depth && !scene.emitters_can_be_met() {
                break;
            }
            let onward = match lit && !settled {
                true => gather.scatter(&vertex, u.lobe, u.direction, stats),
                false => shading
                    .sample(u.lobe, u.direction, Mode::Radiance)
                    .map(|sample| Onward { sample, met: None }),
            };
            let Some(Onward { sample, met }) = onward else {
                break;
            };
            if sample.density != Density::Delta {
                if settled {
                    break;
                }
                spread = true;
            }
            // A pane reflects or lets pass.
            if pane && sample.wi.dot(hit.ng) * hit.wo.dot(hit.ng) > 0.0 {
                straight = false;
                seen = true;
            }
            throughput *= sample.weight;
            eta2 *= sample.eta * sample.eta;
            if roulette || G::ENDS_EARLY {
                let played = roulette.then_some(depth);
                let survival = gather.survival(throughput, eta2, met.as_ref(), played);
                if u.roulette >= survival {
                    break;
                }
                throughput *= 1.0 / survival;
            }
            if throughput.is_black() {
                break;
            }
            ray = hit.spawn(sample.wi);
            known = met;
            stats.indirect += 1;
            last = Some(Departure {
                from: hit,
                density: sample.density,
                light_per_bsdf: 1.0,
            });
        }
        Li { radiance: lo, seen }
    }
}

/// The lobes of a vertex that lead a walk on.
enum Left {
    All,
    Delta,
    Others(Shading),
    Nothing,
}

/// Radiance that leaves a vertex by what is gathered there and by a connection to an emitter, and what leads on.
#[inline]
fn light_at<G: Gather>(
    scene: &Scene,
    vertex: &Vertex,
    gather: &mut G,
    u: &Drawn,
    max_depth: u32,
    stats: &mut PathStats,
) -> (Rgb, Left) {
    let mut mis = Mis::Power {
        bsdf_per_light: gather.bsdf_share(vertex),
    };
    let (gathered, left) = match gather.at(vertex, stats) {
        Gathered::Nothing => (Rgb::BLACK, Left::All),
        Gathered::Also(found) => (found, Left::All),
        Gathered::Instead(found) => return (found, Left::Delta),
        Gathered::Reflected(found) => {
            // No walk will meet the emitter instead.
            mis = Mis::LightOnly;
            (found, Left::Delta)
        }
        Gathered::Diffuse(found) => match vertex.shading.without_diffuse() {
            Some(others) => (found, Left::Others(others)),
            None => return (found, Left::Nothing),
        },
    };
    if gather.alone() {
        return (gathered, left);
    }
    let shading = match &left {
        Left::Others(others) => others,
        _ => vertex.shading,
    };
    let connect = Connect {
        mis,
        passes: max_depth - vertex.edges - 1,
    };
    let hit = vertex.hit;
    let direct = direct_light(scene, hit, shading, connect, u.pick, u.light, stats);
    (gathered + direct, left)
}

impl DirectSpec {
    /// One sample of the emission seen and of the direct light reflected along `ray`.
    pub fn li(&self, scene: &Scene, ray: Ray, sampler: &Sampler, stats: &mut PathStats) -> Li {
        let met = first_seen(scene, ray, self.hide_emitters, stats);
        let mut lo = Rgb::BLACK;
        if !self.hide_emitters {
            lo += emission(scene, &ray, met.as_ref(), None);
        }
        let Some(hit) = met else {
            let seen = !lo.is_black();
            return Li { radiance: lo, seen };
        };
        let shading = scene.shade(&hit, VertexNumbers::new(sampler, 0).material(scene));
        let passed = matches!(shading.bsdf, Bsdf::Null(_));
        let seen = !passed || !lo.is_black();
        let (n_light, n_bsdf) = (self.emitter_samples as f32, self.bsdf_samples as f32);
        if !shading.bsdf.is_delta() && scene.has_lights() {
            let mis = match self.bsdf_samples {
                0 => Mis::LightOnly,
                _ => Mis::Power {
                    bsdf_per_light: n_bsdf / n_light,
                },
            };
            let connect = Connect { mis, passes: 0 };
            for i in 0..self.emitter_samples {
                let u = VertexNumbers::new(sampler, i).draw(scene.lights_are_chosen());
                let lit = direct_light(scene, &hit, &shading, connect, u.pick, u.light, stats);
                lo += lit * (1.0 / n_light);
            }
        }
        if !scene.emitters_can_be_met() {
            return Li { radiance: lo, seen };
        }
        for i in 0..self.bsdf_samples {
            let u = VertexNumbers::new(sampler, i).draw(shading.bsdf.has_lobes());
            let Some(sample) = shading.sample(u.lobe, u.direction, Mode::Radiance) else {
                continue;
            };
            let ray = hit.spawn(sample.wi);
            stats.indirect += 1;
            let departure = Departure {
                from: hit,
                density: sample.density,
                light_per_bsdf: n_light / n_bsdf,
            };
            let met = scene.intersect(&ray);
            lo += sample.weight
                * emission(scene, &ray, met.as_ref(), Some(&departure))
                * (1.0 / n_bsdf);
        }
        Li { radiance: lo, seen }
    }
}

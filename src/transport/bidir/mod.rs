//! Bidirectional transport: light subpaths, eye subpaths, and all ways to join them.
//!
//! One walk of light and one walk of the eye serve bidirectional path tracing (Veach 1997, chapter 10), light
//! tracing, progressive photon mapping and their union, vertex connection and merging (Georgiev et al. 2012):
//! they differ in the [`Techniques`] that are switched on. Light that comes straight from an emitter is never
//! merged, and splatted by light tracing alone: connecting to the emitter finds it without bias and with less
//! noise.

mod eye;
mod join;

use super::light_walk::{LightVertex, LightWalk};
use super::mis::Techniques;
use super::path::UNBOUNDED;
use super::photons::{self, Kernel, KernelShape, PhotonMap, Shoot};
use super::{Iteration, Ledger, Li, PhotonSpec, Setting, Technique};
use crate::geom::Ray;
use crate::light::Aim;
use crate::math::PI;
use crate::sampler::Sampler;
use crate::scene::{CameraSample, PlanEntry, Scene};
use join::Photon;

/// Which techniques are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Bidirectional path tracing.
    Bdpt,
    /// Light tracing: light alone walks, and is connected to the camera.
    Ptracer,
    /// Vertex connection and merging.
    Vcm,
    /// Stochastic progressive photon mapping: photons of light that was scattered are merged where the eye's
    /// walk first scatters by other lobes than delta ones, and in scenes with glossy surfaces, at less
    /// weight, behind that too. The rest is sampled as a path tracer does, each by its weight.
    Sppm,
}

impl Method {
    pub fn name(self) -> &'static str {
        match self {
            Method::Bdpt => "bdpt",
            Method::Ptracer => "ptracer",
            Method::Vcm => "vcm",
            Method::Sppm => "sppm",
        }
    }

    /// The techniques that are weighted against each other, or add up.
    pub fn techniques(self) -> &'static [Technique] {
        use Technique::{Connection, Emission, Merging, NextEvent, Splat};
        match self {
            Method::Bdpt => &[Emission, NextEvent, Connection, Splat],
            Method::Ptracer => &[Emission, Splat],
            Method::Vcm => &[Emission, NextEvent, Connection, Splat, Merging],
            Method::Sppm => &[Emission, NextEvent, Merging],
        }
    }

    /// Whether photons are gathered, which is biased.
    pub fn merges(self) -> bool {
        matches!(self, Method::Vcm | Method::Sppm)
    }
}

/// Settings of bidirectional methods.
#[derive(Clone, Debug, PartialEq)]
pub struct BidirSpec {
    pub method: Method,
    /// Most edges of a path; `None`: no limit.
    pub max_depth: Option<u32>,
    /// Edges from which on Russian roulette may end the eye's walk.
    pub rr_depth: u32,
    pub hide_emitters: bool,
    /// Whether walks of light are connected to the camera, by methods that know other ways to it. Without, what
    /// only they find is lost: the caustics of point lights.
    pub light_image: bool,
    pub photons: PhotonSpec,
}

impl BidirSpec {
    /// What of `scene` is never found, and why.
    pub fn plan(&self, scene: &Scene) -> PlanEntry {
        let specular = scene.throws_caustics().is_ok();
        let (decision, reason) = match self.method {
            Method::Ptracer if specular => (
                "what is seen in mirrors and through glass stays dark",
                "light alone walks, and no light walk ends in a camera by chance",
            ),
            Method::Bdpt if specular => (
                "caustics of points and beams stay dark where they are seen in mirrors or through glass",
                "no vertex is left to connect walks from both ends at",
            ),
            _ => (
                "all are found",
                "walks from both ends meet wherever light is scattered",
            ),
        };
        PlanEntry {
            subject: "light paths",
            decision: decision.to_string(),
            reason: reason.to_string(),
        }
    }
}

/// The photons of one iteration.
pub struct Photons {
    map: PhotonMap<Photon>,
    kernel: Kernel,
    /// One over the number of walks that made the photons and the area that they are gathered from.
    density: f32,
    techniques: Techniques,
}

/// A bidirectional method at work.
pub struct Engine<'a> {
    spec: &'a BidirSpec,
    setting: Setting<'a>,
    aim: Aim,
    max_depth: u32,
    /// Without merging.
    techniques: Techniques,
    /// Walks from lights that are connected to the camera, per iteration.
    walks: f64,
    photons: u64,
    radius: f32,
}

impl<'a> Engine<'a> {
    pub fn new(spec: &'a BidirSpec, setting: Setting<'a>) -> Engine<'a> {
        let crop = setting.film.crop;
        let pixels = u64::from(crop.width) * u64::from(crop.height);
        let walks = pixels as f64;
        let splats = match spec.method {
            Method::Sppm => 0.0,
            Method::Bdpt | Method::Vcm if !spec.light_image => 0.0,
            _ if setting.camera.can_be_connected() => walks,
            _ => 0.0,
        };
        let both = matches!(spec.method, Method::Bdpt | Method::Vcm);
        let techniques = Techniques {
            emission: spec.method != Method::Ptracer,
            next_event: spec.method != Method::Ptracer,
            connection: both,
            splats,
            merging: 0.0,
            later: match setting.scene.is_glossy() {
                true => LATER,
                false => 0.0,
            },
        };
        let radius = match spec.photons.radius {
            _ if !spec.method.merges() => 0.0,
            Some(radius) => radius,
            None => RADIUS_IN_PIXELS * photons::footprint(&setting),
        };
        Engine {
            spec,
            setting,
            aim: match setting.scene.aim_partly_at_caustics() {
                aim if aim.share > AIM_PAYS => aim,
                _ => Aim::default(),
            },
            max_depth: spec.max_depth.unwrap_or(UNBOUNDED),
            techniques,
            walks,
            photons: spec.photons.count.unwrap_or(pixels).max(1),
            radius,
        }
    }

    /// The walk that light takes, with the techniques that its weights know.
    fn light_walk(&self, techniques: Techniques) -> LightWalk<'_> {
        LightWalk {
            scene: self.setting.scene,
            aim: &self.aim,
            techniques,
            // One edge is left for the eye.
            max_edges: self.max_depth.saturating_sub(1),
            specular_only: false,
        }
    }

    /// Of the disk that photons of iteration `number` are gathered from; 0 for methods that shoot none.
    pub fn radius(&self, number: u64) -> f32 {
        photons::reduced(self.radius, self.spec.photons.alpha, number)
    }

    /// With photons gathered from a disk of `radius`.
    fn techniques_within(&self, radius: f32) -> Techniques {
        let area = PI * radius * radius;
        Techniques {
            merging: self.photons as f64 * f64::from(area),
            ..self.techniques
        }
    }

    fn shoot(&self, number: u64, time: f32, techniques: Techniques) -> Shoot<'_> {
        Shoot {
            setting: self.setting,
            walk: self.light_walk(techniques),
            count: self.photons,
            iteration: number,
            time,
        }
    }

    /// What is kept of a vertex of light: nothing of light straight from an emitter, which is never merged.
    fn photon(&self, vertex: &LightVertex, techniques: &Techniques) -> Option<Photon> {
        (vertex.scattered > 0 && self.setting.scene.receives(&vertex.hit))
            .then(|| Photon::new(vertex, techniques.merging))
    }

    /// Whether the photons of an iteration fit into the memory that they may take; if not, what is wrong.
    pub fn fits(&self) -> Result<(), String> {
        if !self.spec.method.merges() {
            return Ok(());
        }
        let techniques = self.techniques_within(self.radius(0));
        let shoot = self.shoot(0, 0.0, techniques);
        shoot.check(self.spec.photons.memory, "photon_count", |vertex| {
            self.photon(vertex, &techniques)
        })
    }

    /// Begins an iteration: shoots its photons.
    pub fn begin(&self, number: u64, ledger: &mut Ledger) -> Iteration {
        if !self.spec.method.merges() {
            return Iteration::default();
        }
        let time = self.setting.common_time(number);
        let radius = self.radius(number);
        let techniques = self.techniques_within(radius);
        let (found, _) = self
            .shoot(number, time.unwrap_or(0.0), techniques)
            .trace(ledger, |vertex| self.photon(vertex, &techniques));
        Iteration {
            time,
            photons: Some(Photons {
                map: ledger.build_map(|| PhotonMap::new(found, radius)),
                kernel: Kernel::new(KernelShape::Uniform, radius),
                density: (1.0 / techniques.merging) as f32,
                techniques,
            }),
            ..Iteration::default()
        }
    }

    /// One sample of the radiance along `ray`; light for other pixels goes to the ledger.
    pub fn sample(
        &self,
        iteration: &Iteration,
        at: &CameraSample,
        ray: Ray,
        sampler: &Sampler,
        ledger: &mut Ledger,
    ) -> Li {
        let photons = iteration.photons.as_ref();
        let techniques = photons.map_or(self.techniques, |p| p.techniques);
        let mut light = std::mem::take(&mut ledger.light);
        light.clear();
        if techniques.splats > 0.0 || techniques.connection {
            self.light_subpath(techniques, at.time, &sampler.of_light(), ledger, &mut light);
        }
        let eye = eye::EyeWalk {
            engine: self,
            techniques,
            photons,
            light: &light,
        };
        let li = match self.spec.method {
            Method::Ptracer => eye.look(ray, ledger),
            _ => eye.walk(ray, sampler, ledger),
        };
        ledger.light = light;
        li
    }

    /// Light walks; what it meets is connected to the camera, and kept for the eye's walk.
    fn light_subpath(
        &self,
        techniques: Techniques,
        time: f32,
        sampler: &Sampler,
        ledger: &mut Ledger,
        kept: &mut Vec<LightVertex>,
    ) {
        let mut rays = std::mem::take(&mut ledger.rays);
        let lens = join::lens_numbers(sampler);
        self.light_walk(techniques)
            .walk(sampler, time, &mut rays, |vertex| {
                if vertex.shading.bsdf.is_delta() {
                    return true;
                }
                // Light straight from an emitter, next-event estimation finds with less noise.
                let straight = techniques.next_event && vertex.scattered == 0;
                if techniques.splats > 0.0 && !straight {
                    self.splat(&techniques, vertex, lens, ledger);
                }
                if techniques.connection {
                    kept.push(*vertex);
                }
                true
            });
        ledger.rays += rays;
    }
}

/// [`Techniques::later`] in a scene with glossy surfaces, behind which photons are worth gathering. Without, it
/// costs as much as it gains at equal numbers of samples (measured on a diffuse box with balls of glass and
/// gold: a third of the time, no change of the error).
const LATER: f64 = 0.1;

/// Share of [`Aim::around`] from which on, that is for small targets, aiming pays for the time that the
/// densities of both walks take. With balls that cover a seventh of a box it cost a third more time, and
/// brought nothing.
const AIM_PAYS: f32 = 0.45;

/// Radius of the first iteration's disk in pixels.
const RADIUS_IN_PIXELS: f32 = 3.0;

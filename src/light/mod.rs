//! Emitters, and the choice among them.
//!
//! [`Lights`] answers what direct lighting asks: a connection to some light with its density, the density
//! that a connection found by other means would have had, and what an emitter sends along a ray. It does
//! not know what blocks the way.

pub mod env;
mod local;
mod moving;
mod rectangle;
mod tree;

pub use env::{EnvError, EnvMap};

use crate::bsdf::Density;
use crate::geom::{Endpoint, Geometry, Hit, Ray, ShapeId, World};
use crate::math::fp::ONE_MINUS_EPSILON;
use crate::math::warp::{self, AliasTable};
use crate::math::{Aabb, Motion, PI, Rgb, Vec2, Vec3};
use local::Part;
use tree::{LightBounds, LightTree};

/// What shines.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// A surface, on the side of its shading normal. `radiance` in W/(m² sr).
    Area { shape: ShapeId, radiance: Rgb },
    /// A point, equally in all directions. `intensity` in W/sr.
    Point { p: Vec3, intensity: Rgb },
    /// All directions alike, from infinity.
    Constant { radiance: Rgb },
    /// An image, from infinity.
    Image(EnvMap),
}

/// Index of an emitter in the list given to [`Lights::new`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EmitterId(pub u32);

/// A connection to a light.
#[derive(Clone, Copy, Debug)]
pub struct EmitterSample {
    /// Unit direction from the receiver.
    pub wi: Vec3,
    /// Distance of the point; infinite for an environment.
    pub dist: f32,
    /// The point, unless it is at infinity.
    pub end: Option<Endpoint>,
    /// With a density per steradian: radiance along `wi` at the receiver. With [`Density::Delta`]:
    /// irradiance at right angles to `wi`, over the probability of the choice of this light.
    pub le: Rgb,
    /// Includes the probability of the choice of the light.
    pub density: Density,
    pub emitter: EmitterId,
}

impl EmitterSample {
    /// The estimate of incident radiance before the cosine and without MIS: `le` over the density.
    #[inline]
    pub fn weight(&self) -> Rgb {
        match self.density {
            Density::PerSr(pdf) => self.le / pdf,
            Density::Delta => self.le,
        }
    }

    /// The ray that is blocked if the light is in shadow.
    #[inline]
    pub fn shadow_ray(&self, from: &Hit) -> Ray {
        match &self.end {
            Some(end) => from.spawn_to(end),
            None => from.spawn(self.wi),
        }
    }
}

/// One thing to choose among the lights at finite distance.
#[derive(Clone, Copy, Debug)]
struct Item {
    emitter: u32,
    what: What,
    /// Of a surface that moves: its place among the motions.
    motion: Option<u32>,
}

#[derive(Clone, Copy, Debug)]
enum What {
    Part { part: Part, radiance: Rgb },
    Point { p: Vec3, intensity: Rgb },
}

/// How an item is chosen.
#[derive(Clone, Debug)]
enum Choice {
    One,
    Power(AliasTable),
    Tree(LightTree),
}

/// Which strategy chooses among the lights at finite distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// By power up to [`TREE_FROM`] items, by the tree from there on.
    #[default]
    Auto,
    Power,
    Tree,
}

/// From this many items on the tree pays for its descent. Measured by `tests/light.rs` on strewn lamps
/// without shadows: with 8 the variance falls by 2 at equal samples, by 1.25 at equal time; with 4 the
/// descent costs what it gains; with 64 it gains 2.9 and 1.4.
pub const TREE_FROM: usize = 8;

/// Share of a choice by power that goes to all items alike: power is blind to distance.
const UNIFORM_SHARE: f64 = 0.1;

/// All lights of a scene.
#[derive(Clone, Debug)]
pub struct Lights {
    emitters: Vec<Emitter>,
    items: Vec<Item>,
    choice: Choice,
    /// Emitters at infinity.
    infinite: Vec<u32>,
    /// By shape: its radiance and where its primitives stand in `item_of`.
    surfaces: Vec<Option<Surface>>,
    /// By emitting primitive: its item, or [`NO_ITEM`] for those without area.
    item_of: Vec<u32>,
    /// Of surfaces that move, from their own coordinates to the world.
    motions: Vec<Motion>,
}

#[derive(Clone, Copy, Debug)]
struct Surface {
    radiance: Rgb,
    first: u32,
}

const NO_ITEM: u32 = u32::MAX;

impl Lights {
    /// Emitters that are black or name a shape that is not there are left out.
    pub fn new(emitters: Vec<Emitter>, geoms: &[Geometry]) -> Lights {
        Lights::with_strategy(emitters, geoms, Strategy::Auto)
    }

    /// The same for the shapes of `world`, where an emitter may be in a group that one placement moves.
    pub fn in_world(emitters: Vec<Emitter>, world: &World) -> Lights {
        let motion = |shape| world.placement_of(shape).map(|p| p.motion.clone());
        Lights::build(emitters, world.geometries(), &motion, Strategy::Auto)
    }

    pub fn with_strategy(emitters: Vec<Emitter>, geoms: &[Geometry], strategy: Strategy) -> Lights {
        Lights::build(emitters, geoms, &|_| None, strategy)
    }

    fn build(
        emitters: Vec<Emitter>,
        geoms: &[Geometry],
        motion: &dyn Fn(ShapeId) -> Option<Motion>,
        strategy: Strategy,
    ) -> Lights {
        let mut lights = Lights {
            emitters: Vec::new(),
            items: Vec::new(),
            choice: Choice::One,
            infinite: Vec::new(),
            surfaces: vec![None; geoms.len()],
            item_of: Vec::new(),
            motions: Vec::new(),
        };
        let mut bounds = Vec::new();
        for (id, emitter) in emitters.iter().enumerate() {
            lights.add(id as u32, emitter, geoms, motion, &mut bounds);
        }
        lights.emitters = emitters;
        let tree = match strategy {
            Strategy::Auto => bounds.len() >= TREE_FROM,
            Strategy::Power => false,
            Strategy::Tree => true,
        };
        lights.choice = if bounds.len() < 2 {
            Choice::One
        } else if tree {
            Choice::Tree(LightTree::new(&bounds))
        } else {
            by_power(&bounds)
        };
        lights
    }

    fn add(
        &mut self,
        id: u32,
        emitter: &Emitter,
        geoms: &[Geometry],
        motion: &dyn Fn(ShapeId) -> Option<Motion>,
        bounds: &mut Vec<LightBounds>,
    ) {
        match *emitter {
            Emitter::Constant { radiance } if !radiance.is_black() => self.infinite.push(id),
            Emitter::Image(ref map) if map.integral() > 0.0 => self.infinite.push(id),
            Emitter::Point { p, intensity } if !intensity.is_black() => {
                let what = What::Point { p, intensity };
                self.items.push(Item {
                    emitter: id,
                    what,
                    motion: None,
                });
                bounds.push(LightBounds {
                    bounds: Aabb { min: p, max: p },
                    axis: Vec3::Z,
                    cos_spread: -1.0,
                    power: 4.0 * PI * intensity.luminance(),
                });
            }
            Emitter::Area { shape, radiance } if !radiance.is_black() => {
                let Some(g) = geoms.get(shape.0 as usize) else {
                    return;
                };
                let first = self.item_of.len() as u32;
                self.surfaces[shape.0 as usize] = Some(Surface { radiance, first });
                let motion = motion(shape).map(|motion| {
                    self.motions.push(motion);
                    self.motions.len() as u32 - 1
                });
                if let Geometry::Deforming(_) = g {
                    let prims = g.prim_count() as usize;
                    self.item_of.extend(std::iter::repeat_n(NO_ITEM, prims));
                }
                for part in local::parts_of(shape, g) {
                    let area = part.area(g);
                    let item = if area > 0.0 {
                        self.items.len() as u32
                    } else {
                        NO_ITEM
                    };
                    self.item_of.extend(part.prims().map(|_| item));
                    if area > 0.0 {
                        let what = What::Part { part, radiance };
                        self.items.push(Item {
                            emitter: id,
                            what,
                            motion,
                        });
                        let (b, axis, cos_spread) = part.bounds(g);
                        let power = PI as f64 * area * radiance.luminance() as f64;
                        let local = LightBounds {
                            bounds: b,
                            axis,
                            cos_spread,
                            power: power.min(f32::MAX as f64) as f32,
                        };
                        bounds.push(match motion {
                            Some(m) => moving::bounds(&self.motions[m as usize], local),
                            None => local,
                        });
                    }
                }
            }
            _ => {}
        }
    }

    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    pub fn is_empty(&self) -> bool {
        self.items.is_empty() && self.infinite.is_empty()
    }

    /// How many things there are to choose among: parts of surfaces, points, environments.
    pub fn len(&self) -> usize {
        self.items.len() + self.infinite.len()
    }

    /// What is done to choose among the lights, and why.
    pub fn choice(&self) -> (String, String) {
        let local = match &self.choice {
            _ if self.items.is_empty() => "no choice".to_string(),
            Choice::One => "no choice".to_string(),
            Choice::Power(_) => "by power".to_string(),
            Choice::Tree(_) => "by a light tree".to_string(),
        };
        let sky = match self.infinite.len() {
            0 => "",
            _ => ", the environment as often as all others together",
        };
        let count = match self.items.len() {
            1 => "there is 1 light at finite distance".to_string(),
            n => format!("there are {n} lights at finite distance"),
        };
        (
            if self.items.is_empty() {
                local
            } else {
                local + sky
            },
            count,
        )
    }

    pub fn is_emitter(&self, shape: ShapeId) -> bool {
        matches!(self.surfaces.get(shape.0 as usize), Some(Some(_)))
    }

    /// Radiance that the surface sends from `hit` towards `hit.wo`.
    #[inline]
    pub fn le(&self, hit: &Hit) -> Rgb {
        match self.surfaces.get(hit.shape.0 as usize) {
            Some(Some(s)) if hit.wo.dot(hit.frame.n) > 0.0 => s.radiance,
            _ => Rgb::BLACK,
        }
    }

    /// Radiance that arrives from infinity along `d`, which points away from the receiver.
    pub fn le_escaped(&self, d: Vec3) -> Rgb {
        self.infinite
            .iter()
            .map(|&i| self.radiance_from(i, d))
            .sum()
    }

    fn radiance_from(&self, emitter: u32, d: Vec3) -> Rgb {
        match &self.emitters[emitter as usize] {
            Emitter::Constant { radiance } => *radiance,
            Emitter::Image(map) => map.eval(d),
            _ => Rgb::BLACK,
        }
    }

    /// Probability of each light at infinity: all at finite distance together count as one of them.
    fn infinite_share(&self) -> f32 {
        1.0 / (self.infinite.len() + usize::from(!self.items.is_empty())).max(1) as f32
    }

    /// Probability that the lights at finite distance are chosen.
    fn local_share(&self) -> f32 {
        if self.infinite.is_empty() {
            1.0
        } else {
            self.infinite_share()
        }
    }

    /// A connection from `from` to one of the lights. `u_pick` and `u` in [0,1); `u_pick` is not used
    /// where there is but one light. `None` when the chosen light sends nothing here.
    #[inline]
    pub fn sample(
        &self,
        geoms: &[Geometry],
        from: &Hit,
        u_pick: f32,
        u: Vec2,
    ) -> Option<EmitterSample> {
        if self.infinite.is_empty() {
            return self.sample_local(geoms, from, u_pick, u, 1.0);
        }
        let share = self.infinite_share();
        let scaled = u_pick * (1.0 / share);
        let k = (scaled as usize).min(self.len() - 1);
        match self.infinite.get(k) {
            Some(&emitter) => self.sample_infinite(emitter, u, share),
            None => {
                let rest = (scaled - self.infinite.len() as f32).clamp(0.0, ONE_MINUS_EPSILON);
                self.sample_local(geoms, from, rest, u, share)
            }
        }
    }

    fn sample_infinite(&self, emitter: u32, u: Vec2, share: f32) -> Option<EmitterSample> {
        let (wi, le, pdf) = match &self.emitters[emitter as usize] {
            Emitter::Constant { radiance } => (
                warp::uniform_sphere(u),
                *radiance,
                warp::uniform_cone_pdf(2.0),
            ),
            Emitter::Image(map) => map.sample(u)?,
            _ => return None,
        };
        Some(EmitterSample {
            wi,
            dist: f32::INFINITY,
            end: None,
            le,
            density: Density::PerSr(pdf * share),
            emitter: EmitterId(emitter),
        })
    }

    #[inline]
    fn sample_local(
        &self,
        geoms: &[Geometry],
        from: &Hit,
        u_pick: f32,
        u: Vec2,
        share: f32,
    ) -> Option<EmitterSample> {
        let (index, prob) = self.pick(from, u_pick)?;
        let item = self.items.get(index)?;
        let emitter = EmitterId(item.emitter);
        let prob = prob * share;
        match item.what {
            What::Part { part, radiance } => {
                let g = geoms.get(part.shape().0 as usize)?;
                let s = match item.motion {
                    None => part.sample(g, from.p, u),
                    Some(m) => moving::sample(&part, g, self.motions.get(m as usize)?, from, u),
                }?;
                let pdf = s.pdf * prob;
                (pdf > 0.0).then_some(EmitterSample {
                    wi: s.wi,
                    dist: s.dist,
                    end: Some(s.end),
                    le: radiance,
                    density: Density::PerSr(pdf),
                    emitter,
                })
            }
            What::Point { p, intensity } => {
                let d = (p - from.p).as_dvec3();
                let wi = d.try_normalize()?.as_vec3();
                let le = intensity * (1.0 / (d.length_squared() * prob as f64)) as f32;
                le.is_finite().then_some(EmitterSample {
                    wi,
                    dist: d.length() as f32,
                    end: Some(Endpoint {
                        p,
                        p_err: Vec3::ZERO,
                        ng: Vec3::ZERO,
                    }),
                    le,
                    density: Density::Delta,
                    emitter,
                })
            }
        }
    }

    /// An item among the lights at finite distance and its probability.
    #[inline]
    fn pick(&self, from: &Hit, u: f32) -> Option<(usize, f32)> {
        match &self.choice {
            Choice::One => Some((0, 1.0)),
            Choice::Power(table) => {
                let pick = table.pick(u);
                Some((pick.index, pick.prob))
            }
            Choice::Tree(tree) => tree.sample(from, u),
        }
    }

    /// The light at finite distance that `u` in [0,1) chooses for `from`, numbered from 0 in the order of
    /// the emitters and, within one, of its primitives. `None` when none of them can send light here.
    pub fn choose(&self, from: &Hit, u: f32) -> Option<usize> {
        self.pick(from, u).map(|(index, _)| index)
    }

    /// Density per steradian at `from` with which [`Lights::sample`] connects to the point `met` of an
    /// emitting surface; 0 when it is none.
    pub fn pdf(&self, geoms: &[Geometry], from: &Hit, met: &Hit) -> f32 {
        let Some(Some(surface)) = self.surfaces.get(met.shape.0 as usize) else {
            return 0.0;
        };
        let index = self.item_of.get((surface.first + met.prim) as usize);
        let Some(&index) = index.filter(|&&i| i != NO_ITEM) else {
            return 0.0;
        };
        let item = &self.items[index as usize];
        let (What::Part { part, .. }, Some(g)) = (item.what, geoms.get(met.shape.0 as usize))
        else {
            return 0.0;
        };
        let prob = self.choice_prob(from, index as usize);
        let pdf = match item.motion.and_then(|m| self.motions.get(m as usize)) {
            None => part.pdf(g, from.p, met.p, met.ng),
            Some(motion) => moving::pdf(&part, g, motion, from, met),
        };
        prob * self.local_share() * pdf
    }

    /// Probability that [`Lights::choose`] gives `index`.
    pub fn choice_prob(&self, from: &Hit, index: usize) -> f32 {
        match &self.choice {
            Choice::One => 1.0,
            Choice::Power(table) => table.prob(index),
            Choice::Tree(tree) => tree.prob(from, index),
        }
    }

    /// Density per steradian at `from` with which [`Lights::sample`] returns the direction `d` to
    /// infinity.
    pub fn pdf_escaped(&self, _from: &Hit, d: Vec3) -> f32 {
        let pdf: f32 = self
            .infinite
            .iter()
            .map(|&i| match &self.emitters[i as usize] {
                Emitter::Image(map) => map.pdf(d),
                _ => warp::uniform_cone_pdf(2.0),
            })
            .sum();
        pdf * self.infinite_share()
    }
}

fn by_power(bounds: &[LightBounds]) -> Choice {
    let total: f64 = bounds.iter().map(|b| b.power as f64).sum();
    let n = bounds.len() as f64;
    let weights: Vec<f32> = bounds
        .iter()
        .map(|b| {
            let share = if total > 0.0 {
                b.power as f64 / total
            } else {
                0.0
            };
            ((1.0 - UNIFORM_SHARE) * share + UNIFORM_SHARE / n) as f32
        })
        .collect();
    // The weights are positive, so only more than the table holds can make it fail; the tree holds more.
    AliasTable::new(&weights).map_or_else(|| Choice::Tree(LightTree::new(bounds)), Choice::Power)
}

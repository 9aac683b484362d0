//! Emitters, and the choice among them.
//!
//! [`Lights`] answers what direct lighting asks: a connection to some light with its density, the density
//! that a connection found by other means would have had, and what an emitter sends along a ray. It does
//! not know what blocks the way.

mod beam;
mod choice;
mod collect;
pub mod env;
mod far;
mod local;
mod moving;
mod projector;
mod rectangle;
mod spot;
mod textured;
mod tree;

pub use choice::{Strategy, TREE_FROM};
pub use env::{EnvError, EnvMap};
pub use projector::{Projector, ProjectorSpec};
pub use spot::{Spot, SpotSpec};

pub(crate) use beam::has_feet;

use crate::bsdf::Density;
use crate::geom::{Endpoint, Geometry, Hit, Ray, ShapeId, World};
use crate::math::warp::{self, Tabulated2};
use crate::math::{Aabb, Motion, Rgb, Vec2, Vec3};
use crate::texture::{At, Texture};
use choice::Choice;
use far::Far;
use local::Part;
use moving::Moved;

/// What shines.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// A surface, on the side of its shading normal. `radiance` in W/(m² sr).
    Area { shape: ShapeId, radiance: Rgb },
    /// The same, varying over the surface.
    TexturedArea { shape: ShapeId, radiance: Texture },
    /// A surface along its shading normals only. `exitance` in W/m²: what a receiver before it gets.
    Beam { shape: ShapeId, exitance: Texture },
    /// A point, equally in all directions. `intensity` in W/sr.
    Point { p: Vec3, intensity: Rgb },
    /// A point, into a cone.
    Spot(Spot),
    /// A point, as a picture.
    Projector(Projector),
    /// From infinity along the unit vector `d`. `irradiance` in W/m² on what is at right angles to it.
    Directional { d: Vec3, irradiance: Rgb },
    /// All directions alike, from infinity.
    Constant { radiance: Rgb },
    /// An image, from infinity.
    Image(EnvMap),
}

impl Emitter {
    /// Whether a ray can run into it: not if it has no extent, or shines in single directions.
    pub fn can_be_met(&self) -> bool {
        match self {
            Emitter::Area { .. }
            | Emitter::TexturedArea { .. }
            | Emitter::Constant { .. }
            | Emitter::Image(_) => true,
            Emitter::Beam { .. }
            | Emitter::Point { .. }
            | Emitter::Spot(_)
            | Emitter::Projector(_)
            | Emitter::Directional { .. } => false,
        }
    }
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
}

#[derive(Clone, Copy, Debug)]
enum What {
    Part {
        part: Part,
        radiance: Rgb,
    },
    /// With a table of this number, if any.
    Textured {
        part: Part,
        table: Option<u32>,
    },
    Beam {
        part: Part,
    },
    /// A point, spot or projector.
    Point,
}

/// All lights of a scene.
#[derive(Clone, Debug)]
pub struct Lights {
    emitters: Vec<Emitter>,
    items: Vec<Item>,
    /// Of the textured parts.
    tables: Vec<Tabulated2>,
    choice: Choice,
    /// Emitters at infinity.
    far: Far,
    /// By shape: its radiance and where its primitives stand in `item_of`.
    surfaces: Vec<Option<Surface>>,
    /// By emitting primitive: its item, or [`NO_ITEM`] for those that no connection is made to.
    item_of: Vec<u32>,
    /// By shape: of surfaces that move, from their own coordinates to the world. Empty where none does.
    motions: Vec<Option<Motion>>,
}

#[derive(Clone, Copy, Debug)]
struct Surface {
    radiance: Radiance,
    first: u32,
}

/// What a ray that meets a surface sees.
#[derive(Clone, Copy, Debug)]
enum Radiance {
    Constant(Rgb),
    /// That of the emitter of this number.
    Textured(u32),
}

const NO_ITEM: u32 = u32::MAX;

impl Lights {
    /// Emitters that are black or name a shape that is not there are left out.
    pub fn new(emitters: Vec<Emitter>, geoms: &[Geometry]) -> Lights {
        Lights::with_strategy(emitters, geoms, Strategy::Auto)
    }

    pub fn with_strategy(emitters: Vec<Emitter>, geoms: &[Geometry], strategy: Strategy) -> Lights {
        Lights::build(emitters, geoms, Vec::new(), strategy)
    }

    /// The same for the shapes of `world`, where an emitter may be in a group that one placement moves.
    /// What changes its form shines, but no connection is made to it.
    pub fn in_world(emitters: Vec<Emitter>, world: &World, strategy: Strategy) -> Lights {
        let shapes = (0..world.geometries().len() as u32).map(ShapeId);
        let motions = match world.places() {
            [] => Vec::new(),
            _ => shapes
                .map(|shape| world.placement_of(shape).map(|p| p.motion.clone()))
                .collect(),
        };
        Lights::build(emitters, world.geometries(), motions, strategy)
    }

    fn build(
        emitters: Vec<Emitter>,
        geoms: &[Geometry],
        motions: Vec<Option<Motion>>,
        strategy: Strategy,
    ) -> Lights {
        let mut lights = Lights {
            emitters: Vec::new(),
            items: Vec::new(),
            tables: Vec::new(),
            choice: Choice::One,
            far: Far::default(),
            surfaces: vec![None; geoms.len()],
            item_of: Vec::new(),
            motions,
        };
        let mut bounds = Vec::new();
        let mut far = Vec::new();
        for (id, emitter) in emitters.iter().enumerate() {
            lights.add(id as u32, emitter, geoms, &mut bounds, &mut far);
        }
        if !far.is_empty() {
            let near = bounds.iter().map(|b| f64::from(b.power)).sum();
            let near = (!bounds.is_empty()).then_some(near);
            lights.far = Far::new(&emitters, far, near, radius(geoms));
        }
        lights.emitters = emitters;
        lights.choice = Choice::new(strategy, &bounds);
        lights
    }

    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    pub fn is_empty(&self) -> bool {
        self.items.is_empty() && self.far.emitters.is_empty()
    }

    /// How many things there are to choose among: parts of surfaces, points, lights at infinity.
    pub fn len(&self) -> usize {
        self.items.len() + self.far.emitters.len()
    }

    /// What is done to choose among the lights, and why.
    pub fn choice(&self) -> (String, String) {
        let decision = match (self.items.len(), self.far.emitters.len()) {
            (0, 0 | 1) => "no choice".to_string(),
            (0, _) => "among those at infinity by power".to_string(),
            (_, 0) => self.choice.describe().to_string(),
            _ => format!(
                "{}; between these and each one at infinity by power",
                self.choice.describe()
            ),
        };
        let count = match self.items.len() {
            1 => "there is 1 light at finite distance".to_string(),
            n => format!("there are {n} lights at finite distance"),
        };
        (decision, count)
    }

    pub fn is_emitter(&self, shape: ShapeId) -> bool {
        matches!(self.surfaces.get(shape.0 as usize), Some(Some(_)))
    }

    /// Radiance that the surface sends from `hit` towards `hit.wo`.
    #[inline]
    pub fn le(&self, hit: &Hit) -> Rgb {
        match self.surfaces.get(hit.shape.0 as usize) {
            Some(Some(s)) if hit.wo.dot(hit.frame.n) > 0.0 => match s.radiance {
                Radiance::Constant(radiance) => radiance,
                Radiance::Textured(emitter) => self.textured(emitter, &place_of(hit)),
            },
            _ => Rgb::BLACK,
        }
    }

    /// What an emitting surface sends at `at`.
    fn textured(&self, emitter: u32, at: &At) -> Rgb {
        match &self.emitters[emitter as usize] {
            Emitter::TexturedArea { radiance: c, .. } | Emitter::Beam { exitance: c, .. } => {
                c.eval(at)
            }
            _ => Rgb::BLACK,
        }
    }

    /// Radiance that arrives from infinity along `d`, which points away from the receiver.
    pub fn le_escaped(&self, d: Vec3) -> Rgb {
        self.far
            .emitters
            .iter()
            .map(|&i| match &self.emitters[i as usize] {
                Emitter::Constant { radiance } => *radiance,
                Emitter::Image(map) => map.eval(d),
                _ => Rgb::BLACK,
            })
            .sum()
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
        if self.far.emitters.is_empty() {
            return self.sample_near(geoms, from, u_pick, u, 1.0);
        }
        match self.far.pick(u_pick) {
            (Some(index), share, _) => self.sample_far(*self.far.emitters.get(index)?, u, share),
            (None, share, rest) => self.sample_near(geoms, from, rest, u, share),
        }
    }

    fn sample_far(&self, emitter: u32, u: Vec2, share: f32) -> Option<EmitterSample> {
        let per_sr = |pdf: f32| Density::PerSr(pdf * share);
        let (wi, le, density) = match &self.emitters[emitter as usize] {
            Emitter::Constant { radiance } => {
                let pdf = per_sr(warp::uniform_cone_pdf(2.0));
                (warp::uniform_sphere(u), *radiance, pdf)
            }
            Emitter::Image(map) => {
                let (wi, le, pdf) = map.sample(u)?;
                (wi, le, per_sr(pdf))
            }
            Emitter::Directional { d, irradiance } => (-*d, *irradiance / share, Density::Delta),
            _ => return None,
        };
        Some(EmitterSample {
            wi,
            dist: f32::INFINITY,
            end: None,
            le,
            density,
            emitter: EmitterId(emitter),
        })
    }

    #[inline]
    fn sample_near(
        &self,
        geoms: &[Geometry],
        from: &Hit,
        u_pick: f32,
        u: Vec2,
        share: f32,
    ) -> Option<EmitterSample> {
        let (index, prob) = self.choice.pick(from, u_pick)?;
        let item = self.items.get(index)?;
        let emitter = EmitterId(item.emitter);
        let prob = prob * share;
        // A surface that moves is seen from its own coordinates.
        let moved = self.moved(&item.what, from);
        let eye = moved.as_ref().map_or(from.p, |m| m.into(from.p));
        let (towards, le) = match item.what {
            What::Part { part, radiance } => {
                let g = geoms.get(part.shape().0 as usize)?;
                (part.sample(g, eye, u)?, radiance)
            }
            What::Textured { part, table } => {
                let g = geoms.get(part.shape().0 as usize)?;
                let (towards, at) = textured::sample(&part, g, self.table(table), eye, u)?;
                (towards, self.textured(item.emitter, &at))
            }
            // Beams do not move.
            What::Beam { .. } if moved.is_some() => return None,
            What::Beam { part } => {
                let g = geoms.get(part.shape().0 as usize)?;
                let foot = beam::foot(&part, g, from)?;
                let le = self.textured(item.emitter, &foot.at) * (foot.factor / prob);
                return delta(foot.wi, foot.dist, foot.end, le, emitter);
            }
            What::Point => return self.sample_point(item.emitter, from, prob),
        };
        let towards = match &moved {
            Some(moved) => moved.out(&towards, from.p)?,
            None => towards,
        };
        let pdf = towards.pdf * prob;
        (pdf > 0.0).then_some(EmitterSample {
            wi: towards.wi,
            dist: towards.dist,
            end: Some(towards.end),
            le,
            density: Density::PerSr(pdf),
            emitter,
        })
    }

    /// How the surface of an item stands at the time of `from`, if it moves.
    #[inline]
    fn moved(&self, what: &What, from: &Hit) -> Option<Moved> {
        if self.motions.is_empty() {
            return None;
        }
        match what {
            What::Part { part, .. } | What::Textured { part, .. } | What::Beam { part } => {
                Some(Moved::new(self.motion(part.shape())?, from.time))
            }
            What::Point => None,
        }
    }

    fn table(&self, index: Option<u32>) -> Option<&Tabulated2> {
        index.and_then(|i| self.tables.get(i as usize))
    }

    /// A connection to an emitter that stands at a point.
    fn sample_point(&self, emitter: u32, from: &Hit, prob: f32) -> Option<EmitterSample> {
        let light = self.emitters.get(emitter as usize)?;
        let p = match light {
            Emitter::Point { p, .. } => *p,
            Emitter::Spot(spot) => spot.position(),
            Emitter::Projector(projector) => projector.position(),
            _ => return None,
        };
        let d = (p - from.p).as_dvec3();
        let wi = d.try_normalize()?.as_vec3();
        let intensity = match light {
            Emitter::Point { intensity, .. } => *intensity,
            Emitter::Spot(spot) => spot.intensity(-wi),
            Emitter::Projector(projector) => projector.intensity(-wi),
            _ => return None,
        };
        let end = Endpoint {
            p,
            p_err: Vec3::ZERO,
            ng: Vec3::ZERO,
        };
        let le = intensity * (1.0 / (d.length_squared() * prob as f64)) as f32;
        delta(wi, d.length() as f32, end, le, EmitterId(emitter))
    }

    /// The light at finite distance that `u` in [0,1) chooses for `from`, numbered from 0 in the order of
    /// the emitters and, within one, of its primitives. `None` when none of them can send light here.
    pub fn choose(&self, from: &Hit, u: f32) -> Option<usize> {
        self.choice.pick(from, u).map(|(index, _)| index)
    }

    /// Probability that [`Lights::choose`] gives `index`.
    pub fn choice_prob(&self, from: &Hit, index: usize) -> f32 {
        self.choice.prob(from, index)
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
        let Some(g) = geoms.get(met.shape.0 as usize) else {
            return 0.0;
        };
        let what = &self.items[index as usize].what;
        let moved = self.moved(what, from);
        let (eye, p, ng) = match &moved {
            Some(m) => (m.into(from.p), m.into(met.p), m.normal_into(met.ng)),
            None => (from.p, met.p, met.ng),
        };
        let pdf = match *what {
            What::Part { part, .. } => part.pdf(g, eye, p, ng),
            What::Textured { part, table } => {
                let at = place_of(met);
                textured::pdf(&part, g, self.table(table), eye, (p, ng, &at))
            }
            What::Beam { .. } | What::Point => return 0.0,
        };
        let pdf = match &moved {
            Some(moved) => moved.pdf_out(pdf, p - eye),
            None => pdf,
        };
        let prob = self.choice.prob(from, index as usize);
        prob * self.far.near_share() * pdf
    }

    /// Density per steradian at `from` with which [`Lights::sample`] returns the direction `d` to
    /// infinity.
    pub fn pdf_escaped(&self, _from: &Hit, d: Vec3) -> f32 {
        let far = self.far.emitters.iter().enumerate();
        far.map(|(k, &i)| match &self.emitters[i as usize] {
            Emitter::Image(map) => map.pdf(d) * self.far.share(k),
            Emitter::Constant { .. } => warp::uniform_cone_pdf(2.0) * self.far.share(k),
            _ => 0.0,
        })
        .sum()
    }
}

/// A connection that only its own direction can make; `le` is irradiance over its probability.
fn delta(wi: Vec3, dist: f32, end: Endpoint, le: Rgb, emitter: EmitterId) -> Option<EmitterSample> {
    (le.is_finite() && !le.is_black()).then_some(EmitterSample {
        wi,
        dist,
        end: Some(end),
        le,
        density: Density::Delta,
        emitter,
    })
}

fn place_of(hit: &Hit) -> At {
    At {
        uv: hit.uv,
        prim: hit.prim,
        bary: hit.bary,
    }
}

/// Of a sphere around all shapes.
fn radius(geoms: &[Geometry]) -> f64 {
    let all = geoms.iter().fold(Aabb::EMPTY, |b, g| b.union(g.bounds()));
    match all.is_empty() {
        true => 0.0,
        false => 0.5 * all.diagonal().as_dvec3().length(),
    }
}

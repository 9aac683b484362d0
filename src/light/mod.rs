//! Emitters, and the choice among them.
//!
//! [`Lights`] answers what direct lighting asks: a connection to some light with its density, the density
//! that a connection found by other means would have had, and what an emitter sends along a ray. It does
//! not know what blocks the way.

mod beam;
mod build;
mod choice;
mod emission;
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
pub use emission::{Aim, Emission, EmissionNumbers, EmissionPdf, Source, Target};
pub use env::{EnvError, EnvMap};
pub use projector::{Projector, ProjectorSpec};
pub use spot::{Spot, SpotSpec};

pub(crate) use beam::has_feet;

use crate::bsdf::Density;
use crate::geom::{Endpoint, Geometry, Hit, Ray, ShapeId};
use crate::math::warp::{self, Tabulated2};
use crate::math::{Motion, Rgb, Vec2, Vec3};
use crate::texture::{At, Texture};
use choice::Choice;
use far::Far;
use local::{Part, Towards};

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

    /// Where it stands, if it has no extent.
    #[inline]
    pub fn standpoint(&self) -> Option<Vec3> {
        match self {
            Emitter::Point { p, .. } => Some(*p),
            Emitter::Spot(spot) => Some(spot.position()),
            Emitter::Projector(projector) => Some(projector.position()),
            _ => None,
        }
    }

    /// Of what has no extent, in W/sr along the unit vector `w`.
    #[inline]
    pub fn intensity(&self, w: Vec3) -> Rgb {
        match self {
            Emitter::Point { intensity, .. } => *intensity,
            Emitter::Spot(spot) => spot.intensity(w),
            Emitter::Projector(projector) => projector.intensity(w),
            _ => Rgb::BLACK,
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
    /// The same; light leaves by the table, connections need none.
    Beam {
        part: Part,
        table: Option<u32>,
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
    /// Where light starts.
    sources: emission::Sources,
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
            0 => "no light is at a finite distance".to_string(),
            1 => "there is 1 light at finite distance".to_string(),
            n => format!("there are {n} lights at finite distance"),
        };
        (decision, count)
    }

    pub fn is_emitter(&self, shape: ShapeId) -> bool {
        matches!(self.surfaces.get(shape.0 as usize), Some(Some(_)))
    }

    /// Whether the surface of `shape` shines with a texture.
    pub fn is_textured(&self, shape: ShapeId) -> bool {
        let surface = self.surfaces.get(shape.0 as usize);
        matches!(surface, Some(Some(s)) if matches!(s.radiance, Radiance::Textured(_)))
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
        self.sample_item(geoms, from, index, prob * share, u)
    }

    /// A connection to the item `index`, chosen with probability `prob`.
    #[inline]
    fn sample_item(
        &self,
        geoms: &[Geometry],
        from: &Hit,
        index: usize,
        prob: f32,
        u: Vec2,
    ) -> Option<EmitterSample> {
        let item = self.items.get(index)?;
        let emitter = EmitterId(item.emitter);
        if let Some(moved) = self.moved(&item.what, from) {
            return self.sample_moved(geoms, item, &moved, from.p, u, prob);
        }
        let (towards, le) = match item.what {
            What::Part { part, radiance } => {
                let g = geoms.get(part.shape().0 as usize)?;
                (part.sample(g, from.p, u)?, radiance)
            }
            What::Textured { part, table } => {
                let g = geoms.get(part.shape().0 as usize)?;
                let (towards, at) = textured::sample(&part, g, self.table(table), from.p, u)?;
                (towards, self.textured(item.emitter, &at))
            }
            What::Beam { part, .. } => {
                let g = geoms.get(part.shape().0 as usize)?;
                let foot = beam::foot(&part, g, from)?;
                let le = self.textured(item.emitter, &foot.at) * (foot.factor / prob);
                return delta(foot.wi, foot.dist, foot.end, le, emitter);
            }
            What::Point => return self.sample_point(item.emitter, from, prob),
        };
        connection(towards, le, prob, emitter)
    }

    fn table(&self, index: Option<u32>) -> Option<&Tabulated2> {
        index.and_then(|i| self.tables.get(i as usize))
    }

    /// A connection to an emitter that stands at a point.
    fn sample_point(&self, emitter: u32, from: &Hit, prob: f32) -> Option<EmitterSample> {
        let light = self.emitters.get(emitter as usize)?;
        let p = light.standpoint()?;
        let d = (p - from.p).as_dvec3();
        let wi = d.try_normalize()?.as_vec3();
        let end = Endpoint {
            p,
            p_err: Vec3::ZERO,
            ng: Vec3::ZERO,
        };
        let le = light.intensity(-wi) * (1.0 / (d.length_squared() * prob as f64)) as f32;
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
        let Some(index) = self.item_at(met) else {
            return 0.0;
        };
        let Some(g) = geoms.get(met.shape.0 as usize) else {
            return 0.0;
        };
        let what = &self.items[index].what;
        let pdf = match self.moved(what, from) {
            Some(moved) => self.pdf_moved(g, what, &moved, from.p, met),
            None => self.pdf_of(g, what, from.p, (met.p, met.ng, &place_of(met))),
        };
        let prob = self.choice.prob(from, index);
        prob * self.far.near_share() * pdf
    }

    /// The item whose surface a ray has met.
    #[inline]
    fn item_at(&self, met: &Hit) -> Option<usize> {
        let surface = self.surfaces.get(met.shape.0 as usize)?.as_ref()?;
        let index = *self.item_of.get((surface.first + met.prim) as usize)?;
        (index != NO_ITEM).then_some(index as usize)
    }

    /// Density per steradian at `eye` of the point `met` of an item: where it is, its normal and place.
    #[inline]
    fn pdf_of(&self, g: &Geometry, what: &What, eye: Vec3, met: (Vec3, Vec3, &At)) -> f32 {
        match *what {
            What::Part { part, .. } => part.pdf(g, eye, met.0, met.1),
            What::Textured { part, table } => textured::pdf(&part, g, self.table(table), eye, met),
            What::Beam { .. } | What::Point => 0.0,
        }
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

/// A connection to a point of a surface, chosen with probability `prob`.
#[inline]
fn connection(towards: Towards, le: Rgb, prob: f32, emitter: EmitterId) -> Option<EmitterSample> {
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

/// The place of a hit, as textures see it.
fn place_of(hit: &Hit) -> At {
    At {
        uv: hit.uv,
        prim: hit.prim,
        bary: hit.bary,
    }
}

//! From a list of emitters to the lights of a scene.

use super::choice::{Choice, Strategy};
use super::emission::{Cover, Sources};
use super::far::Far;
use super::local::{self, Part};
use super::tree::LightBounds;
use super::{Emitter, Item, Lights, NO_ITEM, Radiance, Surface, What};
use super::{moving, textured};
use crate::geom::{Geometry, PlaceId, ShapeId, World};
use crate::math::warp::Tabulated2;
use crate::math::{Aabb, Motion, PI, Rgb, Vec3};

/// By shape, where it stands: empty where all stand as they are.
#[derive(Default)]
struct Standing {
    motions: Vec<Option<Motion>>,
    places: Vec<PlaceId>,
}

impl Lights {
    /// Emitters that are black or name a shape that is not there are left out.
    pub fn new(emitters: Vec<Emitter>, geoms: &[Geometry]) -> Lights {
        Lights::with_strategy(emitters, geoms, Strategy::Auto)
    }

    pub fn with_strategy(emitters: Vec<Emitter>, geoms: &[Geometry], strategy: Strategy) -> Lights {
        let still = Standing::default();
        Lights::build(emitters, geoms, still, &all(geoms), strategy)
    }

    /// The same for the shapes of `world`, where an emitter may be in a group that one placement moves.
    /// What changes its form shines, but no connection is made to it.
    pub fn in_world(emitters: Vec<Emitter>, world: &World, strategy: Strategy) -> Lights {
        let shapes = || (0..world.geometries().len() as u32).map(ShapeId);
        let geoms = world.geometries();
        if world.places().is_empty() {
            return Lights::with_strategy(emitters, geoms, strategy);
        }
        let motion = |shape| world.placement_of(shape).map(|p| p.motion.clone());
        let standing = Standing {
            motions: shapes().map(motion).collect(),
            places: shapes().map(|shape| world.place_of(shape)).collect(),
        };
        Lights::build(emitters, geoms, standing, &world.bounds(), strategy)
    }

    fn build(
        emitters: Vec<Emitter>,
        geoms: &[Geometry],
        standing: Standing,
        around: &Aabb,
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
            motions: standing.motions,
            sources: Sources::default(),
        };
        let mut bounds = Vec::new();
        let mut far = Vec::new();
        for (id, emitter) in emitters.iter().enumerate() {
            lights.add(id as u32, emitter, geoms, &mut bounds, &mut far);
        }
        if !far.is_empty() {
            let near = bounds.iter().map(|b| f64::from(b.power)).sum();
            let near = (!bounds.is_empty()).then_some(near);
            lights.far = Far::new(&emitters, far, near, radius_of(around));
        }
        lights.emitters = emitters;
        lights.choice = Choice::new(strategy, &bounds);
        let powers = bounds.iter().map(|b| b.power);
        lights.sources = Sources::new(&lights, powers, standing.places, Cover::new(around));
        lights
    }

    fn add(
        &mut self,
        id: u32,
        emitter: &Emitter,
        geoms: &[Geometry],
        bounds: &mut Vec<LightBounds>,
        far: &mut Vec<u32>,
    ) {
        match emitter {
            Emitter::Constant { radiance: c } | Emitter::Directional { irradiance: c, .. } => {
                if !c.is_black() {
                    far.push(id);
                }
            }
            Emitter::Image(map) => {
                if map.integral() > 0.0 {
                    far.push(id);
                }
            }
            Emitter::Point { p, intensity } => {
                let all_around = LightBounds {
                    bounds: Aabb { min: *p, max: *p },
                    axis: Vec3::Z,
                    cos_spread: -1.0,
                    cos_reach: -1.0,
                    power: 4.0 * PI * intensity.luminance(),
                };
                self.add_point(id, all_around, bounds);
            }
            Emitter::Spot(spot) => self.add_point(id, spot.bounds(), bounds),
            Emitter::Projector(projector) => self.add_point(id, projector.bounds(), bounds),
            Emitter::Area { shape, radiance } => {
                let Some(g) = geoms.get(shape.0 as usize) else {
                    return;
                };
                if radiance.is_black() {
                    return;
                }
                self.add_surface(*shape, g, Radiance::Constant(*radiance));
                for part in local::parts_of(*shape, g) {
                    let what = What::Part {
                        part,
                        radiance: *radiance,
                    };
                    let power = PI * radiance.luminance();
                    self.add_part(id, g, part, what, power, bounds);
                }
            }
            Emitter::TexturedArea { shape, radiance } => {
                let Some(g) = geoms.get(shape.0 as usize) else {
                    return;
                };
                self.add_surface(*shape, g, Radiance::Textured(id));
                for spread in textured::spread(*shape, g, radiance) {
                    let (part, table) = (spread.part, self.add_table(spread.table));
                    let what = What::Textured { part, table };
                    self.add_part(id, g, part, what, PI * spread.mean, bounds);
                }
            }
            Emitter::Beam { shape, exitance } => {
                let Some(g) = geoms.get(shape.0 as usize) else {
                    return;
                };
                // It belongs to an emitter, but no ray sees its light.
                self.add_surface(*shape, g, Radiance::Constant(Rgb::BLACK));
                for spread in textured::spread(*shape, g, exitance) {
                    let (part, table) = (spread.part, self.add_table(spread.table));
                    let what = What::Beam { part, table };
                    self.add_part(id, g, part, what, spread.mean, bounds);
                }
            }
        }
    }

    fn add_table(&mut self, table: Option<Tabulated2>) -> Option<u32> {
        self.tables.push(table?);
        Some(self.tables.len() as u32 - 1)
    }

    fn add_point(&mut self, emitter: u32, mut b: LightBounds, bounds: &mut Vec<LightBounds>) {
        if b.power > 0.0 {
            b.power = b.power.min(f32::MAX);
            let what = What::Point;
            self.items.push(Item { emitter, what });
            bounds.push(b);
        }
    }

    fn add_surface(&mut self, shape: ShapeId, g: &Geometry, radiance: Radiance) {
        let first = self.item_of.len() as u32;
        self.surfaces[shape.0 as usize] = Some(Surface { radiance, first });
        // What changes its form is met, but not aimed at: its primitives have no items.
        if let Geometry::Deforming(_) = g {
            let none = std::iter::repeat_n(NO_ITEM, g.prim_count() as usize);
            self.item_of.extend(none);
        }
    }

    pub(super) fn motion(&self, shape: ShapeId) -> Option<&Motion> {
        self.motions.get(shape.0 as usize)?.as_ref()
    }

    /// `exitance` in W/m², luminance.
    fn add_part(
        &mut self,
        emitter: u32,
        g: &Geometry,
        part: Part,
        what: What,
        exitance: f32,
        bounds: &mut Vec<LightBounds>,
    ) {
        let area = part.area(g);
        let item = match area > 0.0 {
            true => self.items.len() as u32,
            false => NO_ITEM,
        };
        self.item_of.extend(part.prims().map(|_| item));
        if area > 0.0 {
            self.items.push(Item { emitter, what });
            let (b, axis, cos_spread) = part.bounds(g);
            let local = LightBounds {
                bounds: b,
                axis,
                cos_spread,
                cos_reach: match what {
                    What::Beam { .. } => 1.0,
                    _ => 0.0,
                },
                power: (area * f64::from(exitance)).min(f32::MAX as f64) as f32,
            };
            bounds.push(match self.motion(part.shape()) {
                Some(motion) => moving::bounds(motion, local),
                None => local,
            });
        }
    }
}

fn all(geoms: &[Geometry]) -> Aabb {
    geoms.iter().fold(Aabb::EMPTY, |b, g| b.union(g.bounds()))
}

/// Radius of a sphere around the scene.
fn radius_of(bounds: &Aabb) -> f64 {
    match bounds.is_empty() {
        true => 0.0,
        false => 0.5 * bounds.diagonal().as_dvec3().length(),
    }
}

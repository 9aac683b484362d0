//! From a list of emitters to the lights of a scene.

use super::choice::{Choice, Strategy};
use super::far::Far;
use super::local::{self, Part};
use super::textured;
use super::tree::LightBounds;
use super::{Emitter, Item, Lights, NO_ITEM, Radiance, Surface, What};
use crate::geom::{Geometry, ShapeId};
use crate::math::{Aabb, PI, Rgb, Vec3};

impl Lights {
    /// Emitters that are black or name a shape that is not there are left out.
    pub fn new(emitters: Vec<Emitter>, geoms: &[Geometry]) -> Lights {
        Lights::with_strategy(emitters, geoms, Strategy::Auto)
    }

    pub fn with_strategy(emitters: Vec<Emitter>, geoms: &[Geometry], strategy: Strategy) -> Lights {
        let mut lights = Lights {
            emitters: Vec::new(),
            items: Vec::new(),
            tables: Vec::new(),
            choice: Choice::One,
            far: Far::default(),
            surfaces: vec![None; geoms.len()],
            item_of: Vec::new(),
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
                self.add_surface(*shape, Radiance::Constant(*radiance));
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
                self.add_surface(*shape, Radiance::Textured(id));
                for spread in textured::spread(*shape, g, radiance) {
                    let table = spread.table.map(|table| {
                        self.tables.push(table);
                        self.tables.len() as u32 - 1
                    });
                    let part = spread.part;
                    let what = What::Textured { part, table };
                    self.add_part(id, g, part, what, PI * spread.mean, bounds);
                }
            }
            Emitter::Beam { shape, exitance } => {
                let Some(g) = geoms.get(shape.0 as usize) else {
                    return;
                };
                // It belongs to an emitter, but no ray sees its light.
                self.add_surface(*shape, Radiance::Constant(Rgb::BLACK));
                for spread in textured::spread(*shape, g, exitance) {
                    let part = spread.part;
                    self.add_part(id, g, part, What::Beam { part }, spread.mean, bounds);
                }
            }
        }
    }

    fn add_point(&mut self, emitter: u32, mut b: LightBounds, bounds: &mut Vec<LightBounds>) {
        if b.power > 0.0 {
            b.power = b.power.min(f32::MAX);
            let what = What::Point;
            self.items.push(Item { emitter, what });
            bounds.push(b);
        }
    }

    fn add_surface(&mut self, shape: ShapeId, radiance: Radiance) {
        let first = self.item_of.len() as u32;
        self.surfaces[shape.0 as usize] = Some(Surface { radiance, first });
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
            bounds.push(LightBounds {
                bounds: b,
                axis,
                cos_spread,
                cos_reach: match what {
                    What::Beam { .. } => 1.0,
                    _ => 0.0,
                },
                power: (area * f64::from(exitance)).min(f32::MAX as f64) as f32,
            });
        }
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

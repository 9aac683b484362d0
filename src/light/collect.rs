//! What there is to choose among: the parts of shining surfaces, points, and lights at infinity.

use super::local::{self, Part};
use super::tree::LightBounds;
use super::{Emitter, Item, Lights, NO_ITEM, Radiance, Surface, What, moving, textured};
use crate::geom::{Geometry, ShapeId};
use crate::math::{Aabb, Motion, PI, Rgb, Vec3};

impl Lights {
    /// Adds an emitter: `bounds` gets what the choice is to know of each of its items, `far` its number
    /// if it is at infinity.
    pub(super) fn add(
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
                self.add_unreachable(g);
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
                self.add_unreachable(g);
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
                self.add_unreachable(g);
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

    /// What changes its form is met, but not aimed at: its primitives have no items.
    fn add_unreachable(&mut self, g: &Geometry) {
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

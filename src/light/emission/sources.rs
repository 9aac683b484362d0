//! How often each light is chosen to emit: in proportion to its power, whoever may receive the light.

use super::Cover;
use crate::geom::{PlaceId, ShapeId};
use crate::light::{Emitter, Lights};
use crate::math::PI;
use crate::math::fp::ONE_MINUS_EPSILON;
use crate::math::warp::Tabulated1;

/// Something that emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum What {
    /// An item of the lights at finite distance.
    Item(usize),
    /// The emitter at infinity of this index in the list of those.
    Far(usize),
}

/// The choice among all items and then all emitters at infinity, and what else emission must know of the
/// scene.
#[derive(Clone, Debug, Default)]
pub(in crate::light) struct Sources {
    table: Table,
    items: usize,
    /// By shape: its place in the world. Empty where nothing is placed.
    places: Vec<PlaceId>,
    pub(super) cover: Cover,
}

#[derive(Clone, Debug, Default)]
enum Table {
    #[default]
    Empty,
    One,
    ByPower(Tabulated1),
    /// More than such a table holds: all alike.
    Uniform(usize),
}

impl Sources {
    /// `powers` in W of the items of `lights`, in their order; `places` of the shapes, by number.
    pub fn new(
        lights: &Lights,
        powers: impl Iterator<Item = f32>,
        places: Vec<PlaceId>,
        cover: Cover,
    ) -> Sources {
        let mut powers: Vec<f64> = powers.map(f64::from).collect();
        let items = powers.len();
        // Directions of an environment are drawn without a view to the area that they see of the scene.
        let section = cover.mean_section();
        let far = lights.far.emitters.iter();
        powers.extend(far.map(|&far| match &lights.emitters[far as usize] {
            Emitter::Constant { radiance } => f64::from(4.0 * PI * radiance.luminance()) * section,
            Emitter::Image(map) => map.integral() * section,
            Emitter::Directional { d, irradiance } => {
                f64::from(irradiance.luminance()) * cover.section(d.as_dvec3())
            }
            _ => 0.0,
        }));
        Sources {
            table: Table::new(&powers),
            items,
            places,
            cover,
        }
    }

    /// Chooses a source by `u` in [0,1), with its probability. `None` when there is none.
    #[inline]
    pub(super) fn pick(&self, u: f32) -> Option<(What, f64)> {
        let (index, prob) = match &self.table {
            Table::Empty => return None,
            Table::One => (0, 1.0),
            Table::ByPower(table) => {
                let pick = table.pick(u);
                (pick.index, f64::from(pick.prob))
            }
            Table::Uniform(n) => {
                let u = f64::from(u.clamp(0.0, ONE_MINUS_EPSILON));
                ((u * *n as f64) as usize, 1.0 / *n as f64)
            }
        };
        let what = match index.checked_sub(self.items) {
            Some(far) => What::Far(far),
            None => What::Item(index),
        };
        Some((what, prob))
    }

    fn prob(&self, index: usize) -> f64 {
        match &self.table {
            Table::Empty => 0.0,
            Table::One => 1.0,
            Table::ByPower(table) => f64::from(table.prob(index)),
            Table::Uniform(n) => 1.0 / *n as f64,
        }
    }

    /// Probability that [`Sources::pick`] gives the item of this number.
    pub(super) fn prob_of_item(&self, index: usize) -> f64 {
        self.prob(index)
    }

    /// The same for an index among the emitters at infinity.
    pub(super) fn prob_of_far(&self, index: usize) -> f64 {
        self.prob(self.items + index)
    }

    /// The placement of a shape.
    pub(super) fn place(&self, shape: ShapeId) -> PlaceId {
        let place = self.places.get(shape.0 as usize);
        place.copied().unwrap_or(PlaceId::NONE)
    }
}

impl Table {
    fn new(powers: &[f64]) -> Table {
        let most = powers.iter().fold(0.0, |m: f64, &p| m.max(p));
        let weight = |p: &f64| {
            let share = match most > 0.0 && most < f64::INFINITY {
                true => p / most,
                false => 1.0,
            };
            // What shines is never out of reach, however little it does.
            share.max(f64::from(f32::MIN_POSITIVE)) as f32
        };
        match powers.len() {
            0 => Table::Empty,
            1 => Table::One,
            n => {
                let weights: Vec<f32> = powers.iter().map(weight).collect();
                match Tabulated1::new(&weights) {
                    Some(table) => Table::ByPower(table),
                    None => Table::Uniform(n),
                }
            }
        }
    }
}

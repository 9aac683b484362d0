//! All that can be hit: shapes where they stand, groups of shapes that stand in many places, and shapes
//! that move or change their form while the shutter is open.
//!
//! The tree of the world holds the still shapes as they are, and a box for everything else. A group has a
//! tree of its own in its own coordinates; a ray that enters the box of a placement is taken there in f64
//! and traced on. What moves has one box for each stretch of time ([`split`]), so that something small and
//! fast costs little. A world without placements and deforming meshes is traced as if there were none of this.

mod deform;
mod place;
mod split;

pub use deform::{DeformError, Deforming};
pub use place::Placement;
pub(crate) use place::{normal, point};

use super::{Accel, Geometry, Hit, Hooks, MeshRef, RawHit, Ray, ShapeId};
use crate::math::{Aabb, Vec2, Vec3};
use std::cell::Cell;

/// Index of a group of shapes of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct GroupId(pub u32);

/// Index of a placement of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PlaceId(pub u32);

impl PlaceId {
    /// Not part of any placement: the shape stands in the world as it is.
    pub const NONE: PlaceId = PlaceId(u32::MAX);
}

/// Which meetings of a ray count. Resolved at compile time: `()` accepts all of them and costs nothing.
pub trait Filter {
    /// Whether some meeting may be refused.
    const REFUSES: bool;

    /// Whether a meeting with triangle `prim` of mesh `shape` at weights `uv` counts; asked once for each
    /// meeting, nearest or not. Shapes in groups are asked about like all others.
    fn accept(&self, shape: ShapeId, prim: u32, uv: Vec2) -> bool;

    /// Nearest meeting of `ray` that counts with a shape that is no mesh; as
    /// [`Geometry::intersect_analytic`].
    #[inline]
    fn intersect(&self, _shape: ShapeId, geometry: &Geometry, ray: &Ray) -> Option<(f32, Vec2)> {
        geometry.intersect_analytic(ray, ray.t_max)
    }
}

impl Filter for () {
    const REFUSES: bool = false;

    #[inline]
    fn accept(&self, _: ShapeId, _: u32, _: Vec2) -> bool {
        true
    }
}

/// Everything a ray can meet, immutable.
pub struct World {
    /// By shape, each in the coordinates of its group, or of the world if it is in none.
    geometries: Vec<Geometry>,
    top: Level,
    groups: Vec<Level>,
    places: Vec<Placement>,
    /// By shape: the first placement of its group.
    placed: Vec<PlaceId>,
    moves: bool,
}

/// Shapes that share coordinates.
struct Level {
    accel: Accel,
    contents: Contents,
    /// What the tree's boxes beyond the shapes stand for, in the order of their numbers.
    stretches: Vec<Stretch>,
}

/// The most general thing that a level holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Contents {
    Meshes,
    /// Also shapes that are no mesh.
    Shapes,
    /// Also placements and deforming triangles.
    Stretches,
}

/// Something in one box during a stretch of time.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    /// From here up to, but not with, `until`; the first begins and the last ends at infinity.
    from: f32,
    until: f32,
    what: What,
}

#[derive(Clone, Copy, Debug)]
enum What {
    Place(PlaceId),
    Triangle { shape: ShapeId, prim: u32 },
}

/// The nearest meeting, in the coordinates of the group of what was met.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Met {
    raw: RawHit,
    place: PlaceId,
}

impl World {
    /// Shapes that all stand where they are.
    pub fn new(geometries: Vec<Geometry>) -> World {
        World::with_places(geometries, &[], vec![])
    }

    /// Shapes of which those named in `groups` are in their group's own coordinates and appear only where
    /// `places` put the group. Names of shapes and groups that do not exist are passed over.
    pub fn with_places(
        geometries: Vec<Geometry>,
        groups: &[Vec<ShapeId>],
        places: Vec<Placement>,
    ) -> World {
        let mut free = vec![true; geometries.len()];
        let mut placed = vec![PlaceId::NONE; geometries.len()];
        let mut first = vec![PlaceId::NONE; groups.len()];
        for (i, place) in places.iter().enumerate().rev() {
            if let Some(first) = first.get_mut(place.group.0 as usize) {
                *first = PlaceId(i as u32);
            }
        }
        for (shapes, first) in groups.iter().zip(first) {
            for shape in shapes.iter().map(|s| s.0 as usize) {
                if shape < free.len() {
                    free[shape] = false;
                    placed[shape] = first;
                }
            }
        }
        let ids = (0..geometries.len() as u32).map(ShapeId);
        let top: Vec<ShapeId> = ids.filter(|s| free[s.0 as usize]).collect();
        let groups: Vec<Level> = groups
            .iter()
            .map(|shapes| Level::build(&geometries, shapes, vec![]))
            .collect();
        let boxes = places.iter().enumerate().flat_map(|(i, place)| {
            let local = match groups.get(place.group.0 as usize) {
                Some(group) => group.accel.bounds(),
                None => Aabb::EMPTY,
            };
            let what = What::Place(PlaceId(i as u32));
            let pieces = match local.is_empty() {
                true => vec![],
                false => split::of_motion(&place.motion, local),
            };
            pieces.into_iter().map(move |p| p.stretch(what))
        });
        let top = Level::build(&geometries, &top, boxes.collect());
        let moves = places.iter().any(|p| p.motion.as_still().is_none())
            || geometries
                .iter()
                .any(|g| matches!(g, Geometry::Deforming(_)));
        World {
            moves,
            geometries,
            top,
            groups,
            places,
            placed,
        }
    }

    /// By [`ShapeId`], each in the coordinates of its group.
    pub fn geometries(&self) -> &[Geometry] {
        &self.geometries
    }

    /// By [`PlaceId`].
    pub fn places(&self) -> &[Placement] {
        &self.places
    }

    /// Where the group of `shape` stands, if it is in one: the first of its placements.
    pub fn placement_of(&self, shape: ShapeId) -> Option<&Placement> {
        let place = self.placed.get(shape.0 as usize)?;
        self.places.get(place.0 as usize)
    }

    /// The first placement of the group of `shape`; [`PlaceId::NONE`] if it is in none.
    pub fn place_of(&self, shape: ShapeId) -> PlaceId {
        let place = self.placed.get(shape.0 as usize);
        place.copied().unwrap_or(PlaceId::NONE)
    }

    /// The nearest surface along `ray`. Only with `tangents` do shading frames follow dp/du.
    #[inline]
    pub fn intersect(&self, ray: &Ray, tangents: bool) -> Option<Hit> {
        let accel = &self.top.accel;
        let raw = match self.top.contents {
            Contents::Meshes => accel.intersect(ray),
            Contents::Shapes => accel.intersect_with(ray, &Shapes(&self.geometries)),
            Contents::Stretches => return self.intersect_stretches(ray, tangents),
        }?;
        Some(self.geometries[raw.shape.0 as usize].hit(ray, &raw, tangents))
    }

    #[inline(never)]
    fn intersect_stretches(&self, ray: &Ray, tangents: bool) -> Option<Hit> {
        let met = self.nearest(&self.top, ray, &())?;
        Some(self.hit_at(ray, &met.raw, met.place, tangents))
    }

    /// All that shading needs at the meeting `raw` of `ray` with a shape at `place`, known to happen.
    pub fn hit_at(&self, ray: &Ray, raw: &RawHit, place: PlaceId, tangents: bool) -> Hit {
        let geometry = &self.geometries[raw.shape.0 as usize];
        match self.places.get(place.0 as usize) {
            Some(placement) => placement.hit(geometry, ray, raw, place, tangents),
            None => geometry.hit(ray, raw, tangents),
        }
    }

    /// Whether anything stands in the way of `ray`.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let accel = &self.top.accel;
        match self.top.contents {
            Contents::Meshes => accel.occluded(ray),
            Contents::Shapes => accel.occluded_with(ray, &Shapes(&self.geometries)),
            Contents::Stretches => self.occluded_by(ray, &()),
        }
    }

    /// Whether anything that `filter` accepts stands in the way of `ray`.
    #[inline(never)]
    pub fn occluded_by<F: Filter>(&self, ray: &Ray, filter: &F) -> bool {
        self.any(&self.top, ray, filter)
    }

    fn nearest<F: Filter>(&self, level: &Level, ray: &Ray, filter: &F) -> Option<Met> {
        if level.contents == Contents::Meshes && !F::REFUSES {
            let raw = level.accel.intersect(ray)?;
            return Some(Met::here(raw));
        }
        let inside: Inside<'_, F, false> = Inside::new(self, level, filter);
        let raw = level.accel.intersect_with(ray, &inside)?;
        match (raw.shape.0 as usize) < self.geometries.len() {
            true => Some(Met::here(raw)),
            // What was met last through a stretch is what the tree found nearest.
            false => inside.met.get(),
        }
    }

    fn any<F: Filter>(&self, level: &Level, ray: &Ray, filter: &F) -> bool {
        if level.contents == Contents::Meshes && !F::REFUSES {
            return level.accel.occluded(ray);
        }
        let inside: Inside<'_, F, true> = Inside::new(self, level, filter);
        level.accel.occluded_with(ray, &inside)
    }

    /// dp/du and dp/dv at a hit, for bump maps; either is zero where it is undefined.
    pub fn dp_duv(&self, hit: &Hit) -> (Vec3, Vec3) {
        let Some(geometry) = self.geometries.get(hit.shape.0 as usize) else {
            return (Vec3::ZERO, Vec3::ZERO);
        };
        match self.places.get(hit.place.0 as usize) {
            Some(place) => place.dp_duv(geometry, hit),
            None => geometry.dp_duv(hit),
        }
    }

    /// The box of everything that can be hit, at whatever time; empty for an empty world.
    pub fn bounds(&self) -> Aabb {
        self.top.accel.bounds()
    }

    /// Whether anything changes while the shutter is open.
    pub fn moves(&self) -> bool {
        self.moves
    }

    /// How many placements and deforming meshes change while the shutter is open, and into how many
    /// stretches of time all that is not still was cut.
    pub fn moving(&self) -> (usize, usize) {
        let moving = self.places.iter().filter(|p| p.motion.as_still().is_none());
        let deforming = self
            .geometries
            .iter()
            .filter(|g| matches!(g, Geometry::Deforming(_)));
        let levels = std::iter::once(&self.top).chain(&self.groups);
        let stretches = levels.map(|l| l.stretches.iter().filter(|s| !s.is_always()).count());
        (moving.count() + deforming.count(), stretches.sum())
    }

    /// Whether some shape is no mesh.
    pub fn has_analytic(&self) -> bool {
        !self.geometries.iter().all(Geometry::is_mesh)
    }

    /// Memory of shapes and trees in bytes: a group counts once, however often it is placed.
    pub fn bytes(&self) -> usize {
        let geometries = self.geometries.iter().map(|g| match g {
            Geometry::Mesh(m) => m.bytes(),
            Geometry::Deforming(d) => d.bytes(),
            Geometry::Sdf(s) => s.bytes(),
            _ => 0,
        });
        let levels = std::iter::once(&self.top).chain(&self.groups);
        let levels = levels.map(|l| l.accel.bytes() + size_of_val(&l.stretches[..]));
        geometries.sum::<usize>() + levels.sum::<usize>() + size_of_val(&self.places[..])
    }
}

impl Met {
    fn here(raw: RawHit) -> Met {
        Met {
            raw,
            place: PlaceId::NONE,
        }
    }
}

impl Stretch {
    #[inline]
    fn contains(&self, time: f32) -> bool {
        self.from <= time && time < self.until
    }

    fn is_always(&self) -> bool {
        self.from == f32::NEG_INFINITY && self.until == f32::INFINITY
    }
}

impl Level {
    /// `boxes` are those of placements.
    fn build(
        geometries: &[Geometry],
        shapes: &[ShapeId],
        mut boxes: Vec<(Stretch, Aabb)>,
    ) -> Level {
        let mut meshes = Vec::new();
        let mut others = Vec::new();
        let known = shapes.iter().filter_map(|&shape| {
            let geometry = geometries.get(shape.0 as usize)?;
            Some((shape, geometry))
        });
        for (shape, geometry) in known {
            match geometry {
                Geometry::Mesh(m) => meshes.push(MeshRef {
                    shape,
                    positions: m.positions(),
                    indices: m.indices(),
                }),
                Geometry::Deforming(d) => boxes.extend(d.boxes(shape)),
                g => others.push((shape, g.bounds())),
            }
        }
        let contents = match (others.is_empty(), boxes.is_empty()) {
            (_, false) => Contents::Stretches,
            (false, true) => Contents::Shapes,
            (true, true) => Contents::Meshes,
        };
        // Numbers beyond those of the shapes are stretches.
        let first = geometries.len();
        let numbered = boxes.iter().enumerate();
        others.extend(numbered.map(|(i, b)| (ShapeId((first + i) as u32), b.1)));
        Level {
            accel: Accel::build(&meshes, &others),
            contents,
            stretches: boxes.into_iter().map(|b| b.0).collect(),
        }
    }
}

/// The shapes of a level without stretches that are no meshes.
struct Shapes<'a>(&'a [Geometry]);

impl Hooks for Shapes<'_> {
    const SHAPES: bool = true;
    const FILTERS: bool = false;

    #[inline]
    fn intersect(&self, shape: ShapeId, ray: &Ray) -> Option<(f32, Vec2)> {
        self.0[shape.0 as usize].intersect_analytic(ray, ray.t_max)
    }

    #[inline]
    fn accept(&self, _: ShapeId, _: u32, _: Vec2) -> bool {
        true
    }
}

/// A level, for one ray. With `ANY` it matters only whether something is met.
struct Inside<'a, F, const ANY: bool> {
    world: &'a World,
    level: &'a Level,
    filter: &'a F,
    /// What was met last through a stretch. Each call offers only what is nearer than all before.
    met: Cell<Option<Met>>,
}

impl<'a, F: Filter, const ANY: bool> Inside<'a, F, ANY> {
    fn new(world: &'a World, level: &'a Level, filter: &'a F) -> Self {
        Inside {
            world,
            level,
            filter,
            met: Cell::new(None),
        }
    }

    fn stretch(&self, index: usize, ray: &Ray) -> Option<(f32, Vec2)> {
        let stretch = self.level.stretches.get(index)?;
        if !stretch.contains(ray.time) {
            return None;
        }
        let met = match stretch.what {
            What::Triangle { shape, prim } => {
                let Some(Geometry::Deforming(mesh)) = self.world.geometries.get(shape.0 as usize)
                else {
                    return None;
                };
                let (t, uv) = mesh.intersect(prim, ray)?;
                if F::REFUSES && !self.filter.accept(shape, prim, uv) {
                    return None;
                }
                Met::here(RawHit { t, shape, prim, uv })
            }
            What::Place(id) => {
                let place = &self.world.places[id.0 as usize];
                let group = &self.world.groups[place.group.0 as usize];
                let local = place.ray(ray);
                if ANY {
                    // Any distance will do, as long as it is nearer than the end of the ray.
                    let met = self.world.any(group, &local, self.filter);
                    return met.then_some((0.5 * ray.t_max.min(f32::MAX), Vec2::ZERO));
                }
                let met = self.world.nearest(group, &local, self.filter)?;
                Met { place: id, ..met }
            }
        };
        // The tree takes what is nearer than its best so far, and only that may be remembered.
        (met.raw.t < ray.t_max).then(|| {
            self.met.set(Some(met));
            (met.raw.t, met.raw.uv)
        })
    }
}

impl<F: Filter, const ANY: bool> Hooks for Inside<'_, F, ANY> {
    const SHAPES: bool = true;
    const FILTERS: bool = F::REFUSES;

    #[inline]
    fn intersect(&self, shape: ShapeId, ray: &Ray) -> Option<(f32, Vec2)> {
        let index = shape.0 as usize;
        match self.world.geometries.get(index) {
            Some(geometry) => self.filter.intersect(shape, geometry, ray),
            None => self.stretch(index - self.world.geometries.len(), ray),
        }
    }

    #[inline]
    fn accept(&self, shape: ShapeId, prim: u32, uv: Vec2) -> bool {
        self.filter.accept(shape, prim, uv)
    }
}

#[cfg(test)]
mod tests;

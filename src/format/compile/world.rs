//! Which shape stands where: those of the world, groups and their instances, and what moves.
//!
//! A shape that moves becomes a group of one, placed by its motion; so do only shapes whose transform
//! really changes while the shutter is open.

use std::collections::HashMap;

use rayon::prelude::*;

use super::camera::Sensor;
use super::shapes::{self, Source};
use super::{out_of_reach, within_reach};
use crate::format::plugins::Category;
use crate::format::{ObjectId, Props, SceneError};
use crate::geom::{GroupId, Placement, ShapeId, World};
use crate::math::{Aabb, DVec3, Motion, Transform};
use crate::scene::Plan;

/// Shapes and places by name, before any file is read.
pub struct Layout<'a> {
    /// By [`ShapeId`]; those of a group once.
    pub shapes: Vec<Props<'a>>,
    /// By shape: the transform into the coordinates of its level, and that level.
    stands: Vec<(Transform, Option<GroupId>)>,
    /// By [`GroupId`].
    groups: Vec<Vec<ShapeId>>,
    /// What places a group, and by which motion.
    places: Vec<(Props<'a>, GroupId, Motion)>,
    /// Whether the shutter is open for any time at all.
    time_passes: bool,
}

/// Least and greatest coordinates of what shares coordinates.
#[derive(Clone, Copy)]
struct Extent {
    lo: DVec3,
    hi: DVec3,
}

/// Distance of shapes from the origin, in their radii, up to which coordinates stay as they are: within,
/// moving it would gain less than three bits.
const NEAR_ORIGIN: f64 = 4.0;

impl<'a> Layout<'a> {
    /// What the shapes of the scene are made of. `shutter` says when it opens and closes.
    pub fn new(
        root: &Props<'a>,
        shutter: [f64; 2],
        warnings: &mut Vec<String>,
    ) -> Result<Layout<'a>, SceneError> {
        let mut layout = Layout {
            shapes: Vec::new(),
            stands: Vec::new(),
            groups: Vec::new(),
            places: Vec::new(),
            time_passes: shutter[0] < shutter[1],
        };
        let mut known = HashMap::new();
        let mut defined = Vec::new();
        for shape in root.children(Category::Shape) {
            match shape.plugin() {
                "shapegroup" => defined.push(shape),
                "instance" => layout.instance(shape, shutter, &mut known)?,
                _ => layout.shape(shape, shutter)?,
            }
        }
        for group in defined {
            if !known.contains_key(&group.object_id()) {
                group.ignore_all();
                let lost = "no instance places this shapegroup, so it is not there";
                warnings.push(at(&group, lost));
            }
        }
        if !layout.time_passes {
            let changes = |s: &&Props| s.is_given("filename_end");
            for shape in layout.shapes.iter().filter(changes) {
                let no_time = "filename_end has no effect, as the shutter closes when it opens; give the sensor a shutter_close";
                warnings.push(at(shape, no_time));
            }
            let placed = layout.places.iter().map(|(props, ..)| props);
            for shape in layout.shapes.iter().chain(placed) {
                if shape
                    .keyframes("to_world")?
                    .windows(2)
                    .any(|k| k[0] != k[1])
                {
                    let no_time = "the animation has no effect, as the shutter closes when it opens; give the sensor a shutter_close";
                    warnings.push(at(shape, no_time));
                }
            }
        }
        Ok(layout)
    }

    fn add(&mut self, shape: Props<'a>, to_level: Transform, group: Option<GroupId>) -> ShapeId {
        self.shapes.push(shape);
        self.stands.push((to_level, group));
        ShapeId(self.shapes.len() as u32 - 1)
    }

    fn add_group(&mut self) -> GroupId {
        self.groups.push(Vec::new());
        GroupId(self.groups.len() as u32 - 1)
    }

    /// A shape outside of groups.
    fn shape(&mut self, shape: Props<'a>, shutter: [f64; 2]) -> Result<(), SceneError> {
        let motion = shape.motion("to_world", shutter)?;
        if let Some(still) = motion.as_still() {
            self.add(shape, *still, None);
            return Ok(());
        }
        // A mirror changes what the normals of a shape are. Built mirrored once, it can be moved without.
        let mirror = match motion.at(0.0).swaps_handedness() {
            true => Transform::scale(DVec3::new(1.0, 1.0, -1.0)),
            false => None,
        };
        let mirror = mirror.unwrap_or_default();
        let group = self.add_group();
        let id = self.add(shape, mirror, Some(group));
        self.groups[group.0 as usize].push(id);
        self.places
            .push((shape, group, motion.append(&mirror.inverse())));
        Ok(())
    }

    fn instance(
        &mut self,
        instance: Props<'a>,
        shutter: [f64; 2],
        known: &mut HashMap<ObjectId, GroupId>,
    ) -> Result<(), SceneError> {
        // Of no use without derivatives.
        instance.ignore(&["silhouette_sampling_weight"]);
        let Some(group) = instance.child(Category::Shape) else {
            return Err(instance.error("shape \"instance\" needs a shapegroup inside"));
        };
        if group.plugin() != "shapegroup" {
            let what = format!(
                "an instance places a shapegroup, not a shape of type \"{}\"",
                group.plugin()
            );
            let help = "put the shape into a <shape type=\"shapegroup\"> and refer to that";
            return Err(instance.error(what).with_help(help));
        }
        let id = match known.get(&group.object_id()) {
            Some(id) => *id,
            None => {
                let id = self.members(&group, shutter)?;
                known.insert(group.object_id(), id);
                id
            }
        };
        let motion = instance.motion("to_world", shutter)?;
        self.places.push((instance, id, motion));
        Ok(())
    }

    /// The shapes of a group.
    fn members(&mut self, group: &Props<'a>, shutter: [f64; 2]) -> Result<GroupId, SceneError> {
        let id = self.add_group();
        for shape in group.children(Category::Shape) {
            if matches!(shape.plugin(), "shapegroup" | "instance") {
                let what = format!(
                    "the shape \"{}\" cannot stand in a shapegroup",
                    shape.plugin()
                );
                let help = "list the shapes themselves in each group";
                return Err(shape.error(what).with_help(help));
            }
            if let Some(emitter) = shape.child(Category::Emitter) {
                let help = "put the shape that shines beside the group, once for each place";
                return Err(emitter
                    .error("a shape in a shapegroup cannot be an emitter")
                    .with_help(help));
            }
            let motion = shape.motion("to_world", shutter)?;
            let Some(to_group) = motion.as_still() else {
                return Err(shape
                    .error_at("to_world", "a shape in a shapegroup cannot move by itself")
                    .with_help("give the <animation> to the instances of the group"));
            };
            let member = self.add(shape, *to_group, Some(id));
            self.groups[id.0 as usize].push(member);
        }
        Ok(id)
    }

    /// The shape that `sensor` stands in.
    pub fn measured(&self, sensor: &Sensor) -> Result<Option<ShapeId>, SceneError> {
        let Some(shape) = &sensor.shape else {
            return Ok(None);
        };
        let same = |s: &Props| s.object_id() == shape.object_id();
        match self.shapes.iter().position(same) {
            Some(i) if self.stands[i].1.is_none() => Ok(Some(ShapeId(i as u32))),
            _ => Err(sensor
                .props
                .error("an irradiance meter measures a shape that stands still")
                .with_help("leave the <animation> out, or use a sensor beside the shape")),
        }
    }

    /// Reads the shapes and their files.
    pub fn read(&self) -> Result<Vec<Source<'a>>, SceneError> {
        let stands = self.shapes.par_iter().zip(&self.stands);
        stands
            .map(|(shape, (to_level, _))| shapes::read(shape, *to_level, self.time_passes))
            .collect()
    }

    /// Chooses the centre of the scene and of each group, and makes what [`Layout::read`] gave relative to it.
    pub fn place(
        &self,
        sources: Vec<Source>,
        plan: &mut Plan,
    ) -> Result<(World, DVec3), SceneError> {
        let mut top = Extent::EMPTY;
        let mut groups = vec![Extent::EMPTY; self.groups.len()];
        for (source, (_, group)) in sources.iter().zip(&self.stands) {
            let (lo, hi) = shapes::bounds(source);
            check_reach(source.props(), lo, hi)?;
            match group {
                Some(group) => groups[group.0 as usize].add(lo, hi),
                None => top.add(lo, hi),
            }
        }
        let centers: Vec<DVec3> = groups.iter().map(Extent::center).collect();
        let mut placed = Vec::with_capacity(self.places.len());
        for (props, group, motion) in &self.places {
            let center = centers[group.0 as usize];
            let motion = motion.append(&Transform::translate(center));
            let bounds = motion.bounds(groups[group.0 as usize].around(center), 0.0, 1.0);
            if !bounds.is_empty() {
                let (lo, hi) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
                check_reach(props, lo, hi)?;
                top.add(lo, hi);
            }
            placed.push((*group, motion));
        }
        let center = top.center();
        plan_of_coordinates(plan, &top, center);
        let stands = sources.into_par_iter().zip(&self.stands);
        let geometries = stands
            .map(|(source, (_, group))| {
                let center = group.map_or(center, |g| centers[g.0 as usize]);
                shapes::geometry(source, center)
            })
            .collect::<Result<Vec<_>, SceneError>>()?;
        let to_scene = Transform::translate(-center);
        let places = placed.into_iter().map(|(group, motion)| Placement {
            group,
            motion: motion.prepend(&to_scene),
        });
        let world = World::with_places(geometries, &self.groups, places.collect());
        Ok((world, center))
    }
}

/// A warning with its place.
fn at(props: &Props, what: &str) -> String {
    format!("{}: {what}", props.place())
}

fn check_reach(props: &Props, lo: DVec3, hi: DVec3) -> Result<(), SceneError> {
    // NaN is out of reach too.
    if within_reach(lo) && within_reach(hi) {
        return Ok(());
    }
    let what = out_of_reach("a part of the shape");
    Err(props.error_at("to_world", what))
}

impl Extent {
    const EMPTY: Extent = Extent {
        lo: DVec3::INFINITY,
        hi: DVec3::NEG_INFINITY,
    };

    fn add(&mut self, lo: DVec3, hi: DVec3) {
        self.lo = self.lo.min(lo);
        self.hi = self.hi.max(hi);
    }

    fn is_empty(&self) -> bool {
        !self.lo.cmple(self.hi).all()
    }

    fn middle(&self) -> DVec3 {
        0.5 * (self.lo + self.hi)
    }

    fn radius(&self) -> f64 {
        0.5 * (self.hi - self.lo).length()
    }

    /// The point to which coordinates are relative: the middle, unless the origin is near.
    fn center(&self) -> DVec3 {
        match self.is_empty() || self.middle().length() <= NEAR_ORIGIN * self.radius() {
            true => DVec3::ZERO,
            false => self.middle(),
        }
    }

    /// As a box relative to `center`.
    fn around(&self, center: DVec3) -> Aabb {
        if self.is_empty() {
            return Aabb::EMPTY;
        }
        Aabb {
            min: (self.lo - center).as_vec3().map(f32::next_down),
            max: (self.hi - center).as_vec3().map(f32::next_up),
        }
    }
}

fn plan_of_coordinates(plan: &mut Plan, extent: &Extent, center: DVec3) {
    if center == DVec3::ZERO {
        plan.add(
            "coordinates",
            "as they are",
            "the scene lies near the origin",
        );
    } else {
        let reason = format!(
            "the scene lies {:.3e} of its radii from the origin",
            extent.middle().length() / extent.radius()
        );
        plan.add(
            "coordinates",
            format!("relative to ({}, {}, {})", center.x, center.y, center.z),
            reason,
        );
    }
}

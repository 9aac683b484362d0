//! The scene as light transport sees it: flat, indexed by ids, immutable. It knows no files and no names.

mod camera;
mod plan;

pub use camera::{Camera, FovAxis, PerspectiveSpec};
pub use plan::{Plan, PlanEntry};

use crate::bsdf::Bsdf;
use crate::geom::{Accel, Geometry, Hit, Ray, ShapeId};
use crate::light::{Emitter, EmitterSample, Lights};
use crate::material::Material;
use crate::math::{DVec3, Rgb, Vec2, Vec3};

/// Index of a material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialId(pub u32);

/// A shape as it is handed to [`Scene::new`].
#[derive(Clone, Debug)]
pub struct Shape {
    pub geometry: Geometry,
    pub material: MaterialId,
    /// Radiance emitted by the shape's outside, if any.
    pub radiance: Option<Rgb>,
}

/// Everything a ray can meet and every light.
#[derive(Debug)]
pub struct Scene {
    geometries: Vec<Geometry>,
    /// Material of each shape.
    surfaces: Vec<MaterialId>,
    materials: Vec<Material>,
    lights: Lights,
    accel: Accel,
    center: DVec3,
    plan: Plan,
}

//! The scene as light transport sees it: flat, indexed by ids, immutable. It knows no files and no names.

mod camera;
mod plan;

pub use camera::{Camera, FovAxis, PerspectiveSpec};
pub use plan::{Plan, PlanEntry};

use crate::geom::{Accel, Geometry, Hit, Hooks, MeshRef, Ray, ShapeId};
use crate::light::{Emitter, EmitterSample, Lights, Strategy};
use crate::material::{Material, Shading};
use crate::math::{DVec3, Rgb, Vec2, Vec3};

/// Index of a material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialId(pub u32);

/// How much a scene holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub shapes: usize,
    pub triangles: usize,
    /// Shapes that are intersected exactly, not as triangles.
    pub analytic: usize,
    pub materials: usize,
    pub emitters: usize,
    /// Memory of meshes and hierarchy.
    pub geometry_bytes: usize,
}

/// Everything a ray can meet and every light.
pub struct Scene {
    geometries: Vec<Geometry>,
    /// Material of each shape.
    surfaces: Vec<MaterialId>,
    materials: Vec<Material>,
    lights: Lights,
    /// Whether a ray can run into an emitter: false when all are points.
    emitters_can_be_met: bool,
    accel: Accel,
    /// Whether any shape is no mesh.
    has_analytic: bool,
    /// Whether shading frames must follow dp/du.
    tangents: bool,
    /// Whether chance decides what some material is.
    mixed: bool,
    center: DVec3,
    plan: Plan,
}

/// Shapes that are no mesh, for the acceleration structure.
struct Analytic<'a>(&'a [Geometry]);

impl Hooks for Analytic<'_> {
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

impl Scene {
    /// `surfaces` holds the material of each geometry; `emitters` name geometries by their index;
    /// `center` is the point of the world that all coordinates are relative to.
    pub fn new(
        geometries: Vec<Geometry>,
        surfaces: Vec<MaterialId>,
        materials: Vec<Material>,
        emitters: Vec<Emitter>,
        center: DVec3,
        mut plan: Plan,
    ) -> Scene {
        let shapes = || {
            geometries
                .iter()
                .enumerate()
                .map(|(i, g)| (ShapeId(i as u32), g))
        };
        let meshes: Vec<MeshRef> = shapes()
            .filter_map(|(shape, g)| match g {
                Geometry::Mesh(m) => Some(MeshRef {
                    shape,
                    positions: m.positions(),
                    indices: m.indices(),
                }),
                _ => None,
            })
            .collect();
        let others: Vec<_> = shapes()
            .filter(|(_, g)| !matches!(g, Geometry::Mesh(_)))
            .map(|(id, g)| (id, g.bounds()))
            .collect();
        let accel = Accel::build(&meshes, &others);
        let has_analytic = !others.is_empty();
        let emitters_can_be_met = emitters.iter().any(Emitter::can_be_met);
        let tangents = materials.iter().any(Material::is_anisotropic);
        match tangents {
            true => plan.add(
                "tangents",
                "shading frames follow the texture coordinates",
                "a material is anisotropic",
            ),
            false => plan.add("tangents", "none", "no material is anisotropic"),
        }
        let mixed = materials.iter().any(Material::is_mixed);
        let lights = Lights::new(emitters, &geometries);
        plan_of_scene(&mut plan, &lights, has_analytic, emitters_can_be_met);
        Scene {
            geometries,
            surfaces,
            materials,
            lights,
            emitters_can_be_met,
            accel,
            has_analytic,
            tangents,
            mixed,
            center,
            plan,
        }
    }

    /// The nearest surface along `ray`.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let raw = if self.has_analytic {
            self.accel.intersect_with(ray, &Analytic(&self.geometries))
        } else {
            self.accel.intersect(ray)
        }?;
        Some(self.geometries[raw.shape.0 as usize].hit(ray, &raw, self.tangents))
    }

    /// Whether anything stands in the way of `ray`.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        if self.has_analytic {
            self.accel.occluded_with(ray, &Analytic(&self.geometries))
        } else {
            self.accel.occluded(ray)
        }
    }

    /// How the surface scatters at `hit`, seen from `hit.wo`; `u` in [0,1) decides where chance does.
    #[inline]
    pub fn shade(&self, hit: &Hit, u: f32) -> Shading {
        self.materials[self.surfaces[hit.shape.0 as usize].0 as usize].shade(hit, u)
    }

    /// Whether [`Scene::shade`] uses `u` for some material.
    #[inline]
    pub fn materials_are_mixed(&self) -> bool {
        self.mixed
    }

    /// Share of light that passes along `ray` through masks and boundaries that are not there, at most
    /// `passes` of them; 0 where anything else stands in the way.
    #[inline]
    pub fn transmittance(&self, ray: &Ray, _passes: u32) -> f32 {
        if self.occluded(ray) { 0.0 } else { 1.0 }
    }

    /// Radiance emitted at `hit` towards `hit.wo`.
    #[inline]
    pub fn le(&self, hit: &Hit) -> Rgb {
        self.lights.le(hit)
    }

    /// Radiance from infinity that arrives along `d`, which points away from the receiver.
    #[inline]
    pub fn le_escaped(&self, d: Vec3) -> Rgb {
        self.lights.le_escaped(d)
    }

    /// A connection from `from` to a light; `None` when the chosen one sends nothing there.
    #[inline]
    pub fn sample_light(&self, from: &Hit, u_pick: f32, u: Vec2) -> Option<EmitterSample> {
        self.lights.sample(&self.geometries, from, u_pick, u)
    }

    /// Density per steradian with which [`Scene::sample_light`] connects `from` to the emitter at `met`.
    #[inline]
    pub fn pdf_light(&self, from: &Hit, met: &Hit) -> f32 {
        self.lights.pdf(&self.geometries, from, met)
    }

    /// The same for light from infinity along `d`.
    #[inline]
    pub fn pdf_light_escaped(&self, from: &Hit, d: Vec3) -> f32 {
        self.lights.pdf_escaped(from, d)
    }

    /// Chooses among the lights by `strategy` from now on: for comparisons, since the one that is chosen by
    /// itself is meant to be the best.
    pub fn choose_lights_by(&mut self, strategy: Strategy) {
        let emitters = self.lights.emitters().to_vec();
        self.lights = Lights::with_strategy(emitters, &self.geometries, strategy);
    }

    pub fn is_emitter(&self, shape: ShapeId) -> bool {
        self.lights.is_emitter(shape)
    }

    pub fn has_lights(&self) -> bool {
        !self.lights.is_empty()
    }

    /// Whether a number decides which light is sampled.
    #[inline]
    pub fn lights_are_chosen(&self) -> bool {
        self.lights.len() > 1
    }

    pub fn emitters_can_be_met(&self) -> bool {
        self.emitters_can_be_met
    }

    /// The point of the world that all coordinates of the scene are relative to.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    pub fn counts(&self) -> Counts {
        let meshes = self.geometries.iter().filter_map(|g| match g {
            Geometry::Mesh(m) => Some(m),
            _ => None,
        });
        let (mut triangles, mut count, mut bytes) = (0, 0, self.accel.bytes());
        for m in meshes {
            count += 1;
            triangles += m.indices().len();
            bytes += m.bytes();
        }
        Counts {
            shapes: self.geometries.len(),
            triangles,
            analytic: self.geometries.len() - count,
            materials: self.materials.len(),
            emitters: self.lights.emitters().len(),
            geometry_bytes: bytes,
        }
    }
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Scene {:?}", self.counts())
    }
}

fn plan_of_scene(plan: &mut Plan, lights: &Lights, has_analytic: bool, emitters_can_be_met: bool) {
    match has_analytic {
        true => plan.add(
            "shapes",
            "triangles and exact shapes in one tree",
            "there are spheres, disks or cylinders",
        ),
        false => plan.add("shapes", "triangles only", "no shape is anything else"),
    }
    let (decision, reason) = lights.choice();
    plan.add("light choice", decision, reason);
    if !lights.is_empty() && !emitters_can_be_met {
        let reason = "every light is a point or a beam, which no ray can meet";
        plan.add("last bounce", "no ray to meet an emitter", reason);
    }
}

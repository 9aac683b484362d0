//! The scene as light transport sees it: flat, indexed by ids, immutable. It knows no files and no names.

pub mod camera;
mod plan;

pub use camera::{Camera, CameraSample};
pub use plan::{Plan, PlanEntry};

use crate::geom::{Geometry, Hit, PlaceId, RawHit, Ray, ShapeId, World};
use crate::light::{
    Aim, Emission, EmissionNumbers, EmissionPdf, Emitter, EmitterId, EmitterSample, Lights, Source,
    Strategy,
};
use crate::material::{self, Material, Shading};
use crate::math::{DVec3, Rgb, Vec2, Vec3};

/// Index of a material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaterialId(pub u32);

/// How much a scene holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    pub shapes: usize,
    /// Those of a group of shapes count once, however often it is placed.
    pub triangles: usize,
    /// Shapes that are intersected exactly, not as triangles.
    pub analytic: usize,
    /// Places where groups of shapes stand.
    pub instances: usize,
    pub materials: usize,
    pub emitters: usize,
    /// Memory of meshes and hierarchy.
    pub geometry_bytes: usize,
}

/// Everything a ray can meet and every light.
pub struct Scene {
    world: World,
    /// Material of each shape.
    surfaces: Vec<MaterialId>,
    materials: Vec<Material>,
    lights: Lights,
    /// Whether a ray can run into an emitter: false when all are points.
    emitters_can_be_met: bool,
    /// Whether shading frames must follow dp/du.
    tangents: bool,
    /// Whether chance decides what some material is.
    mixed: bool,
    /// Whether some material lets light through as if it were not there.
    masked: bool,
    center: DVec3,
    plan: Plan,
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
        plan: Plan,
    ) -> Scene {
        let world = World::new(geometries);
        Scene::with_world(world, surfaces, materials, emitters, center, plan)
    }

    /// The same for a world in which shapes stand in many places or move.
    pub fn with_world(
        world: World,
        surfaces: Vec<MaterialId>,
        materials: Vec<Material>,
        emitters: Vec<Emitter>,
        center: DVec3,
        mut plan: Plan,
    ) -> Scene {
        let emitters_can_be_met = emitters.iter().any(Emitter::can_be_met);
        let tangents = materials.iter().any(Material::follows_tangents);
        let mixed = materials.iter().any(Material::is_mixed);
        let masked = materials.iter().any(Material::lets_through);
        let lights = Lights::in_world(emitters, &world, Strategy::Auto);
        plan::of_materials(&mut plan, &materials);
        plan::of_world(&mut plan, &world);
        plan::of_lights(&mut plan, &lights);
        Scene {
            world,
            surfaces,
            materials,
            lights,
            emitters_can_be_met,
            tangents,
            mixed,
            masked,
            center,
            plan,
        }
    }

    /// The nearest surface along `ray`.
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.world.intersect(ray, self.tangents)
    }

    /// Whether anything stands in the way of `ray`.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.world.occluded(ray)
    }

    /// All that shading needs at the meeting `raw` of `ray` with a shape at `place`, known to happen.
    pub fn hit_at(&self, ray: &Ray, raw: &RawHit, place: PlaceId) -> Hit {
        self.world.hit_at(ray, raw, place, self.tangents)
    }

    /// Whether the optical properties of a shape differ from place to place, or by chance.
    pub fn varies(&self, shape: ShapeId) -> bool {
        let material = self.surfaces.get(shape.0 as usize);
        let material = material.and_then(|id| self.materials.get(id.0 as usize));
        let shines = self.lights.is_textured(shape);
        shines || material.is_some_and(|m| m.is_textured() || m.is_mixed())
    }

    /// The shape that emitter `id` is a surface of, shining equally in all directions; `None` for other lights.
    pub fn lambertian_shape(&self, id: EmitterId) -> Option<ShapeId> {
        match self.lights.emitters().get(id.0 as usize)? {
            Emitter::Area { shape, .. } | Emitter::TexturedArea { shape, .. } => Some(*shape),
            _ => None,
        }
    }

    /// All lights, by their ids.
    pub fn emitters(&self) -> &[Emitter] {
        self.lights.emitters()
    }

    /// dp/du and dp/dv at a hit, for bump maps; either is zero where it is undefined.
    pub fn dp_duv(&self, hit: &Hit) -> (Vec3, Vec3) {
        self.world.dp_duv(hit)
    }

    /// All that can be hit.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// How the surface scatters at `hit`, seen from `hit.wo`; `u` in [0,1) decides where chance does.
    #[inline]
    pub fn shade(&self, hit: &Hit, u: f32) -> Shading {
        self.material(hit).shade(hit, u, || self.world.dp_duv(hit))
    }

    /// The surface of `shading`, which was made for `hit` and `u`, seen from the unit vector `wo` instead.
    #[inline]
    pub fn seen_from(&self, hit: &Hit, shading: &Shading, u: f32, wo: Vec3) -> Shading {
        match shading.is_bent() {
            true => self.shade(&Hit { wo, ..*hit }, u),
            false => shading.turned_to(wo),
        }
    }

    /// Whether [`Scene::shade`] uses `u` for some material.
    #[inline]
    pub fn materials_are_mixed(&self) -> bool {
        self.mixed
    }

    /// Share of light that passes along `ray` through masks and boundaries that are not there, at most
    /// `passes` of them; 0 where anything else stands in the way.
    #[inline]
    pub fn transmittance(&self, ray: &Ray, passes: u32) -> f32 {
        if !self.occluded(ray) {
            return 1.0;
        }
        match self.masked {
            true => self.through_masks(*ray, passes),
            false => 0.0,
        }
    }

    fn through_masks(&self, mut ray: Ray, passes: u32) -> f32 {
        let mut through = 1.0;
        for _ in 0..passes {
            let Some(hit) = self.intersect(&ray) else {
                return through;
            };
            through *= 1.0 - self.material(&hit).opacity(&material::at(&hit));
            if through == 0.0 {
                return 0.0;
            }
            let next = hit.spawn(ray.d);
            ray.t_max -= ray.o.distance(next.o);
            ray.o = next.o;
        }
        match self.occluded(&ray) {
            true => 0.0,
            false => through,
        }
    }

    #[inline]
    fn material(&self, hit: &Hit) -> &Material {
        &self.materials[self.surfaces[hit.shape.0 as usize].0 as usize]
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
        self.lights.sample(self.world.geometries(), from, u_pick, u)
    }

    /// Density per steradian with which [`Scene::sample_light`] connects `from` to the emitter at `met`.
    #[inline]
    pub fn pdf_light(&self, from: &Hit, met: &Hit) -> f32 {
        self.lights.pdf(self.world.geometries(), from, met)
    }

    /// The same for light from infinity along `d`.
    #[inline]
    pub fn pdf_light_escaped(&self, from: &Hit, d: Vec3) -> f32 {
        self.lights.pdf_escaped(from, d)
    }

    /// Light that leaves one of the emitters; see [`Lights::sample_emission`].
    #[inline]
    pub fn sample_emission(&self, aim: &Aim, u: &EmissionNumbers) -> Option<Emission> {
        self.lights.sample_emission(self.world.geometries(), aim, u)
    }

    /// As [`Scene::sample_light`], with the densities of the light that would have come from there by
    /// emission, and the probability of the choice of the light.
    #[inline]
    pub fn sample_light_both_ways(
        &self,
        aim: &Aim,
        from: &Hit,
        u_pick: f32,
        u: Vec2,
    ) -> Option<(EmitterSample, EmissionPdf, f32)> {
        let geoms = self.world.geometries();
        self.lights.sample_both_ways(geoms, aim, from, u_pick, u)
    }

    /// Densities with which light is emitted at `met` along `met.wo`; `None` for what does not shine there.
    #[inline]
    pub fn pdf_emission(&self, aim: &Aim, met: &Hit) -> Option<EmissionPdf> {
        self.lights.pdf_emission(self.world.geometries(), aim, met)
    }

    /// The same for light from infinity that arrives at `at` from the direction `wi`.
    #[inline]
    pub fn pdf_emission_escaped(&self, aim: &Aim, at: &Hit, wi: Vec3) -> Option<EmissionPdf> {
        self.lights.pdf_emission_escaped(aim, at, wi)
    }

    /// Density with which [`Scene::sample_light`] connects `from` to `source`, in the measure of
    /// [`EmissionPdf::start`].
    #[inline]
    pub fn pdf_connection(&self, from: &Hit, source: &Source) -> f32 {
        self.lights
            .pdf_connection(self.world.geometries(), from, source)
    }

    /// Whether the surface at `hit` has a lobe that is not a delta one: light that arrives there is worth
    /// remembering, whatever chance makes of the material.
    #[inline]
    pub fn receives(&self, hit: &Hit) -> bool {
        self.material(hit).receives()
    }

    /// Whether light can be thrown onto a surface by delta lobes alone; if not, why.
    pub fn throws_caustics(&self) -> Result<(), &'static str> {
        let any = |asks: fn(&Material) -> bool| {
            let mut used = self
                .surfaces
                .iter()
                .map(|id| &self.materials[id.0 as usize]);
            used.any(asks)
        };
        if !self.has_lights() {
            Err("there is no emitter")
        } else if !any(Material::is_specular) {
            Err("no surface has a delta lobe that reflects or refracts")
        } else if !any(Material::receives) {
            Err("no surface has a lobe other than delta ones, that a caustic could be seen on")
        } else {
            Ok(())
        }
    }

    /// Whether some surface has a diffuse lobe.
    pub fn is_diffuse(&self) -> bool {
        self.diffuse_shapes().next().is_some()
    }

    fn diffuse_shapes(&self) -> impl Iterator<Item = ShapeId> + '_ {
        let shapes = (0..self.surfaces.len() as u32).map(ShapeId);
        shapes.filter(|shape| {
            let material = self.surfaces[shape.0 as usize];
            let material = self.materials.get(material.0 as usize);
            material.is_some_and(Material::is_diffuse)
        })
    }

    /// Whether there can be diffuse surfaces that see each other, and light on them; if not, why.
    pub fn exchanges_diffuse_light(&self) -> Result<(), &'static str> {
        if !self.has_lights() {
            return Err("there is no emitter");
        }
        let mut shapes = self.diffuse_shapes();
        let (Some(first), second) = (shapes.next(), shapes.next()) else {
            return Err("no surface reflects diffusely");
        };
        // A flat surface does not see itself, nor does a ball from outside; one that is not flat, or stands in
        // several places, may.
        let alone = second.is_none() && self.world.placement_of(first).is_none();
        let geometry = &self.world.geometries()[first.0 as usize];
        let single = match geometry {
            Geometry::Mesh(mesh) => mesh.indices().len() == 1,
            Geometry::Disk(_) => true,
            _ => false,
        };
        match alone && single {
            true => Err("a single flat surface reflects diffusely, which does not light itself"),
            false => Ok(()),
        }
    }

    /// Whether some surface scatters light about single directions, as rough metal and glass do.
    pub fn is_glossy(&self) -> bool {
        let used = |id: &MaterialId| self.materials.get(id.0 as usize);
        self.surfaces
            .iter()
            .filter_map(used)
            .any(Material::is_glossy)
    }

    /// An aim, where that pays, of a share of the light at all that can throw a caustic.
    pub fn aim_partly_at_caustics(&self) -> Aim {
        let specular = |shape: &ShapeId| {
            let material = self.surfaces[shape.0 as usize];
            self.materials[material.0 as usize].is_specular()
        };
        let shapes = (0..self.surfaces.len() as u32).map(ShapeId);
        let shapes: Vec<ShapeId> = shapes.filter(specular).collect();
        Aim::around(&self.world, &shapes)
    }

    /// An aim at all that can throw a caustic: light that meets none of it first is not emitted. Where aiming does
    /// not pay, light is emitted everywhere.
    pub fn aim_at_caustics(&self) -> Aim {
        let aim = self.aim_partly_at_caustics();
        Aim {
            share: if aim.share > 0.0 { 1.0 } else { 0.0 },
            ..aim
        }
    }

    /// Adds a decision to the plan.
    pub fn decide(&mut self, entry: PlanEntry) {
        self.plan.entries.push(entry);
    }

    /// Chooses among the lights by `strategy` from now on: for comparisons, since the one that is chosen by
    /// itself is meant to be the best.
    pub fn choose_lights_by(&mut self, strategy: Strategy) {
        let emitters = self.lights.emitters().to_vec();
        self.lights = Lights::in_world(emitters, &self.world, strategy);
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

    /// Whether anything in the scene moves while the shutter is open.
    pub fn moves(&self) -> bool {
        self.world.moves()
    }

    /// The point of the world that all coordinates of the scene are relative to.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    pub fn counts(&self) -> Counts {
        let geometries = self.world.geometries();
        let (mut triangles, mut meshes) = (0, 0);
        for g in geometries.iter().filter(|g| g.is_mesh()) {
            triangles += g.prim_count() as usize;
            meshes += 1;
        }
        Counts {
            shapes: geometries.len(),
            triangles,
            analytic: geometries.len() - meshes,
            instances: self.world.places().len(),
            materials: self.materials.len(),
            emitters: self.lights.emitters().len(),
            geometry_bytes: self.world.bytes(),
        }
    }
}

impl std::fmt::Debug for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Scene {:?}", self.counts())
    }
}

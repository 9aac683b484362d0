//! From the description of a scene to a job that can be rendered: every default settled, every name
//! turned into an index, the plan made.

mod attributes;
mod camera;
mod film;
mod integrator;
mod lights;
mod materials;
mod shapes;
mod world;

use super::error::command_line;
use super::plugins::Category;
use super::{SceneDesc, SceneError, did_you_mean, list};
use crate::film::Window;
use crate::math::DVec3;
use crate::render::{AovLayer, Job};
use crate::scene::{Plan, Scene};
use crate::transport::aov::Aov;
use crate::transport::candidates::{self, Candidate};
use materials::Materials;
use world::Layout;

/// What the command line asks for in place of what the scene says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Name of an integrator, or `auto`.
    pub integrator: Option<String>,
    /// What a path tracer makes of light between diffuse surfaces: `none`, `gather`, `guide`.
    pub indirect: Option<String>,
    /// Name of a sampler.
    pub sampler: Option<String>,
    /// Longest path in edges; -1 sets no limit.
    pub max_depth: Option<i64>,
    /// Width and height of the full picture in pixels.
    pub resolution: Option<[u32; 2]>,
    pub crop: Option<Window>,
    /// Layers beside the colours: `albedo`, `normal`, `depth`, `position`, `uv`, `shape_id`.
    pub aovs: Vec<String>,
    pub seed: Option<u64>,
}

/// A scene ready to render.
#[derive(Debug)]
pub struct Compiled {
    pub job: Job,
    /// Integrators that one is to be chosen from by [`Job::choose`], if the command line leaves that open.
    pub choice: Option<Vec<Candidate>>,
    /// Samples per pixel that the scene asks for.
    pub spp: u64,
    /// What the user should know although it is no error.
    pub warnings: Vec<String>,
    /// Hash of the description after substitution, hexadecimal.
    pub hash: String,
}

/// Makes a job of a description. Mesh and image files are read here.
///
/// # Errors
/// A missing sensor, files that cannot be read, values that contradict each other, overrides that do
/// not exist, and parameters that have no effect where they stand.
pub fn compile(desc: &SceneDesc, overrides: &Overrides) -> Result<Compiled, SceneError> {
    let root = desc.scene();
    let mut plan = Plan::default();
    let mut warnings = Vec::new();
    let sensor = camera::the_sensor(&root, &root.children(Category::Shape), &mut warnings)?;
    let shutter = camera::shutter(&sensor.props)?;
    let mut film = film::film(&sensor.props, overrides)?;
    let sampler = film::sampler(&sensor.props, overrides, &mut plan)?;
    let (integrator, mut aovs) = integrator::integrator(&root, overrides)?;
    if film.pixel_format.has_alpha() {
        aovs.push(AovLayer {
            name: "A".to_string(),
            aov: Aov::Alpha,
        });
    }

    let layout = Layout::new(&root, shutter, &mut warnings)?;
    let mut sources = layout.read()?;
    let mut materials = Materials::new(desc, shapes::take_attributes(&mut sources));
    let (world, center) = layout.place(sources, &mut plan)?;
    let measured = layout.measured(&sensor)?;
    let shape_props = layout.shapes;
    let mut surfaces = Vec::with_capacity(shape_props.len());
    for props in &shape_props {
        surfaces.push(materials.of_shape(props)?);
    }
    let lights = lights::lights(
        &root,
        &shape_props,
        &world,
        &mut materials,
        center,
        &mut warnings,
    )?;
    if lights.is_empty() {
        warnings.push("the scene has no emitter, so the picture is black".to_string());
    }
    let camera = camera::camera(&sensor, shutter, &mut film.spec, (&world, measured), center)?;
    integrator::check_camera(&integrator, &camera, (&root, &sensor.props), overrides)?;
    camera::plan(&camera, camera.moves() || world.moves(), shutter, &mut plan);
    let materials = materials.finish(&mut plan, &mut warnings);
    desc.check_all_read()?;
    let mut scene = Scene::with_world(world, surfaces, materials, lights, center, plan);
    let choice = integrator::candidates(&integrator, &scene, overrides);
    match &choice {
        Some(candidates) => scene.decide(candidates::plan(candidates)),
        None => integrator
            .plan(&scene)
            .into_iter()
            .for_each(|entry| scene.decide(entry)),
    }
    let job = Job {
        scene,
        camera,
        film: film.spec,
        sampler: sampler.kind,
        seed: overrides.seed.unwrap_or(sampler.seed),
        integrator,
        aovs,
        pixel_format: film.pixel_format,
        component_format: film.component_format,
    };
    if choice.is_none() {
        integrator::check_memory(&job, &root, overrides)?;
    }
    Ok(Compiled {
        job,
        choice,
        spp: sampler.spp,
        warnings,
        hash: desc.hash(),
    })
}

/// Largest coordinate of what a scene is made of, in scene units: squares of distances stay far within f32,
/// in which rays are traced.
const MAX_COORDINATE: f64 = 1e15;

/// Whether `p`, world space, is near enough to the origin to be rendered.
fn within_reach(p: DVec3) -> bool {
    p.abs().max_element() <= MAX_COORDINATE
}

/// What is wrong where [`within_reach`] says no.
fn out_of_reach(what: &str) -> String {
    format!("{what} lies more than {MAX_COORDINATE:e} from the origin, too far to be rendered")
}

/// An error in what the command line asks for.
fn on_command_line(option: &str, value: &str, what: impl Into<String>) -> SceneError {
    SceneError::new(command_line(option, value), what)
}

/// A help line for a name that is not among `names`: the nearest one, or all of them.
fn suggest<'a>(found: &str, names: impl IntoIterator<Item = &'a str> + Clone) -> String {
    did_you_mean(found, names.clone()).unwrap_or_else(|| format!("there are {}", list(names)))
}

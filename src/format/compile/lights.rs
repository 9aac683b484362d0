//! Emitters of shapes and of the scene.

use std::collections::HashSet;

use super::camera::field_of_view;
use super::materials::Materials;
use super::{out_of_reach, within_reach};
use crate::format::plugins::Category;
use crate::format::{Props, RgbOrTexture, SceneError};
use crate::geom::{Geometry, ShapeId, World};
use crate::light::{Emitter, EnvError, EnvMap, Projector, ProjectorSpec, Spot, SpotSpec, has_feet};
use crate::math::DVec3;
use crate::texture::Texture;

/// The emitters of all shapes, in their order, then those that stand by themselves. `world` holds the
/// compiled `shapes`.
pub fn lights<'a>(
    root: &Props<'a>,
    shapes: &[Props<'a>],
    world: &World,
    materials: &mut Materials<'a>,
    center: DVec3,
    warnings: &mut Vec<String>,
) -> Result<Vec<Emitter>, SceneError> {
    let mut emitters = Vec::new();
    let mut used = HashSet::new();
    for (i, shape) in shapes.iter().enumerate() {
        materials.enter(Some(shape));
        for emitter in shape.children(Category::Emitter) {
            used.insert(emitter.object_id());
            let shape = ShapeId(i as u32);
            emitters.push(surface(&emitter, shape, world, materials)?);
        }
    }
    materials.enter(None);
    let mut environment: Option<Props> = None;
    for emitter in root.children(Category::Emitter) {
        if is_surface(&emitter) {
            // At the top of the file it is a definition that shapes refer to.
            if !used.contains(&emitter.object_id()) {
                let at = emitter.place();
                warnings.push(format!(
                    "{}:{}:{}: this {} emitter belongs to no shape and gives no light",
                    at.file.display(),
                    at.line,
                    at.column,
                    emitter.plugin()
                ));
            }
            continue;
        }
        ignore_weight(&emitter);
        if matches!(emitter.plugin(), "constant" | "envmap") {
            if let Some(first) = &environment {
                return Err(second_environment(&emitter, first));
            }
            environment = Some(emitter);
        }
        emitters.push(match emitter.plugin() {
            "point" => point(&emitter, center)?,
            "spot" => spot(&emitter, materials, center)?,
            "projector" => projector(&emitter, materials, center)?,
            "directional" => directional(&emitter)?,
            "constant" => {
                emitter.ignore(&["to_world"]);
                Emitter::Constant {
                    radiance: emitter.rgb("radiance")?,
                }
            }
            _ => envmap(&emitter, materials)?,
        });
    }
    Ok(emitters)
}

/// Whether the emitter belongs to a shape.
fn is_surface(emitter: &Props) -> bool {
    matches!(emitter.plugin(), "area" | "directionalarea")
}

/// The weight guides Mitsuba's choice of a light; here power and distance do.
fn ignore_weight(emitter: &Props) {
    emitter.ignore(&["sampling_weight"]);
}

fn second_environment(emitter: &Props, first: &Props) -> SceneError {
    let at = first.place();
    let what = format!(
        "a second environment: the first is at {}:{}:{}",
        at.file.display(),
        at.line,
        at.column
    );
    let error = emitter.error(what);
    error.with_help("a scene has one environment at most")
}

fn surface<'a>(
    p: &Props<'a>,
    shape: ShapeId,
    world: &World,
    materials: &mut Materials<'a>,
) -> Result<Emitter, SceneError> {
    if !is_surface(p) {
        let what = format!("a shape cannot be an emitter of type \"{}\"", p.plugin());
        return Err(p
            .error(what)
            .with_help("use \"area\", or put the emitter beside the shape"));
    }
    ignore_weight(p);
    let geometry = &world.geometries()[shape.0 as usize];
    if let Geometry::Deforming(_) = geometry {
        let what = "a mesh that changes its form cannot be an emitter";
        let help = "leave filename_end out, or move the shape as a whole by an <animation>";
        return Err(p.error(what).with_help(help));
    }
    let radiance = materials.resolve(p.rgb_or_texture("radiance")?)?;
    if p.plugin() == "area" {
        return Ok(match radiance {
            Texture::Constant(radiance) => Emitter::Area { shape, radiance },
            radiance => Emitter::TexturedArea { shape, radiance },
        });
    }
    if !has_feet(geometry) {
        let what = "a smooth mesh, or a shape that curves inwards, cannot shine along its normals";
        return Err(p
            .error(what)
            .with_help("set face_normals of a mesh, or use a flat shape"));
    }
    if world.placement_of(shape).is_some() {
        let what = "a shape that moves cannot shine along its normals";
        let help = "use an \"area\" emitter, or let the shape stand still";
        return Err(p.error(what).with_help(help));
    }
    let exitance = radiance;
    Ok(Emitter::Beam { shape, exitance })
}

/// Where the image of the origin lies, if that can be rendered.
fn standpoint(p: &Props) -> Result<DVec3, SceneError> {
    let position = p.transform("to_world")?.point(DVec3::ZERO);
    match within_reach(position) {
        true => Ok(position),
        false => Err(p.error_at("to_world", out_of_reach("the emitter"))),
    }
}

fn point(p: &Props, center: DVec3) -> Result<Emitter, SceneError> {
    let position = match p.is_given("to_world") {
        true => standpoint(p)?,
        false => p.vec3("position")?,
    };
    if !within_reach(position) {
        return Err(p.error_at("position", out_of_reach("the emitter")));
    }
    Ok(Emitter::Point {
        p: (position - center).as_vec3(),
        intensity: p.rgb("intensity")?,
    })
}

fn spot<'a>(
    p: &Props<'a>,
    materials: &mut Materials<'a>,
    center: DVec3,
) -> Result<Emitter, SceneError> {
    standpoint(p)?;
    let cutoff = p.float("cutoff_angle")?;
    let beam = p.opt_float("beam_width")?.unwrap_or(0.75 * cutoff);
    let texture = match p.opt_rgb_or_texture("texture")? {
        None => None,
        Some(RgbOrTexture::Rgb(_)) => {
            let error = p.error_at("texture", "the texture of a spot light is a single colour");
            return Err(error.with_help("multiply the intensity by it instead"));
        }
        Some(_) if cutoff >= 90.0 => {
            let what = "a spot light with a texture cannot reach 90 degrees from its axis";
            return Err(p.error_at("cutoff_angle", what));
        }
        Some(value) => Some(materials.resolve(value)?),
    };
    let spec = SpotSpec {
        to_world: p.transform("to_world")?,
        intensity: p.rgb("intensity")?,
        cutoff: cutoff.to_radians() as f32,
        beam: beam.to_radians() as f32,
        texture,
    };
    Ok(Emitter::Spot(Spot::new(spec, center)))
}

fn projector<'a>(
    p: &Props<'a>,
    materials: &mut Materials<'a>,
    center: DVec3,
) -> Result<Emitter, SceneError> {
    standpoint(p)?;
    let value = p.rgb_or_texture("irradiance")?;
    let irradiance = materials.resolve(value)?;
    let [w, h] = match value {
        RgbOrTexture::Rgb(_) => [1.0; 2],
        RgbOrTexture::Texture(id) => materials.picture_size(id).map(f64::from),
    };
    let (fov_deg, axis) = field_of_view(p)?;
    let half_width = axis.half_width(fov_deg, w, h);
    let spec = ProjectorSpec {
        to_world: p.transform("to_world")?,
        irradiance,
        scale: p.float("scale")? as f32,
        half_extent: [half_width, half_width * h / w],
    };
    Ok(Emitter::Projector(Projector::new(spec, center)))
}

fn directional(p: &Props) -> Result<Emitter, SceneError> {
    let along = match p.opt_vec3("direction")? {
        Some(direction) => direction,
        None => p.transform("to_world")?.vector(DVec3::Z),
    };
    let d = along.try_normalize().ok_or_else(|| {
        let what = "the direction has no length";
        p.error_at("direction", what)
    })?;
    Ok(Emitter::Directional {
        d: d.as_vec3(),
        irradiance: p.rgb("irradiance")?,
    })
}

fn envmap(p: &Props, materials: &mut Materials) -> Result<Emitter, SceneError> {
    let picture = materials.environment(p)?;
    let (width, height) = (picture.width as usize, picture.height as usize);
    // It changes the noise, not the picture.
    p.ignore(&["mis_compensation"]);
    let map = EnvMap::new(
        picture.colors(),
        width,
        height,
        &p.transform("to_world")?,
        p.float("scale")? as f32,
    );
    map.map(Emitter::Image).map_err(|e| {
        let parameter = match e {
            EnvError::NotRigid => "to_world",
            _ => "filename",
        };
        p.error_at(parameter, e.to_string())
    })
}

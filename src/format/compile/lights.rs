//! Emitters of shapes and of the scene.

use std::collections::HashSet;

use super::materials::Materials;
use super::{out_of_reach, within_reach};
use crate::format::plugins::Category;
use crate::format::{Props, RgbOrTexture, SceneError};
use crate::geom::ShapeId;
use crate::light::{Emitter, EnvMap};
use crate::math::DVec3;

pub fn lights(
    root: &Props,
    shapes: &[Props],
    materials: &mut Materials,
    center: DVec3,
    warnings: &mut Vec<String>,
) -> Result<Vec<Emitter>, SceneError> {
    let mut emitters = Vec::new();
    let mut used = HashSet::new();
    for (i, shape) in shapes.iter().enumerate() {
        materials.enter(Some(shape));
        for emitter in shape.children(Category::Emitter) {
            if emitter.plugin() != "area" {
                let what = format!(
                    "a shape cannot be an emitter of type \"{}\"",
                    emitter.plugin()
                );
                return Err(emitter
                    .error(what)
                    .with_help("use \"area\", or put the emitter beside the shape"));
            }
            if shape.is_given("filename_end") {
                let what = "a mesh that changes its form cannot be an emitter";
                let help = "leave filename_end out, or move the shape as a whole by an <animation>";
                return Err(emitter.error(what).with_help(help));
            }
            ignore_weight(&emitter);
            used.insert(emitter.object_id());
            let radiance = match emitter.rgb_or_texture("radiance")? {
                RgbOrTexture::Rgb(c) => c,
                RgbOrTexture::Texture(id) => {
                    let constant = materials.texture(id)?.as_constant();
                    constant.ok_or_else(|| {
                        let error =
                            emitter.error_at("radiance", "a textured radiance is not supported");
                        error.with_help("give a single colour")
                    })?
                }
            };
            emitters.push(Emitter::Area {
                shape: ShapeId(i as u32),
                radiance,
            });
        }
    }
    materials.enter(None);
    let mut environment: Option<Props> = None;
    for emitter in root.children(Category::Emitter) {
        if emitter.plugin() == "area" {
            // At the top of the file it is a definition that shapes refer to.
            if !used.contains(&emitter.object_id()) {
                let at = emitter.place();
                warnings.push(format!(
                    "{}:{}:{}: this area emitter belongs to no shape and gives no light",
                    at.file.display(),
                    at.line,
                    at.column
                ));
            }
            continue;
        }
        ignore_weight(&emitter);
        if emitter.plugin() == "point" {
            emitters.push(point(&emitter, center)?);
            continue;
        }
        if let Some(first) = &environment {
            let what = {
                let at = first.place();
                format!(
                    "a second environment: the first is at {}:{}:{}",
                    at.file.display(),
                    at.line,
                    at.column
                )
            };
            return Err(emitter
                .error(what)
                .with_help("a scene has one environment at most"));
        }
        emitters.push(match emitter.plugin() {
            "constant" => {
                emitter.ignore(&["to_world"]);
                Emitter::Constant {
                    radiance: emitter.rgb("radiance")?,
                }
            }
            _ => envmap(&emitter, materials)?,
        });
        environment = Some(emitter);
    }
    Ok(emitters)
}

/// The weight guides Mitsuba's choice of a light; here power and distance do.
fn ignore_weight(emitter: &Props) {
    emitter.ignore(&["sampling_weight"]);
}

fn point(p: &Props, center: DVec3) -> Result<Emitter, SceneError> {
    let position = match p.is_given("to_world") {
        true => p.transform("to_world")?.point(DVec3::ZERO),
        false => p.vec3("position")?,
    };
    if !within_reach(position) {
        let name = if p.is_given("to_world") {
            "to_world"
        } else {
            "position"
        };
        return Err(p.error_at(name, out_of_reach("the emitter")));
    }
    Ok(Emitter::Point {
        p: (position - center).as_vec3(),
        intensity: p.rgb("intensity")?,
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
    map.map(Emitter::Image)
        .map_err(|e| p.error_at("filename", e.to_string()))
}

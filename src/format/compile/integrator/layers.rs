//! Layers beside the colours, as the command line and wrappers ask for them.

use crate::format::compile::{on_command_line, suggest};
use crate::format::{Overrides, Props, SceneError};
use crate::render::AovLayer;
use crate::transport::aov::Aov;

/// Names of `--aov`.
const LAYERS: [(&str, Aov); 6] = [
    ("albedo", Aov::Albedo),
    ("normal", Aov::ShadingNormal),
    ("depth", Aov::Depth),
    ("position", Aov::Position),
    ("uv", Aov::Uv),
    ("shape_id", Aov::ShapeIndex),
];
/// Types of Mitsuba's `aov` integrator.
const TYPES: [(&str, Aov); 8] = [
    ("albedo", Aov::Albedo),
    ("sh_normal", Aov::ShadingNormal),
    ("geo_normal", Aov::GeometricNormal),
    ("depth", Aov::Depth),
    ("position", Aov::Position),
    ("uv", Aov::Uv),
    ("shape_index", Aov::ShapeIndex),
    ("prim_index", Aov::PrimIndex),
];
/// Further types of Mitsuba's.
const UNSUPPORTED: [&str; 5] = ["boundary_test", "dp_du", "dp_dv", "duv_dx", "duv_dy"];
/// Layers that every picture has.
const OWN_LAYERS: [&str; 2] = ["stderr", "spp"];
/// Bytes of a layer's name: with the channel's they must stay below the 255 of an EXR file.
const LAYER_NAME_BYTES: usize = 200;

/// Adds the layers that the command line asks for.
pub fn asked_for(overrides: &Overrides, layers: &mut Vec<AovLayer>) -> Result<(), SceneError> {
    for name in &overrides.aovs {
        let Some((_, aov)) = LAYERS.iter().find(|(n, _)| n == name) else {
            let what = format!("unknown layer \"{name}\"");
            return Err(
                on_command_line("--aov", name, what).with_help(suggest(name, LAYERS.map(|l| l.0)))
            );
        };
        add(layers, name, *aov).map_err(|what| on_command_line("--aov", name, what))?;
    }
    Ok(())
}

/// Adds the layers that the integrator "aov" of `props` lists.
pub fn of_wrapper(props: &Props, layers: &mut Vec<AovLayer>) -> Result<(), SceneError> {
    for part in props
        .string("aovs")?
        .split(',')
        .map(str::trim)
        .filter(|p| !p.is_empty())
    {
        let Some((name, kind)) = part.split_once(':') else {
            let what = format!("expected name:type, found \"{part}\"");
            return Err(props.error_at("aovs", what));
        };
        let (name, kind) = (name.trim(), kind.trim());
        let Some((_, aov)) = TYPES.iter().find(|(n, _)| *n == kind) else {
            let error = match UNSUPPORTED.contains(&kind) {
                true => props.error_at(
                    "aovs",
                    format!("output variable \"{kind}\" is not supported"),
                ),
                false => {
                    let what = format!("unknown type \"{kind}\" of output variable \"{name}\"");
                    props.error_at("aovs", what)
                }
            };
            return Err(error.with_help(suggest(kind, TYPES.map(|t| t.0))));
        };
        add(layers, name, *aov).map_err(|what| props.error_at("aovs", what))?;
    }
    Ok(())
}

/// Adds a layer, or says why it could not be written once the picture is rendered.
pub fn add(layers: &mut Vec<AovLayer>, name: &str, aov: Aov) -> Result<(), String> {
    if name.is_empty() {
        return Err("an output variable has no name".to_string());
    }
    if OWN_LAYERS.contains(&name) {
        return Err(format!(
            "\"{name}\" is the name of a layer that every picture has"
        ));
    }
    if name.len() > LAYER_NAME_BYTES || name.chars().any(char::is_control) {
        return Err("the name of an output variable is too long, or not printable".to_string());
    }
    if layers.iter().any(|l| l.name == name) {
        return Err(format!("two layers would have the name \"{name}\""));
    }
    layers.push(AovLayer {
        name: name.to_string(),
        aov,
    });
    Ok(())
}

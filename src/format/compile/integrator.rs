//! The integrator, and the layers that its wrappers ask for.

use super::{on_command_line, suggest};
use crate::format::plugins::Category;
use crate::format::{Overrides, Props, SceneError};
use crate::render::AovLayer;
use crate::transport::aov::Aov;
use crate::transport::{BidirSpec, DirectSpec, IntegratorSpec, Method, PathSpec, PhotonSpec};

const NAMES: [&str; 6] = ["path", "direct", "bdpt", "ptracer", "vcm", "sppm"];
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
const DEFAULT_RR_DEPTH: u32 = 5;

pub fn integrator(
    root: &Props,
    overrides: &Overrides,
) -> Result<(IntegratorSpec, Vec<AovLayer>), SceneError> {
    let mut layers = Vec::new();
    let spec = match root.child(Category::Integrator) {
        Some(props) => unwrap(&props, &mut layers)?,
        None => None,
    };
    let spec = spec.unwrap_or(default_path());
    let mut spec = match &overrides.integrator {
        Some(name) => replaced(spec, name)?,
        None => spec,
    };
    if let Some(depth) = overrides.max_depth {
        match &mut spec {
            IntegratorSpec::Path(path) => path.max_depth = depth_limit(depth),
            IntegratorSpec::Bidirectional(spec) => spec.max_depth = depth_limit(depth),
            IntegratorSpec::Direct(_) => {
                let what = "the integrator \"direct\" has no depth to set";
                return Err(on_command_line("--max-depth", &depth.to_string(), what)
                    .with_help("leave --max-depth out, or give --integrator path"));
            }
        }
    }
    for name in &overrides.aovs {
        let Some((_, aov)) = LAYERS.iter().find(|(n, _)| n == name) else {
            let what = format!("unknown layer \"{name}\"");
            return Err(
                on_command_line("--aov", name, what).with_help(suggest(name, LAYERS.map(|l| l.0)))
            );
        };
        add_layer(&mut layers, name, *aov).map_err(|what| on_command_line("--aov", name, what))?;
    }
    Ok((spec, layers))
}

fn default_path() -> IntegratorSpec {
    IntegratorSpec::Path(PathSpec {
        max_depth: None,
        rr_depth: DEFAULT_RR_DEPTH,
        hide_emitters: false,
    })
}

fn depth_limit(depth: i64) -> Option<u32> {
    u32::try_from(depth).ok()
}

/// The integrator inside any wrappers; `None` where wrappers hold none.
fn unwrap(props: &Props, layers: &mut Vec<AovLayer>) -> Result<Option<IntegratorSpec>, SceneError> {
    // How the work is divided changes nothing in the picture.
    props.ignore(&["samples_per_pass", "block_size"]);
    if props.float("timeout")? > 0.0 {
        let error = props.error_at("timeout", "a timeout in the scene is not supported");
        return Err(error.with_help("use --time to limit the time"));
    }
    let hide_emitters = props.bool("hide_emitters")?;
    match props.plugin() {
        "path" => Ok(Some(IntegratorSpec::Path(PathSpec {
            max_depth: depth_limit(props.int("max_depth")?),
            rr_depth: props.int("rr_depth")? as u32,
            hide_emitters,
        }))),
        "direct" => direct(props, hide_emitters).map(Some),
        wrapper => {
            if wrapper == "moment" {
                add_layer(layers, "m2", Aov::SecondMoment).map_err(|what| props.error(what))?;
            } else {
                aov_layers(props, layers)?;
            }
            let nested = props.children(Category::Integrator);
            let mut inner = None;
            for (i, child) in nested.iter().enumerate() {
                if i > 0 {
                    let what =
                        format!("several integrators inside \"{wrapper}\" are not supported");
                    return Err(child.error(what).with_help("keep one of them"));
                }
                inner = unwrap(child, layers)?;
            }
            if let Some(IntegratorSpec::Path(PathSpec {
                hide_emitters: hide,
                ..
            }))
            | Some(IntegratorSpec::Direct(DirectSpec {
                hide_emitters: hide,
                ..
            })) = &mut inner
            {
                *hide |= hide_emitters;
            }
            Ok(inner)
        }
    }
}

fn direct(props: &Props, hide_emitters: bool) -> Result<IntegratorSpec, SceneError> {
    let shared = props
        .is_given("shading_samples")
        .then(|| props.int("shading_samples"))
        .transpose()?;
    let count = |name: &str| shared.map_or_else(|| props.int(name), Ok);
    let spec = DirectSpec {
        emitter_samples: count("emitter_samples")? as u32,
        bsdf_samples: count("bsdf_samples")? as u32,
        hide_emitters,
    };
    if spec.emitter_samples == 0 && spec.bsdf_samples == 0 {
        return Err(props.error("neither the emitters nor the BSDF would be sampled"));
    }
    if spec.emitter_samples.max(spec.bsdf_samples) > MAX_SPLIT {
        return Err(props.error(format!(
            "more than {MAX_SPLIT} samples per hit are not supported"
        )));
    }
    Ok(IntegratorSpec::Direct(spec))
}

/// Most samples per hit of the direct integrator.
const MAX_SPLIT: u32 = 1 << 16;

fn aov_layers(props: &Props, layers: &mut Vec<AovLayer>) -> Result<(), SceneError> {
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
        add_layer(layers, name, *aov).map_err(|what| props.error_at("aovs", what))?;
    }
    Ok(())
}

/// Adds a layer, or says why it could not be written once the picture is rendered.
fn add_layer(layers: &mut Vec<AovLayer>, name: &str, aov: Aov) -> Result<(), String> {
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

/// The integrator `name` with the settings it shares with `spec`.
fn replaced(spec: IntegratorSpec, name: &str) -> Result<IntegratorSpec, SceneError> {
    let hide_emitters = match &spec {
        IntegratorSpec::Path(p) => p.hide_emitters,
        IntegratorSpec::Direct(d) => d.hide_emitters,
        IntegratorSpec::Bidirectional(b) => b.hide_emitters,
    };
    let bidirectional = |method| {
        Ok(IntegratorSpec::Bidirectional(BidirSpec {
            method,
            max_depth: None,
            rr_depth: DEFAULT_RR_DEPTH,
            hide_emitters,
            photons: PhotonSpec::default(),
        }))
    };
    match name {
        _ if name == spec.name() => Ok(spec),
        "path" => Ok(match default_path() {
            IntegratorSpec::Path(p) => IntegratorSpec::Path(PathSpec { hide_emitters, ..p }),
            other => other,
        }),
        "bdpt" => bidirectional(Method::Bdpt),
        "ptracer" => bidirectional(Method::Ptracer),
        "vcm" => bidirectional(Method::Vcm),
        "sppm" => bidirectional(Method::Sppm),
        "direct" => Ok(IntegratorSpec::Direct(DirectSpec {
            emitter_samples: 1,
            bsdf_samples: 1,
            hide_emitters,
        })),
        _ => {
            let what = format!("unknown integrator \"{name}\"");
            Err(on_command_line("--integrator", name, what).with_help(suggest(name, NAMES)))
        }
    }
}

//! The integrator, and the layers that its wrappers ask for.

mod bidir;
mod layers;
mod photons;
mod radiosity;

pub use bidir::check_camera;
pub use photons::check_memory;

use super::{on_command_line, suggest};
use crate::format::plugins::Category;
use crate::format::{Overrides, Props, SceneError};
use crate::render::AovLayer;
use crate::scene::Scene;
use crate::transport::aov::Aov;
use crate::transport::candidates::{self, Candidate};
use crate::transport::radiosity::Indirect;
use crate::transport::{
    CacheSpec, CombinedSpec, DirectSpec, IntegratorSpec, PathSpec, PhotonMapperSpec, RadiositySpec,
};

/// In place of a name: the most efficient one is to be found out.
const AUTO: &str = "auto";
const NAMES: [&str; 10] = [
    AUTO,
    "path",
    "direct",
    "bdpt",
    "ptracer",
    "vcm",
    "sppm",
    "combined",
    "photonmapper",
    "radiosity",
];

pub fn integrator(
    root: &Props,
    overrides: &Overrides,
) -> Result<(IntegratorSpec, Vec<AovLayer>), SceneError> {
    let mut found = Vec::new();
    let indirect = radiosity::wanted(overrides)?;
    let spec = match root.child(Category::Integrator) {
        Some(props) => unwrap(&props, indirect, &mut found)?,
        None => None,
    };
    let spec = spec.unwrap_or(IntegratorSpec::Path(PathSpec::default()));
    let mut spec = match &overrides.integrator {
        Some(name) => replaced(spec, name)?,
        None => spec,
    };
    if let (Some(AUTO), Some(way)) = (overrides.integrator.as_deref(), &overrides.indirect) {
        let what = "--integrator auto finds out by itself whether radiosity helps".to_string();
        return Err(on_command_line("--indirect", way, what).with_help("leave one of them out"));
    }
    spec = radiosity::overridden(spec, indirect)?;
    if let Some(depth) = overrides.max_depth {
        let name = spec.name();
        let Some(limit) = spec.max_depth() else {
            let what = format!("the integrator \"{name}\" has no depth to set");
            return Err(on_command_line("--max-depth", &depth.to_string(), what)
                .with_help("leave --max-depth out, or give --integrator path"));
        };
        *limit = depth_limit(depth);
    }
    layers::asked_for(overrides, &mut found)?;
    Ok((spec, found))
}

fn depth_limit(depth: i64) -> Option<u32> {
    u32::try_from(depth).ok()
}

/// The integrator inside any wrappers; `None` where wrappers hold none. `indirect` is what the command line wants.
fn unwrap(
    props: &Props,
    indirect: Option<Indirect>,
    found: &mut Vec<AovLayer>,
) -> Result<Option<IntegratorSpec>, SceneError> {
    // How the work is divided changes nothing in the picture.
    props.ignore(&["samples_per_pass", "block_size"]);
    if props.float("timeout")? > 0.0 {
        let error = props.error_at("timeout", "a timeout in the scene is not supported");
        return Err(error.with_help("use --time to limit the time"));
    }
    let hide_emitters = props.bool("hide_emitters")?;
    match props.plugin() {
        "path" => {
            let spec = IntegratorSpec::Path(path(props, hide_emitters)?);
            Ok(Some(spec.with_cache(radiosity::cache(props, indirect)?)))
        }
        "radiosity" => radiosity::shown(props, path(props, hide_emitters)?).map(Some),
        "combined" => Ok(Some(IntegratorSpec::Combined(photons::combined(
            props,
            path(props, hide_emitters)?,
            indirect,
        )?))),
        "photonmapper" => {
            let spec = photons::photon_mapper(props, path(props, hide_emitters)?)?;
            Ok(Some(IntegratorSpec::PhotonMapper(spec)))
        }
        "direct" => direct(props, hide_emitters).map(Some),
        "bdpt" | "ptracer" | "vcm" | "sppm" => {
            bidir::spec(props, path(props, hide_emitters)?).map(Some)
        }
        wrapper => {
            if wrapper == "moment" {
                layers::add(found, "m2", Aov::SecondMoment).map_err(|what| props.error(what))?;
            } else {
                layers::of_wrapper(props, found)?;
            }
            let nested = props.children(Category::Integrator);
            let mut inner = None;
            for (i, child) in nested.iter().enumerate() {
                if i > 0 {
                    let what =
                        format!("several integrators inside \"{wrapper}\" are not supported");
                    return Err(child.error(what).with_help("keep one of them"));
                }
                inner = unwrap(child, indirect, found)?;
            }
            if let Some(inner) = &mut inner {
                *inner.hide_emitters() |= hide_emitters;
            }
            Ok(inner)
        }
    }
}

/// The settings of a camera's walk.
fn path(props: &Props, hide_emitters: bool) -> Result<PathSpec, SceneError> {
    Ok(PathSpec {
        max_depth: depth_limit(props.int("max_depth")?),
        rr_depth: props.int("rr_depth")? as u32,
        hide_emitters,
    })
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

/// What `--integrator auto` is to choose from; `None` where the integrator is known.
pub fn candidates(
    spec: &IntegratorSpec,
    scene: &Scene,
    overrides: &Overrides,
) -> Option<Vec<Candidate>> {
    match (spec, overrides.integrator.as_deref()) {
        (IntegratorSpec::Combined(shared), Some(AUTO)) => {
            Some(candidates::candidates(shared, scene))
        }
        _ => None,
    }
}

/// The integrator `name` with the settings it shares with `spec`.
fn replaced(mut spec: IntegratorSpec, name: &str) -> Result<IntegratorSpec, SceneError> {
    if name == spec.name() {
        return Ok(spec);
    }
    let mut new = match name {
        "path" => IntegratorSpec::Path(PathSpec::default()),
        // It has the settings of all that may be chosen.
        "combined" | AUTO => IntegratorSpec::Combined(CombinedSpec::default()),
        "photonmapper" => IntegratorSpec::PhotonMapper(PhotonMapperSpec::default()),
        "radiosity" => IntegratorSpec::Radiosity(RadiositySpec::default()),
        "direct" => IntegratorSpec::Direct(DirectSpec {
            emitter_samples: 1,
            bsdf_samples: 1,
            hide_emitters: false,
        }),
        _ => match bidir::named(name) {
            Some(spec) => spec,
            None => {
                let what = format!("unknown integrator \"{name}\"");
                let error = on_command_line("--integrator", name, what);
                return Err(error.with_help(suggest(name, NAMES)));
            }
        },
    };
    *new.hide_emitters() = *spec.hide_emitters();
    if let (Some(to), Some(from)) = (new.max_depth(), spec.max_depth()) {
        *to = *from;
    }
    if let (Some(to), Some(from)) = (new.rr_depth(), spec.rr_depth()) {
        *to = *from;
    }
    if let (Some(to), Some(from)) = (new.photons(), spec.photons()) {
        *to = from.clone();
    }
    if let Some(solve) = spec.solve().cloned() {
        match new.cache() {
            Some(cache) => new = new.with_cache(CacheSpec { solve, ..cache }),
            None => new.solve().into_iter().for_each(|to| *to = solve.clone()),
        }
    }
    Ok(new)
}

//! Integrators that walk from lights as well as from the eye.

use super::photons;
use crate::format::compile::on_command_line;
use crate::format::plugins::Category;
use crate::format::{Overrides, Props, SceneError};
use crate::scene::Camera;
use crate::transport::{BidirSpec, IntegratorSpec, Method, PathSpec, PhotonSpec};

const METHODS: [Method; 4] = [Method::Bdpt, Method::Ptracer, Method::Vcm, Method::Sppm];

/// The method called `name`, with its defaults.
pub fn named(name: &str) -> Option<IntegratorSpec> {
    let method = METHODS.into_iter().find(|m| m.name() == name)?;
    let walk = PathSpec::default();
    let spec = settings(method, walk, PhotonSpec::default());
    Some(IntegratorSpec::Bidirectional(spec))
}

fn settings(method: Method, walk: PathSpec, photons: PhotonSpec) -> BidirSpec {
    BidirSpec {
        method,
        max_depth: walk.max_depth,
        rr_depth: walk.rr_depth,
        hide_emitters: walk.hide_emitters,
        light_image: true,
        photons,
    }
}

/// The method that `props` describes, with the settings of the eye's `walk`.
pub fn spec(props: &Props, walk: PathSpec) -> Result<IntegratorSpec, SceneError> {
    let name = props.plugin();
    let Some(method) = METHODS.into_iter().find(|m| m.name() == name) else {
        return Err(props.error(format!("\"{name}\" has no walk from lights")));
    };
    if method == Method::Sppm {
        // How the work is divided changes nothing in the picture.
        props.ignore(&["granularity"]);
        if props.int("max_passes")? != -1 {
            let what = "a number of passes in the integrator is not supported";
            let help = "set the sampler's sample_count or --spp: a pass is a sample of each pixel";
            return Err(props.error_at("max_passes", what).with_help(help));
        }
    }
    let light_image = method != Method::Bdpt || props.bool("light_image")?;
    if method == Method::Bdpt && !props.bool("sample_direct")? {
        let what = "bidirectional path tracing without samples of emitters is not supported";
        let help = "leave \"sample_direct\" out: each technique weighs most where it is good";
        return Err(props.error_at("sample_direct", what).with_help(help));
    }
    let photons = match method.merges() {
        true => photons::spec(props)?,
        false => PhotonSpec::default(),
    };
    Ok(IntegratorSpec::Bidirectional(BidirSpec {
        light_image,
        ..settings(method, walk, photons)
    }))
}

/// That the camera can be reached by an integrator which knows no other way to it.
pub fn check_camera(
    integrator: &IntegratorSpec,
    camera: &Camera,
    (root, sensor): (&Props, &Props),
    overrides: &Overrides,
) -> Result<(), SceneError> {
    let only_splats =
        matches!(integrator, IntegratorSpec::Bidirectional(spec) if spec.method == Method::Ptracer);
    if !only_splats || camera.can_be_connected() {
        return Ok(());
    }
    let sensor = sensor.plugin();
    let what =
        format!("the integrator \"ptracer\" cannot connect light to the sensor \"{sensor}\"");
    let error = match &overrides.integrator {
        Some(name) => on_command_line("--integrator", name, what),
        None => match innermost(root) {
            Some(props) => props.error(what),
            None => root.error(what),
        },
    };
    Err(error.with_help("use \"bdpt\", \"vcm\" or \"path\", which also walk from the sensor"))
}

/// The integrator inside all wrappers.
pub fn innermost<'a>(props: &Props<'a>) -> Option<Props<'a>> {
    let inner = props.child(Category::Integrator)?;
    match innermost(&inner) {
        Some(deeper) => Some(deeper),
        None => Some(inner),
    }
}

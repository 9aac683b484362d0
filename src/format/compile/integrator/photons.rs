//! Integrators that shoot photons.

use super::bidir::innermost;
use crate::format::compile::on_command_line;
use crate::format::{Overrides, Props, SceneError};
use crate::render::Job;
use crate::transport::radiosity::Indirect;
use crate::transport::{CombinedSpec, PathSpec, PhotonMapperSpec, PhotonSpec, Show};

/// Bytes of what memory is asked for in.
const MIB: u64 = 1 << 20;

/// How photons are shot and gathered, from the parameters that all such integrators share.
pub fn spec(props: &Props) -> Result<PhotonSpec, SceneError> {
    let given = |name: &str| props.is_given(name);
    Ok(PhotonSpec {
        count: match given("photon_count") {
            true => Some(props.int("photon_count")? as u64),
            false => None,
        },
        radius: match given("initial_radius") {
            true => Some(props.float("initial_radius")? as f32).filter(|r| *r > 0.0),
            false => None,
        },
        alpha: props.float("alpha")? as f32,
        memory: props.int("memory")? as u64 * MIB,
    })
}

pub fn combined(
    props: &Props,
    path: PathSpec,
    indirect: Option<Indirect>,
) -> Result<CombinedSpec, SceneError> {
    Ok(CombinedSpec {
        path,
        photons: spec(props)?,
        show: match props.bool("caustics")? {
            true => Show::All,
            false => Show::AllByPath,
        },
        cache: super::radiosity::cache(props, indirect)?,
    })
}

pub fn photon_mapper(props: &Props, path: PathSpec) -> Result<PhotonMapperSpec, SceneError> {
    // There is no volume to shoot photons into, and how the work is divided changes nothing in the picture.
    props.ignore(&[
        "volume_photons",
        "volume_lookup_size",
        "granularity",
        "gather_locally",
        "auto_cancel_gathering",
    ]);
    let count = |name: &str| Ok::<u32, SceneError>(props.int(name)? as u32);
    let lookup = match props.is_given("lookup_size") {
        true => Some(count("lookup_size")?),
        false => None,
    };
    let lookup = |name: &str| lookup.map_or_else(|| count(name), Ok);
    let direct_samples = count("direct_samples")?;
    Ok(PhotonMapperSpec {
        path,
        direct_samples,
        gather_samples: count("gather_samples")?,
        glossy_samples: count("glossy_samples")?,
        global_photons: props.int("global_photons")? as u64,
        caustic_photons: props.int("caustic_photons")? as u64,
        global_radius: props.float("global_lookup_radius")? as f32,
        caustic_radius: props.float("caustic_lookup_radius")? as f32,
        global_lookup: lookup("global_lookup_size")?,
        caustic_lookup: lookup("caustic_lookup_size")?,
        memory: props.int("memory")? as u64 * MIB,
    })
}

/// That the photons of an iteration fit into the memory that they may take.
pub fn check_memory(job: &Job, root: &Props, overrides: &Overrides) -> Result<(), SceneError> {
    let Err(what) = job.fits() else {
        return Ok(());
    };
    let error = match &overrides.integrator {
        Some(name) => on_command_line("--integrator", name, what),
        None => innermost(root).map_or_else(|| root.error(&what), |props| props.error(&what)),
    };
    Err(error.with_help("shoot fewer photons, or set \"memory\" of the integrator, in MiB"))
}

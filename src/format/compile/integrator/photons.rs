//! Integrators that shoot photons.

use crate::format::{Props, SceneError};
use crate::transport::{CombinedSpec, PathSpec, PhotonSpec, Show};

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

pub fn combined(props: &Props, path: PathSpec) -> Result<CombinedSpec, SceneError> {
    Ok(CombinedSpec {
        path,
        photons: spec(props)?,
        show: match props.bool("caustics")? {
            true => Show::All,
            false => Show::AllByPath,
        },
    })
}

//! Photons: light as it arrives at surfaces, stored to be gathered from the eye's side.

mod kernel;
mod map;
mod nearest;
mod photon;
mod radius;
mod trace;

pub use kernel::{Kernel, KernelShape};
pub use map::{PhotonMap, RADII};
pub use nearest::NearestMap;
pub use photon::Photon;
pub use radius::{footprint, reduced};
pub use trace::{Shoot, Tally};

/// How photons are shot and gathered.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotonSpec {
    /// Walks of light per iteration; `None`: as many as the picture has pixels.
    pub count: Option<u64>,
    /// Radius of the first iteration's disk in scene units; `None`: from the size of a pixel in the scene.
    pub radius: Option<f32>,
    /// What a radius' reduction leaves of the photons, 0 to 1 (Knaus & Zwicker 2011, alpha).
    pub alpha: f32,
    /// Bytes that a map may take.
    pub memory: u64,
}

impl Default for PhotonSpec {
    fn default() -> PhotonSpec {
        PhotonSpec {
            count: None,
            radius: None,
            alpha: 0.75,
            memory: 4 << 30,
        }
    }
}

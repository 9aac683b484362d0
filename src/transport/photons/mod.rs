//! Photons: light as it arrives at surfaces, stored to be gathered from the eye's side.
//!
//! [`PhotonMap`] finds them within one fixed distance, by a hash grid whose cells are twice as wide, [`NearestMap`]
//! the nearest ones, by a kd-tree. Where either would do, the grid is the default. With photons on walls, a ball and
//! in a bright spot (`benches/photon.rs`), millions of queries per second of one thread's own time, grid against
//! tree: of 1e5 photons, 5 found 3.1 to 1.8, 20 found 1.7 to 0.9, 70 found 1.15 to 0.76, 350 found 0.28 to 0.26; of
//! 1e6 1.7 to 1.25, 0.72 to 0.50, 0.58 to 0.28, 0.18 to 0.15. The grid is built in half of the time or less. Cells as
//! wide as the radius do better from a few hundred photons found on, and worse below, where progressive methods are.

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

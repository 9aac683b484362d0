//! Maps of photons.

use crate::math::Vec3;

/// Photons in space, to be found within a fixed distance.
pub struct PhotonMap<T> {
    radius: f32,
    photons: Vec<(Vec3, T)>,
}

impl<T: Copy + Send + Sync> PhotonMap<T> {
    /// For queries of `radius` > 0.
    pub fn new(photons: Vec<(Vec3, T)>, radius: f32) -> PhotonMap<T> {
        PhotonMap { radius, photons }
    }

    pub fn radius(&self) -> f32 {
        self.radius
    }

    pub fn len(&self) -> usize {
        self.photons.len()
    }

    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Calls `visit` for all photons within the radius of `p`, with the square of their distance. The order
    /// depends on the photons alone.
    pub fn within(&self, p: Vec3, mut visit: impl FnMut(&T, f32)) {
        for (q, photon) in &self.photons {
            let d2 = p.distance_squared(*q);
            if d2 <= self.radius * self.radius {
                visit(photon, d2);
            }
        }
    }
}

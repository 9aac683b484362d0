//! The integrators against each other and against closed forms: unbiased ones agree within chance, those that
//! gather photons within a bias that is small and vanishes at the rate that theory says.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/render.rs"]
mod render;

mod agree;
mod bias;
mod closed_forms;
mod extremes;
mod scenes;
mod threads;

use luxel::format::Compiled;
use luxel::transport::{
    BidirSpec, CombinedSpec, IntegratorSpec, Method, PathSpec, PhotonSpec, Show,
};

/// Photons of a disk that does not shrink, so that the bias does not depend on the number of samples.
pub fn fixed(count: u64, radius: f32) -> PhotonSpec {
    PhotonSpec {
        count: Some(count),
        radius: Some(radius),
        alpha: 1.0,
        ..PhotonSpec::default()
    }
}

pub fn path(max_depth: u32) -> PathSpec {
    PathSpec {
        max_depth: Some(max_depth),
        ..PathSpec::default()
    }
}

pub fn bidirectional(method: Method, max_depth: u32, photons: PhotonSpec) -> IntegratorSpec {
    let walk = path(max_depth);
    IntegratorSpec::Bidirectional(BidirSpec {
        method,
        max_depth: walk.max_depth,
        rr_depth: walk.rr_depth,
        hide_emitters: false,
        light_image: true,
        photons,
    })
}

pub fn combined(max_depth: u32, photons: PhotonSpec) -> IntegratorSpec {
    IntegratorSpec::Combined(CombinedSpec {
        path: path(max_depth),
        photons,
        show: Show::All,
        ..CombinedSpec::default()
    })
}

/// The mean picture of `spp` samples per pixel; fails where any of them is no finite, positive number.
pub fn picture(
    compiled: &mut Compiled,
    integrator: &IntegratorSpec,
    spp: u64,
    seed: u64,
) -> Vec<[f64; 3]> {
    compiled.job.integrator = integrator.clone();
    compiled.job.seed = seed;
    render::render(compiled, spp).0.mean()
}

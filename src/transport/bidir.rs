//! Bidirectional transport: light subpaths, eye subpaths, and all ways to join them.

use super::{Iteration, Ledger, Li, PhotonSpec, Setting};
use crate::geom::Ray;
use crate::math::Rgb;
use crate::sampler::Sampler;
use crate::scene::CameraSample;

/// Which techniques are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Bidirectional path tracing.
    Bdpt,
    /// Light tracing: light alone walks, and is connected to the camera.
    Ptracer,
    /// Vertex connection and merging.
    Vcm,
    /// Stochastic progressive photon mapping.
    Sppm,
}

impl Method {
    pub fn name(self) -> &'static str {
        match self {
            Method::Bdpt => "bdpt",
            Method::Ptracer => "ptracer",
            Method::Vcm => "vcm",
            Method::Sppm => "sppm",
        }
    }

    /// Whether photons are gathered, which is biased.
    pub fn merges(self) -> bool {
        matches!(self, Method::Vcm | Method::Sppm)
    }
}

/// Settings of bidirectional methods.
#[derive(Clone, Debug, PartialEq)]
pub struct BidirSpec {
    pub method: Method,
    /// Most edges of a path; `None`: no limit.
    pub max_depth: Option<u32>,
    /// Edges from which on Russian roulette may end the eye's walk.
    pub rr_depth: u32,
    pub hide_emitters: bool,
    pub photons: PhotonSpec,
}

/// The photons of one iteration.
pub struct Photons;

/// A bidirectional method at work.
pub struct Engine<'a> {
    _spec: &'a BidirSpec,
    _setting: Setting<'a>,
}

impl<'a> Engine<'a> {
    pub fn new(spec: &'a BidirSpec, setting: Setting<'a>) -> Engine<'a> {
        Engine {
            _spec: spec,
            _setting: setting,
        }
    }

    pub fn begin(&self, _number: u64, _ledger: &mut Ledger) -> Iteration {
        Iteration::default()
    }

    pub fn sample(
        &self,
        _iteration: &Iteration,
        _at: &CameraSample,
        _ray: Ray,
        _sampler: &Sampler,
        _ledger: &mut Ledger,
    ) -> Li {
        Li {
            radiance: Rgb::BLACK,
            seen: false,
        }
    }
}

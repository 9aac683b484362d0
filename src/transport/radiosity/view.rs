//! Radiosity shown to the camera, with mirrors, glass and gloss by ray tracing on top of it.
//!
//! The walk goes on by all lobes that are not diffuse: by mirrors, glass and clear coats as far as it takes, and by
//! gloss with connections to emitters. What diffuse lobes send comes from the patches, at the first surface that has
//! one or, for a final gather, at the next one that a ray from there meets.

use super::gather::{Reader, Reads};
use super::{RadiositySpec, Show, Solving, Use};
use crate::geom::Ray;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::transport::path::Start;
use crate::transport::{Ledger, Li, Setting};

/// Whether there is anything to show in `scene`; if not, why.
pub fn is_used(scene: &Scene) -> Result<(), &'static str> {
    match (scene.has_lights(), scene.is_diffuse()) {
        (false, _) => Err("there is no emitter"),
        (true, false) => Err("no surface reflects diffusely"),
        (true, true) => Ok(()),
    }
}

/// The integrator at work.
pub struct View<'a> {
    spec: &'a RadiositySpec,
    setting: Setting<'a>,
    /// `None` where there is nothing to show.
    pub solving: Option<Solving<'a>>,
}

impl<'a> View<'a> {
    pub fn new(spec: &'a RadiositySpec, setting: Setting<'a>) -> View<'a> {
        let scene = setting.scene;
        let made_for = match spec.show {
            Show::Flat => Use::Flat,
            _ => Use::Smooth,
        };
        let solving = || Solving::new(scene, &spec.solve, spec.given.as_ref(), made_for);
        View {
            spec,
            setting,
            solving: is_used(scene).is_ok().then(solving),
        }
    }

    /// One sample of the radiance along `ray`.
    #[inline]
    pub fn sample(&self, ray: Ray, sampler: &Sampler, ledger: &mut Ledger) -> Li {
        let cache = self.solving.as_ref().and_then(Solving::get);
        let reads = match self.spec.show {
            Show::Flat | Show::Gouraud => Reads::All,
            Show::Gather => Reads::AllBehind,
        };
        let mut reader = Reader::<false>::new(self.setting.scene, &self.spec.path, cache, reads);
        let (scene, start) = (self.setting.scene, Start::at_camera(ray));
        let path = &self.spec.path;
        path.walk(scene, start, sampler, &mut ledger.rays, &mut reader)
    }
}

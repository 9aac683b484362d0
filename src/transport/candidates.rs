//! The estimators that may suit a scene, of those that find all its light without bias, or with one that vanishes.
//!
//! What stays biased however many samples are taken (`photonmapper`, `radiosity`, radiosity that is gathered) is never
//! among them; nor is `direct`, which is another picture.

use super::path::UNBOUNDED;
use super::{
    BidirSpec, CacheSpec, CachedSpec, CombinedSpec, Indirect, IntegratorSpec, Method, Show,
};
use crate::light::Emitter;
use crate::scene::{PlanEntry, Scene};

/// An estimator, and whether it may be tried.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Options of the command line that ask for it.
    pub options: &'static str,
    /// Its settings, or why it is left out.
    pub spec: Result<IntegratorSpec, &'static str>,
}

/// Those for `scene`, with the settings of `shared`; the first that may be tried finds all light and is quick to begin.
pub fn candidates(shared: &CombinedSpec, scene: &Scene) -> Vec<Candidate> {
    let path = &shared.path;
    let edges = path.max_depth.unwrap_or(UNBOUNDED);
    // Light, delta lobe, receiver, eye.
    let caustics = match scene.throws_caustics() {
        Ok(()) if edges < 3 => Err("paths are too short for caustics"),
        other => other,
    };
    let hidden = caustics.is_ok() && !scene.emitters().iter().all(Emitter::can_be_met);
    let unless_hidden = |spec: IntegratorSpec, why| match hidden {
        true => Err(why),
        false => Ok(spec),
    };
    let bidirectional = |method: Method| {
        IntegratorSpec::Bidirectional(BidirSpec {
            method,
            max_depth: path.max_depth,
            rr_depth: path.rr_depth,
            hide_emitters: path.hide_emitters,
            light_image: true,
            photons: shared.photons.clone(),
        })
    };
    // Photons serve caustics; elsewhere they would only add a bias.
    let with_photons = |spec: IntegratorSpec| caustics.map(|()| spec);
    let mut guide = CacheSpec::of(Indirect::Guide);
    if shared.cache.solve != CacheSpec::default().solve {
        guide.solve = shared.cache.solve.clone();
    }
    let combined = CombinedSpec {
        show: Show::All,
        cache: CacheSpec::default(),
        ..shared.clone()
    };
    let guided = guide.is_used(scene, path).map(|()| {
        IntegratorSpec::Cached(CachedSpec {
            path: path.clone(),
            cache: guide,
        })
    });
    let unseen = "a path tracer never meets points and beams, so it misses their caustics";
    let candidate = |options, spec| Candidate { options, spec };
    vec![
        candidate(
            "--integrator path",
            unless_hidden(IntegratorSpec::Path(path.clone()), unseen),
        ),
        candidate(
            "--integrator combined",
            with_photons(IntegratorSpec::Combined(combined)),
        ),
        candidate("--integrator vcm", with_photons(bidirectional(Method::Vcm))),
        candidate(
            "--integrator sppm",
            with_photons(bidirectional(Method::Sppm)),
        ),
        candidate(
            "--integrator bdpt",
            unless_hidden(
                bidirectional(Method::Bdpt),
                "caustics of points and beams are lost where they are seen in mirrors or through glass",
            ),
        ),
        candidate(
            "--integrator path --indirect guide",
            guided.and_then(|spec| unless_hidden(spec, unseen)),
        ),
    ]
}

/// The plan's entry where one of them is to be chosen.
pub fn plan(candidates: &[Candidate]) -> PlanEntry {
    let tried: Vec<_> = candidates.iter().filter(|c| c.spec.is_ok()).collect();
    let names: Vec<_> = tried
        .iter()
        .map(|c| c.options.trim_start_matches("--integrator "))
        .collect();
    PlanEntry {
        subject: "integrator",
        decision: format!("the most efficient of {}", names.join(", ")),
        reason: "it is to be chosen by trial, among those that find all light of this scene"
            .to_string(),
    }
}

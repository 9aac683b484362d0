//! The account of what discontinuity meshing found and left out.

use super::{Kind, Sought};

/// How many lines there are of each kind, and what was not looked at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    pub contacts: usize,
    pub shadows: usize,
    pub vertex_edge: usize,
    pub edge_vertex: usize,
    pub horizons: usize,
    /// Lines that the light does not reach.
    pub hidden: usize,
    /// Facets that were divided along lines.
    pub facets: usize,
    pub left_out: LeftOut,
}

/// What the limits left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeftOut {
    /// The weakest lights.
    pub lamps: usize,
    /// Lights with a curved outline, whose shadows have edges only at the outermost bounds.
    pub curved: usize,
    /// Edges of occluders that are much shorter than patches are to be.
    pub short_edges: usize,
    /// Others: the shortest.
    pub edges: usize,
    /// Facets that are hardly larger than patches are to be.
    pub small_facets: usize,
    /// Others: the smallest.
    pub facets: usize,
    /// Lines beyond the number that a facet may have.
    pub lines: usize,
    /// Facets with lines that no triangulation followed.
    pub untriangulated: usize,
}

impl Found {
    pub(super) fn add(&mut self, sought: &Sought) {
        self.hidden += sought.hidden;
        self.left_out.lines += sought.beyond;
        for line in &sought.lines {
            match line.kind {
                Kind::Contact => self.contacts += 1,
                Kind::Shadow => self.shadows += 1,
                Kind::VertexEdge => self.vertex_edge += 1,
                Kind::EdgeVertex => self.edge_vertex += 1,
                Kind::Horizon => self.horizons += 1,
            }
        }
    }

    /// A sentence for the user on each thing that was left out and may be missed.
    pub fn warnings(&self) -> Vec<String> {
        let left = &self.left_out;
        let all = [
            (
                left.lamps,
                "of the weaker lights throw shadows without edges in the mesh",
            ),
            (
                left.curved,
                "lights have curved outlines: of their shadows, only the bounds of the half-shadows of edges are \
                 followed",
            ),
            (
                left.edges,
                "of the shorter edges throw no lines: simplify small geometry, or raise the limit of edges",
            ),
            (
                left.facets,
                "of the smaller facets are not cut along shadows' edges",
            ),
            (
                left.lines,
                "of the weaker lines are left out: they exceed the limit per facet",
            ),
            (
                left.untriangulated,
                "facets have lines that cannot be followed",
            ),
        ];
        all.iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("discontinuity meshing: {count} {what}"))
            .collect()
    }
}

//! The nodes: clusters above, facets and their quarters below.

use super::cluster;
use crate::math::{DVec2, DVec3};
use crate::radiosity::discontinuity::{self, Divisions, Limits};
use crate::radiosity::mesh::{self, Division, of_piece};
use crate::radiosity::{Piece, Rgb64, SolveError, SolveSpec, Surfaces};
use crate::scene::Scene;
use std::sync::Arc;

pub const NONE: u32 = u32::MAX;

/// What a node is.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Nodes `first..first + count` are inside.
    Cluster { first: u32, count: u32 },
    /// A piece of facet `facet`.
    Surface { facet: u32, piece: Piece },
}

#[derive(Clone, Debug)]
pub struct TreeNode {
    pub parent: u32,
    /// The first of four quarters of a divided surface; `NONE` for leaves and clusters.
    pub quarters: u32,
    pub kind: Kind,
    /// Of all surfaces below, in squared scene units.
    pub area: f64,
    /// Middle and radius of a sphere around all of it.
    pub center: DVec3,
    pub radius: f64,
    /// Unit normal of a surface; zero for clusters.
    pub normal: DVec3,
    /// Means over the area.
    pub albedo: Rgb64,
    pub emission: Rgb64,
    /// Irradiance from lights that are no patches, in W/m².
    pub external: Rgb64,
    /// From emitters by mirrors, glass and gloss, in W/m², as known before there are links (see [`super::stray`]).
    pub stray: Rgb64,
    /// What becomes of what links bring to a patch, or to a body.
    pub gain: Gain,
    pub links: Vec<TreeLink>,
}

/// What the light of links is multiplied with, and what is added in W/m²: links err, and by how much is known of
/// many together.
#[derive(Clone, Copy, Debug)]
pub struct Gain {
    pub scale: Rgb64,
    pub more: Rgb64,
}

impl Gain {
    pub const NONE: Gain = Gain {
        scale: Rgb64::ONE,
        more: Rgb64::ZERO,
    };

    pub fn of(&self, linked: Rgb64) -> Rgb64 {
        self.scale * linked + self.more
    }
}

/// Light that comes to a node.
#[derive(Clone, Copy, Debug)]
pub struct TreeLink {
    pub sender: u32,
    /// With visibility.
    pub form_factor: f32,
    /// Difference of the largest and the smallest form factor over the receiver, with visibility.
    pub spread: f32,
    /// Share of rays that arrive.
    pub visible: f32,
}

pub struct Tree {
    pub surfaces: Arc<Surfaces>,
    /// By facet: its cells, which are surface nodes without a surface as their parent, in a row.
    pub divisions: Vec<Division>,
    /// What was left out of these: sentences for the user.
    pub left_out: Vec<String>,
    /// By number of cell: its node.
    pub cells: Vec<u32>,
    /// Clusters come before what they contain; quarters after all that was there when they were made.
    pub nodes: Vec<TreeNode>,
    /// Numbers of the clusters among each other, by node; `NONE` for cells.
    pub clusters: Vec<u32>,
    /// The nodes that are clusters.
    pub by_cluster: Vec<u32>,
    pub patches: u64,
    pub max_patches: u64,
}

/// Patches to begin with that lines are cut for where no size is given.
const PATCHES_ALONG_LINES: u64 = 2_000;

/// More facets are not searched for contacts where that is all that is wanted: it takes each pair of them.
const MOST_TOUCHING: usize = 20_000;

/// The cells of all facets.
fn divided(scene: &Scene, surfaces: &Surfaces, spec: &SolveSpec) -> Result<Divisions, SolveError> {
    let size = spec.patch_size.unwrap_or(f64::INFINITY);
    let check = |patches: u64| match patches > spec.max_patches {
        true => Err(SolveError::TooManyPatches {
            patches,
            limit: spec.max_patches,
        }),
        false => Ok(()),
    };
    check(mesh::count(surfaces, size))?;
    let contacts = spec.contacts && surfaces.facets().len() <= MOST_TOUCHING;
    let limits = match spec.discontinuities {
        true => Limits::default(),
        false if contacts => Limits::CONTACTS,
        false => Limits::NONE,
    };
    let along = match limits == Limits::NONE {
        true => size,
        false => {
            let fine = || mesh::size_for(surfaces, PATCHES_ALONG_LINES);
            spec.patch_size.unwrap_or_else(fine)
        }
    };
    let divisions = discontinuity::divisions(scene, surfaces, [size, along], &limits);
    check(divisions.pieces.len() as u64)?;
    Ok(divisions)
}

impl Tree {
    pub fn new(
        scene: &Scene,
        surfaces: Arc<Surfaces>,
        spec: &SolveSpec,
    ) -> Result<Tree, SolveError> {
        let Divisions {
            divisions,
            pieces,
            found,
        } = divided(scene, &surfaces, spec)?;
        use rayon::prelude::*;
        let make = |&(facet, piece): &(u32, Piece)| {
            let optics = of_piece(scene, &surfaces, facet, &piece);
            TreeNode::surface(NONE, facet, piece, optics.albedo, optics.emission)
        };
        let roots: Vec<TreeNode> = pieces.par_iter().map(make).collect();
        let (nodes, cells) = cluster::build(roots);
        let mut by_cluster = Vec::new();
        let mut clusters = vec![NONE; nodes.len()];
        for (i, node) in nodes.iter().enumerate().filter(|(_, n)| n.is_cluster()) {
            debug_assert!(node.parent == NONE || (node.parent as usize) < i);
            clusters[i] = by_cluster.len() as u32;
            by_cluster.push(i as u32);
        }
        Ok(Tree {
            clusters,
            by_cluster,
            surfaces,
            divisions,
            left_out: match spec.discontinuities {
                true => found.warnings(),
                false => Vec::new(),
            },
            cells,
            nodes,
            patches: pieces.len() as u64,
            max_patches: spec.max_patches,
        })
    }

    /// W per channel.
    pub fn emitted_power(&self) -> Rgb64 {
        let power = |&cell: &u32| {
            let n = &self.nodes[cell as usize];
            (n.emission + n.albedo * n.unlinked()) * n.area
        };
        self.cells.iter().map(power).sum()
    }

    pub fn links(&self) -> usize {
        self.nodes.iter().map(|n| n.links.len()).sum()
    }

    /// Nodes directly below, if any.
    pub fn children(&self, node: u32) -> std::ops::Range<u32> {
        let n = &self.nodes[node as usize];
        match n.kind {
            Kind::Cluster { first, count } => first..first + count,
            Kind::Surface { .. } if n.quarters != NONE => n.quarters..n.quarters + 4,
            Kind::Surface { .. } => 0..0,
        }
    }

    /// The leaf at `st` of a surface.
    pub fn leaf_at(&self, mut node: u32, st: [f32; 2]) -> u32 {
        let mut st = DVec2::from_array(st.map(f64::from));
        while let TreeNode {
            quarters,
            kind: Kind::Surface { piece, .. },
            ..
        } = &self.nodes[node as usize]
            && *quarters != NONE
        {
            let (quarter, inside) = piece.outline.child_at(st);
            (node, st) = (quarters + quarter as u32, inside);
        }
        node
    }

    /// Divides a surface that is not divided yet; false where that cannot be done.
    pub fn divide(&mut self, scene: &Scene, node: u32, min_size: f64) -> bool {
        let parent = &self.nodes[node as usize];
        let Kind::Surface { facet, piece } = parent.kind else {
            return true;
        };
        if parent.quarters != NONE {
            return true;
        }
        let fits = self.patches + 3 <= self.max_patches && self.nodes.len() + 4 < NONE as usize;
        if !fits || piece.longest_edge() < 2.0 * min_size {
            return false;
        }
        let shape = self.surfaces.facets()[facet as usize].shape;
        let (varies, albedo, emission) = (scene.varies(shape), parent.albedo, parent.emission);
        let (external, stray) = (parent.external, parent.stray);
        let first = self.nodes.len() as u32;
        for quarter in 0..4 {
            let piece = piece.child(quarter);
            let (albedo, emission) = match varies {
                true => {
                    let optics = of_piece(scene, &self.surfaces, facet, &piece);
                    (optics.albedo, optics.emission)
                }
                false => (albedo, emission),
            };
            let mut child = TreeNode::surface(node, facet, piece, albedo, emission);
            (child.external, child.stray) = (external, stray);
            self.nodes.push(child);
        }
        self.nodes[node as usize].quarters = first;
        self.patches += 3;
        true
    }
}

impl TreeNode {
    pub fn surface(
        parent: u32,
        facet: u32,
        piece: Piece,
        albedo: Rgb64,
        emission: Rgb64,
    ) -> TreeNode {
        let center = piece.center();
        let reach = piece.corners().map(|c| c.distance(center));
        TreeNode {
            parent,
            quarters: NONE,
            kind: Kind::Surface { facet, piece },
            area: piece.area(),
            center,
            radius: reach.fold(0.0, f64::max),
            normal: piece.normal(),
            albedo,
            emission,
            external: Rgb64::ZERO,
            stray: Rgb64::ZERO,
            gain: Gain::NONE,
            links: Vec::new(),
        }
    }

    /// Irradiance that comes by no link, in W/m².
    pub fn unlinked(&self) -> Rgb64 {
        self.external + self.stray
    }

    pub fn is_cluster(&self) -> bool {
        matches!(self.kind, Kind::Cluster { .. })
    }
}

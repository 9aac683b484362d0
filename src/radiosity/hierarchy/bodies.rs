//! Clusters that light is exchanged with as a whole.
//!
//! A cluster without a link below it is a *body*: what arrives is known by direction alone, and so is what it sends
//! then. All its surfaces together turn one into the other by a matrix, which is summed up once; so a step costs by
//! what is linked, not by what there is. What arrives at each of its surfaces is found at the end.

use super::sphere::Sphere;
use super::tree::{NONE, Tree};
use crate::radiosity::Rgb64;
use rayon::prelude::*;
use std::ops::Range;

/// Which parts of the tree exchange light, as linked at one time.
pub struct Parts {
    /// By node: the body that it is or is in; `NONE` elsewhere.
    pub body_of: Vec<u32>,
    pub bodies: Vec<Body>,
    /// Cells in no body.
    pub cells: Vec<u32>,
    /// Clusters that are or are in no body; parents come first.
    pub open: Vec<u32>,
    /// The patches of the bodies, one body after the other.
    pub leaves: Vec<u32>,
}

pub struct Body {
    pub node: u32,
    /// Into `Parts::leaves`.
    pub leaves: Range<usize>,
    /// Σ A times the lobe of its surfaces (see [`Sphere::lobe`]).
    pub shape: [f64; 9],
    /// The same times the reflectance.
    pub reflects: Sphere,
    /// From what arrives to what is reflected: the lower half of a symmetric matrix, row by row.
    transfer: [Rgb64; 45],
}

/// Leaves that are summed up by one task.
const CHUNK: usize = 4096;

impl Parts {
    pub fn new(tree: &Tree) -> Parts {
        let mut below = vec![false; tree.nodes.len()];
        let mut linked = vec![false; tree.nodes.len()];
        for (i, node) in tree.nodes.iter().enumerate() {
            for link in &node.links {
                linked[i] = true;
                linked[link.sender as usize] = true;
            }
        }
        // Nodes come before what they contain.
        for (i, node) in tree.nodes.iter().enumerate().skip(1).rev() {
            if linked[i] || below[i] {
                below[node.parent as usize] = true;
            }
        }
        let mut parts = Parts {
            body_of: vec![NONE; tree.nodes.len()],
            bodies: Vec::new(),
            cells: Vec::new(),
            open: Vec::new(),
            leaves: Vec::new(),
        };
        for (i, node) in tree.nodes.iter().enumerate() {
            let above = match node.parent {
                NONE => NONE,
                parent => parts.body_of[parent as usize],
            };
            if above != NONE {
                parts.body_of[i] = above;
            } else if node.is_cluster() && below[i] {
                parts.open.push(i as u32);
            } else if node.is_cluster() {
                parts.body_of[i] = parts.bodies.len() as u32;
                let leaves = parts.append_leaves(tree, i as u32);
                let body = Body::new(tree, i as u32, &parts.leaves, leaves);
                parts.bodies.push(body);
            }
        }
        let is_free = |cell: &&u32| parts.body_of[**cell as usize] == NONE;
        parts.cells = tree.cells.iter().filter(is_free).copied().collect();
        // Neighbours in the tree are neighbours in memory.
        parts.cells.sort_unstable();
        parts
    }

    fn append_leaves(&mut self, tree: &Tree, node: u32) -> Range<usize> {
        let first = self.leaves.len();
        let mut stack = vec![node];
        while let Some(node) = stack.pop() {
            let children = tree.children(node);
            if children.is_empty() && !tree.nodes[node as usize].is_cluster() {
                self.leaves.push(node);
            }
            stack.extend(children);
        }
        first..self.leaves.len()
    }
}

impl Body {
    fn new(tree: &Tree, node: u32, leaves: &[u32], range: Range<usize>) -> Body {
        struct Sums([f64; 9], [Rgb64; 9], [Rgb64; 45]);
        let part = |leaves: &[u32]| {
            let mut sums = Sums([0.0; 9], [Rgb64::ZERO; 9], [Rgb64::ZERO; 45]);
            for &leaf in leaves {
                let n = &tree.nodes[leaf as usize];
                let lobe = Sphere::lobe(n.normal);
                let mut at = 0;
                for (i, row) in lobe.iter().enumerate() {
                    sums.0[i] += n.area * row;
                    let reflected = n.albedo * (n.area * row);
                    sums.1[i] += reflected;
                    for column in &lobe[..=i] {
                        sums.2[at] += reflected * (column * std::f64::consts::PI);
                        at += 1;
                    }
                }
            }
            sums
        };
        let parts: Vec<Sums> = leaves[range.clone()].par_chunks(CHUNK).map(part).collect();
        let mut body = Body {
            node,
            leaves: range,
            shape: [0.0; 9],
            reflects: Sphere::default(),
            transfer: [Rgb64::ZERO; 45],
        };
        for Sums(shape, reflects, transfer) in &parts {
            (body.shape.iter_mut().zip(shape)).for_each(|(a, b)| *a += b);
            body.reflects.add(&Sphere(*reflects));
            (body.transfer.iter_mut().zip(transfer)).for_each(|(a, b)| *a += *b);
        }
        body
    }

    /// What is reflected of `arriving`.
    pub fn reflect(&self, arriving: &Sphere) -> Sphere {
        let mut out = Sphere::default();
        let mut at = 0;
        for i in 0..9 {
            for j in 0..i {
                out.0[i] += self.transfer[at] * arriving.0[j];
                out.0[j] += self.transfer[at] * arriving.0[i];
                at += 1;
            }
            out.0[i] += self.transfer[at] * arriving.0[i];
            at += 1;
        }
        out
    }

    /// Irradiance summed over the area, in W.
    pub fn received(&self, arriving: &Sphere) -> Rgb64 {
        let of = |(shape, c): (&f64, &Rgb64)| *c * (shape * std::f64::consts::PI);
        let sum: Rgb64 = self.shape.iter().zip(&arriving.0).map(of).sum();
        sum.max(Rgb64::ZERO)
    }
}

//! The solution in the form that all solvers give.

use super::gather::Field;
use super::tree::{Kind, NONE, Tree};
use super::{Hierarchy, Link, Node};
use crate::radiosity::mesh::{Cell, Patch};
use crate::radiosity::report::{self, Balance};
use crate::radiosity::{PatchMesh, Report, Rgb64, Solution};
use crate::scene::Scene;

/// Numbers of the patches below each node, as nodes are met depth first.
pub struct Numbers {
    /// First patch and the one behind the last, by node.
    ranges: Vec<[u32; 2]>,
    /// By patch: its node.
    pub leaf: Vec<u32>,
}

/// Where each patch of a mesh is in the tree.
fn numbers(tree: &Tree) -> Numbers {
    let mut numbers = Numbers {
        ranges: vec![[0; 2]; tree.nodes.len()],
        leaf: Vec::new(),
    };
    // Nodes are entered, and left after all below.
    let mut stack = vec![(0u32, false)];
    while let Some((node, done)) = stack.pop() {
        if done {
            numbers.ranges[node as usize][1] = numbers.leaf.len() as u32;
            continue;
        }
        numbers.ranges[node as usize][0] = numbers.leaf.len() as u32;
        stack.push((node, true));
        let children = tree.children(node);
        if children.is_empty() && !tree.nodes[node as usize].is_cluster() {
            numbers.leaf.push(node);
        }
        stack.extend(children.rev().map(|child| (child, false)));
    }
    numbers
}

/// The patches.
pub fn mesh(tree: &Tree) -> (PatchMesh, Numbers) {
    let numbers = numbers(tree);
    let patch = |&node: &u32| {
        let n = &tree.nodes[node as usize];
        let Kind::Surface { facet, piece } = n.kind else {
            unreachable!("leaves are surfaces")
        };
        Patch {
            piece,
            facet,
            area: n.area,
            albedo: n.albedo,
            emission: n.emission,
        }
    };
    let mut cells = vec![Cell::Patch(0); tree.cells.len()];
    // Where the cell of a node is written.
    let mut stack: Vec<(usize, u32)> = tree.cells.iter().copied().enumerate().collect();
    while let Some((slot, node)) = stack.pop() {
        let children = tree.children(node);
        cells[slot] = match children.is_empty() {
            true => Cell::Patch(numbers.ranges[node as usize][0]),
            false => {
                let first = cells.len();
                cells.resize(first + 4, Cell::Patch(0));
                stack.extend((first..first + 4).zip(children));
                Cell::Split(first as u32)
            }
        };
    }
    let mesh = PatchMesh {
        surfaces: tree.surfaces.clone(),
        patches: numbers.leaf.iter().map(patch).collect(),
        divisions: tree.divisions.clone(),
        cells,
    };
    (mesh, numbers)
}

/// Values of nodes, by patch.
pub fn by_patch(numbers: &Numbers, values: &[Rgb64]) -> Vec<Rgb64> {
    numbers.leaf.iter().map(|&n| values[n as usize]).collect()
}

/// What was found, with its energy balance.
pub fn solution(
    scene: &Scene,
    tree: &Tree,
    field: &Field,
    direct: &[Rgb64],
    report: Report,
) -> Solution {
    let (mesh, numbers) = mesh(tree);
    let mut solution = Solution {
        radiosity: by_patch(&numbers, &field.radiosity),
        irradiance: by_patch(&numbers, &field.irradiance),
        direct: by_patch(&numbers, direct),
        hierarchy: Some(hierarchy(tree, &numbers)),
        mesh,
        report: Report::default(),
    };
    let external = |&node: &u32| tree.nodes[node as usize].external;
    let external: Vec<Rgb64> = numbers.leaf.iter().map(external).collect();
    let balance = Balance {
        mesh: &solution.mesh,
        external: &external,
        irradiance: &solution.irradiance,
        escaped: Rgb64::ZERO,
    };
    let found = report::of(scene, &balance);
    solution.report = Report {
        patches: solution.mesh.len(),
        // Links do not know what they miss: the rest of the light.
        escaped: found.emitted + found.external - found.absorbed,
        emitted: found.emitted,
        external: found.external,
        absorbed: found.absorbed,
        other: found.other,
        warnings: [found.warnings, report.warnings, tree.left_out.clone()].concat(),
        ..report
    };
    solution
}

fn hierarchy(tree: &Tree, numbers: &Numbers) -> Hierarchy {
    let mut out = Hierarchy {
        nodes: Vec::with_capacity(tree.nodes.len()),
        links: Vec::with_capacity(tree.links()),
        leaf: numbers.leaf.clone(),
    };
    for (i, node) in tree.nodes.iter().enumerate() {
        let first = out.links.len() as u32;
        let links = node.links.iter().map(|link| Link {
            sender: link.sender,
            form_factor: link.form_factor,
        });
        out.links.extend(links);
        let range = |node: u32| numbers.ranges[node as usize];
        out.links[first as usize..].sort_by_key(|link| (range(link.sender)[0], link.sender));
        let [from, to] = numbers.ranges[i];
        out.nodes.push(Node {
            parent: if node.parent == NONE {
                u32::MAX
            } else {
                node.parent
            },
            patches: from..to,
            links: first..out.links.len() as u32,
        });
    }
    out
}

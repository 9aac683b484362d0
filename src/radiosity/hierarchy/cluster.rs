//! Facets that are near to each other, gathered in clusters.

use super::tree::{Gain, Kind, NONE, TreeNode};
use crate::math::DVec3;
use crate::radiosity::Rgb64;

/// A box.
#[derive(Clone, Copy)]
struct Bounds {
    min: DVec3,
    max: DVec3,
}

/// Most nodes that a cluster holds without another cluster between.
const FEW: usize = 4;

/// Nodes with `surfaces` below clusters, the root first, and where each surface went.
pub fn build(surfaces: Vec<TreeNode>) -> (Vec<TreeNode>, Vec<u32>) {
    let bounds: Vec<Bounds> = surfaces.iter().map(Bounds::of).collect();
    let mut builder = Builder {
        places: vec![NONE; surfaces.len()],
        nodes: vec![placeholder()],
        surfaces,
        bounds,
    };
    let all: Vec<u32> = (0..builder.surfaces.len() as u32).collect();
    builder.fill(0, all);
    (builder.nodes, builder.places)
}

struct Builder {
    surfaces: Vec<TreeNode>,
    bounds: Vec<Bounds>,
    nodes: Vec<TreeNode>,
    places: Vec<u32>,
}

/// What a cluster will hold.
enum Member {
    Surface(u32),
    Cluster(Vec<u32>),
}

impl Builder {
    /// Makes node `at` the cluster of these surfaces.
    fn fill(&mut self, at: usize, items: Vec<u32>) {
        let members = self.members(items);
        let first = self.nodes.len() as u32;
        let count = members.len() as u32;
        self.nodes.extend(members.iter().map(|_| placeholder()));
        for (member, slot) in members.into_iter().zip(first as usize..) {
            match member {
                Member::Surface(item) => {
                    self.nodes[slot] = self.surfaces[item as usize].clone();
                    self.places[item as usize] = slot as u32;
                }
                Member::Cluster(items) => self.fill(slot, items),
            }
            self.nodes[slot].parent = at as u32;
        }
        let inside = &self.nodes[first as usize..(first + count) as usize];
        let mut cluster = TreeNode {
            kind: Kind::Cluster { first, count },
            ..placeholder()
        };
        let mut bounds = Bounds::EMPTY;
        for node in inside {
            cluster.area += node.area;
            cluster.albedo += node.albedo * node.area;
            cluster.emission += node.emission * node.area;
            bounds = bounds.union(Bounds::around(node.center, node.radius));
        }
        let share = if cluster.area > 0.0 {
            1.0 / cluster.area
        } else {
            0.0
        };
        cluster.albedo *= share;
        cluster.emission *= share;
        cluster.center = (bounds.min + bounds.max) * 0.5;
        let reach = |n: &TreeNode| n.center.distance(cluster.center) + n.radius;
        cluster.radius = inside.iter().map(reach).fold(0.0, f64::max);
        self.nodes[at] = cluster;
    }

    /// How a cluster of these surfaces is made up: what is nearly as large as the whole stands alone, the rest is
    /// halved three times.
    fn members(&self, items: Vec<u32>) -> Vec<Member> {
        let whole = self.around(&items).longest();
        let is_large = |i: &u32| self.bounds[*i as usize].longest() > 0.5 * whole;
        let (large, small): (Vec<u32>, Vec<u32>) = items.into_iter().partition(is_large);
        let mut members: Vec<Member> = large.into_iter().map(Member::Surface).collect();
        // Large surfaces that are many are clustered too: by place, as if they were small.
        if members.len() > 8 * FEW {
            let all = members.into_iter().map(|m| match m {
                Member::Surface(i) => vec![i],
                Member::Cluster(items) => items,
            });
            let all = all.flatten().chain(small).collect();
            return self.parts(all);
        }
        members.extend(self.parts(small));
        members
    }

    fn parts(&self, items: Vec<u32>) -> Vec<Member> {
        if items.len() <= FEW {
            return items.into_iter().map(Member::Surface).collect();
        }
        let mut parts = vec![items];
        for _ in 0..3 {
            parts = parts.into_iter().flat_map(|p| self.halves(p)).collect();
        }
        let member = |part: Vec<u32>| match part[..] {
            [one] => Member::Surface(one),
            _ => Member::Cluster(part),
        };
        parts
            .into_iter()
            .filter(|p| !p.is_empty())
            .map(member)
            .collect()
    }

    /// Halves by number, along the longest side of the box of the middles.
    fn halves(&self, mut items: Vec<u32>) -> Vec<Vec<u32>> {
        if items.len() < 2 {
            return vec![items];
        }
        let mut box_of_middles = Bounds::EMPTY;
        for &i in &items {
            let middle = self.surfaces[i as usize].center;
            box_of_middles = box_of_middles.union(Bounds::around(middle, 0.0));
        }
        let size = box_of_middles.max - box_of_middles.min;
        let axis = if size.x >= size.y.max(size.z) {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let key = |i: u32| self.surfaces[i as usize].center[axis];
        let middle = items.len() / 2;
        // By number among equals, so that the outcome is always the same.
        items.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        let rest = items.split_off(middle);
        vec![items, rest]
    }

    fn around(&self, items: &[u32]) -> Bounds {
        let boxes = items.iter().map(|&i| self.bounds[i as usize]);
        boxes.fold(Bounds::EMPTY, Bounds::union)
    }
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    };

    fn of(node: &TreeNode) -> Bounds {
        match node.kind {
            Kind::Surface { piece, .. } => piece.corners().fold(Bounds::EMPTY, |b, c| Bounds {
                min: b.min.min(c),
                max: b.max.max(c),
            }),
            Kind::Cluster { .. } => Bounds::around(node.center, node.radius),
        }
    }

    fn around(center: DVec3, radius: f64) -> Bounds {
        Bounds {
            min: center - radius,
            max: center + radius,
        }
    }

    fn union(self, o: Bounds) -> Bounds {
        Bounds {
            min: self.min.min(o.min),
            max: self.max.max(o.max),
        }
    }

    fn longest(&self) -> f64 {
        (self.max - self.min).max_element().max(0.0)
    }
}

fn placeholder() -> TreeNode {
    TreeNode {
        parent: NONE,
        quarters: NONE,
        kind: Kind::Cluster { first: 0, count: 0 },
        area: 0.0,
        center: DVec3::ZERO,
        radius: 0.0,
        normal: DVec3::ZERO,
        albedo: Rgb64::ZERO,
        emission: Rgb64::ZERO,
        external: Rgb64::ZERO,
        stray: Rgb64::ZERO,
        gain: Gain::NONE,
        links: Vec::new(),
    }
}

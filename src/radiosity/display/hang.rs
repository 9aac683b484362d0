//! Vertices of small patches on the edges of large ones.

use super::weld::Welded;
use crate::math::DVec3;
use std::collections::HashSet;

/// A place on the outline of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    pub point: u32,
    /// Whether it is no corner of the patch.
    pub hangs: bool,
    /// The edge that begins or goes on here: number of the corner where it began.
    pub edge: u8,
}

/// The places around each patch: its corners, and all points of the surface that lie on its edges.
pub fn rings(welded: &Welded) -> Vec<Vec<Place>> {
    let edges = |corners: &[u32]| -> Vec<[u32; 2]> {
        (0..corners.len())
            .map(|i| [corners[i], corners[(i + 1) % corners.len()]])
            .collect()
    };
    // Where a neighbour has the same edge, no vertex hangs: all others are few.
    let all: HashSet<[u32; 2]> = welded.corners.iter().flat_map(|c| edges(c)).collect();
    let alone = |&[a, b]: &[u32; 2]| a != b && !all.contains(&[b, a]);
    let mut candidates: Vec<u32> = welded
        .corners
        .iter()
        .flat_map(|c| edges(c))
        .filter(alone)
        .flatten()
        .collect();
    candidates.sort_unstable();
    candidates.dedup();
    let tree = Tree::new(welded, candidates);
    let mut on_edge = Vec::new();
    let mut ring = |corners: &Vec<u32>| {
        let mut places = Vec::with_capacity(corners.len());
        for (i, edge) in edges(corners).into_iter().enumerate() {
            let edge_number = i as u8;
            places.push(Place {
                point: edge[0],
                hangs: false,
                edge: edge_number,
            });
            if !alone(&edge) {
                continue;
            }
            on_edge.clear();
            tree.on_segment(edge, &mut on_edge);
            on_edge.retain(|(_, point)| !corners.contains(point));
            on_edge.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            places.extend(on_edge.iter().map(|&(_, point)| Place {
                point,
                hangs: true,
                edge: edge_number,
            }));
        }
        places
    };
    welded.corners.iter().map(&mut ring).collect()
}

/// Points, halved again and again.
struct Tree<'a> {
    welded: &'a Welded,
    order: Vec<u32>,
    /// As a heap: the children of node i are 2i + 1 and 2i + 2.
    boxes: Vec<[DVec3; 2]>,
}

/// Most points of a leaf.
const LEAF: usize = 8;

impl<'a> Tree<'a> {
    fn new(welded: &'a Welded, order: Vec<u32>) -> Tree<'a> {
        let n = order.len();
        let mut tree = Tree {
            welded,
            order,
            boxes: Vec::new(),
        };
        tree.build(0, 0, n);
        tree
    }

    fn build(&mut self, node: usize, from: usize, to: usize) {
        let points = &self.welded.points;
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let bounds = self.order[from..to].iter().fold(empty, |[low, high], &i| {
            let p = points[i as usize];
            [low.min(p), high.max(p)]
        });
        if self.boxes.len() <= node {
            self.boxes.resize(node + 1, empty);
        }
        self.boxes[node] = bounds;
        if to - from <= LEAF {
            return;
        }
        let size = (bounds[1] - bounds[0]).to_array();
        let axis = (0..3).fold(0, |a, b| if size[b] > size[a] { b } else { a });
        let middle = (from + to) / 2;
        let key = |i: &u32| points[*i as usize][axis];
        self.order[from..to].select_nth_unstable_by(middle - from, |a, b| {
            key(a).total_cmp(&key(b)).then(a.cmp(b))
        });
        self.build(2 * node + 1, from, middle);
        self.build(2 * node + 2, middle, to);
    }

    /// Points between the ends of an edge, and how far along.
    fn on_segment(&self, edge: [u32; 2], out: &mut Vec<(f64, u32)>) {
        let [a, b] = edge.map(|i| self.welded.points[i as usize]);
        let tolerance = edge
            .map(|i| self.welded.tolerance[i as usize])
            .into_iter()
            .fold(0.0, f64::max);
        let d = b - a;
        let length2 = d.length_squared();
        // Above zero: ends are apart by more than their tolerance.
        let mut stack = vec![(0, 0, self.order.len())];
        while let Some((node, from, to)) = stack.pop() {
            if from == to || !meets(self.boxes[node], a, d, tolerance) {
                continue;
            }
            if to - from > LEAF {
                let middle = (from + to) / 2;
                stack.push((2 * node + 1, from, middle));
                stack.push((2 * node + 2, middle, to));
                continue;
            }
            for &i in &self.order[from..to] {
                let to_point = self.welded.points[i as usize] - a;
                let along = to_point.dot(d) / length2;
                let off = (to_point - d * along).length();
                let near = off <= tolerance.max(self.welded.tolerance[i as usize]);
                if near && along > 0.0 && along < 1.0 && !edge.contains(&i) {
                    out.push((along, i));
                }
            }
        }
    }
}

/// Whether a + t d, t in [0,1], comes as near as `tolerance` to a box (slabs).
fn meets([low, high]: [DVec3; 2], a: DVec3, d: DVec3, tolerance: f64) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let (low, high) = (
            low[axis] - tolerance - a[axis],
            high[axis] + tolerance - a[axis],
        );
        if d[axis] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (near, far) = (low / d[axis], high / d[axis]);
        from = from.max(near.min(far));
        to = to.min(near.max(far));
    }
    from <= to
}

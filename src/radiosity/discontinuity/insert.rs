//! Divides a facet into triangles that no line crosses.

use super::{Line, clip};
use crate::math::DVec2;
use crate::radiosity::mesh::cells_for;
use crate::radiosity::piece::{Outline, Piece};
use crate::radiosity::triangulation::{Order, Triangulation};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use std::collections::HashMap;

type Mesh = ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Lines of slope bend to points that are nearer than this share of the patches' size.
const SNAP: f64 = 0.01;
/// Lines of contact bend no further than this, relative to the facet: what f32 makes of one point.
const EXACT: f64 = 1e-6;
/// Regular points keep this far from lines and other points, as a share of their distance.
const APART: f64 = 0.45;

/// How near points of a facet may come to each other, in scene units.
pub fn snap(piece: &Piece, size: f64) -> f64 {
    SNAP * size.min(piece.longest_edge())
}

/// The triangles of a facet along `lines`, stronger lines first; regular points at distances of about `size` (scene
/// units). `None` where nothing is to be cut, or the facet has no extent across.
pub fn triangulate(piece: &Piece, size: f64, lines: &[Line]) -> Option<Triangulation> {
    if lines.is_empty() {
        return None;
    }
    let plane = Plane::new(piece)?;
    let mut cutter = Cutter::new(plane, snap(piece, size) / piece.longest_edge())?;
    let n = cells_for(piece, size);
    let spacing = (size / piece.longest_edge()).clamp(1e-4, 1.0);
    for line in lines {
        cutter.cut(line, spacing);
    }
    if cutter.pieces.is_empty() {
        return None;
    }
    cutter.fill(n);
    Some(cutter.triangles(spacing))
}

/// The plane of a facet in units of its longest edge, without distortion.
#[derive(Clone, Copy, Debug)]
struct Plane {
    outline: Outline,
    e1: DVec2,
    e2: DVec2,
}

impl Plane {
    fn new(piece: &Piece) -> Option<Plane> {
        let scale = piece.longest_edge();
        let (e1, e2) = (piece.e1 / scale, piece.e2 / scale);
        let x = e1.normalize_or_zero();
        let along = x.dot(e2);
        let plane = Plane {
            outline: piece.outline,
            e1: DVec2::new(e1.length(), 0.0),
            e2: DVec2::new(along, (e2 - x * along).length()),
        };
        // Thinner than rounding: its lines would all fall together.
        let wide = plane.e1.x > EXACT && plane.e2.y > EXACT && scale.is_finite();
        wide.then_some(plane)
    }

    fn at(&self, st: DVec2) -> DVec2 {
        self.e1 * st.x + self.e2 * st.y
    }

    fn locate(&self, p: DVec2) -> DVec2 {
        let t = p.y / self.e2.y;
        DVec2::new((p.x - self.e2.x * t) / self.e1.x, t)
    }

    /// Heights over the sides, of [`clip::depths`].
    fn heights(&self) -> [f64; 4] {
        let area = self.e1.x * self.e2.y;
        let third = match self.outline {
            Outline::Triangle => self.e2 - self.e1,
            Outline::Parallelogram => self.e2,
        };
        [
            area / self.e2.length(),
            area / self.e1.length(),
            area / third.length(),
            area / self.e1.length(),
        ]
    }

    /// Moves what is nearer to a side than `near` onto it.
    fn to_outline(self, mut st: DVec2, near: f64) -> DVec2 {
        for (side, height) in self.heights().into_iter().enumerate() {
            let depth = clip::depths(self.outline, st)[side];
            if depth.abs() * height > near {
                continue;
            }
            match (side, self.outline) {
                (0, _) => st.x = 0.0,
                (1, _) => st.y = 0.0,
                (2, Outline::Parallelogram) => st.x = 1.0,
                (3, Outline::Parallelogram) => st.y = 1.0,
                (2, _) => st += DVec2::splat(0.5 * depth),
                _ => {}
            }
        }
        self.outline.clamp(st)
    }

    /// Whether both places lie on the same side of the outline.
    fn on_one_side(&self, a: DVec2, b: DVec2) -> bool {
        let heights = self.heights();
        let [a, b] = [a, b].map(|st| clip::depths(self.outline, st));
        (0..4).any(|i| a[i].abs().max(b[i].abs()) * heights[i] <= 1e-12)
    }

    /// Longest distance between neighbours of a grid of this many cells along an edge of the facet.
    fn spacing(&self, n: [u32; 2]) -> f64 {
        let (a, b) = (
            self.e1.length() / f64::from(n[0]),
            self.e2.length() / f64::from(n[1]),
        );
        a.max(b)
    }
}

/// A straight part of a line, between two points of the mesh.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    ends: [DVec2; 2],
    order: Order,
}

/// A facet under the knife.
struct Cutter {
    plane: Plane,
    mesh: Mesh,
    /// By vertex.
    points: Vec<DVec2>,
    near: Near,
    snap: f64,
    pieces: Vec<Stretch>,
}

impl Cutter {
    fn new(plane: Plane, snap: f64) -> Option<Cutter> {
        let snap = snap.max(EXACT);
        let mut cutter = Cutter {
            plane,
            mesh: Mesh::new(),
            points: Vec::new(),
            near: Near::new(snap),
            snap,
            pieces: Vec::new(),
        };
        for st in plane.outline.corners() {
            cutter.insert(plane.at(*st))?;
        }
        Some(cutter)
    }

    /// A vertex at `p`; `None` where coordinates leave the range of numbers.
    fn insert(&mut self, p: DVec2) -> Option<FixedVertexHandle> {
        // Smallest numbers would be refused; against the facet's size of 1 they are nothing.
        let clean = |x: f64| if x.abs() < 1e-30 { 0.0 } else { x };
        let handle = self.mesh.insert(Point2::new(clean(p.x), clean(p.y))).ok()?;
        self.notice();
        Some(handle)
    }

    /// Takes vertices into account that the mesh has made.
    fn notice(&mut self) {
        for i in self.points.len()..self.mesh.num_vertices() {
            let position = self
                .mesh
                .vertex(FixedVertexHandle::from_index(i))
                .position();
            let p = DVec2::new(position.x, position.y);
            self.near.add(p, i);
            self.points.push(p);
        }
    }

    /// The vertex at `st`, or one within `snap`.
    fn place(&mut self, st: DVec2, snap: f64) -> Option<FixedVertexHandle> {
        let p = self.plane.at(self.plane.to_outline(st, snap));
        match self.near.nearest(&self.points, p, snap) {
            Some(i) => Some(FixedVertexHandle::from_index(i)),
            None => self.insert(p),
        }
    }

    /// Makes `line` an edge of triangles.
    fn cut(&mut self, line: &Line, spacing: f64) {
        let order = line.kind.order();
        let snap = match order {
            Order::Value => EXACT,
            Order::Slope => self.snap,
        };
        let [a, b] = line.ends.map(|st| self.place(st, snap));
        let (Some(a), Some(b)) = (a, b) else { return };
        let [p, q] = [a, b].map(|v| self.points[v.index()]);
        let [from, to] = [p, q].map(|p| self.plane.locate(p));
        if a == b || self.plane.on_one_side(from, to) {
            return;
        }
        // Vertices on the way, and where others cross it.
        let mut stops: Vec<(f64, Option<usize>)> = vec![(0.0, Some(a.index()))];
        let length2 = (q - p).length_squared();
        let along = |x: DVec2| (x - p).dot(q - p) / length2;
        for (i, &x) in self.points.iter().enumerate() {
            let t = along(x);
            let off = (x - p.lerp(q, t)).length();
            if t > 0.0 && t < 1.0 && off <= snap && i != a.index() && i != b.index() {
                stops.push((t, Some(i)));
            }
        }
        let crossed = self
            .pieces
            .iter()
            .filter_map(|piece| crossing([p, q], piece.ends));
        stops.extend(crossed.map(|t| (t, None)));
        stops.push((1.0, Some(b.index())));
        stops.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.chain(&stops, p, q, spacing, order);
    }

    /// Joins vertices along a line from `p` to `q`, with more between those that are far apart.
    fn chain(
        &mut self,
        stops: &[(f64, Option<usize>)],
        p: DVec2,
        q: DVec2,
        spacing: f64,
        order: Order,
    ) {
        let mut last: Option<usize> = None;
        let length = p.distance(q);
        for (k, &(t, vertex)) in stops.iter().enumerate() {
            if k > 0 {
                let before = stops[k - 1].0;
                let n = ((t - before) * length / (1.25 * spacing)).ceil().max(1.0);
                for i in 1..n as u32 {
                    let at = before + (t - before) * f64::from(i) / n;
                    if let Some(v) = self.insert(p.lerp(q, at)) {
                        self.join(&mut last, v.index(), order);
                    }
                }
            }
            if let Some(v) = vertex {
                self.join(&mut last, v, order);
            }
        }
    }

    fn join(&mut self, last: &mut Option<usize>, to: usize, order: Order) {
        if let Some(from) = *last
            && from != to
        {
            let ends = [from, to].map(FixedVertexHandle::from_index);
            self.mesh.add_constraint_and_split(ends[0], ends[1], |p| p);
            self.notice();
            self.pieces.push(Stretch {
                ends: [from, to].map(|i| self.points[i]),
                order,
            });
        }
        *last = Some(to);
    }

    /// Adds the points of a regular grid, where nothing else is near.
    fn fill(&mut self, n: [u32; 2]) {
        let apart = APART * self.plane.spacing(n);
        let mut taken = Near::new(apart);
        let mut points = self.points.clone();
        for piece in &self.pieces {
            let [a, b] = piece.ends;
            let steps = (2.0 * a.distance(b) / apart).ceil().max(1.0) as u32;
            points.extend((1..steps).map(|i| a.lerp(b, f64::from(i) / f64::from(steps))));
        }
        for (i, p) in points.iter().enumerate() {
            taken.add(*p, i);
        }
        for j in 0..=n[1] {
            let row = match self.plane.outline {
                Outline::Triangle => n[0] - j,
                Outline::Parallelogram => n[0],
            };
            for i in 0..=row {
                let st = DVec2::new(
                    f64::from(i) / f64::from(n[0]),
                    f64::from(j) / f64::from(n[1]),
                );
                let p = self.plane.at(st);
                if taken.nearest(&points, p, apart).is_none() {
                    self.insert(p);
                }
            }
        }
    }

    fn triangles(&self, spacing: f64) -> Triangulation {
        let mut jumps = Near::new(1.25 * spacing);
        for (i, piece) in self.pieces.iter().enumerate() {
            if piece.order == Order::Value {
                jumps.add_box(piece.ends, i);
            }
        }
        let places: Vec<DVec2> = self
            .points
            .iter()
            .enumerate()
            .map(|(i, p)| match self.plane.outline.corners().get(i) {
                Some(corner) => *corner,
                None => self.plane.to_outline(self.plane.locate(*p), 1e-13),
            })
            .collect();
        let mut triangles = Vec::new();
        let mut corners = Vec::new();
        let mut edges = Vec::new();
        for face in self.mesh.inner_faces() {
            let numbers = face.vertices().map(|v| v.fix().index());
            let placed = numbers.map(|i| places[i]);
            // Between points that rounding put beside the outline.
            if is_flat(numbers.map(|i| self.points[i])) || is_flat(placed) {
                continue;
            }
            triangles.push(placed);
            corners.push(numbers.map(|i| i as u32));
            edges.push(face.adjacent_edges().map(|edge| {
                let line = edge.is_constraint_edge();
                let ends = edge.positions().map(|p| DVec2::new(p.x, p.y));
                line.then(|| self.order((ends[0] + ends[1]) * 0.5, &jumps))
            }));
        }
        Triangulation::new(triangles, corners, edges, 0)
    }

    /// What happens at a point of a line: the most of what any line does there.
    fn order(&self, p: DVec2, jumps: &Near) -> Order {
        let here = |i: &usize| {
            let [a, b] = self.pieces[*i].ends;
            let t = (p - a).dot(b - a) / (b - a).length_squared();
            p.distance(a.lerp(b, t.clamp(0.0, 1.0))) <= EXACT
        };
        match jumps.at(p).any(|i| here(&i)) {
            true => Order::Value,
            false => Order::Slope,
        }
    }
}

/// Whether a triangle has no area but for rounding.
fn is_flat([a, b, c]: [DVec2; 3]) -> bool {
    let longest = (b - a).length_squared().max((c - a).length_squared());
    (b - a).perp_dot(c - a) <= 1e-12 * longest
}

/// Where on the first line the second crosses it, if both do so between their ends.
fn crossing([p, q]: [DVec2; 2], [a, b]: [DVec2; 2]) -> Option<f64> {
    let (d, e) = (q - p, b - a);
    let det = d.perp_dot(e);
    let (t, u) = ((a - p).perp_dot(e) / det, (a - p).perp_dot(d) / det);
    // False for parallel lines, where they are no numbers.
    (t > 0.0 && t < 1.0 && (0.0..=1.0).contains(&u)).then_some(t)
}

/// Points by cells of a grid, to find those near to a place.
struct Near {
    cell: f64,
    cells: HashMap<[i64; 2], Vec<usize>>,
}

impl Near {
    /// For distances up to `reach`.
    fn new(reach: f64) -> Near {
        Near {
            cell: reach,
            cells: HashMap::new(),
        }
    }

    fn key(&self, p: DVec2) -> [i64; 2] {
        (p / self.cell).floor().to_array().map(|x| x as i64)
    }

    fn add(&mut self, p: DVec2, number: usize) {
        let key = self.key(p);
        self.cells.entry(key).or_default().push(number);
    }

    /// Adds a number to all cells that a line may pass within rounding.
    fn add_box(&mut self, [a, b]: [DVec2; 2], number: usize) {
        let (low, high) = (self.key(a.min(b) - EXACT), self.key(a.max(b) + EXACT));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                self.cells.entry([x, y]).or_default().push(number);
            }
        }
    }

    /// Numbers in the cell of `p`.
    fn at(&self, p: DVec2) -> impl Iterator<Item = usize> + '_ {
        let there = self.cells.get(&self.key(p));
        there.into_iter().flatten().copied()
    }

    /// The nearest of `points` within `reach`, which is at most that of the grid.
    fn nearest(&self, points: &[DVec2], p: DVec2, reach: f64) -> Option<usize> {
        let [x, y] = self.key(p);
        let mut best = None;
        for i in x - 1..=x + 1 {
            for j in y - 1..=y + 1 {
                for &number in self.cells.get(&[i, j]).into_iter().flatten() {
                    let distance = points[number].distance(p);
                    if distance <= best.map_or(reach, |(least, _)| least) {
                        best = Some((distance, number));
                    }
                }
            }
        }
        best.map(|(_, number)| number)
    }
}

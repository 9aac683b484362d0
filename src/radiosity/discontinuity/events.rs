//! Lines that edges and corners of occluders throw onto a facet.

use super::clip::{self, Part};
use super::shell::{Edge, Shell};
use super::source::{Eye, Source};
use super::{Kind, Line, Seeker};
use crate::math::DVec3;
use crate::radiosity::piece::Piece;

/// A line that may be an edge of a shadow, if the light gets there.
#[derive(Clone, Copy, Debug)]
pub struct Event {
    pub line: Line,
    pub from: From,
    /// Of the lamp, towards the side that shines; zero where there is none.
    pub lamp_normal: DVec3,
}

/// Which point of the light a line's point sees just at the occluder.
#[derive(Clone, Copy, Debug)]
pub enum From {
    Eye(Eye),
    /// On the line of an edge of the lamp, behind the corner `over`.
    Edge {
        ends: [DVec3; 2],
        over: DVec3,
    },
    /// Nothing hides a lamp's horizon but what stands before it.
    Horizon(Eye),
}

impl From {
    /// The point of the light for the point `x` of the line.
    pub fn eye(&self, x: DVec3) -> Eye {
        match *self {
            From::Eye(eye) | From::Horizon(eye) => eye,
            From::Edge { ends: [a, b], over } => {
                let (to, along) = (over - x, b - a);
                let across = along.cross(to);
                let t = (x - a).cross(to).dot(across) / across.length_squared();
                Eye::point(a.lerp(
                    b,
                    if t.is_finite() {
                        t.clamp(0.0, 1.0)
                    } else {
                        0.5
                    },
                ))
            }
        }
    }
}

/// A light and what can throw shadows in it.
pub struct Thrower<'a> {
    source: &'a Source,
    /// Corners of the light, and the edges that are outlines as seen from there.
    outlines: Vec<(usize, Vec<u32>)>,
    /// By edge of the light: corners on outlines.
    corners: Vec<Vec<u32>>,
}

impl Edge {
    /// Whether some point sees all of the edge's polygons on one side of it.
    pub fn can_be_outline(&self) -> bool {
        match self.inward[..] {
            [a, b] => {
                let (a, b) = (a.normalize_or_zero(), b.normalize_or_zero());
                // Not where two lie in one plane, on both sides of the edge.
                a.dot(b) > -1.0 + 1e-10
            }
            _ => true,
        }
    }

    fn is_outline(&self, points: &[DVec3], eye: &Eye) -> bool {
        let [a, b] = self.ends.map(|i| points[i as usize]);
        let to = eye.from(a);
        let across = (b - a).cross(to);
        let (mut left, mut right) = (false, false);
        for inward in &self.inward {
            let side = across.dot(*inward);
            // Edge-on counts as neither.
            let least = 1e-7 * across.length() * inward.length();
            left |= side > least;
            right |= side < -least;
        }
        !(left && right)
    }
}

impl<'a> Thrower<'a> {
    pub fn new(source: &'a Source, shell: &Shell, edges: &[u32]) -> Thrower<'a> {
        let before = |p: DVec3| {
            source
                .plane
                .is_none_or(|(o, n)| n.dot(p - o) > 4.0 * shell.tolerance)
        };
        let useful: Vec<u32> = edges
            .iter()
            .copied()
            .filter(|i| {
                let ends = shell.edges[*i as usize].ends;
                ends.iter().any(|end| before(shell.points[*end as usize]))
            })
            .collect();
        let is_outline = |corner: usize, edge: u32| {
            shell.edges[edge as usize].is_outline(&shell.points, &source.corners[corner])
        };
        let mut outlines = vec![Vec::new(); source.corners.len()];
        for &edge in &useful {
            if source.smooth {
                let [a, b] = shell.ends(edge);
                let mut ends = source.outermost(a, b - a).to_vec();
                ends.dedup();
                let seen = ends.into_iter().filter(|corner| is_outline(*corner, edge));
                seen.for_each(|corner| outlines[corner].push(edge));
            } else {
                let all = 0..source.corners.len();
                let seen = all.filter(|corner| is_outline(*corner, edge));
                seen.for_each(|corner| outlines[corner].push(edge));
            }
        }
        let on_outlines = |ends: &[usize; 2]| {
            let mut corners: Vec<u32> = ends
                .iter()
                .flat_map(|end| &outlines[*end])
                .flat_map(|edge| shell.edges[*edge as usize].ends)
                .filter(|corner| before(shell.points[*corner as usize]))
                .collect();
            corners.sort_unstable();
            corners.dedup();
            corners
        };
        let corners = source.edges.iter().map(on_outlines).collect();
        let outlines = outlines.into_iter().enumerate();
        let outlines = outlines.filter(|(_, edges)| !edges.is_empty()).collect();
        Thrower {
            source,
            outlines,
            corners,
        }
    }

    /// Appends all lines on a facet that are longer than `least` scene units.
    pub fn events(&self, seeker: &Seeker, facet: usize, least: f64, out: &mut Vec<Event>) {
        let receiver = Receiver::new(seeker, facet, least);
        for (corner, edges) in &self.outlines {
            let eye = &self.source.corners[*corner];
            let Some(view) = View::new(&receiver, eye) else {
                continue;
            };
            for &edge in edges {
                if let Some(ends) = self.thrown(&view, seeker.shell.ends(edge)) {
                    let kind = match self.source.edges.is_empty() && !self.source.smooth {
                        true => Kind::Shadow,
                        false => Kind::VertexEdge,
                    };
                    self.push(&receiver, ends, kind, From::Eye(*eye), out);
                }
            }
        }
        for (edge, corners) in self.source.edges.iter().zip(&self.corners) {
            let ends = edge.map(|i| self.source.corners[i].v);
            for &corner in corners {
                let over = seeker.shell.points[corner as usize];
                if let Some(line) = receiver.thrown_by_corner(over, ends) {
                    let from = From::Edge { ends, over };
                    self.push(&receiver, line, Kind::EdgeVertex, from, out);
                }
            }
        }
        self.horizon(&receiver, out);
    }

    /// The shadow of an edge in the light of a corner.
    fn thrown(&self, view: &View, [a, b]: [DVec3; 2]) -> Option<[DVec3; 2]> {
        let mut part = Part::ALL;
        let receiver = view.receiver;
        for (normal, c) in &view.sides {
            if !part.keep(normal.dot(a - *c), normal.dot(b - *c)) {
                return None;
            }
        }
        let (ha, hb) = (receiver.height(a), receiver.height(b));
        // What lies on the receiver touches it: that line is found as a contact.
        if ha.max(hb) <= receiver.tolerance || !part.keep(ha, hb) {
            return None;
        }
        let below = |h: f64| view.height * (1.0 - 1e-9) - view.eye.w * h;
        if !part.keep(below(ha), below(hb)) {
            return None;
        }
        if let Some((o, n)) = self.source.plane {
            let (fa, fb) = (n.dot(a - o), n.dot(b - o));
            if fa.max(fb) <= receiver.tolerance || !part.keep(fa, fb) {
                return None;
            }
        }
        let ends = [part.from, part.to].map(|t| {
            let p = a.lerp(b, t);
            let to = view.eye.from(p);
            p - to * (receiver.height(p) / receiver.normal.dot(to))
        });
        ends.iter().all(|p| p.is_finite()).then_some(ends)
    }

    /// Where the plane of the lamp meets the facet.
    fn horizon(&self, receiver: &Receiver, out: &mut Vec<Event>) {
        let Some((o, n)) = self.source.plane else {
            return;
        };
        let corners: Vec<DVec3> = receiver.piece.corners().collect();
        let height = |p: DVec3| n.dot(p - o);
        let mut ends = Vec::new();
        for (i, &p) in corners.iter().enumerate() {
            let q = corners[(i + 1) % corners.len()];
            let (from, to) = (height(p), height(q));
            if (from > 0.0) != (to > 0.0) {
                ends.push(p.lerp(q, from / (from - to)));
            }
        }
        let lit = self
            .source
            .corners
            .iter()
            .any(|eye| receiver.height(eye.v) > receiver.tolerance);
        let level = |p: &DVec3| height(*p).abs() <= receiver.tolerance;
        // A facet in the plane of the lamp has no horizon on it.
        if let ([p, q], true) = (&ends[..], lit && !corners.iter().all(level)) {
            let middle: DVec3 = self.source.corners.iter().map(|eye| eye.v).sum();
            let eye = Eye::point(middle / self.source.corners.len() as f64);
            let from = From::Horizon(eye);
            self.push(receiver, [*p, *q], Kind::Horizon, from, out);
        }
    }

    fn push(
        &self,
        receiver: &Receiver,
        ends: [DVec3; 2],
        kind: Kind,
        from: From,
        out: &mut Vec<Event>,
    ) {
        let placed = ends.map(|p| receiver.piece.locate(p));
        let Some(ends) = clip::to_outline(receiver.piece.outline, placed) else {
            return;
        };
        let [p, q] = ends.map(|st| receiver.piece.at(st));
        let length = p.distance(q);
        let middle = 0.5 * (p + q);
        let e = self
            .source
            .irradiance(receiver.scene, middle, receiver.normal);
        // Also false for what is not a number.
        if !(length > receiver.least && e > 0.0) {
            return;
        }
        out.push(Event {
            line: Line {
                ends,
                kind,
                weight: e * length,
            },
            from,
            lamp_normal: self.source.plane.map_or(DVec3::ZERO, |(_, n)| n),
        });
    }
}

/// A facet that lines are thrown on.
struct Receiver<'a> {
    scene: &'a crate::scene::Scene,
    piece: &'a Piece,
    normal: DVec3,
    tolerance: f64,
    least: f64,
}

impl<'a> Receiver<'a> {
    fn new(seeker: &Seeker<'a>, facet: usize, least: f64) -> Receiver<'a> {
        let piece = &seeker.surfaces.facets()[facet].piece;
        Receiver {
            scene: seeker.scene,
            piece,
            normal: piece.normal(),
            tolerance: 4.0 * seeker.shell.tolerance,
            least,
        }
    }

    fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p - self.piece.o)
    }

    /// Planes through an eye and the sides of the facet: normals to the inside, and a point of each.
    fn sides(&self, eye: &Eye) -> Vec<(DVec3, DVec3)> {
        let corners: Vec<DVec3> = self.piece.corners().collect();
        let side = |i: usize| {
            let (c, d) = (corners[i], corners[(i + 1) % corners.len()]);
            (eye.from(c).cross(d - c), c)
        };
        (0..corners.len()).map(side).collect()
    }

    /// The shadow of a corner in the light of an edge.
    fn thrown_by_corner(&self, p: DVec3, [a, b]: [DVec3; 2]) -> Option<[DVec3; 2]> {
        let height = self.height(p);
        if height <= self.tolerance {
            return None;
        }
        let mut part = Part::ALL;
        let above = |l: DVec3| self.height(l) - height * (1.0 + 1e-9);
        if !part.keep(above(a), above(b)) {
            return None;
        }
        // Seen through the corner, the facet lies the other way round.
        for (normal, c) in self.sides(&Eye::point(p)) {
            if !part.keep(-normal.dot(a - c), -normal.dot(b - c)) {
                return None;
            }
        }
        let ends = [part.from, part.to].map(|t| {
            let l = a.lerp(b, t);
            p + (p - l) * (height / (self.height(l) - height))
        });
        ends.iter().all(|p| p.is_finite()).then_some(ends)
    }
}

/// A facet as a corner of a light sees it.
struct View<'a> {
    receiver: &'a Receiver<'a>,
    eye: &'a Eye,
    /// Of the eye over the facet; of a direction, its cosine.
    height: f64,
    sides: Vec<(DVec3, DVec3)>,
}

impl<'a> View<'a> {
    /// `None` from behind, or in the facet's plane.
    fn new(receiver: &'a Receiver, eye: &'a Eye) -> Option<View<'a>> {
        let height = receiver.normal.dot(eye.from(receiver.piece.o));
        (height > receiver.tolerance * eye.w && height > 0.0).then(|| View {
            receiver,
            eye,
            height,
            sides: receiver.sides(eye),
        })
    }
}

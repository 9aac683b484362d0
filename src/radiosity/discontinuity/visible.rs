//! Which parts of a line are edges of a shadow: those where a point of the light is seen from one side only.

use super::Seeker;
use super::events::{Event, From};
use super::source::Eye;
use crate::geom::Endpoint;
use crate::math::{DVec2, fp};

/// Beside the line, rays are cast from this share of the patches' size away.
const BESIDE: f64 = 2e-3;
/// Along an edge of the lamp, this share of its length is as good as no distance.
const ASIDE: f64 = 1e-3;
/// Most places of a line that are looked at, before its ends are sought.
const MOST: f64 = 32.0;
/// Halvings of the interval that a visible part ends in.
const HALVINGS: usize = 6;

/// The parts of an event's line across which the light's visibility changes.
pub fn parts(seeker: &Seeker, facet: usize, event: &Event) -> Vec<[DVec2; 2]> {
    let view = Beside::new(seeker, facet, event);
    let [a, b] = event.line.ends;
    let piece = view.piece;
    let length = piece.at(a).distance(piece.at(b));
    let size = seeker.size.min(piece.longest_edge());
    let n = (4.0 * length / size).ceil().clamp(6.0, MOST) as usize;
    let at = |i: usize| (i as f64 + 0.5) / n as f64;
    let active: Vec<bool> = (0..n).map(|i| view.changes(at(i))).collect();
    let mut parts = Vec::new();
    let mut i = 0;
    while i < n {
        if !active[i] {
            i += 1;
            continue;
        }
        let first = i;
        while i < n && active[i] {
            i += 1;
        }
        let from = match first {
            0 => 0.0,
            _ => view.boundary(at(first), at(first - 1)),
        };
        let to = match i == n {
            true => 1.0,
            false => view.boundary(at(i - 1), at(i)),
        };
        parts.push([a.lerp(b, from), a.lerp(b, to)]);
    }
    parts
}

/// Looks from both sides of a line.
struct Beside<'a> {
    seeker: &'a Seeker<'a>,
    facet: usize,
    event: &'a Event,
    piece: &'a crate::radiosity::Piece,
    /// Across the line, in the coordinates of the facet.
    across: DVec2,
}

impl<'a> Beside<'a> {
    fn new(seeker: &'a Seeker<'a>, facet: usize, event: &'a Event) -> Beside<'a> {
        let piece = &seeker.surfaces.facets()[facet].piece;
        let [p, q] = event.line.ends.map(|st| piece.at(st));
        let across = piece.normal().cross((q - p).normalize_or_zero());
        let size = seeker.size.min(piece.longest_edge());
        // Far enough for f32 to tell the sides apart.
        let away = (BESIDE * size).max(32.0 * seeker.shell.tolerance);
        let origin = piece.locate(piece.o);
        Beside {
            seeker,
            facet,
            event,
            piece,
            across: piece.locate(piece.o + across * away) - origin,
        }
    }

    /// Whether the light is seen from one side only at `t` of the line.
    fn changes(&self, t: f64) -> bool {
        let [a, b] = self.event.line.ends;
        let st = a.lerp(b, t);
        let differs =
            |eye: &Eye| self.sees(st + self.across, eye) != self.sees(st - self.across, eye);
        match self.event.from {
            From::Horizon(_) => true,
            From::Eye(eye) => differs(&eye),
            From::Edge { ends: [a, b], .. } => {
                let eye = self.event.from.eye(self.piece.at(st));
                // Where edges are parallel, the view grazes one from both sides: aside, it is clear.
                let by = (b - a) * ASIDE;
                let aside = [Eye::point(eye.v - by), Eye::point(eye.v + by)];
                differs(&eye) || aside.iter().any(differs)
            }
        }
    }

    /// Where between `yes` and `no` the line ceases to be an edge.
    fn boundary(&self, mut yes: f64, mut no: f64) -> f64 {
        for _ in 0..HALVINGS {
            let middle = 0.5 * (yes + no);
            match self.changes(middle) {
                true => yes = middle,
                false => no = middle,
            }
        }
        no
    }

    fn sees(&self, st: DVec2, eye: &Eye) -> bool {
        let Seeker {
            scene, surfaces, ..
        } = self.seeker;
        let st = self.piece.outline.clamp(st);
        let hit = surfaces.hit(scene, self.facet as u32, st);
        let v = eye.v.as_vec3();
        if eye.w == 0.0 {
            return !scene.occluded(&hit.spawn(v.normalize_or_zero()));
        }
        let end = Endpoint {
            p: v,
            p_err: v.abs() * fp::gamma(8),
            ng: self.event.lamp_normal.as_vec3(),
        };
        !scene.occluded(&hit.spawn_to(&end))
    }
}

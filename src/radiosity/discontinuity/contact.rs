//! Where surfaces touch or pass through a facet.

use super::clip;
use super::shell::Shell;
use super::{Kind, Line};
use crate::math::{DVec2, DVec3};
use crate::radiosity::piece::{Outline, Piece};
use crate::radiosity::surfaces::Surfaces;

/// The lines on a facet where other polygons touch it, or pass through; not those along its outline.
pub fn contacts(shell: &Shell, surfaces: &Surfaces, facet: usize) -> Vec<Line> {
    let own = shell.polygon_of[facet];
    let Some(polygon) = shell.polygons.get(own as usize) else {
        return Vec::new();
    };
    let piece = &surfaces.facets()[facet].piece;
    let normal = piece.normal();
    let margin = DVec3::splat(shell.tolerance);
    let (low, high) = (polygon.low - margin, polygon.high + margin);
    let mut lines = Vec::new();
    for (i, other) in shell.polygons.iter().enumerate() {
        if i as u32 == own || other.low.cmpgt(high).any() || other.high.cmplt(low).any() {
            continue;
        }
        touching(shell, (piece, normal), i as u32, |ends| {
            let placed = ends.map(|p| piece.locate(p));
            let Some(ends) = clip::to_outline(piece.outline, placed) else {
                return;
            };
            let length = piece.at(ends[0]).distance(piece.at(ends[1]));
            if length > shell.tolerance && !along_outline(shell, piece, ends) {
                lines.push(Line {
                    ends,
                    kind: Kind::Contact,
                    weight: length,
                });
            }
        });
    }
    lines
}

/// Calls `found` with each line that polygon `number` has in common with the plane of a piece.
fn touching(
    shell: &Shell,
    (piece, normal): (&Piece, DVec3),
    number: u32,
    mut found: impl FnMut([DVec3; 2]),
) {
    let mut crossings: Vec<DVec3> = Vec::new();
    let other = &shell.polygons[number as usize];
    for (side, (a, b)) in other.sides().enumerate() {
        let [p, q] = [a, b].map(|i| shell.points[i as usize]);
        let height = |p: DVec3| {
            let height = normal.dot(p - piece.o);
            // On the plane, as well as can be known.
            if height.abs() <= 2.0 * shell.tolerance {
                0.0
            } else {
                height
            }
        };
        let (from, to) = (height(p), height(q));
        if from == 0.0 && to == 0.0 {
            // Sides on the plane are lines themselves; several polygons may have the same.
            if shell.edges[other.edges[side] as usize].first == number {
                found([p, q]);
            }
            continue;
        }
        if from == 0.0 {
            crossings.push(p);
        } else if from * to < 0.0 {
            crossings.push(p.lerp(q, from / (from - to)));
        }
    }
    if let [p, q] = crossings[..] {
        found([p, q]);
    }
}

/// Whether a line lies on a side of the outline, where nothing is to be cut.
fn along_outline(shell: &Shell, piece: &Piece, ends: [DVec2; 2]) -> bool {
    let depths = ends.map(|st| clip::depths(piece.outline, st));
    // A unit of depth, in scene units: the height over each side.
    let area = piece.cross().length();
    let heights = [
        area / piece.e2.length(),
        area / piece.e1.length(),
        area / match piece.outline {
            Outline::Triangle => (piece.e2 - piece.e1).length(),
            Outline::Parallelogram => piece.e2.length(),
        },
        area / piece.e1.length(),
    ];
    (0..4).any(|side| {
        let near = |end: usize| depths[end][side] * heights[side] <= 4.0 * shell.tolerance;
        near(0) && near(1)
    })
}

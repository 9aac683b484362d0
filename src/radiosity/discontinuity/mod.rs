//! Discontinuity meshing: patches that end where irradiance, or its slope, jumps.
//!
//! Shadows of a polygonal lamp have edges on planes through a corner of the lamp and an edge of an occluder (VE), or
//! through an edge of the lamp and a corner of an occluder (EV); shadows of lights without extent, on planes through
//! the light and an edge. Where surfaces touch, light and shadow end at the line of contact. These lines are found on
//! each receiving facet, those that are hidden from the light are dropped, and the facet is divided into triangles
//! that no line crosses (Heckbert 1992, "Discontinuity Meshing for Radiosity"; Lischinski, Tampieri & Greenberg 1992,
//! "Discontinuity Meshing for Accurate Radiosity").
//!
//! Left out are the curves on which three edges of occluders meet on a line of sight (EEE), the curved edges that
//! corners throw in the light of curved lamps, and shadows in reflected light.

mod clip;
mod contact;
mod events;
mod found;
mod insert;
mod shell;
mod source;
mod visible;

pub use found::{Found, LeftOut};
pub use insert::triangulate;

use super::mesh::{self, Division, Grid, PatchMesh, cells_for};
use super::piece::Piece;
use super::surfaces::Surfaces;
use super::triangulation::{Order, Triangulation};
use crate::math::DVec2;
use crate::scene::Scene;
use rayon::prelude::*;
use shell::Shell;
use std::sync::Arc;

/// How much is looked for; what lies beyond is counted in [`LeftOut`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Most lights, by power.
    pub lamps: usize,
    /// Most corners of a lamp that each count; of others, which stand for curves, the outermost ones do.
    pub corners: usize,
    /// Most edges of occluders, by length.
    pub edges: usize,
    /// Shortest edge of an occluder, as a share of the size of patches.
    pub shortest: f64,
    /// Most facets that are cut, by area.
    pub facets: usize,
    /// Smallest facet that is cut: its longest edge as a share of the size of patches.
    pub smallest: f64,
    /// Most lines on a facet that are shadows' edges, by irradiance times length.
    pub lines: usize,
    /// Most lines of contact on a facet, by length.
    pub contacts: usize,
}

impl Limits {
    /// No lines are looked for.
    pub const NONE: Limits = Limits {
        lamps: 0,
        corners: 0,
        edges: 0,
        shortest: 0.0,
        facets: 0,
        smallest: 0.0,
        lines: 0,
        contacts: 0,
    };
}

impl Limits {
    /// Only where surfaces touch.
    pub const CONTACTS: Limits = Limits {
        facets: 2000,
        contacts: 200,
        smallest: 0.5,
        ..Limits::NONE
    };
}

impl Default for Limits {
    fn default() -> Limits {
        Limits {
            lamps: 16,
            corners: 8,
            edges: 2000,
            shortest: 0.1,
            facets: 5000,
            smallest: 0.5,
            lines: 200,
            contacts: 200,
        }
    }
}

/// What makes a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Another surface touches the facet or passes through it.
    Contact,
    /// The shadow of an edge in the light of something without extent.
    Shadow,
    /// The shadow of an edge as a corner of a lamp throws it.
    VertexEdge,
    /// The shadow of a corner as an edge of a lamp throws it.
    EdgeVertex,
    /// The plane of a lamp, beyond which it is not seen.
    Horizon,
}

impl Kind {
    pub fn order(self) -> Order {
        match self {
            Kind::Contact | Kind::Shadow => Order::Value,
            _ => Order::Slope,
        }
    }
}

/// A straight line on a facet that no patch may lie across.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// In the coordinates of the facet's piece.
    pub ends: [DVec2; 2],
    pub kind: Kind,
    /// Orders lines of a facet: contacts by length, others by unshadowed irradiance times length.
    pub weight: f64,
}

/// As [`PatchMesh::uniform`], but facets that lines cross are divided into triangles along these. `size` in scene
/// units.
pub fn mesh(
    scene: &Scene,
    surfaces: Arc<Surfaces>,
    size: f64,
    limits: &Limits,
) -> (PatchMesh, Found) {
    let cut = divisions(scene, &surfaces, [size, size], limits);
    let mesh = PatchMesh {
        patches: mesh::patches(scene, &surfaces, &cut.pieces),
        divisions: cut.divisions,
        cells: (0..cut.pieces.len() as u32)
            .map(mesh::Cell::Patch)
            .collect(),
        surfaces,
    };
    (mesh, cut.found)
}

/// How all facets are divided.
pub struct Divisions {
    /// By facet.
    pub divisions: Vec<Division>,
    /// By cell: its facet, and what it covers.
    pub pieces: Vec<(u32, Piece)>,
    pub found: Found,
}

/// Divides facets that lines cross into triangles of about `size`, and others into cells of at most `whole`; both in
/// scene units.
pub fn divisions(
    scene: &Scene,
    surfaces: &Surfaces,
    [whole, size]: [f64; 2],
    limits: &Limits,
) -> Divisions {
    let (lines, mut found) = lines(scene, surfaces, size, limits);
    let facets = surfaces.facets();
    let cut: Vec<Option<Triangulation>> = facets
        .par_iter()
        .zip(&lines)
        .map(|(facet, lines)| triangulate(&facet.piece, size, lines))
        .collect();
    let mut divisions = Vec::new();
    let mut pieces = Vec::new();
    for (i, (facet, cut)) in facets.iter().zip(cut).enumerate() {
        let first = pieces.len() as u32;
        let division = match cut {
            Some(mut triangles) => {
                found.facets += 1;
                triangles.first = first;
                let placed = triangles
                    .triangles
                    .iter()
                    .map(|corners| Piece::triangle(corners.map(|st| facet.piece.at(st))));
                pieces.extend(placed.map(|piece| (i as u32, piece)));
                Division::Triangles(Box::new(triangles))
            }
            None => {
                if !lines[i].is_empty() {
                    found.left_out.untriangulated += 1;
                }
                let n = cells_for(&facet.piece, whole);
                let grid = Grid { n, first };
                let all = 0..grid.count(facet.piece.outline);
                pieces.extend(all.map(|index| (i as u32, grid.piece(&facet.piece, index))));
                Division::Grid(grid)
            }
        };
        divisions.push(division);
    }
    Divisions {
        divisions,
        pieces,
        found,
    }
}

/// The lines on each facet that patches of about `size` scene units should follow, strongest first, contacts before
/// all.
pub fn lines(
    scene: &Scene,
    surfaces: &Surfaces,
    size: f64,
    limits: &Limits,
) -> (Vec<Vec<Line>>, Found) {
    let mut found = Found::default();
    if *limits == Limits::NONE {
        return (vec![Vec::new(); surfaces.facets().len()], found);
    }
    let shell = Shell::new(scene, surfaces);
    let (sources, lamps) = source::sources(scene, surfaces, &shell, limits);
    found.left_out.lamps = lamps;
    found.left_out.curved = sources.iter().filter(|s| s.smooth).count();
    let edges = long_edges(&shell, size, limits, &mut found);
    let throws: Vec<events::Thrower> = sources
        .iter()
        .map(|source| events::Thrower::new(source, &shell, &edges))
        .collect();
    let receivers = receivers(surfaces, size, limits, &mut found);
    let sought: Vec<Sought> = receivers
        .par_iter()
        .map(|&facet| {
            let facet = facet as usize;
            Seeker {
                scene,
                surfaces,
                shell: &shell,
                size,
                limits,
            }
            .seek(facet, &throws)
        })
        .collect();
    let mut lines = vec![Vec::new(); surfaces.facets().len()];
    for (facet, sought) in receivers.into_iter().zip(sought) {
        found.add(&sought);
        lines[facet as usize] = sought.lines;
    }
    (lines, found)
}

/// Of the limit of lines, so many times as many are looked at: the others may be hidden.
const TRIED: usize = 4;

/// Lines of one facet, and how many were not taken.
struct Sought {
    lines: Vec<Line>,
    hidden: usize,
    beyond: usize,
}

/// What every facet is searched with.
#[derive(Clone, Copy)]
struct Seeker<'a> {
    scene: &'a Scene,
    surfaces: &'a Surfaces,
    shell: &'a Shell,
    size: f64,
    limits: &'a Limits,
}

impl Seeker<'_> {
    fn seek(&self, facet: usize, throws: &[events::Thrower]) -> Sought {
        let piece = &self.surfaces.facets()[facet].piece;
        let mut lines = contact::contacts(self.shell, self.surfaces, facet);
        sort(&mut lines, |line| line.weight);
        let mut beyond = lines.len().saturating_sub(self.limits.contacts);
        lines.truncate(self.limits.contacts);
        let least = insert::snap(piece, self.size);
        let mut events = Vec::new();
        for thrower in throws {
            thrower.events(self, facet, least, &mut events);
        }
        sort(&mut events, |event: &events::Event| event.line.weight);
        let (mut hidden, mut shown) = (0, 0);
        for (i, event) in events.iter().enumerate() {
            if shown >= self.limits.lines || i >= TRIED * self.limits.lines {
                beyond += 1;
                continue;
            }
            let parts = visible::parts(self, facet, event);
            match parts.is_empty() {
                true => hidden += 1,
                false => shown += 1,
            }
            lines.extend(parts.into_iter().map(|ends| Line { ends, ..event.line }));
        }
        Sought {
            lines,
            hidden,
            beyond,
        }
    }
}

/// Greatest first; equal ones stay in order.
fn sort<T>(list: &mut [T], key: impl Fn(&T) -> f64) {
    list.sort_by(|a, b| key(b).total_cmp(&key(a)));
}

/// Edges of the shell that are worth a shadow.
fn long_edges(shell: &Shell, size: f64, limits: &Limits, found: &mut Found) -> Vec<u32> {
    // Patches are never larger than the scene.
    let reach = (0..3).map(|axis| {
        let along = shell.points.iter().map(|p| p[axis]);
        let (low, high) = along.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        (high - low).max(0.0)
    });
    let least = limits.shortest * size.min(0.1 * reach.fold(0.0, f64::max));
    let length = |i: u32| {
        let [a, b] = shell.ends(i);
        a.distance(b)
    };
    let mut edges: Vec<u32> = (0..shell.edges.len() as u32)
        .filter(|i| shell.edges[*i as usize].can_be_outline())
        .collect();
    let all = edges.len();
    edges.retain(|i| length(*i) >= least);
    found.left_out.short_edges = all - edges.len();
    sort(&mut edges, |i| length(*i));
    found.left_out.edges = edges.len().saturating_sub(limits.edges);
    edges.truncate(limits.edges);
    edges
}

/// Facets that are large enough to be cut, by number.
fn receivers(surfaces: &Surfaces, size: f64, limits: &Limits, found: &mut Found) -> Vec<u32> {
    let facets = surfaces.facets();
    let large = |i: &u32| {
        let longest = facets[*i as usize].piece.longest_edge();
        !size.is_finite() || longest >= limits.smallest * size
    };
    let mut receivers: Vec<u32> = (0..facets.len() as u32).filter(large).collect();
    found.left_out.small_facets = facets.len() - receivers.len();
    sort(&mut receivers, |i| facets[*i as usize].piece.area());
    found.left_out.facets = receivers.len().saturating_sub(limits.facets);
    receivers.truncate(limits.facets);
    receivers.sort_unstable();
    receivers
}

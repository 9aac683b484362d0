//! What stands in the way of light: polygons with common corners, and their edges.

use crate::geom::{Geometry, Mesh, PlaceId, ShapeId};
use crate::math::DVec3;
use crate::radiosity::Surfaces;
use crate::radiosity::piece::{Outline, Piece};
use crate::scene::Scene;
use std::collections::{HashMap, HashSet};

/// A flat polygon, whichever side of it is seen.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    pub piece: Piece,
    /// Corners in order, as numbers of points; a triangle repeats its first.
    pub corners: [u32; 4],
    /// Number of the edge from each corner to the next; of a triangle, three.
    pub edges: [u32; 4],
    pub low: DVec3,
    pub high: DVec3,
}

/// Where polygons end or meet.
#[derive(Clone, Debug)]
pub struct Edge {
    pub ends: [u32; 2],
    /// From the edge into each of its polygons: in their planes, of any length.
    pub inward: Vec<DVec3>,
    /// The first of its polygons.
    pub first: u32,
}

/// All polygons of a scene that stand still.
#[derive(Debug, Default)]
pub struct Shell {
    pub points: Vec<DVec3>,
    pub polygons: Vec<Polygon>,
    pub edges: Vec<Edge>,
    /// By facet: its polygon, or `u32::MAX` where rounding leaves none.
    pub polygon_of: Vec<u32>,
    /// Positions are not known better than this, in scene units.
    pub tolerance: f64,
}

/// Corners come in f32, and the fourth of a parallelogram is the sum of three of them.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

impl Shell {
    /// The polygons of all facets, and the triangles of meshes that have no facets: they too throw shadows.
    pub fn new(scene: &Scene, surfaces: &Surfaces) -> Shell {
        let facets = surfaces.facets();
        let mut pieces: Vec<Piece> = facets.iter().map(|f| f.piece).collect();
        pieces.extend(other_meshes(scene, surfaces));
        let extent = pieces
            .iter()
            .flat_map(|p| [p.o, p.o + p.e1, p.o + p.e2, p.o + p.e1 + p.e2])
            .map(|p| p.abs().max_element())
            .fold(0.0, f64::max);
        let mut shell = Shell {
            tolerance: extent * ROUNDING,
            ..Shell::default()
        };
        // Without extent there is no polygon, and the grid of the weld has no cells.
        if !(shell.tolerance > 0.0 && shell.tolerance.is_finite()) {
            shell.polygon_of = vec![u32::MAX; facets.len()];
            return shell;
        }
        let mut weld = Weld {
            cells: HashMap::new(),
            tolerance: shell.tolerance,
        };
        let mut known = HashMap::new();
        for (i, piece) in pieces.iter().enumerate() {
            let number = shell.add(&mut weld, &mut known, piece);
            if i < facets.len() {
                shell.polygon_of.push(number);
            }
        }
        shell.join();
        shell
    }

    /// The number of the polygon; `u32::MAX` if corners of it fall together.
    fn add(&mut self, weld: &mut Weld, known: &mut HashMap<[u32; 4], u32>, piece: &Piece) -> u32 {
        let mut corners = [0; 4];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut count = 0;
        for p in piece.corners() {
            corners[count] = weld.number(&mut self.points, p);
            (low, high) = (low.min(p), high.max(p));
            count += 1;
        }
        if count == 3 {
            corners[3] = corners[0];
        }
        let mut key = corners;
        key[..count].sort_unstable();
        if key[..count].windows(2).any(|pair| pair[0] == pair[1]) || !piece.at_finite() {
            return u32::MAX;
        }
        if count == 3 {
            key[3] = u32::MAX;
        }
        let number = self.polygons.len() as u32;
        let found = *known.entry(key).or_insert(number);
        if found == number {
            self.polygons.push(Polygon {
                piece: *piece,
                corners,
                edges: [0; 4],
                low,
                high,
            });
        }
        found
    }

    /// Both ends of an edge.
    pub fn ends(&self, edge: u32) -> [DVec3; 2] {
        self.edges[edge as usize]
            .ends
            .map(|i| self.points[i as usize])
    }

    /// Finds which polygons meet at which edges.
    fn join(&mut self) {
        let mut known: HashMap<[u32; 2], usize> = HashMap::new();
        for (i, polygon) in self.polygons.iter_mut().enumerate() {
            let center = polygon.piece.center();
            for (side, (a, b)) in polygon.sides().enumerate() {
                let [p, q] = [a, b].map(|i| self.points[i as usize]);
                // What is left of the way to the middle at right angles to the edge.
                let along = (q - p).normalize_or_zero();
                let inward = (center - p) - along * (center - p).dot(along);
                let ends = [a.min(b), a.max(b)];
                let number = *known.entry(ends).or_insert(self.edges.len());
                if number == self.edges.len() {
                    self.edges.push(Edge {
                        ends,
                        inward: Vec::new(),
                        first: i as u32,
                    });
                }
                self.edges[number].inward.push(inward);
                polygon.edges[side] = number as u32;
            }
        }
    }
}

impl Polygon {
    /// Pairs of corners, in order.
    pub fn sides(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let corners = self.corners;
        let count = match self.piece.outline {
            Outline::Triangle => 3,
            Outline::Parallelogram => 4,
        };
        (0..count).map(move |i| (corners[i], corners[(i + 1) % count]))
    }
}

impl Piece {
    fn at_finite(&self) -> bool {
        self.o.is_finite() && self.e1.is_finite() && self.e2.is_finite()
    }
}

/// Gives points that are as good as equal the same number.
struct Weld {
    cells: HashMap<[i64; 3], Vec<u32>>,
    tolerance: f64,
}

impl Weld {
    fn number(&mut self, points: &mut Vec<DVec3>, p: DVec3) -> u32 {
        // Many times the tolerance, so that a point is seldom near a second cell.
        let size = 64.0 * self.tolerance;
        let cell = |p: DVec3| (p / size).floor().to_array().map(|x| x as i64);
        let (low, high) = (cell(p - self.tolerance), cell(p + self.tolerance));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let Some(there) = self.cells.get(&[x, y, z]) else {
                        continue;
                    };
                    let near = |i: &&u32| points[**i as usize].distance(p) <= self.tolerance;
                    if let Some(&found) = there.iter().find(near) {
                        return found;
                    }
                }
            }
        }
        let number = points.len() as u32;
        points.push(p);
        self.cells.entry(cell(p)).or_default().push(number);
        number
    }
}

/// Triangles of meshes that stand still and have no facets.
fn other_meshes(scene: &Scene, surfaces: &Surfaces) -> Vec<Piece> {
    let seen: HashSet<(u32, u32)> = surfaces
        .facets()
        .iter()
        .map(|f| (f.shape.0, f.place.0))
        .collect();
    let world = scene.world();
    let mut pieces = Vec::new();
    for (number, geometry) in world.geometries().iter().enumerate() {
        let Geometry::Mesh(mesh) = geometry else {
            continue;
        };
        let shape = number as u32;
        match world.placement_of(ShapeId(shape)) {
            None if seen.contains(&(shape, PlaceId::NONE.0)) => {}
            None => pieces.extend(triangles(mesh)),
            Some(first) => {
                let places = world.places().iter().enumerate();
                for (i, place) in places.filter(|(_, place)| place.group == first.group) {
                    let Some(to_world) = place.motion.as_still() else {
                        continue;
                    };
                    if !seen.contains(&(shape, i as u32)) {
                        pieces.extend(triangles(mesh).map(|p| Piece {
                            o: to_world.point(p.o),
                            e1: to_world.vector(p.e1),
                            e2: to_world.vector(p.e2),
                            ..p
                        }));
                    }
                }
            }
        }
    }
    pieces
}

fn triangles(mesh: &Mesh) -> impl Iterator<Item = Piece> + '_ {
    let all = 0..mesh.indices().len() as u32;
    all.map(|i| Piece::triangle(mesh.triangle(i).map(|p| p.as_dvec3())))
}

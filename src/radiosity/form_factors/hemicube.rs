//! Form factors by hemicubes (Cohen & Greenberg 1985): all patches are drawn onto half a cube over a point of a
//! patch, and each pixel that shows another patch adds its share of the cosine-weighted hemisphere to that one's
//! form factor.
//!
//! These shares, the delta form factors, are Lambert's closed form for the pixel, not the kernel at its middle;
//! their sum differs from 1 by rounding alone and is divided out, so that closed scenes have rows of sum 1. A
//! patch with others near (seen at an angle that changes over it) has several points, each with a hemicube turned by
//! chance about the normal, so that the pixels of one do not repeat the errors of another.
//!
//! The error falls with one over the resolution. Patches that cover no middle of a pixel get nothing: they are
//! counted. Not reciprocal. Masks are opaque here, and what moves or has no surface to divide stops no light.

use super::analytic::lambert;
use super::polygon::{Polygon, distance2_to_segment};
use super::raster::{BLOCKED, Buffer, NOTHING};
use super::{Face, FormFactors, Loss};
use crate::geom::{Geometry, PlaceId, ShapeId};
use crate::math::{DVec2, DVec3};
use crate::radiosity::PatchMesh;
use crate::radiosity::mesh::Grid;
use crate::sampler::mix;
use crate::scene::Scene;
use std::collections::HashSet;
use std::f64::consts::TAU;

/// Fewest and most pixels along an edge of the cube.
const RESOLUTIONS: std::ops::RangeInclusive<u32> = 2..=4096;

/// What does not depend on the patch.
#[derive(Clone, Debug)]
pub struct Hemicube {
    /// Even.
    resolution: usize,
    /// Delta form factors of the top and of one side.
    top: Vec<f64>,
    side: Vec<f64>,
    /// Surfaces that take no part, but stand in the way.
    blockers: Vec<Polygon>,
    seed: u64,
}

/// Axes of a face: across, up, and outwards, in the coordinates of the patch (z its normal).
const FACES: [[DVec3; 3]; 5] = [
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::Y, DVec3::Z, DVec3::X],
    [DVec3::NEG_X, DVec3::Z, DVec3::Y],
    [DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X],
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
];

impl Hemicube {
    /// `resolution`: pixels along an edge of the cube, made even, at least 2 and at most 4096.
    pub fn new(scene: &Scene, mesh: &PatchMesh, resolution: u32, seed: u64) -> Hemicube {
        let resolution = resolution.clamp(*RESOLUTIONS.start(), *RESOLUTIONS.end());
        let resolution = resolution.next_multiple_of(2) as usize;
        let [top, side] = buffers(resolution);
        let mut shares = [deltas(&top, FACES[0]), deltas(&side, FACES[1])];
        let all = shares[0].iter().sum::<f64>() + 4.0 * shares[1].iter().sum::<f64>();
        shares.iter_mut().flatten().for_each(|share| *share /= all);
        let [top, side] = shares;
        Hemicube {
            resolution,
            top,
            side,
            blockers: blockers(scene, mesh),
            seed,
        }
    }
}

impl FormFactors<'_> {
    /// Fills a row; what was lost on the way.
    pub(super) fn by_hemicube(&self, cube: &Hemicube, i: u32, out: &mut [f64]) -> Loss {
        out.fill(0.0);
        let face = &self.faces[i as usize];
        let piece = self.mesh.patches[i as usize].piece;
        let m = self.points_along(i);
        let grid = Grid {
            n: [m, m],
            first: 0,
        };
        let points = grid.count(piece.outline);
        let share = 1.0 / f64::from(points);
        let mut covered = vec![0usize; out.len()];
        let [mut top, mut side] = buffers(cube.resolution);
        for point in 0..points {
            let eye = grid.piece(&piece, point).center();
            let hash = mix(mix(cube.seed ^ u64::from(i)) ^ u64::from(point));
            let turn = (hash >> 11) as f64 * (TAU / (1u64 << 53) as f64);
            let (s, t) = face.normal.any_orthonormal_pair();
            let (sin, cos) = turn.sin_cos();
            let axes = [s * cos + t * sin, t * cos - s * sin, face.normal];
            let local = |p: DVec3| {
                let d = p - eye;
                DVec3::new(d.dot(axes[0]), d.dot(axes[1]), d.dot(axes[2]))
            };
            for (number, view) in FACES.iter().enumerate() {
                let (buffer, deltas) = match number {
                    0 => (&mut top, &cube.top),
                    _ => (&mut side, &cube.side),
                };
                buffer.clear();
                self.draw(cube, i, eye, &local, view, buffer, &mut covered);
                for (item, delta) in buffer.items.iter().zip(deltas) {
                    if *item != NOTHING && *item != BLOCKED {
                        out[*item as usize] += share * delta;
                    }
                }
            }
        }
        self.loss(i, &covered)
    }

    #[allow(clippy::too_many_arguments)]
    fn draw(
        &self,
        cube: &Hemicube,
        i: u32,
        eye: DVec3,
        local: &impl Fn(DVec3) -> DVec3,
        view: &[DVec3; 3],
        buffer: &mut Buffer,
        covered: &mut [usize],
    ) {
        let seen = |polygon: &Polygon| {
            polygon.map(|p| {
                let p = local(p);
                DVec3::new(p.dot(view[0]), p.dot(view[1]), p.dot(view[2]))
            })
        };
        let own = self.faces[i as usize].facet;
        for (j, face) in self.faces.iter().enumerate() {
            if face.facet == own {
                continue;
            }
            let front = (eye - face.polygon[0]).dot(face.normal) > 0.0;
            let item = if front { j as u32 } else { BLOCKED };
            let pixels = buffer.draw(&seen(&face.polygon), item);
            if front {
                covered[j] += pixels;
            }
        }
        for polygon in &cube.blockers {
            buffer.draw(&seen(polygon), BLOCKED);
        }
    }

    /// How many rows of points the patch has: more than one where others are near.
    fn points_along(&self, i: u32) -> u32 {
        let face = &self.faces[i as usize];
        let distance2 = |other: &Face| {
            let to = |sum: f64, (p, q)| sum.min(distance2_to_segment(face.center, p, q));
            other.polygon.edges().fold(f64::INFINITY, to)
        };
        let facing = self.faces.iter().filter(|other| face.faces(other));
        let nearest2 = facing.map(distance2).fold(f64::INFINITY, f64::min);
        match nearest2.sqrt() / face.radius {
            ratio if ratio < 2.0 => 4,
            ratio if ratio < 4.0 => 2,
            _ => 1,
        }
    }

    fn loss(&self, i: u32, covered: &[usize]) -> Loss {
        let face = &self.faces[i as usize];
        let mut loss = Loss::default();
        for (j, other) in self.faces.iter().enumerate() {
            if covered[j] > 0 {
                loss.met.push(j as u32);
            } else if face.faces(other) {
                let seen = other.polygon.clip(|p| (p - face.center).dot(face.normal));
                let front = (face.center - other.polygon[0]).dot(other.normal) > 0.0;
                let f = lambert(face.center, face.normal, &seen, other.normal);
                if front && f > 0.0 {
                    loss.lost.push(j as u32);
                    loss.share += f.min(1.0);
                }
            }
        }
        loss
    }
}

/// Item buffers of the top and of a side.
fn buffers(resolution: usize) -> [Buffer; 2] {
    [
        Buffer::new(resolution, resolution, -1.0),
        Buffer::new(resolution, resolution / 2, 0.0),
    ]
}

/// Form factors of the pixels of a face, by row and column.
fn deltas(buffer: &Buffer, [across, up, out]: [DVec3; 3]) -> Vec<f64> {
    let mut shares = Vec::with_capacity(buffer.items.len());
    for row in 0..buffer.height {
        for column in 0..buffer.width {
            let [x0, y0, x1, y1] = buffer.pixel(row, column);
            let at = |x: f64, y: f64| across * x + up * y + out;
            // The order of corners that shows its front to the eye: across × up points outwards.
            let pixel = Polygon::new(&[at(x0, y0), at(x0, y1), at(x1, y1), at(x1, y0)]);
            shares.push(lambert(DVec3::ZERO, DVec3::Z, &pixel, -out));
        }
    }
    shares
}

/// Shapes without patches, as polygons: mirrors, glass, black bodies.
fn blockers(scene: &Scene, mesh: &PatchMesh) -> Vec<Polygon> {
    let facets = mesh.surfaces.facets();
    let divided: HashSet<(u32, u32)> = facets.iter().map(|f| (f.shape.0, f.place.0)).collect();
    let world = scene.world();
    let mut found = Vec::new();
    for (number, geometry) in world.geometries().iter().enumerate() {
        let mut add = |place: PlaceId| {
            if !divided.contains(&(number as u32, place.0)) {
                polygons(scene, geometry, place, &mut found);
            }
        };
        match world.placement_of(ShapeId(number as u32)) {
            None => add(PlaceId::NONE),
            Some(first) => {
                let places = world.places().iter().enumerate();
                places
                    .filter(|(_, place)| place.group == first.group)
                    .for_each(|(i, _)| add(PlaceId(i as u32)));
            }
        }
    }
    found
}

fn polygons(scene: &Scene, geometry: &Geometry, place: PlaceId, out: &mut Vec<Polygon>) {
    /// Cells of a curved shape around it.
    const AROUND: u32 = 48;
    let place = scene.world().places().get(place.0 as usize);
    let to_world = match place.map(|place| place.motion.as_still()) {
        Some(None) => return,
        Some(Some(transform)) => Some(transform),
        None => None,
    };
    let moved = |p: DVec3| to_world.map_or(p, |transform| transform.point(p));
    match geometry {
        Geometry::Deforming(_) | Geometry::Sdf(_) => {}
        Geometry::Mesh(mesh) => {
            let triangle = |i: u32| mesh.triangle(i).map(|p| moved(p.as_dvec3()));
            out.extend((0..mesh.indices().len() as u32).map(|i| Polygon::new(&triangle(i))));
        }
        curved => {
            let (nu, nv) = match curved {
                Geometry::Sphere(_) => (AROUND, AROUND / 2),
                Geometry::Disk(_) => (1, AROUND),
                _ => (AROUND, 1),
            };
            for cell in 0..nu * nv {
                let at = |di: u32, dj: u32| {
                    let u = f64::from(cell % nu + di) / f64::from(nu);
                    let v = f64::from(cell / nu + dj) / f64::from(nv);
                    moved(curved.at_uv(DVec2::new(u, v)))
                };
                out.push(Polygon::new(&[at(0, 0), at(1, 0), at(1, 1)]));
                out.push(Polygon::new(&[at(0, 0), at(1, 1), at(0, 1)]));
            }
        }
    }
}

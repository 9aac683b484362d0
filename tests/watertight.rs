//! No ray leaves a closed mesh unnoticed: rays aimed in double precision at corners and at points of
//! edges, from inside, at many scales and offsets; and axis-parallel rays onto the corners of a grid.
//!
//! Ten million rays in all, none of which may escape.

use glam::{DVec3, Vec3};
use luxel::geom::accel::{Accel, MeshRef};
use luxel::geom::{Ray, ShapeId};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use std::collections::HashMap;

struct Mesh {
    positions: Vec<Vec3>,
    indices: Vec<[u32; 3]>,
}

impl Mesh {
    fn accel(&self) -> Accel {
        let mesh = MeshRef {
            shape: ShapeId(0),
            positions: &self.positions,
            indices: &self.indices,
        };
        Accel::build(&[mesh], &[])
    }

    /// The same scaled about the origin, then moved by `offset` times the scale.
    fn placed(&self, scale: f64, offset: f64) -> Mesh {
        let place = |p: &Vec3| ((p.as_dvec3() + DVec3::splat(offset)) * scale).as_vec3();
        Mesh {
            positions: self.positions.iter().map(place).collect(),
            indices: self.indices.clone(),
        }
    }
}

/// The cube from -1 to 1: planes that bounding boxes have no thickness across.
fn cube() -> Mesh {
    let sign = |b: u32| if b == 0 { -1.0 } else { 1.0 };
    let corner = |i: u32| Vec3::new(sign(i & 1), sign(i & 2), sign(i & 4));
    let sides = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    let split = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    Mesh {
        positions: (0..8).map(corner).collect(),
        indices: sides.into_iter().flat_map(split).collect(),
    }
}

/// An octahedron subdivided `level` times and blown up to a ball with bumps.
fn ball(level: u32) -> Mesh {
    let mut p = vec![Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    let mut indices: Vec<[u32; 3]> = (0..8)
        .map(|i| [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2)])
        .collect();
    for _ in 0..level {
        let mut middle = HashMap::new();
        let mut between = |a: u32, b: u32| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                p.push((p[a as usize] + p[b as usize]).normalize());
                p.len() as u32 - 1
            })
        };
        let split = |&[a, b, c]: &[u32; 3]| {
            let (d, e, f) = (between(a, b), between(b, c), between(c, a));
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        indices = indices.iter().flat_map(split).collect();
    }
    let bump =
        |p: Vec3| p * (1.0 + 0.15 * (7.0 * p.x).sin() * (9.0 * p.y).cos() * (5.0 * p.z).sin());
    Mesh {
        positions: p.into_iter().map(bump).collect(),
        indices,
    }
}

struct Random(Pcg32);

impl Random {
    fn new(seed: u64) -> Random {
        Random(Pcg32::seed_from_u64(seed))
    }
    fn below(&mut self, n: usize) -> usize {
        self.0.next_u32() as usize % n
    }
    /// In [-1, 1).
    fn signed(&mut self) -> f64 {
        f64::from(self.0.next_u32() as i32) / f64::from(1u32 << 31)
    }
}

/// How many of `n` rays from near the middle, half of them at corners, half at edges, escape.
fn escapes(mesh: &Mesh, accel: &Accel, n: usize, scale: f64, offset: f64, seed: u64) -> usize {
    const BATCH: usize = 10_000;
    let batch = |batch: usize| {
        let mut rng = Random::new(seed << 32 | batch as u64);
        let mut lost = 0;
        for i in 0..BATCH {
            let mut near = || offset + 0.45 * rng.signed();
            let o = (DVec3::new(near(), near(), near()) * scale).as_vec3();
            let t = mesh.indices[rng.below(mesh.indices.len())];
            let k = rng.below(3);
            let a = mesh.positions[t[k] as usize].as_dvec3();
            let b = mesh.positions[t[(k + 1) % 3] as usize].as_dvec3();
            let w = if i % 2 == 0 {
                0.0
            } else {
                0.5 + 0.5 * rng.signed()
            };
            let d = (a + (b - a) * w - o.as_dvec3()).normalize().as_vec3();
            let ray = Ray::new(o, d);
            let escaped = match i % 8 {
                0 | 1 => !accel.occluded(&ray),
                _ => accel.intersect(&ray).is_none(),
            };
            lost += usize::from(escaped);
        }
        lost
    };
    (0..n.div_ceil(BATCH)).into_par_iter().map(batch).sum()
}

#[test]
fn closed_meshes_at_the_origin_lose_no_ray() {
    for (seed, (name, mesh, n)) in [
        ("cube", cube(), 3_000_000),
        ("ball of 32", ball(1), 1_000_000),
        ("ball of 32768", ball(6), 3_000_000),
    ]
    .into_iter()
    .enumerate()
    {
        let lost = escapes(&mesh, &mesh.accel(), n, 1.0, 0.0, seed as u64);
        assert_eq!(lost, 0, "of {n} rays in the {name}");
    }
}

#[test]
fn neither_scale_nor_offset_matters() {
    for scale in [1e-15, 1e-6, 1e-3, 1e3, 1e6, 1e15] {
        for (mesh, offset) in [
            (cube(), 0.0),
            (ball(4), 0.0),
            (cube(), 30.0),
            (ball(4), 1e3),
            (ball(2), 1e5),
        ] {
            let mesh = mesh.placed(scale, offset);
            let n = 100_000;
            let lost = escapes(&mesh, &mesh.accel(), n, scale, offset, 77);
            assert_eq!(lost, 0, "of {n} rays at scale {scale}, offset {offset}");
        }
    }
}

#[test]
fn plain_arrays_lose_no_ray_either() {
    for mesh in [cube(), ball(4)] {
        let mut accel = mesh.accel();
        accel.force_plain();
        assert_eq!(escapes(&mesh, &accel, 200_000, 1.0, 0.0, 5), 0);
    }
}

/// Rays along an axis, with zeros of both signs in the direction, onto corners and edges of a
/// regular grid in the plane across that axis: a camera over a tessellated floor.
#[test]
fn axis_parallel_rays_meet_the_corners_of_a_grid() {
    let n = 128u32;
    for axis in 0..3 {
        let at = |x: f32, y: f32, h: f32| {
            let mut p = [h; 3];
            p[(axis + 1) % 3] = x;
            p[(axis + 2) % 3] = y;
            Vec3::from_array(p)
        };
        // Both with coordinates that are exact and with such that are rounded.
        for step in [1.0 / 128.0, 0.1] {
            let line = |i: u32| i as f32 * step;
            let positions =
                (0..=n * n + 2 * n).map(|i| at(line(i % (n + 1)), line(i / (n + 1)), 0.0));
            let cell = |i: u32| {
                let a = i / n * (n + 1) + i % n;
                [[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]
            };
            let mesh = Mesh {
                positions: positions.collect(),
                indices: (0..n * n).flat_map(cell).collect(),
            };
            let accel = mesh.accel();
            for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
                for zero in [0.0, -0.0] {
                    for (h, d) in [(1.0, -1.0), (-1000.0, 1.0)] {
                        let mut dir = [zero; 3];
                        dir[axis] = d;
                        let ray = Ray::new(at(line(i), line(j), h), Vec3::from_array(dir));
                        let hit = accel.intersect(&ray);
                        assert_eq!(hit.map(|h| h.t), Some(h.abs()), "corner {i} {j}, {ray:?}");
                        let middle = line(j) + 0.3 * (line(j + 1) - line(j));
                        let ray = Ray::new(at(line(i), middle, h), ray.d);
                        assert!(j == n || accel.occluded(&ray), "edge {i} {j}, {ray:?}");
                    }
                }
            }
        }
    }
}

/// A ray in the plane of a flat mesh, and one that grazes a face of a cube, must do no harm: it may
/// hit or not, but the ray next to it hits.
#[test]
fn rays_within_a_plane_end() {
    let mesh = cube();
    let accel = mesh.accel();
    for y in [-1.0f32, 1.0] {
        for d in [Vec3::X, -Vec3::X, Vec3::Z, Vec3::new(0.6, 0.0, 0.8)] {
            // In the plane of a face, through the cube: the faces across are met at the latest.
            let ray = Ray::new(Vec3::new(0.0, y, 0.0) - d * 3.0, d);
            if let Some(hit) = accel.intersect(&ray) {
                assert!(hit.t >= 1.5 && hit.t <= 4.5, "{hit:?}");
            }
            let inside = Ray::new(Vec3::new(0.0, y * 1.0f32.next_down(), 0.0), d);
            assert!(accel.intersect(&inside).is_some());
        }
    }
}

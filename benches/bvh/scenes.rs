//! Scenes and rays: a box of 38 triangles, a bumpy ball in a box, and a million triangles.

use glam::Vec3;
use luxel::geom::accel::{Accel, MeshRef};
use luxel::geom::{Ray, ShapeId};
use luxel::math::{Frame, Vec2};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng, SeedableRng};
use std::collections::HashMap;
use std::f32::consts::TAU;

#[derive(Default)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub indices: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn accel(&self) -> Accel {
        let mesh = MeshRef {
            shape: ShapeId(0),
            positions: &self.positions,
            indices: &self.indices,
        };
        Accel::build(&[mesh], &[])
    }

    fn quad(&mut self, o: Vec3, a: Vec3, b: Vec3) {
        let n = self.positions.len() as u32;
        self.positions.extend([o, o + a, o + a + b, o + b]);
        self.indices.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
    }

    fn block(&mut self, o: Vec3, [a, b, c]: [Vec3; 3]) {
        for (x, y, z) in [(a, b, c), (b, c, a), (c, a, b)] {
            self.quad(o, x, y);
            self.quad(o + z, x, y);
        }
    }

    /// A room without its front (z = 1), x and y from -1 to 1, and a lamp below the ceiling.
    fn room(&mut self) {
        let (x, y, z) = (2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z);
        let o = Vec3::NEG_ONE;
        for (o, a, b) in [
            (o, x, y),
            (o, x, z),
            (o + y, x, z),
            (o, y, z),
            (o + x, y, z),
        ] {
            self.quad(o, a, b);
        }
        let lamp = Vec3::new(-0.25, 0.99, -0.25);
        self.quad(lamp, 0.5 * Vec3::X, 0.5 * Vec3::Z);
    }

    /// A ball with bumps: the triangles of an icosphere, 20 * 4^level.
    fn ball(&mut self, level: u32, center: Vec3, radius: f32) {
        let g = (1.0 + 5f32.sqrt()) / 2.0;
        let mut p: Vec<Vec3> = (0..12)
            .map(|i| {
                let (a, b) = (
                    if i & 1 == 0 { 1.0 } else { -1.0 },
                    if i & 2 == 0 { g } else { -g },
                );
                [
                    Vec3::new(a, b, 0.0),
                    Vec3::new(0.0, a, b),
                    Vec3::new(b, 0.0, a),
                ][i >> 2]
                    .normalize()
            })
            .collect();
        // Faces: all triples of corners at edge distance.
        let near = |a: Vec3, b: Vec3| (a - b).length() < 1.2;
        let mut faces = Vec::new();
        for (i, j, k) in (0..12usize)
            .flat_map(|i| (i + 1..12).flat_map(move |j| (j + 1..12).map(move |k| (i, j, k))))
        {
            if near(p[i], p[j]) && near(p[j], p[k]) && near(p[k], p[i]) {
                faces.push([i as u32, j as u32, k as u32]);
            }
        }
        for _ in 0..level {
            let mut middle = HashMap::new();
            faces = faces
                .iter()
                .flat_map(|&[a, b, c]| {
                    let [d, e, f] = [(a, b), (b, c), (c, a)].map(|(a, b)| {
                        *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                            p.push((p[a as usize] + p[b as usize]).normalize());
                            p.len() as u32 - 1
                        })
                    });
                    [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
                })
                .collect();
        }
        let first = self.positions.len() as u32;
        let bump = |p: Vec3| {
            1.0 + 0.15 * (7.0 * p.x).sin() * (9.0 * p.y).cos() * (5.0 * p.z).sin()
                + 0.01 * (90.0 * p.x).sin() * (80.0 * p.y).sin()
        };
        self.positions
            .extend(p.iter().map(|&p| center + p * (radius * bump(p))));
        self.indices
            .extend(faces.iter().map(|f| f.map(|i| first + i)));
    }
}

/// Name and triangles.
pub fn all() -> Vec<(&'static str, Mesh)> {
    let mut small = Mesh::default();
    small.room();
    small.block(
        Vec3::new(-0.6, -1.0, -0.6),
        [
            Vec3::new(0.5, 0.0, 0.2),
            1.1 * Vec3::Y,
            Vec3::new(-0.2, 0.0, 0.5),
        ],
    );
    small.block(
        Vec3::new(0.1, -1.0, 0.1),
        [
            Vec3::new(0.5, 0.0, -0.2),
            0.5 * Vec3::Y,
            Vec3::new(0.2, 0.0, 0.5),
        ],
    );

    let mut middle = Mesh::default();
    middle.room();
    middle.ball(6, Vec3::new(0.0, -0.3, -0.1), 0.6);

    let mut large = Mesh::default();
    large.room();
    for i in 0..12u32 {
        let at = Vec3::new(
            (i % 4) as f32 * 0.45 - 0.7,
            (i / 4 % 2) as f32 * 0.5 - 0.6,
            (i / 2) as f32 * 0.28 - 0.8,
        );
        large.ball(6, at, 0.22);
    }
    vec![("38 triangles", small), ("82k", middle), ("1M", large)]
}

pub struct Rng32(Pcg32);

impl Rng32 {
    pub fn new(seed: u64) -> Rng32 {
        Rng32(Pcg32::seed_from_u64(seed))
    }
    pub fn u32(&mut self) -> u32 {
        self.0.next_u32()
    }
    pub fn f32(&mut self) -> f32 {
        (self.0.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }
    fn vec2(&mut self) -> Vec2 {
        Vec2::new(self.f32(), self.f32())
    }
}

/// Sets of rays by name; the last is for occlusion.
pub fn rays(mesh: &Mesh, accel: &Accel) -> Vec<(&'static str, Vec<Ray>)> {
    let mut rng = Rng32::new(1);
    let side = 400;
    let eye = Vec3::new(0.1, 0.05, 3.2);
    let primary: Vec<Ray> = (0..side * side)
        .map(|i| {
            let (x, y) = (i % side, i / side);
            let to =
                Vec3::new(x as f32 + rng.f32(), y as f32 + rng.f32(), 0.0) * (2.0 / side as f32);
            Ray::new(eye, (to - Vec3::new(1.0, 1.0, -0.9) - eye).normalize())
        })
        .collect();
    let first = bounce(mesh, accel, &primary, &mut rng);
    let mut second = bounce(mesh, accel, &first, &mut rng);
    for i in (1..second.len()).rev() {
        second.swap(i, rng.u32() as usize % (i + 1));
    }
    let shadow = surface(mesh, accel, &primary)
        .map(|(p, _)| {
            let u = rng.vec2();
            let to = Vec3::new(u.x * 0.5 - 0.25, 0.98, u.y * 0.5 - 0.25) - p;
            let len = to.length();
            Ray {
                o: p,
                d: to / len,
                t_max: len,
                time: 0.0,
            }
        })
        .collect();
    vec![
        ("primary", primary),
        ("bounce", first),
        ("bounce 2, shuffled", second),
        ("shadow", shadow),
    ]
}

/// Points met, moved off the surface, and their normals. The offset is good enough for a benchmark.
fn surface<'a>(
    mesh: &'a Mesh,
    accel: &'a Accel,
    rays: &'a [Ray],
) -> impl Iterator<Item = (Vec3, Vec3)> + 'a {
    rays.iter().filter_map(move |ray| {
        let hit = accel.intersect(ray)?;
        let [a, b, c] = mesh.indices[hit.prim as usize].map(|i| mesh.positions[i as usize]);
        let n = (b - a).cross(c - a).normalize();
        let n = if n.dot(ray.d) > 0.0 { -n } else { n };
        Some((ray.at(hit.t) + n * 1e-5, n))
    })
}

fn bounce(mesh: &Mesh, accel: &Accel, rays: &[Ray], rng: &mut Rng32) -> Vec<Ray> {
    surface(mesh, accel, rays)
        .map(|(p, n)| {
            let u = rng.vec2();
            let (r, phi) = (u.x.sqrt(), TAU * u.y);
            let d = Vec3::new(r * phi.cos(), r * phi.sin(), (1.0 - u.x).sqrt());
            Ray::new(p, Frame::from_normal(n).to_world(d).normalize())
        })
        .collect()
}

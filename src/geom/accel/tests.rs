use super::*;
use crate::math::fp;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rand_pcg::Pcg32;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Balls as (centre, radius), numbered from shape 100 on.
struct Balls(Vec<(Vec3, f32)>);

const BALL: u32 = 100;

impl Hooks for Balls {
    const SHAPES: bool = true;
    const FILTERS: bool = false;

    fn intersect(&self, shape: ShapeId, ray: &Ray) -> Option<(f32, Vec2)> {
        let (center, radius) = self.0[(shape.0 - BALL) as usize];
        let (o, d) = ((ray.o - center).as_dvec3(), ray.d.as_dvec3());
        let (b, c) = (o.dot(d), o.length_squared() - f64::from(radius).powi(2));
        let root = (b * b - c * d.length_squared()).max(-1.0).sqrt();
        let at = [(-b - root) as f32, (-b + root) as f32];
        let t = at.into_iter().find(|&t| t > 0.0 && t <= ray.t_max)?;
        Some((t, Vec2::ZERO))
    }

    fn accept(&self, _: ShapeId, _: u32, _: Vec2) -> bool {
        true
    }
}

/// Random numbers of a fixed seed.
struct Random(Pcg32);

impl Random {
    fn new(seed: u64) -> Random {
        Random(Pcg32::seed_from_u64(seed))
    }
    fn below(&mut self, n: u32) -> u32 {
        self.0.next_u32() % n
    }
    /// In [-1, 1), with few bits now and then, so that coordinates coincide.
    fn coordinate(&mut self) -> f32 {
        let x = self.0.next_u32() as i32 as f32 / (1u32 << 31) as f32;
        match self.below(4) {
            0 => (x * 4.0).round() / 4.0,
            _ => x,
        }
    }
    fn point(&mut self) -> Vec3 {
        Vec3::new(self.coordinate(), self.coordinate(), self.coordinate())
    }
    /// Every fourth direction has zeros of either sign.
    fn direction(&mut self) -> Vec3 {
        loop {
            let mut d = self.point();
            if self.below(4) == 0 {
                d *= [Vec3::X, Vec3::NEG_Y, Vec3::new(0.0, 1.0, -1.0)][self.below(3) as usize];
            }
            if d.length() > 1e-3 {
                return d.normalize();
            }
        }
    }
}

struct Soup {
    meshes: Vec<(Vec<Vec3>, Vec<[u32; 3]>)>,
    balls: Balls,
    bounds: Vec<(ShapeId, Aabb)>,
}

impl Soup {
    fn new(rng: &mut Random, scale: f32) -> Soup {
        let mut meshes = Vec::new();
        for _ in 0..rng.below(4) {
            let center = rng.point();
            let size = [0.02, 0.2, 1.0][rng.below(3) as usize];
            let p: Vec<Vec3> = (0..3 + rng.below(60))
                .map(|_| (center + rng.point() * size) * scale)
                .collect();
            let corner = |rng: &mut Random| rng.below(p.len() as u32 + 1);
            // Some corners do not exist, some triangles are degenerate: neither may matter.
            let t = (0..rng.below(200)).map(|_| [corner(rng), corner(rng), corner(rng)]);
            let t = t.collect();
            meshes.push((p, t));
        }
        let balls: Vec<_> = (0..rng.below(6))
            .map(|_| (rng.point() * scale, 0.3 * scale * rng.coordinate().abs()))
            .collect();
        let grown = |r: f32| Vec3::splat(r * 1.000_01);
        let bounds = balls.iter().enumerate().map(|(i, &(c, r))| {
            let (min, max) = (c - grown(r), c + grown(r));
            (ShapeId(BALL + i as u32), Aabb { min, max })
        });
        Soup {
            meshes,
            bounds: bounds.collect(),
            balls: Balls(balls),
        }
    }

    fn refs(&self) -> Vec<MeshRef<'_>> {
        self.meshes
            .iter()
            .enumerate()
            .map(|(i, (positions, indices))| MeshRef {
                shape: ShapeId(i as u32),
                positions,
                indices,
            })
            .collect()
    }

    /// A tree of its own for each triangle and each ball.
    fn alone(&self) -> Vec<Accel> {
        let refs = self.refs();
        let triangle = |m: &MeshRef<'_>, t: &[u32; 3]| {
            let indices = std::slice::from_ref(t);
            Accel::build(&[MeshRef { indices, ..*m }], &[])
        };
        let triangles = refs
            .iter()
            .flat_map(|m| m.indices.iter().map(move |t| triangle(m, t)));
        let mut all: Vec<Accel> = triangles.collect();
        all.extend(self.bounds.iter().map(|&b| Accel::build(&[], &[b])));
        all
    }

    /// The distance of the nearest meeting with each triangle, in double precision and without regard
    /// for shared edges, and how far inside the triangle it lies.
    fn brute(&self, ray: &Ray) -> Vec<(f64, f64)> {
        let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
        let mut met = Vec::new();
        for mesh in self.refs() {
            for t in mesh.indices {
                let Some(p) = corners(&mesh, t).filter(|&p| usable(p)) else {
                    continue;
                };
                let [a, b, c] = p.map(|p| p.as_dvec3() - o);
                let n = (b - a).cross(c - a);
                let t = a.dot(n) / d.dot(n);
                let x = d * t;
                let part = |p: glam::DVec3, q: glam::DVec3| {
                    (q - p).cross(x - p).dot(n) / n.length_squared()
                };
                let inside = part(a, b).min(part(b, c)).min(part(c, a));
                met.push((t, inside));
            }
        }
        met
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 300,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// Nearest hits and occlusion against the definition, over random soups of triangles and balls.
    #[test]
    fn agrees_with_brute_force(seed in any::<u64>(), exponent in -6i32..7) {
        let rng = &mut Random::new(seed);
        let scale = 10f32.powi(exponent);
        let soup = Soup::new(rng, scale);
        let accel = Accel::build(&soup.refs(), &soup.bounds);
        let mut plain = Accel::build(&soup.refs(), &soup.bounds);
        plain.force_plain();
        let alone = soup.alone();
        for _ in 0..60 {
            let mut ray = Ray::new(rng.point() * (2.0 * scale), rng.direction());
            if rng.below(3) == 0 {
                ray.t_max = scale * rng.coordinate().abs();
            }
            let hit = accel.intersect_with(&ray, &soup.balls);
            prop_assert_eq!(hit, plain.intersect_with(&ray, &soup.balls));
            prop_assert_eq!(accel.occluded_with(&ray, &soup.balls), hit.is_some());
            prop_assert_eq!(plain.occluded_with(&ray, &soup.balls), hit.is_some());

            // No box hides anything: the distance is exactly the least of all, each tested alone.
            let all = alone.iter().filter_map(|a| a.intersect_with(&ray, &soup.balls));
            let least = all.map(|h| h.t).reduce(f32::min);
            prop_assert_eq!(hit.map(|h| h.t), least);

            // Clear hits must be found, and what is found must be (nearly) a hit.
            let size = f64::from(scale) * 4.0;
            let t_max = f64::from(ray.t_max);
            let brute = soup.brute(&ray);
            let clear = |&&(t, inside): &&(f64, f64)| inside > 1e-4 && t > 1e-6 * size && t < t_max * (1.0 - 1e-6);
            let nearest = brute.iter().filter(clear).map(|b| b.0).fold(f64::INFINITY, f64::min);
            let ball = soup.bounds.iter().filter_map(|b| soup.balls.intersect(b.0, &ray));
            let nearest = ball.map(|b| f64::from(b.0)).fold(nearest, f64::min);
            let t = hit.map_or(f64::INFINITY, |h| f64::from(h.t));
            prop_assert!(t <= nearest * (1.0 + 1e-4) + 1e-5 * size, "hit {hit:?}, nearest {nearest}");
            if let Some(hit) = hit && hit.shape.0 < BALL {
                let mesh = soup.refs()[hit.shape.0 as usize];
                let [a, b, c] = corners(&mesh, &mesh.indices[hit.prim as usize]).unwrap();
                let (u, v) = (hit.uv.x, hit.uv.y);
                prop_assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 2.0 * fp::gamma(4));
                let p = a * (1.0 - u - v) + b * u + c * v;
                prop_assert!((p - ray.at(hit.t)).length() < 1e-5 * scale * 4.0, "{p} {}", ray.at(hit.t));
            }
        }
    }
}

fn one(positions: &[Vec3], indices: &[[u32; 3]]) -> Accel {
    let shape = ShapeId(0);
    Accel::build(
        &[MeshRef {
            shape,
            positions,
            indices,
        }],
        &[],
    )
}

/// `n` triangles with their own corners.
fn loose(n: u32, triangle: impl Fn(u32) -> [Vec3; 3]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let p = (0..n).flat_map(triangle).collect();
    (p, (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

/// Hits that lie close behind each other in many boxes: an error of a part in ten thousand in what is
/// skipped as too far would show.
#[test]
fn the_nearest_of_many_close_hits_is_found() {
    let rng = &mut Random::new(8);
    let sheets: Vec<Vec3> = (0..400).map(|_| rng.point()).collect();
    let (p, t) = loose(400, |i| {
        let Vec3 { x, y, z } = sheets[i as usize];
        let at = |dx: f32, dy: f32| Vec3::new(x + dx, y + dy, 100.0 + 0.01 * z);
        [at(0.0, 0.0), at(0.3, 0.0), at(0.0, 0.3)]
    });
    let accel = one(&p, &t);
    let alone: Vec<Accel> = t.iter().map(|&t| one(&p, &[t])).collect();
    for _ in 0..1000 {
        let o = rng.point();
        let to = o + Vec3::new(0.0, 0.0, 100.0) + 0.01 * rng.point();
        let ray = Ray::new(o, (to - o).normalize());
        let least = alone
            .iter()
            .filter_map(|a| a.intersect(&ray))
            .map(|h| h.t)
            .reduce(f32::min);
        assert_eq!(accel.intersect(&ray).map(|h| h.t), least);
    }
}

#[test]
fn empty_and_useless_input_hits_nothing() {
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    assert!(Accel::build(&[], &[]).intersect(&ray).is_none());
    let odd = [
        Vec3::NAN,
        Vec3::INFINITY,
        Vec3::Z,
        Vec3::new(1.0, 0.0, 1.0),
        Vec3::ONE,
    ];
    // Not finite, without such a corner, a point, a segment, three points on a line.
    let line = [[0, 2, 3], [1, 2, 3], [2, 3, 9], [2, 2, 2], [2, 3, 3]];
    let accel = one(&odd, &line);
    assert!(!accel.occluded(&ray) && accel.bounds().is_empty());
    // Bad triangles do not disturb a good one, and numbers count the bad ones.
    let mut all = line.to_vec();
    all.push([2, 3, 4]);
    let hit = one(&odd, &all).intersect(&Ray::new(Vec3::new(0.5, 0.1, 0.0), Vec3::Z));
    assert_eq!(hit.map(|h| (h.t, h.prim)), Some((1.0, 5)));
}

#[test]
fn ends_of_the_ray_are_in_and_out() {
    let p = [
        Vec3::new(-1.0, -1.0, 2.0),
        Vec3::new(3.0, -1.0, 2.0),
        Vec3::new(-1.0, 3.0, 2.0),
    ];
    let accel = one(&p, &[[0, 1, 2]]);
    for (z, t_max, hits) in [
        (0.0, 2.0, true),
        (0.0, 1.999_999_8, false),
        (2.0, 1.0, false),
    ] {
        let mut ray = Ray::new(Vec3::new(0.0, 0.0, z), Vec3::Z);
        ray.t_max = t_max;
        assert_eq!(accel.occluded(&ray), hits, "from {z} to {t_max}");
        assert_eq!(accel.intersect(&ray).is_some(), hits);
    }
    // Rays that are no rays end.
    for ray in [
        Ray::new(Vec3::NAN, Vec3::Z),
        Ray::new(Vec3::ZERO, Vec3::NAN),
        Ray::new(Vec3::INFINITY, Vec3::ZERO),
    ] {
        assert!(accel.intersect(&ray).is_none());
    }
}

#[test]
fn masks_let_rays_through() {
    struct Odd;
    impl Hooks for Odd {
        const SHAPES: bool = false;
        const FILTERS: bool = true;
        fn intersect(&self, _: ShapeId, _: &Ray) -> Option<(f32, Vec2)> {
            None
        }
        fn accept(&self, shape: ShapeId, prim: u32, uv: Vec2) -> bool {
            assert!(shape == ShapeId(0) && uv.min_element() >= 0.0);
            prim % 2 == 1
        }
    }
    let (p, t) = loose(40, |i| {
        [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + (i + 1) as f32 * Vec3::Z)
    });
    let accel = one(&p, &t);
    // Through the inside, and through a corner, which goes by the double-precision path.
    for x in [0.25, 0.0] {
        let mut ray = Ray::new(Vec3::new(x, x, 0.0), Vec3::Z);
        assert_eq!(accel.intersect_with(&ray, &Odd).map(|h| h.prim), Some(1));
        ray.t_max = 1.5;
        assert!(!accel.occluded_with(&ray, &Odd) && accel.occluded(&ray));
    }
}

/// Inputs on which clustering builders take quadratic time. The work of ours is bounded by its depth,
/// so that is what is looked at.
#[test]
fn pathological_inputs_build_shallow_trees() {
    let unit = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let n = 20_000;
    let nested = |i: u32| {
        let s = (i + 1) as f32;
        [
            Vec3::new(-s, -s, 0.0),
            Vec3::new(s, -s, 0.0),
            Vec3::new(0.0, s, s),
        ]
    };
    type Case<'a> = (&'a str, &'a dyn Fn(u32) -> [Vec3; 3], u32);
    let cases: [Case<'_>; 5] = [
        ("identical", &|_| unit, n),
        ("row", &|i| unit.map(|p| p + i as f32 * Vec3::X), n),
        ("nested", &nested, n),
        (
            "geometric row",
            &|i| unit.map(|p| (p + Vec3::X) * 1.004f32.powi(i as i32 - 10_000)),
            n,
        ),
        (
            "huge and tiny",
            &|i| unit.map(|p| p * 10f32.powi(i as i32 % 76 - 38)),
            4_000,
        ),
    ];
    for (name, triangle, n) in cases {
        let (p, t) = loose(n, triangle);
        let accel = one(&p, &t);
        assert!(
            accel.depth() <= wide::MAX_DEPTH,
            "{name}: depth {}",
            accel.depth()
        );
        assert!(
            accel.bytes() < 110 * n as usize,
            "{name}: {} bytes",
            accel.bytes()
        );
    }
}

/// Where the tree would be too deep to traverse, halving keeps to the depth asked for.
#[test]
fn depth_limit_holds() {
    for (n, limit) in [
        (1u32, 0),
        (2, 1),
        (3, 2),
        (1000, 10),
        (1000, 11),
        (5000, 20),
    ] {
        let bounds = |i: u32| {
            let p = Vec3::splat(1.02f32.powi(i as i32 % 4000));
            Aabb {
                min: p,
                max: p * 1.01,
            }
        };
        let mut prims: Vec<Prim> = (0..n).map(|i| Prim::new(bounds(i), i)).collect();
        let tree = binary::build(&mut prims, limit);
        let mut seen = vec![0; n as usize];
        let mut open = vec![(0usize, 0)];
        while let Some((at, depth)) = open.pop() {
            let node = &tree[at];
            assert!(depth <= limit, "{n} primitives, limit {limit}");
            if node.leaf {
                seen[node.first as usize] += 1;
                continue;
            }
            for child in [node.first as usize, node.first as usize + 1] {
                assert_eq!(tree[child].bounds.union(node.bounds), node.bounds);
                open.push((child, depth + 1));
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
    }
}

/// The tree, and so the order of equal hits, does not depend on the number of threads.
#[test]
fn trees_do_not_depend_on_threads() {
    let rng = &mut Random::new(3);
    let points: Vec<Vec3> = (0..150_000).map(|_| rng.point()).collect();
    let (p, t) = loose(150_000, |i| {
        let p = points[i as usize];
        [p, p + 0.01 * Vec3::X, p + 0.01 * Vec3::new(0.2, 1.0, p.x)]
    });
    let print = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let accel = pool.expect("threads").install(|| one(&p, &t));
        (accel.wide().fingerprint(), accel.depth())
    };
    let first = print(1);
    assert_eq!(first, print(2));
    assert_eq!(first, print(3));
}

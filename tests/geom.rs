//! Points on shapes against figures measured with Mitsuba 3.9.1 (`ray_intersect`, scalar_rgb), and the
//! properties that hold for every shape: error bounds, area densities, grazing and distant rays.

mod shapes;

use luxel::geom::{Cylinder, Geometry, Hit, Mesh, MeshError, Ray, Sphere};
use luxel::math::{DVec3, Frame, Transform, Vec2, Vec3};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};
use shapes::{cylinder, disk, intersect, scale, sphere, turned};

fn uniform(rng: &mut Pcg64Mcg) -> f32 {
    (rng.next_u32() >> 8) as f32 / (1 << 24) as f32
}

fn direction(rng: &mut Pcg64Mcg) -> Vec3 {
    loop {
        let v = Vec3::from_array(std::array::from_fn(|_| 2.0 * uniform(rng) - 1.0));
        if (1e-3..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// Two triangles around the z axis that share an edge, without normals.
fn fold(face_normals: bool, flip: bool) -> Geometry {
    let positions = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
        [0.0, 0.0, 0.5],
    ]
    .map(Vec3::from_array)
    .to_vec();
    let mut m = Mesh::new(positions, vec![], vec![], vec![[0, 1, 2], [0, 2, 3]], flip).unwrap();
    if !face_normals {
        m.compute_vertex_normals();
    }
    Geometry::Mesh(m)
}

/// What Mitsuba found: p, n, sh_frame.n, sh_frame.s, uv.
struct Measured {
    name: &'static str,
    shape: Geometry,
    o: [f32; 3],
    d: [f32; 3],
    p: [f32; 3],
    ng: [f32; 3],
    ns: [f32; 3],
    s: [f32; 3],
    uv: [f32; 2],
}

#[rustfmt::skip]
fn measured() -> Vec<Measured> {
    let id = Transform::IDENTITY;
    let (mx, mz) = (scale(-1.0, 1.0, 1.0), scale(1.0, 1.0, -1.0));
    let above = ([0.9, 2.3, 3.1], [-0.65, -1.99, -2.9]);
    let inside = ([0.1, 0.2, 0.3], [-0.7, -2.0, 0.4]);
    let axis = DVec3::ONE.normalize();
    let f = Frame::from_normal(axis.as_vec3());
    let rod = Transform::translate(DVec3::Z)
        * Transform::new(glam::DAffine3::from_mat3(glam::DMat3::from_cols(f.s.as_dvec3(), f.t.as_dvec3(), axis))).unwrap()
        * scale(0.5, 0.5, 3f64.sqrt());
    let tilted = Transform::rotate(DVec3::X, 20.0).unwrap() * scale(2.0, 1.0, 1.0);
    let row = |name, shape, (o, d): ([f32; 3], [f32; 3]), p, ng, ns, s, uv| Measured { name, shape, o, d, p, ng, ns, s, uv };
    vec![
        row("sphere", sphere(turned(), false), above, [0.47426, 0.99657, 1.20053], [0.21097, 0.68967, 0.69271], [0.21097, 0.68967, 0.69271], [-0.90937, -0.12145, 0.39787], [0.18293, 0.20842]),
        row("flipped sphere", sphere(turned(), true), above, [0.47426, 0.99657, 1.20053], [-0.21097, -0.68967, -0.69271], [-0.21097, -0.68967, -0.69271], [-0.90937, -0.12145, 0.39787], [0.18293, 0.20842]),
        row("sphere mirrored in x", sphere(mx, false), above, [0.35767, 0.63964, 0.68039], [-0.35767, -0.63964, -0.68039], [-0.35767, -0.63964, -0.68039], [0.87281, -0.48805, 0.0], [0.33115, 0.26181]),
        row("sphere mirrored in z, flipped", sphere(mz, true), above, [0.35767, 0.63964, 0.68039], [0.35767, 0.63964, 0.68039], [0.35767, 0.63964, 0.68039], [-0.87281, 0.48805, 0.0], [0.16885, 0.73819]),
        row("sphere from inside", sphere(id, false), ([0.1, 0.2, 0.3], [1.0, 2.0, -0.5]), [0.44352, 0.88704, 0.12824], [0.44352, 0.88704, 0.12824], [0.44352, 0.88704, 0.12824], [-0.89443, 0.44721, 0.0], [0.17621, 0.45907]),
        row("disk", disk(turned(), false), above, [0.26012, 0.34097, 0.24513], [0.38567, 0.1123, 0.91578], [0.38567, 0.1123, 0.91578], [0.23636, 0.94742, -0.21572], [0.19565, 0.11468]),
        row("disk mirrored in x", disk(mx, false), above, [0.20517, 0.17276, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.76494, 0.6441, 0.0], [0.26822, 0.38862]),
        row("disk mirrored in z", disk(mz, false), above, [0.20517, 0.17276, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [0.76494, 0.6441, 0.0], [0.26822, 0.11138]),
        row("elliptic disk", disk(tilted, false), ([3.0, 3.0, 5.0], [-2.3, -2.8, -5.0]), [0.74206, 0.2512, 0.09143], [0.0, -0.34202, 0.93969], [0.0, -0.34202, 0.93969], [0.94081, 0.31848, 0.11592], [0.4573, 0.09937]),
        row("cylinder from inside", cylinder(id, false), inside, [-0.30349, -0.95283, 0.53057], [-0.30349, -0.95283, 0.0], [-0.30349, -0.95283, 0.0], [0.95283, -0.30349, 0.0], [0.70092, 0.53057]),
        row("cylinder mirrored in x, flipped", cylinder(mx, true), inside, [-0.30349, -0.95283, 0.53057], [0.30349, 0.95283, 0.0], [0.30349, 0.95283, 0.0], [-0.95283, 0.30349, 0.0], [0.79908, 0.53057]),
        row("cylinder between points", cylinder(rod, false), ([2.0, 0.2, 1.5], [-1.5, 0.3, 0.0]), [1.04993, 0.39001, 1.5], [0.80656, -0.51326, -0.29329], [0.80656, -0.51326, -0.29329], [0.127, 0.635, -0.762], [0.93348, 0.64665]),
        row("rectangle", Geometry::Mesh(Mesh::rectangle(&id, false)), ([0.9, 2.3, 3.1], [-0.65, -1.99, -2.9]), [0.20517, 0.17276, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.60259, 0.58638]),
        row("flipped rectangle", Geometry::Mesh(Mesh::rectangle(&id, true)), above, [0.20517, 0.17276, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.60259, 0.58638]),
        row("rectangle mirrored in x", Geometry::Mesh(Mesh::rectangle(&mx, false)), above, [0.20517, 0.17276, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.39741, 0.58638]),
        row("cube", Geometry::Mesh(Mesh::cube(&id, false)), above, [0.42931, 0.85897, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.92948, 0.71466]),
        row("cube mirrored in x, flipped", Geometry::Mesh(Mesh::cube(&mx, true)), above, [0.42931, 0.85897, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [0.92948, 0.28534]),
        row("mesh without normals", fold(false, false), ([0.3, 0.4, 3.0], [0.0, 0.1, -1.0]), [0.3, 0.7, 0.0], [0.0, 0.0, 1.0], [0.43244, 0.0, 0.90166], [0.90166, 0.0, -0.43244], [0.3, 0.35]),
        row("mesh with face_normals", fold(true, false), ([0.3, 0.4, 3.0], [0.0, 0.1, -1.0]), [0.3, 0.7, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.3, 0.35]),
        row("flipped mesh", fold(false, true), ([0.3, 0.4, 3.0], [0.0, 0.1, -1.0]), [0.3, 0.7, 0.0], [0.0, 0.0, -1.0], [-0.43244, 0.0, -0.90166], [0.90166, 0.0, -0.43244], [0.3, 0.35]),
    ]
}

#[test]
fn points_are_those_of_mitsuba() {
    for m in measured() {
        let ray = Ray::new(Vec3::from(m.o), Vec3::from(m.d).normalize());
        let hit = intersect(&m.shape, &ray).unwrap_or_else(|| panic!("{}: missed", m.name));
        for (what, ours, theirs) in [
            ("p", hit.p, m.p),
            ("ng", hit.ng, m.ng),
            ("ns", hit.frame.n, m.ns),
            ("s", hit.frame.s, m.s),
            (
                "t",
                hit.frame.t,
                Vec3::from(m.ns).cross(Vec3::from(m.s)).into(),
            ),
            ("uv", hit.uv.extend(0.0), [m.uv[0], m.uv[1], 0.0]),
        ] {
            let gap = (ours - Vec3::from(theirs)).abs().max_element();
            assert!(gap < 2e-5, "{} {what}: {ours} and not {theirs:?}", m.name);
        }
    }
}

#[test]
fn tangents_are_derivatives_of_the_point() {
    // dp/du and dp/dv as Mitsuba reports them.
    let ray = Ray::new(
        Vec3::new(0.9, 2.3, 3.1),
        Vec3::new(-0.65, -1.99, -2.9).normalize(),
    );
    let rows = [
        (
            sphere(turned(), false),
            [-4.52344, -0.60414, 1.9791],
            [-1.46425, 2.91549, -2.45673],
        ),
        (
            disk(turned(), false),
            [0.30726, 1.23164, -0.28043],
            [-1.42526, 0.47886, 0.54152],
        ),
        (
            Geometry::Mesh(Mesh::cube(&Transform::IDENTITY, false)),
            [0.0, 2.0, 0.0],
            [2.0, 0.0, 0.0],
        ),
    ];
    for (g, du, dv) in rows {
        let (dp_du, dp_dv) = g.dp_duv(&intersect(&g, &ray).unwrap());
        assert!((dp_du - Vec3::from(du)).length() < 1e-4, "{dp_du}");
        assert!((dp_dv - Vec3::from(dv)).length() < 1e-4, "{dp_dv}");
    }
}

#[test]
fn vertex_normals_are_weighted_by_angle() {
    let Geometry::Mesh(m) = fold(false, false) else {
        unreachable!()
    };
    // At the far end of the shared edge the faces meet with angles of atan(1/2) and atan(1/4).
    let expected = [
        [0.70710677, 0.0, 0.70710677],
        [0.0, 0.0, 1.0],
        [0.46716982, 0.0, 0.88416755],
        [1.0, 0.0, 0.0],
    ];
    for (n, e) in m.normals().iter().zip(expected) {
        assert!((*n - Vec3::from(e)).length() < 1e-6, "{n} and not {e:?}");
    }
}

#[test]
fn tiny_triangles_keep_their_normal_and_area() {
    let p = |x: f32, y: f32| Vec3::new(0.5 + x, 0.25 + y, 0.125);
    // The smallest steps that f32 can take at these coordinates.
    let (dx, dy) = (f32::EPSILON / 2.0, f32::EPSILON / 4.0);
    let far = Mesh::new(
        vec![p(0.0, 0.0), p(dx, 0.0), p(0.0, dy)],
        vec![],
        vec![],
        vec![[0, 1, 2]],
        false,
    )
    .unwrap();
    assert_eq!(far.face_normal(0), Vec3::Z);
    let near = Mesh::new(
        [[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.0, 1e-9, 1e-9]]
            .map(Vec3::from_array)
            .to_vec(),
        vec![],
        vec![],
        vec![[0, 1, 2], [0, 0, 1]],
        false,
    )
    .unwrap();
    let expected = Vec3::new(0.0, -1.0, 1.0).normalize();
    assert!((near.face_normal(0) - expected).length() < 1e-6);
    assert!((near.triangle_area(0) / (0.5e-18 * 2f64.sqrt()) - 1.0).abs() < 1e-6);
    // A degenerate triangle has a normal all the same, and no area.
    assert!(near.face_normal(1).is_normalized() && near.triangle_area(1) == 0.0);
}

#[test]
fn meshes_that_cannot_be_used_are_refused() {
    let p = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    let tri = vec![[0, 1, 3]];
    let e = Mesh::new(p.clone(), vec![], vec![], tri, false).unwrap_err();
    assert_eq!(
        e.to_string(),
        "triangle 0 names vertex 3, but the mesh has 3 vertices"
    );
    let e = Mesh::new(p.clone(), vec![Vec3::Z], vec![], vec![], false).unwrap_err();
    assert_eq!(e.to_string(), "1 normals for 3 vertices");
    let nan = vec![Vec3::ZERO, Vec3::NAN];
    let e = Mesh::new(nan, vec![], vec![], vec![], false).unwrap_err();
    assert_eq!(e, MeshError::NotFinite { vertex: 1 });
    assert!(Sphere::new(scale(1.0, 1.0, 1.001), false).is_none());
    assert!(!Cylinder::new(scale(1.0, 1.1, 1.0), false).is_even());
    assert!(Cylinder::new(scale(1.0, 1.0, 7.0), false).is_even());
}

fn every_shape(t: Transform) -> [Geometry; 5] {
    [
        sphere(t, false),
        disk(t, false),
        cylinder(t, false),
        Geometry::Mesh(Mesh::rectangle(&t, false)),
        Geometry::Mesh(Mesh::cube(&t, false)),
    ]
}

/// Distance of `p` from the surface the hit was on, in f64, along the normal there.
fn off_surface(g: &Geometry, t: &Transform, hit: &Hit) -> f64 {
    let l = t.inverse().point(hit.p.as_dvec3());
    let unit = t.vector(DVec3::X).length();
    unit * match g {
        Geometry::Sphere(_) => l.length() - 1.0,
        Geometry::Cylinder(_) => l.x.hypot(l.y) - 1.0,
        Geometry::Disk(_) => l.z,
        Geometry::Deforming(_) | Geometry::Sdf(_) => panic!("they have tests of their own"),
        // The mesh is the plane of its rounded corners, not the ideal square.
        Geometry::Mesh(m) => {
            let [a, b, c] = m.triangle(hit.prim).map(|p| p.as_dvec3());
            let n = (b - a).cross(c - a).normalize();
            return n.dot(hit.p.as_dvec3() - a);
        }
    }
}

#[test]
fn points_lie_within_their_error_bound_and_spawned_rays_leave() {
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    for size in [1e-6, 1.0, 1e6] {
        for offset in [0.0, 30.0] {
            let t = Transform::translate(DVec3::new(offset, -offset, offset) * size)
                * turned()
                * scale(size, size, size);
            for g in every_shape(t) {
                let b = g.bounds();
                for _ in 0..2000 {
                    // From ten thousand sizes away now and then.
                    let far = if uniform(&mut rng) < 0.2 { 1e4 } else { 1.0 };
                    let o = b.center() + direction(&mut rng) * (b.diagonal().length() * far);
                    let aim = Vec3::from_array(std::array::from_fn(|_| uniform(&mut rng)));
                    let d = (b.min + b.diagonal() * aim - o).normalize();
                    let Some(hit) = intersect(&g, &Ray::new(o, d)) else {
                        continue;
                    };
                    let bound = hit.ng.abs().dot(hit.p_err) as f64;
                    let off = off_surface(&g, &t, &hit);
                    assert!(off.abs() <= bound, "{off} beyond {bound}");
                    // Leaving to the outside never meets the shape again; all but the disk close to
                    // the inside, where the ray must cross to another place.
                    let wi = direction(&mut rng);
                    if let (Geometry::Sphere(_) | Geometry::Disk(_), true) =
                        (&g, wi.dot(hit.ng) >= 0.0)
                    {
                        assert!(intersect(&g, &hit.spawn(wi)).is_none(), "{wi} from {hit:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn area_samples_are_uniform_and_lie_on_the_surface() {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let t = turned();
    for g in every_shape(t) {
        let n = 200_000;
        let mut sum = DVec3::ZERO;
        let mut sum2 = DVec3::ZERO;
        let prims = g.prim_count();
        let total: f64 = (0..prims).map(|i| g.prim_area(i)).sum();
        assert!((total / g.area() - 1.0).abs() < 1e-9);
        for i in 0..n {
            // All triangles of these meshes have the same area.
            let s = g.sample_area(i % prims, Vec2::new(uniform(&mut rng), uniform(&mut rng)));
            let share = s.pdf_a as f64 * g.prim_area(i % prims);
            assert!((share - 1.0).abs() < 1e-6);
            let q = t.inverse().point(s.p.as_dvec3());
            sum += q;
            sum2 += q * q;
            assert!(s.ng.is_normalized() && s.ns.is_normalized());
        }
        // First and second moments in object space: 4 standard errors.
        let mean = match g {
            Geometry::Cylinder(_) => DVec3::new(0.0, 0.0, 0.5),
            _ => DVec3::ZERO,
        };
        let second = match g {
            Geometry::Sphere(_) => DVec3::splat(1.0 / 3.0),
            Geometry::Disk(_) => DVec3::new(0.25, 0.25, 0.0),
            Geometry::Cylinder(_) => DVec3::new(0.5, 0.5, 1.0 / 3.0),
            Geometry::Mesh(ref m) if m.indices().len() == 2 => DVec3::new(1.0, 1.0, 0.0) / 3.0,
            _ => DVec3::splat(5.0 / 9.0),
        };
        let tolerance = 4.0 / (n as f64).sqrt();
        assert!((sum / n as f64 - mean).abs().max_element() < tolerance);
        let gap = (sum2 / n as f64 - second).abs().max_element();
        assert!(gap < 0.5 * tolerance, "{gap}");
    }
}

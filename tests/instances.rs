//! Groups of shapes that stand in many places: the same hits and pictures as the scene written out, no leaks
//! and no self-hits at any scale, and one copy in memory.

mod common;
#[path = "common/render.rs"]
mod render;

use common::Rng;
use glam::{DVec3, Vec3};
use luxel::geom::{Geometry, GroupId, Hit, Mesh, Placement, Ray, ShapeId, World};
use luxel::math::{Motion, Transform};
use luxel::scene::Scene;

/// What stands in the group, each shape with its own transform.
fn members(place: &str) -> String {
    let shape = |kind: &str, place_before: &str, material: &str| {
        format!(
            r#"<shape type="{kind}"><transform name="to_world">{place_before}{place}</transform>
            <bsdf type="{material}"/></shape>"#
        )
    };
    shape(
        "cube",
        r#"<scale value="0.3"/><translate x="-0.6"/>"#,
        "diffuse",
    ) + &shape(
        "sphere",
        r#"<scale value="0.35"/><translate x="0.5" y="0.2"/>"#,
        "dielectric",
    ) + &shape(
        "disk",
        r#"<rotate x="1" angle="-90"/><translate y="-0.4"/>"#,
        "diffuse",
    ) + &shape(
        "cylinder",
        r#"<scale x="0.1" y="0.1"/><translate z="-0.5"/>"#,
        "roughconductor",
    )
}

/// Uniform scales, so that spheres stay spheres where the scene is written out.
const PLACES: [&str; 3] = [
    r#"<rotate x="1" y="0.3" angle="40"/><translate x="-1.2" y="0.4"/>"#,
    r#"<scale value="0.5"/><rotate y="1" angle="100"/><translate x="0.2" y="0.9" z="0.4"/>"#,
    r#"<scale value="0.8"/><rotate z="1" x="0.2" angle="-70"/><translate x="1.1" y="-0.5" z="-0.6"/>"#,
];

const LIGHT: &str = r#"<emitter type="constant"/>
    <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/><scale value="0.5"/>
    <translate y="3"/></transform><emitter type="area"><rgb name="radiance" value="4"/></emitter></shape>"#;

fn instanced() -> String {
    let places = PLACES.map(|place| {
        format!(
            r#"<shape type="instance"><ref id="g"/><transform name="to_world">{place}</transform></shape>"#
        )
    });
    let group = format!(r#"<shape type="shapegroup" id="g">{}</shape>"#, members(""));
    group + &places.concat() + LIGHT
}

fn written_out() -> String {
    PLACES.map(members).concat() + LIGHT
}

fn scene_of(content: &str) -> Scene {
    let xml = render::scene(6, &render::camera(32, 60.0), content);
    render::compile(&xml).job.scene
}

/// A ray from around the scene to about its middle.
fn ray(rng: &mut Rng) -> Ray {
    let mut v = || Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 2.0 - 1.0;
    let (o, to) = (v() * 4.0, v() * 1.5);
    Ray::new(o, (to - o).normalize())
}

fn close(a: Vec3, b: Vec3, tolerance: f32) -> bool {
    (a - b).abs().max_element() <= tolerance
}

#[test]
fn hits_are_those_of_the_scene_written_out() {
    let (a, b) = (scene_of(&instanced()), scene_of(&written_out()));
    let (mut met, mut odd) = (0, 0);
    let mut rng = Rng::new(1);
    for _ in 0..200_000 {
        let ray = ray(&mut rng);
        match (a.intersect(&ray), b.intersect(&ray)) {
            (None, None) => {}
            (Some(x), Some(y)) if close(x.p, y.p, 1e-4) => {
                met += 1;
                assert_eq!(x.prim, y.prim);
                let same = close(x.ng, y.ng, 1e-4)
                    && close(x.frame.n, y.frame.n, 1e-4)
                    && close(x.frame.s, y.frame.s, 2e-3)
                    && (x.uv - y.uv).abs().max_element() < 2e-4;
                // uv and frame of disks and spheres turn fast about their centres and poles.
                odd += usize::from(!same);
                // Along the surface a rounding of the ray moves the point far where it is grazed.
                let off = (x.p - y.p).dot(x.ng).abs();
                assert!(off <= (x.p_err + y.p_err).max_element(), "{x:?} {y:?}");
                let (u, v) = (a.dp_duv(&x), b.dp_duv(&y));
                assert!(close(u.0, v.0, 1e-2) && close(u.1, v.1, 1e-2) || !same);
            }
            // Across an edge.
            _ => odd += 1,
        }
        let short = Ray {
            t_max: 3.0 * rng.f32() + 1.0,
            ..ray
        };
        odd += usize::from(a.occluded(&short) != b.occluded(&short));
        odd += usize::from(a.occluded(&short) != a.intersect(&short).is_some());
    }
    assert!(met > 50_000, "{met}");
    assert!(odd < 60, "{odd} of {met} differ");
}

#[test]
fn pictures_are_those_of_the_scene_written_out() {
    let camera = render::camera(32, 50.0);
    let picture = |content: &str| render::picture(&render::scene(6, &camera, content), 64, 7);
    let (a, b) = (picture(&instanced()), picture(&written_out()));
    let (mean_a, mean_b) = (render::mean_of(&a), render::mean_of(&b));
    // The numbers are the same, so only paths that cross an edge differ.
    assert!((mean_a / mean_b - 1.0).abs() < 2e-3, "{mean_a} {mean_b}");
    let same = a
        .iter()
        .zip(&b)
        .filter(|(a, b)| (a[0] / b[0] - 1.0).abs() < 1e-3);
    let same = same.count() as f64 / a.len() as f64;
    assert!(same > 0.8, "{same}");
}

/// One closed mesh or sphere, far from its own origin or not, placed with `scale` at `at`.
fn placed(geometry: Geometry, scale: DVec3, at: DVec3) -> (World, Transform) {
    let turn = Transform::rotate(DVec3::new(1.0, 2.0, -0.5), 33.0).unwrap();
    let place = Transform::translate(at) * turn * Transform::scale(scale).unwrap();
    let (group, motion) = (GroupId(0), Motion::still(place));
    let world = World::with_places(
        vec![geometry],
        &[vec![ShapeId(0)]],
        vec![Placement { group, motion }],
    );
    (world, place)
}

fn sphere() -> Geometry {
    Geometry::Sphere(luxel::geom::Sphere::new(Transform::IDENTITY, false).unwrap())
}

/// Where the surface was left on one of its sides, rays back to it meet nothing at no distance, and from
/// inside every ray meets the other side.
#[test]
fn no_ray_leaks_or_meets_the_surface_it_leaves() {
    let mut rng = Rng::new(2);
    let cube = || Geometry::Mesh(Mesh::cube(&Transform::IDENTITY, false));
    for scale in [1e-3, 1.0, 1e3] {
        for stretch in [
            DVec3::ONE,
            DVec3::new(1.0, 0.1, 3.0),
            DVec3::new(-1.0, 1.0, 1.0),
        ] {
            for offset in [0.0, 1.0, 1e3] {
                let at = DVec3::new(1.0, -0.7, 0.4) * offset * scale;
                for geometry in [cube(), sphere()] {
                    let (world, place) = placed(geometry, stretch * scale, at);
                    for _ in 0..2000 {
                        check_at(&world, scale as f32, &place, &mut rng);
                    }
                }
            }
        }
    }
}

fn direction(rng: &mut Rng) -> Vec3 {
    luxel::math::warp::uniform_sphere(rng.vec2())
}

fn check_at(world: &World, scale: f32, place: &Transform, rng: &mut Rng) {
    let at = place.point(DVec3::ZERO).as_vec3();
    // From about the middle out.
    let from = at + direction(rng) * (0.02 * scale);
    let out = Ray::new(from, direction(rng));
    let hit: Hit = world.intersect(&out, true).expect("a ray leaks");
    assert!(world.occluded(&out));
    assert!(hit.frame.s.is_finite() && hit.ng.is_normalized() && hit.p_err.is_finite());
    let far = (hit.p - at).length();
    // Where a face ends within the error of the point, that may lie outside of the next one.
    let local = place.inverse().point(hit.p.as_dvec3()).abs();
    let err = place.inverse().matrix().matrix3.abs() * hit.p_err.as_dvec3();
    let mut to_side = ((local - 1.0).abs() - 4.0 * err).to_array();
    to_side.sort_by(f64::total_cmp);
    let on_edge = world.geometries()[0].is_mesh() && to_side[1] < 0.0;
    // Almost along the surface too.
    let flat = |w: Vec3, k: f32| (w - hit.ng * w.dot(hit.ng) * (1.0 - k)).normalize();
    let w = direction(rng);
    for k in [1.0, 1e-3, 1e-6] {
        let w = flat(w, k);
        let leaving = hit.spawn(w);
        match world.intersect(&leaving, false) {
            None => assert!(on_edge || w.dot(hit.ng) >= 0.0, "a ray leaks out along {w}"),
            // Inwards: not the same place again. A cube's edge may be near.
            Some(next) => {
                assert!(w.dot(hit.ng) < 1e-4, "the surface shadows itself along {w}");
                let apart = (next.p - hit.p).length() > 1e-5 * far;
                assert!(
                    apart || next.prim != hit.prim || k < 1.0,
                    "{:?} {:?}",
                    hit,
                    next
                );
            }
        }
    }
}

/// A triangle mesh of `n` by `n` quads with hills.
fn hills(n: u32) -> Mesh {
    let at = |i: u32| i as f32 / n as f32;
    let row = |j: u32| (0..=n).map(move |i| (at(i), at(j)));
    let height = |(x, y): (f32, f32)| Vec3::new(x, y, 0.1 * (20.0 * x).sin() * (17.0 * y).cos());
    let positions = (0..=n).flat_map(row).map(height).collect();
    let quad = |k: u32| {
        let a = k / n * (n + 1) + k % n;
        [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
    };
    let indices = (0..n * n).flat_map(quad).collect();
    Mesh::new(positions, vec![], vec![], indices, false).unwrap()
}

#[test]
fn a_thousand_instances_store_their_mesh_once() {
    let mesh = hills(224);
    assert!(mesh.indices().len() > 100_000);
    let alone = World::new(vec![Geometry::Mesh(mesh.clone())]).bytes();
    let place = |i: u32| Placement {
        group: GroupId(0),
        motion: Motion::still(Transform::translate(DVec3::new(
            f64::from(i % 32) * 1.5,
            f64::from(i / 32) * 1.5,
            0.0,
        ))),
    };
    let world = World::with_places(
        vec![Geometry::Mesh(mesh)],
        &[vec![ShapeId(0)]],
        (0..1000).map(place).collect(),
    );
    let more = world.bytes() - alone;
    assert!(more < 1000 * 500, "{more} bytes for 1000 places of {alone}");
    // Each of them is there.
    for i in 0..1000 {
        let at = Vec3::new(
            (i % 32) as f32 * 1.5 + 0.5,
            (i / 32) as f32 * 1.5 + 0.5,
            5.0,
        );
        let hit = world.intersect(&Ray::new(at, Vec3::NEG_Z), false).unwrap();
        assert_eq!(hit.place.0, i);
    }
}

/// Rays, and what Mitsuba 3.9.1 finds with them: t, normal, s of the frame, uv, dp/du, dp/dv.
#[test]
fn mirrored_instances_are_those_of_mitsuba() {
    let place = r#"<scale x="-1.5" y="1.5" z="1.5"/><rotate x="1" angle="20"/>
        <translate x="0.1" y="0.2" z="0.3"/>"#;
    let down = Ray::new(Vec3::new(0.2, 0.3, 8.0), Vec3::NEG_Z);
    let across = Ray::new(Vec3::new(8.0, 0.3, 1.2), Vec3::NEG_X);
    type Row = (
        &'static str,
        f32,
        [f32; 3],
        [f32; 3],
        [f32; 2],
        [f32; 3],
        [f32; 3],
    );
    #[rustfmt::skip]
    let rows: [Row; 5] = [
        ("rectangle", 7.663603, [0.0, -0.34202, 0.939693], [-1.0, 0.0, 0.0], [0.466667, 0.535473],
            [-3.0, 0.0, 0.0], [0.0, 2.81908, 1.02606]),
        ("sphere", 6.206681, [0.0666666, 0.0666668, 0.995546], [0.986601, -0.153312, -0.0558011],
            [0.276083, 0.133989], [3.79953, -0.590426, -0.214897], [0.701719, 4.64607, -0.358115]),
        ("cylinder", 6.454813, [0.963458, 0.251704, 0.0916129], [0.267858, -0.905355, -0.329522],
            [0.456842, 0.541014], [2.5245, -8.53277, -3.10567], [0.0, -0.51303, 1.40954]),
        ("disk", 7.663602, [0.0, -0.34202, 0.939693], [0.684791, 0.684791, 0.249244],
            [0.0973533, 0.370053], [1.02719, 1.02719, 0.373865], [0.668643, -0.590426, -0.214898]),
        ("cube", 6.067336, [0.0, -0.34202, 0.939693], [0.0, 0.939693, 0.34202], [0.717458, 0.466667],
            [0.0, 2.81908, 1.02606], [-3.0, 0.0, 0.0]),
    ];
    for (kind, t, n, s, uv, du, dv) in rows {
        // An anisotropic material makes frames follow dp/du.
        let content = format!(
            r#"<shape type="shapegroup" id="g"><shape type="{kind}"><bsdf type="roughconductor">
            <float name="alpha_u" value="0.1"/><float name="alpha_v" value="0.2"/></bsdf></shape></shape>
            <shape type="instance"><ref id="g"/><transform name="to_world">{place}</transform></shape>"#
        );
        let scene = scene_of(&content);
        let ray = if kind == "cylinder" { across } else { down };
        let hit = scene.intersect(&ray).unwrap();
        let found = scene.dp_duv(&hit);
        let near = |a: Vec3, b: [f32; 3]| close(a, Vec3::from(b), 2e-5);
        assert!((hit.p.distance(ray.o) - t).abs() < 1e-5, "{kind}: {hit:?}");
        assert!(near(hit.ng, n) && near(hit.frame.n, n), "{kind}: {hit:?}");
        assert!(near(hit.frame.s, s), "{kind}: {hit:?}");
        assert!(hit.uv.distance(uv.into()) < 1e-5, "{kind}: {hit:?}");
        assert!(near(found.0, du) && near(found.1, dv), "{kind}: {found:?}");
    }
}

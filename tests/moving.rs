//! Shapes that move or change while the shutter is open: against closed forms, and against the average of many
//! still pictures.

mod common;
mod directions;
#[path = "common/render.rs"]
mod render;
mod shapes;

use common::{Rng, sidak};
use directions::DirectionCheck;
use glam::{DVec3, Vec3};
use luxel::bsdf::Density;
use luxel::film::Film;
use luxel::format::{self, Overrides};
use luxel::geom::{
    Cylinder, Deforming, Disk, Geometry, GroupId, Hit, Mesh, Placement, Ray, ShapeId, Sphere, World,
};
use luxel::light::{Emitter, Lights, Strategy};
use luxel::math::{Motion, Rgb, Transform};
use std::fs;
use std::path::{Path, PathBuf};

/// A camera whose shutter is open from 0 to 1, looking down -z at the square of half-width `half` around
/// (`x`, 0, 0).
fn ortho(size: u32, x: f64, half: f64) -> String {
    format!(
        r#"<sensor type="orthographic"><float name="shutter_close" value="1"/>
            <transform name="to_world"><scale x="{half}" y="{half}"/>
            <lookat origin="{x}, 0, 4" target="{x}, 0, 0" up="0, 1, 0"/></transform>
            <film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/>
            <rfilter type="box"/></film></sensor>"#
    )
}

/// The same as [`render::camera`], with a shutter that is open from 0 to 1.
fn camera(size: u32, fov: f64) -> String {
    let still = render::camera(size, fov);
    still.replace(
        r#"<float name="fov""#,
        r#"<float name="shutter_close" value="1"/><float name="fov""#,
    )
}

/// Keyframes at times 0 and 1.
fn animation(first: &str, last: &str) -> String {
    format!(
        r#"<animation name="to_world"><transform time="0">{first}</transform>
        <transform time="1">{last}</transform></animation>"#
    )
}

const SHINING: &str = r#"<emitter type="area"><rgb name="radiance" value="1"/></emitter>"#;

#[test]
fn a_moving_square_leaves_a_streak() {
    // Of width 0.5, over a way of 2: each place of the streak is covered for a quarter of the time.
    let small = r#"<scale value="0.25"/><translate x="-1"/>"#;
    let content = format!(
        r#"<shape type="rectangle">{}{SHINING}</shape>"#,
        animation(small, &small.replace("-1", "1"))
    );
    let scene = |x: f64| render::scene(1, &ortho(16, x, 0.2), &content);
    let middle = render::mean_and_error(&scene(0.0), 8192, 1);
    render::assert_explained(middle, 0.25, "the middle");
    // At both ends it fades over the width of the square.
    for x in [-1.0, 1.0] {
        let end = render::picture(&scene(x), 1024, 2);
        let off = render::mean_of(&end) / 0.125 - 1.0;
        assert!(off.abs() < 0.01, "{x}: {off}");
    }
}

#[test]
fn a_turning_square_covers_its_corners_part_of_the_time() {
    let content = format!(
        r#"<shape type="rectangle">{}{SHINING}</shape>"#,
        animation("", r#"<rotate z="1" angle="90"/>"#)
    );
    // Of a circle of radius r about the middle, 4 arcs of 2 acos(1/r) lie outside of the square.
    let covered = |x: f64, y: f64| 1.0 - 4.0 / std::f64::consts::PI * (1.0 / x.hypot(y)).acos();
    let (x, half, n) = (1.2, 0.1, 64);
    let at = |i: i32| half * (f64::from(2 * i + 1) / f64::from(n) - 1.0);
    let cells = (0..n * n).map(|i| covered(x + at(i % n), at(i / n)));
    let expected = cells.sum::<f64>() / f64::from(n * n);
    let xml = render::scene(1, &ortho(4, x, half), &content);
    render::assert_explained(render::mean_and_error(&xml, 1024, 3), expected, "corner");
}

#[test]
fn equal_keyframes_are_a_still_shape_bit_for_bit() {
    let light = r#"<emitter type="constant"/>"#;
    let place = r#"<scale value="0.7"/><rotate x="1" angle="20"/><translate x="0.3" y="0.2"/>"#;
    let still = format!(r#"<transform name="to_world">{place}</transform>"#);
    for shape in ["cube", "sphere", "cylinder"] {
        let content =
            |to_world: &str| format!(r#"<shape type="{shape}">{to_world}</shape>{light}"#);
        let picture = |to_world: &str| {
            let xml = render::scene(4, &camera(16, 45.0), &content(to_world));
            render::picture(&xml, 4, 5)
        };
        assert_eq!(
            picture(&still),
            picture(&animation(place, place)),
            "{shape}"
        );
    }
}

/// Renders `xml`, a scene of meshes in `dir`.
fn film(xml: &str, dir: &Path, spp: u64, seed: u64) -> Film {
    let overrides = Overrides {
        seed: Some(seed),
        ..Overrides::default()
    };
    let desc = format::load_str("test.xml", xml, dir, &[]).unwrap_or_else(|e| panic!("{e}"));
    let compiled = format::compile(&desc, &overrides).unwrap_or_else(|e| panic!("{e}"));
    render::render(&compiled, spp).0
}

/// Mean and variance of the mean over each block of `n` by `n` pixels of channel 0.
fn blocks(film: &Film, size: usize, n: usize) -> Vec<[f64; 2]> {
    let (mean, err) = (film.mean(), film.standard_error());
    let mut sums = vec![[0.0; 2]; (size / n) * (size / n)];
    let area = (n * n) as f64;
    for (i, (m, e)) in mean.iter().zip(&err).enumerate() {
        let block = &mut sums[i / size / n * (size / n) + i % size / n];
        block[0] += m[0] / area;
        block[1] += (e[0] / area).powi(2);
    }
    sums
}

/// Fails where `moving` is not the average of `stills`, block by block and as a whole.
fn assert_average(moving: &Film, stills: &[Film], size: usize, what: &str) {
    let n = stills.len() as f64;
    for (block, tolerance) in [(4, 4.5), (size, 4.0)] {
        let found = blocks(moving, size, block);
        let mut average = vec![[0.0; 2]; found.len()];
        for still in stills {
            for (sum, b) in average.iter_mut().zip(blocks(still, size, block)) {
                sum[0] += b[0] / n;
                sum[1] += b[1] / (n * n);
            }
        }
        for (i, ([a, va], [b, vb])) in found.iter().zip(&average).enumerate() {
            let sigma = (va + vb).sqrt();
            let off = (a - b).abs();
            // The stills stand for times that lie apart: a share of a per cent at the edges of shadows.
            assert!(
                off < tolerance * sigma + 3e-3 * b,
                "{what}, block {i} of {block}: {a} against {b} +- {sigma}"
            );
            assert!(
                block < size || sigma < 4.5e-3 * b,
                "{what}: {sigma} of {b} says too little"
            );
        }
    }
}

/// The motion that [`animation`] makes of these steps, at one time.
fn step(time: f64, turn: f64, way: [f64; 3], scale: [f64; 3]) -> String {
    let [x, y, z] = way.map(|v| v * time);
    let [sx, sy, sz] = scale.map(|s| 1.0 + (s - 1.0) * time);
    format!(
        r#"<scale x="{sx}" y="{sy}" z="{sz}"/><rotate x="0.3" y="1" angle="{}"/>
        <translate x="{x}" y="{y}" z="{z}"/>"#,
        turn * time
    )
}

/// Compares a scene in which `shape` moves with the average of still ones. The shape is given before
/// and after its transform.
fn check_motion(
    what: &str,
    max_depth: i32,
    (before, after, rest): (&str, &str, &str),
    at: impl Fn(f64) -> String,
    spp: u64,
) {
    const SIZE: usize = 16;
    const STILLS: u64 = 32;
    let camera = camera(SIZE as u32, 45.0);
    let scene = |to_world: &str| {
        render::scene(
            max_depth,
            &camera,
            &format!("{before}{to_world}{after}{rest}"),
        )
    };
    let moving = film(
        &scene(&animation(&at(0.0), &at(1.0))),
        Path::new("."),
        spp,
        11,
    );
    let still = |i: u64| {
        let place = at((i as f64 + 0.5) / STILLS as f64);
        let to_world = format!(r#"<transform name="to_world">{place}</transform>"#);
        film(&scene(&to_world), Path::new("."), spp / STILLS, 100 + i)
    };
    let stills: Vec<Film> = (0..STILLS).map(still).collect();
    assert_average(&moving, &stills, SIZE, what);
}

const ROOM: &str = r#"<emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-1"/></transform>
    <bsdf type="diffuse"><texture type="checkerboard" name="reflectance"><transform name="to_uv">
    <scale value="6"/></transform></texture></bsdf></shape>"#;

#[test]
fn moving_balls_are_the_average_of_still_ones() {
    for material in ["conductor", "dielectric"] {
        let before = r#"<shape type="sphere"><float name="radius" value="0.4"/>"#;
        let after = format!(r#"<bsdf type="{material}"/></shape>"#);
        let at = |t: f64| step(t, 50.0, [0.5, 0.3, 0.2], [1.0; 3]);
        check_motion(material, 8, (before, &after, ROOM), at, 512);
    }
}

#[test]
fn moving_lights_are_the_average_of_still_ones() {
    let after = r#"<emitter type="area"><rgb name="radiance" value="3"/></emitter></shape>"#;
    // Stretched and turned while it moves: what a solid angle is in its space changes on the way.
    let cases = [
        ("rectangle", r#"<shape type="rectangle">"#, [0.5, 2.0, 1.0]),
        (
            "sphere",
            r#"<shape type="sphere"><float name="radius" value="0.3"/>"#,
            [1.5; 3],
        ),
        ("cube", r#"<shape type="cube">"#, [0.6, 1.4, 0.7]),
    ];
    for (kind, before, scale) in cases {
        let at = |t: f64| {
            let own = if kind == "sphere" { 1.0 } else { 0.3 };
            let away = r#"<translate x="-0.5" z="0.8"/>"#;
            // The rectangle looks down on the floor.
            let turned = r#"<rotate y="1" angle="180"/>"#;
            format!(
                r#"<scale value="{own}"/>{turned}{}{away}"#,
                step(t, 40.0, [1.0, 0.3, -0.5], scale)
            )
        };
        check_motion(kind, 2, (before, after, ROOM), at, 256);
    }
}

/// Solid angles change where a light is stretched: connections to it follow their density at every time.
#[test]
fn connections_to_lights_that_stretch_follow_their_density() {
    let place = |x: f64, angle: f64, scale: [f64; 3]| {
        Transform::translate(DVec3::new(x, 0.2, 2.5))
            * Transform::rotate(DVec3::new(1.0, 0.3, 0.2), 120.0 + angle).unwrap()
            * Transform::scale(DVec3::from(scale)).unwrap()
    };
    let keys = [
        (0.0, place(-0.5, 0.0, [1.5, 0.6, 0.8])),
        (1.0, place(0.7, 60.0, [0.8, 1.2, 0.4])),
    ];
    let one = Transform::IDENTITY;
    let shapes = [
        ("sphere", Geometry::Sphere(Sphere::new(one, false).unwrap())),
        ("disk", Geometry::Disk(Disk::new(one, false))),
        ("cylinder", Geometry::Cylinder(Cylinder::new(one, false))),
        ("rectangle", Geometry::Mesh(Mesh::rectangle(&one, false))),
        ("cube", Geometry::Mesh(Mesh::cube(&one, false))),
    ];
    let alpha = sidak(0.01, shapes.len());
    for ((name, geometry), time) in shapes.into_iter().zip([0.0, 0.3, 0.5, 0.8, 1.0]) {
        let motion = Motion::new(&keys, [0.0, 1.0]).unwrap();
        let group = GroupId(0);
        let places = vec![Placement { group, motion }];
        let world = World::with_places(vec![geometry], &[vec![ShapeId(0)]], places);
        let emitter = Emitter::Area {
            shape: ShapeId(0),
            radiance: Rgb::WHITE,
        };
        let lights = Lights::in_world(vec![emitter], &world, Strategy::Auto);
        let from = Hit {
            time,
            ..shapes::receiver(Vec3::ZERO, Vec3::Z)
        };
        let towards = |d: Vec3| Ray {
            time,
            ..Ray::new(from.p, d)
        };
        let meet = |d: Vec3| world.intersect(&towards(d), false);
        let bounds = world.bounds();
        let check = DirectionCheck {
            name,
            alpha,
            axis: bounds.center().normalize(),
            sin2: f64::from(
                0.25 * bounds.diagonal().length_squared() / bounds.center().length_squared(),
            ),
        };
        check.run(
            |rng| {
                let s = lights.sample(world.geometries(), &from, rng.f32(), rng.vec2())?;
                let Density::PerSr(pdf) = s.density else {
                    panic!("{name}: a delta density");
                };
                // The density of the direction is that of the sample.
                let met = meet(s.wi).filter(|m| m.p.distance(s.end.unwrap().p) < 1e-4);
                if let Some(met) = met.filter(|m| m.wo.dot(m.ng) > 0.1) {
                    let again = lights.pdf(world.geometries(), &from, &met);
                    assert!((again / pdf - 1.0).abs() < 2e-3, "{name}: {again} {pdf}");
                }
                Some((s.wi, pdf))
            },
            |d| meet(d).is_some_and(|m| !lights.le(&m).is_black()),
        );
    }
}

fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("moving_{test}"));
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// A wavy sheet at a time, as PLY: its middle rises, its waves grow, its normals follow.
fn sheet(time: f64) -> String {
    const N: usize = 8;
    let point = |i: usize, j: usize, t: f64| {
        let (x, y) = (
            2.0 * i as f64 / N as f64 - 1.0,
            2.0 * j as f64 / N as f64 - 1.0,
        );
        let z = t * (0.6 * (1.0 - x * x) * (1.0 - y * y) + 0.1 * (5.0 * x).sin());
        DVec3::new(x + 0.2 * t, y, z - 0.3)
    };
    let normal = |i: usize, j: usize, t: f64| {
        let (a, b) = (i.max(1) - 1, (i + 1).min(N));
        let (c, d) = (j.max(1) - 1, (j + 1).min(N));
        let (du, dv) = (
            point(b, j, t) - point(a, j, t),
            point(i, d, t) - point(i, c, t),
        );
        du.cross(dv).normalize()
    };
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        (N + 1) * (N + 1),
        2 * N * N
    );
    for j in 0..=N {
        for i in 0..=N {
            let p = point(i, j, 0.0).lerp(point(i, j, 1.0), time);
            let n = normal(i, j, 0.0).lerp(normal(i, j, 1.0), time);
            text += &format!("{} {} {} {} {} {}\n", p.x, p.y, p.z, n.x, n.y, n.z);
        }
    }
    for k in 0..N * N {
        let a = k / N * (N + 1) + k % N;
        let (b, c, d) = (a + 1, a + N + 2, a + N + 1);
        text += &format!("3 {a} {b} {c}\n3 {a} {c} {d}\n");
    }
    text
}

#[test]
fn deforming_meshes_are_the_average_of_still_ones() {
    const SIZE: usize = 16;
    const STILLS: u64 = 32;
    let dir = folder("sheet");
    fs::write(dir.join("0.ply"), sheet(0.0)).unwrap();
    fs::write(dir.join("1.ply"), sheet(1.0)).unwrap();
    let scene = |file: &str, more: &str| {
        let content = format!(
            r#"<shape type="ply"><string name="filename" value="{file}"/>{more}<bsdf type="twosided">
            <bsdf type="roughconductor"><float name="alpha" value="0.2"/></bsdf></bsdf></shape>{ROOM}"#
        );
        render::scene(4, &camera(SIZE as u32, 45.0), &content)
    };
    let end = r#"<string name="filename_end" value="1.ply"/>"#;
    let moving = film(&scene("0.ply", end), &dir, 512, 3);
    let still = |i: u64| {
        let name = format!("still{i}.ply");
        fs::write(dir.join(&name), sheet((i as f64 + 0.5) / STILLS as f64)).unwrap();
        film(&scene(&name, ""), &dir, 512 / STILLS, 200 + i)
    };
    let stills: Vec<Film> = (0..STILLS).map(still).collect();
    assert_average(&moving, &stills, SIZE, "sheet");
    // Nothing to do: the same file twice is a still mesh, bit for bit.
    let same = r#"<string name="filename_end" value="0.ply"/>"#;
    let mean = |more: &str| film(&scene("0.ply", more), &dir, 2, 4).mean();
    assert_eq!(mean(same), mean(""));
}

#[test]
fn no_ray_leaves_a_closed_mesh_while_it_deforms() {
    let turn = Transform::rotate(DVec3::new(1.0, 2.0, 3.0), 35.0).unwrap();
    let stretch = Transform::scale(DVec3::new(0.4, 2.0, 1.0)).unwrap();
    let cube = |t: &Transform| {
        // One vertex per corner, so that neighbours share their edges.
        let mut corners: Vec<Vec3> = Vec::new();
        let mesh = Mesh::cube(&Transform::IDENTITY, false);
        let mut indices = mesh.indices().to_vec();
        for i in indices.iter_mut().flatten() {
            let p = mesh.positions()[*i as usize];
            let known = corners.iter().position(|&q| q == p);
            *i = known.unwrap_or(corners.len()) as u32;
            if known.is_none() {
                corners.push(p);
            }
        }
        let corners = corners
            .iter()
            .map(|p| t.point(p.as_dvec3()).as_vec3())
            .collect();
        Mesh::new(corners, vec![], vec![], indices, false).unwrap()
    };
    let deforming = Deforming::new(cube(&Transform::IDENTITY), cube(&(turn * stretch))).unwrap();
    let (open, close) = (cube(&Transform::IDENTITY), cube(&(turn * stretch)));
    let world = World::new(vec![Geometry::Deforming(deforming)]);
    let mut rng = Rng::new(9);
    for i in 0..200_000 {
        let time = rng.f32();
        // At corners and edges.
        let tri = open.indices()[(rng.f32() * 12.0) as usize];
        let at = |k: usize| {
            let i = tri[k % 3] as usize;
            open.positions()[i].lerp(close.positions()[i], time)
        };
        let w = if i % 2 == 0 { 0.0 } else { rng.f32() };
        let k = (rng.f32() * 3.0) as usize;
        let to = at(k).lerp(at(k + 1), w);
        let o = Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 0.2 - 0.1;
        let ray = Ray {
            time,
            ..Ray::new(o, (to - o).normalize())
        };
        let hit = world.intersect(&ray, false).expect("a ray leaks");
        assert!(world.occluded(&ray));
        assert!((hit.p - to).length() < 1e-4 * to.length(), "{hit:?} {to}");
        // Leaving outwards it does not meet what it leaves.
        let out = hit.ng * hit.ng.dot(to).signum();
        assert!(!world.occluded(&hit.spawn(out)), "{hit:?}");
    }
}

/// A moving thing at any time is met where the still one is that stands there, in however many boxes.
#[test]
fn hits_at_any_time_are_those_of_a_still_shape() {
    let t = |x: f64, angle: f64| {
        let turn = Transform::rotate(DVec3::new(0.2, 1.0, 0.4), angle).unwrap();
        Transform::translate(DVec3::new(x, 0.1 * x, 0.0)) * turn
    };
    // Out of the shutter's times on both sides, with a bend.
    let keys = [
        (-0.5, t(-30.0, 0.0)),
        (0.3, t(1.0, 80.0)),
        (2.0, t(20.0, 200.0)),
    ];
    let motion = Motion::new(&keys, [0.0, 1.0]).unwrap();
    let shapes = || {
        let cube = Mesh::cube(&Transform::scale(DVec3::splat(0.4)).unwrap(), false);
        let ball = Sphere::new(Transform::translate(DVec3::Y), false).unwrap();
        vec![Geometry::Mesh(cube), Geometry::Sphere(ball)]
    };
    let world = |motion: Motion| {
        let group = GroupId(0);
        let place = Placement { group, motion };
        World::with_places(shapes(), &[vec![ShapeId(0), ShapeId(1)]], vec![place])
    };
    let moving = world(motion.clone());
    assert!(moving.moving().1 >= 8, "{:?}", moving.moving());
    let mut rng = Rng::new(4);
    let (mut met, edges) = (0, [0.0, 1.0, 0.5, 1.0 / 32.0]);
    for i in 0..4000 {
        let time = match i % 8 {
            0 => edges[i / 8 % 4],
            _ => rng.f32(),
        };
        let at = motion.at(time);
        let still = world(Motion::still(at));
        let middle = at.point(DVec3::ZERO).as_vec3();
        let mut v = || Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 2.0 - 1.0;
        let (o, to) = (middle + v() * 5.0, middle + v() * 1.5);
        let ray = Ray {
            time,
            ..Ray::new(o, (to - o).normalize())
        };
        let (a, b) = (moving.intersect(&ray, true), still.intersect(&ray, true));
        assert_eq!(format!("{a:?}"), format!("{b:?}"));
        assert_eq!(moving.occluded(&ray), a.is_some());
        met += usize::from(a.is_some());
    }
    assert!(met > 1000, "{met}");
}

//! Facets and patches against the surfaces that rays meet.

use crate::rooms::*;
use luxel::geom::{Hit, Ray};
use luxel::math::{Vec2, Vec3};
use luxel::radiosity::{PatchMesh, Surfaces, mesh};
use luxel::sampler::{Sampler, SamplerKind};
use luxel::scene::Scene;
use std::f64::consts::PI;
use std::path::PathBuf;
use std::sync::Arc;

const CURVE_ERROR: f64 = 0.01;

fn divided(scene: &Scene, size: f64) -> PatchMesh {
    PatchMesh::uniform(scene, Arc::new(Surfaces::new(scene, CURVE_ERROR)), size)
}

/// Rays from all around through the ball of radius 1 about the origin, and what they meet.
fn hits(scene: &Scene, radius: f32) -> Vec<Hit> {
    let ray = |i: u64| {
        let sampler = Sampler::new(SamplerKind::Independent, 5, 0, i, 1);
        let ([a, b, c, d], [e, f, ..]) = (sampler.get4(0), sampler.get4(1));
        let at = |u, v| luxel::math::warp::uniform_sphere(Vec2::new(u, v));
        let from = at(a, b) * radius * 3.0;
        let to = at(c, d) * radius * e.max(f);
        Ray::new(from, (to - from).normalize())
    };
    (0..4000).filter_map(|i| scene.intersect(&ray(i))).collect()
}

/// Every hit lies on the patch that is found for it, up to the error of curves.
#[track_caller]
fn assert_located(scene: &Scene, mesh: &PatchMesh, hits: &[Hit], radius: f64) {
    assert!(hits.len() > 200, "{}", hits.len());
    for hit in hits {
        let Some(found) = mesh.locate(hit) else {
            let albedo = luxel::radiosity::optics::at(scene, hit, 0.5).albedo;
            assert_eq!(albedo.max_element(), 0.0, "nothing found at {hit:?}");
            continue;
        };
        let piece = &mesh.patches[found.patch as usize].piece;
        assert!(piece.outline.contains(found.st));
        let off = piece.at(found.st).distance(hit.p.as_dvec3());
        let rounding = 4e-6 * (1.0 + f64::from(hit.p.length()));
        // Besides its height over the facet, what a curve covers beyond the facet's edges comes to their nearest
        // place: together less than 2 errors.
        assert!(
            off <= 2.0 * CURVE_ERROR * radius + rounding,
            "{off} {hit:?}"
        );
        let back = mesh.hit(scene, found.patch, found.st);
        let off = f64::from(back.p.distance(hit.p));
        assert!(
            off <= 3.0 * CURVE_ERROR * radius + rounding,
            "{off} back at {hit:?}"
        );
        assert_eq!(back.shape, hit.shape);
        // The same side.
        let front = piece.normal().as_vec3();
        assert!(
            front.dot(back.wo) > 0.0 && (back.wo.dot(back.ng) > 0.0) == (hit.wo.dot(hit.ng) > 0.0)
        );
    }
}

#[test]
fn rays_find_the_patches_they_meet() {
    let two = format!("<bsdf type='twosided'>{}</bsdf>", diffuse(0.5));
    let place = "<rotate x='1' y='2' angle='30'/><translate x='0.1' y='0.2'/>";
    for (kind, more, area, radius) in [
        ("cube", diffuse(0.5), 24.0, 0.0),
        ("cube", two.clone(), 48.0, 0.0),
        ("rectangle", two.clone(), 8.0, 0.0),
        ("disk", two.clone(), 2.0 * PI, 1.0),
        ("sphere", diffuse(0.5), 4.0 * PI, 1.0),
        ("cylinder", two.clone(), 4.0 * PI, 1.0),
    ] {
        let scene = scene(&shape(kind, place, &more));
        for size in [f64::INFINITY, 0.3, 0.07] {
            let mesh = divided(&scene, size);
            assert_eq!(mesh.len() as u64, mesh::count(&mesh.surfaces, size));
            let share = mesh.area() / area;
            // Inscribed: always less, by at most twice the error in each of two directions.
            assert!(
                share <= 1.0 + 1e-6 && share > 1.0 - 4.0 * CURVE_ERROR,
                "{kind} {share}"
            );
            assert!(radius > 0.0 || share > 1.0 - 1e-6, "{kind} {share}");
            assert_located(&scene, &mesh, &hits(&scene, 1.5), radius);
        }
    }
}

#[test]
fn instances_have_patches_of_their_own() {
    let group = format!(
        "<shape type='shapegroup' id='g'>{}{}</shape>",
        shape("sphere", "<scale value='0.5'/>", &diffuse(0.4)),
        shape(
            "cube",
            "<scale value='0.3'/><translate x='1'/>",
            &diffuse(0.6)
        ),
    );
    let instance = |place: &str| shape("instance", place, "<ref id='g'/>");
    let body = group
        + &instance("<translate x='-1.2'/>")
        + &instance("<rotate z='1' angle='70'/><scale value='0.7'/><translate y='0.8'/>");
    let scene = scene(&body);
    let mesh = divided(&scene, 0.2);
    let one = 4.0 * PI * 0.25 + 24.0 * 0.09;
    let share = mesh.area() / (one * 1.49);
    assert!(share < 1.0 && share > 1.0 - 4.0 * CURVE_ERROR, "{share}");
    assert_located(&scene, &mesh, &hits(&scene, 2.0), 0.5);
}

/// A file in the folder of the tests.
pub fn file(name: &str, text: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).unwrap();
    path
}

pub fn obj(path: &std::path::Path, more: &str) -> String {
    let path = path.display();
    format!("<shape type='obj'><string name='filename' value='{path}'/>{more}</shape>")
}

#[test]
fn quads_of_meshes_are_one_facet_and_others_two() {
    // A square, a kite, a lone triangle, one without area.
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 3 -0.3 0\nv 4 0 0\nv 3 1 0\n\
                v 0 2 0\nv 1 2 0\nv 0 3 0.5\nf 1 2 3 4\nf 5 6 7 8\nf 9 10 11\nf 1 2 2\n";
    let path = file("radiosity_quads.obj", text);
    let scene = scene(&obj(&path, &diffuse(0.5)));
    let surfaces = Surfaces::new(&scene, CURVE_ERROR);
    assert_eq!(surfaces.facets().len(), 4);
    let mesh = divided(&scene, 0.2);
    let area = 1.0 + 1.3 + 0.5 * 1.25f64.sqrt();
    assert!((mesh.area() / area - 1.0).abs() < 1e-6, "{}", mesh.area());
    let down = |x: f32, y: f32| Ray::new(Vec3::new(x, y, 9.0), -Vec3::Z);
    let center = scene.center().as_vec3();
    let all: Vec<Hit> = (0..2500)
        .filter_map(|i| {
            let (x, y) = ((i % 50) as f32 / 12.0, (i / 50) as f32 / 14.0 - 0.3);
            scene.intersect(&down(x - center.x, y - center.y))
        })
        .collect();
    assert_located(&scene, &mesh, &all, 0.0);
}

#[test]
fn textures_are_averaged() {
    let checker = "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'>\
                   <rgb name='color0' value='0.2, 0.4, 0'/><rgb name='color1' value='0.6, 0, 0.8'/>\
                   <transform name='to_uv'><scale value='4'/></transform></texture></bsdf>";
    let scene = scene(&shape("rectangle", "", checker));
    let whole = divided(&scene, f64::INFINITY);
    assert_eq!(whole.len(), 1);
    let off = whole.patches[0].albedo - luxel::radiosity::Rgb64::new(0.4, 0.2, 0.4);
    assert!(
        off.abs().max_element() < 0.03,
        "{}",
        whole.patches[0].albedo
    );
    // A patch per square: each has one of both colours.
    let fine = divided(&scene, 0.25);
    assert_eq!(fine.len(), 64);
    let colours = fine.patches.iter().map(|p| p.albedo.x);
    assert!(
        colours
            .into_iter()
            .all(|x| (x - 0.2).abs() < 1e-6 || (x - 0.6).abs() < 1e-6)
    );
    let at = |x: f64, y: f64| {
        fine.patches.iter().find(|p| {
            p.piece
                .outline
                .contains(p.piece.locate(luxel::math::DVec3::new(x, y, 0.0)))
        })
    };
    assert!(at(0.1, 0.1).unwrap().albedo != at(0.35, 0.1).unwrap().albedo);
}

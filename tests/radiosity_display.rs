//! Interpolation between patches: exact where it says so, continuous, without T-vertices.

mod common;
#[path = "common/patches.rs"]
mod patches;
#[path = "common/render.rs"]
mod render;

use common::Rng;
use luxel::math::{DVec2, DVec3};
use luxel::radiosity::discontinuity::{self, Limits};
use luxel::radiosity::{Display, Located, Outline, PatchMesh, Rgb64, Surfaces};
use luxel::scene::Scene;
use patches::{BOX, FLOOR, FLOOR_OF_PARTS, SPHERE, center_values, mesh_of, split};
use std::collections::HashMap;
use std::sync::Arc;

/// Meshes of all kinds of surfaces, even and divided at random.
fn meshes() -> Vec<(&'static str, Scene, PatchMesh)> {
    let mut all = Vec::new();
    for (name, xml) in [
        ("floor", FLOOR),
        ("parts", FLOOR_OF_PARTS),
        ("box", BOX),
        ("sphere", SPHERE),
    ] {
        for seed in 0..4 {
            let (scene, mut mesh) = mesh_of(xml, if seed == 0 { 0.4 } else { 0.9 }, 1.0);
            if seed > 0 {
                split(&scene, &mut mesh, seed, 4);
            }
            all.push((name, scene, mesh));
        }
    }
    all
}

#[test]
fn constants_are_kept() {
    for (name, scene, mesh) in meshes() {
        let display = Display::new(&scene, &mesh);
        let c = Rgb64::new(0.3, 7.0, 1e-9);
        let values = display.vertex_values(&vec![c; mesh.len()]);
        let mut rng = Rng::new(1);
        for patch in 0..mesh.len() as u32 {
            let st = mesh.patches[patch as usize]
                .piece
                .outline
                .sample(rng.vec2().as_dvec2());
            let at = display.at(&mesh, &values, Located { patch, st });
            assert!(((at / c) - 1.0).abs().max_element() < 1e-14, "{name}");
        }
    }
}

/// 3 + 2 x - z, as a value per patch, away from the border.
#[test]
fn linear_functions_are_kept_inside() {
    for (name, scene, mesh) in meshes().into_iter().take(8) {
        let f = |p: DVec3| Rgb64::splat(3.0 + 2.0 * p.x - p.z);
        let display = Display::new(&scene, &mesh);
        let values = display.vertex_values(&center_values(&mesh, f));
        let inside = |p: DVec3| p.x.abs().max(p.z.abs()) < 1.0 - 1e-6;
        let (mut seen, mut kept) = (0, 0);
        for patch in 0..mesh.len() as u32 {
            let ring = display.ring(patch);
            if !ring
                .clone()
                .all(|(v, _)| inside(display.vertices()[v as usize].position))
            {
                continue;
            }
            for st in [
                DVec2::new(0.1, 0.2),
                DVec2::new(0.3, 0.6),
                DVec2::new(0.5, 0.5),
            ] {
                let p = mesh.patches[patch as usize].piece.at(st);
                let at = display.at(&mesh, &values, Located { patch, st });
                seen += 1;
                kept += u32::from((at - f(p)).abs().max_element() < 1e-9);
            }
        }
        // Beside a triangle up to 16 times as long the middles may not surround a vertex.
        let most = match name {
            "floor" => seen,
            _ => seen * 4 / 5,
        };
        assert!(kept >= most, "{name}: {kept} of {seen}");
        assert!(seen > 20, "{name}: {seen}");
    }
}

/// Along each edge that two patches of a smooth surface share in whole or in part, both sides say the same.
#[test]
fn values_do_not_jump_across_edges() {
    for (name, scene, mesh) in meshes() {
        let display = Display::new(&scene, &mesh);
        let mut rng = Rng::new(5);
        let random: Vec<Rgb64> = (0..mesh.len())
            .map(|_| Rgb64::new(rng.f32().into(), rng.f32().into(), 1.0))
            .collect();
        let values = display.vertex_values(&random);
        // From an edge to what the sides of it say at a third of it.
        let mut said: HashMap<[u32; 2], Vec<Rgb64>> = HashMap::new();
        for patch in 0..mesh.len() as u32 {
            let ring: Vec<u32> = display.ring(patch).map(|(v, _)| v).collect();
            let piece = &mesh.patches[patch as usize].piece;
            for (i, &a) in ring.iter().enumerate() {
                let b = ring[(i + 1) % ring.len()];
                let [p, q] = [a.min(b), a.max(b)].map(|v| display.vertices()[v as usize].position);
                let st = piece.outline.clamp(piece.locate(p + (q - p) / 3.0));
                let value = display.at(&mesh, &values, Located { patch, st });
                said.entry([a.min(b), a.max(b)]).or_default().push(value);
            }
        }
        let two: Vec<_> = said.values().filter(|v| v.len() == 2).collect();
        assert!(two.len() > mesh.len(), "{name}: {} edges", two.len());
        assert!(said.values().all(|v| v.len() <= 2), "{name}");
        for sides in two {
            assert!(
                (sides[0] - sides[1]).abs().max_element() < 1e-6,
                "{name}: {sides:?}"
            );
        }
    }
}

/// What `locate` finds on both sides of an edge is nearly the same: by hits, over a whole floor.
#[test]
fn values_at_hits_are_continuous() {
    for seed in 1..4 {
        let (scene, mut mesh) = mesh_of(FLOOR_OF_PARTS, 0.9, 1.0);
        split(&scene, &mut mesh, seed, 4);
        let display = Display::new(&scene, &mesh);
        let f = |p: DVec3| Rgb64::splat((3.0 * p.x).sin() + p.z * p.z + 2.0);
        let values = display.vertex_values(&center_values(&mesh, f));
        let step = 2e-4;
        for k in 0..20 {
            let z = -0.95 + 0.0953 * f64::from(k);
            let mut last: Option<Rgb64> = None;
            for i in 0..9_900 {
                let x = -0.99 + step * f64::from(i);
                let from = luxel::math::Vec3::new(x as f32, 1.0, z as f32);
                let ray = luxel::geom::Ray::new(from, -luxel::math::Vec3::Y);
                let located = mesh.locate(&scene.intersect(&ray).unwrap()).unwrap();
                let value = display.at(&mesh, &values, located);
                if let Some(last) = last {
                    let jump = (value - last).abs().max_element();
                    // Slopes are below 40 here; a vertex that is not shared makes jumps of 0.1.
                    assert!(jump < 40.0 * step, "{jump} at {x}, {z}");
                }
                last = Some(value);
            }
        }
    }
}

#[test]
fn no_vertex_lies_on_an_edge() {
    for (name, scene, mesh) in meshes() {
        let display = Display::new(&scene, &mesh);
        let triangles = display.triangles(&mesh, true);
        let at = |v: u32| triangles.vertices[v as usize].position;
        let area: f64 = triangles
            .triangles
            .iter()
            .map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length() / 2.0)
            .sum();
        assert!((area / mesh.area() - 1.0).abs() < 1e-9, "{name}");
        let mut edges: HashMap<[[u64; 3]; 2], i32> = HashMap::new();
        let key = |v: u32| at(v).to_array().map(|x| (x + 0.0).to_bits());
        let mut count = 0;
        for (t, patch) in triangles.triangles.iter().zip(&triangles.patches) {
            let facet = mesh.surfaces.facets()[mesh.patches[*patch as usize].facet as usize];
            assert!(!facet.inside, "{name}: seen from one side");
            for i in 0..3 {
                let (a, b) = (key(t[i]), key(t[(i + 1) % 3]));
                assert_ne!(a, b, "{name}");
                *edges
                    .entry(if a < b { [a, b] } else { [b, a] })
                    .or_default() += if a < b { 1 } else { -1 };
                count += 1;
            }
        }
        let alone: Vec<_> = edges.iter().filter(|(_, n)| **n != 0).collect();
        let on_border = |p: [u64; 3]| {
            let p = p.map(f64::from_bits);
            p[0].abs().max(p[2].abs()) > 1.0 - 1e-6
        };
        match name {
            "floor" | "parts" => {
                assert!(
                    alone.iter().all(|(e, _)| e.iter().all(|p| on_border(*p))),
                    "{name}"
                );
                assert!(alone.len() * 4 < count);
            }
            _ => assert!(alone.is_empty(), "{name}: {} of {count}", alone.len()),
        }
    }
}

#[test]
fn creases_stay_sharp_and_curves_smooth() {
    let (scene, mesh) = mesh_of(BOX, 0.4, 1.0);
    let display = Display::new(&scene, &mesh);
    // Each side has a colour of its own, which stays on it.
    let side = |patch: usize| mesh.patches[patch].piece.normal();
    let values: Vec<Rgb64> = (0..mesh.len()).map(side).collect();
    let shown = display.vertex_values(&values);
    for patch in 0..mesh.len() {
        for (v, _) in display.ring(patch as u32) {
            assert!(shown[v as usize].distance(side(patch)) < 1e-6);
            assert!(display.vertices()[v as usize].normal.distance(side(patch)) < 1e-6);
        }
    }
    let (scene, mesh) = mesh_of(SPHERE, 0.4, 1.0);
    let display = Display::new(&scene, &mesh);
    assert!(display.vertices().len() < mesh.len());
    for v in display.vertices() {
        assert!(v.normal.dot(v.position.normalize()) > 0.999, "{v:?}");
    }
}

#[test]
fn size_of_the_world_makes_no_difference() {
    let count = |scale: f64| {
        let (scene, mut mesh) = mesh_of(FLOOR_OF_PARTS, 0.9 * scale, scale);
        split(&scene, &mut mesh, 3, 4);
        let display = Display::new(&scene, &mesh);
        let triangles = display.triangles(&mesh, true);
        (
            mesh.len(),
            triangles.vertices.len(),
            triangles.triangles.len(),
        )
    };
    let expected = count(1.0);
    for scale in [1e-6, 1e-3, 1e3, 1e6] {
        assert_eq!(count(scale), expected, "{scale}");
    }
}

#[test]
fn triangles_and_interpolation_agree() {
    let (scene, mut mesh) = mesh_of(FLOOR_OF_PARTS, 0.9, 1.0);
    split(&scene, &mut mesh, 2, 4);
    let display = Display::new(&scene, &mesh);
    let random = center_values(&mesh, |p| {
        Rgb64::splat((20.0 * p.x).sin() + (17.0 * p.z).cos())
    });
    let values = display.vertex_values(&random);
    let triangles = display.triangles(&mesh, true);
    let shown = display.values(&triangles, &random);
    for (t, &patch) in triangles.triangles.iter().zip(&triangles.patches) {
        let p = &mesh.patches[patch as usize];
        if p.piece.outline == Outline::Parallelogram && display.ring(patch).len() == 4 {
            continue; // bilinear there
        }
        let middle: DVec3 = t
            .iter()
            .map(|&v| triangles.vertices[v as usize].position)
            .sum();
        let mean: Rgb64 = t.iter().map(|&v| shown[v as usize]).sum();
        let st = p.piece.locate(middle / 3.0);
        let at = display.at(&mesh, &values, Located { patch, st });
        assert!((at - mean / 3.0).abs().max_element() < 1e-6);
    }
    let flat = display.triangles(&mesh, false);
    let shown = display.values(&flat, &random);
    for (t, &patch) in flat.triangles.iter().zip(&flat.patches) {
        assert!(
            t.iter()
                .all(|&v| shown[v as usize] == random[patch as usize])
        );
    }
    assert_eq!(flat.triangles.len(), triangles.triangles.len());
}

/// A block on a floor that is divided along its foot: what is dark below it stays there.
#[test]
fn nothing_leaks_across_lines_where_light_jumps() {
    let rectangle = |transform: &str, more: &str| {
        format!(
            r#"<shape type="rectangle"><transform name="to_world">{transform}</transform>{more}</shape>"#
        )
    };
    let shapes = [
        rectangle(r#"<scale value="2"/>"#, ""),
        rectangle(
            r#"<scale value="0.2"/><rotate x="1" angle="180"/><translate z="3"/>"#,
            r#"<emitter type="area"><rgb name="radiance" value="1"/></emitter>"#,
        ),
        r#"<shape type="cube"><transform name="to_world"><scale value="0.37"/>
            <rotate z="1" angle="20"/><translate z="0.37"/></transform></shape>"#
            .to_string(),
    ];
    let xml = render::scene(3, &render::camera(8, 45.0), &shapes.concat());
    let scene = render::compile(&xml).job.scene;
    let surfaces = Arc::new(Surfaces::new(&scene, 0.02));
    let (mesh, _) = discontinuity::mesh(&scene, surfaces, 0.5, &Limits::default());
    let display = Display::new(&scene, &mesh);
    let (sin, cos) = 20f64.to_radians().sin_cos();
    let below = |p: DVec3| {
        let (x, y) = (p.x * cos + p.y * sin, p.y * cos - p.x * sin);
        x.abs().max(y.abs()) < 0.37
    };
    let on_floor = |patch: usize| {
        let piece = &mesh.patches[patch].piece;
        piece.normal().z > 0.9 && piece.center().z.abs() < 1e-4
    };
    let light = center_values(&mesh, |p| if below(p) { Rgb64::ZERO } else { Rgb64::ONE });
    let values = display.vertex_values(&light);
    let [mut dark, mut bright] = [0, 0];
    for patch in (0..mesh.len()).filter(|&p| on_floor(p)) {
        for (v, _) in display.ring(patch as u32) {
            assert!(values[v as usize].distance(light[patch]) < 1e-9);
        }
        match light[patch] == Rgb64::ZERO {
            true => dark += 1,
            false => bright += 1,
        }
    }
    assert!(dark > 1 && bright > 20, "{dark} {bright}");
}

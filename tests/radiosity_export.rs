//! Meshes that other programs read: glTF, OBJ, PLY.

mod common;
#[path = "common/patches.rs"]
mod patches;
#[path = "common/render.rs"]
mod render;

use luxel::math::DVec3;
use luxel::radiosity::export::{ColoredMesh, ExportSpec, MeshFormat, Shading, Up};
use luxel::radiosity::{Display, PatchMesh, Rgb64};
use luxel::scene::Scene;
use patches::{BOX, FLOOR_OF_PARTS, SPHERE, center_values, mesh_of, split};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};

const CENTER: DVec3 = DVec3::new(1000.25, -20.0, 3.5);

fn divided(shape: &str) -> (Scene, PatchMesh) {
    let (scene, mut mesh) = mesh_of(shape, 0.9, 1.0);
    split(&scene, &mut mesh, 7, 3);
    (scene, mesh)
}

/// Some radiosity per patch, up to 2 π: a share of what is shown exceeds 1.
fn radiosity(mesh: &PatchMesh) -> Vec<Rgb64> {
    center_values(mesh, |p| {
        Rgb64::new(1.0 + p.x, 0.25, (5.0 * p.z).sin().abs()) * PI
    })
}

fn exported(shape: &str, spec: &ExportSpec) -> (PatchMesh, Vec<Rgb64>, ColoredMesh) {
    let (scene, mesh) = divided(shape);
    let b = radiosity(&mesh);
    let display = Display::new(&scene, &mesh);
    let colored = ColoredMesh::new(&mesh, &display, &b, CENTER, spec);
    (mesh, b, colored)
}

fn area(positions: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    let one = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        (b - a).cross(c - a).length() / 2.0
    };
    triangles.iter().map(one).sum()
}

fn file(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("radiosity_export");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(name)
}

fn from_single(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

#[test]
fn gltf_is_valid_and_holds_the_solution() {
    for (shape, shading) in [
        (FLOOR_OF_PARTS, Shading::Gouraud),
        (FLOOR_OF_PARTS, Shading::Flat),
        (BOX, Shading::Gouraud),
        (SPHERE, Shading::Flat),
    ] {
        let spec = ExportSpec {
            shading,
            exposure: 0.8,
            up: Up::Y,
        };
        let (mesh, b, colored) = exported(shape, &spec);
        let bytes = colored.encode(MeshFormat::Glb, spec.up).unwrap();
        assert!(bytes.len().is_multiple_of(4));
        // Reads and validates.
        let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = blob.unwrap();
        assert_eq!(
            document.extensions_used().collect::<Vec<_>>(),
            ["KHR_materials_unlit"]
        );
        let node = document.default_scene().unwrap().nodes().next().unwrap();
        let (moved, ..) = node.transform().decomposed();
        assert_eq!(from_single(moved), CENTER);
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        assert!(!primitive.material().double_sided());
        let reader = primitive.reader(|_| Some(&blob));
        let positions: Vec<DVec3> = reader.read_positions().unwrap().map(from_single).collect();
        let normals: Vec<DVec3> = reader.read_normals().unwrap().map(from_single).collect();
        let colors = reader.read_colors(0).unwrap().into_rgb_f32();
        let colors: Vec<DVec3> = colors.map(from_single).collect();
        let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
        let triangles: Vec<[u32; 3]> = indices.as_chunks().0.to_vec();
        assert_eq!(positions.len(), normals.len());
        assert_eq!(positions.len(), colors.len());
        assert_eq!(triangles.len(), colored.triangles.len());
        assert!((area(&positions, &triangles) / mesh.area() - 1.0).abs() < 1e-5);
        let bounds = primitive.bounding_box();
        for p in &positions {
            let inside =
                |p: DVec3| p.cmpge(from_single(bounds.min)) & p.cmple(from_single(bounds.max));
            assert!(inside(*p).all());
        }
        assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
        for t in &triangles {
            let [p, q, r] = t.map(|i| positions[i as usize]);
            assert!(
                (q - p).cross(r - p).dot(normals[t[0] as usize]) > 0.0,
                "front"
            );
        }
        assert!(
            colors
                .iter()
                .all(|c| c.max_element() <= 1.0 && c.min_element() >= 0.0)
        );
        // The mean over the area, as far as 1 allows.
        let shown = |b: &Rgb64| (*b * (0.8 / PI)).min(Rgb64::ONE);
        if shading == Shading::Flat {
            let expected: Rgb64 = mesh
                .patches
                .iter()
                .zip(&b)
                .map(|(p, b)| shown(b) * p.area)
                .sum();
            let found: Rgb64 = triangles
                .iter()
                .map(|t| colors[t[0] as usize] * area(&positions, &[*t]))
                .sum();
            assert!(
                (found / expected - 1.0).abs().max_element() < 1e-5,
                "{found} {expected}"
            );
        }
        assert!(colored.clipped > 0.0 && colored.clipped < 0.7);
    }
}

#[test]
fn gltf_turns_a_scene_whose_up_is_z() {
    let (.., colored) = exported(BOX, &ExportSpec::default());
    let bytes = colored.encode(MeshFormat::Glb, Up::Z).unwrap();
    let document = gltf::Gltf::from_slice(&bytes).unwrap().document;
    let node = document.nodes().next().unwrap();
    let m = node
        .transform()
        .matrix()
        .map(|column| column.map(f64::from));
    let turned = |v: DVec3| {
        let row = |i: usize| m[0][i] * v.x + m[1][i] * v.y + m[2][i] * v.z + m[3][i];
        DVec3::new(row(0), row(1), row(2))
    };
    let world = CENTER + DVec3::new(0.5, -1.0, 0.25);
    let found = turned(world - CENTER);
    assert!(
        found.distance(DVec3::new(world.x, world.z, -world.y)) < 1e-4,
        "{found}"
    );
}

#[test]
fn obj_holds_colours_and_places() {
    let (mesh, _, colored) = exported(FLOOR_OF_PARTS, &ExportSpec::default());
    let path = file("parts.obj");
    colored.write(&path, Up::Y).unwrap();
    let (models, _) = tobj::load_obj(&path, &tobj::LoadOptions::default()).unwrap();
    let read = &models[0].mesh;
    let triples = |of: &[f64]| -> Vec<DVec3> {
        of.as_chunks::<3>()
            .0
            .iter()
            .map(|c| DVec3::from_array(*c))
            .collect()
    };
    let (positions, colors) = (triples(&read.positions), triples(&read.vertex_color));
    // The reader numbers vertices as they are used first.
    let triangles = read.indices.as_chunks().0;
    assert_eq!(triangles.len(), colored.triangles.len());
    let written = colored.triangles.as_flattened();
    for (&i, &k) in read.indices.iter().zip(written) {
        let (i, k) = (i as usize, k as usize);
        assert!(positions[i].distance(colored.positions[k] + CENTER) < 1e-9);
        assert!(colors[i].distance(colored.colors[k]) < 1e-6);
    }
    assert!((area(&positions, triangles) / mesh.area() - 1.0).abs() < 1e-9);
    assert_eq!(read.normals.len(), read.positions.len());
}

/// luxel reads what it wrote, as a shape.
#[test]
fn ply_can_be_rendered() {
    let (mesh, _, mut colored) = exported(FLOOR_OF_PARTS, &ExportSpec::default());
    for (name, center) in [("near.ply", DVec3::ZERO), ("far.ply", CENTER)] {
        colored.center = center;
        let path = file(name);
        colored.write(&path, Up::Y).unwrap();
        let shape = format!(
            r#"<shape type="ply"><string name="filename" value="{}"/></shape>"#,
            path.display()
        );
        let scene = render::compile(&render::scene(3, &render::camera(8, 45.0), &shape))
            .job
            .scene;
        assert_eq!(scene.counts().triangles, colored.triangles.len());
        let bounds = scene.world().bounds().diagonal().as_dvec3();
        assert!(
            (bounds - DVec3::new(2.0, 0.0, 2.0)).abs().max_element() < 2e-4,
            "{bounds}"
        );
        // A vertex: place, normal and colour; a face: a count and three numbers.
        let bytes = std::fs::read(&path).unwrap();
        let end = b"end_header\n";
        let header = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let place = if center == DVec3::ZERO { 12 } else { 24 };
        let vertices = colored.positions.len() * (place + 24);
        assert_eq!(
            bytes.len(),
            header + vertices + colored.triangles.len() * 13
        );
        let at = header + place + 12;
        let red = f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!(red, colored.colors[0].x as f32);
    }
    assert!(mesh.len() > 10);
}

#[test]
fn other_files_are_refused_by_name() {
    let (.., colored) = exported(BOX, &ExportSpec::default());
    let error = colored.write(Path::new("mesh.stl"), Up::Y).unwrap_err();
    assert_eq!(
        error.to_string(),
        "cannot write mesh.stl: its name does not end in .glb, .obj or .ply"
    );
    assert_eq!(MeshFormat::of(Path::new("A.GLB")), Some(MeshFormat::Glb));
    assert_eq!(MeshFormat::of(Path::new("glb")), None);
}

#[test]
fn nothing_invalid_is_written() {
    let (scene, mesh) = divided(BOX);
    let display = Display::new(&scene, &mesh);
    let mut b = radiosity(&mesh);
    b[0] = Rgb64::new(f64::NAN, -1.0, 1e300);
    let colored = ColoredMesh::new(&mesh, &display, &b, CENTER, &ExportSpec::default());
    assert!(
        colored
            .colors
            .iter()
            .all(|c| c.is_finite() && c.min_element() >= 0.0)
    );
    for format in [MeshFormat::Glb, MeshFormat::Obj, MeshFormat::Ply] {
        let bytes = colored.encode(format, Up::Y).unwrap();
        if format == MeshFormat::Glb {
            gltf::Gltf::from_slice(&bytes).unwrap();
        }
    }
}

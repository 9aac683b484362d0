//! Patch meshes to try interpolation and export on.
#![allow(dead_code)]

use super::common::Rng;
use luxel::bsdf::{Bsdf, Diffuse};
use luxel::geom::{Geometry, Mesh};
use luxel::material::Material;
use luxel::math::{DVec3, Rgb, Vec3};
use luxel::radiosity::mesh::{Cell, patches};
use luxel::radiosity::{Patch, PatchMesh, Rgb64, Surfaces};
use luxel::scene::{MaterialId, Plan, Scene};
use std::sync::Arc;

/// A square of edge 2 in the plane y = 0.
pub const FLOOR: &str = r#"<shape type="rectangle"><transform name="to_world">
    <scale value="SCALE"/><rotate x="1" angle="-90"/></transform></shape>"#;

/// The same from triangles of several sizes.
pub const FLOOR_OF_PARTS: &str = "parts";

pub const BOX: &str =
    r#"<shape type="cube"><transform name="to_world"><scale value="SCALE"/></transform></shape>"#;

pub const SPHERE: &str =
    r#"<shape type="sphere"><transform name="to_world"><scale value="SCALE"/></transform></shape>"#;

/// Patches of edges up to `size` of a shape of `scale`, in a scene of its own.
pub fn mesh_of(shape: &str, size: f64, scale: f64) -> (Scene, PatchMesh) {
    let scene = match shape {
        FLOOR_OF_PARTS => floor_of_parts(scale as f32),
        _ => {
            let shape = shape.replace("SCALE", &format!("{scale}"));
            let xml = super::render::scene(3, &super::render::camera(8, 45.0), &shape);
            super::render::compile(&xml).job.scene
        }
    };
    let surfaces = Arc::new(Surfaces::new(&scene, 0.02));
    let mesh = PatchMesh::uniform(&scene, surfaces, size);
    (scene, mesh)
}

fn floor_of_parts(scale: f32) -> Scene {
    let corners = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [-1.0, 1.0],
        [0.3, 0.1],
        [-0.2, 0.6],
    ];
    let positions = corners.map(|[x, z]| Vec3::new(x, 0.0, z) * scale).to_vec();
    // Front up; the edges between are shared whole.
    let indices = vec![
        [0, 4, 1],
        [1, 4, 2],
        [4, 5, 2],
        [2, 5, 3],
        [3, 5, 0],
        [0, 5, 4],
    ];
    let mesh = Mesh::new(positions, vec![], vec![], indices, false).unwrap();
    let material = Material::Uniform(Bsdf::Diffuse(Diffuse::new(Rgb::splat(0.5))));
    Scene::new(
        vec![Geometry::Mesh(mesh)],
        vec![MaterialId(0)],
        vec![material],
        vec![],
        DVec3::ZERO,
        Plan::default(),
    )
}

/// Divides patches at random into quarters, again and again.
pub fn split(scene: &Scene, mesh: &mut PatchMesh, seed: u64, levels: u32) {
    let mut rng = Rng::new(seed);
    let mut pieces: Vec<_> = mesh.patches.iter().map(|p| (p.facet, p.piece)).collect();
    let mut depth = vec![0; pieces.len()];
    let mut i = 0;
    while i < mesh.cells.len() {
        if let Cell::Patch(patch) = mesh.cells[i] {
            let (facet, piece) = pieces[patch as usize];
            let level = depth[patch as usize];
            if level < levels && rng.f32() < 0.45 {
                let first = mesh.cells.len() as u32;
                mesh.cells[i] = Cell::Split(first);
                for child in 0..4 {
                    // The first takes the number of the patch.
                    let number = match child {
                        0 => patch,
                        _ => pieces.len() as u32,
                    };
                    match child {
                        0 => {
                            pieces[patch as usize] = (facet, piece.child(0));
                            depth[patch as usize] = level + 1;
                        }
                        _ => {
                            pieces.push((facet, piece.child(child)));
                            depth.push(level + 1);
                        }
                    }
                    mesh.cells.push(Cell::Patch(number));
                }
            }
        }
        i += 1;
    }
    mesh.patches = patches(scene, &mesh.surfaces, &pieces);
}

/// `f` at the middle of each patch.
pub fn center_values(mesh: &PatchMesh, f: impl Fn(DVec3) -> Rgb64) -> Vec<Rgb64> {
    let value = |p: &Patch| f(p.piece.center());
    mesh.patches.iter().map(value).collect()
}

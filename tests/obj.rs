//! The OBJ reader against the crate tobj, on files that both take: any mixture of groups, polygons, index
//! forms, and relative indices.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use luxel::format::mesh_io::{MeshData, read_obj};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// One corner as it is drawn in the picture: place, texture coordinate, normal.
type Corner = ([f64; 3], [f32; 2], [f32; 3]);

/// The corners of all triangles in file order. This is all that both readers must agree on: how they number
/// the vertices is their own affair.
fn ours(mesh: &MeshData) -> Vec<Corner> {
    let at = |i: &u32| {
        let i = *i as usize;
        let uv = mesh.uvs.as_ref().map_or([0.0; 2], |uvs| uvs[i].to_array());
        let n = mesh.normals.as_ref();
        let n = n.map_or([0.0; 3], |normals| normals[i].to_array());
        (mesh.positions[i].to_array(), uv, n)
    };
    mesh.indices.iter().flatten().map(at).collect()
}

fn theirs(path: &PathBuf) -> Vec<Corner> {
    let options = tobj::LoadOptions {
        triangulate: true,
        ..tobj::LoadOptions::default()
    };
    let (models, _) = tobj::load_obj(path, &options).unwrap();
    let corners = models.iter().flat_map(|model| {
        let m = &model.mesh;
        (0..m.indices.len()).map(|i| {
            let p = 3 * m.indices[i] as usize;
            // tobj keeps f64; we round once, so the roundings agree.
            let uv = match m.texcoord_indices.get(i) {
                Some(&t) => [0, 1].map(|c| m.texcoords[2 * t as usize + c] as f32),
                None => [0.0; 2],
            };
            let n = match m.normal_indices.get(i) {
                Some(&n) => [0, 1, 2].map(|c| m.normals[3 * n as usize + c] as f32),
                None => [0.0; 3],
            };
            ([0, 1, 2].map(|c| m.positions[p + c]), uv, n)
        })
    });
    corners.collect()
}

/// A file of up to 12 vertices. Each face has 3 to 6 corners, and indices in one of the four forms for the
/// whole file, counted from the start or back from the end.
fn file() -> impl Strategy<Value = String> {
    let number = || prop_oneof![-1e3..1e3f64, -1e-3..1e-3f64, Just(0.0)];
    let vertices = prop::collection::vec((number(), number(), number()), 3..12);
    let faces = prop::collection::vec(
        (
            prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 3..6),
            0u8..4,
        ),
        1..20,
    );
    (vertices, faces, 0u8..4).prop_map(|(vertices, faces, form)| {
        let mut text = String::new();
        let (uvs, normals) = (form & 1 != 0, form & 2 != 0);
        for (x, y, z) in &vertices {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "v {x} {y:e}\t{z}");
            if uvs {
                let _ = writeln!(text, "vt {y} {z}");
            }
            if normals {
                let _ = writeln!(text, "vn {z} {x} 0.5");
            }
        }
        for (corners, before) in &faces {
            text += ["", "g part\n", "o thing\n", "usemtl red\ns off\n"][usize::from(*before)];
            text += "f";
            for (corner, relative) in corners {
                let n = vertices.len() as i64;
                let i = corner.index(vertices.len()) as i64;
                let i = if *relative { i - n } else { i + 1 };
                let _ = match form {
                    0 => write!(text, " {i}"),
                    1 => write!(text, " {i}/{i}"),
                    2 => write!(text, " {i}//{i}"),
                    _ => write!(text, " {i}/{i}/{i}"),
                };
            }
            text += "\n";
        }
        text
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn agrees_with_tobj(text in file()) {
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("agrees.obj");
        fs::write(&path, &text).unwrap();
        let mesh = read_obj(&path).unwrap();
        prop_assert_eq!(ours(&mesh), theirs(&path));
    }
}

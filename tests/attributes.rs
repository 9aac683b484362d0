//! What meshes carry at vertices and faces, as textures show it.

mod common {
    pub mod render;
}

use std::fs;
use std::path::PathBuf;

use common::render::{camera, picture, scene};

/// A PLY file of a square [-1,1]² in two triangles whose faces carry two colours, and whose vertices carry
/// `heat` equal to their x.
fn square(name: &str, first: &str, second: &str) -> PathBuf {
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property float heat_1\nelement face 2\nproperty list uchar int vertex_indices\n\
         property float red\nproperty float green\nproperty float blue\nend_header\n\
         -1 -1 0 0\n1 -1 0 1\n1 1 0 1\n-1 1 0 0\n3 0 1 2 {first}\n3 0 2 3 {second}\n"
    );
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::write(&path, text).unwrap();
    path
}

/// Two squares, left and right, of one material whose reflectance is an attribute, in a white world.
fn two_squares(attribute: &str, scale: f32) -> Vec<[f64; 3]> {
    let shape = |file: PathBuf, x: f32| {
        format!(
            r#"<shape type="ply"><string name="filename" value="{}"/><ref id="m"/>
            <transform name="to_world"><translate x="{x}"/></transform></shape>"#,
            file.display()
        )
    };
    let name = |side: &str| format!("square_{attribute}_{side}.ply");
    let content = format!(
        r#"<bsdf type="diffuse" id="m"><texture type="mesh_attribute" name="reflectance">
            <string name="name" value="{attribute}"/><float name="scale" value="{scale}"/>
        </texture></bsdf><emitter type="constant"/>{}{}"#,
        shape(square(&name("l"), "0.1 0.2 0.3", "0.4 0.5 0.6"), -1.0),
        shape(square(&name("r"), "0.9 0.8 0.7", "0.6 0.4 0.2"), 1.0)
    );
    // 8 x 8 pixels of a quarter each, seen along -z; only the middle rows show the squares.
    picture(
        &scene(2, &camera(8, 2.0 * 0.5f64.atan().to_degrees()), &content),
        256,
        1,
    )
}

fn close(a: [f64; 3], b: [f64; 3], tolerance: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() < tolerance)
}

#[test]
fn each_mesh_shows_its_own_faces() {
    let p = two_squares("face_color", 0.5);
    // Row 5 lies in y from -0.5 to -1: from x = -2 on, below the diagonal is the first face.
    let at = |x: usize, y: usize| p[y * 8 + x];
    assert!(close(at(3, 5), [0.05, 0.1, 0.15], 0.004), "{:?}", at(3, 5));
    assert!(close(at(0, 2), [0.2, 0.25, 0.3], 0.004), "{:?}", at(0, 2));
    assert!(close(at(7, 5), [0.45, 0.4, 0.35], 0.01), "{:?}", at(7, 5));
    assert!(close(at(4, 2), [0.3, 0.2, 0.1], 0.004), "{:?}", at(4, 2));
}

#[test]
fn vertices_are_interpolated() {
    let p = two_squares("vertex_heat", 1.0);
    for x in 0..4 {
        let heat = (x as f64 + 0.5) / 4.0;
        for column in [x, x + 4] {
            let seen = p[3 * 8 + column];
            assert!(close(seen, [heat; 3], 0.012), "{column} {seen:?}");
        }
    }
}

//! PLY, binary and little-endian, with normals and linear colours as floats that may exceed 1.

use super::{ColoredMesh, single};
use std::fmt::Write;

pub(super) fn encode(mesh: &ColoredMesh) -> Vec<u8> {
    let [low, high] = mesh.bounds();
    // Far from the origin single precision would lose the mesh's details.
    let size = (high - low).max_element();
    let far = mesh.center.abs().max_element() > 16.0 * size;
    let number = if far { "double" } else { "float" };
    let mut text = String::from(
        "ply\nformat binary_little_endian 1.0\ncomment radiosity as radiance, colours linear\n",
    );
    let _ = writeln!(text, "element vertex {}", mesh.positions.len());
    for axis in ["x", "y", "z"] {
        let _ = writeln!(text, "property {number} {axis}");
    }
    for name in ["nx", "ny", "nz", "red", "green", "blue"] {
        let _ = writeln!(text, "property float {name}");
    }
    let _ = writeln!(text, "element face {}", mesh.triangles.len());
    text += "property list uchar uint vertex_indices\nend_header\n";

    let mut out = text.into_bytes();
    let vertices = mesh.positions.iter().zip(&mesh.normals).zip(&mesh.colors);
    for ((p, n), c) in vertices {
        for x in (*p + mesh.center).to_array() {
            match far {
                true => out.extend(x.to_le_bytes()),
                false => out.extend(single(x).to_le_bytes()),
            }
        }
        for x in n.to_array().into_iter().chain(c.to_array()) {
            out.extend(single(x).to_le_bytes());
        }
    }
    for t in &mesh.triangles {
        out.push(3);
        out.extend(t.iter().flat_map(|i| i.to_le_bytes()));
    }
    out
}

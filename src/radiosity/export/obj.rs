//! Wavefront OBJ. Colours follow the coordinates of vertices (`v x y z r g b`): no part of the format, but read by
//! MeshLab, Blender and others. They are linear and may exceed 1.

use super::ColoredMesh;
use std::fmt::Write;

pub(super) fn encode(mesh: &ColoredMesh) -> Vec<u8> {
    let mut text = String::from(
        "# Radiosity as radiance: v x y z r g b, colours linear (sRGB primaries)\no radiosity\n",
    );
    // Writing to a string cannot fail.
    for (p, c) in mesh.positions.iter().zip(&mesh.colors) {
        let p = *p + mesh.center;
        let _ = writeln!(
            text,
            "v {} {} {} {} {} {}",
            p.x, p.y, p.z, c.x as f32, c.y as f32, c.z as f32
        );
    }
    for n in &mesh.normals {
        let _ = writeln!(text, "vn {} {} {}", n.x as f32, n.y as f32, n.z as f32);
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| u64::from(i) + 1);
        let _ = writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}");
    }
    text.into_bytes()
}

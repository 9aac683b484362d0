//! glTF 2.0 in its binary form (Khronos specification 2.0.1, section 4.4: header, JSON, binary data).

use super::{ColoredMesh, Up, single};
use crate::math::DVec3;
use serde_json::{Value, json};

const MAGIC: u32 = 0x4654_6C67;
const VERSION: u32 = 2;
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Parts of the binary data.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Triples of floats per vertex; the accessor's number.
    fn floats(&mut self, values: impl ExactSizeIterator<Item = [f32; 3]>, bounds: bool) -> usize {
        let (offset, count) = (self.bytes.len(), values.len());
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for value in values {
            for (axis, x) in value.into_iter().enumerate() {
                low[axis] = low[axis].min(x);
                high[axis] = high[axis].max(x);
                self.bytes.extend(x.to_le_bytes());
            }
        }
        let mut accessor = json!({ "componentType": FLOAT, "count": count, "type": "VEC3" });
        if bounds {
            // Of what was written, as the specification asks; as f64, which holds them exactly.
            accessor["min"] = json!(low.map(f64::from));
            accessor["max"] = json!(high.map(f64::from));
        }
        self.add(offset, ARRAY_BUFFER, accessor)
    }

    fn indices(&mut self, triangles: &[[u32; 3]]) -> usize {
        let offset = self.bytes.len();
        let all = triangles.as_flattened();
        self.bytes.extend(all.iter().flat_map(|i| i.to_le_bytes()));
        let accessor =
            json!({ "componentType": UNSIGNED_INT, "count": all.len(), "type": "SCALAR" });
        self.add(offset, ELEMENT_ARRAY_BUFFER, accessor)
    }

    fn add(&mut self, offset: usize, target: u32, mut accessor: Value) -> usize {
        let length = self.bytes.len() - offset;
        self.views.push(json!({
            "buffer": 0, "byteOffset": offset, "byteLength": length, "target": target,
        }));
        accessor["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

pub(super) fn encode(mesh: &ColoredMesh, up: Up) -> Result<Vec<u8>, String> {
    let triples = |of: &[DVec3]| {
        of.iter()
            .map(|v| v.to_array().map(single))
            .collect::<Vec<_>>()
    };
    let clamped: Vec<[f32; 3]> = mesh
        .colors
        .iter()
        .map(|c| c.clamp(DVec3::ZERO, DVec3::ONE).to_array().map(single))
        .collect();
    let mut buffer = Buffer::default();
    let attributes = json!({
        "POSITION": buffer.floats(triples(&mesh.positions).into_iter(), true),
        "NORMAL": buffer.floats(triples(&mesh.normals).into_iter(), false),
        "COLOR_0": buffer.floats(clamped.into_iter(), false),
    });
    let indices = buffer.indices(&mesh.triangles);
    let text = json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("luxel ", env!("CARGO_PKG_VERSION")),
        },
        // The light is in the colours: a viewer shall add none.
        "extensionsUsed": ["KHR_materials_unlit"],
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [node(mesh, up)],
        "meshes": [{
            "name": "radiosity",
            "primitives": [{
                "attributes": attributes, "indices": indices, "material": 0, "mode": 4,
            }],
        }],
        // For viewers that do not know the extension: white and rough, as it advises.
        "materials": [{
            "name": "radiosity",
            "doubleSided": false,
            "pbrMetallicRoughness": {
                "baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "roughnessFactor": 1,
            },
            "extensions": { "KHR_materials_unlit": {} },
        }],
        "buffers": [{ "byteLength": buffer.bytes.len() }],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    });
    container(text.to_string().into_bytes(), buffer.bytes)
}

/// Where the mesh stands: coordinates are small, relative to a centre that may be far away.
fn node(mesh: &ColoredMesh, up: Up) -> Value {
    let mut node = json!({ "name": "radiosity", "mesh": 0 });
    let DVec3 { x, y, z } = mesh.center;
    let center = match up {
        Up::Y => [x, y, z],
        Up::Z => {
            // A quarter turn about x brings z up to y.
            let half = std::f64::consts::FRAC_1_SQRT_2;
            node["rotation"] = json!([-half, 0.0, 0.0, half]);
            [x, z, -y]
        }
    };
    if center != [0.0; 3] {
        node["translation"] = json!(center);
    }
    node
}

/// Both chunks in their container, each padded to multiples of four bytes.
fn container(mut text: Vec<u8>, mut data: Vec<u8>) -> Result<Vec<u8>, String> {
    text.resize(text.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let length = 12 + 8 + text.len() + 8 + data.len();
    let size = |n: usize| {
        u32::try_from(n)
            .map_err(|_| "glTF files end at 4 GiB: make patches larger, or write .ply".to_string())
    };
    let mut out = Vec::with_capacity(length);
    for word in [MAGIC, VERSION, size(length)?, size(text.len())?, JSON] {
        out.extend(word.to_le_bytes());
    }
    out.extend(text);
    for word in [size(data.len())?, BIN] {
        out.extend(word.to_le_bytes());
    }
    out.extend(data);
    Ok(out)
}

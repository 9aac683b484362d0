//! Readers of mesh files: Wavefront OBJ, PLY and Mitsuba's serialized meshes, into plain arrays;
//! and of the grids that stand for a shape.
//!
//! Positions stay in f64, since the scene is moved to its centre only later. What is wrong with a
//! file is told with its name and, for text, its line. Nothing is allocated on the word of a header
//! alone: declared counts are held against the bytes that are there.

mod attributes;
mod obj;
mod ply;
mod ply_header;
mod serialized;
mod vol;

pub use attributes::Attribute;
pub use vol::GridData;

use super::limits;
use crate::math::{DVec3, Vec2, Vec3};
use std::fmt;
use std::io::Read;
use std::path::{Path, PathBuf};

/// A triangle mesh as a file gives it, polygons cut into fans. Never empty, all numbers finite, all
/// indices in range; triangles may still be degenerate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    pub positions: Vec<DVec3>,
    /// Per vertex, of any length; a zero vector for a vertex without, when others have one. `None` asks
    /// for computed normals (they are computed after `to_world`, by the caller).
    pub normals: Option<Vec<Vec3>>,
    /// Per vertex; (0, 0) for a vertex without, when others have one.
    pub uvs: Option<Vec<Vec2>>,
    pub indices: Vec<[u32; 3]>,
    /// Those that were asked for: a value per vertex, or per triangle.
    pub attributes: Vec<Attribute>,
    /// The names of all that there are.
    pub attribute_names: Vec<String>,
}

/// What is wrong with a mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshError {
    pub file: PathBuf,
    /// From 1; `None` where the file has no lines or the error none.
    pub line: Option<usize>,
    pub what: String,
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file.display())?;
        if let Some(line) = self.line {
            write!(f, "{line}:")?;
        }
        write!(f, " {}", self.what)
    }
}

impl std::error::Error for MeshError {}

/// A message and the line it is about.
type Wrong = (Option<usize>, String);

/// Reads a Wavefront OBJ file: `v`, `vt`, `vn`, `f`; other lines are skipped.
pub fn read_obj(path: &Path) -> Result<MeshData, MeshError> {
    read_with(path, |bytes| obj::parse(&bytes))
}

/// Reads a PLY file, ASCII or binary of either byte order, with the attributes of the names `wanted`.
pub fn read_ply(path: &Path, wanted: &[String]) -> Result<MeshData, MeshError> {
    read_with(path, |bytes| ply::parse(&bytes, wanted))
}

/// Reads mesh `index`, from 0, of a file of Mitsuba's serialized meshes, version 3 or 4.
pub fn read_serialized(path: &Path, index: usize) -> Result<MeshData, MeshError> {
    read_with(path, |bytes| serialized::parse(&bytes, index))
}

/// Reads a grid of numbers from a volume file of Mitsuba (`.vol`): one channel of 32-bit floats.
pub fn read_grid(path: &Path) -> Result<GridData, MeshError> {
    let error = |(line, what)| MeshError {
        file: path.to_path_buf(),
        line,
        what,
    };
    let bytes = read_bytes(path).map_err(|what| error((None, what)))?;
    vol::parse(&bytes).map_err(error)
}

fn read_with(
    path: &Path,
    parse: impl FnOnce(Vec<u8>) -> Result<MeshData, Wrong>,
) -> Result<MeshData, MeshError> {
    let error = |(line, what)| MeshError {
        file: path.to_path_buf(),
        line,
        what,
    };
    let bytes = read_bytes(path).map_err(|what| error((None, what)))?;
    let mesh = parse(bytes).map_err(error)?;
    if mesh.indices.is_empty() {
        return Err(error((None, "the mesh has no triangles".into())));
    }
    Ok(mesh)
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, String> {
    let failed = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => "no such file".to_string(),
        _ => format!("cannot read it: {error}"),
    };
    let file = std::fs::File::open(path).map_err(failed)?;
    let size = file.metadata().map_err(failed)?.len();
    if size > limits::MESH_FILE_BYTES {
        let gib = limits::MESH_FILE_BYTES >> 30;
        return Err(format!("it is larger than {gib} GiB"));
    }
    let mut bytes = Vec::with_capacity(size as usize);
    // What is no regular file may hold more than it says.
    file.take(limits::MESH_FILE_BYTES)
        .read_to_end(&mut bytes)
        .map_err(failed)?;
    Ok(bytes)
}

/// Appends the triangles (0, 1, 2), (0, 2, 3), ... of a polygon.
fn push_fan(indices: &mut Vec<[u32; 3]>, polygon: &[u32]) {
    if let [first, rest @ ..] = polygon {
        indices.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    }
}

/// A number of a text file, which must be finite also as the f32 it becomes, where it becomes one.
fn number(word: &[u8]) -> Result<f64, String> {
    let text = std::str::from_utf8(word).unwrap_or("?");
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) => Err(format!("\"{text}\" is not a finite number")),
        Err(_) => Err(format!("\"{}\" is not a number", shown(word))),
    }
}

/// Bytes of a file for a message: short and printable.
fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(40)])
        .chars()
        .map(|c| if c.is_control() { '?' } else { c })
        .collect()
}

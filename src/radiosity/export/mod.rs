//! A solution as a mesh with colours, for other programs: glTF 2.0, OBJ, PLY.
//!
//! A colour is radiance, B/π, times an exposure: linear, of the primaries of sRGB. Each side of a surface that
//! takes part is there, as triangles seen from that side.

mod glb;
mod obj;
mod ply;

use super::display::Display;
use super::{PatchMesh, Rgb64};
use crate::image_io::{self, ImageError};
use crate::math::DVec3;
use std::f64::consts::PI;
use std::path::Path;

/// How values are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    /// One value per patch.
    Flat,
    /// Interpolated between vertices.
    Gouraud,
}

/// Which way is up in the scene. glTF calls it y, and viewers turn about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    Y,
    Z,
}

/// How a mesh is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExportSpec {
    pub shading: Shading,
    /// Colours are multiplied with this. glTF has colours up to 1 only: what is more is written as 1.
    pub exposure: f64,
    /// glTF only: the others keep the coordinates of the scene.
    pub up: Up,
}

impl Default for ExportSpec {
    fn default() -> ExportSpec {
        ExportSpec {
            shading: Shading::Gouraud,
            exposure: 1.0,
            up: Up::Y,
        }
    }
}

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// glTF 2.0 in one binary file.
    Glb,
    /// Wavefront OBJ with colours behind the coordinates of vertices.
    Obj,
    /// PLY, binary.
    Ply,
}

impl MeshFormat {
    /// What the names of files that can be written end in.
    pub const EXTENSIONS: &str = ".glb, .obj or .ply";

    /// By the ending of the file's name; `None` for others than [`MeshFormat::EXTENSIONS`].
    pub fn of(path: &Path) -> Option<MeshFormat> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "glb" => Some(MeshFormat::Glb),
            "obj" => Some(MeshFormat::Obj),
            "ply" => Some(MeshFormat::Ply),
            _ => None,
        }
    }
}

/// A mesh of triangles with a colour per vertex.
#[derive(Clone, Debug)]
pub struct ColoredMesh {
    /// Relative to `center`, in scene units.
    pub positions: Vec<DVec3>,
    /// Of unit length.
    pub normals: Vec<DVec3>,
    /// Linear; zero or more.
    pub colors: Vec<Rgb64>,
    /// Counter-clockwise from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Where the origin of the positions lies in the world.
    pub center: DVec3,
    /// Share of the area of patches whose colour exceeds 1 in some channel.
    pub clipped: f64,
}

impl ColoredMesh {
    /// `radiosity` holds B in W/m² of each patch of `mesh`, `display` was made of the mesh, and `center` is that of
    /// the scene. Values that are negative or no numbers become 0.
    pub fn new(
        mesh: &PatchMesh,
        display: &Display,
        radiosity: &[Rgb64],
        center: DVec3,
        spec: &ExportSpec,
    ) -> ColoredMesh {
        let color = |b: &Rgb64| (*b * (spec.exposure / PI)).map(|x| if x > 0.0 { x } else { 0.0 });
        let colors: Vec<Rgb64> = radiosity.iter().map(color).collect();
        let bright = mesh.patches.iter().zip(&colors);
        let bright = bright.filter(|(_, c)| c.max_element() > 1.0);
        let bright: f64 = bright.map(|(p, _)| p.area).sum();
        let triangles = display.triangles(mesh, spec.shading == Shading::Gouraud);
        let positions: Vec<DVec3> = triangles.vertices.iter().map(|v| v.position).collect();
        let has_area = |corners: &[u32; 3]| !is_flat(corners.map(|i| positions[i as usize]));
        let with_area = triangles.triangles.iter().copied().filter(has_area);
        let with_area: Vec<[u32; 3]> = with_area.collect();
        ColoredMesh {
            positions,
            normals: triangles.vertices.iter().map(|v| v.normal).collect(),
            colors: display.values(&triangles, &colors),
            triangles: with_area,
            center,
            clipped: bright / mesh.area(),
        }
    }

    /// Least and greatest coordinates, relative to the centre.
    pub fn bounds(&self) -> [DVec3; 2] {
        let empty = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let grow = |[low, high]: [DVec3; 2], p: &DVec3| [low.min(*p), high.max(*p)];
        self.positions.iter().fold(empty, grow)
    }

    /// The file's bytes.
    ///
    /// # Errors
    /// A mesh that the format cannot hold, in words.
    pub fn encode(&self, format: MeshFormat, up: Up) -> Result<Vec<u8>, String> {
        match format {
            MeshFormat::Glb => glb::encode(self, up),
            MeshFormat::Obj => Ok(obj::encode(self)),
            MeshFormat::Ply => Ok(ply::encode(self)),
        }
    }

    /// Writes a file of the kind that its name ends in, complete or not at all.
    ///
    /// # Errors
    /// As [`image_io::write_atomic`]; names that end in something else; meshes that the format cannot hold.
    pub fn write(&self, path: &Path, up: Up) -> Result<(), ImageError> {
        let fault = |what: String| ImageError::Write {
            path: path.to_path_buf(),
            what,
        };
        let format = MeshFormat::of(path).ok_or_else(|| {
            fault(format!(
                "its name does not end in {}",
                MeshFormat::EXTENSIONS
            ))
        })?;
        let bytes = self.encode(format, up).map_err(fault)?;
        image_io::write_atomic(path, &bytes)
    }
}

/// Whether a triangle has no area in single precision, as slivers between the edges of shadows: its neighbours meet
/// there without it.
fn is_flat(corners: [DVec3; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.as_vec3().as_dvec3());
    (b - a).cross(c - a).length_squared() <= 0.0
}

/// In single precision, finite: what is too large becomes the largest.
fn single(x: f64) -> f32 {
    x.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

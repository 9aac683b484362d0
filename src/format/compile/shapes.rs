//! Shapes: files are read and placed in the coordinates of the world, or of a group, in f64; only when
//! their centre is known are coordinates rounded, relative to it.

use std::sync::Arc;

use crate::format::mesh_io::{self, MeshData};
use crate::format::plugins::Category;
use crate::format::{Props, SceneError};
use crate::geom::{Cylinder, Deforming, Disk, Geometry, Mesh, Sdf, SdfGrid, Sphere};
use crate::math::{DVec3, Transform, Vec3};

use super::attributes::{self, Attributes};
use super::{out_of_reach, within_reach};

/// A shape whose place in the world, or in its group, is known but not yet rounded.
pub struct Source<'a> {
    props: Props<'a>,
    kind: Kind,
    to_world: Transform,
    flip_normals: bool,
}

enum Kind {
    /// `smooth`: compute vertex normals, as the file has none.
    Mesh {
        data: MeshData,
        smooth: bool,
        /// The same mesh when the shutter closes.
        end: Option<Box<MeshData>>,
    },
    Rectangle,
    Cube,
    Sphere,
    Disk,
    Cylinder,
    Sdf {
        grid: Arc<SdfGrid>,
        smooth: bool,
    },
}

impl<'a> Source<'a> {
    pub fn props(&self) -> &Props<'a> {
        &self.props
    }
}

/// Reads one shape, its file included. `to_world` takes it to the world, or to the coordinates of its
/// group. Where no time passes while the shutter is open, what a mesh becomes meanwhile is left out.
pub fn read<'a>(
    props: &Props<'a>,
    mut to_world: Transform,
    time_passes: bool,
) -> Result<Source<'a>, SceneError> {
    // Of no use without derivatives.
    props.ignore(&["silhouette_sampling_weight"]);
    let kind = match props.plugin() {
        "rectangle" | "cube" => {
            // Flat faces have the same normals either way.
            props.ignore(&["face_normals"]);
            if props.plugin() == "cube" {
                Kind::Cube
            } else {
                Kind::Rectangle
            }
        }
        "sphere" => {
            let radius = scale(props, props.float("radius")?)?;
            to_world = to_world * Transform::translate(props.vec3("center")?) * radius;
            Kind::Sphere
        }
        "disk" => Kind::Disk,
        "cylinder" => {
            to_world = to_world * along_axis(props)?;
            Kind::Cylinder
        }
        "sdfgrid" => sdf(props)?,
        _ => mesh(props, &to_world, time_passes)?,
    };
    Ok(Source {
        props: *props,
        kind,
        to_world,
        // The sign of its distances says where a grid has its outside.
        flip_normals: props.plugin() != "sdfgrid" && props.bool("flip_normals")?,
    })
}

fn scale(props: &Props, factor: f64) -> Result<Transform, SceneError> {
    Transform::scale(DVec3::splat(factor))
        .ok_or_else(|| props.error_at("radius", "the radius is too small or too large"))
}

/// The unit cylinder onto the one from `p0` to `p1`.
fn along_axis(props: &Props) -> Result<Transform, SceneError> {
    let (p0, p1, radius) = (props.vec3("p0")?, props.vec3("p1")?, props.float("radius")?);
    let axis = p1 - p0;
    let no_axis = || {
        props.error_at(
            "p1",
            "p0 and p1 are the same point, which gives the cylinder no axis",
        )
    };
    let z = axis.try_normalize().ok_or_else(no_axis)?;
    let (x, y) = z.any_orthonormal_pair();
    // (x, y, z) must be right-handed.
    let (x, y) = if x.cross(y).dot(z) > 0.0 {
        (x, y)
    } else {
        (y, x)
    };
    let (x, y) = (x * radius, y * radius);
    let rows = [
        [x.x, y.x, axis.x, p0.x],
        [x.y, y.y, axis.y, p0.y],
        [x.z, y.z, axis.z, p0.z],
        [0.0, 0.0, 0.0, 1.0],
    ];
    Transform::from_rows(rows)
        .ok_or_else(|| props.error_at("radius", "the radius is too small for the length"))
}

/// A grid of distances from a file.
fn sdf(props: &Props) -> Result<Kind, SceneError> {
    if let Some(emitter) = props.child(Category::Emitter) {
        let error = emitter.error("a \"sdfgrid\" cannot be an emitter");
        return Err(error.with_help("use a mesh of the shape"));
    }
    let wrong = |what: String| props.error_at("filename", what);
    let path = props.file("filename")?;
    let data = mesh_io::read_grid(path).map_err(|e| wrong(e.to_string()))?;
    let grid = SdfGrid::new(data.size, data.values);
    Ok(Kind::Sdf {
        grid: Arc::new(grid.map_err(|what| wrong(format!("{}: {what}", path.display())))?),
        smooth: props.choice("normals")? == "smooth",
    })
}

/// A mesh from a file, and the one that it has become when the shutter closes.
fn mesh(props: &Props, to_world: &Transform, time_passes: bool) -> Result<Kind, SceneError> {
    let data = mesh_file(props, "filename", to_world)?;
    // As in Mitsuba, one normal in the file is enough to compute none: vertices without then count as
    // flat, since a zero normal leaves the face its own.
    let smooth = !props.bool("face_normals")? && data.normals.is_none();
    let end = match props.is_given("filename_end") && time_passes {
        true => Some(Box::new(mesh_file(props, "filename_end", to_world)?)),
        false => None,
    };
    props.ignore(&["filename_end"]);
    Ok(Kind::Mesh { data, smooth, end })
}

/// The mesh in the file that the parameter `name` gives, its positions and normals taken to the world.
fn mesh_file(props: &Props, name: &str, to_world: &Transform) -> Result<MeshData, SceneError> {
    let path = props.file(name)?;
    let flip_v = props.plugin() != "serialized" && props.bool("flip_tex_coords")?;
    let data = match props.plugin() {
        "serialized" => mesh_io::read_serialized(path, props.int("shape_index")? as usize),
        "ply" => mesh_io::read_ply(path, &attributes::wanted(props)),
        _ => mesh_io::read_obj(path),
    };
    let mut data = data.map_err(|e| props.error_at(name, e.to_string()))?;
    for p in &mut data.positions {
        *p = to_world.point(*p);
        if !p.is_finite() {
            return Err(props.error_at("to_world", "the transform takes a vertex to infinity"));
        }
    }
    if flip_v {
        for uv in data.uvs.iter_mut().flatten() {
            uv.y = 1.0 - uv.y;
        }
    }
    if props.bool("face_normals")? {
        data.normals = None;
    }
    for n in data.normals.iter_mut().flatten() {
        *n = to_world.normal(n.as_dvec3()).normalize_or_zero().as_vec3();
    }
    Ok(data)
}

/// Takes out what the meshes carry beside their geometry.
pub fn take_attributes(sources: &mut [Source]) -> Attributes {
    let mut all = Attributes::default();
    for source in sources {
        if let Kind::Mesh { data, .. } = &mut source.kind {
            all.take(&source.props, data);
        }
    }
    all
}

/// Least and greatest coordinates of a shape.
pub fn bounds(source: &Source) -> (DVec3, DVec3) {
    if let Kind::Mesh { data, end, .. } = &source.kind {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let end = end.iter().flat_map(|end| &end.positions);
        return data
            .positions
            .iter()
            .chain(end)
            .fold(start, |(lo, hi), p| (lo.min(*p), hi.max(*p)));
    }
    // A box around every one of the canonical shapes.
    let corner = |i: u32| {
        let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        source.to_world.point(DVec3::new(sign(0), sign(1), sign(2)))
    };
    (0..8)
        .map(corner)
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| {
            (lo.min(p), hi.max(p))
        })
}

/// One shape that is no part of the scene, relative to the scene's centre.
pub fn alone(props: &Props, center: DVec3) -> Result<Geometry, SceneError> {
    let source = read(props, props.transform("to_world")?, false)?;
    let (lo, hi) = bounds(&source);
    if !(within_reach(lo) && within_reach(hi)) {
        return Err(props.error_at("to_world", out_of_reach("a part of the shape")));
    }
    geometry(source, center)
}

/// The shape in f32, relative to `center` of its coordinates.
pub fn geometry(source: Source, center: DVec3) -> Result<Geometry, SceneError> {
    let Source {
        props,
        kind,
        to_world,
        flip_normals,
    } = source;
    let to_scene = Transform::translate(-center) * to_world;
    let refused = |what: &str| {
        props
            .error_at("to_world", what)
            .with_help("use a uniform scale, or a mesh of the shape")
    };
    Ok(match kind {
        Kind::Mesh { data, smooth, end } => {
            let build = |data: MeshData, name: &str| {
                let positions = data.positions.iter();
                let positions: Vec<Vec3> = positions.map(|p| (*p - center).as_vec3()).collect();
                let (normals, uvs) = (
                    data.normals.unwrap_or_default(),
                    data.uvs.unwrap_or_default(),
                );
                let mut mesh = Mesh::new(positions, normals, uvs, data.indices, flip_normals)
                    .map_err(|e| props.error_at(name, e.to_string()))?;
                if smooth {
                    mesh.compute_vertex_normals();
                }
                Ok(mesh)
            };
            let open = build(data, "filename")?;
            match end {
                None => Geometry::Mesh(open),
                Some(end) => deforming(&props, open, build(*end, "filename_end")?)?,
            }
        }
        Kind::Rectangle => Geometry::Mesh(Mesh::rectangle(&to_scene, flip_normals)),
        Kind::Cube => Geometry::Mesh(Mesh::cube(&to_scene, flip_normals)),
        Kind::Sphere => Geometry::Sphere(Sphere::new(to_scene, flip_normals).ok_or_else(|| {
            refused("the transform makes the sphere an ellipsoid, which is not supported")
        })?),
        Kind::Sdf { grid, smooth } => Geometry::Sdf(Sdf::new(grid, to_scene, smooth)),
        Kind::Disk => Geometry::Disk(Disk::new(to_scene, flip_normals)),
        Kind::Cylinder => {
            let cylinder = Cylinder::new(to_scene, flip_normals);
            if !cylinder.is_even() && props.child(Category::Emitter).is_some() {
                return Err(refused(
                    "the transform makes the cylinder elliptic or oblique, which is not supported of an emitter",
                ));
            }
            Geometry::Cylinder(cylinder)
        }
    })
}

/// `open` as it turns into `close` over the shutter.
fn deforming(props: &Props, open: Mesh, close: Mesh) -> Result<Geometry, SceneError> {
    let deforming = Deforming::new(open, close).map_err(|e| {
        let error = props.error_at("filename_end", e.to_string());
        error.with_help(
            "a mesh deforms by moving its vertices: both files must list the same triangles",
        )
    })?;
    Ok(match deforming.is_still() {
        true => Geometry::Mesh(deforming.open().clone()),
        false => Geometry::Deforming(deforming),
    })
}

//! Shapes: files are read and placed in the world in f64; only when the centre of the scene is known are
//! coordinates rounded, relative to it.

use std::sync::Arc;

use rayon::prelude::*;

use crate::format::mesh_io::{self, MeshData};
use crate::format::plugins::Category;
use crate::format::{Props, SceneError};
use crate::geom::{Cylinder, Disk, Geometry, Mesh, Sdf, SdfGrid, Sphere};
use crate::math::{DVec3, Transform, Vec3};
use crate::scene::Plan;

use super::attributes::{self, Attributes};
use super::{out_of_reach, within_reach};

/// A shape whose place in the world is known but not yet rounded.
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

/// Reads one shape, its file included.
pub fn read<'a>(props: &Props<'a>) -> Result<Source<'a>, SceneError> {
    // Of no use without derivatives.
    props.ignore(&["silhouette_sampling_weight"]);
    let mut to_world = props.transform("to_world")?;
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
        _ => mesh(props, &to_world)?,
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

/// A mesh from a file, its positions and normals taken to the world.
fn mesh(props: &Props, to_world: &Transform) -> Result<Kind, SceneError> {
    let path = props.file("filename")?;
    let face_normals = props.bool("face_normals")?;
    let flip_v = props.plugin() != "serialized" && props.bool("flip_tex_coords")?;
    let data = match props.plugin() {
        "serialized" => mesh_io::read_serialized(path, props.int("shape_index")? as usize),
        "ply" => mesh_io::read_ply(path, &attributes::wanted(props)),
        _ => mesh_io::read_obj(path),
    };
    let mut data = data.map_err(|e| props.error_at("filename", e.to_string()))?;
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
    if face_normals {
        data.normals = None;
    }
    for n in data.normals.iter_mut().flatten() {
        *n = to_world.normal(n.as_dvec3()).normalize_or_zero().as_vec3();
    }
    // As in Mitsuba, one normal in the file is enough to compute none: vertices without then count as
    // flat, since a zero normal leaves the face its own.
    let smooth = !face_normals && data.normals.is_none();
    Ok(Kind::Mesh { data, smooth })
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

/// Least and greatest coordinates of a shape in the world.
fn bounds(source: &Source) -> (DVec3, DVec3) {
    if let Kind::Mesh { data, .. } = &source.kind {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        return data
            .positions
            .iter()
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

/// Distance of the scene from the origin, in radii of the scene, up to which its coordinates stay as they
/// are: within, moving it would gain less than three bits.
const NEAR_ORIGIN: f64 = 4.0;

/// Chooses the centre and makes the shapes relative to it.
pub fn place(sources: Vec<Source>, plan: &mut Plan) -> Result<(Vec<Geometry>, DVec3), SceneError> {
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for source in &sources {
        let (l, h) = bounds(source);
        // NaN is out of reach too.
        if !(within_reach(l) && within_reach(h)) {
            let what = out_of_reach("a part of the shape");
            return Err(source.props.error_at("to_world", what));
        }
        (lo, hi) = (lo.min(l), hi.max(h));
    }
    let middle = 0.5 * (lo + hi);
    let radius = 0.5 * (hi - lo).length();
    let center = if sources.is_empty() || middle.length() <= NEAR_ORIGIN * radius {
        DVec3::ZERO
    } else {
        middle
    };
    if center == DVec3::ZERO {
        plan.add(
            "coordinates",
            "as they are",
            "the scene lies near the origin",
        );
    } else {
        let reason = format!(
            "the scene lies {:.3e} of its radii from the origin",
            middle.length() / radius
        );
        plan.add(
            "coordinates",
            format!("relative to ({}, {}, {})", center.x, center.y, center.z),
            reason,
        );
    }
    let shapes: Result<Vec<_>, _> = sources
        .into_par_iter()
        .map(|s| geometry(s, center))
        .collect();
    Ok((shapes?, center))
}

fn geometry(source: Source, center: DVec3) -> Result<Geometry, SceneError> {
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
        Kind::Mesh { data, smooth } => {
            let positions: Vec<Vec3> = data
                .positions
                .iter()
                .map(|p| (*p - center).as_vec3())
                .collect();
            let (normals, uvs) = (
                data.normals.unwrap_or_default(),
                data.uvs.unwrap_or_default(),
            );
            let mut mesh = Mesh::new(positions, normals, uvs, data.indices, flip_normals)
                .map_err(|e| props.error_at("filename", e.to_string()))?;
            if smooth {
                mesh.compute_vertex_normals();
            }
            Geometry::Mesh(mesh)
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

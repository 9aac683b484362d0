//! Which sensor is rendered, its shutter, and the camera made of it.

use super::{MAX_COORDINATE, out_of_reach, shapes, within_reach};
use crate::film::{FilmSpec, Filter};
use crate::format::plugins::Category;
use crate::format::{Props, SceneError};
use crate::geom::{Geometry, ShapeId, World};
use crate::math::{DVec3, Motion, Transform};
use crate::scene::Plan;
use crate::scene::camera::{
    Aperture, Camera, Distant, FovAxis, IrradianceMeter, Lens, Orthographic, OrthographicSpec,
    Perspective, PerspectiveSpec, Surface, Target, View,
};

/// A sensor and the shape that it stands in.
pub struct Sensor<'a> {
    pub props: Props<'a>,
    pub shape: Option<Props<'a>>,
}

/// The first sensor of the scene, be it in a shape or beside them.
pub fn the_sensor<'a>(
    root: &Props<'a>,
    shapes: &[Props<'a>],
    warnings: &mut Vec<String>,
) -> Result<Sensor<'a>, SceneError> {
    let beside = root.children(Category::Sensor).into_iter();
    let mut sensors: Vec<_> = beside.map(|props| Sensor { props, shape: None }).collect();
    for shape in shapes {
        let inside = shape.children(Category::Sensor).into_iter();
        sensors.extend(inside.map(|props| Sensor {
            props,
            shape: Some(*shape),
        }));
    }
    // In the order of the file.
    sensors.sort_by_key(|s| s.props.object_id());
    if sensors.len() > 1 {
        warnings.push(format!(
            "the scene has {} sensors: the first one is rendered",
            sensors.len()
        ));
    }
    for unused in sensors.iter().skip(1) {
        unused.props.ignore_all();
    }
    let first = sensors.into_iter().next().ok_or_else(|| {
        root.error("the scene has no sensor")
            .with_help("add <sensor type=\"perspective\"> to say where to look from")
    })?;
    let of_shape = first.props.plugin() == "irradiancemeter";
    let wrong = |what: &str, help: &str| Err(first.props.error(what).with_help(help));
    match (of_shape, first.shape) {
        (true, None) => wrong(
            "an irradiance meter measures the shape that it stands in, but it stands in none",
            "put it inside a <shape>",
        ),
        (false, Some(_)) => wrong(
            "only an irradiance meter can stand inside a shape",
            "put the sensor beside the shape",
        ),
        _ => Ok(first),
    }
}

/// When the shutter opens and closes, in the scene's time.
pub fn shutter(sensor: &Props) -> Result<[f64; 2], SceneError> {
    let open = sensor.float("shutter_open")?;
    let close = sensor.float("shutter_close")?;
    if open > close {
        return Err(sensor.error_at("shutter_open", "the shutter closes before it opens"));
    }
    Ok([open, close])
}

/// The camera of `sensor`, with the world as placed relative to `center` and the shape there that the sensor
/// stands in. A meter turns the film's filter into a box, so that all its rays count the same.
pub fn camera(
    sensor: &Sensor,
    shutter: [f64; 2],
    film: &mut FilmSpec,
    (world, measured): (&World, Option<ShapeId>),
    center: DVec3,
) -> Result<Camera, SceneError> {
    let p = &sensor.props;
    let camera = match (p.plugin(), measured) {
        ("irradiancemeter", Some(shape)) => {
            let surface = surface(p, world.geometries()[shape.0 as usize].clone())?;
            Camera::irradiance_meter(IrradianceMeter::new(surface))
        }
        ("radiancemeter", _) => Camera::radiance_meter(radiance_meter(p, shutter, center)?),
        ("distant", _) => {
            let view = View::new(&directed(p, shutter, DVec3::ZERO)?, DVec3::ZERO);
            Camera::distant(view, distant(p, world, center)?)
        }
        ("orthographic", _) => {
            let spec = orthographic(p)?;
            let to_world = p.motion("to_world", shutter)?;
            // The corners of the near plane.
            let height = f64::from(film.height) / f64::from(film.width);
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                check_reach(p, DVec3::new(x, y * height, spec.near_clip))?;
            }
            let view = View::new(&to_world, center);
            return Ok(Camera::orthographic(view, Orthographic::new(&spec, film)));
        }
        _ => {
            check_rigid(p)?;
            let view = View::new(&p.motion("to_world", shutter)?, center);
            let perspective = perspective(p, film)?;
            return Ok(Camera::perspective(view, perspective));
        }
    };
    if (film.width, film.height) != (1, 1) {
        let (width, height) = (film.width, film.height);
        let what = format!(
            "{} measures one number: its film must have 1 x 1 pixels, not {width} x {height}",
            p.row()
        );
        let help = "give it a <film type=\"hdrfilm\"> of width and height 1";
        return Err(p.error(what).with_help(help));
    }
    film.filter = Filter::Box { radius: 0.5 };
    Ok(camera)
}

/// What the camera does about time and focus.
pub fn plan(camera: &Camera, moves: bool, shutter: [f64; 2], plan: &mut Plan) {
    match (moves, camera.moves()) {
        (true, by_camera) => plan.add(
            "motion",
            format!(
                "each sample has a time from {} to {}",
                shutter[0], shutter[1]
            ),
            match by_camera {
                true => "the camera moves while the shutter is open",
                false => "something moves while the shutter is open",
            },
        ),
        (false, _) => plan.add(
            "motion",
            "none, no sample has a time",
            "nothing moves while the shutter is open",
        ),
    }
    match camera.lens() {
        Some(Lens::Pinhole) => {
            plan.add("lens", "pinhole", "there is no lens, or one of radius 0");
        }
        Some(Lens::Thin { .. }) => plan.add("lens", "thin lens", "the lens has a radius"),
        None => plan.add("lens", "none", "the sensor is no perspective camera"),
    }
}

/// Refuses transforms that take `local`, a point in the camera's coordinates, too far away.
fn check_reach(sensor: &Props, local: DVec3) -> Result<(), SceneError> {
    match sensor
        .keyframes("to_world")?
        .iter()
        .all(|key| within_reach(key.point(local)))
    {
        true => Ok(()),
        false => Err(sensor.error_at("to_world", out_of_reach("the camera"))),
    }
}

/// Refuses transforms that enlarge, which perspective has no use for.
fn check_rigid(sensor: &Props) -> Result<(), SceneError> {
    for key in sensor.keyframes("to_world")? {
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            if (key.vector(axis).length_squared() - 1.0).abs() > 1e-3 {
                let error = sensor.error_at("to_world", "the transform of a camera must not scale");
                return Err(error.with_help("leave <scale> out: fov says how much the camera sees"));
            }
        }
    }
    check_reach(sensor, DVec3::ZERO)
}

fn clips(sensor: &Props) -> Result<[f64; 2], SceneError> {
    let (near, far) = (sensor.float("near_clip")?, sensor.float("far_clip")?);
    if near >= far {
        return Err(sensor.error_at(
            "near_clip",
            format!("near_clip {near} is not below far_clip {far}"),
        ));
    }
    Ok([near, far])
}

fn perspective(sensor: &Props, film: &FilmSpec) -> Result<Perspective, SceneError> {
    let [near_clip, far_clip] = clips(sensor)?;
    let (fov_deg, fov_axis) = field_of_view(sensor)?;
    let thin = sensor.plugin() == "thinlens";
    let (lens, principal_point_offset) = match thin {
        true => (thin_lens(sensor, far_clip)?, [0.0; 2]),
        false => {
            // A pinhole is sharp at every distance.
            sensor.ignore(&["focus_distance"]);
            let x = sensor.float("principal_point_offset_x")?;
            let y = sensor.float("principal_point_offset_y")?;
            (Lens::Pinhole, [x, y])
        }
    };
    let spec = PerspectiveSpec {
        fov_deg,
        fov_axis,
        principal_point_offset,
        near_clip,
        far_clip,
        lens,
    };
    let perspective = Perspective::new(&spec, film);
    if near_clip * f64::from(perspective.largest_slope(film)) > MAX_COORDINATE {
        return Err(sensor.error_at("near_clip", out_of_reach("a corner of the near plane")));
    }
    Ok(perspective)
}

/// A lens wider than this many times its focal distance could not tell directions apart.
const MAX_SLOPE: f64 = 1e6;

fn thin_lens(sensor: &Props, far_clip: f64) -> Result<Lens, SceneError> {
    let radius = sensor.float("aperture_radius")?;
    let focus = sensor.opt_float("focus_distance")?.unwrap_or(far_clip);
    if radius > MAX_COORDINATE || radius > MAX_SLOPE * focus {
        let what = format!("an aperture of radius {radius} is too wide for focus at {focus}");
        return Err(sensor.error_at("aperture_radius", what));
    }
    let rotation = sensor.opt_float("blade_rotation")?;
    let aperture = match sensor.opt_int("aperture_blades")? {
        Some(blades) => Aperture::Polygon {
            blades: blades as u32,
            // Reduced first: f32 would lose the direction of many turns.
            rotation: (rotation.unwrap_or(0.0) % 360.0).to_radians() as f32,
        },
        None if rotation.is_some() => {
            let what = "blade_rotation has no effect on a round lens";
            let error = sensor.error_at("blade_rotation", what);
            return Err(error.with_help("add <integer name=\"aperture_blades\" .../>"));
        }
        None => Aperture::Disk,
    };
    Ok(Lens::new(radius, focus, aperture))
}

/// The field of view in degrees and what it is measured along.
pub(super) fn field_of_view(p: &Props) -> Result<(f64, FovAxis), SceneError> {
    let Some(fov) = p.opt_float("fov")? else {
        return Ok((fov_of_focal_length(p)?, FovAxis::Diagonal));
    };
    let axis = match p.choice("fov_axis")? {
        "y" => FovAxis::Y,
        "diagonal" => FovAxis::Diagonal,
        "smaller" => FovAxis::Smaller,
        "larger" => FovAxis::Larger,
        _ => FovAxis::X,
    };
    Ok((fov, axis))
}

/// Diagonal field of view, in degrees, of a lens on 35 mm film (36 x 24 mm).
fn fov_of_focal_length(sensor: &Props) -> Result<f64, SceneError> {
    let text = sensor.string("focal_length")?;
    let number = text
        .strip_suffix("mm")
        .unwrap_or(text)
        .trim()
        .parse::<f64>()
        .ok();
    let length = number
        .filter(|l| l.is_finite() && *l > 0.0)
        .ok_or_else(|| {
            let what = format!("\"{text}\" is no focal length");
            sensor
                .error_at("focal_length", what)
                .with_help("write millimetres, such as 50mm")
        })?;
    Ok(2.0 * (0.5 * 36f64.hypot(24.0) / length).atan().to_degrees())
}

fn orthographic(sensor: &Props) -> Result<OrthographicSpec, SceneError> {
    // Parallel rays are sharp at every distance.
    sensor.ignore(&["focus_distance"]);
    let [near_clip, far_clip] = clips(sensor)?;
    Ok(OrthographicSpec {
        near_clip,
        far_clip,
    })
}

fn radiance_meter(sensor: &Props, shutter: [f64; 2], center: DVec3) -> Result<View, SceneError> {
    let origin = sensor.opt_vec3("origin")?;
    for (name, other) in [("origin", "direction"), ("direction", "origin")] {
        if sensor.is_given(name) && !sensor.is_given(other) {
            let what = format!("\"{name}\" of {} needs \"{other}\" too", sensor.row());
            return Err(sensor.error_at(name, what));
        }
    }
    let origin = origin.unwrap_or_default();
    if !within_reach(origin) {
        return Err(sensor.error_at("origin", out_of_reach("the sensor")));
    }
    check_reach(sensor, DVec3::ZERO)?;
    Ok(View::new(&directed(sensor, shutter, origin)?, center))
}

/// The frame whose third axis is `direction`, moved to `origin`; without a direction, `to_world`.
fn directed(sensor: &Props, shutter: [f64; 2], origin: DVec3) -> Result<Motion, SceneError> {
    let Some(direction) = sensor.opt_vec3("direction")? else {
        return sensor.motion("to_world", shutter);
    };
    let frame = direction
        .try_normalize()
        .and_then(|d| Transform::look_at(DVec3::ZERO, d, d.any_orthonormal_vector()));
    match frame {
        Some(frame) => Ok(Motion::still(Transform::translate(origin) * frame)),
        None => Err(sensor.error_at("direction", "the direction is zero")),
    }
}

fn distant(sensor: &Props, world: &World, center: DVec3) -> Result<Distant, SceneError> {
    let bounds = world.bounds();
    let (middle, radius) = match bounds.is_empty() {
        true => Default::default(),
        false => (bounds.center(), 0.5 * bounds.diagonal().length()),
    };
    let shape = sensor.named_children(Category::Shape).into_iter().next();
    let target = match (sensor.opt_vec3("target")?, shape) {
        (Some(_), Some((_, shape))) => {
            return Err(shape.error("the sensor has a target already, which is a point"));
        }
        (_, Some((name, shape))) if name != Some("target") => {
            let error =
                shape.error("the shape in a distant sensor is its target, but not named so");
            return Err(error.with_help("write <shape name=\"target\" ...>"));
        }
        (Some(p), None) if !within_reach(p) => {
            return Err(sensor.error_at("target", out_of_reach("the target")));
        }
        (Some(p), None) => Target::Point((p - center).as_vec3()),
        (None, Some((_, shape))) => {
            let geometry = shapes::alone(&shape, center)?;
            Target::Surface(Box::new(surface(&shape, geometry)?))
        }
        (None, None) => Target::Scene,
    };
    Ok(Distant::new(target, middle, radius))
}

fn surface(at: &Props, geometry: Geometry) -> Result<Surface, SceneError> {
    let what = "the shape that is measured has no area, or too many triangles to choose from";
    Surface::new(geometry).ok_or_else(|| at.error(what))
}

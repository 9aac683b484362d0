//! What building a scene makes of its files: normals and texture coordinates of meshes, values of pictures.

#[path = "common/render.rs"]
mod render;

use luxel::bsdf::Mode;
use luxel::format::{self, Compiled, Overrides};
use luxel::geom::{Hit, Ray};
use luxel::image_io::Image;
use luxel::math::{Rgb, Vec2, Vec3};
use std::f32::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};

/// A fresh folder for the files of one test.
fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("building_{test}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn build(dir: &Path, body: &str) -> Compiled {
    let xml = format!("<scene version='3.0.0'><sensor type='perspective'/>{body}</scene>");
    let desc = format::load_str("a.xml", &xml, dir, &[]);
    desc.and_then(|d| format::compile(&d, &Overrides::default()))
        .unwrap_or_else(|e| panic!("{e}"))
}

/// What is met looking down the z axis at (x, y).
fn seen_at(built: &Compiled, x: f32, y: f32) -> Hit {
    let ray = Ray::new(Vec3::new(x, y, 9.0), -Vec3::Z);
    built.job.scene.intersect(&ray).unwrap()
}

fn assert_near(found: Vec3, expected: Vec3) {
    assert!((found - expected).length() < 1e-3, "{found} {expected}");
}

/// A slope up to the ridge x = 0, and level ground from there.
const SLOPE: &str = "v -1 -1 -1\nv 0 -1 0\nv 0 1 0\nv -1 1 -1\nv 1 -1 0\nv 1 1 0\n";

#[test]
fn vertex_normals_are_computed_after_to_world() {
    let dir = folder("normals");
    let shape = |file: &str, more: &str| {
        let body = format!(
            "<shape type='obj'><string name='filename' value='{file}'/>{more}\
             <transform name='to_world'><scale z='2'/></transform></shape>"
        );
        seen_at(&build(&dir, &body), 1e-4, 0.1).frame.n
    };
    fs::write(
        dir.join("none.obj"),
        format!("{SLOPE}f 1 2 3 4\nf 2 5 6 3\n"),
    )
    .unwrap();
    // Twice as high, the slope has the normal (-2, 0, 1) / sqrt 5; both quads have right angles.
    let slope = Vec3::new(-2.0, 0.0, 1.0).normalize();
    assert_near(shape("none.obj", ""), (slope + Vec3::Z).normalize());
    let flat = "<boolean name='face_normals' value='true'/>";
    assert_near(shape("none.obj", flat), Vec3::Z);
    // Normals of the file go along with the transform; where some are there, none is computed.
    let given = format!("{SLOPE}vn 1 0 1\nf 1 2 3 4\nf 2//1 5//1 6//1 3//1\n");
    fs::write(dir.join("given.obj"), given).unwrap();
    let tilted = Vec3::new(1.0, 0.0, 0.5).normalize();
    assert_near(shape("given.obj", ""), tilted);
    assert_near(shape("given.obj", flat), Vec3::Z);
    let partly = format!("{SLOPE}vn 1 0 1\nf 1//1 2 3 4\nf 2 5 6 3\n");
    fs::write(dir.join("partly.obj"), partly).unwrap();
    assert_near(shape("partly.obj", ""), Vec3::Z);
}

#[test]
fn texture_coordinates_are_flipped_as_in_mitsuba() {
    let dir = folder("uv");
    let obj =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
    fs::write(dir.join("quad.obj"), obj).unwrap();
    let uv = |more: &str| {
        let body =
            format!("<shape type='obj'><string name='filename' value='quad.obj'/>{more}</shape>");
        seen_at(&build(&dir, &body), 0.25, 0.125).uv
    };
    let near = |a: Vec2, b: Vec2| assert!((a - b).length() < 1e-6, "{a} {b}");
    near(uv(""), Vec2::new(0.25, 0.875));
    let unflipped = "<boolean name='flip_tex_coords' value='false'/>";
    near(uv(unflipped), Vec2::new(0.25, 0.125));
}

#[test]
fn pictures_never_reflect_more_than_all_or_less_than_nothing() {
    let dir = folder("pictures");
    let image = |name: &str, values: [f32; 4]| {
        let picture = Image::from_rgb(2, 2, &values.map(Rgb::splat));
        picture.write(dir.join(name)).unwrap();
    };
    image("bright.exr", [3.0, 0.5, 0.5, 0.5]);
    image("below.exr", [-1.0, 0.5, 0.5, 0.5]);
    let built = |name: &str| {
        let body = format!(
            "<emitter type='constant'/><shape type='rectangle'><bsdf type='diffuse'>\
             <texture type='bitmap' name='reflectance'><string name='filename' value='{name}'/>\
             <string name='filter_type' value='nearest'/></texture></bsdf></shape>"
        );
        let built = build(&dir, &body);
        let albedo_at = |(x, y)| {
            let bsdf = built.job.scene.shade(&seen_at(&built, x, y), 0.0).bsdf;
            PI * bsdf.eval(Vec3::Z, Vec3::Z, Mode::Radiance).r
        };
        let albedos = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)].map(albedo_at);
        let (low, high) = (
            albedos.iter().copied().fold(9.0, f32::min),
            albedos.iter().copied().fold(-9.0, f32::max),
        );
        ([low, high], built.warnings)
    };
    let warning =
        "a.xml:1:146: the picture has values above 1, which as \"reflectance\" are cut to 1";
    let near = |found: [f32; 2], expected: [f32; 2]| {
        assert!(
            (0..2).all(|i| (found[i] - expected[i]).abs() < 1e-6),
            "{found:?}"
        );
    };
    let (range, warnings) = built("bright.exr");
    near(range, [0.5, 1.0]);
    assert_eq!(warnings, [warning]);
    let (range, warnings) = built("below.exr");
    near(range, [0.0, 0.5]);
    assert!(warnings.is_empty(), "{warnings:?}");
}

/// Radiance of the lamp itself and of what it reflects, seen by the camera, mean over the picture.
fn lamp(material: &str, radiance: f32) -> f64 {
    let content = format!(
        r#"<shape type="rectangle">{material}<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>
        <emitter type="constant"/>"#
    );
    render::mean_of(&render::picture(
        &render::scene(2, &render::camera(8, 10.0), &content),
        256,
        1,
    ))
}

#[test]
fn a_lamp_without_a_material_is_black() {
    // As in Mitsuba 3.9.1: only shapes that do not emit are grey by default.
    assert_eq!(lamp("", 1.0), 1.0);
    let grey = r#"<bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>"#;
    assert!((lamp(grey, 1.0) - 1.5).abs() < 0.01);
}

//! The full text of each error that a scene can cause.

mod cameras;
mod compiling;
mod composed;
mod emitters;
mod files;
mod integrators;
mod language;
mod meshes;
mod outside;
mod values;
mod world;

use luxel::format::{self, Category, Overrides, SceneDesc, SceneError};
use std::fs;
use std::path::{Path, PathBuf};

/// A fresh folder for the files of one test.
fn folder(test: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("scene_errors_{test}"));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn load(xml: &str) -> Result<SceneDesc, SceneError> {
    format::load_str("a.xml", xml, "nowhere".as_ref(), &[])
}

/// The error of a whole file.
fn file(xml: &str) -> String {
    load(xml).expect_err(xml).to_string()
}

/// The error of what stands inside a scene, which begins on line 2.
fn inside(body: &str) -> String {
    file(&format!("<scene version=\"3.0.0\">\n{body}\n</scene>"))
}

/// The error of what stands inside a sphere, which begins on line 3.
fn in_sphere(body: &str) -> String {
    inside(&format!("<shape type=\"sphere\">\n{body}\n</shape>"))
}

/// The error of a step of a transform, which begins on line 4.
fn step(step: &str) -> String {
    in_sphere(&format!(
        "<transform name=\"to_world\">\n{step}\n</transform>"
    ))
}

/// The error of building a scene that names no file.
fn building(body: &str) -> String {
    building_in(Path::new("nowhere"), body, &Overrides::default())
}

/// The error of building what stands inside a scene, which begins on line 2; files are looked for in `dir`.
fn building_in(dir: &Path, body: &str, overrides: &Overrides) -> String {
    let xml = format!("<scene version='3.0.0'>\n{body}\n</scene>");
    let desc = format::load_str("a.xml", &xml, dir, &[]);
    let error = desc.and_then(|d| format::compile(&d, overrides).map(|_| ()));
    let text = error.expect_err(body).to_string();
    text.replace(&dir.display().to_string(), "DIR")
}

/// Compares an error with its text, which begins on a line of its own.
#[track_caller]
fn says(error: String, expected: &str) {
    assert_eq!(error, expected.trim_start_matches('\n'));
}

//! The full text of each error that a scene can cause.

mod compiling;
mod files;
mod language;
mod values;

use luxel::format::{self, Category, SceneDesc, SceneError};
use std::fs;
use std::path::PathBuf;

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

/// Compares an error with its text, which begins on a line of its own.
#[track_caller]
fn says(error: String, expected: &str) {
    assert_eq!(error, expected.trim_start_matches('\n'));
}

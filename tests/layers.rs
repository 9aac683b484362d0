//! Who may import whom: a module uses only rooms below its own, and only the crates that belong there.

use std::fs;
use std::path::{Path, PathBuf};

/// Rooms from the ground up; rooms of one row are strangers to each other.
const ROWS: [&[&str]; 10] = [
    &["math"],
    &["sampler", "image_io", "bsdf"],
    &["film", "geom", "texture"],
    &["material", "light"],
    &["scene"],
    &["radiosity"],
    &["transport"],
    &["render"],
    &["format", "study"],
    &["cli"],
];

/// Crates that only the named rooms may use. Threads (rayon) are for what loops over pixels, shapes or
/// triangles, not for what happens at one hit.
const CRATES: [(&str, &[&str]); 16] = [
    ("obvhs", &["geom"]),
    (
        "rayon",
        &[
            "geom",
            "radiosity",
            "transport",
            "render",
            "study",
            "format",
            "cli",
        ],
    ),
    ("faer", &["radiosity"]),
    ("spade", &["radiosity"]),
    ("kiddo", &["transport"]),
    ("serde_json", &["radiosity", "render", "study", "cli"]),
    ("sobol_burley", &["sampler"]),
    ("rand_pcg", &["sampler"]),
    ("exr", &["image_io"]),
    ("image", &["image_io"]),
    ("flate2", &["format"]),
    ("roxmltree", &["format"]),
    ("clap", &["cli"]),
    ("indicatif", &["cli"]),
    ("ctrlc", &["cli"]),
    ("tev_client", &["cli"]),
];

/// Unit tests in files of their own are left out: they may use what helps testing.
fn sources(dir: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
            out.push(path);
        }
    }
}

fn row(room: &str) -> Option<usize> {
    ROWS.iter().position(|rooms| rooms.contains(&room))
}

#[test]
fn imports_go_down() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let mut faults = Vec::new();
    for file in &files {
        let inside = file.strip_prefix(&root).unwrap();
        let room = inside
            .iter()
            .next()
            .unwrap()
            .to_string_lossy()
            .replace(".rs", "");
        let Some(own) = row(&room) else {
            assert!(
                ["lib", "main"].contains(&room.as_str()),
                "{room} has no row"
            );
            continue;
        };
        for (number, line) in fs::read_to_string(file).unwrap().lines().enumerate() {
            let code = line.trim_start();
            if code.starts_with("//") {
                continue;
            }
            let place = format!("{}:{}", inside.display(), number + 1);
            for used in code.split("crate::").skip(1) {
                let used: String = used
                    .chars()
                    .take_while(|c| c.is_alphanumeric() || *c == '_')
                    .collect();
                if let Some(other) = row(&used)
                    && used != room
                    && other >= own
                {
                    faults.push(format!("{place}: {room} uses {used}"));
                }
            }
            for (name, rooms) in CRATES {
                let uses = code.starts_with(&format!("use {name}::"))
                    || code.contains(&format!(" {name}::"));
                if uses && !rooms.contains(&room.as_str()) {
                    faults.push(format!("{place}: {room} uses the crate {name}"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

//! The scene language: from an XML file to a checked [`SceneDesc`], and readers of mesh files.
//!
//! The language is that of Mitsuba 3. What comes out knows files and lines and nothing of rendering;
//! building a scene from it is the work of [`compile`].

mod check;
mod cie;
pub mod compile;
mod content;
mod desc;
mod error;
mod limits;
pub mod mesh_io;
pub mod plugins;
mod props;
pub mod spectrum;
mod spectrum_plugins;
mod xml;

pub use compile::{Compiled, Overrides, compile};
pub use desc::{ObjectId, SceneDesc};
pub use error::{Place, SceneError, did_you_mean, list};
pub use plugins::Category;
pub use props::{FloatOrTexture, Props, RgbOrTexture};

use error::{Source, whole_file};
use std::path::Path;
use xml::{Loader, Parameters};

/// Reads a scene file. `defines` are the `-D name=value` of the command line.
pub fn load(path: &Path, defines: &[(String, String)]) -> Result<SceneDesc, SceneError> {
    let text = xml::read_text(path).map_err(|what| SceneError::new(whole_file(path), what))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    load_source(path, text, folder, defines)
}

/// The scene that is rendered when none is named.
const BUILT_IN: &str = include_str!("../../scenes/cornell-balls.xml");
/// Its file name without extension.
pub const BUILT_IN_NAME: &str = "cornell-balls";

/// Reads the scene that is built into the program.
pub fn load_built_in(defines: &[(String, String)]) -> Result<SceneDesc, SceneError> {
    load_str("cornell-balls.xml", BUILT_IN, Path::new(""), defines)
}

/// Reads a scene from text. Errors call it `name`; files are looked for in `base_dir`.
pub fn load_str(
    name: &str,
    text: &str,
    base_dir: &Path,
    defines: &[(String, String)],
) -> Result<SceneDesc, SceneError> {
    if text.len() as u64 > limits::XML_FILE_BYTES {
        let what = format!("larger than {} MiB", limits::XML_FILE_BYTES >> 20);
        return Err(SceneError::new(whole_file(Path::new(name)), what));
    }
    load_source(Path::new(name), text.to_string(), base_dir, defines)
}

fn load_source(
    name: &Path,
    text: String,
    folder: &Path,
    defines: &[(String, String)],
) -> Result<SceneDesc, SceneError> {
    let parameters = Parameters::new(defines)?;
    let source = Source {
        name: name.to_path_buf(),
        text: text.into(),
    };
    Loader::new(parameters, folder.to_path_buf()).load(source, defines)
}

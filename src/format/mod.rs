//! The scene language: from an XML file to a checked [`SceneDesc`], and readers of mesh files.
//!
//! The language is that of Mitsuba 3. What comes out knows files and lines and nothing of rendering;
//! building a scene from it is left to `compile`.

mod check;
mod cie;
mod desc;
mod error;
mod limits;
pub mod mesh_io;
pub mod plugins;
mod props;
pub mod spectrum;
mod xml;

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

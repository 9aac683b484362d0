//! How far a picture is from a reference: error metrics, a perceptual difference, a statistical test,
//! and a picture of the error. These work on two pictures and know nothing of how they were made.
//!
//! Above them, studies: [`plan`] says what is rendered how often, [`sweep`] does it, [`statistics`] tells bias
//! from noise over the runs, [`fit`] draws lines through the errors, [`remarks`] warns of what
//! cannot be believed, [`results`] and [`report`] write.

pub mod error_map;
pub mod evaluate;
pub mod fit;
pub mod flip;
pub mod flip_floor;
pub mod memory;
pub mod metrics;
pub mod plan;
pub mod reference;
pub mod remarks;
pub mod report;
pub mod results;
pub mod runs;
pub mod statistics;
pub mod sweep;
pub mod z_test;

use std::fmt;
use std::path::{Path, PathBuf};

use crate::image_io::{Image, ImageError};
use crate::math::Rgb;

/// A picture of linear colours, row by row from the top left; every number is finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<Rgb>,
}

/// Why two pictures cannot be compared.
#[derive(Clone, Debug, PartialEq)]
pub enum CompareError {
    File(ImageError),
    /// The file has no channels that are a colour.
    NoColour {
        path: PathBuf,
    },
    NotFinite {
        path: PathBuf,
        count: usize,
        /// Column and row of the first one, from the top left, from 0.
        first: [usize; 2],
    },
    SizesDiffer {
        a: (PathBuf, usize, usize),
        b: (PathBuf, usize, usize),
    },
}

impl fmt::Display for CompareError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CompareError::File(e) => e.fmt(f),
            CompareError::NoColour { path } => write!(
                f,
                "{}: no channels R, G, B, or X, Y, Z, or Y to compare",
                path.display()
            ),
            CompareError::NotFinite { path, count, first } => write!(
                f,
                "{}: {count} pixels are NaN or infinite, the first at column {}, row {} (from 0)",
                path.display(),
                first[0],
                first[1]
            ),
            CompareError::SizesDiffer { a, b } => write!(
                f,
                "the sizes differ: {} has {} x {} pixels, {} has {} x {}",
                a.0.display(),
                a.1,
                a.2,
                b.0.display(),
                b.1,
                b.2
            ),
        }
    }
}

impl std::error::Error for CompareError {}

impl From<ImageError> for CompareError {
    fn from(e: ImageError) -> CompareError {
        CompareError::File(e)
    }
}

impl Picture {
    /// The colours of the file at `path`, decoded to linear numbers.
    ///
    /// # Errors
    /// An unreadable file, one without colours, and pixels that are NaN or infinite.
    pub fn read(path: impl AsRef<Path>) -> Result<Picture, CompareError> {
        let path = path.as_ref();
        let image = Image::read(path)?;
        let pixels = image.rgb().ok_or_else(|| CompareError::NoColour {
            path: path.to_path_buf(),
        })?;
        Picture::finite(path, image.width, pixels)
    }

    /// The colours of layer `name` of the EXR at `path`, under the conditions of [`Picture::read`];
    /// `Ok(None)` when it has no such layer.
    pub fn read_layer(path: impl AsRef<Path>, name: &str) -> Result<Option<Picture>, CompareError> {
        let path = path.as_ref();
        let image = Image::read(path)?;
        let layer = image.layer(name).and_then(|layer| layer.rgb());
        layer
            .map(|pixels| Picture::finite(path, image.width, pixels))
            .transpose()
    }

    fn finite(path: &Path, width: usize, pixels: Vec<Rgb>) -> Result<Picture, CompareError> {
        let bad = |p: &Rgb| !p.is_finite();
        if let Some(at) = pixels.iter().position(bad) {
            return Err(CompareError::NotFinite {
                path: path.to_path_buf(),
                count: pixels.iter().filter(|p| bad(p)).count(),
                first: [at % width, at / width],
            });
        }
        Ok(Picture {
            width,
            height: pixels.len() / width,
            pixels,
        })
    }

    /// A picture of the same size as `like`, read from `path`; `like_path` is named if the sizes differ.
    pub fn read_like(
        path: impl AsRef<Path>,
        like: &Picture,
        like_path: &Path,
    ) -> Result<Picture, CompareError> {
        let path = path.as_ref();
        let read = Picture::read(path)?;
        if (read.width, read.height) != (like.width, like.height) {
            return Err(CompareError::SizesDiffer {
                a: (like_path.to_path_buf(), like.width, like.height),
                b: (path.to_path_buf(), read.width, read.height),
            });
        }
        Ok(read)
    }
}

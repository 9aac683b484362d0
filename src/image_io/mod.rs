//! Pictures in files: EXR with layers, PNG, JPEG, BMP, TGA, Radiance HDR and PFM.
//!
//! Two types, for two uses. [`Image`] holds planar layers of linear numbers and is what the renderer
//! writes and `luxel compare` reads. [`Bitmap`] holds the picture of a file interleaved and as it was
//! stored (8-bit data stay 8-bit and sRGB-encoded), which is what a texture wants.
//!
//! A file may be malformed in any way: readers answer with an [`ImageError`], and check the declared
//! size against [`MAX_PIXELS`] before they allocate. Writers build the file in memory and hand it to
//! [`write_atomic`], so that a file is either complete or untouched.

mod atomic;
mod bitmap;
pub mod color;
mod exr_check;
mod exr_file;
mod pfm;
mod raster;

use std::fmt;
use std::path::{Path, PathBuf};

use crate::math::Rgb;

pub use atomic::{check_writable, write_atomic};
pub use bitmap::{Bitmap, Encoding, Pixels};
pub use exr_file::read_metadata;

/// Largest number of pixels that a reader or writer accepts.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Largest number of samples (pixels times channels, all layers) that a reader accepts.
pub const MAX_SAMPLES: u64 = 1 << 30;

/// A file that could not be read or written, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ImageError {
    Read { path: PathBuf, what: String },
    Write { path: PathBuf, what: String },
}

impl ImageError {
    fn read(path: &Path, what: impl Into<String>) -> ImageError {
        ImageError::Read {
            path: path.to_path_buf(),
            what: what.into(),
        }
    }

    fn write(path: &Path, what: impl Into<String>) -> ImageError {
        ImageError::Write {
            path: path.to_path_buf(),
            what: what.into(),
        }
    }
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ImageError::Read { path, what } => {
                write!(f, "cannot read {}: {what}", path.display())
            }
            ImageError::Write { path, what } => {
                write!(f, "cannot write {}: {what}", path.display())
            }
        }
    }
}

impl std::error::Error for ImageError {}

/// The samples of one channel, row by row from the top left; the variant fixes how EXR stores them.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Stored as IEEE half: 11 significant bits, at most 65504.
    Half(Vec<f32>),
    Float(Vec<f32>),
    /// Counts and identifiers, exact over the whole range.
    Uint(Vec<u32>),
    /// The same, of bits that look like noise: not compressed. Read as [`Samples::Uint`].
    Bits(Vec<u32>),
}

impl Samples {
    pub fn len(&self) -> usize {
        match self {
            Samples::Half(v) | Samples::Float(v) => v.len(),
            Samples::Uint(v) | Samples::Bits(v) => v.len(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Sample `i` as a number (integers above 2^24 are rounded); NaN beyond the end.
    #[inline]
    pub fn get(&self, i: usize) -> f32 {
        match self {
            Samples::Half(v) | Samples::Float(v) => v.get(i).copied().unwrap_or(f32::NAN),
            Samples::Uint(v) | Samples::Bits(v) => v.get(i).map_or(f32::NAN, |&n| n as f32),
        }
    }
}

/// One named plane of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name within the layer: `R`, `Y`, `X` …
    pub name: String,
    pub samples: Samples,
}

/// Channels that belong together. The layer with the empty name is the picture itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    pub name: String,
    pub channels: Vec<Channel>,
}

impl Layer {
    /// Layer `name` with the channels R, G, B.
    pub fn from_rgb(name: &str, pixels: &[Rgb], store: fn(Vec<f32>) -> Samples) -> Layer {
        let plane = |name: &str, c: usize| Channel {
            name: name.to_string(),
            samples: store(pixels.iter().map(|p| p[c]).collect()),
        };
        Layer {
            name: name.to_string(),
            channels: vec![plane("R", 0), plane("G", 1), plane("B", 2)],
        }
    }

    /// Layer `name` with the one channel Y.
    pub fn from_scalar(name: &str, samples: Samples) -> Layer {
        Layer {
            name: name.to_string(),
            channels: vec![Channel {
                name: "Y".to_string(),
                samples,
            }],
        }
    }

    pub fn channel(&self, name: &str) -> Option<&Samples> {
        let found = self.channels.iter().find(|c| c.name == name);
        found.map(|c| &c.samples)
    }

    /// The layer as linear Rec. 709 colours: channels R, G, B, or X, Y, Z (CIE, D65), or Y alone.
    /// `None` when it has none of these.
    pub fn rgb(&self) -> Option<Vec<Rgb>> {
        let triple = |names: [&str; 3]| -> Option<Vec<Rgb>> {
            let [a, b, c] = names.map(|n| self.channel(n));
            let (a, b, c) = (a?, b?, c?);
            let colour = |i| Rgb::new(a.get(i), b.get(i), c.get(i));
            Some((0..a.len()).map(colour).collect())
        };
        if let Some(rgb) = triple(["R", "G", "B"]) {
            return Some(rgb);
        }
        if let Some(mut xyz) = triple(["X", "Y", "Z"]) {
            xyz.iter_mut().for_each(|c| *c = color::xyz_to_rgb(*c));
            return Some(xyz);
        }
        let y = self.channel("Y")?;
        Some((0..y.len()).map(|i| Rgb::splat(y.get(i))).collect())
    }
}

/// A picture of linear numbers with layers, as EXR holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    /// Where the top left pixel lies inside the full frame (the data window of EXR); pixels.
    pub offset: [i32; 2],
    /// Width and height of the full frame (the display window), pixels.
    pub frame: [usize; 2],
    pub layers: Vec<Layer>,
    /// JSON text about the making of the picture: the attribute `luxel` of our EXR files.
    pub metadata: Option<String>,
}

impl Image {
    /// An image without layers that fills its frame.
    pub fn new(width: usize, height: usize) -> Image {
        Image {
            width,
            height,
            offset: [0, 0],
            frame: [width, height],
            layers: Vec::new(),
            metadata: None,
        }
    }

    /// The picture alone, stored as 32-bit floats. `pixels` holds `width * height` colours.
    pub fn from_rgb(width: usize, height: usize, pixels: &[Rgb]) -> Image {
        let mut image = Image::new(width, height);
        image
            .layers
            .push(Layer::from_rgb("", pixels, Samples::Float));
        image
    }

    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|l| l.name == name)
    }

    /// The channel with the full name `layer.channel`, or `channel` of the picture.
    pub fn channel(&self, full_name: &str) -> Option<&Samples> {
        let (layer, name) = full_name.rsplit_once('.').unwrap_or(("", full_name));
        self.layer(layer)?.channel(name)
    }

    /// The picture as colours: the layer without a name or, where there is none, the first layer that
    /// is a colour.
    pub fn rgb(&self) -> Option<Vec<Rgb>> {
        let main = self.layer("").and_then(Layer::rgb);
        main.or_else(|| self.layers.iter().find_map(Layer::rgb))
    }

    /// Reads a file of any supported kind. EXR comes with all its layers; 8-bit and 16-bit pictures are
    /// decoded from sRGB to linear.
    pub fn read(path: impl AsRef<Path>) -> Result<Image, ImageError> {
        let path = path.as_ref();
        let bytes = read_bytes(path)?;
        match Kind::detect(&bytes, path)? {
            Kind::Exr => exr_file::decode(&bytes).map_err(|e| ImageError::read(path, e)),
            kind => Ok(Bitmap::decode(&bytes, kind)
                .map_err(|e| ImageError::read(path, e))?
                .into_image()),
        }
    }

    /// Writes the file that the extension asks for: `.exr` holds all layers and the metadata, `.png`
    /// and `.jpg` the picture (sRGB, exposure 0, 8 bit), `.hdr` and `.pfm` the picture (float).
    ///
    /// The file appears at once and complete ([`write_atomic`]).
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), ImageError> {
        let path = path.as_ref();
        let kind = Kind::of_target(path)?;
        self.encode(kind)
            .map_err(|e| ImageError::write(path, e))
            .and_then(|bytes| write_atomic(path, &bytes))
    }

    /// The picture as the bytes of a PNG, as [`Image::write`] would write it.
    ///
    /// # Errors
    /// It has no colours, or is too large.
    pub fn png(&self) -> Result<Vec<u8>, String> {
        self.encode(Kind::Png)
    }

    /// Whether the extension of `path` is one that [`Image::write`] knows.
    pub fn can_write_extension(path: impl AsRef<Path>) -> bool {
        Kind::of_target(path.as_ref()).is_ok()
    }

    /// Whether [`Image::write`] to `path` can be expected to work ([`check_writable`]).
    pub fn check_target(path: impl AsRef<Path>) -> Result<(), ImageError> {
        let path = path.as_ref();
        Kind::of_target(path).and_then(|_| check_writable(path))
    }

    fn encode(&self, kind: Kind) -> Result<Vec<u8>, String> {
        check_size(self.width as u64, self.height as u64)?;
        let pixels = self.width * self.height;
        for layer in &self.layers {
            let wrong = |c: &&Channel| c.samples.len() != pixels;
            if let Some(channel) = layer.channels.iter().find(wrong) {
                return Err(format!(
                    "channel \"{}\" of layer \"{}\" has {} samples, not {} x {}",
                    channel.name,
                    layer.name,
                    channel.samples.len(),
                    self.width,
                    self.height
                ));
            }
        }
        if kind == Kind::Exr {
            return exr_file::encode(self);
        }
        let rgb = self
            .rgb()
            .ok_or("the image has no layer with channels R, G, B or Y")?;
        match kind {
            Kind::Pfm => Ok(pfm::encode(self.width, self.height, &rgb)),
            Kind::Hdr => raster::encode_hdr(self.width, self.height, &rgb),
            Kind::Jpeg => raster::encode_ldr(self.width, self.height, &rgb, None, kind),
            _ => raster::encode_ldr(self.width, self.height, &rgb, self.channel("A"), kind),
        }
    }
}

/// The kinds of file that are known here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Exr,
    Png,
    Jpeg,
    Bmp,
    Tga,
    Hdr,
    Pfm,
}

impl Kind {
    /// The kind to write, by the extension.
    fn of_target(path: &Path) -> Result<Kind, ImageError> {
        let kind = Kind::from_extension(path).filter(|k| *k != Kind::Bmp && *k != Kind::Tga);
        kind.ok_or_else(|| {
            ImageError::write(path, "the extension is not .exr, .png, .jpg, .hdr or .pfm")
        })
    }

    fn from_extension(path: &Path) -> Option<Kind> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "exr" => Kind::Exr,
            "png" => Kind::Png,
            "jpg" | "jpeg" => Kind::Jpeg,
            "bmp" => Kind::Bmp,
            "tga" => Kind::Tga,
            "hdr" | "rgbe" | "pic" => Kind::Hdr,
            "pfm" => Kind::Pfm,
            _ => return None,
        })
    }

    /// By the first bytes; TGA has none of its own and goes by its extension.
    fn detect(bytes: &[u8], path: &Path) -> Result<Kind, ImageError> {
        const MAGIC: [(&[u8], Kind); 9] = [
            (b"\x76\x2f\x31\x01", Kind::Exr),
            (b"\x89PNG\r\n\x1a\n", Kind::Png),
            (b"\xff\xd8\xff", Kind::Jpeg),
            (b"#?RADIANCE", Kind::Hdr),
            (b"#?RGBE", Kind::Hdr),
            (b"PF\n", Kind::Pfm),
            (b"Pf\n", Kind::Pfm),
            (b"PF\r\n", Kind::Pfm),
            (b"Pf\r\n", Kind::Pfm),
        ];
        if let Some((_, kind)) = MAGIC.iter().find(|(magic, _)| bytes.starts_with(magic)) {
            return Ok(*kind);
        }
        match Kind::from_extension(path) {
            _ if bytes.is_empty() => Err(ImageError::read(path, "the file is empty")),
            Some(Kind::Tga) => Ok(Kind::Tga),
            // Two letters are too few to go by alone.
            Some(Kind::Bmp) if bytes.starts_with(b"BM") => Ok(Kind::Bmp),
            _ => Err(ImageError::read(
                path,
                "not an EXR, PNG, JPEG, BMP, TGA, Radiance HDR or PFM file, or cut off at its start",
            )),
        }
    }
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, ImageError> {
    std::fs::read(path).map_err(|e| ImageError::read(path, atomic::reason(&e)))
}

/// Refuses empty and oversized pictures; to be called before anything of that size is allocated.
fn check_size(width: u64, height: u64) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err(format!("the picture is empty ({width} x {height} pixels)"));
    }
    if width.saturating_mul(height) > MAX_PIXELS {
        return Err(format!(
            "{width} x {height} pixels are more than the {MAX_PIXELS} that luxel accepts"
        ));
    }
    Ok(())
}

/// Runs a decoder of a third party and turns a panic into an error. The last resort: files that are
/// known to trip a decoder are refused before it sees them.
fn guarded<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err("the file is malformed (the decoder gave up)".to_string()))
}

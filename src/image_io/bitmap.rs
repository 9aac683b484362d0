//! The picture of a file as it was stored: what a texture reads.

use std::path::Path;

use super::color::srgb_to_linear;
use super::{Channel, Image, ImageError, Kind, Layer, Samples};
use super::{exr_file, pfm, raster, read_bytes};

/// How stored numbers relate to light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Colour channels follow the sRGB curve (IEC 61966-2-1); alpha does not.
    Srgb,
    /// Numbers are proportional to light.
    Linear,
}

/// Interleaved samples, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// 8-bit files: 255 means 1.
    U8(Vec<u8>),
    /// 16-bit files, scaled so that 65535 means 1, and float files.
    F32(Vec<f32>),
}

/// A picture of one to four interleaved channels: grey, grey and alpha, RGB, RGB and alpha.
#[derive(Clone, Debug, PartialEq)]
pub struct Bitmap {
    pub width: usize,
    pub height: usize,
    /// 1 to 4; the last one of 2 or 4 is alpha.
    pub channels: usize,
    /// [`Encoding::Srgb`] for PNG, JPEG, BMP and TGA: a convention, as the files rarely say. Whoever
    /// uses the numbers as data (roughness, normals) takes them raw.
    pub encoding: Encoding,
    pub pixels: Pixels,
}

impl Bitmap {
    /// Reads the picture of a file of any supported kind; of an EXR, the layer that other programs show.
    ///
    /// # Errors
    /// A missing, malformed, cut off or oversized file, and an EXR without R, G, B, or Y, or X, Y, Z.
    pub fn read(path: impl AsRef<Path>) -> Result<Bitmap, ImageError> {
        let path = path.as_ref();
        let bytes = read_bytes(path)?;
        let kind = Kind::detect(&bytes, path)?;
        Bitmap::decode(&bytes, kind).map_err(|e| ImageError::read(path, e))
    }

    pub(super) fn decode(bytes: &[u8], kind: Kind) -> Result<Bitmap, String> {
        match kind {
            Kind::Exr => Bitmap::from_image(&exr_file::decode(bytes)?),
            Kind::Pfm => pfm::decode(bytes),
            _ => raster::decode(bytes, kind),
        }
    }

    fn from_image(image: &Image) -> Result<Bitmap, String> {
        let main = image.layer("").filter(|l| l.rgb().is_some());
        let layer = main.or_else(|| image.layers.iter().find(|l| l.rgb().is_some()));
        let none = "no layer has the channels R, G, B, or X, Y, Z, or Y";
        let layer = layer.ok_or(none)?;
        let rgb = layer.rgb().ok_or(none)?;
        let grey = layer.channel("R").is_none() && layer.channel("X").is_none();
        let alpha = layer.channel("A");
        let colours = if grey { 1 } else { 3 };
        let channels = colours + usize::from(alpha.is_some());
        let mut pixels = Vec::with_capacity(rgb.len() * channels);
        for (i, c) in rgb.iter().enumerate() {
            pixels.extend_from_slice(&c.to_array()[..colours]);
            pixels.extend(alpha.map(|a| a.get(i)));
        }
        Ok(Bitmap {
            width: image.width,
            height: image.height,
            channels,
            encoding: Encoding::Linear,
            pixels: Pixels::F32(pixels),
        })
    }

    /// Sample `c` of pixel `i` as a linear number.
    fn linear(&self, i: usize, c: usize) -> f32 {
        let at = i * self.channels + c;
        let raw = match &self.pixels {
            Pixels::U8(v) => f32::from(v[at]) / 255.0,
            Pixels::F32(v) => v[at],
        };
        let alpha = self.channels.is_multiple_of(2) && c + 1 == self.channels;
        match self.encoding {
            Encoding::Srgb if !alpha => srgb_to_linear(raw),
            _ => raw,
        }
    }

    /// The same picture as planar linear floats, in the layer without a name.
    pub(super) fn into_image(self) -> Image {
        let names: &[&str] = match self.channels {
            1 => &["Y"],
            2 => &["Y", "A"],
            3 => &["R", "G", "B"],
            _ => &["R", "G", "B", "A"],
        };
        let count = self.width * self.height;
        let plane = |(c, name): (usize, &&str)| Channel {
            name: name.to_string(),
            samples: Samples::Float((0..count).map(|i| self.linear(i, c)).collect()),
        };
        let mut image = Image::new(self.width, self.height);
        image.layers.push(Layer {
            name: String::new(),
            channels: names.iter().enumerate().map(plane).collect(),
        });
        image
    }
}

//! OpenEXR by way of the `exr` crate.
//!
//! Written files hold each layer in a part of its own, the picture first. Programs that know no layers
//! (Mitsuba 3, the `image` crate, most viewers) open the first part, which is then plain R, G, B; with
//! dotted channels in one part, Mitsuba 3.9 opens a many-channel bitmap that serves as no texture.
//! Parts also have their own compression: 32-bit floats stay uncompressed (noise defeats ZIP: a second
//! per 1080p frame for 6 % of size), half floats and integers are zipped.
//!
//! Our metadata are one text attribute, since the crate writes several in random order and equal
//! renderings shall give equal files.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use ::exr::error::Error as ExrError;
use ::exr::meta::attribute::AttributeValue;
use ::exr::meta::header::Header;
use ::exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, ImageAttributes,
    IntegerBounds, Layer as ExrLayer, LayerAttributes, LineOrder, ReadChannels, ReadLayers, Text,
    Vec2, WritableImage, f16, read as read_exr,
};
use ::exr::prelude::{Image as ExrImage, SmallVec};

use super::exr_check::checked_headers;
use super::{Channel, Image, ImageError, Kind, Layer, Samples};
use super::{guarded, read_bytes};

/// Name of the attribute that holds our metadata.
const METADATA: &str = "luxel";

/// Name of the first part in a file of several; they must all have one.
const MAIN_PART: &str = "main";

/// Files smaller than this are read by one thread: starting others takes longer.
const PARALLEL_FROM: usize = 1 << 20;

/// The metadata (JSON) that luxel left in an EXR file; `None` in files of other programs.
///
/// # Errors
/// A file that is missing or no EXR.
pub fn read_metadata(path: impl AsRef<Path>) -> Result<Option<String>, ImageError> {
    let path = path.as_ref();
    let bytes = read_bytes(path)?;
    if Kind::detect(&bytes, path)? != Kind::Exr {
        return Err(ImageError::read(path, "not an EXR file"));
    }
    guarded(|| checked_headers(&bytes))
        .map(|headers| metadata(&headers))
        .map_err(|e| ImageError::read(path, e))
}

fn metadata(headers: &[Header]) -> Option<String> {
    let value = headers.iter().find_map(|h| {
        let own = h.own_attributes.other.get(METADATA.as_bytes());
        own.or_else(|| h.shared_attributes.other.get(METADATA.as_bytes()))
    })?;
    match value {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}

pub(super) fn decode(bytes: &[u8]) -> Result<Image, String> {
    guarded(|| {
        let headers = checked_headers(bytes)?;
        let reader = read_exr()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes();
        let exr = if bytes.len() < PARALLEL_FROM {
            reader.non_parallel().from_buffered(Cursor::new(bytes))
        } else {
            reader.from_buffered(Cursor::new(bytes))
        };
        let mut exr = exr.map_err(told)?;
        let parts = std::mem::take(&mut exr.layer_data);
        let mut image = assemble(&exr.attributes, parts)?;
        image.metadata = metadata(&headers);
        Ok(image)
    })
}

/// Parts to layers. Channel `a.b.R` belongs to layer `a.b`; the layers of every part but the first
/// are prefixed with its name.
fn assemble(
    shared: &ImageAttributes,
    parts: SmallVec<[ExrLayer<AnyChannels<FlatSamples>>; 2]>,
) -> Result<Image, String> {
    let first = parts.first().ok_or("the file has no parts")?;
    let window = Window::of(first);
    let mut image = Image::new(window.width, window.height);
    let frame = shared.display_window;
    image.offset = [window.x - frame.position.0, window.y - frame.position.1];
    image.frame = [frame.size.0, frame.size.1];
    for (index, part) in parts.into_iter().enumerate() {
        let from = Window::of(&part);
        let part_name = match &part.attributes.layer_name {
            Some(name) if index > 0 => name.to_string(),
            _ => String::new(),
        };
        for channel in part.channel_data.list {
            let full = channel.name.to_string();
            let (group, name) = full.rsplit_once('.').unwrap_or(("", &full));
            let layer_name = match (part_name.as_str(), group) {
                (part, group) if part.is_empty() || part == group => group.to_string(),
                (part, "") => part.to_string(),
                (part, group) => format!("{part}.{group}"),
            };
            let samples = match channel.sample_data {
                FlatSamples::F16(v) => Samples::Half(window.cut(&from, halves(v))),
                FlatSamples::F32(v) => Samples::Float(window.cut(&from, v)),
                FlatSamples::U32(v) => Samples::Uint(window.cut(&from, v)),
            };
            let channel = Channel {
                name: name.to_string(),
                samples,
            };
            match image.layers.iter_mut().find(|l| l.name == layer_name) {
                Some(layer) => layer.channels.push(channel),
                None => image.layers.push(Layer {
                    name: layer_name,
                    channels: vec![channel],
                }),
            }
        }
    }
    image.layers.iter_mut().for_each(order);
    Ok(image)
}

/// EXR sorts channels by name; give colours back in the usual order.
fn order(layer: &mut Layer) {
    layer
        .channels
        .sort_by_key(|c| ["R", "G", "B", "A"].iter().position(|n| c.name == *n));
}

fn halves(v: Vec<f16>) -> Vec<f32> {
    v.into_iter().map(f16::to_f32).collect()
}

/// A data window: its place in the plane and its size, pixels.
#[derive(Clone, Copy, PartialEq)]
struct Window {
    x: i32,
    y: i32,
    width: usize,
    height: usize,
}

impl Window {
    fn of(part: &ExrLayer<AnyChannels<FlatSamples>>) -> Window {
        Window {
            x: part.attributes.layer_position.0,
            y: part.attributes.layer_position.1,
            width: part.size.0,
            height: part.size.1,
        }
    }

    /// The samples of window `from` as this window sees them; outside of `from` they are zero, as the
    /// OpenEXR documentation says.
    fn cut<T: Copy + Default>(&self, from: &Window, samples: Vec<T>) -> Vec<T> {
        if self == from {
            return samples;
        }
        let mut out = vec![T::default(); self.width * self.height];
        for (y, row) in out.chunks_exact_mut(self.width).enumerate() {
            let sy = y as i64 + i64::from(self.y) - i64::from(from.y);
            if sy < 0 || sy >= from.height as i64 {
                continue;
            }
            let line = &samples[sy as usize * from.width..][..from.width];
            let shift = i64::from(self.x) - i64::from(from.x);
            for (x, out) in row.iter_mut().enumerate() {
                let sx = usize::try_from(x as i64 + shift).ok();
                if let Some(&v) = sx.and_then(|sx| line.get(sx)) {
                    *out = v;
                }
            }
        }
        out
    }
}

pub(super) fn encode(image: &Image) -> Result<Vec<u8>, String> {
    if image.layers.is_empty() {
        return Err("the image has no layers".to_string());
    }
    // The picture first: other programs open the first part.
    let mut layers: Vec<&Layer> = image.layers.iter().collect();
    layers.sort_by_key(|l| !l.name.is_empty());
    let several = layers.len() > 1;
    let mut parts = SmallVec::<[ExrLayer<AnyChannels<FlatSamples>>; 2]>::new();
    for (index, layer) in layers.into_iter().enumerate() {
        let mut part = part(image, layer, several)?;
        if let Some(json) = image.metadata.as_deref().filter(|_| index == 0) {
            let value = AttributeValue::Text(text(&ascii_json(json))?);
            part.attributes.other = HashMap::from([(text(METADATA)?, value)]);
        }
        parts.push(part);
    }
    let frame = IntegerBounds::new((0, 0), (image.frame[0], image.frame[1]));
    let exr = ExrImage::from_layers(ImageAttributes::new(frame), parts);
    let mut out = Cursor::new(Vec::new());
    guarded(|| exr.write().to_buffered(&mut out).map_err(told))?;
    Ok(out.into_inner())
}

fn part(
    image: &Image,
    layer: &Layer,
    several: bool,
) -> Result<ExrLayer<AnyChannels<FlatSamples>>, String> {
    let name = match layer.name.as_str() {
        "" if several => Some(MAIN_PART),
        "" => None,
        name => Some(name),
    };
    if layer.channels.is_empty() {
        return Err(format!("layer \"{}\" has no channels", layer.name));
    }
    let mut attributes = LayerAttributes {
        layer_position: Vec2(image.offset[0], image.offset[1]),
        ..LayerAttributes::default()
    };
    attributes.layer_name = name.map(text).transpose()?;
    // Noise in 32-bit floats does not compress; the rest does.
    let float = |c: &Channel| matches!(c.samples, Samples::Float(_) | Samples::Bits(_));
    let compression = match layer.channels.iter().any(float) {
        true => Compression::Uncompressed,
        false => Compression::ZIP16,
    };
    let encoding = Encoding {
        compression,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut channels = SmallVec::new();
    for channel in &layer.channels {
        let samples = match &channel.samples {
            Samples::Half(v) => FlatSamples::F16(v.iter().map(|&x| f16::from_f32(x)).collect()),
            Samples::Float(v) => FlatSamples::F32(v.clone()),
            Samples::Uint(v) | Samples::Bits(v) => FlatSamples::U32(v.clone()),
        };
        channels.push(AnyChannel::new(text(&channel.name)?, samples));
    }
    let size = (image.width, image.height);
    Ok(ExrLayer::new(
        size,
        attributes,
        encoding,
        AnyChannels::sort(channels),
    ))
}

/// EXR text is bytes of no stated encoding: ASCII alone is read alike everywhere.
fn text(s: &str) -> Result<Text, String> {
    match Text::new_or_none(s) {
        Some(text) if s.is_ascii() && !s.contains('\0') => Ok(text),
        _ => Err(format!("the name {s:?} is not plain ASCII")),
    }
}

/// JSON with every character outside ASCII written as `\uXXXX`: the same document.
fn ascii_json(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    let mut units = [0u16; 2];
    for c in json.chars() {
        if c.is_ascii() {
            out.push(c);
        } else {
            for unit in c.encode_utf16(&mut units) {
                out.push_str(&format!("\\u{unit:04x}"));
            }
        }
    }
    out
}

pub(super) fn told(e: ExrError) -> String {
    match e {
        ExrError::NotSupported(what) => format!("this kind of EXR is not supported: {what}"),
        ExrError::Invalid(what) if what == "reference to missing bytes" => {
            "the file is cut off or malformed".to_string()
        }
        ExrError::Invalid(what) => format!("malformed EXR: {what}"),
        ExrError::Io(e) => super::atomic::reason(&e),
        ExrError::Aborted => "aborted".to_string(),
    }
}

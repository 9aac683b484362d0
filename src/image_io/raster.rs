//! PNG, JPEG, BMP, TGA and Radiance HDR by way of the `image` crate.

use std::io::Cursor;

use image::codecs::hdr::HdrEncoder;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageReader};

use super::bitmap::{Bitmap, Encoding, Pixels};
use super::color::linear_to_srgb;
use super::{Kind, MAX_PIXELS, Samples, check_size, guarded};
use crate::math::Rgb;

/// Quality of written JPEG files, 1..100; at 95 the loss is below what a screen shows.
const JPEG_QUALITY: u8 = 95;

pub(super) fn decode(bytes: &[u8], kind: Kind) -> Result<Bitmap, String> {
    if !is_complete(bytes, kind) {
        return Err("the file is cut off".to_string());
    }
    let renamed = radiance_mark(bytes, kind);
    let bytes = renamed.as_deref().unwrap_or(bytes);
    guarded(|| {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format(kind)?);
        let mut limits = image::Limits::default();
        // The size is checked below; this bounds what a decoder takes for itself.
        limits.max_alloc = Some(MAX_PIXELS * 16);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(told)?;
        let (width, height) = decoder.dimensions();
        check_size(width.into(), height.into())?;
        let encoding = match decoder.color_type() {
            ColorType::Rgb32F | ColorType::Rgba32F => Encoding::Linear,
            _ => Encoding::Srgb,
        };
        let picture = DynamicImage::from_decoder(decoder).map_err(told)?;
        let (channels, pixels) = match picture {
            DynamicImage::ImageLuma8(b) => (1, Pixels::U8(b.into_raw())),
            DynamicImage::ImageLumaA8(b) => (2, Pixels::U8(b.into_raw())),
            DynamicImage::ImageRgb8(b) => (3, Pixels::U8(b.into_raw())),
            DynamicImage::ImageRgba8(b) => (4, Pixels::U8(b.into_raw())),
            DynamicImage::ImageLuma16(b) => (1, unit(b.into_raw())),
            DynamicImage::ImageLumaA16(b) => (2, unit(b.into_raw())),
            DynamicImage::ImageRgb16(b) => (3, unit(b.into_raw())),
            DynamicImage::ImageRgba16(b) => (4, unit(b.into_raw())),
            DynamicImage::ImageRgb32F(b) => (3, Pixels::F32(b.into_raw())),
            DynamicImage::ImageRgba32F(b) => (4, Pixels::F32(b.into_raw())),
            _ => return Err("the kind of pixels is not supported".to_string()),
        };
        Ok(Bitmap {
            width: width as usize,
            height: height as usize,
            channels,
            encoding,
            pixels,
        })
    })
}

/// A Radiance file that begins with the mark of another program (Mitsuba writes `#?RGBE`), with the mark
/// that the decoder knows.
fn radiance_mark(bytes: &[u8], kind: Kind) -> Option<Vec<u8>> {
    const MARK: &[u8] = b"#?RADIANCE";
    if kind != Kind::Hdr || bytes.starts_with(MARK) {
        return None;
    }
    let end = bytes.iter().position(|b| *b == b'\n')?;
    Some([MARK, &bytes[end..]].concat())
}

/// Whether the end mark of the format is there. The JPEG decoder paints what is missing grey without
/// a word, and a PNG without its last bytes may be a copy that has not ended.
fn is_complete(bytes: &[u8], kind: Kind) -> bool {
    let holds = |mark: &[u8], part: &[u8]| part.windows(mark.len()).rev().any(|w| w == mark);
    match kind {
        Kind::Png => holds(b"IEND\xae\x42\x60\x82", bytes),
        // After the start of a scan: a preview in the header has an end mark of its own.
        Kind::Jpeg => jpeg_scan(bytes).is_some_and(|scan| holds(b"\xff\xd9", scan)),
        _ => true,
    }
}

/// What follows the first start-of-scan marker of a JPEG file (ITU-T T.81, annex B).
fn jpeg_scan(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes.get(2..)?;
    loop {
        match rest {
            [0xff, 0xff, ..] => rest = &rest[1..],
            [0xff, 0xda, scan @ ..] => return Some(scan),
            [0xff, _, hi, lo, ..] => {
                let length = usize::from(u16::from_be_bytes([*hi, *lo]));
                rest = rest.get(2 + length..)?;
            }
            _ => return None,
        }
    }
}

fn unit(raw: Vec<u16>) -> Pixels {
    Pixels::F32(raw.iter().map(|&v| f32::from(v) / 65535.0).collect())
}

/// PNG or JPEG: sRGB curve, exposure 0, 8 bit. NaN becomes black. `alpha` is taken as EXR means it
/// (colours already multiplied by it); PNG wants the colours without it.
pub(super) fn encode_ldr(
    width: usize,
    height: usize,
    pixels: &[Rgb],
    alpha: Option<&Samples>,
    kind: Kind,
) -> Result<Vec<u8>, String> {
    let mut raw = Vec::with_capacity(pixels.len() * 4);
    for (i, &pixel) in pixels.iter().enumerate() {
        let a = alpha.map(|a| a.get(i));
        let straight = match a {
            Some(a) if a > 0.0 => pixel / a,
            _ => pixel,
        };
        raw.extend(straight.to_array().map(|v| byte(linear_to_srgb(v))));
        raw.extend(a.map(byte));
    }
    let colour = match alpha {
        Some(_) => ExtendedColorType::Rgba8,
        None => ExtendedColorType::Rgb8,
    };
    let (w, h) = sides(width, height)?;
    let mut out = Vec::new();
    match kind {
        Kind::Jpeg => JpegEncoder::new_with_quality(&mut out, JPEG_QUALITY)
            .write_image(&raw, w, h, colour)
            .map_err(told)?,
        _ => PngEncoder::new(&mut out)
            .write_image(&raw, w, h, colour)
            .map_err(told)?,
    }
    Ok(out)
}

/// Radiance RGBE: 8 bits of mantissa, so an error of up to 0.4 % of the largest channel.
pub(super) fn encode_hdr(width: usize, height: usize, pixels: &[Rgb]) -> Result<Vec<u8>, String> {
    sides(width, height)?;
    let raw: Vec<_> = pixels.iter().map(|p| image::Rgb(p.to_array())).collect();
    let mut out = Vec::new();
    HdrEncoder::new(&mut out)
        .encode(&raw, width, height)
        .map_err(told)?;
    Ok(out)
}

/// 0..1 to 0..255, rounded; NaN to 0.
fn byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn sides(width: usize, height: usize) -> Result<(u32, u32), String> {
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w), Ok(h)) => Ok((w, h)),
        _ => Err(format!("{width} x {height} pixels are too many")),
    }
}

fn format(kind: Kind) -> Result<image::ImageFormat, String> {
    Ok(match kind {
        Kind::Png => image::ImageFormat::Png,
        Kind::Jpeg => image::ImageFormat::Jpeg,
        Kind::Bmp => image::ImageFormat::Bmp,
        Kind::Tga => image::ImageFormat::Tga,
        Kind::Hdr => image::ImageFormat::Hdr,
        Kind::Exr | Kind::Pfm => return Err("not a file for this reader".to_string()),
    })
}

fn told(e: image::ImageError) -> String {
    match e {
        image::ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the file is cut off".to_string()
        }
        e => e.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiance_files_of_other_programs_are_read() {
        let pixels = [Rgb::new(0.5, 1.0, 2.0), Rgb::new(0.25, 0.125, 4.0)];
        let ours = encode_hdr(2, 1, &pixels).unwrap();
        let rest = ours.strip_prefix(b"#?RADIANCE").unwrap();
        let theirs = [b"#?RGBE", rest].concat();
        assert_eq!(decode(&theirs, Kind::Hdr), decode(&ours, Kind::Hdr));
        assert!(decode(&ours, Kind::Hdr).is_ok());
        assert!(decode(b"#?RGBE", Kind::Hdr).is_err());
    }
}

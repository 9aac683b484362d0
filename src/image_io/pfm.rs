//! Portable float map: `PF` (colour) or `Pf` (grey), rows from the bottom, 32-bit floats whose byte
//! order is the sign of the scale in the header (negative: little endian). Format as described by
//! Debevec, <https://www.pauldebevec.com/Research/HDR/PFM/>.

use super::bitmap::{Bitmap, Encoding, Pixels};
use super::check_size;
use crate::math::Rgb;

pub(super) fn decode(bytes: &[u8]) -> Result<Bitmap, String> {
    let mut rest = bytes;
    let channels = match token(&mut rest)? {
        "PF" => 3,
        "Pf" => 1,
        other => return Err(format!("the header begins with {other:?}, not PF or Pf")),
    };
    let width = number::<u32>(&mut rest, "width")?;
    let height = number::<u32>(&mut rest, "height")?;
    let scale = number::<f32>(&mut rest, "scale")?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(format!("the scale in the header is {scale}"));
    }
    check_size(width.into(), height.into())?;
    let (width, height) = (width as usize, height as usize);
    let row = width * channels;
    let need = row * height * 4;
    if rest.len() < need {
        return Err(format!(
            "the file is cut off: {width} x {height} pixels need {need} bytes, {} are there",
            rest.len()
        ));
    }
    let value = |b: &[u8]| {
        let b = [b[0], b[1], b[2], b[3]];
        if scale < 0.0 {
            f32::from_le_bytes(b)
        } else {
            f32::from_be_bytes(b)
        }
    };
    // The magnitude of the scale is a unit of luminance that programs agree to ignore.
    let mut pixels = Vec::with_capacity(row * height);
    for line in rest[..need].chunks_exact(row * 4).rev() {
        pixels.extend(line.chunks_exact(4).map(value));
    }
    Ok(Bitmap {
        width,
        height,
        channels,
        encoding: Encoding::Linear,
        pixels: Pixels::F32(pixels),
    })
}

pub(super) fn encode(width: usize, height: usize, pixels: &[Rgb]) -> Vec<u8> {
    let mut out = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    out.reserve(pixels.len() * 12);
    for row in pixels.chunks_exact(width).rev() {
        for v in row.iter().flat_map(|c| c.to_array()) {
            out.extend_from_slice(&v.to_le_bytes());
        }
    }
    out
}

/// The next word, and the single white space after it (what follows the last word is data).
fn token<'a>(rest: &mut &'a [u8]) -> Result<&'a str, String> {
    const CUT: &str = "the file is cut off inside its header";
    let start = rest.iter().position(|b| !b.is_ascii_whitespace());
    let text = &rest[start.ok_or(CUT)?..];
    let len = text.iter().position(|b| b.is_ascii_whitespace());
    let len = len.ok_or(CUT)?;
    *rest = &text[len + 1..];
    std::str::from_utf8(&text[..len]).map_err(|_| "the header is not text".to_string())
}

fn number<T: std::str::FromStr>(rest: &mut &[u8], what: &str) -> Result<T, String> {
    let text = token(rest)?;
    text.parse()
        .map_err(|_| format!("the {what} in the header is {text:?}"))
}

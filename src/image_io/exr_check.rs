//! What is refused before the EXR decoder sees a file: sizes beyond our limits, kinds of pixels that we
//! have no use for, and numbers for which the decoder would take memory without bound.

use std::io::Cursor;

use ::exr::block::chunk::CompressedBlock;
use ::exr::block::reader::ChunksReader;
use ::exr::meta::header::Header;
use ::exr::meta::{BlockDescription, MetaData};
use ::exr::prelude::{Compression, Vec2};

use super::exr_file::told;
use super::{MAX_SAMPLES, check_size};

/// Largest coordinate of a data or display window that is accepted: far from integer overflow.
const MAX_COORDINATE: i32 = 1 << 28;

/// Reads the headers and refuses what the decoder cannot or must not handle.
pub(super) fn checked_headers(bytes: &[u8]) -> Result<Vec<Header>, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(told)?;
    if meta.headers.is_empty() {
        return Err("the file has no parts".to_string());
    }
    let mut samples = 0u64;
    for header in &meta.headers {
        if header.deep {
            return Err("deep pixels are not supported".to_string());
        }
        let Vec2(width, height) = header.layer_size;
        check_size(width as u64, height as u64)?;
        let shared = &header.shared_attributes.display_window;
        check_size(shared.size.0 as u64, shared.size.1 as u64)?;
        let at = header.own_attributes.layer_position;
        for coordinate in [at.0, at.1, shared.position.0, shared.position.1] {
            if coordinate.unsigned_abs() > MAX_COORDINATE.unsigned_abs() {
                return Err(format!("the picture lies at coordinate {coordinate}"));
            }
        }
        for channel in &header.channels.list {
            if channel.sampling != Vec2(1, 1) {
                return Err(format!(
                    "channel \"{}\" is stored at a lower resolution, which is not supported",
                    channel.name
                ));
            }
        }
        samples += width as u64 * height as u64 * header.channels.list.len() as u64;
        if samples > MAX_SAMPLES {
            return Err(format!(
                "the channels hold more than the {MAX_SAMPLES} samples that luxel accepts"
            ));
        }
        let raw = (width * height) as u64 * header.channels.bytes_per_pixel as u64;
        if raw / largest_ratio(header) > bytes.len() as u64 {
            return Err(format!(
                "the file is cut off: {} bytes cannot hold {width} x {height} pixels",
                bytes.len()
            ));
        }
        if let BlockDescription::Tiles(tiles) = &header.blocks {
            check_size(tiles.tile_size.0 as u64, tiles.tile_size.1 as u64)?;
        }
        // Each chunk has an entry of 8 bytes in a table of offsets: no table, no chunk, no memory.
        if header.chunk_count as u64 > bytes.len() as u64 / 8 {
            return Err(
                "the file is cut off: it has fewer chunks than its header says".to_string(),
            );
        }
    }
    let headers: Vec<Header> = meta.headers.into_iter().collect();
    if headers.iter().any(is_dwa) {
        check_dwa_chunks(bytes, &headers)?;
    }
    Ok(headers)
}

/// How much smaller a compression can make pixels at the very best, generously rounded up: deflate by
/// 1032, the run lengths of PIZ by less, DWA leaves 2 bytes of a black block of 64 samples to deflate.
fn largest_ratio(header: &Header) -> u64 {
    match header.compression {
        Compression::Uncompressed => 1,
        _ if is_dwa(header) => 1 << 18,
        _ => 1 << 14,
    }
}

fn is_dwa(header: &Header) -> bool {
    matches!(
        header.compression,
        Compression::DWAA(_) | Compression::DWAB(_)
    )
}

/// A chunk of DWA compression begins with the sizes of its sections after decompression; the decoder
/// (exr 1.74) allocates what they say, and a process that runs out of memory cannot be saved. None can
/// be much larger than the pixels of the chunk.
fn check_dwa_chunks(bytes: &[u8], headers: &[Header]) -> Result<(), String> {
    /// Places among the eleven numbers at the start: uncompressed sizes of the sections without loss
    /// and of run lengths, the latter unpacked, and the numbers of AC and DC coefficients.
    const SIZES: [usize; 5] = [1, 6, 7, 8, 9];
    /// Blocks of 8 x 8 are complete, however few of their pixels the picture has.
    const LEAST: u64 = 1 << 20;
    let reader = ::exr::block::read(Cursor::new(bytes), false).map_err(told)?;
    let mut chunks = reader.filter_chunks(false, |_, _, _| true).map_err(told)?;
    while let Some(chunk) = chunks.read_next_chunk() {
        let chunk = chunk.map_err(told)?;
        let Some(header) = headers.get(chunk.layer_index).filter(|h| is_dwa(h)) else {
            continue;
        };
        let data = match &chunk.compressed_block {
            CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
            CompressedBlock::Tile(block) => &block.compressed_pixels_le,
            _ => return Err("deep pixels are not supported".to_string()),
        };
        let tile = header.get_block_data_indices(&chunk.compressed_block);
        let pixels = tile.and_then(|tile| header.get_absolute_block_pixel_coordinates(tile));
        let pixels = pixels.map_err(told)?.size.area();
        let raw = pixels as u64 * header.channels.bytes_per_pixel as u64;
        // A chunk that DWA would not make smaller is stored as it is.
        if data.len() as u64 == raw {
            continue;
        }
        let limit = LEAST.max(16 * raw);
        let numbers: Vec<u64> = data
            .chunks_exact(8)
            .take(11)
            .map(|b| b.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b)))
            .collect();
        if SIZES
            .iter()
            .any(|&i| numbers.get(i).is_some_and(|&n| n > limit))
        {
            return Err("malformed EXR: a chunk claims more data than it has pixels".to_string());
        }
    }
    Ok(())
}

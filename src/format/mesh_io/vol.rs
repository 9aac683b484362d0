//! Mitsuba's binary volume grids (`.vol`): the mark "VOL", a version byte, the kind of numbers, the size,
//! channels and a box, then the numbers, channels first and x next, all little-endian.

use super::Wrong;

/// A grid of single numbers. The box of the file is not kept.
#[derive(Clone, Debug, PartialEq)]
pub struct GridData {
    /// Numbers along x, y and z.
    pub size: [usize; 3],
    /// x runs fastest.
    pub values: Vec<f32>,
}

const HEADER: usize = 48;
const VERSION: u8 = 3;
/// Numbers of 32 bits.
const FLOAT: u32 = 1;

pub fn parse(bytes: &[u8]) -> Result<GridData, Wrong> {
    grid(bytes).map_err(|what| (None, what))
}

fn grid(bytes: &[u8]) -> Result<GridData, String> {
    let Some(rest) = bytes.strip_prefix(b"VOL") else {
        return Err("not a volume grid: the first three bytes are not \"VOL\"".into());
    };
    if bytes.len() < HEADER {
        return Err("the file is truncated".into());
    }
    if rest[0] != VERSION {
        return Err(format!(
            "version {} is not supported: it must be {VERSION}",
            rest[0]
        ));
    }
    let words: Vec<u32> = bytes[4..24]
        .chunks_exact(4)
        .filter_map(|b| b.first_chunk().map(|b| u32::from_le_bytes(*b)))
        .collect();
    let &[kind, x, y, z, channels] = words.as_slice() else {
        return Err("the file is truncated".into());
    };
    if kind != FLOAT {
        return Err(format!(
            "its numbers are of type {kind}, which is not supported: they must be 32-bit floats (type 1)"
        ));
    }
    if channels != 1 {
        return Err(format!("it has {channels} channels, not 1"));
    }
    let size = [x, y, z].map(|n| n as usize);
    let body = &bytes[HEADER..];
    let count = size.iter().try_fold(1usize, |n, side| n.checked_mul(*side));
    let need = count.and_then(|n| n.checked_mul(4));
    let Some(data) = need.and_then(|need| body.get(..need)) else {
        return Err(format!(
            "the file is truncated: {x} x {y} x {z} numbers do not fit into the {} bytes after the header",
            body.len()
        ));
    };
    let values = data.chunks_exact(4);
    let values = values.filter_map(|b| b.first_chunk().map(|b| f32::from_le_bytes(*b)));
    Ok(GridData {
        size,
        values: values.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, words: [u32; 5], values: &[f32]) -> Vec<u8> {
        let mut bytes = b"VOL".to_vec();
        bytes.push(version);
        bytes.extend(words.iter().flat_map(|w| w.to_le_bytes()));
        bytes.extend([0; 24]);
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    }

    #[test]
    fn a_grid_is_read_and_nothing_else() {
        let values: Vec<f32> = (0u8..12).map(f32::from).collect();
        let good = file(3, [1, 3, 2, 2, 1], &values);
        let grid = parse(&good).unwrap();
        assert_eq!((grid.size, &grid.values), ([3, 2, 2], &values));
        for cut in 0..good.len() {
            assert!(parse(&good[..cut]).is_err(), "{cut}");
        }
        let says = |bytes: &[u8], what: &str| {
            assert_eq!(parse(bytes), Err((None, what.into())));
        };
        says(
            b"ply",
            "not a volume grid: the first three bytes are not \"VOL\"",
        );
        says(b"VOL", "the file is truncated");
        says(
            &file(2, [1, 3, 2, 2, 1], &values),
            "version 2 is not supported: it must be 3",
        );
        says(
            &file(3, [2, 3, 2, 2, 1], &values),
            "its numbers are of type 2, which is not supported: they must be 32-bit floats (type 1)",
        );
        says(
            &file(3, [1, 3, 2, 2, 3], &values),
            "it has 3 channels, not 1",
        );
        says(
            &file(3, [1, u32::MAX, u32::MAX, 2, 1], &values),
            "the file is truncated: 4294967295 x 4294967295 x 2 numbers do not fit into the 48 bytes after the header",
        );
    }
}

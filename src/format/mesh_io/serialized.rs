//! Mitsuba's compressed mesh container: several meshes in one file, each zlib-compressed.
//!
//! A mesh is two 16-bit words (a mark and the version) and a zlib stream of flags, name (from version 4
//! on), counts, positions, normals, texture coordinates, colours and triangles, all little-endian. At the
//! end of the file stand the offset of every mesh (32 bits in version 3, 64 in version 4) and their number.
//!
//! As in Mitsuba 3.9, vertex colours and the flag for face normals are read over.

use std::io::Read;

use flate2::bufread::ZlibDecoder;

use super::super::limits::MESH_FILE_BYTES;
use super::{MeshData, Wrong};
use crate::math::{DVec3, Vec2, Vec3};

const MARK: u16 = 0x041c;
const HAS_NORMALS: u32 = 0x0001;
const HAS_UVS: u32 = 0x0002;
const HAS_COLORS: u32 = 0x0008;
const DOUBLE: u32 = 0x2000;

/// Deflate cannot pack better than this: two bits for 258 bytes (RFC 1951, section 3.2.5).
const BEST_RATIO: u64 = 1032;
/// Longest name of a mesh.
const NAME_BYTES: usize = 1 << 16;
/// Bytes that are unpacked at a time.
const CHUNK: usize = 1 << 16;

/// Mesh number `index` of the file, from 0.
pub fn parse(bytes: &[u8], index: usize) -> Result<MeshData, Wrong> {
    container(bytes, index).map_err(|what| (None, what))
}

fn container(bytes: &[u8], index: usize) -> Result<MeshData, String> {
    let version = version_at(bytes, 0)?;
    // The first mesh needs no table, and some files have none.
    let (start, end) = match index {
        0 => (0, bytes.len()),
        _ => entry(bytes, version, index)?,
    };
    if index > 0 {
        version_at(bytes, start)?;
    }
    let packed = bytes.get(start + 4..end).unwrap_or_default();
    mesh(packed, version)
}

/// The version of the mesh whose header stands at byte `at`.
fn version_at(bytes: &[u8], at: usize) -> Result<u16, String> {
    let header = bytes.get(at..).and_then(|rest| rest.first_chunk());
    let Some(&[m0, m1, v0, v1]) = header else {
        return Err("the file is truncated".into());
    };
    if u16::from_le_bytes([m0, m1]) != MARK {
        return Err(match at {
            0 => "not a serialized mesh: the first two bytes are not 1C 04".into(),
            _ => format!("no mesh begins at byte {at}, where the table at the end says so"),
        });
    }
    match u16::from_le_bytes([v0, v1]) {
        version @ (3 | 4) => Ok(version),
        other => Err(format!(
            "version {other} is not supported: it must be 3 or 4"
        )),
    }
}

/// First byte of mesh `index` and the one where the table of meshes begins.
fn entry(bytes: &[u8], version: u16, index: usize) -> Result<(usize, usize), String> {
    let no_table = || "the file has no table of meshes at its end".to_string();
    let (rest, count) = bytes.split_last_chunk().ok_or_else(no_table)?;
    let count = u32::from_le_bytes(*count) as usize;
    let width = if version == 3 { 4 } else { 8 };
    let table = count
        .checked_mul(width)
        .and_then(|size| rest.len().checked_sub(size))
        .filter(|_| count > 0)
        .ok_or_else(no_table)?;
    if index >= count {
        return Err(format!(
            "shape_index {index} is out of range: the file holds {count} meshes, counted from 0"
        ));
    }
    let mut offset = [0; 8];
    offset[..width].copy_from_slice(&rest[table + index * width..][..width]);
    usize::try_from(u64::from_le_bytes(offset))
        .ok()
        .filter(|offset| *offset < table)
        .map(|offset| (offset, table))
        .ok_or_else(|| format!("the table at the end puts mesh {index} outside of the file"))
}

fn mesh(packed: &[u8], version: u16) -> Result<MeshData, String> {
    let mut stream = Stream {
        zlib: ZlibDecoder::new(packed),
        double: false,
    };
    let flags = u32::from_le_bytes(stream.bytes()?);
    stream.double = flags & DOUBLE != 0;
    if version >= 4 {
        stream.skip_name()?;
    }
    let vertices = u64::from_le_bytes(stream.bytes()?);
    let triangles = u64::from_le_bytes(stream.bytes()?);
    if vertices >= u64::from(u32::MAX) {
        return Err("more than 4 billion vertices".into());
    }
    check_size(flags, vertices, triangles, packed.len() as u64)?;

    let mut mesh = MeshData::default();
    stream.rows(vertices, |v: [f64; 3]| mesh.positions.push(v.into()))?;
    if flags & HAS_NORMALS != 0 {
        let mut normals = Vec::new();
        stream.rows(vertices, |v| normals.push(DVec3::from(v).as_vec3()))?;
        mesh.normals = Some(normals);
    }
    if flags & HAS_UVS != 0 {
        let mut uvs = Vec::new();
        stream.rows(vertices, |[u, v]| uvs.push(Vec2::new(u as f32, v as f32)))?;
        mesh.uvs = Some(uvs);
    }
    if flags & HAS_COLORS != 0 {
        stream.rows(vertices, |_: [f64; 3]| ())?;
    }
    let mut outside = None;
    stream.blocks(triangles, 12, |row| {
        let triangle = indices(row);
        let bad = triangle.iter().find(|i| u64::from(**i) >= vertices);
        outside = outside.or(bad.copied());
        mesh.indices.push(triangle);
    })?;
    if let Some(index) = outside {
        return Err(format!(
            "vertex index {index} is out of range: there are {vertices} vertices"
        ));
    }
    check_finite(&mesh)?;
    stream.end()?;
    Ok(mesh)
}

/// Refuses counts that the packed bytes cannot hold and sizes that are too much for memory.
fn check_size(flags: u32, vertices: u64, triangles: u64, packed: u64) -> Result<(), String> {
    let has = |flag: u32, numbers: u64| if flags & flag != 0 { numbers } else { 0 };
    let numbers = 3 + has(HAS_NORMALS, 3) + has(HAS_UVS, 2) + has(HAS_COLORS, 3);
    let size = if flags & DOUBLE != 0 { 8 } else { 4 };
    let bytes = (vertices * numbers * size).saturating_add(triangles.saturating_mul(12));
    if bytes > packed.saturating_mul(BEST_RATIO) {
        return Err(format!(
            "the file is truncated: {vertices} vertices and {triangles} triangles do not fit into it"
        ));
    }
    if bytes > MESH_FILE_BYTES {
        let gib = MESH_FILE_BYTES >> 30;
        return Err(format!("unpacked, it is larger than {gib} GiB"));
    }
    Ok(())
}

fn check_finite(mesh: &MeshData) -> Result<(), String> {
    let normals: &[Vec3] = mesh.normals.as_deref().unwrap_or_default();
    let uvs: &[Vec2] = mesh.uvs.as_deref().unwrap_or_default();
    let bad = mesh.positions.iter().position(|p| !p.is_finite());
    let bad = bad.or_else(|| normals.iter().position(|n| !n.is_finite()));
    let bad = bad.or_else(|| uvs.iter().position(|uv| !uv.is_finite()));
    match bad {
        Some(i) => Err(format!("vertex {i} is not finite")),
        None => Ok(()),
    }
}

fn indices(row: &[u8]) -> [u32; 3] {
    let mut words = row.chunks_exact(4);
    std::array::from_fn(|_| {
        let word = words.next().and_then(|w| w.first_chunk());
        word.map_or(u32::MAX, |w| u32::from_le_bytes(*w))
    })
}

/// The unpacked bytes of a mesh.
struct Stream<'a> {
    zlib: ZlibDecoder<&'a [u8]>,
    /// Real numbers take 8 bytes instead of 4.
    double: bool,
}

impl Stream<'_> {
    fn fill(&mut self, buffer: &mut [u8]) -> Result<(), String> {
        self.zlib.read_exact(buffer).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => "the file is truncated".to_string(),
            _ => "the compressed data are damaged".to_string(),
        })
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    fn skip_name(&mut self) -> Result<(), String> {
        for _ in 0..NAME_BYTES {
            if self.bytes()? == [0] {
                return Ok(());
            }
        }
        Err(format!(
            "the name of the mesh does not end within {NAME_BYTES} bytes"
        ))
    }

    /// `count` blocks of `size` bytes. Unpacks a piece at a time: what is not there fills no memory.
    fn blocks(
        &mut self,
        count: u64,
        size: usize,
        mut block: impl FnMut(&[u8]),
    ) -> Result<(), String> {
        let mut buffer = vec![0; CHUNK / size * size];
        let mut left = count;
        while left > 0 {
            let now = left.min((CHUNK / size) as u64);
            let piece = &mut buffer[..now as usize * size];
            self.fill(piece)?;
            piece.chunks_exact(size).for_each(&mut block);
            left -= now;
        }
        Ok(())
    }

    /// `count` rows of `N` real numbers.
    fn rows<const N: usize>(
        &mut self,
        count: u64,
        mut row: impl FnMut([f64; N]),
    ) -> Result<(), String> {
        let double = self.double;
        let size = if double { 8 } else { 4 };
        self.blocks(count, N * size, |bytes| {
            let mut numbers = bytes.chunks_exact(size).map(|b| match *b {
                [a, b, c, d] => f32::from_le_bytes([a, b, c, d]).into(),
                [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
                _ => f64::NAN,
            });
            row(std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN)));
        })
    }

    /// Runs over what may follow, so that the check sum of the stream is looked at.
    fn end(&mut self) -> Result<(), String> {
        let mut rest = [0; 256];
        for _ in 0..CHUNK {
            match self.zlib.read(&mut rest) {
                Ok(0) => return Ok(()),
                Ok(_) => {}
                Err(_) => return Err("the compressed data are damaged".into()),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::{Compression, write::ZlibEncoder};
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;
    use std::io::Write;

    const POSITIONS: [[f64; 3]; 4] = [[0.0; 3], [1.5, 0.0, 0.0], [1.5, 1.0, 0.0], [0.0, 1.0, 0.25]];
    const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    /// A compressed stream: `numbers` rows of reals after the counts, then the triangles.
    fn stream(version: u16, flags: u32, rows: &[&[f64]], triangles: &[[u32; 3]]) -> Vec<u8> {
        let mut raw = flags.to_le_bytes().to_vec();
        if version == 4 {
            raw.extend(b"a name\0");
        }
        raw.extend(4u64.to_le_bytes());
        raw.extend((triangles.len() as u64).to_le_bytes());
        for x in rows.iter().copied().flatten() {
            match flags & DOUBLE {
                0 => raw.extend((*x as f32).to_le_bytes()),
                _ => raw.extend(x.to_le_bytes()),
            }
        }
        for i in triangles.as_flattened() {
            raw.extend(i.to_le_bytes());
        }
        packed(version, &raw)
    }

    fn packed(version: u16, raw: &[u8]) -> Vec<u8> {
        let header = [MARK.to_le_bytes(), version.to_le_bytes()].concat();
        let mut zlib = ZlibEncoder::new(header, Compression::default());
        zlib.write_all(raw).unwrap();
        zlib.finish().unwrap()
    }

    fn file(version: u16, meshes: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = meshes.concat();
        let mut at = 0u64;
        for mesh in meshes {
            match version {
                3 => bytes.extend((at as u32).to_le_bytes()),
                _ => bytes.extend(at.to_le_bytes()),
            }
            at += mesh.len() as u64;
        }
        bytes.extend((meshes.len() as u32).to_le_bytes());
        bytes
    }

    /// Two meshes: positions alone, and one with everything.
    fn two(version: u16, precision: u32) -> Vec<u8> {
        let positions = POSITIONS.as_flattened();
        let normals = [0.0, 0.0, 2.0].repeat(4);
        let uvs: Vec<f64> = (0..8).map(|i| f64::from(i) / 8.0).collect();
        let colors = [1.0, 0.5, 0.25].repeat(4);
        let all = precision | HAS_NORMALS | HAS_UVS | HAS_COLORS;
        let rows: [&[f64]; 4] = [positions, &normals, &uvs, &colors];
        file(
            version,
            &[
                stream(version, precision, &[positions], &TRIANGLES),
                stream(version, all, &rows, &TRIANGLES[..1]),
            ],
        )
    }

    #[test]
    fn both_versions_and_precisions_give_one_mesh() {
        for (version, precision) in [(3, 0), (3, DOUBLE), (4, 0x1000), (4, DOUBLE)] {
            let bytes = two(version, precision);
            let first = parse(&bytes, 0).unwrap();
            assert_eq!(first.indices, TRIANGLES);
            assert_eq!(first.positions, POSITIONS.map(DVec3::from));
            assert_eq!((first.normals, first.uvs), (None, None));
            let second = parse(&bytes, 1).unwrap();
            assert_eq!(second.indices, [[0, 1, 2]]);
            assert_eq!(second.normals.unwrap(), [2.0 * Vec3::Z; 4]);
            assert_eq!(second.uvs.unwrap()[3], Vec2::new(0.75, 0.875));
        }
    }

    #[test]
    fn errors_say_what_is_wrong() {
        let says = |bytes: &[u8], index: usize, what: &str| {
            assert_eq!(parse(bytes, index), Err((None, what.into())));
        };
        let good = two(4, 0);
        let positions: &[&[f64]] = &[POSITIONS.as_flattened()];
        says(b"", 0, "the file is truncated");
        says(
            b"ply\n",
            0,
            "not a serialized mesh: the first two bytes are not 1C 04",
        );
        says(&good[..30], 0, "the file is truncated");
        says(
            &packed(5, b""),
            0,
            "version 5 is not supported: it must be 3 or 4",
        );
        says(
            &good,
            2,
            "shape_index 2 is out of range: the file holds 2 meshes, counted from 0",
        );
        let alone = stream(4, 0, positions, &TRIANGLES);
        assert!(parse(&alone, 0).is_ok());
        says(&alone, 1, "the file has no table of meshes at its end");
        says(
            &stream(4, 0, positions, &[[0, 1, 4]]),
            0,
            "vertex index 4 is out of range: there are 4 vertices",
        );
        let mut far = good.clone();
        let entry = far.len() - 12;
        far[entry + 3] = 9;
        says(
            &far,
            1,
            "the table at the end puts mesh 1 outside of the file",
        );
        far[entry..entry + 4].copy_from_slice(&[7, 0, 0, 0]);
        says(
            &far,
            1,
            "no mesh begins at byte 7, where the table at the end says so",
        );
        let mut damaged = alone;
        let last = damaged.len() - 1;
        damaged[last] ^= 1;
        says(&damaged, 0, "the compressed data are damaged");
        let nan = [f64::NAN; 12];
        says(
            &stream(4, 0, &[&nan], &TRIANGLES),
            0,
            "vertex 0 is not finite",
        );
        let lying = [&[0; 5], &u32::MAX.to_le_bytes()[..3], &[0; 5], &[0xff; 8]].concat();
        says(
            &packed(4, &lying),
            0,
            "the file is truncated: 16777215 vertices and 18446744073709551615 triangles do not fit into it",
        );
        let endless = [&[0; 4][..], &[b'a'; NAME_BYTES + 9]].concat();
        says(
            &packed(4, &endless),
            0,
            "the name of the mesh does not end within 65536 bytes",
        );
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        for version in [3, 4] {
            let bytes = two(version, 0);
            for cut in 0..bytes.len() {
                assert!(parse(&bytes[..cut], 1).is_err(), "{cut}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn garbage_is_no_panic(
            version in 3u16..5,
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
            index in 0usize..3,
        ) {
            let mut bytes = two(version, 0);
            for (at, byte) in changes {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            let _ = parse(&bytes, index);
        }

        #[test]
        fn garbage_inside_is_no_panic(version in 3u16..5, raw in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&packed(version, &raw), 0);
        }
    }
}

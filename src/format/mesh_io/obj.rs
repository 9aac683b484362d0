//! Wavefront OBJ.
//!
//! Written here rather than taken from the crate tobj, which serves as the oracle of `tests/obj.rs`. Around
//! tobj 4.0, errors with lines, corners without an index, index 0 and indices that wrap around would all
//! need a parser of faces of their own before it: it looks at indices only at the end of the file, gives
//! a corner without texture coordinate or normal those of the corner before, and takes index 0 of these for none.
//! Behind it, vertices would have to be joined a second time. A million triangles with all three indices
//! take 1.3 s in tobj alone and 0.6 s here (0.6 and 0.2 s with positions alone).

use super::super::limits::POLYGON_CORNERS;
use super::{MeshData, Wrong, number, push_fan, shown};
use crate::math::{DVec3, Vec2, Vec3};

/// No vertex, texture coordinate or normal.
const NONE: u32 = u32::MAX;

#[derive(Default)]
struct Reader {
    positions: Vec<DVec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// For each position the first of the vertices made from it.
    first: Vec<u32>,
    vertices: Vec<Vertex>,
    indices: Vec<[u32; 3]>,
    polygon: Vec<u32>,
}

/// A position with its texture coordinate and normal; vertices of one position form a chain.
struct Vertex {
    position: u32,
    uv: u32,
    normal: u32,
    next: u32,
}

pub fn parse(bytes: &[u8]) -> Result<MeshData, Wrong> {
    let mut reader = Reader::default();
    let mut joined = Vec::new();
    let mut start_line = 1;
    for (i, line) in bytes.split(|&b| b == b'\n').enumerate() {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        // A backslash joins the next line.
        if let Some(part) = line.strip_suffix(b"\\") {
            joined.extend_from_slice(part);
            joined.push(b' ');
            continue;
        }
        let result = if joined.is_empty() {
            start_line = i + 1;
            reader.line(line)
        } else {
            joined.extend_from_slice(line);
            reader.line(&joined)
        };
        joined.clear();
        result.map_err(|what| (Some(start_line.max(1)), what))?;
        start_line = i + 2;
    }
    if !joined.is_empty() {
        reader
            .line(&joined)
            .map_err(|what| (Some(start_line), what))?;
    }
    Ok(reader.finish())
}

impl Reader {
    fn line(&mut self, line: &[u8]) -> Result<(), String> {
        let line = line.split(|&b| b == b'#').next().unwrap_or_default();
        let mut words = line
            .split(u8::is_ascii_whitespace)
            .filter(|word| !word.is_empty());
        match words.next() {
            Some(b"v") => {
                // Weights and colours may follow.
                let [x, y, z] = numbers(words)?;
                self.positions.push(DVec3::new(x, y, z));
                self.first.push(NONE);
                fits(self.positions.len())
            }
            Some(b"vt") => {
                let [u, v] = numbers(words)?;
                let uv = Vec2::new(u as f32, v as f32);
                self.uvs.push(uv);
                uv.is_finite()
                    .then_some(())
                    .ok_or("texture coordinate too large")?;
                fits(self.uvs.len())
            }
            Some(b"vn") => {
                let [x, y, z] = numbers(words)?;
                let n = Vec3::new(x as f32, y as f32, z as f32);
                self.normals.push(n);
                n.is_finite().then_some(()).ok_or("normal too large")?;
                fits(self.normals.len())
            }
            Some(b"f") => self.face(words),
            _ => Ok(()),
        }
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>) -> Result<(), String> {
        let mut polygon = std::mem::take(&mut self.polygon);
        polygon.clear();
        for word in words {
            let mut parts = word.split(|&b| b == b'/');
            let mut index = |count: usize, of: &str| match parts.next() {
                None | Some(b"") => Ok(NONE),
                Some(part) => resolve(part, count, of),
            };
            let position = index(self.positions.len(), "vertices")?;
            let uv = index(self.uvs.len(), "texture coordinates")?;
            let normal = index(self.normals.len(), "normals")?;
            if position == NONE {
                return Err(format!("\"{}\" names no vertex", shown(word)));
            }
            if polygon.len() == POLYGON_CORNERS {
                return Err(format!("a face with more than {POLYGON_CORNERS} corners"));
            }
            polygon.push(self.vertex(position, uv, normal));
        }
        if polygon.len() < 3 {
            return Err(format!(
                "a face needs at least 3 corners, found {}",
                polygon.len()
            ));
        }
        push_fan(&mut self.indices, &polygon);
        self.polygon = polygon;
        fits(self.vertices.len())
    }

    /// The vertex of these three, made when it is new.
    fn vertex(&mut self, position: u32, uv: u32, normal: u32) -> u32 {
        let mut at = self.first[position as usize];
        while let Some(v) = self.vertices.get(at as usize) {
            if v.uv == uv && v.normal == normal {
                return at;
            }
            at = v.next;
        }
        let new = self.vertices.len() as u32;
        self.vertices.push(Vertex {
            position,
            uv,
            normal,
            next: self.first[position as usize],
        });
        self.first[position as usize] = new;
        new
    }

    fn finish(self) -> MeshData {
        let vertices = &self.vertices;
        let has_uvs = vertices.iter().any(|v| v.uv != NONE);
        let has_normals = vertices.iter().any(|v| v.normal != NONE);
        let uv = |v: &Vertex| self.uvs.get(v.uv as usize).copied().unwrap_or_default();
        let normal = |v: &Vertex| {
            let n = self.normals.get(v.normal as usize);
            n.copied().unwrap_or_default()
        };
        let position = |v: &Vertex| self.positions[v.position as usize];
        MeshData {
            positions: vertices.iter().map(position).collect(),
            normals: has_normals.then(|| vertices.iter().map(normal).collect()),
            uvs: has_uvs.then(|| vertices.iter().map(uv).collect()),
            indices: self.indices,
            ..MeshData::default()
        }
    }
}

fn numbers<'a, const N: usize>(
    mut words: impl Iterator<Item = &'a [u8]>,
) -> Result<[f64; N], String> {
    let mut found = [0.0; N];
    for (i, slot) in found.iter_mut().enumerate() {
        let word = words
            .next()
            .ok_or_else(|| format!("expected {N} numbers, found {i}"))?;
        *slot = number(word)?;
    }
    Ok(found)
}

/// From an index that counts from 1, or back from the newest when negative.
fn resolve(word: &[u8], count: usize, of: &str) -> Result<u32, String> {
    let index = integer(word).ok_or_else(|| format!("\"{}\" is not an index", shown(word)))?;
    let from_zero = match index {
        1.. => index - 1,
        _ => index.saturating_add(count as i64),
    };
    let in_range = index != 0 && (0..count as i64).contains(&from_zero);
    match in_range {
        true => Ok(from_zero as u32),
        false => Err(format!(
            "index {index} is out of range: there are {count} {of} so far"
        )),
    }
}

/// Decimal digits after an optional minus. Faces are most of a file, so this is on the hot path.
fn integer(word: &[u8]) -> Option<i64> {
    let (sign, digits) = match word {
        [b'-', digits @ ..] => (-1, digits),
        digits => (1, digits),
    };
    // 18 digits always fit.
    let good = (1..=18).contains(&digits.len()) && digits.iter().all(u8::is_ascii_digit);
    let value = |v: i64, d: &u8| v * 10 + i64::from(d - b'0');
    good.then(|| sign * digits.iter().fold(0, value))
}

fn fits(count: usize) -> Result<(), String> {
    match count < NONE as usize {
        true => Ok(()),
        false => Err("more than 4 billion vertices".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

    fn read(text: &str) -> Result<MeshData, Wrong> {
        parse(format!("{TRIANGLE}{text}").as_bytes())
    }

    #[test]
    fn corners_that_agree_are_one_vertex() {
        let mesh = read("v 1 1 0\nvt 0 0\nvt 1 0\nf 1/1 2/1 4/1 3/1\nf 1/2 2/1 3/1\n").unwrap();
        assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3], [4, 1, 3]]);
        assert_eq!(mesh.positions[4], DVec3::ZERO);
        assert_eq!(mesh.uvs.unwrap()[4], Vec2::new(1.0, 0.0));
        assert_eq!(mesh.normals, None);
    }

    #[test]
    fn all_ways_to_write_a_face_work() {
        for face in [
            "f 1 2 3",
            "f -3 -2 -1",
            "f 1/1 2/1 3/1",
            "f 1//1 2//1 3//1",
            "f 1/1/1 2/1/1 3/1/1",
            "f\t1 \\\r\n 2 \\\n3 # x",
        ] {
            let mesh = read(&format!(
                "vt 0 0\nvn 0 0 1\no a\ng b\ns 1\nusemtl x\r\n{face}"
            ))
            .unwrap();
            assert_eq!(mesh.indices, [[0, 1, 2]], "{face}");
            assert_eq!(mesh.positions[1], DVec3::X);
        }
        // Normals may be missing at some corners.
        let mesh = read("vn 0 0 1\nf 1//1 2 3").unwrap();
        assert_eq!(mesh.normals.unwrap(), [Vec3::Z, Vec3::ZERO, Vec3::ZERO]);
    }

    #[test]
    fn errors_name_the_line() {
        for (text, line, what) in [
            (
                "f 1 2 4",
                4,
                "index 4 is out of range: there are 3 vertices so far",
            ),
            (
                "f 0 1 2",
                4,
                "index 0 is out of range: there are 3 vertices so far",
            ),
            (
                "f -4 1 2",
                4,
                "index -4 is out of range: there are 3 vertices so far",
            ),
            ("\nf 1 2", 5, "a face needs at least 3 corners, found 2"),
            (
                "f 1/1 2 3",
                4,
                "index 1 is out of range: there are 0 texture coordinates so far",
            ),
            (
                "f 1 \\\n 2 \\\n 9\n",
                4,
                "index 9 is out of range: there are 3 vertices so far",
            ),
            ("f a 2 3", 4, "\"a\" is not an index"),
            ("f / 2 3", 4, "\"/\" names no vertex"),
            ("v 1 x 2", 4, "\"x\" is not a number"),
            ("v 1 nan 2", 4, "\"nan\" is not a finite number"),
            ("v 1 2", 4, "expected 3 numbers, found 2"),
            ("vt 1e39 2", 4, "texture coordinate too large"),
        ] {
            assert_eq!(read(text), Err((Some(line), what.into())), "{text}");
        }
    }
}

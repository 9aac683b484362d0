//! PLY (the Stanford polygon format 1.0): ASCII, and binary in either byte order, any scalar types.

use super::super::limits::POLYGON_CORNERS;
use super::attributes::Columns;
use super::ply_header::{Element, Encoding, Header, Property, Scalar, header};
use super::{MeshData, Wrong, number, push_fan, shown};
use crate::math::{DVec3, Vec2, Vec3};

/// The mesh, with the attributes of the names `wanted`.
pub fn parse(bytes: &[u8], wanted: &[String]) -> Result<MeshData, Wrong> {
    let Header {
        encoding,
        elements,
        at,
        line,
    } = header(bytes)?;
    let mut body = Body { bytes, at, line };
    let mut mesh = MeshData::default();
    for element in &elements {
        body.check_count(encoding, element)?;
        match element.name.as_str() {
            "vertex" => vertices(&mut body, encoding, element, wanted, &mut mesh)?,
            "face" => faces(&mut body, encoding, element, wanted, &mut mesh)?,
            _ => (0..element.count).try_for_each(|_| {
                let mut all = element.properties.iter();
                all.try_for_each(|p| body.property(encoding, p, |_| Ok(())))
            })?,
        }
    }
    let count = mesh.positions.len();
    match mesh
        .indices
        .iter()
        .flatten()
        .find(|&&i| i as usize >= count)
    {
        Some(i) => Err((
            None,
            format!("vertex index {i} is out of range: there are {count} vertices"),
        )),
        None => Ok(mesh),
    }
}

/// What follows the header.
struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Of the next byte, for ASCII.
    line: usize,
}

impl Body<'_> {
    fn wrong(&self, encoding: Encoding, what: impl Into<String>) -> Wrong {
        let line = (encoding == Encoding::Ascii).then_some(self.line);
        (line, what.into())
    }

    /// Refuses a count that the rest of the file cannot hold, before memory is set aside for it.
    fn check_count(&self, encoding: Encoding, element: &Element) -> Result<(), Wrong> {
        let least: usize = element
            .properties
            .iter()
            .map(|p| match encoding {
                // A digit and a blank; the last blank may be missing.
                Encoding::Ascii => 2,
                _ => p.length.unwrap_or(p.scalar).size(),
            })
            .sum();
        let left = self.bytes.len() - self.at;
        if element.count > 0 && element.count.saturating_mul(least.max(1)) > left + 1 {
            let what = format!(
                "the file is truncated: {} elements \"{}\" do not fit into the {left} bytes that are left",
                element.count, element.name
            );
            return Err((None, what));
        }
        Ok(())
    }

    fn scalar(&mut self, encoding: Encoding, scalar: Scalar) -> Result<f64, Wrong> {
        if encoding == Encoding::Ascii {
            return self.word(scalar);
        }
        let size = scalar.size();
        let Some(bytes) = self.bytes.get(self.at..self.at + size) else {
            return Err((None, "the file is truncated".into()));
        };
        self.at += size;
        let mut b = [0; 8];
        b[..size].copy_from_slice(bytes);
        if encoding == Encoding::Big {
            b[..size].reverse();
        }
        let [b0, b1, b2, b3, ..] = b;
        Ok(match scalar {
            Scalar::I8 => i8::from_le_bytes([b0]).into(),
            Scalar::U8 => b0.into(),
            Scalar::I16 => i16::from_le_bytes([b0, b1]).into(),
            Scalar::U16 => u16::from_le_bytes([b0, b1]).into(),
            Scalar::I32 => i32::from_le_bytes([b0, b1, b2, b3]).into(),
            Scalar::U32 => u32::from_le_bytes([b0, b1, b2, b3]).into(),
            Scalar::F32 => f32::from_le_bytes([b0, b1, b2, b3]).into(),
            Scalar::F64 => f64::from_le_bytes(b),
        })
    }

    fn word(&mut self, scalar: Scalar) -> Result<f64, Wrong> {
        while let Some(b) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += usize::from(*b == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(u8::is_ascii_whitespace);
        let word = &rest[..end.unwrap_or(rest.len())];
        if word.is_empty() {
            return Err(self.wrong(Encoding::Ascii, "the file is truncated"));
        }
        self.at += word.len();
        let x = number(word).map_err(|what| self.wrong(Encoding::Ascii, what))?;
        if scalar.is_integer() && x.fract() != 0.0 {
            let what = format!("\"{}\" is not an integer", shown(word));
            return Err(self.wrong(Encoding::Ascii, what));
        }
        Ok(x)
    }

    /// Reads a scalar or each item of a list.
    fn property(
        &mut self,
        encoding: Encoding,
        property: &Property,
        mut item: impl FnMut(f64) -> Result<(), String>,
    ) -> Result<(), Wrong> {
        let count = match property.length {
            None => 1,
            Some(length) => self.length(encoding, length)?,
        };
        for _ in 0..count {
            let x = self.scalar(encoding, property.scalar)?;
            item(x).map_err(|what| self.wrong(encoding, what))?;
        }
        Ok(())
    }

    fn length(&mut self, encoding: Encoding, length: Scalar) -> Result<usize, Wrong> {
        let count = self.scalar(encoding, length)?;
        match (0.0..=POLYGON_CORNERS as f64).contains(&count) {
            true => Ok(count as usize),
            false => Err(self.wrong(encoding, format!("a list of {count} items"))),
        }
    }
}

/// Where the numbers of a vertex go.
const SLOTS: [&[&str]; 8] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx"],
    &["ny"],
    &["nz"],
    &["u", "s", "texture_u", "texture_s"],
    &["v", "t", "texture_v", "texture_t"],
];

fn slot_of(name: &str) -> Option<usize> {
    SLOTS.iter().position(|names| names.contains(&name))
}

fn vertices(
    body: &mut Body<'_>,
    encoding: Encoding,
    element: &Element,
    wanted: &[String],
    mesh: &mut MeshData,
) -> Result<(), Wrong> {
    if element.count >= u32::MAX as usize {
        return Err((None, "more than 4 billion vertices".into()));
    }
    let slot = |p: &Property| match p.length {
        None => slot_of(&p.name),
        Some(_) => None,
    };
    let slots: Vec<Option<usize>> = element.properties.iter().map(slot).collect();
    let has = |wanted: &[usize]| wanted.iter().all(|s| slots.contains(&Some(*s)));
    if !has(&[0, 1, 2]) {
        return Err((None, "the vertices have no x, y, z".into()));
    }
    let (has_normals, has_uvs) = (has(&[3, 4, 5]), has(&[6, 7]));
    let (mut normals, mut uvs) = (Vec::new(), Vec::new());
    let (mut columns, names) = Columns::new(element, |name| slot_of(name).is_some(), wanted);
    mesh.positions.reserve_exact(element.count);
    if has_normals {
        normals.reserve_exact(element.count);
    }
    if has_uvs {
        uvs.reserve_exact(element.count);
    }
    for i in 0..element.count {
        let mut v = [0.0; SLOTS.len()];
        for (k, (property, slot)) in element.properties.iter().zip(&slots).enumerate() {
            body.property(encoding, property, |x| {
                match slot {
                    Some(slot) => v[*slot] = x,
                    None => columns.set(k, x),
                }
                Ok(())
            })?;
        }
        if !columns.finish_row(1) {
            return Err(body.wrong(
                encoding,
                format!("an attribute of vertex {i} is not finite"),
            ));
        }
        let [x, y, z, nx, ny, nz, s, t] = v;
        let p = DVec3::new(x, y, z);
        let n = Vec3::new(nx as f32, ny as f32, nz as f32);
        let uv = Vec2::new(s as f32, t as f32);
        if !(p.is_finite() && n.is_finite() && uv.is_finite()) {
            return Err(body.wrong(encoding, format!("vertex {i} is not finite")));
        }
        mesh.positions.push(p);
        if has_normals {
            normals.push(n);
        }
        if has_uvs {
            uvs.push(uv);
        }
    }
    mesh.normals = has_normals.then_some(normals);
    mesh.uvs = has_uvs.then_some(uvs);
    mesh.attributes.append(&mut columns.attributes);
    mesh.attribute_names.extend(names);
    Ok(())
}

fn faces(
    body: &mut Body<'_>,
    encoding: Encoding,
    element: &Element,
    wanted: &[String],
    mesh: &mut MeshData,
) -> Result<(), Wrong> {
    let is_corners = |p: &Property| {
        let named = matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
        named && p.length.is_some() && p.scalar.is_integer()
    };
    if element.count > 0 && !element.properties.iter().any(is_corners) {
        return Err((
            None,
            "the faces have no list of integers \"vertex_indices\"".into(),
        ));
    }
    mesh.indices.reserve(element.count);
    // Faces may stand before the vertices; then their indices are checked at the end.
    let limit = match mesh.positions.len() {
        0 => u32::MAX as usize,
        count => count,
    };
    let (mut columns, names) = Columns::new(element, |_| false, wanted);
    let mut polygon = Vec::new();
    for i in 0..element.count {
        polygon.clear();
        for (k, property) in element.properties.iter().enumerate() {
            let keep = is_corners(property);
            body.property(encoding, property, |x| {
                if keep && !(0.0..limit as f64).contains(&x) {
                    return Err(format!(
                        "face {i} has the vertex index {x}, which is out of range"
                    ));
                }
                if keep {
                    polygon.push(x as u32);
                } else {
                    columns.set(k, x);
                }
                Ok(())
            })?;
        }
        if polygon.len() < 3 {
            let what = format!("face {i} has {} corners, not 3 or more", polygon.len());
            return Err(body.wrong(encoding, what));
        }
        push_fan(&mut mesh.indices, &polygon);
        if !columns.finish_row(polygon.len() - 2) {
            return Err(body.wrong(encoding, format!("an attribute of face {i} is not finite")));
        }
    }
    mesh.attributes.append(&mut columns.attributes);
    mesh.attribute_names.extend(names);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "ply\nformat FORMAT 1.0\ncomment made by hand\nelement vertex 4\n\
        property double x\nproperty float y\nproperty float z\nproperty uchar red\n\
        property float s\nproperty float t\nelement edge 1\nproperty list uchar short ends\n\
        element face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\nend_header\n";
    const ROWS: [[f64; 6]; 4] = [
        [0.0, 0.0, 0.0, 7.0, 0.0, 0.0],
        [1.5, 0.0, 0.0, 7.0, 1.0, 0.0],
        [1.5, 1.0, 0.0, 7.0, 1.0, 0.5],
        [0.0, 1.0, 0.25, 7.0, 0.0, 1.0],
    ];

    fn binary(big: bool) -> Vec<u8> {
        let format = if big {
            "binary_big_endian"
        } else {
            "binary_little_endian"
        };
        let mut bytes = HEADER.replace("FORMAT", format).into_bytes();
        let mut push = |le: &[u8]| match big {
            true => bytes.extend(le.iter().rev()),
            false => bytes.extend(le),
        };
        for [x, y, z, red, s, t] in ROWS {
            push(&x.to_le_bytes());
            push(&(y as f32).to_le_bytes());
            push(&(z as f32).to_le_bytes());
            push(&[red as u8]);
            push(&(s as f32).to_le_bytes());
            push(&(t as f32).to_le_bytes());
        }
        push(&[2]);
        push(&0i16.to_le_bytes());
        push(&1i16.to_le_bytes());
        for face in [vec![0i32, 1, 2, 3], vec![2, 1, 0]] {
            push(&[0]);
            push(&[face.len() as u8]);
            face.iter().for_each(|i| push(&i.to_le_bytes()));
        }
        bytes
    }

    fn ascii() -> String {
        let rows = ROWS.map(|r| r.map(|x| x.to_string()).join(" ")).join("\n");
        let header = HEADER.replace("FORMAT", "ascii");
        format!("{header}{rows}\n2 0 1\n0 4 0 1 2 3\n0 3 2 1 0")
    }

    #[test]
    fn the_three_encodings_give_one_mesh() {
        let mesh = parse(ascii().as_bytes(), &[]).unwrap();
        assert_eq!(mesh.indices, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]);
        assert_eq!(mesh.positions[3], DVec3::new(0.0, 1.0, 0.25));
        assert_eq!(mesh.uvs.as_ref().unwrap()[2], Vec2::new(1.0, 0.5));
        assert_eq!(mesh.normals, None);
        assert_eq!(parse(&binary(false), &[]).unwrap(), mesh);
        assert_eq!(parse(&binary(true), &[]).unwrap(), mesh);
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        for bytes in [binary(false), binary(true)] {
            for cut in 0..bytes.len() {
                assert!(parse(&bytes[..cut], &[]).is_err(), "{cut}");
            }
        }
        // The last digit of a text cannot be missed.
        let text = ascii();
        for cut in 0..text.len() - 1 {
            assert!(parse(&text.as_bytes()[..cut], &[]).is_err(), "{cut}");
        }
    }

    #[test]
    fn errors_name_the_line() {
        let lying = "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\n\
            property float y\nproperty float z\nend_header\n0 0 0\n";
        for (text, line, what) in [
            ("", Some(1), "not a PLY file: the first line is not \"ply\""),
            ("ply\nfoo\n", Some(2), "unknown line in the header"),
            (
                "ply\nelement vertex x\n",
                Some(2),
                "the count of the element is no number",
            ),
            (
                "ply\nproperty float x\n",
                Some(2),
                "a property before any element",
            ),
            (
                "ply\nelement a 1\nproperty list float int x\n",
                Some(3),
                "unknown kind of property",
            ),
            ("ply\nend_header\n", Some(2), "the header has no format"),
            (
                lying,
                None,
                "the file is truncated: 4000000000 elements \"vertex\" do not fit into the 6 bytes that are left",
            ),
            (
                &ascii().replace("1.5 0 0", "1.5 nan 0"),
                Some(18),
                "\"nan\" is not a finite number",
            ),
            (
                &ascii().replace("1.5 0 0 7 1", "1.5 0 0 7 1e39"),
                Some(18),
                "vertex 1 is not finite",
            ),
            (
                &ascii().replace("0 3 2 1 0", "0 3 2 1 4"),
                Some(23),
                "face 1 has the vertex index 4, which is out of range",
            ),
            (
                &ascii().replace("0 3 2 1 0", "0 2 2 1"),
                Some(23),
                "face 1 has 2 corners, not 3 or more",
            ),
            (
                &ascii().replace("0 3 2 1 0", "0 3 2 1.5 0"),
                Some(23),
                "\"1.5\" is not an integer",
            ),
        ] {
            assert_eq!(
                parse(text.as_bytes(), &[]),
                Err((line, what.into())),
                "{text}"
            );
        }
    }
}

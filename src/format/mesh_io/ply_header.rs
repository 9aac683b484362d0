//! The header of a PLY file.

use super::Wrong;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

#[derive(Debug)]
pub struct Property {
    pub name: String,
    pub scalar: Scalar,
    /// Type of the length, for a list.
    pub length: Option<Scalar>,
}

#[derive(Debug)]
pub struct Element {
    pub name: String,
    pub count: usize,
    pub properties: Vec<Property>,
}

impl Scalar {
    pub fn from_name(name: &str) -> Option<Scalar> {
        Some(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }

    pub fn size(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    pub fn is_integer(self) -> bool {
        !matches!(self, Scalar::F32 | Scalar::F64)
    }
}

#[derive(Debug)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the body begins: byte, and line from 1.
    pub at: usize,
    pub line: usize,
}

/// What the file holds, and the offset and line where it begins.
pub fn header(bytes: &[u8]) -> Result<Header, Wrong> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    for number in 1.. {
        let wrong = |what: &str| (Some(number), what.to_string());
        let rest = &bytes[at..];
        let Some(end) = rest.iter().position(|&b| b == b'\n') else {
            return Err(wrong(match number {
                1 => "not a PLY file: the first line is not \"ply\"",
                _ => "the header has no \"end_header\"",
            }));
        };
        at += end + 1;
        let line = std::str::from_utf8(&rest[..end]).map_err(|_| wrong("not text"))?;
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match (number, words.as_slice()) {
            (1, ["ply"]) => {}
            (1, _) => return Err(wrong("not a PLY file: the first line is not \"ply\"")),
            (_, [] | ["comment" | "obj_info", ..]) => {}
            (_, ["format", name, "1.0"]) => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::Little,
                    "binary_big_endian" => Encoding::Big,
                    _ => return Err(wrong("unknown format")),
                });
            }
            (_, ["element", name, count]) => elements.push(Element {
                name: name.to_string(),
                count: count
                    .parse()
                    .map_err(|_| wrong("the count of the element is no number"))?,
                properties: Vec::new(),
            }),
            (_, ["property", kind @ ..]) => {
                let element = elements
                    .last_mut()
                    .ok_or_else(|| wrong("a property before any element"))?;
                let property = property(kind).ok_or_else(|| wrong("unknown kind of property"))?;
                element.properties.push(property);
            }
            (_, ["end_header"]) => {
                let encoding = encoding.ok_or_else(|| wrong("the header has no format"))?;
                return Ok(Header {
                    encoding,
                    elements,
                    at,
                    line: number + 1,
                });
            }
            _ => return Err(wrong("unknown line in the header")),
        }
    }
    Err((None, "the header does not end".into()))
}

fn property(kind: &[&str]) -> Option<Property> {
    let (length, scalar, name) = match kind {
        ["list", length, scalar, name] => (Some(*length), *scalar, *name),
        [scalar, name] => (None, *scalar, *name),
        _ => return None,
    };
    let length = match length {
        Some(length) => Some(Scalar::from_name(length).filter(|l| l.is_integer())?),
        None => None,
    };
    Some(Property {
        name: name.into(),
        scalar: Scalar::from_name(scalar)?,
        length,
    })
}

//! The header: format, elements and their properties.

use std::collections::HashSet;

use crate::{Fault, Place, quoted};

/// How the data after the header is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::I8 => "char",
            Self::U8 => "uchar",
            Self::I16 => "short",
            Self::U16 => "ushort",
            Self::I32 => "int",
            Self::U32 => "uint",
            Self::F32 => "float",
            Self::F64 => "double",
        }
    }

    /// Bytes in binary data.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The largest value of an integer type.
    pub fn largest(self) -> Option<f64> {
        Some(match self {
            Self::I8 => f64::from(i8::MAX),
            Self::U8 => f64::from(u8::MAX),
            Self::I16 => f64::from(i16::MAX),
            Self::U16 => f64::from(u16::MAX),
            Self::I32 => f64::from(i32::MAX),
            Self::U32 => f64::from(u32::MAX),
            Self::F32 | Self::F64 => return None,
        })
    }

    fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Clone, Debug)]
pub(crate) struct Property {
    pub name: Vec<u8>,
    pub kind: Kind,
}

#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub name: Vec<u8>,
    pub count: u64,
    pub properties: Vec<Property>,
    /// Line of its declaration.
    pub line: u64,
}

impl Element {
    /// Index of the property called `name`.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.properties
            .iter()
            .position(|p| p.name == name.as_bytes())
    }

    /// Fewest bytes that one element takes: for ASCII a digit and a separator a value, the last separator possibly missing.
    pub fn least_bytes(&self, encoding: Encoding) -> usize {
        let sizes = self.properties.iter().map(|p| match (encoding, p.kind) {
            (Encoding::Ascii, _) => 2,
            (_, Kind::Scalar(s)) | (_, Kind::List { count: s, .. }) => s.size(),
        });
        sizes.sum()
    }

    /// Bytes of one element in binary data, if all have the same.
    pub fn fixed_bytes(&self) -> Option<u64> {
        self.properties.iter().try_fold(0, |sum, p| match p.kind {
            Kind::Scalar(s) => Some(sum + s.size() as u64),
            Kind::List { .. } => None,
        })
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Offset of the first byte after the header.
    pub end: usize,
    /// Lines in the header.
    pub lines: u64,
}

/// Reads the header at the start of `bytes`.
pub(crate) fn parse(bytes: &[u8]) -> Result<Header, Fault> {
    let mut header = Header {
        encoding: Encoding::Ascii,
        elements: Vec::new(),
        end: 0,
        lines: 0,
    };
    let mut encoding = None;
    let mut names = HashSet::new();
    loop {
        let rest = &bytes[header.end..];
        header.lines += 1;
        let fault = |reason: String| Fault {
            place: Place::Line(header.lines),
            reason,
        };
        let Some(length) = rest.iter().position(|&b| b == b'\n') else {
            let reason = if header.lines == 1 {
                not_ply(rest)
            } else {
                "the file ends within the header, before \"end_header\"".into()
            };
            return Err(fault(reason));
        };
        let line = rest[..length].trim_ascii();
        header.end += length + 1;
        if header.lines == 1 {
            if line != b"ply" {
                return Err(fault(not_ply(line)));
            }
            continue;
        }
        let mut words = line
            .split(u8::is_ascii_whitespace)
            .filter(|w| !w.is_empty());
        match words.next() {
            None | Some(b"comment" | b"obj_info") => {}
            Some(b"format") => {
                let (name, version) = (words.next().unwrap_or(b""), words.next().unwrap_or(b""));
                if version != b"1.0" {
                    return Err(fault(format!(
                        "format version {} instead of 1.0",
                        quoted(version)
                    )));
                }
                encoding = Some(match name {
                    b"ascii" => Encoding::Ascii,
                    b"binary_little_endian" => Encoding::LittleEndian,
                    b"binary_big_endian" => Encoding::BigEndian,
                    _ => {
                        let reason = format!(
                            "format {} instead of ascii, binary_little_endian or binary_big_endian",
                            quoted(name)
                        );
                        return Err(fault(reason));
                    }
                });
            }
            Some(b"element") => {
                let (name, count) = (words.next().unwrap_or(b""), words.next().unwrap_or(b""));
                let number = str::from_utf8(count).ok().and_then(|c| c.parse().ok());
                let Some(count) = number else {
                    let reason = format!("element {} has count {}", quoted(name), quoted(count));
                    return Err(fault(reason));
                };
                if !names.insert(name) {
                    return Err(fault(format!("a second element {}", quoted(name))));
                }
                header.elements.push(Element {
                    name: name.to_vec(),
                    count,
                    properties: Vec::new(),
                    line: header.lines,
                });
            }
            Some(b"property") => {
                let property = property(words).map_err(fault)?;
                let Some(element) = header.elements.last_mut() else {
                    return Err(fault("a property before the first element".into()));
                };
                element.properties.push(property);
            }
            Some(b"end_header") => break,
            Some(word) => {
                let reason = format!(
                    "{} instead of format, element, property, comment, obj_info or end_header",
                    quoted(word)
                );
                return Err(fault(reason));
            }
        }
    }
    let place = Place::Line(header.lines);
    header.encoding = encoding.ok_or_else(|| Fault {
        place,
        reason: "the header has no \"format\" line".into(),
    })?;
    Ok(header)
}

fn not_ply(start: &[u8]) -> String {
    format!(
        "not a PLY file: it starts with {} instead of \"ply\"",
        quoted(start)
    )
}

fn property<'a>(mut words: impl Iterator<Item = &'a [u8]>) -> Result<Property, String> {
    let mut next = || words.next().unwrap_or(b"");
    let scalar = |name: &[u8]| {
        Scalar::named(name).ok_or_else(|| format!("unknown property type {}", quoted(name)))
    };
    let first = next();
    let kind = if first == b"list" {
        let (count, item) = (scalar(next())?, scalar(next())?);
        if !count.is_integer() {
            return Err("the count of a list property is not of an integer type".into());
        }
        Kind::List { count, item }
    } else {
        Kind::Scalar(scalar(first)?)
    };
    let name = next();
    if name.is_empty() {
        return Err("a property without a name".into());
    }
    Ok(Property {
        name: name.to_vec(),
        kind,
    })
}

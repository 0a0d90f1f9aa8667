//! The data after the header, value by value.

use crate::header::{Element, Encoding, Header, Kind, Scalar};
use crate::{Fault, Place, quoted};

/// Reads values in the order of the file.
pub(crate) struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
    encoding: Encoding,
    /// Line at `at`; counted for ASCII only.
    line: u64,
}

impl<'a> Body<'a> {
    pub fn new(header: &Header, bytes: &'a [u8]) -> Self {
        Self {
            bytes,
            at: header.end,
            encoding: header.encoding,
            line: header.lines + 1,
        }
    }

    /// How many elements the rest of the file can hold at most, for reserving memory: at most `element.count`.
    pub fn plausible_count(&self, element: &Element) -> usize {
        let left = self.bytes.len() - self.at + 1;
        let most = left / element.least_bytes(self.encoding).max(1);
        usize::try_from(element.count).map_or(most, |count| count.min(most))
    }

    /// Where the next value starts.
    #[inline]
    pub fn place(&mut self) -> Place {
        match self.encoding {
            Encoding::Ascii => {
                self.skip_whitespace();
                Place::Line(self.line)
            }
            _ => Place::Byte(self.at as u64),
        }
    }

    pub fn fault(&mut self, reason: impl Into<String>) -> Fault {
        Fault {
            place: self.place(),
            reason: reason.into(),
        }
    }

    fn skip_whitespace(&mut self) {
        while let Some(b) = self.bytes.get(self.at).filter(|b| b.is_ascii_whitespace()) {
            self.line += u64::from(*b == b'\n');
            self.at += 1;
        }
    }

    /// The next value. f64 holds every scalar type exactly.
    #[inline]
    pub fn value(&mut self, scalar: Scalar) -> Result<f64, Fault> {
        match self.encoding {
            Encoding::Ascii => self.word(scalar),
            Encoding::LittleEndian => self.binary::<true>(scalar),
            Encoding::BigEndian => self.binary::<false>(scalar),
        }
    }

    /// The count of the list that follows, which the rest of the file has room for.
    pub fn list_count(&mut self, count: Scalar, item: Scalar) -> Result<usize, Fault> {
        let (place, n) = (self.place(), self.value(count)?);
        let left = self.bytes.len() - self.at;
        let room = match self.encoding {
            // A digit and a separator each, the last separator possibly missing.
            Encoding::Ascii => left.div_ceil(2),
            _ => left / item.size(),
        };
        if n >= 0.0 && n <= room as f64 {
            return Ok(n as usize);
        }
        let reason = if n < 0.0 {
            format!("a list of {n} values")
        } else {
            format!(
                "a list of {n} values in the last {} bytes of the file",
                left
            )
        };
        Err(Fault { place, reason })
    }

    /// Passes over one property.
    pub fn skip(&mut self, kind: Kind) -> Result<(), Fault> {
        match kind {
            Kind::Scalar(s) => self.value(s).map(drop),
            Kind::List { count, item } => {
                for _ in 0..self.list_count(count, item)? {
                    self.value(item)?;
                }
                Ok(())
            }
        }
    }

    /// Passes over all of an element nobody asked for.
    pub fn skip_element(&mut self, element: &Element) -> Result<(), Fault> {
        // Elements without properties take no room; do not count to 10¹⁸ for them.
        if element.properties.is_empty() {
            return Ok(());
        }
        if self.encoding != Encoding::Ascii
            && let Some(size) = element.fixed_bytes()
        {
            let left = (self.bytes.len() - self.at) as u64;
            return match element.count.checked_mul(size) {
                Some(total) if total <= left => {
                    self.at += total as usize;
                    Ok(())
                }
                _ => Err(self.fault(format!(
                    "the file ends within element {}: {} of {size} bytes each, but {left} bytes are left",
                    quoted(&element.name),
                    element.count
                ))),
            };
        }
        for _ in 0..element.count {
            for property in &element.properties {
                self.skip(property.kind)?;
            }
        }
        Ok(())
    }

    #[inline]
    fn binary<const LITTLE: bool>(&mut self, scalar: Scalar) -> Result<f64, Fault> {
        macro_rules! read {
            ($type:ty) => {{
                let Some(bytes) = self.bytes[self.at..].first_chunk() else {
                    return Err(self.fault("the file ends within the data"));
                };
                self.at += size_of::<$type>();
                let value = if LITTLE {
                    <$type>::from_le_bytes(*bytes)
                } else {
                    <$type>::from_be_bytes(*bytes)
                };
                Ok(value.into())
            }};
        }
        match scalar {
            Scalar::I8 => read!(i8),
            Scalar::U8 => read!(u8),
            Scalar::I16 => read!(i16),
            Scalar::U16 => read!(u16),
            Scalar::I32 => read!(i32),
            Scalar::U32 => read!(u32),
            Scalar::F32 => read!(f32),
            Scalar::F64 => read!(f64),
        }
    }

    fn word(&mut self, scalar: Scalar) -> Result<f64, Fault> {
        self.skip_whitespace();
        let rest = &self.bytes[self.at..];
        let length = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        if length == 0 {
            return Err(self.fault("the file ends within the data"));
        }
        let word = &rest[..length];
        let text = str::from_utf8(word).ok();
        // Integers in range of their type; a float written for an integer ("3.0") is refused.
        let value = text.and_then(|t| match scalar {
            Scalar::I8 => t.parse::<i8>().ok().map(f64::from),
            Scalar::U8 => t.parse::<u8>().ok().map(f64::from),
            Scalar::I16 => t.parse::<i16>().ok().map(f64::from),
            Scalar::U16 => t.parse::<u16>().ok().map(f64::from),
            Scalar::I32 => t.parse::<i32>().ok().map(f64::from),
            Scalar::U32 => t.parse::<u32>().ok().map(f64::from),
            Scalar::F32 | Scalar::F64 => t.parse::<f64>().ok(),
        });
        let value = value.ok_or_else(|| {
            self.fault(format!(
                "{} where a value of type {} is due",
                quoted(word),
                scalar.name()
            ))
        })?;
        self.at += length;
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All memory that a header's or a list's counts decide goes through these two.
    #[test]
    fn counts_are_not_believed() {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            for count in [0, 1, 3, 1000, u64::MAX] {
                for (property, size) in [
                    ("char x", 1),
                    ("float x\nproperty double y", 12),
                    ("list int int x", 4),
                ] {
                    let mut bytes = format!(
                        "ply\nformat {format} 1.0\nelement a {count}\nproperty {property}\nend_header\n"
                    )
                    .into_bytes();
                    let header = crate::header::parse(&bytes).unwrap();
                    bytes.extend([b'9'; 47]);
                    let mut body = Body::new(&header, &bytes);
                    let n = body.plausible_count(&header.elements[0]);
                    let size = if format == "ascii" { 2 } else { size };
                    assert!(
                        n as u64 <= count && n <= 48 / size,
                        "{format} {count} {property}: {n}"
                    );
                    // 99…9 of them, 0x39393939 in binary.
                    assert!(body.list_count(Scalar::I32, Scalar::F64).is_err());
                }
            }
        }
    }

    #[test]
    fn lists_that_just_fit() {
        let header =
            crate::header::parse(b"ply\nformat binary_little_endian 1.0\nend_header\n").unwrap();
        for (room, fits) in [(15, false), (16, true), (17, true)] {
            let mut bytes = vec![0; header.end];
            bytes.push(2);
            bytes.resize(header.end + 1 + room, 0);
            let n = Body::new(&header, &bytes).list_count(Scalar::U8, Scalar::F64);
            assert_eq!(n.is_ok(), fits, "{n:?}");
        }
    }
}

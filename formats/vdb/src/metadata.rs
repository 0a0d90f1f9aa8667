//! Named values attached to a file or a grid.

use std::fmt;

use half::f16;

use crate::error::Parsed;
use crate::reader::Reader;

/// The value of one metadata entry.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum MetaValue {
    /// `string`
    String(String),
    /// `bool`
    Bool(bool),
    /// `int32`
    I32(i32),
    /// `int64`
    I64(i64),
    /// `half`
    F16(f16),
    /// `float`
    F32(f32),
    /// `double`
    F64(f64),
    /// `vec2i`, `vec3i`, `vec4i`: as many numbers as the type's name says.
    Ints(Vec<i32>),
    /// `vec2s`, `vec3s`, `vec4s` and, row by row, `mat3s`, `mat4s`.
    Floats(Vec<f32>),
    /// `vec2d`, `vec3d`, `vec4d` and, row by row, `mat3d`, `mat4d`.
    Doubles(Vec<f64>),
    /// A type this reader does not know: its length in bytes. The bytes are not kept.
    Opaque(u32),
}

impl fmt::Display for MetaValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::String(v) => f.write_str(v),
            Self::Bool(v) => v.fmt(f),
            Self::I32(v) => v.fmt(f),
            Self::I64(v) => v.fmt(f),
            Self::F16(v) => v.fmt(f),
            Self::F32(v) => v.fmt(f),
            Self::F64(v) => v.fmt(f),
            Self::Ints(v) => write!(f, "{v:?}"),
            Self::Floats(v) => write!(f, "{v:?}"),
            Self::Doubles(v) => write!(f, "{v:?}"),
            Self::Opaque(length) => write!(f, "<{length} bytes>"),
        }
    }
}

/// One entry: name, type as the file spells it, value.
#[derive(Clone, Debug, PartialEq)]
pub struct MetaEntry {
    /// The key.
    pub name: String,
    /// The type's name in the file, for example `vec3i`.
    pub type_name: String,
    /// The value.
    pub value: MetaValue,
}

/// Metadata in the order of the file. Statistics in it (`file_voxel_count`, …) are claims of the
/// program that wrote the file; this reader never relies on them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    entries: Vec<MetaEntry>,
}

impl Metadata {
    /// The value stored under `name`; of several, the last, as in OpenVDB.
    pub fn get(&self, name: &str) -> Option<&MetaValue> {
        self.entries
            .iter()
            .rev()
            .find(|entry| entry.name == name)
            .map(|entry| &entry.value)
    }

    /// The string stored under `name`.
    pub fn string(&self, name: &str) -> Option<&str> {
        match self.get(name) {
            Some(MetaValue::String(value)) => Some(value),
            _ => None,
        }
    }

    /// The truth value stored under `name`.
    pub fn bool(&self, name: &str) -> Option<bool> {
        match self.get(name) {
            Some(MetaValue::Bool(value)) => Some(*value),
            _ => None,
        }
    }

    /// All entries, in the order of the file.
    pub fn iter(&self) -> std::slice::Iter<'_, MetaEntry> {
        self.entries.iter()
    }

    /// How many entries there are.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    pub(crate) fn read(reader: &mut Reader<'_>) -> Parsed<Self> {
        let count = reader.u32("the metadata count")?;
        let mut entries = Vec::new();
        for _ in 0..count {
            let name = reader.string("a metadata name")?;
            let type_name = reader.string("a metadata type")?;
            let size = reader.u32("a metadata size")?;
            let value = value(reader, &type_name, size)?;
            // OpenVDB keeps sizes of compressed leaves here for loading later: many bytes, no news.
            if name != "file_delayed_load" {
                entries.push(MetaEntry {
                    name,
                    type_name,
                    value,
                });
            }
        }
        Ok(Self { entries })
    }
}

fn value(reader: &mut Reader<'_>, type_name: &str, size: u32) -> Parsed<MetaValue> {
    let expected = match type_name {
        "bool" => 1,
        "half" => 2,
        "int32" | "float" => 4,
        "int64" | "double" | "vec2i" | "vec2s" => 8,
        "vec3i" | "vec3s" => 12,
        "vec2d" | "vec4i" | "vec4s" => 16,
        "vec3d" => 24,
        "vec4d" => 32,
        "mat3s" => 36,
        "mat4s" => 64,
        "mat3d" => 72,
        "mat4d" => 128,
        _ => size,
    };
    let known = matches!(type_name, "string") || expected == size && is_number(type_name);
    if !known {
        reader.skip(u64::from(size), "a metadata value")?;
        return Ok(MetaValue::Opaque(size));
    }
    let bytes = reader.bytes_checked(size, "a metadata value")?;
    Ok(match type_name {
        "string" => MetaValue::String(String::from_utf8_lossy(bytes).into_owned()),
        "bool" => MetaValue::Bool(bytes[0] != 0),
        "half" => MetaValue::F16(f16::from_le_bytes([bytes[0], bytes[1]])),
        "int32" => MetaValue::I32(numbers(bytes, i32::from_le_bytes)[0]),
        "float" => MetaValue::F32(numbers(bytes, f32::from_le_bytes)[0]),
        "int64" => MetaValue::I64(numbers(bytes, i64::from_le_bytes)[0]),
        "double" => MetaValue::F64(numbers(bytes, f64::from_le_bytes)[0]),
        name if name.ends_with('i') => MetaValue::Ints(numbers(bytes, i32::from_le_bytes)),
        name if name.ends_with('s') => MetaValue::Floats(numbers(bytes, f32::from_le_bytes)),
        _ => MetaValue::Doubles(numbers(bytes, f64::from_le_bytes)),
    })
}

fn is_number(type_name: &str) -> bool {
    matches!(
        type_name,
        "bool"
            | "half"
            | "int32"
            | "int64"
            | "float"
            | "double"
            | "vec2i"
            | "vec2s"
            | "vec2d"
            | "vec3i"
            | "vec3s"
            | "vec3d"
            | "vec4i"
            | "vec4s"
            | "vec4d"
            | "mat3s"
            | "mat3d"
            | "mat4s"
            | "mat4d"
    )
}

fn numbers<T, const N: usize>(bytes: &[u8], from: fn([u8; N]) -> T) -> Vec<T> {
    bytes
        .as_chunks::<N>()
        .0
        .iter()
        .map(|chunk| from(*chunk))
        .collect()
}

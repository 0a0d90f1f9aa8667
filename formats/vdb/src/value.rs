//! The value types of grids.

use std::fmt;

use half::f16;

/// What a voxel of a readable grid holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ValueType {
    /// `float`
    Float,
    /// `double`
    Double,
    /// `vec3s`: three floats
    Vec3s,
    /// `vec3d`: three doubles
    Vec3d,
    /// `vec3i`: three 32-bit integers
    Vec3i,
    /// `int32`
    Int32,
    /// `int64`
    Int64,
    /// `bool`
    Bool,
    /// `mask`: no value beside the active state
    Mask,
}

impl ValueType {
    /// The type named in a tree's name, `Tree_<name>_5_4_3`.
    pub(crate) fn from_tree(tree: &str) -> Option<Self> {
        Some(match tree.strip_prefix("Tree_")?.strip_suffix("_5_4_3")? {
            "float" => Self::Float,
            "double" => Self::Double,
            "vec3s" => Self::Vec3s,
            "vec3d" => Self::Vec3d,
            "vec3i" => Self::Vec3i,
            "int32" => Self::Int32,
            "int64" => Self::Int64,
            "bool" => Self::Bool,
            "mask" => Self::Mask,
            _ => return None,
        })
    }

    /// The name OpenVDB uses.
    pub fn name(self) -> &'static str {
        match self {
            Self::Float => "float",
            Self::Double => "double",
            Self::Vec3s => "vec3s",
            Self::Vec3d => "vec3d",
            Self::Vec3i => "vec3i",
            Self::Int32 => "int32",
            Self::Int64 => "int64",
            Self::Bool => "bool",
            Self::Mask => "mask",
        }
    }

    /// Numbers per voxel: 3 for vectors, else 1.
    pub fn components(self) -> usize {
        if matches!(self, Self::Vec3s | Self::Vec3d | Self::Vec3i) {
            3
        } else {
            1
        }
    }

    /// Bytes of one value as the file stores it at full precision.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Float | Self::Int32 => 4,
            Self::Double | Self::Int64 => 8,
            Self::Vec3s | Self::Vec3i => 12,
            Self::Vec3d => 24,
            Self::Bool | Self::Mask => 1,
        }
    }

    /// Whether "saved as half" applies: OpenVDB ignores it for integers and truth values.
    pub(crate) fn is_real(self) -> bool {
        matches!(self, Self::Float | Self::Double | Self::Vec3s | Self::Vec3d)
    }

    /// Bytes of one value in a node's or leaf's buffer.
    pub(crate) fn stored_size(self, half: bool) -> usize {
        if half && self.is_real() {
            2 * self.components()
        } else {
            self.size()
        }
    }

    /// Appends `value` negated, both at full precision. OpenVDB's `math::negative`, which is "not"
    /// for truth values.
    pub(crate) fn negate(self, value: &[u8], out: &mut Vec<u8>) {
        match self {
            Self::Float | Self::Vec3s => {
                each(value, out, |b| (-f32::from_le_bytes(b)).to_le_bytes())
            }
            Self::Double | Self::Vec3d => {
                each(value, out, |b| (-f64::from_le_bytes(b)).to_le_bytes())
            }
            Self::Int32 | Self::Vec3i => {
                each(value, out, |b| {
                    i32::from_le_bytes(b).wrapping_neg().to_le_bytes()
                });
            }
            Self::Int64 => each(value, out, |b| {
                i64::from_le_bytes(b).wrapping_neg().to_le_bytes()
            }),
            Self::Bool | Self::Mask => out.extend(value.iter().map(|b| u8::from(*b == 0))),
        }
    }

    /// Appends half-precision values at full precision.
    pub(crate) fn widen(self, halves: &[u8], out: &mut Vec<u8>) {
        let numbers = halves
            .as_chunks::<2>()
            .0
            .iter()
            .map(|b| f16::from_le_bytes(*b));
        match self {
            Self::Double | Self::Vec3d => {
                out.extend(numbers.flat_map(|h| h.to_f64().to_le_bytes()))
            }
            _ => out.extend(numbers.flat_map(|h| h.to_f32().to_le_bytes())),
        }
    }
}

impl fmt::Display for ValueType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

fn each<const N: usize>(value: &[u8], out: &mut Vec<u8>, map: impl Fn([u8; N]) -> [u8; N]) {
    out.extend(
        value
            .as_chunks::<N>()
            .0
            .iter()
            .flat_map(|chunk| map(*chunk)),
    );
}

/// One value, at full precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Of a `float` grid.
    F32(f32),
    /// Of a `double` grid.
    F64(f64),
    /// Of an `int32` grid.
    I32(i32),
    /// Of an `int64` grid.
    I64(i64),
    /// Of a `bool` grid; of a `mask` grid it is the active state.
    Bool(bool),
    /// Of a `vec3s` grid.
    Vec3F32([f32; 3]),
    /// Of a `vec3d` grid.
    Vec3F64([f64; 3]),
    /// Of a `vec3i` grid.
    Vec3I32([i32; 3]),
}

impl Value {
    /// The value in `bytes` at full precision; their number is `kind.size()`.
    pub(crate) fn from_bytes(kind: ValueType, bytes: &[u8]) -> Self {
        match kind {
            ValueType::Float => Self::F32(f32::from_le_bytes(part(bytes, 0))),
            ValueType::Double => Self::F64(f64::from_le_bytes(part(bytes, 0))),
            ValueType::Int32 => Self::I32(i32::from_le_bytes(part(bytes, 0))),
            ValueType::Int64 => Self::I64(i64::from_le_bytes(part(bytes, 0))),
            ValueType::Bool | ValueType::Mask => Self::Bool(bytes[0] != 0),
            ValueType::Vec3s => {
                Self::Vec3F32([0, 1, 2].map(|i| f32::from_le_bytes(part(bytes, i))))
            }
            ValueType::Vec3d => {
                Self::Vec3F64([0, 1, 2].map(|i| f64::from_le_bytes(part(bytes, i))))
            }
            ValueType::Vec3i => {
                Self::Vec3I32([0, 1, 2].map(|i| i32::from_le_bytes(part(bytes, i))))
            }
        }
    }

    /// The components as `f64`: one for scalars (the others are 0), three for vectors. Truth values
    /// are 0 or 1; 64-bit integers beyond 2⁵³ are rounded.
    pub fn to_f64(self) -> [f64; 3] {
        match self {
            Self::F32(v) => [f64::from(v), 0.0, 0.0],
            Self::F64(v) => [v, 0.0, 0.0],
            Self::I32(v) => [f64::from(v), 0.0, 0.0],
            Self::I64(v) => [v as f64, 0.0, 0.0],
            Self::Bool(v) => [f64::from(u8::from(v)), 0.0, 0.0],
            Self::Vec3F32(v) => v.map(f64::from),
            Self::Vec3F64(v) => v,
            Self::Vec3I32(v) => v.map(f64::from),
        }
    }

    /// A scalar as `f32` (rounded where it must be), `None` for a vector.
    pub fn to_f32(self) -> Option<f32> {
        match self {
            Self::Vec3F32(_) | Self::Vec3F64(_) | Self::Vec3I32(_) => None,
            Self::F32(v) => Some(v),
            other => Some(other.to_f64()[0] as f32),
        }
    }

    /// A vector as three `f32` (rounded where they must be), `None` for a scalar.
    pub fn to_vec3f(self) -> Option<[f32; 3]> {
        match self {
            Self::Vec3F32(v) => Some(v),
            Self::Vec3F64(v) => Some(v.map(|c| c as f32)),
            Self::Vec3I32(v) => Some(v.map(|c| c as f32)),
            _ => None,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::F32(v) => v.fmt(f),
            Self::F64(v) => v.fmt(f),
            Self::I32(v) => v.fmt(f),
            Self::I64(v) => v.fmt(f),
            Self::Bool(v) => v.fmt(f),
            Self::Vec3F32(v) => write!(f, "{v:?}"),
            Self::Vec3F64(v) => write!(f, "{v:?}"),
            Self::Vec3I32(v) => write!(f, "{v:?}"),
        }
    }
}

/// The `index`th group of `N` bytes.
pub(crate) fn part<const N: usize>(bytes: &[u8], index: usize) -> [u8; N] {
    bytes.as_chunks::<N>().0[index]
}

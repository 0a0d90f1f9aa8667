//! The decoded values of one leaf.

use half::f16;

use crate::value::Value;

/// The number of voxels in a leaf.
pub const LEAF_VOXELS: usize = 512;

/// What happens to grids saved as half floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Halves {
    /// They become what their grid's type says: `float` gives [`LeafValues::F32`].
    #[default]
    Widen,
    /// They stay halves: [`LeafValues::F16`] or [`LeafValues::Vec3F16`]. The values of inactive
    /// voxels, which the file stores at full precision, are rounded (OpenVDB's writer rounded them
    /// already).
    Keep,
}

/// All 512 values of a leaf, inactive voxels included: these hold the background, or on a level
/// set's inside its negative, and take part in interpolation.
///
/// Voxel (x, y, z) of the leaf has index `(x << 6) | (y << 3) | z`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LeafValues<'a> {
    /// `float` or `double`, saved as half, with [`Halves::Keep`].
    F16(&'a [f16; LEAF_VOXELS]),
    /// `float`
    F32(&'a [f32; LEAF_VOXELS]),
    /// `double`
    F64(&'a [f64; LEAF_VOXELS]),
    /// `int32`
    I32(&'a [i32; LEAF_VOXELS]),
    /// `int64`
    I64(&'a [i64; LEAF_VOXELS]),
    /// `bool`: one bit per voxel, laid out like the mask of a [`LeafNode`](crate::LeafNode). Of a
    /// `mask` grid it is that mask.
    Bool(&'a [u64; 8]),
    /// `vec3s` or `vec3d`, saved as half, with [`Halves::Keep`].
    Vec3F16(&'a [[f16; 3]; LEAF_VOXELS]),
    /// `vec3s`
    Vec3F32(&'a [[f32; 3]; LEAF_VOXELS]),
    /// `vec3d`
    Vec3F64(&'a [[f64; 3]; LEAF_VOXELS]),
    /// `vec3i`
    Vec3I32(&'a [[i32; 3]; LEAF_VOXELS]),
}

impl LeafValues<'_> {
    /// The value at `index` (0..512). Halves come as `F32` or `Vec3F32`.
    pub fn get(&self, index: usize) -> Value {
        match self {
            Self::F16(v) => Value::F32(v[index].to_f32()),
            Self::F32(v) => Value::F32(v[index]),
            Self::F64(v) => Value::F64(v[index]),
            Self::I32(v) => Value::I32(v[index]),
            Self::I64(v) => Value::I64(v[index]),
            Self::Bool(v) => Value::Bool(v[index >> 6] >> (index & 63) & 1 != 0),
            Self::Vec3F16(v) => Value::Vec3F32(v[index].map(f16::to_f32)),
            Self::Vec3F32(v) => Value::Vec3F32(v[index]),
            Self::Vec3F64(v) => Value::Vec3F64(v[index]),
            Self::Vec3I32(v) => Value::Vec3I32(v[index]),
        }
    }

    /// Writes scalars as `f32`, rounded where they must be; truth values become 0 and 1. Returns
    /// `false` and writes nothing if the values are vectors.
    #[must_use]
    pub fn to_f32(&self, out: &mut [f32; LEAF_VOXELS]) -> bool {
        match self {
            Self::F32(v) => *out = **v,
            Self::F16(v) => map(*v, out, |x| x.to_f32()),
            Self::F64(v) => map(*v, out, |x| x as f32),
            Self::I32(v) => map(*v, out, |x| x as f32),
            Self::I64(v) => map(*v, out, |x| x as f32),
            Self::Bool(v) => {
                for (word, out) in v.iter().zip(out.as_chunks_mut::<64>().0) {
                    for (bit, out) in out.iter_mut().enumerate() {
                        *out = (word >> bit & 1) as f32;
                    }
                }
            }
            _ => return false,
        }
        true
    }

    /// Writes vectors as three `f32` each, rounded where they must be. Returns `false` and writes
    /// nothing if the values are scalars.
    #[must_use]
    pub fn to_vec3f(&self, out: &mut [[f32; 3]; LEAF_VOXELS]) -> bool {
        match self {
            Self::Vec3F32(v) => *out = **v,
            Self::Vec3F16(v) => map(*v, out, |x| x.map(f16::to_f32)),
            Self::Vec3F64(v) => map(*v, out, |x| x.map(|c| c as f32)),
            Self::Vec3I32(v) => map(*v, out, |x| x.map(|c| c as f32)),
            _ => return false,
        }
        true
    }
}

fn map<A: Copy, B>(from: &[A], to: &mut [B], convert: impl Fn(A) -> B) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = convert(*from);
    }
}

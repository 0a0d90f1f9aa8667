//! What a brick holds per voxel, and how values are mixed between voxels.

use half::f16;
use resolvent_vdb::{LeafValues, Value};

/// Voxels along the edge of a brick.
pub const EDGE: i32 = 8;
/// Voxels in a brick.
pub const BRICK: usize = 512;

/// A brick: voxel (x, y, z), each 0..8, is element `(x << 6) | (y << 3) | z`, as in the file.
pub type Brick<V> = [V; BRICK];

/// Offset of a voxel in its brick; only the lowest three bits of each coordinate count.
#[inline(always)]
pub fn offset(v: [i32; 3]) -> usize {
    ((v[0] & 7) << 6 | (v[1] & 7) << 3 | (v[2] & 7)) as usize
}

/// `[f(0), f(1), f(2)]`, inlined without fail, as `array::map` is not.
#[inline(always)]
pub fn each<T>(mut f: impl FnMut(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
}

/// What interpolation needs of a value.
pub trait Mix: Copy + Send + Sync + PartialEq + 'static {
    /// `a + w (b − a)`, the order of operations of OpenVDB's `BoxSampler`.
    fn mix(a: Self, b: Self, w: f32) -> Self;
}

impl Mix for f32 {
    #[inline(always)]
    fn mix(a: Self, b: Self, w: f32) -> Self {
        a + w * (b - a)
    }
}

impl Mix for [f32; 3] {
    #[inline(always)]
    fn mix(a: Self, b: Self, w: f32) -> Self {
        each(|i| f32::mix(a[i], b[i], w))
    }
}

/// A voxel as it is stored.
pub trait Voxel: Copy + Default + Send + Sync + 'static {
    /// What it stands for.
    type Value: Mix + Default;
    /// Its value.
    fn value(self) -> Self::Value;
    /// Its value before it was sanitised, when it may still be negative or not finite.
    fn raw(self) -> Self::Value {
        self.value()
    }
    /// The nearest stored form of a value.
    fn store(value: Self::Value) -> Self;
    /// The components of a value.
    fn components(value: &mut Self::Value) -> &mut [f32];
    /// Copies a leaf's values; `false` if they are of another shape (vectors for scalars).
    fn copy(from: &LeafValues<'_>, to: &mut Brick<Self>) -> bool;
    /// A tile's or the background's value.
    fn of_tile(value: &Value) -> Option<Self::Value>;
}

impl Voxel for f32 {
    type Value = f32;
    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
    fn store(value: f32) -> Self {
        value
    }
    fn components(value: &mut f32) -> &mut [f32] {
        std::slice::from_mut(value)
    }
    fn copy(from: &LeafValues<'_>, to: &mut Brick<Self>) -> bool {
        from.to_f32(to)
    }
    fn of_tile(value: &Value) -> Option<f32> {
        value.to_f32()
    }
}

impl Voxel for [f32; 3] {
    type Value = [f32; 3];
    #[inline(always)]
    fn value(self) -> [f32; 3] {
        self
    }
    fn store(value: [f32; 3]) -> Self {
        value
    }
    fn components(value: &mut [f32; 3]) -> &mut [f32] {
        value
    }
    fn copy(from: &LeafValues<'_>, to: &mut Brick<Self>) -> bool {
        from.to_vec3f(to)
    }
    fn of_tile(value: &Value) -> Option<[f32; 3]> {
        value.to_vec3f()
    }
}

/// A non-negative finite half float, as its bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Half(pub u16);

impl Voxel for Half {
    type Value = f32;
    /// Exact for every finite non-negative half, subnormals included: the bits moved into place read as an `f32` whose
    /// exponent is short by 127 − 15 = 112.
    #[inline(always)]
    fn value(self) -> f32 {
        const TWO_112: f32 = f32::from_bits((127 + 112) << 23);
        f32::from_bits(u32::from(self.0) << 13) * TWO_112
    }
    fn raw(self) -> f32 {
        f16::from_bits(self.0).to_f32()
    }
    fn store(value: f32) -> Self {
        Self(f16::from_f32(value).to_bits())
    }
    fn components(value: &mut f32) -> &mut [f32] {
        std::slice::from_mut(value)
    }
    fn copy(from: &LeafValues<'_>, to: &mut Brick<Self>) -> bool {
        match from {
            LeafValues::F16(v) => {
                for (to, from) in to.iter_mut().zip(v.iter()) {
                    *to = Self(from.to_bits());
                }
                true
            }
            _ => {
                let mut wide = [0.0; BRICK];
                let scalar = from.to_f32(&mut wide);
                for (to, from) in to.iter_mut().zip(&wide) {
                    *to = Self::store(*from);
                }
                scalar
            }
        }
    }
    fn of_tile(value: &Value) -> Option<f32> {
        value.to_f32()
    }
}

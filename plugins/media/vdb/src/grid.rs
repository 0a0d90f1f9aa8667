//! A grid in memory: index, bricks and constants, with exact interpolation.

use crate::index::{DEFAULT, Index, UNIFORM};
use crate::voxel::each;
use crate::voxel::{Brick, Mix, Voxel, offset};

/// Voxel values by position. Positions are local: in voxels, with voxel centres at integers, counted from the index's base.
pub struct Grid<V: Voxel> {
    /// Finds bricks.
    pub index: Index,
    /// The bricks.
    pub pool: Vec<Brick<V>>,
    /// The values of constants; the first is the background's.
    pub constants: Vec<V::Value>,
    /// Interpolate between voxels, or take the nearest one. With nearest voxels, positions are shifted by half a voxel on
    /// the way to local coordinates, so that a voxel's cell starts at its integer coordinates.
    pub trilinear: bool,
}

impl<V: Voxel> Grid<V> {
    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.index.memory()
            + self.pool.capacity() * size_of::<Brick<V>>()
            + self.constants.capacity() * size_of::<V::Value>()
    }

    /// The value of a slot at an offset.
    #[inline(always)]
    pub fn of_slot(&self, slot: u32, offset: usize) -> V::Value {
        if slot & UNIFORM == 0 {
            self.pool[slot as usize][offset & 511].value()
        } else {
            self.constants[(slot & !UNIFORM) as usize]
        }
    }

    /// The value of a voxel, the background's outside the domain.
    #[inline]
    pub fn voxel(&self, v: [i32; 3]) -> V::Value {
        self.of_slot(self.index.slot(each(|i| v[i] >> 3)), offset(v))
    }

    /// The background's value.
    pub fn background(&self) -> V::Value {
        self.constants[(DEFAULT & !UNIFORM) as usize]
    }

    /// The eight voxels around the cell with lower corner `v`; element (x << 2 | y << 1 | z).
    #[inline]
    pub fn corners(&self, v: [i32; 3]) -> [V::Value; 8] {
        let at = |i: usize| {
            [
                v[0] + (i as i32 >> 2),
                v[1] + (i as i32 >> 1 & 1),
                v[2] + (i as i32 & 1),
            ]
        };
        if v.iter().all(|c| c & 7 < 7) {
            // All in one brick, as in two of three cases.
            let slot = self.index.slot(each(|i| v[i] >> 3));
            return std::array::from_fn(|i| self.of_slot(slot, offset(at(i))));
        }
        std::array::from_fn(|i| self.voxel(at(i)))
    }

    /// The value at a position: that of OpenVDB's `BoxSampler` if trilinear, of its `PointSampler` otherwise.
    #[inline]
    pub fn sample(&self, p: [f32; 3]) -> V::Value {
        let floor = each(|i| p[i].floor());
        let v = each(|i| floor[i] as i32);
        if !self.trilinear {
            return self.voxel(v);
        }
        trilinear(&self.corners(v), each(|i| p[i] - floor[i]))
    }
}

/// Trilinear interpolation between eight corners.
#[inline(always)]
pub fn trilinear<T: Mix>(c: &[T; 8], w: [f32; 3]) -> T {
    let along_z = |i: usize| T::mix(c[i], c[i + 1], w[2]);
    let (low, high) = (
        T::mix(along_z(0), along_z(2), w[1]),
        T::mix(along_z(4), along_z(6), w[1]),
    );
    T::mix(low, high, w[0])
}

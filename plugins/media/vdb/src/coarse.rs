//! A small dense grid of mean densities, for optical depths that need to be cheap but not exact.

use crate::cursor::Cursor;
use crate::grid::Grid;
use crate::index::{GROUP, Place};
use crate::voxel::{EDGE, Voxel};

/// Most cells: 128 kB.
const MOST: i64 = 1 << 15;

/// Means over cubes of 2^`log` bricks along each edge.
pub struct Coarse {
    log: u32,
    dims: [i32; 3],
    means: Vec<f32>,
}

impl Coarse {
    /// From the bricks' means, in the order of the index's slots.
    pub fn new<V: Voxel<Value = f32>>(grid: &Grid<V>, means: &[f32]) -> Self {
        let extent = grid.index.extent();
        let mut log = 0;
        let dims = loop {
            let dims = extent.map(|e| (i64::from(e) + (1 << log) - 1) >> log);
            if dims.iter().product::<i64>() <= MOST {
                break dims.map(|d| d as i32);
            }
            log += 1;
        };
        let mut coarse = Self {
            log,
            dims,
            means: vec![0.0; dims.iter().product::<i32>() as usize],
        };
        let share = 1.0 / f64::from(1u32 << log).powi(3);
        let mut sums = vec![0.0f64; coarse.means.len()];
        for (group, place) in grid.index.places.iter().enumerate() {
            let Place::At(at) = place else { continue };
            for k in 0..GROUP {
                let brick = [
                    at[0] + (k >> 6) as i32,
                    at[1] + (k >> 3 & 7) as i32,
                    at[2] + (k & 7) as i32,
                ];
                sums[coarse.entry(brick.map(|c| c >> log))] += f64::from(means[group * GROUP + k]);
            }
        }
        for (mean, sum) in coarse.means.iter_mut().zip(&sums) {
            *mean = (sum * share) as f32;
        }
        grid.index.uniform(&mut |at, size, constant| {
            let value = grid.of_slot(constant, 0);
            if value == 0.0 {
                return;
            }
            let (lo, hi) = (at.map(|c| c >> log), at.map(|c| (c + size - 1) >> log));
            // Larger than a cube: it fills some. Smaller: a share of one.
            let part = f64::from(size.min(1 << log)).powi(3) * share;
            for x in lo[0]..=hi[0] {
                for y in lo[1]..=hi[1] {
                    for z in lo[2]..=hi[2] {
                        let entry = coarse.entry([x, y, z]);
                        coarse.means[entry] += value * part as f32;
                    }
                }
            }
        });
        coarse
    }

    fn entry(&self, c: [i32; 3]) -> usize {
        ((c[0] * self.dims[1] + c[1]) * self.dims[2] + c[2]) as usize
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        self.means.len() * 4
    }

    /// The integral of the density along a ray, over world length.
    pub fn integral(&self, ray: &mut Cursor) -> f32 {
        let size = (EDGE << self.log) as f32;
        let mut sum = 0.0;
        while ray.t < ray.t1 {
            let at = ray.next_voxel().map(|c| c >> (self.log + 3));
            if (0..3).any(|i| at[i] >= self.dims[i]) {
                break;
            }
            let (t0, t1) = ray.enter(size);
            sum += self.means[self.entry(at)] * (t1 - t0);
        }
        sum
    }
}

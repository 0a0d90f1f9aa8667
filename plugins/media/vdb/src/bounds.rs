//! Bounds of the interpolant over cells.
//!
//! A look-up at a continuous position x mixes the voxels ⌊x⌋ and ⌊x⌋ + 1, so the cell [8b, 8b + 8] of brick b depends on its
//! own voxels and on the first layer of the seven bricks towards +x, +y, +z. Every cell gets the smallest and the largest of
//! these voxels, no more and no less.

use crate::grid::Grid;
use crate::index::{GROUP, Place};
use crate::voxel::{Brick, Voxel};
use resolvent_vdb::Parallel;
use std::sync::Mutex;

/// Bounds over one brick's cell, in grid values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Largest value.
    pub max: f32,
    /// Smallest value, or [`Bounds::ROUGH`].
    pub min: f32,
}

impl Bounds {
    /// In place of `min`: the values in the cell differ so much that its voxels are visited one by one.
    pub const ROUGH: f32 = -1.0;

    const NONE: Self = Self {
        max: f32::NEG_INFINITY,
        min: f32::INFINITY,
    };

    fn add(&mut self, v: f32) {
        // Comparisons instead of `f32::min`: there are no NaN here, and this compiles to vector minima.
        self.min = if v < self.min { v } else { self.min };
        self.max = if v > self.max { v } else { self.max };
    }

    fn join(&mut self, o: Self) {
        self.add(o.min);
        self.add(o.max);
    }
}

/// What is known per brick once its voxels are.
pub struct Summary {
    /// Bounds of the cells, in the order of [`crate::index::Index::slots`].
    pub cells: Vec<Bounds>,
    /// Means of the bricks, in the same order.
    pub means: Vec<f32>,
}

/// The voxels of a brick in the layer x = 0 (bit 4 of `side`), y = 0 (bit 2) and z = 0 (bit 1).
fn layer<V: Voxel<Value = f32>>(brick: &Brick<V>, side: usize) -> Bounds {
    let mut all = Bounds::NONE;
    let along = |bit: usize| if side & bit != 0 { 1 } else { 8 };
    for x in 0..along(4) {
        for y in 0..along(2) {
            for v in &brick[x << 6 | y << 3..][..along(1)] {
                all.add(v.value());
            }
        }
    }
    all
}

fn whole<V: Voxel<Value = f32>>(brick: &Brick<V>) -> (Bounds, f32) {
    let mut lanes = [Bounds::NONE; 8];
    let mut sum = [0.0; 8];
    for row in brick.as_chunks::<8>().0 {
        for (i, v) in row.iter().enumerate() {
            lanes[i].add(v.value());
            sum[i] += v.value();
        }
    }
    let mut all = Bounds::NONE;
    lanes.iter().for_each(|l| all.join(*l));
    (all, sum.iter().sum::<f32>() / 512.0)
}

/// Finds the bounds of all cells of a grid. `rough(max, min)` says whether a cell's voxels are to be visited one by one.
pub fn summarise<V: Voxel<Value = f32>>(
    grid: &Grid<V>,
    parallel: &dyn Parallel,
    rough: impl Fn(f32, f32) -> bool + Sync,
) -> Summary {
    let count = grid.index.slots.len();
    let mut summary = Summary {
        cells: vec![Bounds::default(); count],
        means: vec![0.0; count],
    };
    let places: Vec<_> = summary
        .cells
        .chunks_mut(GROUP)
        .zip(summary.means.chunks_mut(GROUP))
        .map(Mutex::new)
        .collect();
    parallel.run(places.len(), &|group| {
        let mut place = places[group].lock().unwrap_or_else(|e| e.into_inner());
        let (cells, means) = &mut *place;
        for k in 0..GROUP {
            let (bounds, mean) = cell(grid, group, k);
            means[k] = mean;
            cells[k] = bounds;
            if rough(bounds.max, bounds.min) {
                cells[k].min = Bounds::ROUGH;
            }
        }
    });
    drop(places);
    summary
}

fn cell<V: Voxel<Value = f32>>(grid: &Grid<V>, group: usize, k: usize) -> (Bounds, f32) {
    use crate::index::UNIFORM;
    let slots = &grid.index.slots[group * GROUP..][..GROUP];
    let own = slots[k];
    let (mut bounds, mean) = if own & UNIFORM == 0 {
        whole(&grid.pool[own as usize])
    } else {
        let v = grid.of_slot(own, 0);
        (Bounds { max: v, min: v }, v)
    };
    if !grid.trilinear {
        return (bounds, mean);
    }
    let place = [k >> 6, k >> 3 & 7, k & 7];
    for side in 1..8usize {
        let step = [side >> 2 & 1, side >> 1 & 1, side & 1];
        let to = [0, 1, 2].map(|i| place[i] + step[i]);
        let slot = if to.iter().all(|c| *c < 8) {
            slots[to[0] << 6 | to[1] << 3 | to[2]]
        } else {
            match grid.index.places[group] {
                Place::At(at) => grid
                    .index
                    .slot([0, 1, 2].map(|i| (at[i] & !7) + to[i] as i32)),
                Place::Pattern(key) => key[to[0] >> 3 << 2 | to[1] >> 3 << 1 | to[2] >> 3],
            }
        };
        if slot & UNIFORM != 0 {
            bounds.add(grid.of_slot(slot, 0));
        } else {
            bounds.join(layer(&grid.pool[slot as usize], side));
        }
    }
    (bounds, mean)
}

//! Extremes of a grid's values, found by decoding it.

use std::sync::Mutex;

use crate::error::Result;
use crate::file::File;
use crate::grid::GridInfo;
use crate::leaf_values::{Halves, LEAF_VOXELS, LeafValues};
use crate::parallel::Parallel;
use crate::topology::LeafNode;
use crate::value::ValueType;

/// What the active voxels and tiles of a grid hold. Inactive ones do not count.
#[derive(Clone, Debug, PartialEq)]
pub struct Statistics {
    /// The number of active voxels, a tile counting as the voxels it covers.
    pub active_voxels: u64,
    /// Inclusive index bounds of the active voxels, `None` without any.
    pub active_bbox: Option<[[i32; 3]; 2]>,
    /// Least value per component, `None` if no active value is a number. Scalars have one
    /// component; truth values are 0 and 1; 64-bit integers beyond 2⁵³ are rounded.
    pub min: Option<Vec<f64>>,
    /// Greatest value per component.
    pub max: Option<Vec<f64>>,
    /// How many components of active leaf voxels and active tiles are not a number.
    pub not_a_number: u64,
    /// How many components of active leaf voxels and active tiles are infinite.
    pub infinite: u64,
    /// Numbers of leaves, of inner nodes over 128³ voxels, and of inner nodes over 4096³ voxels.
    pub node_counts: [usize; 3],
}

#[derive(Clone, Copy)]
struct Extremes {
    min: [f64; 3],
    max: [f64; 3],
    nan: u64,
    infinite: u64,
}

impl Extremes {
    const NONE: Self = Self {
        min: [f64::INFINITY; 3],
        max: [f64::NEG_INFINITY; 3],
        nan: 0,
        infinite: 0,
    };

    fn add(&mut self, component: usize, value: f64) {
        if value.is_nan() {
            self.nan += 1;
            return;
        }
        self.infinite += u64::from(value.is_infinite());
        self.min[component] = self.min[component].min(value);
        self.max[component] = self.max[component].max(value);
    }

    fn merge(&mut self, other: &Self) {
        for c in 0..3 {
            self.min[c] = self.min[c].min(other.min[c]);
            self.max[c] = self.max[c].max(other.max[c]);
        }
        self.nan += other.nan;
        self.infinite += other.infinite;
    }

    fn of_leaf(leaf: &LeafNode, values: LeafValues<'_>, components: usize) -> Self {
        let mut all = Self::NONE;
        if let LeafValues::F32(values) = values {
            // The common case, without the detour over `Value`.
            for (offset, value) in values.iter().enumerate() {
                if leaf.is_active(offset) {
                    all.add(0, f64::from(*value));
                }
            }
            return all;
        }
        for offset in (0..LEAF_VOXELS).filter(|offset| leaf.is_active(*offset)) {
            let value = values.get(offset).to_f64();
            (0..components).for_each(|c| all.add(c, value[c]));
        }
        all
    }
}

impl File {
    /// Decodes a grid and describes its active values.
    ///
    /// # Errors
    /// As [`read_topology`](Self::read_topology) and [`read_leaves`](Self::read_leaves).
    pub fn statistics(&self, grid: &GridInfo, parallel: &dyn Parallel) -> Result<Statistics> {
        let topology = self.read_topology(grid)?;
        let components = grid.value_type.map_or(1, ValueType::components);
        let all = Mutex::new(Extremes::NONE);
        self.read_leaves(grid, &topology, Halves::Widen, parallel, |index, values| {
            let leaf = Extremes::of_leaf(&topology.leaves()[index], values, components);
            all.lock()
                .unwrap_or_else(|poisoned| poisoned.into_inner())
                .merge(&leaf);
        })?;
        let mut all = all
            .into_inner()
            .unwrap_or_else(|poisoned| poisoned.into_inner());
        for tile in topology.tiles().filter(|tile| tile.active) {
            let value = tile.value.to_f64();
            (0..components).for_each(|c| all.add(c, value[c]));
        }
        let found = (0..components).all(|c| all.min[c] <= all.max[c]);
        let part = |values: [f64; 3]| found.then(|| values[..components].to_vec());
        Ok(Statistics {
            active_voxels: topology.active_voxels(),
            active_bbox: topology.active_bbox(),
            min: part(all.min),
            max: part(all.max),
            not_a_number: all.nan,
            infinite: all.infinite,
            node_counts: topology.node_counts(),
        })
    }
}

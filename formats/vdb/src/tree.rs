//! A grid in memory, with lookup by index coordinate.

use std::collections::HashMap;

use crate::error::Result;
use crate::file::File;
use crate::grid::GridInfo;
use crate::leaf_values::{Halves, LEAF_VOXELS, LeafValues};
use crate::parallel::Parallel;
use crate::tiles::Level;
use crate::topology::Topology;
use crate::value::{Value, ValueType};

/// A grid read as a whole, at full precision: for looking values up and for checking other
/// structures against. A renderer decodes into its own ([`File::read_leaves_into`]).
pub struct Tree {
    topology: Topology,
    values: Values,
    leaves: HashMap<[i32; 3], u32>,
    root: HashMap<[i32; 3], usize>,
    nodes: HashMap<(Level, [i32; 3]), usize>,
}

/// The leaves' values, one element per leaf.
enum Values {
    F32(Vec<[f32; LEAF_VOXELS]>),
    F64(Vec<[f64; LEAF_VOXELS]>),
    I32(Vec<[i32; LEAF_VOXELS]>),
    I64(Vec<[i64; LEAF_VOXELS]>),
    Bool(Vec<[u64; 8]>),
    Vec3F32(Vec<[[f32; 3]; LEAF_VOXELS]>),
    Vec3F64(Vec<[[f64; 3]; LEAF_VOXELS]>),
    Vec3I32(Vec<[[i32; 3]; LEAF_VOXELS]>),
}

impl Tree {
    /// Reads a grid.
    ///
    /// # Errors
    /// As [`File::read_topology`] and [`File::read_leaves`].
    pub fn read(file: &File, grid: &GridInfo, parallel: &dyn Parallel) -> Result<Self> {
        let topology = file.read_topology(grid)?;
        macro_rules! values {
            ($variant:ident, $zero:expr) => {{
                let mut places = vec![$zero; topology.leaves().len()];
                let all = &mut places;
                file.read_leaves_into(
                    grid,
                    &topology,
                    Halves::Widen,
                    parallel,
                    all,
                    |_, values, place| {
                        if let LeafValues::$variant(values) = values {
                            *place = *values;
                        }
                    },
                )?;
                Values::$variant(places)
            }};
        }
        let values = match grid.value_type.unwrap_or(ValueType::Mask) {
            ValueType::Float => values!(F32, [0.0; LEAF_VOXELS]),
            ValueType::Double => values!(F64, [0.0; LEAF_VOXELS]),
            ValueType::Int32 => values!(I32, [0; LEAF_VOXELS]),
            ValueType::Int64 => values!(I64, [0; LEAF_VOXELS]),
            ValueType::Bool | ValueType::Mask => values!(Bool, [0; 8]),
            ValueType::Vec3s => values!(Vec3F32, [[0.0; 3]; LEAF_VOXELS]),
            ValueType::Vec3d => values!(Vec3F64, [[0.0; 3]; LEAF_VOXELS]),
            ValueType::Vec3i => values!(Vec3I32, [[0; 3]; LEAF_VOXELS]),
        };
        let leaves = (0..)
            .zip(topology.leaves())
            .map(|(index, leaf)| (leaf.origin, index))
            .collect();
        let tiles = &topology.tiles;
        let root = tiles
            .root()
            .iter()
            .enumerate()
            .map(|(index, tile)| (tile.origin, index))
            .collect();
        let nodes = tiles
            .nodes()
            .map(|(index, level, origin)| ((level, origin), index))
            .collect();
        Ok(Self {
            topology,
            values,
            leaves,
            root,
            nodes,
        })
    }

    /// The grid's topology.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// The values of the leaf at `index` in [`Topology::leaves`].
    ///
    /// # Panics
    /// If there is no such leaf.
    pub fn leaf(&self, index: usize) -> LeafValues<'_> {
        match &self.values {
            Values::F32(v) => LeafValues::F32(&v[index]),
            Values::F64(v) => LeafValues::F64(&v[index]),
            Values::I32(v) => LeafValues::I32(&v[index]),
            Values::I64(v) => LeafValues::I64(&v[index]),
            Values::Bool(v) => LeafValues::Bool(&v[index]),
            Values::Vec3F32(v) => LeafValues::Vec3F32(&v[index]),
            Values::Vec3F64(v) => LeafValues::Vec3F64(&v[index]),
            Values::Vec3I32(v) => LeafValues::Vec3I32(&v[index]),
        }
    }

    /// Value and active state of a voxel, wherever in index space it is.
    pub fn probe(&self, at: [i32; 3]) -> (Value, bool) {
        if let Some(&index) = self.leaves.get(&at.map(|c| c & !7)) {
            let offset = ((at[0] & 7) << 6 | (at[1] & 7) << 3 | at[2] & 7) as usize;
            let leaf = &self.topology.leaves()[index as usize];
            return (
                self.leaf(index as usize).get(offset),
                leaf.is_active(offset),
            );
        }
        let tiles = &self.topology.tiles;
        for level in [Level::Lower, Level::Upper] {
            let log2 = level.log2();
            let child = level.child_dim().trailing_zeros();
            let size = 1 << (log2 + child);
            if let Some(&node) = self.nodes.get(&(level, at.map(|c| c & -size))) {
                let place = at.map(|c| ((c & (size - 1)) >> child) as usize);
                let slot = place[0] << (2 * log2) | place[1] << log2 | place[2];
                if let Some(tile) = tiles.find(node, slot) {
                    return tile;
                }
            }
        }
        match self.root.get(&at.map(|c| c & !4095)) {
            Some(&index) => (tiles.root()[index].value, tiles.root()[index].active),
            None => (self.topology.background(), false),
        }
    }

    /// Trilinear interpolation between voxel centres, that is between whole index positions, inactive
    /// voxels counting with their value: OpenVDB's `BoxSampler`, with its order of operations and its
    /// rounding. Scalars are in the first component.
    pub fn sample(&self, index: [f64; 3]) -> [f64; 3] {
        let single = matches!(self.values, Values::F32(_) | Values::Vec3F32(_));
        let round = |x: f64| if single { f64::from(x as f32) } else { x };
        let low = index.map(|c| c.floor() as i32);
        let weight = [0, 1, 2].map(|i| index[i] - f64::from(low[i]));
        let mut corner = [[0.0; 3]; 8];
        for (n, corner) in corner.iter_mut().enumerate() {
            let step = [n >> 2, n >> 1 & 1, n & 1];
            *corner = self
                .probe([0, 1, 2].map(|i| low[i].saturating_add(step[i] as i32)))
                .0
                .to_f64();
        }
        [0, 1, 2].map(|c| {
            let lerp = |a: f64, b: f64, w: f64| round(a + round(round(b - a) * w));
            let pair = |n: usize| lerp(corner[n][c], corner[n + 1][c], weight[2]);
            let row = |n: usize| lerp(pair(n), pair(n + 2), weight[1]);
            lerp(row(0), row(4), weight[0])
        })
    }
}

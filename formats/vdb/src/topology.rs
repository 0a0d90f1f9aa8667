//! The shape of a grid's tree: background, tiles, and where its leaves are.

use crate::encoding::Encoding;
use crate::error::Parsed;
use crate::reader::Reader;
use crate::tiles::{Tile, Tiles};
use crate::value::Value;
use crate::walk::Walk;

/// A leaf: 8³ voxels.
///
/// Voxel (x, y, z) of the leaf, each 0..8, has the offset `(x << 6) | (y << 3) | z`: x varies
/// slowest. Its bit in the mask is bit `offset & 63` of word `offset >> 6`, so a word is a slab of
/// equal x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LeafNode {
    /// The lowest index coordinate in it, a multiple of 8.
    pub origin: [i32; 3],
    /// The active voxels.
    pub mask: [u64; 8],
}

impl LeafNode {
    /// Whether the voxel at `offset` (0..512) is active.
    pub fn is_active(&self, offset: usize) -> bool {
        self.mask[offset >> 6] >> (offset & 63) & 1 != 0
    }

    /// The number of active voxels.
    pub fn active_voxels(&self) -> u32 {
        self.mask.iter().map(|word| word.count_ones()).sum()
    }

    /// Inclusive index bounds of the active voxels, `None` without any.
    pub fn active_bbox(&self) -> Option<[[i32; 3]; 2]> {
        let union = self.mask.iter().fold(0, |all, word| all | word);
        if union == 0 {
            return None;
        }
        let x0 = self.mask.iter().position(|word| *word != 0)? as i32;
        let x1 = self.mask.iter().rposition(|word| *word != 0)? as i32;
        let y0 = (union.trailing_zeros() >> 3) as i32;
        let y1 = ((63 - union.leading_zeros()) >> 3) as i32;
        let row = union.to_le_bytes().iter().fold(0, |all, byte| all | byte);
        let z0 = row.trailing_zeros() as i32;
        let z1 = 7 - row.leading_zeros() as i32;
        let [x, y, z] = self.origin;
        Some([[x + x0, y + y0, z + z0], [x + x1, y + y1, z + z1]])
    }
}

/// Everything about a grid but its voxels' values: read first, so that a caller can make room for
/// the leaves before they are decoded.
pub struct Topology {
    pub(crate) background: Value,
    pub(crate) background_bytes: Vec<u8>,
    pub(crate) leaves: Vec<LeafNode>,
    pub(crate) tiles: Tiles,
    pub(crate) lower_nodes: usize,
    pub(crate) upper_nodes: usize,
    /// Leaves seen; `leaves` is empty when they were only counted.
    pub(crate) leaf_count: u64,
    /// File offset of the topology: which tree this is.
    pub(crate) start: u64,
    /// File offset of the first leaf's buffer.
    pub(crate) buffers: u64,
}

impl Topology {
    /// The value of all voxels that are neither in a leaf nor in a tile; they are inactive.
    pub fn background(&self) -> Value {
        self.background
    }

    /// The leaves, in the order of the file. Their origins are distinct.
    pub fn leaves(&self) -> &[LeafNode] {
        &self.leaves
    }

    /// The tiles that are active or whose value differs from the background, without overlap.
    ///
    /// There may be very many: packed in memory, they are unpacked by the iterator.
    pub fn tiles(&self) -> impl Iterator<Item = Tile> + '_ {
        self.tiles.iter()
    }

    /// Numbers of leaves, of inner nodes over 128³ voxels, and of inner nodes over 4096³ voxels.
    pub fn node_counts(&self) -> [usize; 3] {
        [self.leaves.len(), self.lower_nodes, self.upper_nodes]
    }

    /// The number of active voxels, a tile counting as the voxels it covers (saturating).
    pub fn active_voxels(&self) -> u64 {
        let leaves = self
            .leaves
            .iter()
            .map(|leaf| u64::from(leaf.active_voxels()))
            .sum();
        self.tiles()
            .filter(|tile| tile.active)
            .fold(leaves, |all: u64, tile| {
                all.saturating_add(u64::from(tile.dim).pow(3))
            })
    }

    /// Inclusive index bounds of the active voxels and tiles, `None` without any. Found from the
    /// tree, not from the file's metadata.
    pub fn active_bbox(&self) -> Option<[[i32; 3]; 2]> {
        let leaves = self.leaves.iter().filter_map(LeafNode::active_bbox);
        let tiles = self.tiles().filter(|tile| tile.active).map(|tile| {
            let last = tile.dim as i32 - 1;
            [tile.origin, tile.origin.map(|low| low + last)]
        });
        leaves.chain(tiles).reduce(|a, b| {
            [
                [0, 1, 2].map(|i| a[0][i].min(b[0][i])),
                [0, 1, 2].map(|i| a[1][i].max(b[1][i])),
            ]
        })
    }

    /// Reads a tree's topology. With `keep` unset, leaves are counted but not remembered.
    pub(crate) fn read(reader: &mut Reader<'_>, encoding: &Encoding, keep: bool) -> Parsed<Self> {
        let kind = encoding.kind;
        let start = reader.position();
        // The number of buffers per leaf: always one since 2010, and OpenVDB only warns.
        reader.u32("the buffer count")?;
        let background_bytes = reader.bytes(kind.size(), "the background")?.to_vec();
        let topology = Self {
            background: Value::from_bytes(kind, &background_bytes),
            background_bytes,
            leaves: Vec::new(),
            tiles: Tiles::new(kind),
            lower_nodes: 0,
            upper_nodes: 0,
            leaf_count: 0,
            start,
            buffers: 0,
        };
        let mut topology = Walk::new(encoding, keep, topology).run(reader)?;
        topology.buffers = reader.position();
        Ok(topology)
    }
}

pub(crate) fn leaf_mask(bytes: &[u8; 64]) -> [u64; 8] {
    let words = bytes.as_chunks::<8>().0;
    std::array::from_fn(|i| u64::from_le_bytes(words[i]))
}

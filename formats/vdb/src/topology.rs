//! The shape of a grid's tree: background, tiles, and where its leaves are.

use std::collections::HashSet;

use crate::encoding::{Code, Encoding, Scratch, chunk_length};
use crate::error::{Fault, Parsed};
use crate::reader::Reader;
use crate::tiles::{Level, Tile, Tiles};
use crate::value::Value;

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
        let mut walk = Walk {
            encoding,
            keep,
            scratch: Scratch::default(),
            wide: Vec::new(),
            topology: Self {
                background: Value::from_bytes(kind, &background_bytes),
                background_bytes,
                leaves: Vec::new(),
                tiles: Tiles::new(kind),
                lower_nodes: 0,
                upper_nodes: 0,
                leaf_count: 0,
                start,
                buffers: 0,
            },
        };
        walk.root(reader)?;
        walk.topology.buffers = reader.position();
        Ok(walk.topology)
    }
}

struct Walk<'a> {
    encoding: &'a Encoding,
    keep: bool,
    scratch: Scratch,
    /// A node's values at full precision.
    wide: Vec<u8>,
    topology: Topology,
}

/// Which slots of a node its stored values belong to.
#[derive(Clone, Copy, PartialEq)]
enum Stored {
    All,
    Active,
    /// All but children: format 221.
    Childless,
}

impl Walk<'_> {
    fn root(&mut self, reader: &mut Reader<'_>) -> Parsed<()> {
        let kind = self.encoding.kind;
        let tiles = reader.u32("the number of root tiles")?;
        let children = reader.u32("the number of root children")?;
        let mut seen = HashSet::new();
        let mut origin_of = |reader: &mut Reader<'_>| {
            let at = reader.position();
            let origin = reader.coordinate("a root entry's origin")?;
            if origin.iter().any(|c| c & 4095 != 0) {
                let reason = format!("root entry at {origin:?}, which is no multiple of 4096");
                return Err(Fault::invalid(at, reason));
            }
            if !seen.insert(origin) {
                return Err(Fault::invalid(
                    at,
                    format!("two root entries at {origin:?}"),
                ));
            }
            Ok(origin)
        };
        for _ in 0..tiles {
            let origin = origin_of(reader)?;
            let bytes = reader.bytes(kind.size(), "a root tile")?;
            let differs = bytes != self.topology.background_bytes;
            let value = Value::from_bytes(kind, bytes);
            let active = reader.u8("a root tile's state")? != 0;
            if active || differs {
                self.topology.tiles.push_root(Tile {
                    origin,
                    dim: 4096,
                    value,
                    active,
                });
            }
        }
        for _ in 0..children {
            let origin = origin_of(reader)?;
            self.node(reader, Level::Upper, origin)?;
        }
        Ok(())
    }

    fn node(&mut self, reader: &mut Reader<'_>, level: Level, origin: [i32; 3]) -> Parsed<()> {
        let (children, active) = (mask(reader, level.slots())?, mask(reader, level.slots())?);
        self.values(reader, level, origin, &children, &active)?;
        match level {
            Level::Upper => self.topology.upper_nodes += 1,
            Level::Lower => self.topology.lower_nodes += 1,
        }
        for (word, bits) in children.iter().enumerate() {
            let mut bits = *bits;
            while bits != 0 {
                let slot = word * 64 + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let origin = level.child_origin(origin, slot);
                match level {
                    Level::Upper => self.node(reader, Level::Lower, origin)?,
                    Level::Lower => self.leaf(reader, origin)?,
                }
            }
        }
        Ok(())
    }

    fn leaf(&mut self, reader: &mut Reader<'_>, origin: [i32; 3]) -> Parsed<()> {
        self.topology.leaf_count += 1;
        if !self.keep {
            return reader.skip(64, "a leaf's mask");
        }
        let bytes = reader.array::<64>("a leaf's mask")?;
        let mask = leaf_mask(&bytes);
        self.topology.leaves.push(LeafNode { origin, mask });
        Ok(())
    }

    /// Reads the values of a node's slots and keeps those of its tiles.
    fn values(
        &mut self,
        reader: &mut Reader<'_>,
        level: Level,
        origin: [i32; 3],
        children: &[u64],
        active: &[u64],
    ) -> Parsed<()> {
        let Self {
            encoding,
            scratch,
            wide,
            topology,
            ..
        } = self;
        let (kind, slots) = (encoding.kind, level.slots());
        let what = "a node's values";
        let mut code = Code::ALL;
        let mut selection = Vec::new();
        if encoding.has_code() {
            let at = reader.position();
            code = Code::new(reader.u8("a node's code")?, at)?;
            let stored = reader.bytes(code.values() * kind.size(), "a node's inactive values")?;
            code.inactive(
                kind,
                &topology.background_bytes,
                stored,
                &mut scratch.inactive,
            );
            if code.has_selection() {
                selection = mask(reader, slots)?;
            }
        }
        let (stored, count) = if !encoding.has_code() {
            (Stored::Childless, slots - ones(children))
        } else if encoding.compression.active_mask && code != Code::ALL {
            (Stored::Active, ones(active))
        } else {
            (Stored::All, slots)
        };
        let expected = count * encoding.stored_size();
        let at = reader.position();
        let (length, raw) = if encoding.has_length(count) {
            let prefix = reader.i64("the length of a node's values")?;
            chunk_length(encoding, prefix, count, at)?
        } else {
            (expected, true)
        };
        let chunk = reader.bytes(length, what)?;
        let bytes = if raw || count == 0 {
            chunk
        } else {
            scratch
                .unpack(encoding.compression.codec, chunk, expected)
                .map_err(|reason| Fault::invalid(at, format!("{what}: {reason}")))?;
            &scratch.bytes
        };
        let mut values = if count == 0 {
            &[][..]
        } else {
            &bytes[..expected]
        };
        if encoding.half && kind.is_real() {
            wide.clear();
            kind.widen(values, wide);
            values = wide;
        }

        topology.tiles.begin(level, origin);
        let background = &topology.background_bytes[..];
        let plain =
            stored == Stored::Active && scratch.inactive[0] == background && selection.is_empty();
        let mut stored_values = values.chunks_exact(kind.size());
        for word in 0..slots / 64 {
            if plain && active[word] == 0 {
                continue;
            }
            for bit in 0..64 {
                let is = |mask: &[u64]| mask[word] >> bit & 1 != 0;
                let (child, on) = (is(children), is(active));
                let has_value = match stored {
                    Stored::All => true,
                    Stored::Active => on,
                    Stored::Childless => !child,
                };
                let value = match has_value.then(|| stored_values.next()).flatten() {
                    Some(value) => value,
                    None => &scratch.inactive[usize::from(!selection.is_empty() && is(&selection))],
                };
                if !child && (on || value != background) {
                    topology.tiles.push(word * 64 + bit, on, value);
                }
            }
        }
        Ok(())
    }
}

fn ones(mask: &[u64]) -> usize {
    mask.iter().map(|word| word.count_ones() as usize).sum()
}

fn mask(reader: &mut Reader<'_>, bits: usize) -> Parsed<Vec<u64>> {
    let bytes = reader.bytes(bits / 8, "a node's mask")?;
    Ok(bytes
        .as_chunks::<8>()
        .0
        .iter()
        .map(|word| u64::from_le_bytes(*word))
        .collect())
}

pub(crate) fn leaf_mask(bytes: &[u8; 64]) -> [u64; 8] {
    let words = bytes.as_chunks::<8>().0;
    std::array::from_fn(|i| u64::from_le_bytes(words[i]))
}

//! The walk through a tree's nodes in the order of the file: root, upper nodes, lower nodes, and the
//! masks of their leaves, depth first.

use std::collections::HashSet;

use crate::encoding::{Code, Encoding, Scratch, chunk_length};
use crate::error::{Fault, Parsed};
use crate::reader::Reader;
use crate::tiles::{Level, Tile};
use crate::topology::{LeafNode, Topology, leaf_mask};
use crate::value::Value;

/// Reads nodes into a topology.
pub(crate) struct Walk<'a> {
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

impl<'a> Walk<'a> {
    /// With `keep` unset, leaves are counted but not remembered.
    pub fn new(encoding: &'a Encoding, keep: bool, topology: Topology) -> Self {
        Self {
            encoding,
            keep,
            scratch: Scratch::default(),
            wide: Vec::new(),
            topology,
        }
    }

    /// Reads the tree behind its background.
    pub fn run(mut self, reader: &mut Reader<'_>) -> Parsed<Topology> {
        self.root(reader)?;
        Ok(self.topology)
    }

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

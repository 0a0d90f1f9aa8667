//! Tiles: regions of one value above the leaves.

use crate::value::{Value, ValueType};

/// A cube of voxels that share one value and one state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tile {
    /// The lowest index coordinate in it, a multiple of `dim`.
    pub origin: [i32; 3],
    /// Its edge in voxels: 8, 128 or 4096.
    pub dim: u32,
    /// The value of every voxel in it.
    pub value: Value,
    /// Whether its voxels are active.
    pub active: bool,
}

/// The two kinds of inner nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Level {
    /// 16³ children of 8³ voxels.
    Lower,
    /// 32³ children of 128³ voxels.
    Upper,
}

impl Level {
    /// Children per axis, as a power of two.
    pub fn log2(self) -> u32 {
        match self {
            Self::Lower => 4,
            Self::Upper => 5,
        }
    }

    /// Number of children.
    pub fn slots(self) -> usize {
        1 << (3 * self.log2())
    }

    /// Edge of a child in voxels.
    pub fn child_dim(self) -> u32 {
        match self {
            Self::Lower => 8,
            Self::Upper => 128,
        }
    }

    /// Origin of the child in `slot` = (x << 2·log2) | (y << log2) | z.
    pub fn child_origin(self, origin: [i32; 3], slot: usize) -> [i32; 3] {
        let log2 = self.log2();
        let axis = (1 << log2) - 1;
        let slot = slot as i32;
        let place = [slot >> (2 * log2), (slot >> log2) & axis, slot & axis];
        // Node origins are multiples of the node's size, so this stays within the node.
        [0, 1, 2].map(|i| origin[i] + place[i] * self.child_dim() as i32)
    }
}

/// A run of consecutive slots with equal value and state. The top bit of `first` is the state.
#[derive(Clone, Copy)]
struct Run {
    first: u16,
    length: u16,
}

const ACTIVE: u16 = 0x8000;

impl Run {
    fn start(self) -> usize {
        usize::from(self.first & !ACTIVE)
    }
}

struct Node {
    level: Level,
    origin: [i32; 3],
    /// Its runs: from here to the next node's.
    runs: usize,
}

/// The tiles of a tree that are active or differ from the background, packed as runs: an inner node
/// has up to 32,768 of them, and level sets fill their inside with inactive ones.
pub(crate) struct Tiles {
    kind: ValueType,
    root: Vec<Tile>,
    nodes: Vec<Node>,
    runs: Vec<Run>,
    /// One value per run, at full precision.
    values: Vec<u8>,
}

impl Tiles {
    pub fn new(kind: ValueType) -> Self {
        Self {
            kind,
            root: Vec::new(),
            nodes: Vec::new(),
            runs: Vec::new(),
            values: Vec::new(),
        }
    }

    pub fn push_root(&mut self, tile: Tile) {
        self.root.push(tile);
    }

    /// Opens the node whose slots the following [`push`](Self::push)es speak of.
    pub fn begin(&mut self, level: Level, origin: [i32; 3]) {
        if self
            .nodes
            .last()
            .is_some_and(|node| node.runs == self.runs.len())
        {
            self.nodes.pop(); // it got no tiles
        }
        self.nodes.push(Node {
            level,
            origin,
            runs: self.runs.len(),
        });
    }

    /// Adds a tile; slots come in rising order.
    pub fn push(&mut self, slot: usize, active: bool, value: &[u8]) {
        let size = self.kind.size();
        let state = if active { ACTIVE } else { 0 };
        if self
            .nodes
            .last()
            .is_some_and(|node| node.runs < self.runs.len())
            && let Some(run) = self.runs.last_mut()
            && run.start() + usize::from(run.length) == slot
            && run.first & ACTIVE == state
            && self.values[self.values.len() - size..] == *value
        {
            run.length += 1;
            return;
        }
        self.runs.push(Run {
            first: slot as u16 | state,
            length: 1,
        });
        self.values.extend_from_slice(value);
    }

    pub fn root(&self) -> &[Tile] {
        &self.root
    }

    pub fn iter(&self) -> impl Iterator<Item = Tile> + '_ {
        let inner = self.nodes().flat_map(move |(index, level, origin)| {
            self.runs_of(index).flat_map(move |run| {
                let (value, active) = self.of_run(run);
                let slots = self.runs[run].start()
                    ..self.runs[run].start() + usize::from(self.runs[run].length);
                slots.map(move |slot| Tile {
                    origin: level.child_origin(origin, slot),
                    dim: level.child_dim(),
                    value,
                    active,
                })
            })
        });
        self.root.iter().copied().chain(inner)
    }

    /// Index, level and origin of each inner node with tiles.
    pub fn nodes(&self) -> impl Iterator<Item = (usize, Level, [i32; 3])> + '_ {
        self.nodes
            .iter()
            .enumerate()
            .map(|(index, node)| (index, node.level, node.origin))
    }

    /// Value and state of the tile in `slot` of the `node`th inner node, if it has one.
    pub fn find(&self, node: usize, slot: usize) -> Option<(Value, bool)> {
        let range = self.runs_of(node);
        let runs = &self.runs[range.clone()];
        let last = runs
            .partition_point(|run| run.start() <= slot)
            .checked_sub(1)?;
        let run = runs[last];
        (slot < run.start() + usize::from(run.length)).then(|| self.of_run(range.start + last))
    }

    fn runs_of(&self, node: usize) -> std::ops::Range<usize> {
        let end = self
            .nodes
            .get(node + 1)
            .map_or(self.runs.len(), |next| next.runs);
        self.nodes[node].runs..end
    }

    fn of_run(&self, run: usize) -> (Value, bool) {
        let size = self.kind.size();
        let value = Value::from_bytes(self.kind, &self.values[run * size..][..size]);
        (value, self.runs[run].first & ACTIVE != 0)
    }
}

//! Writes small OpenVDB files of any density, for tests that need to know every voxel.

use std::collections::BTreeMap;

/// A float grid given by its voxels.
pub struct Voxels {
    /// Written as half floats.
    pub half: bool,
    /// Rows of the 4×4 matrix that acts on row vectors, as OpenVDB writes it.
    pub matrix: [[f64; 4]; 4],
    /// Value of everything else.
    pub background: f32,
    /// Active voxels.
    pub voxels: BTreeMap<[i32; 3], f32>,
    /// Active tiles of 4096³ voxels.
    pub root_tiles: Vec<([i32; 3], f32)>,
    /// Active tiles of 128³ voxels.
    pub tiles: Vec<([i32; 3], f32)>,
}

impl Voxels {
    /// The voxels `lo..hi` (not including `hi`) with values of `f`, cubes of edge 1 centred at their indices.
    pub fn new(lo: [i32; 3], hi: [i32; 3], f: impl Fn([i32; 3]) -> f32) -> Self {
        let mut voxels = BTreeMap::new();
        for x in lo[0]..hi[0] {
            for y in lo[1]..hi[1] {
                for z in lo[2]..hi[2] {
                    voxels.insert([x, y, z], f([x, y, z]));
                }
            }
        }
        Self {
            half: false,
            matrix: scale(1.0),
            background: 0.0,
            voxels,
            root_tiles: Vec::new(),
            tiles: Vec::new(),
        }
    }

    /// The bytes of a file with this grid alone, named `density`.
    pub fn bytes(&self) -> Vec<u8> {
        let mut out = 0x5644_4220_i64.to_le_bytes().to_vec();
        for word in [224u32, 10, 0] {
            out.extend(word.to_le_bytes());
        }
        out.push(1);
        out.extend([b'0'; 36]);
        out.extend(0u32.to_le_bytes());
        out.extend(1u32.to_le_bytes());
        for part in [
            "density",
            if self.half {
                "Tree_float_5_4_3_HalfFloat"
            } else {
                "Tree_float_5_4_3"
            },
            "",
        ] {
            text(&mut out, part.as_bytes());
        }
        let grid = self.grid();
        let start = out.len() as u64 + 24;
        for offset in [start, start + grid.len() as u64, start + grid.len() as u64] {
            out.extend(offset.to_le_bytes());
        }
        out.extend(grid);
        out
    }

    fn grid(&self) -> Vec<u8> {
        let mut out = 2u32.to_le_bytes().to_vec();
        out.extend(2u32.to_le_bytes());
        for (name, kind, value) in [
            ("class", "string", b"fog volume".to_vec()),
            ("is_saved_as_half_float", "bool", vec![u8::from(self.half)]),
        ] {
            text(&mut out, name.as_bytes());
            text(&mut out, kind.as_bytes());
            text(&mut out, &value);
        }
        text(&mut out, b"AffineMap");
        out.extend(self.matrix.iter().flatten().flat_map(|v| v.to_le_bytes()));
        self.tree(&mut out);
        out
    }

    fn tree(&self, out: &mut Vec<u8>) {
        let mut leaves: BTreeMap<[i32; 3], ([u64; 8], Vec<f32>)> = BTreeMap::new();
        for (at, value) in &self.voxels {
            let leaf = leaves
                .entry(at.map(|c| c & !7))
                .or_insert_with(|| ([0; 8], vec![self.background; 512]));
            let k = ((at[0] & 7) << 6 | (at[1] & 7) << 3 | (at[2] & 7)) as usize;
            leaf.0[k >> 6] |= 1 << (k & 63);
            leaf.1[k] = *value;
        }
        // Per upper node, its lower nodes; per lower node, its leaves in the order of their slots.
        let mut uppers: BTreeMap<[i32; 3], BTreeMap<usize, Vec<[i32; 3]>>> = BTreeMap::new();
        for origin in leaves.keys() {
            let upper = uppers.entry(origin.map(|c| c & !4095)).or_default();
            upper.entry(slot(*origin, 7, 5)).or_default().push(*origin);
        }
        for (origin, _) in &self.tiles {
            uppers.entry(origin.map(|c| c & !4095)).or_default();
        }
        out.extend(1u32.to_le_bytes());
        out.extend(self.background.to_le_bytes());
        out.extend((self.root_tiles.len() as u32).to_le_bytes());
        out.extend((uppers.len() as u32).to_le_bytes());
        for (origin, value) in &self.root_tiles {
            out.extend(origin.iter().flat_map(|c| c.to_le_bytes()));
            out.extend(value.to_le_bytes());
            out.push(1);
        }
        let mut order = Vec::new();
        for (origin, lowers) in &mut uppers {
            out.extend(origin.iter().flat_map(|c| c.to_le_bytes()));
            let mut tiles: Vec<_> = self
                .tiles
                .iter()
                .filter(|t| t.0.map(|c| c & !4095) == *origin)
                .map(|t| (slot(t.0, 7, 5), t.1))
                .collect();
            tiles.sort_by_key(|t| t.0);
            masks(
                out,
                32768,
                lowers.keys().copied(),
                tiles.iter().map(|t| t.0),
            );
            out.push(0);
            tiles.iter().for_each(|t| self.value(out, t.1));
            for leaves_here in lowers.values_mut() {
                leaves_here.sort_by_key(|l| slot(*l, 3, 4));
                masks(
                    out,
                    4096,
                    leaves_here.iter().map(|l| slot(*l, 3, 4)),
                    [].into_iter(),
                );
                out.push(0);
                for leaf in leaves_here.iter() {
                    out.extend(leaves[leaf].0.iter().flat_map(|w| w.to_le_bytes()));
                    order.push(*leaf);
                }
            }
        }
        for leaf in order {
            let (mask, values) = &leaves[&leaf];
            out.extend(mask.iter().flat_map(|w| w.to_le_bytes()));
            out.push(6); // all values stored
            values.iter().for_each(|v| self.value(out, *v));
        }
    }

    fn value(&self, out: &mut Vec<u8>, v: f32) {
        if self.half {
            out.extend(half::f16::from_f32(v).to_le_bytes());
        } else {
            out.extend(v.to_le_bytes());
        }
    }
}

/// A uniform scale.
pub fn scale(s: f64) -> [[f64; 4]; 4] {
    [
        [s, 0.0, 0.0, 0.0],
        [0.0, s, 0.0, 0.0],
        [0.0, 0.0, s, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
}

fn text(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend((bytes.len() as u32).to_le_bytes());
    out.extend(bytes);
}

/// Slot of a child with edge 2^`log` in a node of 2^`fan` children along each edge.
fn slot(at: [i32; 3], log: u32, fan: u32) -> usize {
    let mask = (1 << fan) - 1;
    let [x, y, z] = at.map(|c| (c >> log & mask) as usize);
    x << (2 * fan) | y << fan | z
}

fn masks(
    out: &mut Vec<u8>,
    slots: usize,
    children: impl Iterator<Item = usize>,
    tiles: impl Iterator<Item = usize>,
) {
    let mut bits = vec![0u8; slots / 4];
    children.for_each(|s| bits[s / 8] |= 1 << (s % 8));
    tiles.for_each(|s| bits[slots / 8 + s / 8] |= 1 << (s % 8));
    out.extend(bits);
}

//! Writes small files by hand, right ones and wrong ones, that OpenVDB itself would not write.

use std::io::Write;

/// The parts of a file with one grid; the defaults make an empty `float` grid.
pub struct Writer {
    pub version: u32,
    pub name: &'static str,
    pub tree: &'static str,
    pub flags: u32,
    pub metadata: Vec<(&'static str, &'static str, Vec<u8>)>,
    pub map: Vec<u8>,
    /// Everything from the buffer count on.
    pub body: Vec<u8>,
}

pub fn text(bytes: impl AsRef<[u8]>) -> Vec<u8> {
    let bytes = bytes.as_ref();
    let mut out = (bytes.len() as u32).to_le_bytes().to_vec();
    out.extend_from_slice(bytes);
    out
}

pub fn doubles(name: &str, values: &[f64]) -> Vec<u8> {
    let mut out = text(name);
    out.extend(values.iter().flat_map(|v| v.to_le_bytes()));
    out
}

impl Default for Writer {
    fn default() -> Self {
        Self {
            version: 224,
            name: "density",
            tree: "Tree_float_5_4_3",
            flags: 2,
            metadata: vec![("class", "string", b"fog volume".to_vec())],
            map: doubles("UniformScaleMap", &[0.5; 15]),
            body: root(&0.0_f32.to_le_bytes(), &[], 0),
        }
    }
}

impl Writer {
    /// Header and file metadata (none), up to the number of grids.
    pub fn header(version: u32, grids: i32, offsets: bool) -> Vec<u8> {
        let mut out = 0x5644_4220_i64.to_le_bytes().to_vec();
        for word in [version, 10, 0] {
            out.extend(word.to_le_bytes());
        }
        out.push(offsets.into());
        out.extend([b'0'; 36]);
        out.extend(0_u32.to_le_bytes());
        out.extend(grids.to_le_bytes());
        out
    }

    /// Appends descriptor and grid.
    pub fn grid(&self, out: &mut Vec<u8>, parent: &str) {
        for part in [self.name, self.tree, parent] {
            out.extend(text(part));
        }
        let mut grid = self.flags.to_le_bytes().to_vec();
        grid.extend((self.metadata.len() as u32).to_le_bytes());
        for (name, kind, value) in &self.metadata {
            grid.extend([text(name), text(kind), text(value)].concat());
        }
        grid.extend_from_slice(&self.map);
        if parent.is_empty() {
            grid.extend_from_slice(&self.body);
        }
        let start = out.len() as u64 + 24;
        let end = start + grid.len() as u64;
        for offset in [start, end, end] {
            out.extend(offset.to_le_bytes());
        }
        out.extend(grid);
    }

    pub fn file(&self) -> Vec<u8> {
        let mut out = Self::header(self.version, 1, true);
        self.grid(&mut out, "");
        out
    }
}

/// Buffer count, background, root tiles (origin, value, state) and the number of root children.
pub fn root(background: &[u8], tiles: &[([i32; 3], &[u8], bool)], children: u32) -> Vec<u8> {
    let mut out = 1_u32.to_le_bytes().to_vec();
    out.extend_from_slice(background);
    out.extend((tiles.len() as u32).to_le_bytes());
    out.extend(children.to_le_bytes());
    for (origin, value, active) in tiles {
        out.extend(origin.iter().flat_map(|c| c.to_le_bytes()));
        out.extend_from_slice(value);
        out.push((*active).into());
    }
    out
}

pub fn coordinate(at: [i32; 3]) -> Vec<u8> {
    at.iter().flat_map(|c| c.to_le_bytes()).collect()
}

/// Masks of a node: the set children, then the set active tiles.
pub fn masks(slots: usize, children: &[usize], active: &[usize]) -> Vec<u8> {
    let mut out = vec![0; slots / 4];
    for (base, set) in [(0, children), (slots / 8, active)] {
        for slot in set {
            out[base + slot / 8] |= 1 << (slot % 8);
        }
    }
    out
}

/// A buffer packed with zlib, behind its length.
pub fn zipped(bytes: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    packer.write_all(bytes).unwrap();
    let packed = packer.finish().unwrap();
    let mut out = (packed.len() as i64).to_le_bytes().to_vec();
    out.extend(packed);
    out
}

/// A tree with the given leaves in the lower node at the origin: the upper and the lower node, the
/// leaves' masks, then their buffers (code, inactive values, selection, values) as given. With
/// `packed`, the nodes' empty values have a length in front.
pub fn leaves(packed: bool, background: &[u8], leaves: &[(usize, [u64; 8], Vec<u8>)]) -> Vec<u8> {
    let empty = &[0; 9][..if packed { 9 } else { 1 }];
    let mut out = root(background, &[], 1);
    out.extend(coordinate([0; 3]));
    out.extend(masks(32768, &[0], &[]));
    out.extend_from_slice(empty); // code: inactive tiles are background; no values
    let slots: Vec<usize> = leaves.iter().map(|leaf| leaf.0).collect();
    out.extend(masks(4096, &slots, &[]));
    out.extend_from_slice(empty);
    let mask = |mask: &[u64; 8]| {
        mask.iter()
            .flat_map(|word| word.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    leaves.iter().for_each(|leaf| out.extend(mask(&leaf.1)));
    for leaf in leaves {
        out.extend(mask(&leaf.1));
        out.extend_from_slice(&leaf.2);
    }
    out
}

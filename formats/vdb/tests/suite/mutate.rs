//! Files to start from, and seeded mutations of them.

use std::path::{Path, PathBuf};

/// A sound or damaged file to start from.
pub struct Seed {
    pub name: String,
    pub bytes: Vec<u8>,
}

/// The corpus and the smaller files of other programs.
pub fn seeds() -> Vec<Seed> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let mut paths: Vec<PathBuf> = ["corpus", "real"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|kind| kind == "vdb"))
        .collect();
    paths.sort();
    let seed = |path: PathBuf| Seed {
        name: path.file_name().unwrap().to_string_lossy().into_owned(),
        bytes: std::fs::read(&path).unwrap(),
    };
    paths
        .into_iter()
        .map(seed)
        .filter(|seed| seed.bytes.len() < 250_000)
        .collect()
}

/// SplitMix64 (Steele, Lea and Flood 2014): small, and the same everywhere.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        x ^ (x >> 31)
    }

    /// Uniform in `0..end`; 0 if there is nothing to choose from.
    pub fn below(&mut self, end: usize) -> usize {
        if end == 0 {
            0
        } else {
            (self.next() % end as u64) as usize
        }
    }

    pub fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    fn choose<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

const WORDS: [i64; 24] = [
    0,
    1,
    -1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    16,
    48,
    64,
    127,
    128,
    255,
    512,
    2048,
    4096,
    32768,
    i32::MAX as i64,
    i32::MIN as i64,
    i64::MAX,
    i64::MIN,
];

const TEXTS: [&[u8]; 20] = [
    b"Tree_float_5_4_3",
    b"Tree_int32_5_4_3",
    b"Tree_vec3s_5_4_3",
    b"Tree_vec3d_5_4_3",
    b"Tree_vec3i_5_4_3",
    b"Tree_int64_5_4_3",
    b"Tree_bool_5_4_3",
    b"Tree_mask_5_4_3",
    b"Tree_double_5_4_3",
    b"Tree_ptdataidx32_5_4_3",
    b"ScaleMap",
    b"UniformScaleMap",
    b"TranslationMap",
    b"AffineMap",
    b"NonlinearFrustumMap",
    b"is_saved_as_half_float",
    b"string",
    b"bool",
    b"mat4d",
    b"vec3i",
];

/// A damaged copy of one of the seeds.
pub fn mutate(seeds: &[Seed], random: &mut Random) -> (usize, Vec<u8>) {
    let index = random.below(seeds.len());
    let mut bytes = seeds[index].bytes.clone();
    let length = bytes.len();
    for _ in 0..=random.below(4) {
        step(&mut bytes, seeds, random);
    }
    // A file that is not as long as it says is refused early: let some keep their word.
    if bytes.len() != length && !random.one_in(3) {
        let (old, new) = (
            (length as u64).to_le_bytes(),
            (bytes.len() as u64).to_le_bytes(),
        );
        if let Some(at) = bytes.windows(8).position(|word| word == old) {
            bytes[at..at + 8].copy_from_slice(&new);
        }
    }
    (index, bytes)
}

/// A place in the file: often in its head, and mostly where something is (masks are mostly zeros).
fn place(bytes: &[u8], random: &mut Random) -> usize {
    let end = if random.one_in(3) {
        bytes.len().min(1500)
    } else {
        bytes.len()
    };
    let mut at = random.below(end);
    for _ in 0..12 {
        if bytes.get(at).is_some_and(|byte| *byte != 0) {
            break;
        }
        at = random.below(end);
    }
    // Beside it, so that zeros next to something get their turn.
    at.saturating_add(random.below(9))
        .saturating_sub(4)
        .min(bytes.len().saturating_sub(1))
}

fn step(bytes: &mut Vec<u8>, seeds: &[Seed], random: &mut Random) {
    if bytes.is_empty() {
        bytes.extend((0..random.below(64)).map(|i| i as u8));
        return;
    }
    let at = place(bytes, random);
    match random.below(10) {
        0 | 1 => bytes[at] ^= 1 << random.below(8),
        2 => bytes[at] = random.next() as u8,
        3 | 4 => {
            let word = random
                .choose(&WORDS)
                .wrapping_add(random.choose(&[0, 0, 0, 1, -1]));
            let size = random.choose(&[1, 2, 4, 8]).min(bytes.len() - at);
            bytes[at..at + size].copy_from_slice(&word.to_le_bytes()[..size]);
        }
        5 => bytes.truncate(if random.one_in(2) {
            at
        } else {
            bytes.len() - random.below(bytes.len().min(64))
        }),
        6 => {
            // A piece of a file, over what is there or between.
            let other = &seeds[random.below(seeds.len())].bytes;
            let from = random.below(other.len());
            let size = random
                .choose(&[8, 64, 128, 512, 4096])
                .min(other.len() - from);
            let piece = &other[from..from + size];
            let end = if random.one_in(2) {
                at
            } else {
                (at + size).min(bytes.len())
            };
            bytes.splice(at..end, piece.iter().copied());
        }
        7 => {
            let end = (at + random.choose(&[1, 4, 8, 12, 64, 512])).min(bytes.len());
            if random.one_in(2) {
                bytes.drain(at..end);
            } else {
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
        }
        8 => {
            let end = (at + random.choose(&[2, 8, 16, 64, 512, 4096])).min(bytes.len());
            bytes[at..end].fill(random.choose(&[0, 0xff, 0x55, 1]));
        }
        _ => swap_name(bytes, random),
    }
}

/// Puts one known name, with its length, in the place of another.
fn swap_name(bytes: &mut Vec<u8>, random: &mut Random) {
    let (old, new) = (random.choose(&TEXTS), random.choose(&TEXTS));
    let head = &bytes[..bytes.len().min(4096)];
    let Some(at) = head.windows(old.len()).position(|part| part == old) else {
        return;
    };
    if at < 4 {
        return;
    }
    let mut text = (new.len() as u32).to_le_bytes().to_vec();
    text.extend_from_slice(new);
    bytes.splice(at - 4..at + old.len(), text);
}

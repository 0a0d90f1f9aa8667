//! Damaged files give errors or models: no panic, no hang, no memory beyond reason.

mod common;

use common::everything;
use resolvent_gltf::Model;

/// A small generator (SplitMix64, Steele et al. 2014), so that every run does the same.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

/// Reads and looks at everything.
fn survives(bytes: &[u8]) -> bool {
    match Model::parse(bytes, "mutant.glb") {
        Ok(model) => {
            assert!(model.triangles() < 1 << 24);
            if let Some(b) = model.bounds() {
                assert!(b.iter().flatten().all(|x| !x.is_nan()), "{b:?}");
            }
            true
        }
        Err(_) => false,
    }
}

#[test]
fn truncations_are_errors() {
    let good = everything().glb();
    assert!(survives(&good));
    for end in 0..good.len() - 4 {
        if end % 7 == 0 || end < 64 {
            assert!(!survives(&good[..end]), "{end}");
        }
    }
}

/// Bytes of the text and of the buffer changed.
#[test]
fn changed_bytes() {
    let good = everything().glb();
    let mut random = Random(1);
    let mut read = 0;
    for _ in 0..3000 {
        let mut bytes = good.clone();
        for _ in 0..1 + random.below(3) {
            let at = random.below(bytes.len());
            bytes[at] = random.below(256) as u8;
        }
        read += u32::from(survives(&bytes));
    }
    assert!(read > 100, "{read}");
}

/// Numbers of the text replaced by others, which keeps it JSON and reaches the checks behind it.
#[test]
fn changed_numbers() {
    let builder = everything();
    let text = builder.json.to_string();
    let numbers: Vec<(usize, usize)> = {
        let bytes = text.as_bytes();
        let digit = |i: usize| {
            bytes
                .get(i)
                .is_some_and(|b| b.is_ascii_digit() || *b == b'.')
        };
        let starts = (1..bytes.len())
            .filter(|i| digit(*i) && !digit(i - 1) && !bytes[i - 1].is_ascii_alphabetic());
        starts
            .map(|i| (i, (i..).find(|j| !digit(*j)).unwrap_or(i)))
            .collect()
    };
    let others = [
        "0",
        "1",
        "2",
        "3",
        "7",
        "-1",
        "0.5",
        "65535",
        "4294967295",
        "4294967296",
        "18446744073709551615",
        "1e308",
        "1e-308",
        "5120",
        "5125",
        "null",
        "[]",
        "\"x\"",
    ];
    let mut random = Random(2);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..4000 {
        let (start, end) = numbers[random.below(numbers.len())];
        let other = others[random.below(others.len())];
        let changed = format!("{}{other}{}", &text[..start], &text[end..]);
        let Ok(json) = serde_json::from_str(&changed) else {
            continue;
        };
        let mutant = common::Builder {
            json,
            bin: builder.bin.clone(),
        };
        if survives(&mutant.glb()) {
            read += 1;
        } else {
            refused += 1;
        }
    }
    assert!(read > 300 && refused > 300, "{read} {refused}");
}

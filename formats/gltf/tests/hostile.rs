//! Damaged files give errors or models: no panic, no hang, no memory beyond reason.

mod common;
mod memory;

use common::{Builder, everything};
use resolvent_gltf::Model;
use serde_json::json;

#[global_allocator]
static ALLOCATOR: memory::Counting = memory::Counting;

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

/// Primitives that share vertices take time and memory for their own vertices, not each for all of them.
#[test]
fn shared_vertices_are_not_copied_for_each_primitive() {
    const VERTICES: usize = 60_000;
    const PRIMITIVES: usize = 400;
    let mut b = Builder::new();
    let at = |i: usize| [i as f32, (i * i % 1009) as f32, 1.0];
    let points: Vec<f32> = (0..VERTICES).flat_map(at).collect();
    let p = b.floats(&points, 3);
    let n = b.floats(&vec![1.0; 3 * VERTICES], 3);
    let primitives: Vec<_> = (0..PRIMITIVES)
        .map(|k| {
            let i = b.indices(&[0, 1, 2].map(|c| (k * 149 + c) as u16));
            json!({"attributes": {"POSITION": p, "NORMAL": n}, "indices": i})
        })
        .collect();
    b.push("meshes", json!({"primitives": primitives}));
    b.push("nodes", json!({"mesh": 0}));
    let bytes = b.glb();
    memory::start();
    let model = Model::parse(&bytes, "shared.glb").unwrap();
    // The JSON takes most of it. Every vertex for every primitive would be 2.4 GB.
    let taken = memory::taken();
    assert!(taken < 8 * bytes.len(), "{taken} bytes for {}", bytes.len());
    let shapes = &model.meshes[0].shapes;
    assert_eq!(shapes.len(), PRIMITIVES);
    for (k, shape) in shapes.iter().enumerate() {
        let expected = [0, 1, 2].map(|c| at(k * 149 + c).map(f64::from));
        assert_eq!(common::mesh(shape).positions, expected);
        assert_eq!(common::mesh(shape).indices, [[0, 1, 2]]);
    }
}

/// Sparse accessors are many at no cost, too.
#[test]
fn shared_sparse_elements_are_bounded() {
    const CHANGES: usize = 50_000;
    let mut b = Builder::new();
    let indices: Vec<u8> = (0..CHANGES as u16).flat_map(u16::to_le_bytes).collect();
    let indices = b.view(&indices);
    let values = b.view(&vec![0; 12 * CHANGES]);
    let triangle = b.indices(&[0, 1, 2]);
    let mut add = |last: usize| {
        let accessor = b.push(
            "accessors",
            json!({
                "componentType": 5126, "count": last + 1, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0],
                "sparse": {
                    "count": CHANGES, "indices": {"bufferView": indices, "componentType": 5123},
                    "values": {"bufferView": values}
                }
            }),
        );
        json!({"attributes": {"POSITION": accessor}, "indices": triangle})
    };
    let few: Vec<_> = (0..20).map(|_| add(CHANGES)).collect();
    let many: Vec<_> = (0..1000).map(|_| add(CHANGES)).collect();
    let short = vec![add(CHANGES - 2)];
    b.push("nodes", json!({"mesh": 0}));
    let mut with = |primitives: Vec<serde_json::Value>| {
        b.json["meshes"] = json!([{"primitives": primitives}]);
        let model = Model::parse(&b.glb(), "sparse.glb");
        model.map(|m| m.triangles()).map_err(|e| e.to_string())
    };
    assert_eq!(with(few), Ok(20));
    let error = with(many).unwrap_err();
    assert!(error.contains("more sparse elements than"), "{error}");
    let error = with(short).unwrap_err();
    assert!(
        error.contains("replaces its element 49999 of 49999"),
        "{error}"
    );
    b.bin[2..4].copy_from_slice(&[0, 0]);
    let error = b.error();
    assert!(
        error.contains("have to increase, and 0 comes before 0"),
        "{error}"
    );
}

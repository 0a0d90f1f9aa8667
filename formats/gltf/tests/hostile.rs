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

/// Bytes that parsing asks for, in bytes of the file.
fn work(bytes: &[u8], path: &std::path::Path) -> (Result<Model, String>, usize) {
    memory::start();
    let model = Model::parse(bytes, path).map_err(|e| e.to_string());
    (model, memory::taken() / bytes.len())
}

/// Shows nodes, all of them roots.
fn show(b: &mut Builder, nodes: impl Iterator<Item = serde_json::Value>) {
    b.json["nodes"] = nodes.collect();
    let count = b.json["nodes"].as_array().unwrap().len();
    b.json["scenes"][0]["nodes"] = (0..count).collect();
}

/// Images of one buffer view are one copy; views that overlap do not multiply their bytes.
#[test]
fn images_share_their_bytes() {
    let with = |overlap: bool| {
        let mut b = Builder::new();
        let view = b.view(&[7; 1 << 18]);
        for i in 0..500 {
            let at = json!({"buffer": 0, "byteOffset": i, "byteLength": (1 << 18) - 500});
            let own = if overlap {
                b.push("bufferViews", at)
            } else {
                view
            };
            b.push(
                "images",
                json!({"bufferView": own, "mimeType": "image/png"}),
            );
        }
        let texture = b.push("textures", json!({"source": 499}));
        let info = json!({"index": texture});
        let pbr = json!({"baseColorTexture": info});
        let material = b.push("materials", json!({"pbrMetallicRoughness": pbr}));
        let square = b.square(Some(material));
        b.push("nodes", json!({"mesh": square}));
        work(&b.glb(), "images.glb".as_ref())
    };
    let (model, work) = with(false);
    assert_eq!(model.unwrap().textures.len(), 1);
    assert!(work < 20, "{work}");
    let (model, work) = with(true);
    let error = model.err().unwrap();
    assert!(
        error.contains("images[499]: overlaps with others"),
        "{error}"
    );
    assert!(work < 20, "{work}");
}

/// Buffers of one file are read once, whatever they call it, and make no room for more triangles.
#[test]
fn buffers_share_their_files() {
    let folder = std::env::temp_dir().join(format!("resolvent-shared-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("a.bin"), vec![0; 1 << 20]).unwrap();
    let mut b = Builder::new();
    let cube = b.cube();
    b.push("nodes", json!({"mesh": cube}));
    for i in 0..500 {
        let uri = format!("{}a.bin", "./".repeat(i % 3));
        b.push("buffers", json!({"byteLength": (1 << 20) - i, "uri": uri}));
    }
    let bytes = b.glb();
    let (model, work) = work(&bytes, &folder.join("m.glb"));
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(model.unwrap().triangles(), 12);
    // Read once, it is some 40 times the model.
    assert!(work < 200, "{work}");
}

/// Long names that many parts of a scene repeat.
#[test]
fn names_are_cut_off() {
    let long = "n".repeat(1 << 17);
    let mut b = Builder::new();
    let material = b.push("materials", json!({"name": long}));
    let square = b.square(Some(material));
    b.json["meshes"][square]["name"] = json!(long);
    let primitive = b.json["meshes"][square]["primitives"][0].clone();
    b.json["meshes"][square]["primitives"] = json!(vec![primitive; 500]);
    b.push(
        "cameras",
        json!({"name": long, "type": "perspective", "perspective": {"yfov": 1, "znear": 1}}),
    );
    b.push("skins", json!({"name": long, "joints": [0]}));
    let node = json!({"mesh": square, "camera": 0, "skin": 0});
    show(&mut b, (0..500).map(|_| node.clone()));
    let (model, work) = work(&b.glb(), "names.glb".as_ref());
    let model = model.unwrap();
    assert_eq!(
        (model.cameras.len(), model.meshes[0].shapes.len()),
        (500, 500)
    );
    assert!(
        model.meshes[0].name.chars().count() < 200 && work < 40,
        "{work}"
    );
}

/// Reads a model of a folder into a scene with the model alone.
fn expanded(b: &Builder, name: &str) -> Result<(resolvent_scene::Scene, usize), String> {
    let folder = std::env::temp_dir().join(format!("resolvent-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("m.glb"), b.glb()).unwrap();
    let text = r#"{
        "resolvent": 1, "camera": {"type": "perspective", "origin": [0, 0, 1], "target": [0, 0, 0], "fov_x_deg": 40},
        "film": {"resolution": [4, 4]}, "shapes": [{"type": "gltf", "file": "m.glb"}]
    }"#;
    let scene = resolvent_scene::Scene::parse(text.as_bytes(), folder.join("s.json"));
    let mut scene = scene.map_err(|e| e.to_string())?;
    memory::start();
    let done = resolvent_gltf::expand(&mut scene);
    let taken = memory::taken();
    std::fs::remove_dir_all(&folder).unwrap();
    done.map(|_| (scene, taken)).map_err(|e| e.to_string())
}

/// A mesh that emits is copied for each node, so that a small file could fill any memory.
#[test]
fn copies_of_lights_are_bounded() {
    let with = |places: usize| {
        let mut b = Builder::new();
        let material = b.push("materials", json!({"emissiveFactor": [1, 1, 1]}));
        let square = b.square(Some(material));
        let primitive = b.json["meshes"][square]["primitives"][0].clone();
        b.json["meshes"][square]["primitives"] = json!(vec![primitive; 1000]);
        show(&mut b, (0..places).map(|_| json!({"mesh": square})));
        expanded(&b, "lights").map(|(scene, _)| scene.shapes.len())
    };
    assert_eq!(with(20), Ok(20_000));
    let error = with(2000).unwrap_err();
    assert!(
        error.contains("m.glb: the mesh 'square' at 2000 places"),
        "{error}"
    );
}

/// Prototypes of one name are numbered without trying all numbers again.
#[test]
fn meshes_of_one_name() {
    const MESHES: usize = 3000;
    let mut b = Builder::new();
    b.square(None);
    let mesh = b.json["meshes"][0].clone();
    b.json["meshes"] = json!(vec![mesh; MESHES]);
    let nodes = (0..2 * MESHES).map(|i| json!({"mesh": i / 2, "translation": [i, 0, 0]}));
    show(&mut b, nodes);
    let (scene, taken) = expanded(&b, "names").unwrap();
    assert_eq!(scene.prototypes.len(), MESHES);
    assert!(scene.prototypes.contains_key("m.glb: square (3000)"));
    // All numbers again for each would be 4.5 million names: 161 MB.
    assert!(taken < 60 << 20, "{taken}");
}

/// What is asked of every vertex at every place is asked of the corners of boxes where that is too much.
#[test]
fn points_of_many_places() {
    let with = |places: usize| {
        let mut b = Builder::new();
        let points: Vec<f32> = (0..3 * 30_000).map(|i| (i * 7919 % 1000) as f32).collect();
        let p = b.floats(&points, 3);
        b.push(
            "meshes",
            json!({"primitives": [{"attributes": {"POSITION": p}}]}),
        );
        let nodes = (0..places).map(|i| json!({"mesh": 0, "translation": [i, 0, 0]}));
        show(&mut b, nodes);
        let model = b.read();
        let mut count = 0;
        model.for_each_point(|_| count += 1);
        (count, model.bounds().unwrap())
    };
    let (count, [lo, hi]) = with(10);
    assert_eq!(count, 300_000);
    let (count, [low, high]) = with(1000);
    assert_eq!(count, 8000);
    assert_eq!((low, high), (lo, [hi[0] + 990.0, hi[1], hi[2]]));
}

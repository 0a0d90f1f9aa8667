//! Compares what this crate reads with what the OpenVDB library read: the JSON beside each file.

use std::path::{Path, PathBuf};

use resolvent_vdb::{
    File, GridInfo, Halves, LeafValues, MetaValue, Parallel, Tile, Tree, Value, ValueType,
};
use serde_json::Value as Json;

/// Where the test files are.
pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

pub fn json(path: &Path) -> Json {
    let text = std::fs::read_to_string(path).unwrap();
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Two or more real threads, whatever the machine: order must not matter.
pub struct Rayon(rayon::ThreadPool);

impl Rayon {
    pub fn new() -> Self {
        Self(
            rayon::ThreadPoolBuilder::new()
                .num_threads(3)
                .build()
                .unwrap(),
        )
    }
}

impl Parallel for Rayon {
    fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        use rayon::prelude::*;
        self.0.install(|| (0..count).into_par_iter().for_each(task));
    }
}

/// How many claims of each sort were checked, so that a test can tell that it did something.
#[derive(Debug, Default)]
pub struct Checked {
    pub grids: usize,
    pub refused: usize,
    pub samples: usize,
    pub interpolated: usize,
    pub tiles: usize,
    pub metadata: usize,
    pub leaf_voxels: u64,
}

/// Checks every claim of a sidecar about a file that is fit to read.
pub fn check_file(path: &Path, parallel: &dyn Parallel, checked: &mut Checked) {
    let side = json(&path.with_extension("json"));
    let file = File::open(path).unwrap_or_else(|error| panic!("{error}"));
    if let Some(damage) = file.damage() {
        panic!("{damage}");
    }
    if let Some(header) = side.get("header") {
        assert_eq!(
            u64::from(file.version()),
            header["file_version"].as_u64().unwrap()
        );
        assert_eq!(
            file.library().map(Json::from),
            header["library"].as_array().unwrap()[..]
        );
        assert_eq!(
            file.grids().len() as u64,
            header["grid_count"].as_u64().unwrap()
        );
        let offsets = header["has_grid_offsets"].as_bool().unwrap();
        for (grid, claim) in file.grids().iter().zip(header["grids"].as_array().unwrap()) {
            check_descriptor(grid, claim, offsets);
        }
    }
    for (name, claim) in side["file_metadata"].as_object().unwrap() {
        check_metadata(file.metadata().get(name), claim, name);
        checked.metadata += 1;
    }
    let grids = side["grids"].as_array().unwrap();
    assert_eq!(grids.len(), file.grids().len(), "{}", path.display());
    for claim in grids {
        if claim.get("error").is_none() {
            check_grid(&file, claim, parallel, checked);
        }
    }
}

fn check_descriptor(grid: &GridInfo, claim: &Json, offsets: bool) {
    let named = claim["type"].as_str().unwrap();
    assert_eq!(grid.tree_type, named.trim_end_matches("_HalfFloat"));
    assert!(grid.saved_as_half || grid.tree_type == named);
    if let Some(flags) = claim["compression_flags"].as_u64() {
        use resolvent_vdb::Codec;
        let codec = if flags & 4 != 0 {
            Codec::Blosc
        } else if flags & 1 != 0 {
            Codec::Zip
        } else {
            Codec::None
        };
        assert_eq!(grid.compression.codec, codec);
        assert_eq!(grid.compression.active_mask, flags & 2 != 0);
    }
    if offsets {
        assert_eq!(grid.range[0], claim["grid_pos"].as_u64().unwrap());
        assert_eq!(grid.range[1], claim["end_pos"].as_u64().unwrap());
    }
    let parent = claim["instance_parent"]
        .as_str()
        .unwrap()
        .replace('\u{1e}', "[");
    assert_eq!(grid.instance_of.is_some(), !parent.is_empty());
}

fn check_grid(file: &File, claim: &Json, parallel: &dyn Parallel, checked: &mut Checked) {
    let unique = claim["unique_name"].as_str().unwrap();
    let place = format!("{}: {unique}", file.path().display());
    let grid = file.grid(unique).unwrap();
    assert_eq!(grid.unique_name, unique, "{place}");
    assert_eq!(grid.name, claim["name"].as_str().unwrap(), "{place}");
    assert_eq!(
        grid.tree_type,
        claim["tree_type"].as_str().unwrap(),
        "{place}"
    );
    assert_eq!(
        grid.class.to_string(),
        claim["class"].as_str().unwrap(),
        "{place}"
    );
    for (name, value) in claim["metadata"].as_object().unwrap() {
        if name == "file_compression" {
            // OpenVDB writes this one from the flags whenever it reads.
            assert_eq!(
                grid.compression.to_string(),
                value[1].as_str().unwrap(),
                "{place}"
            );
        } else {
            check_metadata(grid.metadata.get(name), value, &format!("{place}: {name}"));
        }
        checked.metadata += 1;
    }

    let map = claim["transform"]["map_type"].as_str().unwrap();
    let refused_by = if claim["tree_type"].as_str().unwrap().starts_with("Tree_pt") {
        Some(claim["tree_type"].as_str().unwrap())
    } else {
        (map == "NonlinearFrustumMap").then_some(map)
    };
    if let Some(name) = refused_by {
        let refusal = grid.refusal.as_ref().unwrap();
        assert_eq!(
            refusal.kind,
            resolvent_vdb::ErrorKind::Unsupported,
            "{place}"
        );
        assert!(refusal.to_string().contains(name), "{refusal}");
        assert!(file.read_topology(grid).is_err());
        checked.refused += 1;
        return;
    }
    // OpenVDB calls a mask tree's values bool.
    let kind = grid.value_type.unwrap();
    let kind = if kind == ValueType::Mask {
        ValueType::Bool
    } else {
        kind
    };
    assert_eq!(
        kind.name(),
        claim["value_type"].as_str().unwrap(),
        "{place}"
    );
    assert_eq!(
        grid.saved_as_half,
        claim["saved_as_half"].as_bool().unwrap(),
        "{place}"
    );
    check_transform(grid, &claim["transform"], &place);

    let tree = Tree::read(file, grid, parallel).unwrap_or_else(|error| panic!("{error}"));
    let topology = tree.topology();
    assert!(
        same(topology.background(), &claim["background"]),
        "{place}: background"
    );
    assert_eq!(
        topology.active_voxels(),
        claim["active_voxels"].as_u64().unwrap(),
        "{place}"
    );
    let bbox = topology
        .active_bbox()
        .map_or(Json::Null, |bbox| bbox.map(|c| c.to_vec()).to_vec().into());
    assert_eq!(bbox, claim["active_bbox"], "{place}");
    let counts: Vec<u64> = claim["node_counts_leaf_to_root"]
        .as_array()
        .unwrap()
        .iter()
        .map(|n| n.as_u64().unwrap())
        .collect();
    assert_eq!(
        topology.node_counts().map(|n| n as u64),
        counts[..3],
        "{place}"
    );

    check_leaves(file, grid, &tree, claim, parallel, &place, checked);
    check_tiles(&tree, claim, &place, checked);
    for sample in claim["samples"].as_array().unwrap() {
        let at = [0, 1, 2].map(|i| sample["ijk"][i].as_i64().unwrap() as i32);
        let (value, active) = tree.probe(at);
        assert!(
            same(value, &sample["value"]),
            "{place}: {value:?} at {at:?}, not {}",
            sample["value"]
        );
        assert_eq!(
            active,
            sample["active"].as_bool().unwrap(),
            "{place}: {at:?}"
        );
        checked.samples += 1;
    }
    for sample in claim["trilinear"].as_array().into_iter().flatten() {
        let index = [0, 1, 2].map(|i| number(&sample["index"][i]));
        let value = tree.sample(index);
        let expected = numbers(&sample["value"]);
        let scale = number(&sample["corner_scale"]);
        for (value, expected) in value.iter().zip(&expected) {
            let scale = scale.max(expected.abs()).max(1e-30);
            let near = (value - expected).abs() <= 1e-5 * scale
                || value.is_nan() && expected.is_nan()
                || value == expected;
            assert!(near, "{place}: {value} at {index:?}, not {expected}");
        }
        checked.interpolated += 1;
    }
    checked.grids += 1;
}

fn check_leaves(
    file: &File,
    grid: &GridInfo,
    tree: &Tree,
    claim: &Json,
    parallel: &dyn Parallel,
    place: &str,
    checked: &mut Checked,
) {
    let (mut count, mut sum, mut absolute, mut nan, mut checksum) = (0_u64, 0.0, 0.0, 0_u64, 0_u64);
    let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
    for (index, leaf) in tree.topology().leaves().iter().enumerate() {
        let values = tree.leaf(index);
        for offset in (0..512).filter(|offset| leaf.is_active(*offset)) {
            let value = values.get(offset);
            count += 1;
            let local = [offset >> 6, offset >> 3 & 7, offset & 7];
            let at = [0, 1, 2].map(|i| leaf.origin[i] + local[i] as i32);
            checksum = checksum.wrapping_add(fnv(at, value));
            let scalar = value.to_f64()[0];
            if scalar.is_nan() {
                nan += 1;
            } else {
                sum += scalar;
                absolute += scalar.abs();
                min = min.min(scalar);
                max = max.max(scalar);
            }
        }
    }
    assert_eq!(
        count,
        claim["active_leaf_voxels"].as_u64().unwrap(),
        "{place}"
    );
    assert_eq!(
        format!("{checksum:016x}"),
        claim["checksum_active_leaf_voxels"].as_str().unwrap(),
        "{place}"
    );
    if let Some(expected) = claim.get("leaf_sum") {
        let expected = number(expected);
        let bound = 1e-9 * number(&claim["leaf_abs_sum"]);
        assert!(
            (sum - expected).abs() <= bound || sum == expected || sum.is_nan() && expected.is_nan(),
            "{place}: {sum}"
        );
        let expected = number(&claim["leaf_abs_sum"]);
        assert!(
            (absolute - expected).abs() <= bound || absolute == expected,
            "{place}: {absolute}"
        );
        assert_eq!(nan, claim["leaf_nan"].as_u64().unwrap(), "{place}");
        assert_eq!(min, number(&claim["leaf_min"]), "{place}");
        assert_eq!(max, number(&claim["leaf_max"]), "{place}");
        let statistics = file.statistics(grid, parallel).unwrap();
        assert_eq!(
            statistics.active_voxels,
            tree.topology().active_voxels(),
            "{place}"
        );
        if tree.topology().tiles().all(|tile| !tile.active) {
            assert_eq!(statistics.not_a_number, nan, "{place}");
            assert_eq!(
                statistics.min.map_or(f64::INFINITY, |m| m[0]),
                min,
                "{place}"
            );
            assert_eq!(
                statistics.max.map_or(f64::NEG_INFINITY, |m| m[0]),
                max,
                "{place}"
            );
        }
    }
    checked.leaf_voxels += count;
    check_other_forms(file, grid, tree, parallel, place);
}

/// Halves kept as halves, and conversions to `f32`, hold the same values.
fn check_other_forms(
    file: &File,
    grid: &GridInfo,
    tree: &Tree,
    parallel: &dyn Parallel,
    place: &str,
) {
    let topology = tree.topology();
    let mut seen = vec![false; topology.leaves().len()];
    file.read_leaves_into(
        grid,
        topology,
        Halves::Keep,
        parallel,
        &mut seen,
        |index, values, seen| {
            assert!(!*seen, "leaf {index} decoded twice");
            *seen = true;
            let full = tree.leaf(index);
            let half = matches!(values, LeafValues::F16(_) | LeafValues::Vec3F16(_));
            let real = matches!(
                grid.value_type,
                Some(ValueType::Float | ValueType::Double | ValueType::Vec3s | ValueType::Vec3d)
            );
            assert_eq!(half, grid.saved_as_half && real, "{place}");
            let (mut scalars, mut vectors) = ([0.0; 512], [[0.0; 3]; 512]);
            let is_scalar = values.to_f32(&mut scalars);
            assert_ne!(is_scalar, values.to_vec3f(&mut vectors), "{place}");
            for offset in 0..512 {
                let full = full.get(offset);
                match (full.to_f32(), full.to_vec3f()) {
                    (Some(value), None) => {
                        assert_eq!(value.to_bits(), scalars[offset].to_bits(), "{place}")
                    }
                    (None, Some(value)) => assert_eq!(value, vectors[offset], "{place}"),
                    other => panic!("{other:?}"),
                }
            }
        },
    )
    .unwrap_or_else(|error| panic!("{error}"));
    assert!(seen.iter().all(|seen| *seen), "{place}: leaves left out");
}

fn check_tiles(tree: &Tree, claim: &Json, place: &str, checked: &mut Checked) {
    let tiles: Vec<Tile> = tree.topology().tiles().collect();
    assert_eq!(
        tiles.len() as u64,
        claim["tiles_listed_of"].as_u64().unwrap(),
        "{place}"
    );
    let active = tiles.iter().filter(|tile| tile.active).count();
    assert_eq!(
        active as u64,
        claim["active_tiles"].as_u64().unwrap(),
        "{place}"
    );
    for listed in claim["tiles"].as_array().unwrap() {
        let origin = [0, 1, 2].map(|i| listed["origin"][i].as_i64().unwrap() as i32);
        let tile = tiles.iter().find(|tile| tile.origin == origin);
        let tile = tile.unwrap_or_else(|| panic!("{place}: no tile at {origin:?}"));
        assert_eq!(
            u64::from(tile.dim),
            listed["dim"].as_u64().unwrap(),
            "{place}"
        );
        assert_eq!(tile.active, listed["active"].as_bool().unwrap(), "{place}");
        assert!(
            same(tile.value, &listed["value"]),
            "{place}: tile at {origin:?}"
        );
        checked.tiles += 1;
    }
}

fn check_transform(grid: &GridInfo, claim: &Json, place: &str) {
    let transform = grid.transform.as_ref().unwrap();
    let kind = claim["map_type"].as_str().unwrap();
    assert_eq!(transform.map_type, kind, "{place}");
    for row in 0..4 {
        for column in 0..4 {
            // Row vectors there, column vectors here.
            let expected = number(&claim["matrix_row_vector"][4 * column + row]);
            assert_eq!(
                transform.index_to_world[row][column], expected,
                "{place}: {row} {column}"
            );
        }
    }
    for pair in claim["index_to_world"].as_array().unwrap() {
        let index = [0, 1, 2].map(|i| number(&pair[0][i]));
        let expected = [0, 1, 2].map(|i| number(&pair[1][i]));
        let world = transform.to_world(index);
        let back = transform.to_index(world).unwrap();
        for i in 0..3 {
            let scale = expected.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            assert!(
                (world[i] - expected[i]).abs() <= 1e-14 * scale,
                "{place}: {world:?}"
            );
            // World positions far out have few digits left for the index.
            let digits = 1e-14 * scale
                / transform
                    .voxel_size()
                    .iter()
                    .copied()
                    .fold(f64::MAX, f64::min);
            assert!(
                (back[i] - index[i]).abs() <= 1e-10 + 4.0 * digits,
                "{place}: {back:?}"
            );
        }
    }
    for (size, expected) in transform
        .voxel_size()
        .iter()
        .zip(numbers(&claim["voxel_size"]))
    {
        assert!(
            (size - expected).abs() <= 1e-12 * expected,
            "{place}: {size}"
        );
    }
}

/// The sidecar has type and text as OpenVDB prints it (six digits), long strings cut.
fn check_metadata(value: Option<&MetaValue>, claim: &Json, place: &str) {
    let (kind, text) = (claim[0].as_str().unwrap(), claim[1].as_str().unwrap());
    let value = value.unwrap_or_else(|| panic!("{place}: no such metadata"));
    let floats = |got: &[f64]| {
        let expected: Vec<f64> = text
            .split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)))
            .filter(|part| !part.is_empty())
            .map(|part| part.parse().unwrap())
            .collect();
        assert_eq!(got.len(), expected.len(), "{place}: {text}");
        for (got, expected) in got.iter().zip(&expected) {
            assert!(
                (got - expected).abs() <= 1e-5 * expected.abs() + 1e-6,
                "{place}: {got} is not {expected}"
            );
        }
    };
    match (kind, value) {
        ("string", MetaValue::String(got)) => {
            if text.ends_with(" characters)") {
                let (start, length) = text.split_once("...(").unwrap();
                assert!(got.starts_with(start), "{place}");
                assert_eq!(got.len().to_string() + " characters)", length, "{place}");
            } else {
                assert_eq!(got, text, "{place}");
            }
        }
        ("bool", MetaValue::Bool(_))
        | ("int32", MetaValue::I32(_))
        | ("int64", MetaValue::I64(_)) => {
            assert_eq!(value.to_string(), text, "{place}");
        }
        ("float", MetaValue::F32(got)) => floats(&[f64::from(*got)]),
        ("double", MetaValue::F64(got)) => floats(&[*got]),
        (_, MetaValue::Ints(got)) => floats(&got.iter().map(|x| f64::from(*x)).collect::<Vec<_>>()),
        (_, MetaValue::Floats(got)) => {
            floats(&got.iter().map(|x| f64::from(*x)).collect::<Vec<_>>())
        }
        (_, MetaValue::Doubles(got)) => floats(got),
        (_, MetaValue::Opaque(_)) => assert_eq!(text, "<binary data>", "{place}"),
        other => panic!("{place}: {other:?}"),
    }
}

fn same(value: Value, claim: &Json) -> bool {
    let f32_same = |a: f32, b: &Json| {
        let b = number(b) as f32;
        a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
    };
    let f64_same = |a: f64, b: &Json| {
        let b = number(b);
        a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
    };
    match value {
        Value::F32(v) => f32_same(v, claim),
        Value::F64(v) => f64_same(v, claim),
        Value::I32(v) => claim.as_i64() == Some(i64::from(v)),
        Value::I64(v) => claim.as_i64() == Some(v),
        Value::Bool(v) => claim.as_bool() == Some(v),
        Value::Vec3F32(v) => (0..3).all(|i| f32_same(v[i], &claim[i])),
        Value::Vec3F64(v) => (0..3).all(|i| f64_same(v[i], &claim[i])),
        Value::Vec3I32(v) => (0..3).all(|i| claim[i].as_i64() == Some(i64::from(v[i]))),
    }
}

fn number(json: &Json) -> f64 {
    match json.as_str() {
        Some("nan") => f64::NAN,
        Some("inf") => f64::INFINITY,
        Some("-inf") => f64::NEG_INFINITY,
        _ => json
            .as_f64()
            .unwrap_or_else(|| panic!("{json} is no number")),
    }
}

fn numbers(json: &Json) -> Vec<f64> {
    json.as_array().map_or_else(
        || vec![number(json)],
        |list| list.iter().map(number).collect(),
    )
}

/// FNV-1a over coordinates and value, as the sidecars define it.
fn fnv(at: [i32; 3], value: Value) -> u64 {
    let mut bytes: Vec<u8> = at.iter().flat_map(|c| c.to_le_bytes()).collect();
    match value {
        Value::F32(v) => bytes.extend(v.to_le_bytes()),
        Value::F64(v) => bytes.extend(v.to_le_bytes()),
        Value::I32(v) => bytes.extend(v.to_le_bytes()),
        Value::I64(v) => bytes.extend(v.to_le_bytes()),
        Value::Bool(v) => bytes.push(v.into()),
        Value::Vec3F32(v) => v.iter().for_each(|c| bytes.extend(c.to_le_bytes())),
        Value::Vec3F64(v) => v.iter().for_each(|c| bytes.extend(c.to_le_bytes())),
        Value::Vec3I32(v) => v.iter().for_each(|c| bytes.extend(c.to_le_bytes())),
    }
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

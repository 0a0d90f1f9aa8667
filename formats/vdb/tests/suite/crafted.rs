//! Files made by hand for what the corpus leaves out: refusals, bombs, odd values.

use crate::hostile::{Outcome, read_everything};
use crate::memory;
use crate::writer::{Writer, coordinate, doubles, leaves, masks, root, text, zipped};
use resolvent_vdb::{Error, ErrorKind, File, GridClass, Halves, LeafValues, Serial, Tree, Value};

fn open(writer: &Writer) -> File {
    File::from_bytes("made.vdb", writer.file()).unwrap()
}

/// The error that opening or reading the only grid gives.
fn failure(writer: &Writer) -> Error {
    let file = match File::from_bytes("made.vdb", writer.file()) {
        Ok(file) => file,
        Err(error) => return error,
    };
    Tree::read(&file, &file.grids()[0], &Serial)
        .err()
        .expect("an error")
}

#[test]
fn an_empty_grid_is_read() {
    let file = open(&Writer::default());
    let grid = file.grid("density").unwrap();
    assert_eq!(grid.class, GridClass::FogVolume);
    let tree = Tree::read(&file, grid, &Serial).unwrap();
    assert_eq!(tree.topology().active_voxels(), 0);
    assert_eq!(tree.topology().active_bbox(), None);
    assert_eq!(
        tree.probe([i32::MIN, 0, i32::MAX]),
        (Value::F32(0.0), false)
    );
}

#[test]
fn other_versions_are_named() {
    for version in [0, 213, 220, 226, u32::MAX] {
        let error = failure(&Writer {
            version,
            ..Writer::default()
        });
        assert_eq!(error.kind, ErrorKind::Unsupported);
        assert!(
            error
                .to_string()
                .contains(&format!("file format {version} ")),
            "{error}"
        );
    }
    for version in [222, 223, 224, 225] {
        assert_eq!(
            open(&Writer {
                version,
                ..Writer::default()
            })
            .version(),
            version
        );
    }
}

#[test]
fn errors_name_file_grid_place_and_remedy() {
    let file = open(&Writer::default());
    let error = file.grid("heat").unwrap_err();
    assert_eq!(error.kind, ErrorKind::Missing);
    assert_eq!(
        error.to_string(),
        "made.vdb: missing grid 'heat'; the file has: density (float, fog volume)"
    );

    let unaligned = [root(&[0; 4], &[], 1), coordinate([0, 5, 0])].concat();
    let writer = Writer {
        body: unaligned,
        ..Writer::default()
    };
    let at = writer.file().len() - 12;
    let error = failure(&writer);
    assert_eq!(
        (error.kind, error.offset),
        (ErrorKind::Invalid, Some(at as u64))
    );
    let expected = format!(
        "made.vdb: grid 'density': root entry at [0, 5, 0], which is no multiple of 4096 (at byte {at})"
    );
    assert_eq!(error.to_string(), expected);

    let error = File::open("/no/such/file.vdb").unwrap_err();
    assert_eq!(error.kind, ErrorKind::Io);
    assert!(
        error.to_string().starts_with("/no/such/file.vdb: "),
        "{error}"
    );
    assert_eq!(
        File::open(env!("CARGO_MANIFEST_DIR")).unwrap_err().kind,
        ErrorKind::Io
    );
}

#[test]
fn root_entries_must_differ() {
    let one = 1.0_f32.to_le_bytes();
    let body = root(
        &[0; 4],
        &[([4096, 0, 0], &one, true), ([4096, 0, 0], &one, false)],
        0,
    );
    let error = failure(&Writer {
        body,
        ..Writer::default()
    });
    assert!(
        error.reason.contains("two root entries at [4096, 0, 0]"),
        "{error}"
    );
}

#[test]
fn root_tiles_reach_to_the_ends_of_index_space() {
    let (low, high) = (-1.5_f32, 2.5_f32);
    let ends = [[i32::MIN; 3], [i32::MAX - 4095; 3]];
    let body = root(
        &[0; 4],
        &[
            (ends[0], &low.to_le_bytes(), true),
            (ends[1], &high.to_le_bytes(), false),
        ],
        0,
    );
    let file = open(&Writer {
        body,
        ..Writer::default()
    });
    let tree = Tree::read(&file, &file.grids()[0], &Serial).unwrap();
    assert_eq!(tree.probe([i32::MIN; 3]), (Value::F32(low), true));
    assert_eq!(tree.probe([i32::MAX; 3]), (Value::F32(high), false));
    assert_eq!(tree.topology().active_voxels(), 4096_u64.pow(3));
    assert_eq!(
        tree.topology().active_bbox(),
        Some([[i32::MIN; 3], [i32::MIN + 4095; 3]])
    );
    // At the very end of index space there is no next voxel to interpolate with.
    assert_eq!(
        tree.sample([f64::from(i32::MAX); 3]),
        [f64::from(high), 0.0, 0.0]
    );
    let statistics = file.statistics(&file.grids()[0], &Serial).unwrap();
    assert_eq!(
        (statistics.min, statistics.max),
        (Some(vec![-1.5]), Some(vec![-1.5]))
    );
}

/// An inactive value that halves cannot hold is exact when widened, rounded when kept.
#[test]
fn inactive_values_of_halves_are_exact_when_widened() {
    let background = 0.15_f32.to_le_bytes();
    let mut values = vec![1_u8]; // inactive voxels are minus the background
    values.extend(half::f16::from_f32(0.5).to_le_bytes());
    let body = leaves(
        false,
        &background,
        &[(4095, [1, 0, 0, 0, 0, 0, 0, 0], values)],
    );
    let half = ("is_saved_as_half_float", "bool", vec![1]);
    let file = open(&Writer {
        body,
        metadata: vec![half],
        ..Writer::default()
    });
    let grid = &file.grids()[0];
    let tree = Tree::read(&file, grid, &Serial).unwrap();
    assert_eq!(tree.probe([120; 3]), (Value::F32(0.5), true));
    assert_eq!(tree.probe([121; 3]), (Value::F32(-0.15), false));
    file.read_leaves(grid, tree.topology(), Halves::Keep, &Serial, |_, values| {
        let LeafValues::F16(values) = values else {
            panic!("halves were asked for")
        };
        assert_eq!(values[0].to_f32(), 0.5);
        assert_eq!(values[73], half::f16::from_f32(-0.15));
    })
    .unwrap();
}

#[test]
fn a_leaf_must_have_the_mask_the_topology_says() {
    let one = [vec![0], 1.0_f32.to_le_bytes().to_vec()].concat();
    let mut body = leaves(false, &[0; 4], &[(0, [1, 0, 0, 0, 0, 0, 0, 0], one)]);
    let at = body.len() - 5 - 64;
    body[at] = 2; // another voxel
    let error = failure(&Writer {
        body,
        ..Writer::default()
    });
    assert!(error.reason.contains("another mask"), "{error}");
}

#[test]
fn frustums_and_unknown_maps_are_refused_by_name() {
    let mut frustum = doubles("NonlinearFrustumMap", &[1.0; 8]);
    frustum.extend(doubles("AffineMap", &[1.0; 16]));
    let unknown = text("WobblyMap");
    for (map, name) in [(&frustum, "NonlinearFrustumMap"), (&unknown, "WobblyMap")] {
        let error = failure(&Writer {
            map: map.clone(),
            ..Writer::default()
        });
        assert_eq!(error.kind, ErrorKind::Unsupported);
        assert!(error.reason.contains(name), "{error}");
    }
    for scale in [0.0, f64::NAN, f64::INFINITY] {
        let map = doubles("UniformScaleMap", &[scale; 15]);
        assert_eq!(
            failure(&Writer {
                map,
                ..Writer::default()
            })
            .kind,
            ErrorKind::Invalid
        );
    }
    // A UnitaryMap by name (OpenVDB renames it when it writes).
    let turn = [
        0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 4.0, 5.0, 6.0, 1.0,
    ];
    let file = open(&Writer {
        map: doubles("UnitaryMap", &turn),
        ..Writer::default()
    });
    let transform = file.grids()[0].transform.as_ref().unwrap();
    assert_eq!(
        transform.to_world([1.0, 2.0, 3.0]),
        [4.0 - 2.0, 5.0 + 1.0, 6.0 + 3.0]
    );
    assert_eq!(transform.to_index([2.0, 6.0, 9.0]), Some([1.0, 2.0, 3.0]));
}

/// In a stream, a frustum grid can be passed over, a tree of unknown type cannot; both are named.
#[test]
fn streams_go_on_behind_what_can_be_measured() {
    let frustum = [
        doubles("NonlinearFrustumMap", &[1.0; 8]),
        doubles("AffineMap", &[1.0; 16]),
    ]
    .concat();
    let one = [vec![0], 1.0_f32.to_le_bytes().to_vec()].concat();
    let body = leaves(false, &[0; 4], &[(7, [0, 0, 1, 0, 0, 0, 0, 0], one)]);
    let mut bytes = Writer::header(224, 4, false);
    Writer {
        name: "warped",
        map: frustum,
        body: body.clone(),
        ..Writer::default()
    }
    .grid(&mut bytes, "");
    Writer {
        name: "plain",
        body,
        ..Writer::default()
    }
    .grid(&mut bytes, "");
    Writer {
        name: "points",
        tree: "Tree_ptdataidx32_5_4_3",
        ..Writer::default()
    }
    .grid(&mut bytes, "");
    Writer {
        name: "behind",
        ..Writer::default()
    }
    .grid(&mut bytes, "");
    let file = File::from_bytes("stream.vdb", bytes).unwrap();
    let names: Vec<_> = file.grids().iter().map(|grid| grid.name.as_str()).collect();
    assert_eq!(names, ["warped", "plain", "points"]);
    let refused: Vec<_> = file
        .grids()
        .iter()
        .map(|grid| grid.refusal.is_some())
        .collect();
    assert_eq!(refused, [true, false, true]);
    let tree = Tree::read(&file, file.grid("plain").unwrap(), &Serial).unwrap();
    assert_eq!(tree.probe([2, 0, 56]), (Value::F32(1.0), true));
    let error = file.grid("behind").unwrap_err();
    assert!(
        error
            .reason
            .contains("grids behind 'points' cannot be found"),
        "{error}"
    );
}

#[test]
fn instances_share_a_tree_but_not_a_transform() {
    let mut bytes = Writer::header(224, 4, true);
    let body = root(&[0; 4], &[([0; 3], &3.0_f32.to_le_bytes(), true)], 0);
    Writer {
        name: "a\u{1e}0",
        body,
        ..Writer::default()
    }
    .grid(&mut bytes, "");
    Writer {
        name: "a\u{1e}1",
        map: doubles("TranslationMap", &[1.0; 3]),
        ..Writer::default()
    }
    .grid(&mut bytes, "a\u{1e}0");
    Writer {
        name: "lost",
        ..Writer::default()
    }
    .grid(&mut bytes, "nobody");
    Writer {
        name: "other",
        tree: "Tree_int32_5_4_3",
        ..Writer::default()
    }
    .grid(&mut bytes, "a\u{1e}0");
    let file = File::from_bytes("instances.vdb", bytes).unwrap();
    let names: Vec<_> = file
        .grids()
        .iter()
        .map(|grid| grid.unique_name.as_str())
        .collect();
    assert_eq!(names, ["a[0]", "a[1]", "lost", "other"]);
    let copy = file.grid("a[1]").unwrap();
    assert_eq!(copy.instance_of.as_deref(), Some("a[0]"));
    assert_eq!(
        copy.transform.as_ref().unwrap().to_world([0.0; 3]),
        [1.0; 3]
    );
    let tree = Tree::read(&file, copy, &Serial).unwrap();
    assert_eq!(tree.probe([9; 3]), (Value::F32(3.0), true));
    for (name, reason) in [
        ("lost", "'nobody', which the file does not have"),
        ("other", "which is a Tree_float_5_4_3"),
    ] {
        let refusal = file.grid(name).unwrap().refusal.clone().unwrap();
        assert!(refusal.reason.contains(reason), "{refusal}");
    }
}

/// Chunks that inflate far beyond what a node can hold.
#[test]
fn bombs_do_not_go_off() {
    let zeros = vec![0; 64 << 20];
    let bomb = zipped(&zeros);
    let mut body = root(&[0; 4], &[], 1);
    body.extend(coordinate([0; 3]));
    body.extend(masks(32768, &[], &[]));
    body.push(6);
    body.extend(&bomb);
    let writer = Writer {
        body,
        flags: 3,
        ..Writer::default()
    };
    let bytes = writer.file();
    drop(zeros);
    assert_eq!(read_everything(&bytes), Ok(Outcome::Refused));
    assert!(memory::peak() < 1 << 20, "{}", memory::peak());

    let body = leaves(
        true,
        &[0; 4],
        &[(0, [u64::MAX; 8], [vec![6], zipped(&[0; 1 << 20])].concat())],
    );
    let error = failure(&Writer {
        body,
        flags: 3,
        ..Writer::default()
    });
    assert!(error.reason.contains("zip"), "{error}");
}

/// The worst a node can do by the rules: 32,768 differing tiles, packed well. It must come out right
/// and stay within the allowance.
#[test]
fn dense_tiles_stay_within_the_allowance() {
    let values: Vec<u8> = (0..32768_u32)
        .flat_map(|i| [f64::from(i % 2), 7.0, 0.0].map(f64::to_le_bytes))
        .flatten()
        .collect();
    let mut body = root(&[0; 24], &[], 8);
    for n in 0..8 {
        body.extend(coordinate([4096 * n, 0, 0]));
        body.extend(masks(32768, &[], &[3]));
        body.push(6);
        body.extend(zipped(&values));
    }
    let writer = Writer {
        tree: "Tree_vec3d_5_4_3",
        body,
        flags: 3,
        ..Writer::default()
    };
    let bytes = writer.file();
    assert!(bytes.len() < 90_000, "{}", bytes.len());
    assert_eq!(read_everything(&bytes), Ok(Outcome::Read));
    let file = open(&writer);
    let tree = Tree::read(&file, &file.grids()[0], &Serial).unwrap();
    assert_eq!(tree.topology().tiles().count(), 8 * 32768);
    assert_eq!(
        tree.probe([4096 + 300, 129, 4000]),
        (Value::Vec3F64([1.0, 7.0, 0.0]), false)
    );
    assert_eq!(
        tree.probe([0, 0, 3 * 128]),
        (Value::Vec3F64([1.0, 7.0, 0.0]), true)
    );
    assert_eq!(tree.topology().active_voxels(), 8 * 128_u64.pow(3));
}

/// The most leaves a file can hold: nothing but masks and codes, each a leaf of 12 kB.
#[test]
fn empty_leaves_stay_within_the_allowance() {
    let all: Vec<_> = (0..4096).map(|slot| (slot, [0; 8], vec![0])).collect();
    let body = leaves(false, &[0; 24], &all);
    let half = ("is_saved_as_half_float", "bool", vec![1]);
    let writer = Writer {
        tree: "Tree_vec3d_5_4_3",
        body,
        metadata: vec![half],
        ..Writer::default()
    };
    assert_eq!(read_everything(&writer.file()), Ok(Outcome::Read));
    let mut cut = writer.file();
    cut.truncate(cut.len() - 1);
    assert_eq!(read_everything(&cut), Ok(Outcome::Refused));
}

/// What is wrong with an instance does not repeat all that its parent says.
#[test]
fn many_instances_of_a_parent_of_a_long_type() {
    let parent = Writer {
        name: "a",
        tree: "Tree_".repeat(40_000).leak(),
        ..Writer::default()
    };
    let mut bytes = Writer::header(224, 1001, true);
    parent.grid(&mut bytes, "");
    for _ in 0..1000 {
        Writer::default().grid(&mut bytes, "a");
    }
    assert_eq!(read_everything(&bytes), Ok(Outcome::Refused));
    let file = File::from_bytes("instances.vdb", bytes).unwrap();
    let refusal = file.grids()[1000].refusal.as_ref().unwrap().to_string();
    assert!(
        refusal.contains("the tree of 'a', which is a Tree_Tree_"),
        "{refusal}"
    );
}

#[test]
fn only_what_is_asked_for_is_read() {
    let path = format!("{}/tests/data/cloud_s.vdb", env!("CARGO_MANIFEST_DIR"));
    let file = File::open(&path).unwrap();
    assert!(file.bytes_read() < 20_000, "{}", file.bytes_read());

    let path = format!(
        "{}/tests/data/corpus/multi_fire.vdb",
        env!("CARGO_MANIFEST_DIR")
    );
    let file = File::open(&path).unwrap();
    let grid = file.grid("flame").unwrap();
    let before = file.bytes_read();
    Tree::read(&file, grid, &Serial).unwrap();
    let read = file.bytes_read() - before;
    // Reading ahead in the topology sees some of the leaves twice.
    assert!(
        read <= 2 * (grid.range[1] - grid.range[0]),
        "{read} of {:?}",
        grid.range
    );
}

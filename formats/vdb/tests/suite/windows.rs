//! Grids larger than the reader's windows: order, errors behind the first window, memory.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::writer::{Writer, leaves};
use crate::{memory, sidecar};
use resolvent_vdb::{ErrorKind, File, GridInfo, Halves, LeafValues, Parallel, Serial, Topology};

const LEAVES: usize = 4096;

/// 50 MB of `vec3d`: each value tells leaf, voxel and a constant.
fn file() -> Vec<u8> {
    let leaf = |slot: usize| {
        let values = (0..512).flat_map(|voxel| [slot as f64, f64::from(voxel), -1.0]);
        let mut bytes = vec![6];
        bytes.extend(values.flat_map(f64::to_le_bytes));
        (slot, [u64::MAX; 8], bytes)
    };
    let all: Vec<_> = (0..LEAVES).map(leaf).collect();
    let body = leaves(false, &[0; 24], &all);
    Writer {
        tree: "Tree_vec3d_5_4_3",
        body,
        ..Writer::default()
    }
    .file()
}

fn check(file: &File, grid: &GridInfo, topology: &Topology, parallel: &dyn Parallel) {
    let mut seen = vec![false; LEAVES];
    file.read_leaves_into(
        grid,
        topology,
        Halves::Widen,
        parallel,
        &mut seen,
        |index, values, seen| {
            let LeafValues::Vec3F64(values) = values else {
                panic!("vec3d")
            };
            assert!(!std::mem::replace(seen, true));
            for (voxel, value) in values.iter().enumerate() {
                assert_eq!(*value, [index as f64, voxel as f64, -1.0]);
            }
        },
    )
    .unwrap();
    assert!(seen.iter().all(|seen| *seen));
}

/// Runs the tasks last to first.
struct Backwards;

impl Parallel for Backwards {
    fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..count).rev().for_each(task);
    }
}

#[test]
fn windows_join_without_a_seam() {
    let file = File::from_bytes("large.vdb", file()).unwrap();
    let grid = &file.grids()[0];
    let topology = file.read_topology(grid).unwrap();
    assert_eq!(topology.leaves().len(), LEAVES);
    check(&file, grid, &topology, &Serial);
    check(&file, grid, &topology, &Backwards);
    check(&file, grid, &topology, &sidecar::Rayon::new());
}

#[test]
fn an_error_in_a_later_window_is_found_and_the_first_is_told() {
    let mut bytes = file();
    let record = 64 + 1 + 512 * 24;
    let at = |leaf: usize| bytes.len() - (LEAVES - leaf) * record;
    let (first, second) = (at(3000), at(3001));
    for (place, code) in [(first, 99), (second, 77)] {
        bytes[place + 64] = code;
    }
    let file = File::from_bytes("large.vdb", bytes).unwrap();
    let grid = &file.grids()[0];
    let topology = file.read_topology(grid).unwrap();
    let highest = Mutex::new(0);
    let error = file
        .read_leaves(
            grid,
            &topology,
            Halves::Widen,
            &sidecar::Rayon::new(),
            |index, _| {
                let mut highest = highest.lock().unwrap();
                *highest = index.max(*highest);
            },
        )
        .unwrap_err();
    assert!(error.reason.contains("unknown code 99"), "{error}");
    assert_eq!(error.offset, Some(first as u64 + 64));
    let highest = *highest.lock().unwrap();
    assert!((1000..3000).contains(&highest), "{highest}");
}

/// Stops after some tasks.
struct Quitter(AtomicUsize);

impl Parallel for Quitter {
    fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        for index in 0..count {
            if self.0.fetch_add(1, Ordering::Relaxed) == 20 {
                return;
            }
            task(index);
        }
    }
}

#[test]
fn tasks_left_undone_are_told() {
    let file = File::from_bytes("large.vdb", file()).unwrap();
    let grid = &file.grids()[0];
    let topology = file.read_topology(grid).unwrap();
    let quitter = Quitter(AtomicUsize::new(0));
    let error = file
        .read_leaves(grid, &topology, Halves::Widen, &quitter, |_, _| {})
        .unwrap_err();
    assert_eq!(error.kind, ErrorKind::Cancelled);
}

/// Decoding into one's own storage takes little more than that storage.
#[test]
fn decoding_takes_little_beside_the_result() {
    let path = std::env::temp_dir().join(format!("resolvent-vdb-{}.vdb", std::process::id()));
    std::fs::write(&path, file()).unwrap();
    memory::start();
    let file = File::open(&path).unwrap();
    let grid = &file.grids()[0];
    let topology = file.read_topology(grid).unwrap();
    let before = file.bytes_read();
    let mut bricks = vec![[[0.0; 3]; 512]; LEAVES];
    file.read_leaves_into(
        grid,
        &topology,
        Halves::Widen,
        &Serial,
        &mut bricks,
        |_, values, brick| {
            if let LeafValues::Vec3F64(values) = values {
                *brick = *values;
            }
        },
    )
    .unwrap();
    let (peak, result) = (memory::peak(), size_of_val(&bricks[..]));
    let read = file.bytes_read() - before;
    std::fs::remove_file(&path).unwrap();
    assert_eq!(bricks[LEAVES - 1][511], [4095.0, 511.0, -1.0]);
    assert!(peak > result, "the counter works");
    assert!(
        peak as f64 <= 1.3 * result as f64,
        "{peak} bytes held for {result}"
    );
    // Only the leaf cut by the end of each window is read twice.
    assert!(
        read < file.size() + file.size() / 50,
        "{read} of {}",
        file.size()
    );
}

//! vdb-rs as an independent witness: on float grids that it is known to read right, every active voxel and tile agrees.
//!
//! It is not used outside this test: of 155 valid files it reads 44 silently wrong, and it reads out of bounds on crafted ones.

use resolvent_vdb::{File, Serial, Tree, Value};
use std::io::BufReader;

use super::sidecar::data;

/// Compares all float grids of a file with the witness; returns how many active voxels it lists.
fn compare(name: &str) -> u64 {
    let path = data(name);
    let file = File::open(&path).unwrap();
    let mut total = 0;
    for grid in file.grids() {
        if grid.value_type.map(|t| t.name()) != Some("float") {
            continue;
        }
        let tree = Tree::read(&file, grid, &Serial).unwrap();
        let source = BufReader::new(std::fs::File::open(&path).unwrap());
        let mut witness = vdb_rs::VdbReader::new(source).unwrap();
        let mut listed = 0u64;
        let mut check = |p: [f32; 3], value: f32, scale: f32| {
            let ijk = p.map(|c| c as i32);
            let (ours, active) = tree.probe(ijk);
            assert!(active, "{name} {ijk:?}: the witness says active");
            assert_eq!(ours, Value::F32(value), "{name} {ijk:?}");
            listed += (scale as u64).pow(3);
        };
        if grid.saved_as_half {
            let read = witness.read_grid::<half::f16>(&grid.unique_name).unwrap();
            for (p, value, level) in read.iter() {
                check([p.x, p.y, p.z], value.to_f32(), level.scale());
            }
        } else {
            let read = witness.read_grid::<f32>(&grid.unique_name).unwrap();
            for (p, value, level) in read.iter() {
                check([p.x, p.y, p.z], value, level.scale());
            }
        }
        assert_eq!(
            listed,
            tree.topology().active_voxels(),
            "{name} {}",
            grid.name
        );
        total += listed;
    }
    total
}

#[test]
fn agrees_on_real_files() {
    for name in [
        "real/smoke.vdb",
        "real/sphere.vdb",
        "real/densityAndHeat.vdb",
        "real/smoke_000002.vdb",
    ] {
        assert!(compare(name) > 1000, "{name}");
    }
}

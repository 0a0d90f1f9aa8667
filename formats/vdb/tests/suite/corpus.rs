//! Every file of the corpus, against what the OpenVDB library reads in it.

use std::time::{Duration, Instant};

use crate::sidecar::{Checked, Rayon, check_file, data, json};
use resolvent_vdb::{Error, File, Parallel, Serial, Tree};

/// Reads all there is and returns the errors met.
fn read_all(bytes: &std::path::Path, parallel: &dyn Parallel) -> Vec<Error> {
    let file = match File::open(bytes) {
        Ok(file) => file,
        Err(error) => return vec![error],
    };
    let mut errors: Vec<Error> = file.damage().cloned().into_iter().collect();
    errors.extend(
        file.grids()
            .iter()
            .filter_map(|grid| Tree::read(&file, grid, parallel).err()),
    );
    errors
}

fn manifest(expect: &str) -> Vec<String> {
    let manifest = json(&data("corpus/manifest.json"));
    let entries = manifest.as_array().unwrap();
    let of_kind = entries.iter().filter(|entry| entry["expect"] == expect);
    of_kind
        .map(|entry| format!("corpus/{}", entry["file"].as_str().unwrap()))
        .collect()
}

#[test]
fn sound_files_hold_what_openvdb_reads() {
    let mut checked = Checked::default();
    let names = manifest("ok");
    assert_eq!(names.len(), 107);
    for name in &names {
        check_file(&data(name), &Rayon::new(), &mut checked);
    }
    // What the sidecars claim in all, counted apart: nothing above was skipped.
    assert_eq!((checked.grids, checked.refused), (124, 3), "{checked:?}");
    assert_eq!(
        (checked.samples, checked.interpolated),
        (3179, 2771),
        "{checked:?}"
    );
    assert_eq!(
        (checked.tiles, checked.metadata),
        (189, 1141),
        "{checked:?}"
    );
}

#[test]
fn files_of_other_programs_hold_what_openvdb_reads() {
    let mut checked = Checked::default();
    let names = [
        "sphere",
        "smoke",
        "densityAndHeat",
        "smoke_000001",
        "smoke_000002",
    ];
    for name in names {
        check_file(
            &data(&format!("real/{name}.vdb")),
            &Rayon::new(),
            &mut checked,
        );
    }
    check_file(&data("cloud_s.vdb"), &Serial, &mut checked);
    assert!(checked.leaf_voxels > 1_000_000, "{checked:?}");
}

#[test]
fn damaged_files_are_refused() {
    let names = manifest("error");
    assert!(names.len() > 30);
    for name in names {
        let start = Instant::now();
        let errors = read_all(&data(&name), &Serial);
        assert!(!errors.is_empty(), "{name} was read");
        for error in errors {
            assert!(
                error.to_string().contains(name.rsplit('/').next().unwrap()),
                "{error}"
            );
            assert!(!error.reason.is_empty());
        }
        assert!(
            start.elapsed() < Duration::from_secs(2),
            "{name} took {:?}",
            start.elapsed()
        );
    }
}

#[test]
fn one_bad_grid_does_not_hide_the_others() {
    for name in manifest("partial") {
        let file = File::open(data(&name)).unwrap();
        assert!(file.damage().is_none());
        let (good, bad): (Vec<_>, Vec<_>) =
            file.grids().iter().partition(|grid| grid.refusal.is_none());
        assert_eq!((good.len(), bad.len()), (1, 1), "{name}");
        assert_eq!(good[0].name, "density");
        let tree = Tree::read(&file, good[0], &Serial).unwrap();
        assert!(tree.topology().active_voxels() > 0);
        let error = file.read_topology(bad[0]).err().unwrap().to_string();
        assert!(
            error.contains(&bad[0].tree_type) && error.contains(&bad[0].name),
            "{error}"
        );
    }
    let mut checked = Checked::default();
    check_file(
        &data("corpus/points_then_density_null.vdb"),
        &Serial,
        &mut checked,
    );
    assert_eq!((checked.grids, checked.refused), (1, 1));
}

#[test]
fn undecided_files_end_well() {
    let names = manifest("any");
    assert!(names.len() > 30);
    for name in names {
        let start = Instant::now();
        read_all(&data(&name), &Rayon::new());
        assert!(
            start.elapsed() < Duration::from_secs(2),
            "{name} took {:?}",
            start.elapsed()
        );
    }
}

//! Against what OpenVDB's own sampler says.

use super::data;
use crate::channel::local_shift;
use crate::load::{Cover, Services, Values, load};
use crate::voxel::{Half, Voxel};
use resolvent_api::math::DVec3;
use resolvent_vdb::{File, GridClass, GridInfo, Serial};
use serde_json::Value;
use std::sync::atomic::{AtomicBool, Ordering};

fn point(v: &Value) -> Option<DVec3> {
    let c: Vec<f64> = v.as_array()?.iter().filter_map(Value::as_f64).collect();
    (c.len() == 3).then(|| DVec3::new(c[0], c[1], c[2]))
}

/// Compares a grid with its sidecar; the number of positions compared.
fn compare<V: Voxel<Value = f32>>(file: &File, info: &GridInfo, side: &Value, name: &str) -> usize {
    let identity = Values {
        scale: 1.0,
        offset: 0.0,
        limit: f32::MAX,
    };
    let changed = AtomicBool::new(false);
    let warn = |_: &str| changed.store(true, Ordering::Relaxed);
    let services = Services {
        parallel: &Serial,
        warn: &warn,
    };
    let Ok(loaded) = load::<V>(file, info, identity, true, Cover::default(), services) else {
        return 0; // damaged: the reader's own tests say which are
    };
    if changed.into_inner() {
        // Inactive voxels with negative values: 0 here on purpose, tested elsewhere.
        return 0;
    }
    let to_index = local_shift(&loaded.grid);
    let to_local = to_index.inverse().unwrap();
    let [lo, hi] = loaded.domain;
    let mut compared = 0;
    for sample in side["trilinear"].as_array().into_iter().flatten() {
        let (Some(at), Some(expected)) = (point(&sample["index"]), sample["value"].as_f64()) else {
            continue;
        };
        let inside = (0..3).all(|i| lo[i] as f64 <= at[i] && at[i] <= hi[i] as f64);
        // Far from the origin the index position was rounded when the sidecar was written.
        if !inside || at.abs().max_element() > 1e5 {
            continue;
        }
        let local = to_local.point(at).as_vec3();
        let got = f64::from(loaded.grid.sample(local.into()));
        let scale = sample["corner_scale"].as_f64().unwrap_or(1.0);
        // 1e-5 of the corners for the arithmetic, and as much for the rounding of the position.
        assert!(
            (got - expected).abs() <= 2e-5 * scale,
            "{name} at {at}: {got}, expected {expected}"
        );
        compared += 1;
    }
    for sample in side["samples"].as_array().into_iter().flatten() {
        let (Some(at), Some(expected)) = (point(&sample["ijk"]), sample["value"].as_f64()) else {
            continue;
        };
        if (0..3).any(|i| at[i] < lo[i] as f64 || at[i] > hi[i] as f64) {
            continue;
        }
        let voxel = [0, 1, 2].map(|i| (at[i] as i64 - loaded.grid.index.base[i]) as i32);
        assert_eq!(loaded.grid.voxel(voxel), expected as f32, "{name} at {at}");
        compared += 1;
    }
    compared
}

#[test]
fn values_are_those_of_openvdb() {
    let mut paths: Vec<_> = std::fs::read_dir(data("corpus"))
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    paths.extend(["cloud_s.vdb", "real/smoke.vdb", "real/densityAndHeat.vdb"].map(data));
    paths.sort();
    let (mut grids, mut positions, mut halves) = (0, 0, 0);
    for path in paths
        .iter()
        .filter(|p| p.extension().is_some_and(|e| e == "vdb"))
    {
        let Ok(text) = std::fs::read_to_string(path.with_extension("json")) else {
            continue;
        };
        let Ok(side) = serde_json::from_str::<Value>(&text) else {
            continue;
        };
        let Ok(file) = File::open(path) else { continue };
        for side in side["grids"].as_array().into_iter().flatten() {
            let Some(info) = side["unique_name"].as_str().and_then(|n| file.grid(n).ok()) else {
                continue;
            };
            let scalar = info.value_type.is_some_and(|t| t.components() == 1);
            let fog = info.class != GridClass::LevelSet && info.refusal.is_none();
            // What is negative or not finite becomes 0 here on purpose, and is tested elsewhere.
            let clean = side["leaf_min"].as_f64().is_some_and(|v| v >= 0.0)
                && side["leaf_max"].as_f64().is_some_and(f64::is_finite)
                && side["leaf_nan"].as_f64() == Some(0.0)
                && side["background"].as_f64().is_some_and(|v| v >= 0.0);
            if !(scalar && fog && clean) {
                continue;
            }
            let name = path.display().to_string();
            grids += 1;
            if info.saved_as_half {
                halves += 1;
                positions += compare::<Half>(&file, info, side, &name);
            } else {
                positions += compare::<f32>(&file, info, side, &name);
            }
        }
    }
    assert!(
        grids >= 60 && halves >= 5 && positions >= 2000,
        "{grids} grids, {halves} halves, {positions} positions"
    );
}

//! `--stats`: what a scene does not have costs nothing.

use crate::program::{Run, changed, folder, json, mean, picture, render, scene, vdb};
use serde_json::{Value, json};
use std::path::Path;

fn stats(at: &Path, input: &Path, options: &[&str]) -> Value {
    let all = [&["--stats", "s.json", "--resolution", "24x16"], options].concat();
    render(at, input, "out.exr", &all);
    json(&at.join("s.json"))
}

#[track_caller]
fn number(s: &Value, path: &str) -> f64 {
    let found = s.pointer(path).and_then(Value::as_f64);
    found.unwrap_or_else(|| panic!("no number {path} in {s:#}"))
}

fn kinds(s: &Value) -> Vec<&str> {
    let all = s["plugins"]
        .as_array()
        .map(Vec::as_slice)
        .unwrap_or_default();
    all.iter().filter_map(|p| p["kind"].as_str()).collect()
}

#[test]
fn without_media_nothing_is_tracked() {
    let at = folder("stats-surfaces");
    let s = stats(&at, &scene("bench/surface_only.json"), &["--spp", "32"]);
    assert!(
        kinds(&s).iter().all(|k| *k != "medium" && *k != "phase"),
        "{s:#}"
    );
    assert!(kinds(&s).contains(&"integrator") && kinds(&s).contains(&"bsdf"));
    assert_eq!(s["media"], json!([]));
    for count in ["flights", "transmittances", "depths", "lookups"] {
        assert_eq!(number(&s, &format!("/counts/{count}")), 0.0, "{count}");
    }
    assert_eq!(number(&s, "/geometry/bvhs"), 1.0);
    assert_eq!(number(&s, "/geometry/triangles"), 32.0);
    assert!(number(&s, "/counts/rays") >= 24.0 * 16.0 * 32.0);
    assert!(number(&s, "/counts/shadow_rays") > 0.0);
}

#[test]
fn without_surfaces_nothing_is_traced() {
    let at = folder("stats-volume");
    let s = stats(&at, &scene("bench/cloud_sun.json"), &["--spp", "32"]);
    for figure in [
        "/geometry/bvhs",
        "/geometry/nodes",
        "/geometry/memory_bytes",
        "/counts/rays",
        "/counts/shadow_rays",
        "/counts/majorant_violations",
    ] {
        assert_eq!(number(&s, figure), 0.0, "{figure}");
    }
    assert!(!kinds(&s).contains(&"bsdf"), "{s:#}");
    assert!(number(&s, "/counts/flights") > 0.0);
    assert!(number(&s, "/counts/lookups") > 0.0);
    assert!(number(&s, "/counts/collisions/real") > 0.0);
}

/// The grid that is not named is damaged beyond reading in a copy of the file: nobody notices.
#[test]
fn a_grid_that_is_not_named_is_not_read() {
    let at = folder("stats-grids");
    let file = vdb("real/densityAndHeat.vdb");
    let info = Run::new(&at, ["info", &file.to_string_lossy(), "--json"]);
    let info = info.done().json();
    let heat = &info["grids"][1];
    assert_eq!(heat["name"], "heat");
    let range = [0, 1].map(|i| heat["file_range"][i].as_u64().unwrap_or(0) as usize);
    let mut bytes = std::fs::read(&file).unwrap_or_else(|e| panic!("{e}"));
    // The second half of the grid is the values of its leaves.
    bytes[(range[0] + range[1]) / 2..range[1]].fill(0xff);
    let damaged = at.join("damaged.vdb");
    std::fs::write(&damaged, bytes).unwrap_or_else(|e| panic!("{e}"));

    let scene_of = |file: &Path, grids: Value| {
        changed(&at, "bench/cloud_sun.json", |s| {
            let mut params = json!({"file": file.to_string_lossy(), "sigma_t": 0.5});
            for (k, v) in grids.as_object().into_iter().flatten() {
                params[k] = v.clone();
            }
            s["media"] = json!({"smoke": {"plugin": "vdb", "params": params}});
            s["camera"]["origin"] = json!([0, 10, 60]);
            s["camera"]["target"] = json!([0, 10, 0]);
        })
    };
    let heat = json!({"temperature_grid": "heat"});
    let with = |file: &Path, grids: &Value| {
        let input = scene_of(file, grids.clone());
        stats(&at, &input, &["--spp", "32"])["media"][0].clone()
    };
    let one = with(&damaged, &json!({}));
    let two = with(&file, &heat);
    assert_eq!(
        (&one["grids_read"], &two["grids_read"]),
        (&json!(1), &json!(2))
    );
    assert_eq!(number(&one, "/voxels"), 6124.0);
    for figure in ["/memory_bytes", "/bytes_read"] {
        assert!(number(&two, figure) > number(&one, figure), "{figure}");
    }
    let input = scene_of(&damaged, heat);
    let refused = Run::new(&at, ["render", &input.to_string_lossy(), "-o", "x.exr"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("'heat'"), "{refused:?}");
}

/// The cloud stands in a box that reaches from (−9.1, 0.5, −11.2) to (0.4, 10.0, −2.0) and leaves its upper corners empty.
/// Rays through such a corner are inside of the medium's bounds, but look nothing up.
#[test]
fn empty_space_costs_no_lookups() {
    let at = folder("stats-empty");
    let through = |x: f64, y: f64| {
        let input = changed(&at, "bench/cloud_sun.json", |s| {
            s["camera"]["origin"] = json!([x, y, 10]);
            s["camera"]["target"] = json!([x, y, -10]);
            s["camera"]["fov_x_deg"] = json!(0.2);
        });
        let s = stats(&at, &input, &["--spp", "32"]);
        (number(&s, "/counts/flights"), number(&s, "/counts/lookups"))
    };
    let (flights, lookups) = through(0.2, 9.8);
    assert!(
        flights >= 24.0 * 16.0 * 32.0,
        "{flights} flights met the medium"
    );
    assert_eq!(lookups, 0.0);
    let (_, lookups) = through(-4.5, 3.0);
    assert!(lookups > 0.0, "the middle is not empty");
}

#[test]
fn figures_are_complete_and_plausible() {
    let at = folder("stats-all");
    let options = ["--spp", "32", "--threads", "2", "--seed", "3"];
    let s = stats(&at, &scene("fog-room/fog-room.json"), &options);
    assert_eq!(s["threads"], 2);
    assert_eq!(s["sampling"]["seed"], 3);
    assert_eq!(s["sampling"]["sample_range"], "0..32");
    assert_eq!(number(&s, "/sampling/samples"), 24.0 * 16.0 * 32.0);
    assert_eq!(s["image"]["resolution"], json!([24, 16]));
    assert_eq!(number(&s, "/geometry/quadrics"), 3.0);
    let names: Vec<_> = s["plugins"].as_array().into_iter().flatten().collect();
    for (kind, name) in [
        ("medium", "homogeneous"),
        ("phase", "hg"),
        ("bsdf", "diffuse"),
        ("integrator", "pt"),
    ] {
        let found = names
            .iter()
            .find(|p| p["kind"] == kind && p["name"] == name);
        let path = found.and_then(|p| p["path"].as_str()).unwrap_or_default();
        assert!(Path::new(path).is_file(), "{kind} {name}: {s:#}");
    }
    let parts: f64 = ["parse", "plugins", "media", "geometry", "render", "write"]
        .iter()
        .map(|p| number(&s, &format!("/seconds/{p}")))
        .sum();
    let total = number(&s, "/seconds/total");
    assert!(
        parts <= total * 1.001 + 1e-3 && parts > 0.5 * total,
        "{parts} of {total}"
    );
    if cfg!(target_os = "linux") {
        let peak = number(&s, "/peak_memory_bytes");
        assert!((1e6..1e9).contains(&peak), "{peak}");
    }
}

/// What is counted before a render, to refuse what memory cannot hold, is what it takes, with and without all that costs memory.
#[test]
#[cfg(target_os = "linux")]
fn memory_is_what_was_counted() {
    let at = folder("stats-memory");
    let cases: [&[&str]; 4] = [
        &["--integrator", "pt", "--aov", "error_95"],
        &[
            "--integrator",
            "pt",
            "--aov",
            "orders:2,depth,normal,variance",
            "--checkpoint",
            "a.ckpt",
        ],
        &["--integrator", "light", "--aov", "error_95"],
        &[
            "--integrator",
            "light",
            "--aov",
            "orders:2",
            "--checkpoint",
            "b.ckpt",
        ],
    ];
    for options in cases {
        let peak = |size: &str| {
            let _ = ["a.ckpt", "b.ckpt"].map(|f| std::fs::remove_file(at.join(f)));
            let fixed = ["--stats", "s.json", "--spp", "1", "--resolution", size];
            let all = [&fixed, options].concat();
            render(&at, &scene("caustic/caustic.json"), "a.exr", &all);
            let s = json(&at.join("s.json"));
            (
                number(&s, "/peak_memory_bytes"),
                number(&s, "/image/memory_bytes"),
            )
        };
        let ((small, _), (peak, counted)) = (peak("8x8"), peak("600x400"));
        let taken = peak - small;
        println!("{options:?}: {taken:e}, counted {counted:e}");
        assert!(
            (0.75..1.05).contains(&(taken / counted)),
            "{options:?}: {taken} {counted}"
        );
    }
}

/// A picture too faint for its error says so, and is none that meets a goal; one with exposure is as good as any.
#[test]
fn faint_pictures_tell() {
    let at = folder("stats-faint");
    let dim = |exposure: i32| {
        changed(&at, "bench/box_fog.json", |s| {
            for light in s["shapes"].as_array_mut().into_iter().flatten() {
                let emission = light.get_mut("emission").and_then(Value::as_array_mut);
                if let Some(all) = emission {
                    for v in all {
                        *v = (v.as_f64().unwrap_or(0.0) * 0.5f64.powi(50)).into();
                    }
                }
            }
            s["camera"]["exposure"] = exposure.into();
        })
    };
    let remedy = "raise the camera's exposure";
    let run = |scene: &Path, options: &[&str]| {
        let scene = scene.to_string_lossy();
        let fixed = ["render", &scene, "-q", "-o", "a.exr", "--stats", "s.json"];
        let size = ["--resolution", "12x8"];
        Run::new(&at, [&fixed[..], &size, options].concat())
    };
    let options = ["--spp", "64", "--aov", "orders:2,error_95,variance"];
    for (exposure, faint) in [(0, true), (50, false)] {
        let told = run(&dim(exposure), &options).done().stderr;
        let s = json(&at.join("s.json"));
        assert_eq!(told.matches(remedy).count(), usize::from(faint), "{told}");
        assert_eq!(s["sampling"]["estimated_error"].is_null(), faint);
        assert_eq!(s["sampling"]["mean"]["error_95"][0].is_null(), faint);
        let image = picture(&at.join("a.exr"));
        assert!(mean(&image) > 0.0);
        for layer in ["error_95", "variance"] {
            assert_eq!(image.layer(layer).is_none(), faint, "{layer}");
        }
        assert!(image.layer("order1").is_some());
    }
    for integrator in ["pt", "bdpt"] {
        let options = ["--error", "0.5", "--integrator", integrator];
        let refused = run(&dim(0), &options);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert_eq!(refused.stderr.matches(remedy).count(), 1, "{refused:?}");
        run(&dim(50), &options).done();
    }
}

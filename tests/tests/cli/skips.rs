//! What a scene does not have costs nothing: a table of absent features and the work that is not done for them, by the program's own
//! counters. With `RESOLVENT_REPORT=DIR` the table is added to `DIR/skips.md`.

use crate::program::{Run, changed, folder, json, scene};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

const OPTIONS: [&str; 6] = ["--stats", "s.json", "--resolution", "24x16", "--spp", "32"];
const SAMPLES: f64 = 24.0 * 16.0 * 32.0;

fn stats(at: &Path, input: &Path, more: &[&str]) -> Value {
    // Not quiet: a scene without lights is warned of.
    let args = ["render", &input.to_string_lossy(), "-o", "out.exr"];
    Run::new(at, [&args[..], &OPTIONS, more].concat()).done();
    json(&at.join("s.json"))
}

/// A figure by its path; `/plugins/KIND` counts the plugins of a kind that were loaded.
#[track_caller]
fn figure(s: &Value, path: &str) -> f64 {
    if let Some(kind) = path.strip_prefix("/plugins/") {
        let all = s["plugins"].as_array().into_iter().flatten();
        return all.filter(|p| p["kind"] == *kind).count() as f64;
    }
    let found = s.pointer(path).and_then(Value::as_f64);
    found.unwrap_or_else(|| panic!("no number {path} in {s:#}"))
}

/// One row: the scene without something, and with it as a check that the counters count at all.
struct Row {
    absent: &'static str,
    without: PathBuf,
    with: PathBuf,
    /// Figures that are 0 without it, and not 0 with it.
    zero: &'static [&'static str],
}

/// A floor, a medium, a sun: a bit of everything, to take away from.
fn still(at: &Path, name: &str, change: impl FnOnce(&mut Value)) -> PathBuf {
    let dir = at.join(name);
    std::fs::create_dir_all(&dir).unwrap_or_else(|e| panic!("{e}"));
    changed(&dir, "bench/smoke_area.json", |s| {
        s["lights"] = json!([{"type": "distant", "to_light": [0.3, 1, 0.2], "irradiance": 3}]);
        if let Some(shapes) = s["shapes"].as_array_mut() {
            shapes.truncate(1);
        }
        change(s);
    })
}

#[test]
fn what_is_absent_costs_nothing() {
    let at = folder("skips");
    let all = still(&at, "all", |_| {});
    let texture = at.join("grey.png");
    // One grey pixel.
    let png = {
        let mut image = resolvent_image::Image::new(1, 1);
        image.push(
            resolvent_image::BEAUTY,
            ["R", "G", "B"].map(|c| (c, vec![0.5f32])),
        );
        image
    };
    png.write_png(&texture, &resolvent_image::ToneMap::default())
        .unwrap_or_else(|e| panic!("{e}"));
    let textured = |name: &str, file: &Path, used: bool| {
        still(&at, name, |s| {
            s["textures"] = json!({"grey": {"file": file.to_string_lossy()}});
            if used {
                s["materials"]["floor"]["params"]["reflectance"] = json!({"texture": "grey"});
            }
        })
    };
    let away = still(&at, "away", |s| {
        s["camera"]["target"] = json!([82.0, 3000.0, 400.0]);
        s["shapes"] = json!([]);
    });
    let lonely = still(&at, "lonely", |s| s["shapes"] = json!([]));
    let rows = [
        Row {
            absent: "media",
            without: still(&at, "no-media", |s| s["media"] = json!({})),
            with: all.clone(),
            zero: &[
                "/plugins/medium",
                "/plugins/phase",
                "/counts/flights",
                "/counts/transmittances",
                "/counts/lookups",
                "/counts/collisions/real",
            ],
        },
        Row {
            absent: "surfaces",
            without: lonely.clone(),
            with: all.clone(),
            zero: &[
                "/plugins/bsdf",
                "/geometry/bvhs",
                "/geometry/nodes",
                "/geometry/memory_bytes",
                "/counts/rays",
                "/counts/shadow_rays",
            ],
        },
        Row {
            absent: "lights",
            without: still(&at, "dark", |s| s["lights"] = json!([])),
            with: all.clone(),
            zero: &["/lights", "/counts/shadow_rays", "/counts/transmittances"],
        },
        Row {
            absent: "textures (one is named, but nothing uses it; its file is not even there)",
            without: textured("unused", &at.join("none.png"), false),
            with: textured("used", &texture, true),
            zero: &["/textures/read", "/textures/bytes_read"],
        },
        Row {
            absent: "a medium in sight (rays pass beside its bounds)",
            without: away,
            with: lonely,
            zero: &["/counts/flights", "/counts/lookups"],
        },
    ];
    for row in rows {
        let (without, with) = (stats(&at, &row.without, &[]), stats(&at, &row.with, &[]));
        for path in row.zero {
            let (a, b) = (figure(&without, path), figure(&with, path));
            assert_eq!(a, 0.0, "without {}: {path}", row.absent);
            assert!(b > 0.0, "with {}: {path} counts nothing", row.absent);
        }
        let names: Vec<_> = row.zero.iter().map(|z| z[1..].replace('/', " ")).collect();
        report(row.absent, &format!("0: {}", names.join(", ")));
    }

    // Grids that are not named.
    let heat = |grid: bool| {
        let name = if grid { "hot" } else { "cold" };
        still(&at, name, |s| {
            let file = crate::program::vdb("real/densityAndHeat.vdb");
            let p = &mut s["media"]["smoke"]["params"];
            p["file"] = json!(file.to_string_lossy());
            if grid {
                p["temperature_grid"] = json!("heat");
            }
        })
    };
    let (one, two) = (stats(&at, &heat(false), &[]), stats(&at, &heat(true), &[]));
    for path in [
        "/media/0/grids_read",
        "/media/0/bytes_read",
        "/media/0/memory_bytes",
    ] {
        assert!(figure(&one, path) < figure(&two, path), "{path}");
    }
    report(
        "a temperature grid (the file has one)",
        "its bytes are not read, no bricks are made of it, flights look nothing up in it",
    );

    // A crop traces the rays of its window alone.
    let whole = stats(&at, &scene("bench/surface_only.json"), &[]);
    let crop = stats(
        &at,
        &scene("bench/surface_only.json"),
        &["--crop", "4,4,12,8"],
    );
    assert_eq!(figure(&whole, "/sampling/samples"), SAMPLES);
    assert_eq!(figure(&crop, "/sampling/samples"), 8.0 * 4.0 * 32.0);
    assert!(figure(&crop, "/counts/rays") < figure(&whole, "/counts/rays") / 6.0);
    report(
        "most of the picture (`--crop`)",
        "samples, rays and film memory of the window only; a volume is read whole, since light that scatters comes from all of it",
    );
}

/// Small scenes are ready in 50 ms: everything but sampling and writing, in CPU time, which a busy machine does not stretch.
#[test]
fn small_scenes_start_at_once() {
    let at = folder("start-up");
    for name in [
        "bench/surface_only.json",
        "bench/cloud_sun.json",
        "bench/fire.json",
        "bench/milk.json",
        "fog-room/fog-room.json",
    ] {
        // The best of three: caches may be cold.
        let best = (0..3)
            .map(|_| {
                let s = stats(&at, &scene(name), &["--threads", "1"]);
                figure(&s, "/cpu_seconds/total") - figure(&s, "/cpu_seconds/render")
            })
            .fold(f64::INFINITY, f64::min);
        let limit = if cfg!(debug_assertions) { 1.0 } else { 0.05 };
        assert!(best <= limit, "{name}: {:.1} ms", 1e3 * best);
        report(
            &format!("start-up of `{name}`"),
            &format!(
                "{:.1} ms of CPU time from start to end, sampling aside",
                1e3 * best
            ),
        );
    }
}

fn report(absent: &str, work: &str) {
    let Some(dir) = std::env::var_os("RESOLVENT_REPORT") else {
        return;
    };
    let path = Path::new(&dir).join("skips.md");
    let added = std::fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(&path)
        .and_then(|mut f| f.write_all(format!("| {absent} | {work} |\n").as_bytes()));
    if let Err(e) = added {
        panic!("{}: {e}", path.display());
    }
}

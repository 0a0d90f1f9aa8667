//! `info`, `compare`, `plugin` and `schema`.

use crate::program::{Run, changed, folder, json, path, render, scene, vdb};
use serde_json::{Value, json};

#[test]
fn info_of_a_volume_agrees_with_the_real_library() {
    let at = folder("info-vdb");
    for name in [
        "cloud_s",
        "real/densityAndHeat",
        "real/smoke",
        "real/sphere",
    ] {
        let path = vdb(&format!("{name}.vdb"));
        let path = path.to_string_lossy();
        let info = Run::new(&at, ["info", &path, "--json"]).done().json();
        // The sidecar is what OpenVDB itself reads in the file.
        let truth = json(&vdb(&format!("{name}.json")));
        let grids = info["grids"]
            .as_array()
            .map(Vec::as_slice)
            .unwrap_or_default();
        let expected = truth["grids"]
            .as_array()
            .map(Vec::as_slice)
            .unwrap_or_default();
        assert_eq!(grids.len(), expected.len());
        for (g, e) in grids.iter().zip(expected) {
            assert_eq!(g["name"], e["name"]);
            assert_eq!(g["type"], e["value_type"]);
            assert_eq!(g["class"], e["class"]);
            assert_eq!(g["active_voxels"], e["active_voxels"]);
            assert_eq!(g["bounds_index"], e["active_bbox"]);
            assert_eq!(g["saved_as_half"], e["saved_as_half"]);
            assert_eq!(g["transform"]["type"], e["transform"]["map_type"]);
        }
        let text = Run::new(&at, ["info", &path]).done().stdout;
        assert!(
            text.contains("active voxels") && text.contains("bounds in world"),
            "{text}"
        );
    }
}

/// Refused grids are listed with the reason, beside the others.
#[test]
fn info_tells_what_cannot_be_read() {
    let at = folder("info-refused");
    let path = vdb("corpus/pointindex_and_density.vdb");
    assert!(path.is_file());
    let path = path.to_string_lossy();
    let info = Run::new(&at, ["info", &path, "--json"]).done().json();
    let grids = info["grids"]
        .as_array()
        .map(Vec::as_slice)
        .unwrap_or_default();
    let refused: Vec<_> = grids.iter().filter(|g| g["refused"].is_string()).collect();
    assert_eq!(refused.len(), 1, "{info:#}");
    assert!(
        grids.iter().any(|g| g["active_voxels"].as_u64() > Some(0)),
        "{info:#}"
    );
}

#[test]
fn info_of_a_scene() {
    let at = folder("info-scene");
    let path = scene("overlap/overlap.json");
    let path = path.to_string_lossy();
    let info = Run::new(&at, ["info", &path, "--json"]).done().json();
    assert_eq!(info["kind"], "scene");
    assert_eq!(info["lights"], json!(["distant", "constant environment"]));
    assert_eq!(info["media"].as_array().map(Vec::len), Some(3));
    let named = |kind: &str, name: &str| {
        let all = info["plugins"].as_array().into_iter().flatten();
        all.filter(|p| p["kind"] == kind && p["name"] == name && p["path"].is_string())
            .count()
    };
    for (kind, name) in [
        ("integrator", "pt"),
        ("medium", "procedural"),
        ("medium", "homogeneous"),
        ("phase", "two-lobe-hg"),
        ("phase", "hg"),
        ("phase", "isotropic"),
        ("bsdf", "diffuse"),
    ] {
        assert_eq!(named(kind, name), 1, "{kind} {name}: {info:#}");
    }
    let info = Run::new(
        &at,
        [
            "info",
            &scene("cloud/cloud.json").to_string_lossy(),
            "--json",
        ],
    );
    let info = info.done().json();
    assert_eq!(info["files"][0]["bytes"], 1_475_137, "{info:#}");
    assert!(
        Run::new(&at, ["info", &path])
            .done()
            .stdout
            .contains("two-lobe-hg")
    );
}

#[test]
fn info_of_a_picture() {
    let at = folder("info-exr");
    let options = [
        "--resolution",
        "20x10",
        "--crop",
        "4,2,12,9",
        "--spp",
        "32",
        "--aov",
        "depth",
    ];
    render(&at, &scene("bench/surface_only.json"), "out.exr", &options);
    let info = Run::new(&at, ["info", "out.exr", "--json"]).done().json();
    assert_eq!(info["size"], json!([8, 7]));
    assert_eq!(info["origin"], json!([4, 2]));
    assert_eq!(info["full_size"], json!([20, 10]));
    let layers: Vec<_> = info["layers"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|l| &l["name"])
        .collect();
    assert_eq!(layers.len(), 3, "{layers:?}");
    assert_eq!(info["metadata"]["samples"], "32");
    let text = Run::new(&at, ["info", "out.exr"]).done().stdout;
    assert!(
        text.contains("8 x 7 pixels, a part of 20 x 10 from (4, 2)"),
        "{text}"
    );
}

#[test]
fn comparing() {
    let at = folder("compare");
    let shot = |name: &str, seed: &str, light: f64| {
        let input = changed(&at, "bench/surface_only.json", |s| {
            let shapes = s["shapes"].as_array_mut();
            for shape in shapes.into_iter().flatten() {
                if shape.get("emission").is_some() {
                    shape["emission"] = json!([18.0 * light, 15.0 * light, 9.0 * light]);
                }
            }
        });
        render(
            &at,
            &input,
            name,
            &["--resolution", "48x48", "--spp", "64", "--seed", seed],
        );
    };
    shot("a.exr", "1", 1.0);
    shot("b.exr", "2", 1.0);
    shot("c.exr", "3", 1.2);
    let compare =
        |image: &str, more: &[&str]| Run::new(&at, [&["compare", image, "a.exr"], more].concat());

    let same = compare("a.exr", &["--json", "--fail"]).done().json();
    assert_eq!((&same["mse"], &same["rel_mse"]), (&json!(0.0), &json!(0.0)));
    assert_eq!(same["mean_ratio"], json!([1.0, 1.0, 1.0]));
    assert_eq!(same["z_test"]["passed"], true);

    let noise = compare("b.exr", &["--json", "--fail"]).done().json();
    assert!(noise["mse"].as_f64() > Some(0.0));
    assert_eq!(noise["z_test"]["passed"], true, "{noise:#}");
    assert!(compare("b.exr", &[]).done().stdout.contains("PASS"));

    let other = compare("c.exr", &["--json"]).done().json();
    assert_eq!(other["z_test"]["passed"], false, "{other:#}");
    let ratio = other["mean_ratio"][0].as_f64().unwrap_or(0.0);
    assert!((ratio - 1.2).abs() < 0.05, "{ratio}");
    let failed = compare("c.exr", &["--fail"]);
    assert_eq!(failed.code, Some(1), "{failed:?}");
    assert!(
        failed.stdout.contains("FAIL") && failed.stdout.contains("worst"),
        "{failed:?}"
    );

    // Without variance there is no test, and --fail cannot be answered.
    let plain = changed(&at, "bench/surface_only.json", |s| {
        s["film"]["aovs"] = json!([])
    });
    let image = ["--resolution", "8x8", "--spp", "1"];
    render(&at, &plain, "d.exr", &image);
    let none = Run::new(&at, ["compare", "d.exr", "d.exr", "--json"])
        .done()
        .json();
    assert_eq!(none["z_test"], Value::Null);
    assert_eq!(
        Run::new(&at, ["compare", "d.exr", "d.exr", "--fail"]).code,
        Some(2)
    );
    assert_eq!(
        Run::new(&at, ["compare", "d.exr", "a.exr"]).code,
        Some(2),
        "sizes differ"
    );
}

#[test]
fn plugins_are_listed_and_described() {
    let at = folder("plugins");
    let list = Run::new(&at, ["plugin", "list", "--json"]).done().json();
    let all = list["plugins"]
        .as_array()
        .map(Vec::as_slice)
        .unwrap_or_default();
    for (kind, name) in [
        ("medium", "vdb"),
        ("medium", "homogeneous"),
        ("medium", "procedural"),
        ("phase", "isotropic"),
        ("phase", "hg"),
        ("phase", "two-lobe-hg"),
        ("phase", "rayleigh"),
        ("phase", "mie-approx"),
        ("phase", "tabulated"),
        ("bsdf", "diffuse"),
        ("bsdf", "null"),
        ("integrator", "pt"),
    ] {
        let found = all.iter().find(|p| p["kind"] == kind && p["name"] == name);
        let summary = found
            .and_then(|p| p["summary"].as_str())
            .unwrap_or_default();
        assert!(!summary.is_empty(), "{kind} {name}: {list:#}");
    }
    let hg = Run::new(&at, ["plugin", "info", "hg", "--json"])
        .done()
        .json();
    let g = &hg["parameters"][0];
    assert_eq!(g["name"], "g");
    assert_eq!((&g["min"], &g["max"]), (&json!(-1.0), &json!(1.0)));
    assert_eq!(g["min_excluded"], true);
    let text = Run::new(&at, ["plugin", "info", "vdb"]).done().stdout;
    for word in [
        "sigma_t",
        "unit 1/length",
        "required",
        "trilinear | nearest",
        "default",
    ] {
        assert!(text.contains(word), "{word}: {text}");
    }
    // The same by the path of the library.
    let path = hg["path"].as_str().unwrap_or_default();
    let by_path = Run::new(&at, ["plugin", "info", path, "--json"])
        .done()
        .json();
    assert_eq!(by_path["parameters"], hg["parameters"]);
}

#[test]
fn the_schema_holds_the_plugins() {
    let at = folder("schema");
    let schema = Run::new(&at, ["schema"]).done().json();
    let defs = schema["$defs"].as_object().map(|d| d.len()).unwrap_or(0);
    assert!(defs >= 9, "{defs}");
    let vdb = &schema["$defs"]["params.medium.vdb"];
    assert!(vdb["properties"]["sigma_t"].is_object(), "{vdb:#}");
}

#[test]
fn help_has_examples() {
    let at = folder("help");
    for args in [
        &["--help"][..],
        &["render", "--help"],
        &["info", "--help"],
        &["compare", "--help"],
        &["plugin", "--help"],
    ] {
        let text = Run::new(&at, args).done().stdout;
        assert!(text.contains("Examples:\n  resolvent "), "{args:?}: {text}");
    }
    assert!(
        Run::new(&at, ["--version"])
            .done()
            .stdout
            .starts_with("resolvent ")
    );
}

/// Of two plugins of one name the first is used, and which is not is said.
#[test]
fn two_plugins_of_one_name() {
    let at = folder("two_of_a_name");
    let file = format!("libresolvent_phase_hg{}", std::env::consts::DLL_SUFFIX);
    let beside = path().with_file_name(&file);
    std::fs::copy(&beside, at.join(&file)).unwrap_or_else(|e| panic!("{e}"));
    let scene = scene("cloud/cloud.json").display().to_string();
    let render = [
        "render",
        &scene,
        "--resolution",
        "8x8",
        "--spp",
        "1",
        "-o",
        "out.png",
    ];
    let said = Run::new(&at, [&render[..], &["--plugin-path", "."]].concat()).done();
    let words = [
        "there are two of the phase plugin 'hg' (./libresolvent_phase_hg",
        &format!("{} is not used", beside.display()),
    ];
    assert!(words.iter().all(|w| said.stderr.contains(w)), "{said:?}");
    let alone = Run::new(&at, render).done();
    assert!(!alone.stderr.contains("there are two"), "{alone:?}");
}

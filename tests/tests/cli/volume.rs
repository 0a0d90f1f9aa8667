//! `resolvent render FILE.vdb`: guesses, the options that replace them, and the scene they make.

use crate::program::{Run, bits, folder, json, mean, render, scene, vdb};
use resolvent_image::BEAUTY;
use serde_json::{Value, json};
use std::path::Path;

const TINY: [&str; 4] = ["--spp", "32", "--resolution", "32x32"];

#[test]
fn a_bare_volume_is_in_the_picture() {
    let at = folder("bare");
    for file in [
        scene("cloud/cloud_s.vdb"),
        vdb("real/smoke.vdb"),
        vdb("real/densityAndHeat.vdb"),
        vdb("corpus/xform_affine_rotscale.vdb"),
    ] {
        let image = render(&at, &file, "out.exr", &TINY);
        let alpha = image.channel(BEAUTY, "A").unwrap_or_default();
        let at = |x: usize, y: usize| alpha[y * 32 + x];
        // All of it is in the picture, none of it is at the border, and it takes a good part.
        let border: f32 = (0..32)
            .map(|i| at(i, 0) + at(i, 31) + at(0, i) + at(31, i))
            .sum();
        assert!(border < 6.0, "{}: {border}", file.display());
        let covered = alpha.iter().filter(|a| **a > 0.5).count();
        assert!(covered > 60, "{}: {covered} of 1024", file.display());
        assert!(mean(&image) > 0.05);
    }
}

/// Every line of guesses names an option; giving it makes the line go away.
#[test]
fn every_guess_can_be_replaced() {
    let at = folder("guesses");
    let file = vdb("real/densityAndHeat.vdb");
    let file = file.to_string_lossy();
    let lines = |options: &[&str]| -> Vec<String> {
        let fixed = [
            "render",
            &file,
            "-o",
            "out.exr",
            "--resolution",
            "8x8",
            "--seed",
            "1",
        ];
        let args = [&fixed[..], options].concat();
        let run = Run::new(&at, args).done();
        let all = run.stderr.lines().filter(|l| l.starts_with("  --"));
        all.map(|l| l.split_whitespace().next().unwrap_or_default().to_owned())
            .collect()
    };
    let replacements = [
        ("--grid", "density"),
        ("--temperature-grid", "heat"),
        ("--density-scale", "0.7"),
        ("--albedo", "0.5,0.6,0.7"),
        ("--g", "-0.2"),
        ("--up", "z"),
        ("--camera", "0,-60,10,0,0,10"),
        ("--fov", "35"),
        ("--sun", "-1,0,2"),
        ("--sun-irradiance", "2"),
        ("--sky", "none"),
        ("--spp", "1"),
    ];
    let mut guessed = lines(&[]);
    let mut expected: Vec<_> = replacements.iter().map(|(o, _)| (*o).to_owned()).collect();
    guessed.sort();
    expected.sort();
    assert_eq!(guessed, expected);
    let options: Vec<&str> = replacements.iter().flat_map(|(o, v)| [*o, *v]).collect();
    let left = lines(&options);
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn replacements_reach_the_scene() {
    let at = folder("replaced");
    let file = vdb("real/densityAndHeat.vdb");
    let options = [
        "--density-scale",
        "0.7",
        "--albedo",
        "0.5,0.6,0.7",
        "--g",
        "-0.2",
        "--up",
        "z",
        "--camera",
        "0,-60,10,0,0,10",
        "--fov",
        "35",
        "--sun",
        "-1,0,2",
        "--sky",
        "none",
        "--sun-irradiance",
        "2",
        "--temperature-grid",
        "none",
        "--save-scene",
        "s.json",
        "--spp",
        "1",
        "--resolution",
        "8x6",
    ];
    render(&at, &file, "out.exr", &options);
    let s = json(&at.join("s.json"));
    let params = &s["media"]["volume"]["params"];
    assert_eq!(params["sigma_t"], json!(0.7));
    assert_eq!(params["albedo"], json!([0.5, 0.6, 0.7]));
    assert_eq!(params["phase"]["params"]["g"], json!(-0.2));
    assert_eq!(params.get("temperature_grid"), None);
    assert_eq!(s["camera"]["origin"], json!([0.0, -60.0, 10.0]));
    assert_eq!(s["camera"]["up"], json!([0.0, 0.0, 1.0]));
    assert_eq!(s["camera"]["fov_x_deg"], json!(35.0));
    assert_eq!(s["lights"].as_array().map(Vec::len), Some(1));
    assert_eq!(s["lights"][0]["irradiance"], json!(2.0));
    assert_eq!(s["film"]["resolution"], json!([8, 6]));
}

/// The scene that is saved renders the same bits, wherever it stands.
#[test]
fn the_saved_scene_is_the_one_rendered() {
    let at = folder("saved");
    std::fs::create_dir_all(at.join("elsewhere/deep")).unwrap_or_else(|e| panic!("{e}"));
    for file in [scene("cloud/cloud_s.vdb"), vdb("real/densityAndHeat.vdb")] {
        // A relative path, which must be rewritten for the scene's folder.
        let copy = at.join("copy.vdb");
        std::fs::copy(&file, &copy).unwrap_or_else(|e| panic!("{e}"));
        let options = [
            "--save-scene",
            "elsewhere/deep/s.json",
            "--aov",
            "depth,variance",
        ];
        let first = render(
            &at,
            Path::new("copy.vdb"),
            "a.exr",
            &[&options[..], &TINY].concat(),
        );
        let saved = at.join("elsewhere/deep/s.json");
        let second = render(&at.join("elsewhere"), &saved, "b.exr", &[]);
        assert_eq!(bits(&first), bits(&second), "{}", file.display());
    }
}

/// The density scale follows its stated rule: the mean optical thickness of the three lines that `info` measures.
#[test]
fn the_density_scale_follows_its_rule() {
    let at = folder("density-scale");
    let file = scene("cloud/cloud_s.vdb");
    let path = file.to_string_lossy();
    let info = Run::new(&at, ["info", &path, "--json"]).done().json();
    let lines = &info["grids"][0]["optical_thickness"];
    let mean = ["x", "y", "z"]
        .iter()
        .filter_map(|a| lines[a].as_f64())
        .sum::<f64>()
        / 3.0;
    assert!(mean > 0.1, "{info:#}");
    let scale = |options: &[&str]| {
        let all = [
            &[
                "--save-scene",
                "s.json",
                "--spp",
                "1",
                "--resolution",
                "4x4",
            ],
            options,
        ]
        .concat();
        render(&at, &file, "out.exr", &all);
        let s = json(&at.join("s.json"));
        s["media"]["volume"]["params"]["sigma_t"]
            .as_f64()
            .unwrap_or(0.0)
    };
    assert!((scale(&[]) * mean / 40.0 - 1.0).abs() < 1e-9);
    assert!((scale(&["--optical-thickness", "7"]) * mean / 7.0 - 1.0).abs() < 1e-9);
}

/// What glows is found by name, and shines without sun and sky.
#[test]
fn heat_glows() {
    let at = folder("heat");
    let file = vdb("real/densityAndHeat.vdb");
    let dark = ["--sun", "none", "--sky", "none"];
    let image = render(&at, &file, "hot.exr", &[&dark[..], &TINY].concat());
    let rgb = image.color().unwrap_or_else(|| panic!("no colour"));
    let sum = |c: &[f32]| c.iter().map(|v| f64::from(*v)).sum::<f64>();
    let [r, g, b] = rgb.map(sum);
    assert!(r > g && g > b && r > 1.0, "{r} {g} {b}");
    // Brighter by what is asked for, with the same random numbers.
    let brighter = [&dark[..], &TINY, &["--emission-scale", "4"]].concat();
    let image = render(&at, &file, "hotter.exr", &brighter);
    let hotter = sum(image.color().unwrap_or_else(|| panic!("no colour"))[0]);
    assert!((hotter / r - 4.0).abs() < 1e-3, "{hotter} {r}");
}

#[test]
fn quiet_runs_guess_silently_and_info_measures_levels() {
    let at = folder("quiet");
    let file = vdb("real/sphere.vdb");
    let path = file.to_string_lossy();
    let info: Value = Run::new(&at, ["info", &path, "--json"]).done().json();
    let grid = &info["grids"][0];
    assert_eq!(grid["class"], "level set");
    assert_eq!(
        grid.get("optical_thickness"),
        None,
        "distances are no densities"
    );
    assert_eq!(grid["active_voxels"], 270_638);
}

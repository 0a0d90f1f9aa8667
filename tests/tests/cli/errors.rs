//! One clear sentence and the right exit code.

use crate::program::{Run, changed, folder, scene, vdb};
use serde_json::json;
use std::path::Path;

/// Exit code 2, one line with these words, and no picture.
#[track_caller]
fn fails(at: &Path, args: &[&str], words: &[&str]) {
    let run = Run::new(at, args);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert_eq!(run.stderr.lines().count(), 1, "{run:?}");
    assert!(run.stderr.starts_with("error: "), "{run:?}");
    for word in words {
        assert!(run.stderr.contains(word), "{word:?} is not in {run:?}");
    }
    assert!(!at.join("out.exr").exists());
}

/// The command line's own errors: exit code 2, and the option is named.
#[track_caller]
fn usage(args: &[&str], words: &[&str]) {
    let at = folder("usage");
    let input = scene("bench/surface_only.json");
    let input = input.to_string_lossy();
    let run = Run::new(
        &at,
        [&["render", &input, "-o", "out.exr", "--quiet"], args].concat(),
    );
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.stderr.starts_with("error: "), "{run:?}");
    for word in words {
        assert!(run.stderr.contains(word), "{word:?} is not in {run:?}");
    }
    assert!(!at.join("out.exr").exists());
}

#[test]
fn wrong_options() {
    for (args, words) in [
        (
            &["--resolution", "12"][..],
            &["--resolution", "WIDTHxHEIGHT"][..],
        ),
        (&["--resolution", "0x5"], &["--resolution", "0"]),
        (&["--resolution", "70000x5"], &["65536"]),
        (
            &["--crop", "0,0,9999,9"],
            &["--crop", "leaves the picture", "160x160"],
        ),
        (&["--crop", "5,0,5,9"], &["empty"]),
        (
            &["--sample-range", "9..3"],
            &["--sample-range", "no samples"],
        ),
        (&["--sample-range", "0..4000000000"], &["8388608"]),
        (
            &["--sample-range", "3000000000..3000000064"],
            &["3000000000..3000000064 is beyond 8388608"],
        ),
        (&["--spp", "0"], &["--spp"]),
        (&["--spp", "9000000"], &["9000000", "8388608"]),
        (&["--spp", "4", "--time", "2"], &["--spp", "--time"]),
        (&["--time", "nan"], &["--time", "finite"]),
        (&["--error", "-1"], &["--error"]),
        (&["--exposure", "inf"], &["--exposure"]),
        (&["--aov", "depht"], &["depht", "depth"]),
        (&["--aov", "orders"], &["orders:N", "99"]),
        (&["--aov", "orders:100"], &["orders:N", "99"]),
        (&["--tone-map", "aces"], &["aces", "filmic"]),
        (&["--nonsense"], &["--nonsense"]),
        (&["--grid", "density"], &["--grid", "VDB files"]),
        (&["--sky", "nan"], &["--sky"]),
        (&["-o", "out.jpg"], &["out.jpg", ".exr or .png"]),
        (&["-o", "out.exr"], &["twice"]),
        (
            &["-o", "no/such/folder/a.exr"],
            &["no/such/folder", "no folder"],
        ),
        (&["--stats", "no/such/s.json"], &["no/such"]),
        (
            &["--plugin-path", "no/such"],
            &["--plugin-path no/such", "no such folder"],
        ),
        (&["--integrator", "pr"], &["'pr'", "did you mean 'pt'"]),
        (
            &["--integrator", "bdpt", "--reuse", "4"],
            &["--reuse is for the integrator pt; this is bdpt"],
        ),
        (&["--reuse", "9"], &["--reuse", "1..=8"]),
    ] {
        usage(args, words);
    }
}

/// Refused before anything is rendered, so that no work is lost.
#[test]
#[cfg(unix)]
fn a_folder_that_cannot_be_written_to() {
    use std::os::unix::fs::PermissionsExt;
    let at = folder("unwritable");
    let locked = at.join("locked");
    std::fs::create_dir_all(&locked).unwrap_or_else(|e| panic!("{e}"));
    let mode = |m| std::fs::set_permissions(&locked, std::fs::Permissions::from_mode(m));
    mode(0o500).unwrap_or_else(|e| panic!("{e}"));
    // The superuser may write everywhere.
    let refused = std::fs::write(locked.join("probe"), b"").is_err();
    let input = scene("bench/surface_only.json");
    let input = input.to_string_lossy();
    if refused {
        let args = ["render", &input, "-o", "locked/a.exr", "--spp", "8000000"];
        fails(
            &at,
            &args,
            &["locked/a.exr", "cannot write", "ermission denied"],
        );
    }
    mode(0o700).unwrap_or_else(|e| panic!("{e}"));
    // A folder in the place of the picture is refused for everyone.
    let args = ["render", &input, "-o", "folder.exr", "--spp", "8000000"];
    std::fs::create_dir_all(at.join("folder.exr")).unwrap_or_else(|e| panic!("{e}"));
    fails(&at, &args, &["folder.exr", "is a folder"]);
}

#[test]
fn wrong_scenes() {
    let at = folder("scenes");
    let name = "bench/cloud_sun.json";
    let render = ["render", "scene.json", "-o", "out.exr", "--quiet"];
    let run = |change: &dyn Fn(&mut serde_json::Value), words: &[&str]| {
        changed(&at, name, |s| change(s));
        fails(&at, &render, words);
    };
    run(
        &|s| s["camera"]["fov"] = json!(40),
        &["scene.json:1:", "$.camera.fov", "\"fov\"", "fov_x_deg"],
    );
    run(
        &|s| s["lights"][0]["irradiance"] = json!(-1),
        &["$.lights[0].irradiance"],
    );
    run(
        &|s| s["integrator"]["plugin"] = json!("ptt"),
        &[
            "scene.json:1:",
            "$.integrator",
            "no integrator plugin 'ptt'",
            "did you mean 'pt'",
        ],
    );
    run(
        &|s| s["media"]["cloud"]["plugin"] = json!("vdbb"),
        &["$.media.cloud", "'vdbb'", "did you mean 'vdb'"],
    );
    run(
        &|s| s["media"]["cloud"]["params"]["sigmat"] = json!(1),
        &["$.media.cloud.params.sigmat", "sigma_t"],
    );
    run(
        &|s| s["media"]["cloud"]["params"]["albedo"] = json!(1.5),
        &["$.media.cloud.params.albedo"],
    );
    run(
        &|s| s["media"]["cloud"]["params"]["grid"] = json!("smoke"),
        &[
            "cloud_s.vdb",
            "missing grid 'smoke'",
            "density (float, fog volume)",
        ],
    );
    run(
        &|s| s["media"]["cloud"]["params"]["phase"]["params"]["g"] = json!(1),
        &["$.media.cloud.params.phase"],
    );
    // JSON knows no NaN.
    let text = std::fs::read_to_string(at.join("scene.json")).unwrap_or_default();
    let text = text.replacen("\"fov_x_deg\":44", "\"fov_x_deg\":NaN", 1);
    assert!(text.contains("NaN"));
    std::fs::write(at.join("scene.json"), text).unwrap_or_else(|e| panic!("{e}"));
    fails(&at, &render, &["scene.json:1:"]);
}

#[test]
fn wrong_files() {
    let at = folder("files");
    let rest = ["-o", "out.exr", "--quiet"];
    let run = |file: &Path, words: &[&str]| {
        let file = file.to_string_lossy();
        fails(&at, &[&["render", &file], &rest[..]].concat(), words);
    };
    run(Path::new("none.json"), &["none.json", "No such file"]);
    run(Path::new("none.vdb"), &["none.vdb", "No such file"]);
    run(&at, &["is a folder"]);
    std::fs::write(at.join("note.txt"), "hello").unwrap_or_else(|e| panic!("{e}"));
    run(Path::new("note.txt"), &["note.txt", "neither a scene"]);
    std::fs::write(at.join("cut.json"), "{\"resolvent\": 1, ").unwrap_or_else(|e| panic!("{e}"));
    run(Path::new("cut.json"), &["cut.json:1:"]);
    run(
        &vdb("real/sphere.vdb"),
        &["sphere.vdb", "'ls_sphere'", "level set"],
    );
    run(&vdb("corpus/bad_text.vdb"), &["bad_text.vdb"]);
    let other = scene("cloud/cloud_s.vdb");
    let other = other.to_string_lossy();
    let args = [
        "render", &other, "--grid", "dens", "-o", "out.exr", "--quiet",
    ];
    fails(
        &at,
        &args,
        &["missing grid 'dens'", "density (float, fog volume)"],
    );
}

#[test]
fn tools_fail_clearly_too() {
    let at = folder("tools-errors");
    fails(&at, &["info", "none.vdb"], &["none.vdb", "No such file"]);
    fails(&at, &["compare", "a.exr", "b.exr"], &["a.exr"]);
    fails(
        &at,
        &["plugin", "info", "hgg"],
        &["'hgg'", "did you mean 'hg'"],
    );
    fails(
        &at,
        &["plugin", "info", "./libnone.so"],
        &["libnone.so", "o such file"],
    );
    let not = scene("cloud/cloud_s.vdb");
    let not = not.to_string_lossy();
    fails(&at, &["plugin", "info", &not], &["cloud_s.vdb"]);
    fails(&at, &["info", "."], &["is a folder"]);
    // What is there, and what to do with it, for files of the wrong kind.
    let input = scene("bench/surface_only.json");
    let input = input.to_string_lossy();
    let small = ["--quiet", "--spp", "1", "--resolution", "8x8"];
    let files = ["-o", "a.exr", "-o", "a.png", "--checkpoint", "a.ckpt"];
    Run::new(&at, [&["render", &input], &small[..], &files].concat()).done();
    for args in [["compare", "a.exr", "a.png"], ["compare", "a.png", "a.exr"]] {
        let words = ["a.png: is no EXR image", "compare takes EXR images"];
        fails(&at, &args, &words);
    }
    fails(&at, &["info", "a.png"], &["a.png", "OpenEXR image (.exr)"]);
    let words = ["a.ckpt: is a checkpoint", "resolvent merge a.ckpt"];
    fails(&at, &["info", "a.ckpt"], &words);
}

/// Light that gets into a body with a hole, filled with what scatters without loss and without end, would never come out: neither would the
/// picture.
#[test]
fn endless_walks() {
    let at = folder("endless");
    let scene = |albedo: f64, sides: &[[u32; 3]], place: &str| {
        let mesh = json!({"type": "mesh", "interior": "milk", "indices": sides,
            "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]});
        let mut s = json!({"resolvent": 1,
            "camera": {"type": "perspective", "origin": [1, 2, 3], "target": [0.2, 0.2, 0.2], "fov_x_deg": 30},
            "film": {"resolution": [8, 8]}, "sampling": {"spp": 4},
            "lights": [{"type": "environment", "radiance": 1}],
            "media": {"milk": {"plugin": "homogeneous", "params": {"sigma_t": 5, "albedo": albedo}}}});
        if place == "world" {
            s["shapes"] = json!([mesh]);
        } else {
            s["prototypes"] = json!({"bottle": [mesh]});
            s["instances"] = json!([{"prototype": "bottle"}]);
        }
        let path = at.join("scene.json");
        std::fs::write(&path, s.to_string()).unwrap_or_else(|e| panic!("{e}"));
        ["render", "scene.json", "-q", "-o", "out.exr"]
    };
    let closed = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let turned = closed.map(|[a, b, c]| [a, c, b]);
    let medium = [
        "scene.json:",
        "$.media.milk",
        "'milk' scatters without loss",
    ];
    for (place, name) in [
        ("world", "$.shapes[0]"),
        ("prototype", "$.prototypes.bottle[0]"),
    ] {
        let of = |why| [&medium[..], &[name, why, "an albedo below 1"]].concat();
        fails(
            &at,
            &scene(1.0, &closed[..3], place),
            &of("is open: 3 of its edges"),
        );
        fails(&at, &scene(1.0, &turned, place), &of("is inside out"));
        // What is closed ends, and so does what absorbs.
        for (albedo, sides) in [(1.0, &closed[..]), (0.9, &closed[..3])] {
            Run::new(&at, scene(albedo, sides, place)).done();
            std::fs::remove_file(at.join("out.exr")).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

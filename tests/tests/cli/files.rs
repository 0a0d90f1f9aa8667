//! Files that are written: none takes the place of another, and none is lost because another cannot be written.

use crate::program::{Run, changed, folder, scene};
use std::path::Path;

/// What each file of a folder holds.
fn contents(at: &Path) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let files = std::fs::read_dir(at).into_iter().flatten().flatten();
    let read = |f: std::fs::DirEntry| Some((f.file_name(), std::fs::read(f.path()).ok()?));
    let mut all: Vec<_> = files.filter_map(read).collect();
    all.sort();
    all
}

/// Exit code 2, one sentence that has both roles, and no file is changed or made.
#[track_caller]
fn refused(at: &Path, args: &[&str], words: &[&str]) {
    let before = contents(at);
    let run = Run::new(at, args);
    assert_eq!(run.code, Some(2), "{args:?}: {run:?}");
    assert_eq!(run.stderr.lines().count(), 1, "{run:?}");
    for word in words {
        assert!(run.stderr.contains(word), "{word:?} is not in {run:?}");
    }
    assert!(contents(at) == before, "{args:?} changed a file");
}

#[test]
fn no_file_has_two_roles() {
    let at = folder("roles");
    let cloud = at.join("cloud.vdb");
    std::fs::copy(scene("cloud/cloud_s.vdb"), &cloud).unwrap_or_else(|e| panic!("{e}"));
    changed(&at, "bench/cloud_sun.json", |s| {
        s["media"]["cloud"]["params"]["file"] = cloud.to_string_lossy().into();
    });
    std::fs::create_dir(at.join("sub")).unwrap_or_else(|e| panic!("{e}"));
    let small = ["--quiet", "--spp", "1", "--resolution", "16x16"];
    let render = |input: &str, more: &[&str], words: &[&str]| {
        refused(&at, &[&["render", input], &small[..], more].concat(), words);
    };
    let out = ["-o", "a.exr"];
    let with = |more: &[&'static str]| [&out[..], more].concat();
    for option in ["--save-scene", "--stats", "--checkpoint"] {
        let words = ["the input", option];
        render("cloud.vdb", &with(&[option, "cloud.vdb"]), &words);
        render("scene.json", &with(&[option, "sub/../scene.json"]), &words);
        let words = ["cloud.vdb", "a file of the scene", option];
        // That there is no checkpoint to begin with is checked first.
        let resume: &[&str] = if option == "--checkpoint" {
            &["--resume"]
        } else {
            &[]
        };
        let more = [&with(&[option, "cloud.vdb"])[..], resume].concat();
        render("scene.json", &more, &words);
        render("scene.json", &with(&[option, "a.exr"]), &["-o", option]);
    }
    let twice = ["--save-scene", "x.json", "--stats", "sub/../x.json"];
    render("scene.json", &with(&twice), &["--save-scene", "--stats"]);
    render("scene.json", &["-o", "a.exr", "-o", "./a.exr"], &["twice"]);
    // A link to what is not there yet is that file.
    #[cfg(unix)]
    {
        let link = at.join("link.json");
        std::os::unix::fs::symlink("x.json", &link).unwrap_or_else(|e| panic!("{e}"));
        let twice = ["--save-scene", "x.json", "--stats", "link.json"];
        render("scene.json", &with(&twice), &["--save-scene", "--stats"]);
    }
    let watch = with(&["--stats", "scene.json", "--watch"]);
    render("scene.json", &watch, &["the input", "--stats"]);

    let keep = ["--checkpoint", "k.ckpt", "--resume"];
    let args = [&["render", "scene.json"], &small[..], &keep].concat();
    Run::new(&at, &args).done();
    // What a render goes on from it also writes.
    Run::new(&at, &args).done();
    let merge = |more: &[&str], words: &[&str]| {
        refused(&at, &[&["merge", "k.ckpt", "-q"], more].concat(), words);
    };
    let same = ["-o", "m.exr", "--checkpoint", "m.exr"];
    merge(&same, &["-o", "--checkpoint"]);
    let own = ["-o", "m.exr", "--checkpoint", "k.ckpt"];
    merge(&own, &["a checkpoint to merge", "--checkpoint"]);

    let convert = ["convert", "scene.json", "-o", "scene.json"];
    refused(&at, &convert, &["the input", "-o"]);
    let export = ["export", "scene.json", "-o", "s.usda", "--report", "s.usda"];
    refused(&at, &export, &["-o", "--report"]);
}

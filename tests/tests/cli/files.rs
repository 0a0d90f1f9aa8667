//! Files that are written: none takes the place of another, and none is lost because another cannot be written.

use crate::program::{Run, changed, folder, path, picture, scene};
use std::path::Path;
#[cfg(unix)]
use std::process::Command;

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

/// Where no picture can be is known before it is rendered; where a link leads to it can.
#[test]
#[cfg(unix)]
fn pipes_and_links() {
    let at = folder("pipes");
    let input = scene("bench/surface_only.json");
    let input = input.to_string_lossy();
    let made = Command::new("mkfifo").arg(at.join("pipe.exr")).status();
    assert!(made.is_ok_and(|s| s.success()));
    let link = |to: &str, name: &str| {
        std::os::unix::fs::symlink(to, at.join(name)).unwrap_or_else(|e| panic!("{e}"));
    };
    link("loop.exr", "loop.exr");
    link("gone/a.exr", "lost.exr");
    link("/dev/null", "null.json");
    link("sub/there.exr", "second.exr");
    link("second.exr", "first.exr");
    std::fs::create_dir(at.join("sub")).unwrap_or_else(|e| panic!("{e}"));
    let long = ["render", &input, "-q", "--time", "5"];
    for (files, words) in [
        (&["-o", "pipe.exr"][..], ["pipe.exr: ", "a pipe"]),
        (&["-o", "loop.exr"], ["loop.exr: ", "leads to itself"]),
        (&["-o", "lost.exr"], ["lost.exr: ", "no folder"]),
        (
            &["-o", "a.exr", "--stats", "/dev/null"],
            ["/dev/null: ", "a device"],
        ),
        (&["--checkpoint", "null.json"], ["null.json: ", "a device"]),
    ] {
        let run = Run::new(&at, [&long[..], files].concat());
        assert_eq!(run.code, Some(2), "{run:?}");
        for word in words {
            assert!(run.stderr.contains(word), "{word:?} is not in {run:?}");
        }
    }
    let short = ["render", &input, "-q", "--spp", "1", "--resolution", "8x8"];
    for _ in 0..2 {
        Run::new(&at, [&short[..], &["-o", "first.exr"]].concat()).done();
        picture(&at.join("sub/there.exr"));
        for name in ["first.exr", "second.exr"] {
            let meta = std::fs::symlink_metadata(at.join(name));
            assert!(meta.is_ok_and(|m| m.is_symlink()), "{name} was replaced");
        }
    }
}

/// The program where files of more than `blocks` of 512 bytes cannot be written.
#[cfg(unix)]
fn limited(at: &Path, blocks: usize, args: &[&str]) -> (Option<i32>, String) {
    // Without its signal the limit is an error like that of a full disk.
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    let out = Command::new("sh")
        .args(["-c", &script])
        .arg(path())
        .args(args)
        .current_dir(at)
        .output()
        .unwrap_or_else(|e| panic!("{e}"));
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    (out.status.code(), said)
}

/// A checkpoint and pictures that cannot be written are told of, and the rest is written.
#[test]
#[cfg(unix)]
fn a_failure_spares_the_other_files() {
    let at = folder("spared");
    let input = scene("bench/surface_only.json");
    let input = input.to_string_lossy();
    let size = ["--quiet", "--spp", "4", "--resolution", "64x64"];
    let files = ["--checkpoint", "k.ckpt", "-o", "a.exr", "-o", "a.png"];
    let render = [&["render", &input], &size[..], &files].concat();
    let told = |(code, said): (Option<i32>, String), words: &[&str]| {
        assert_eq!(code, Some(1), "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
        for word in words {
            assert!(said.contains(word), "{word:?} is not in {said}");
        }
    };
    let there = || ["k.ckpt", "a.exr", "a.png"].map(|f| at.join(f).exists());
    // Sizes of the three files are far apart, the checkpoint's is the largest and the PNG's the smallest.
    Run::new(&at, &render).done();
    let blocks = |f: &str| {
        let size = std::fs::metadata(at.join(f)).map(|m| m.len() as usize);
        size.unwrap_or_else(|e| panic!("{e}")).div_ceil(512)
    };
    let [most, exr, png] = ["k.ckpt", "a.exr", "a.png"].map(blocks);
    assert!(most > exr + 1 && exr > png + 1, "{most} {exr} {png}");
    let whole = picture(&at.join("a.exr"));
    std::fs::rename(at.join("k.ckpt"), at.join("whole.ckpt")).unwrap_or_else(|e| panic!("{e}"));

    let clear = || ["a.exr", "a.png"].map(|f| drop(std::fs::remove_file(at.join(f))));
    clear();
    let words = ["k.ckpt: cannot write", "written is a.exr, a.png"];
    told(limited(&at, exr + 1, &render), &words);
    assert_eq!(there(), [false, true, true]);
    assert!(picture(&at.join("a.exr")).layers == whole.layers);

    clear();
    let words = ["k.ckpt: ", "a.exr: ", "written is a.png"];
    told(limited(&at, png + 1, &render), &words);
    assert_eq!(there(), [false, false, true]);
    clear();
    let merge = [&["merge", "whole.ckpt", "-q"], &files[..]].concat();
    told(limited(&at, png + 1, &merge), &words);
    assert_eq!(there(), [false, false, true]);

    clear();
    told(limited(&at, 0, &render), &["a.png: ", "nothing is written"]);
    assert_eq!(there(), [false; 3]);
}

/// The exit code and what is said when standard output goes to `out`.
#[cfg(unix)]
fn printing_to(at: &Path, out: std::process::Stdio, args: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(path());
    let out = command.args(args).current_dir(at).stdout(out).output();
    let out = out.unwrap_or_else(|e| panic!("{e}"));
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    (out.status.code(), said)
}

/// Results that cannot be printed are no bug of the program; a reader that has gone is nothing to tell.
#[test]
#[cfg(target_os = "linux")]
fn standard_output_that_cannot_be_written() {
    let at = folder("stdout");
    let cloud = scene("cloud/cloud_s.vdb");
    let cloud = cloud.to_string_lossy();
    Run::new(
        &at,
        [
            "render",
            &cloud,
            "-q",
            "--spp",
            "1",
            "--resolution",
            "8x8",
            "-o",
            "a.exr",
        ],
    )
    .done();
    for args in [
        &["schema"][..],
        &["compare", "a.exr", "a.exr"],
        &["info", &cloud, "--json"],
        &["plugin", "list"],
    ] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
        let full = full.unwrap_or_else(|e| panic!("{e}"));
        let (code, said) = printing_to(&at, full.into(), args);
        assert_eq!(code, Some(1), "{said}");
        let start = "error: cannot write to standard output: No space left";
        assert!(
            said.starts_with(start) && said.lines().count() == 1,
            "{said}"
        );

        let (reader, writer) = std::io::pipe().unwrap_or_else(|e| panic!("{e}"));
        drop(reader);
        let (_, said) = printing_to(&at, writer.into(), args);
        assert_eq!(said, "");
    }
}

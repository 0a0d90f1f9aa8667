//! The same through the program: exit codes, and one sentence on the terminal.

use crate::build;
use crate::drive::{cloud, haze, walk};
use resolvent_image::Image;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The program, two folders above the tests' executables.
pub fn program() -> PathBuf {
    let exe = std::env::current_exe().unwrap_or_else(|e| panic!("{e}"));
    let folder = exe
        .parent()
        .and_then(Path::parent)
        .unwrap_or(Path::new("."));
    let path = folder.join(format!("resolvent{}", std::env::consts::EXE_SUFFIX));
    let mode = if cfg!(debug_assertions) {
        ""
    } else {
        " --release"
    };
    assert!(
        path.is_file(),
        "{} is not built: run `cargo build{mode}` first",
        path.display()
    );
    path
}

struct Run {
    code: Option<i32>,
    stderr: String,
    picture: PathBuf,
}

fn run(name: &str, scene: &Value) -> Run {
    let at = build::folder("program");
    let (file, picture) = (
        at.join(format!("{name}.json")),
        at.join(format!("{name}.exr")),
    );
    let text = serde_json::to_vec_pretty(scene).unwrap_or_else(|e| panic!("{e}"));
    build::write(&file, &text);
    if picture.exists() {
        std::fs::remove_file(&picture).unwrap_or_else(|e| panic!("{e}"));
    }
    let out = Command::new(program())
        .args(["render", "--quiet", "--threads", "2", "--plugin-path"])
        .arg(build::unruly_folder())
        .arg(&file)
        .arg("-o")
        .arg(&picture)
        .env("RUST_BACKTRACE", "1")
        .output()
        .unwrap_or_else(|e| panic!("{e}"));
    Run {
        code: out.status.code(),
        stderr: String::from_utf8_lossy(&out.stderr).into_owned(),
        picture,
    }
}

/// Exit code 2, one line with these words, and no picture.
#[track_caller]
fn fails(name: &str, scene: &Value, words: &[&str]) {
    let r = run(name, scene);
    let text = &r.stderr;
    assert_eq!(text.lines().count(), 1, "{name}: {text}");
    assert!(
        text.starts_with("error: ") && !text.contains("backtrace"),
        "{text}"
    );
    for word in words {
        assert!(text.contains(word), "{name}: '{word}' is not in: {text}");
    }
    assert_eq!(r.code, Some(2), "{name}: {text}");
    assert!(!r.picture.exists());
}

#[test]
fn plugins_that_break() {
    let title = |kind: &str| format!("{kind} plugin 'unruly' ({})", build::unruly(kind).display());
    let (medium, phase, integrator) = (title("medium"), title("phase"), title("integrator"));
    for (name, scene, words) in [
        (
            "create",
            cloud("create panics"),
            [&medium, "$.media.cloud", "unruly as asked"],
        ),
        (
            "info",
            cloud("info panics"),
            [&medium, "$.media.cloud", "unruly as asked"],
        ),
        (
            "sample",
            cloud("sample panics"),
            [&medium, "'cloud'", "unruly as asked"],
        ),
        (
            "nan",
            cloud("value is NaN"),
            [&medium, "'cloud'", "impossible flight"],
        ),
        (
            "eval",
            haze("eval panics"),
            [&phase, "'haze'", "panicked in eval"],
        ),
        (
            "render",
            walk("render panics"),
            [&integrator, "panicked at", "unruly as asked"],
        ),
    ] {
        fails(name, &scene, &words);
    }
}

#[test]
fn libraries_that_are_refused() {
    let mut s = haze("none");
    let newer = build::c_phase("program_newer", &["ABI_MAJOR=2"]);
    s["media"]["haze"]["params"]["phase"] = json!({ "plugin": newer });
    let words = [
        "built for plugin ABI 2.",
        "has ABI 1",
        &newer.display().to_string(),
    ];
    fails("newer", &s, &words);
}

/// The finished part is saved, and that is said.
#[test]
fn what_was_finished_is_saved() {
    let r = run("later", &walk("a later pass panics"));
    assert_eq!(r.code, Some(2), "{}", r.stderr);
    assert_eq!(r.stderr.lines().count(), 1, "{}", r.stderr);
    assert!(
        r.stderr.contains("unruly as asked: later") && r.stderr.contains("saved"),
        "{}",
        r.stderr
    );
    let image = Image::read_exr(&r.picture);
    assert!(image.is_ok(), "{:?}", image.err());
}

/// A sample that is not finite ends the render with an error that names the plugin, the pixel and what was saved.
#[test]
fn samples_that_are_not_finite() {
    let r = run("not-finite", &walk("radiance is NaN"));
    assert_eq!(r.code, Some(2), "{}", r.stderr);
    assert_eq!(r.stderr.lines().count(), 1, "{}", r.stderr);
    let path = build::unruly("integrator").display().to_string();
    let words = [path.as_str(), "gave sample 1 of pixel (", "NaN"];
    assert!(words.iter().all(|w| r.stderr.contains(w)), "{}", r.stderr);
}

/// A majorant that is too small is a warning.
#[test]
fn violated_majorants_are_a_warning() {
    let r = run("majorant", &cloud("majorant too small"));
    assert_eq!(r.code, Some(0), "{}", r.stderr);
    assert!(
        r.stderr
            .starts_with("warning: the extinction was above its majorant"),
        "{}",
        r.stderr
    );
    let title = format!("'unruly' ({})", build::unruly("medium").display());
    let words = ["of the medium 'cloud'", &title];
    assert!(words.iter().all(|w| r.stderr.contains(w)), "{}", r.stderr);
}

//! USD stages: the converter's own tests, and the program with the converter.

use super::interrupt::signal;
use super::program::{bits, folder, path, picture, repository};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// The converter's folder.
fn package() -> PathBuf {
    repository().join("formats/usd")
}

/// A Python with the converter and pytest, in an environment of its own, which is made if it is not there.
fn python() -> &'static Path {
    static PYTHON: OnceLock<PathBuf> = OnceLock::new();
    PYTHON.get_or_init(|| {
        let environment = package().join(".venv");
        let python = environment.join("bin/python");
        let ready = |python: &Path| {
            Command::new(python)
                .args(["-c", "import pytest, resolvent_usd.convert"])
                .output()
                .is_ok_and(|out| out.status.success())
        };
        if !ready(&python) {
            let environment = environment.to_string_lossy().into_owned();
            let package = format!("{}[test]", package().display());
            step("python3", &["-m", "venv", &environment]);
            let pip = ["-m", "pip", "install", "--quiet", "--editable", &package];
            step(&python.to_string_lossy(), &pip);
            assert!(ready(&python), "{} is of no use", python.display());
        }
        python
    })
}

/// One step of making the environment.
fn step(program: &str, args: &[&str]) {
    let out = Command::new(program).args(args).output();
    let said = match out {
        Ok(out) if out.status.success() => return,
        Ok(out) => String::from_utf8_lossy(&out.stderr).into_owned(),
        Err(e) => e.to_string(),
    };
    panic!(
        "the tests of formats/usd need python3 (3.10 or newer, with its module venv) and, the first time, PyPI for usd-core, numpy and \
         pytest; `{program} {}` failed: {said}",
        args.join(" ")
    );
}

#[test]
fn the_packages_own_tests() {
    let out = Command::new(python())
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
        .current_dir(package())
        .env("RESOLVENT_PROGRAM", path())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap_or_else(|e| panic!("{e}"));
    let said = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{said}");
}

/// The program with this Python and a cache of its own.
fn command(folder: &Path, python: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(path());
    command
        .args(args)
        .current_dir(folder)
        .env_remove("RESOLVENT_PLUGIN_PATH")
        .env("RESOLVENT_PYTHON", python)
        .env("XDG_CACHE_HOME", folder.join("cache"));
    command
}

/// Runs it.
fn run(folder: &Path, python: &Path, args: &[&str]) -> Output {
    command(folder, python, args)
        .output()
        .unwrap_or_else(|e| panic!("{e}"))
}

fn stage(color: &str) -> String {
    format!(
        r#"#usda 1.0
(
    endTimeCode = 9
    startTimeCode = 0
)
def Camera "camera"
{{
    float2 clippingRange = (1, 10)
}}
def Sphere "ball"
{{
    color3f[] primvars:displayColor = [{color}]
    double3 xformOp:translate.timeSamples = {{ 0: (0, 0, -9), 9: (0, 0, 9) }}
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def DistantLight "sun"
{{
    float inputs:intensity = 1
    float inputs:angle = 1
    bool inputs:normalize = 1
}}
"#
    )
}

const RENDER: [&str; 8] = [
    "render",
    "shot.usda",
    "-o",
    "shot.exr",
    "--spp",
    "4",
    "--resolution",
    "24x24",
];

/// The picture's mean colour.
fn mean(folder: &Path) -> [f32; 3] {
    let image = picture(&folder.join("shot.exr"));
    let color = image.color().unwrap_or_else(|| panic!("no colour"));
    color.map(|c| c.iter().sum::<f32>() / image.pixels() as f32)
}

fn said(out: &Output) -> String {
    String::from_utf8_lossy(&out.stderr).into_owned()
}

/// A stage renders; what was lost is said; the conversion is kept while the bytes of the stage are the same.
#[test]
fn rendered_through_the_cache() {
    let folder = folder("usd_cache");
    let write = |color| std::fs::write(folder.join("shot.usda"), stage(color)).unwrap();
    let scenes = || -> Vec<(PathBuf, std::time::SystemTime)> {
        std::fs::read_dir(folder.join("cache/resolvent/usd"))
            .unwrap()
            .map(|e| e.unwrap().path().join("scene.json"))
            .map(|p| (p.clone(), p.metadata().unwrap().modified().unwrap()))
            .collect()
    };
    write("(1, 0, 0)");
    let out = run(&folder, python(), &RENDER);
    assert!(out.status.success(), "{}", said(&out));
    assert!(said(&out).contains("clippingRange"), "{}", said(&out));
    let red = mean(&folder);
    assert!(red[0] > 1e-3 && red[1] == 0.0, "{red:?}");
    let first = scenes();
    assert_eq!(first.len(), 1);

    // The same bytes written again: found, and the losses are said again, in full if they are asked for.
    write("(1, 0, 0)");
    let args = [&RENDER[..], &["--report", "losses.json"]].concat();
    let out = run(&folder, python(), &args);
    assert!(said(&out).contains("clippingRange"), "{}", said(&out));
    assert_eq!(scenes(), first);
    let report = std::fs::read_to_string(folder.join("losses.json")).unwrap();
    assert!(report.contains("clippingRange"), "{report}");

    write("(0, 1, 0)");
    let out = run(&folder, python(), &RENDER);
    assert!(out.status.success(), "{}", said(&out));
    let green = mean(&folder);
    assert!(green[1] > 1e-3 && green[0] == 0.0, "{green:?}");
    assert_ne!(scenes(), first);
    assert_eq!(scenes().len(), 1);

    // At the end the ball is behind the camera.
    let out = run(
        &folder,
        python(),
        &[&RENDER[..], &["--frame", "9"]].concat(),
    );
    assert!(out.status.success(), "{}", said(&out));
    assert_eq!(mean(&folder), [0.0; 3]);
    assert_eq!(scenes().len(), 2);
}

/// Frame after frame, each the picture that it is alone; names have the frame's number.
#[test]
fn sequences_are_rendered() {
    let folder = folder("usd_sequence");
    std::fs::write(folder.join("shot.usda"), stage("(1, 0, 0)")).unwrap();
    let args = |output, more: &[&'static str]| {
        let args = ["render", "shot.usda", "-o", output, "--resolution", "24x24"];
        [&args[..], more].concat()
    };
    let out = run(
        &folder,
        python(),
        &args("a.####.exr", &["--spp", "4", "--frames", "0-7:3"]),
    );
    assert!(out.status.success(), "{}", said(&out));
    let pictures = |name: &str| {
        let mut found: Vec<_> = std::fs::read_dir(&folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .filter(|n| n.starts_with(name))
            .collect();
        found.sort();
        found
    };
    assert_eq!(pictures("a."), ["a.0000.exr", "a.0003.exr", "a.0006.exr"]);
    let alone = args("alone.exr", &["--spp", "4", "--frame", "3"]);
    assert!(run(&folder, python(), &alone).status.success());
    let [third, alone] = ["a.0003.exr", "alone.exr"].map(|f| bits(&picture(&folder.join(f))));
    assert_eq!(third, alone);

    // Interrupted in the second frame: the first one is there, and what is left is said.
    let mut child = command(
        &folder,
        python(),
        &args(
            "b.exr",
            &["--time", "1", "--threads", "1", "--frames", "0-9:3"],
        ),
    )
    .stderr(Stdio::piped())
    .spawn()
    .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap())
        .lines()
        .map_while(Result::ok);
    assert!(lines.any(|l| l.starts_with("frame 3")));
    assert_eq!(pictures("b."), ["b.0000.exr"]);
    signal("-INT", child.id());
    let rest: Vec<String> = lines.collect();
    assert_eq!(child.wait().unwrap().code(), Some(3), "{rest:?}");
    let left = "interrupted; 1 frames are written; for the rest: --frames 3-9:3";
    assert_eq!(rest.last().map(String::as_str), Some(left), "{rest:?}");

    // An error names the frame; an option that has no meaning for a scene is refused.
    let broken =
        stage("(1, 0, 0)").replace("intensity = 1", "intensity.timeSamples = { 0: 1, 3: nan }");
    std::fs::write(folder.join("shot.usda"), broken).unwrap();
    let out = run(
        &folder,
        python(),
        &args("c.exr", &["--spp", "1", "--frames", "0-9:3"]),
    );
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    let last = said(&out).lines().last().unwrap_or_default().to_owned();
    for words in [
        "error: frame 3: /sun",
        "1 frames are written; for the rest: --frames 3-9:3",
    ] {
        assert!(last.contains(words), "{last}");
    }
    assert_eq!(pictures("c."), ["c.0000.exr"]);
    std::fs::write(folder.join("scene.json"), "{}").unwrap();
    let out = run(
        &folder,
        python(),
        &["render", "scene.json", "--frames", "1-2"],
    );
    assert!(
        said(&out).contains("--frames is for USD stages"),
        "{}",
        said(&out)
    );
}

#[test]
fn converted_to_scenes() {
    let folder = folder("usd_convert");
    std::fs::write(folder.join("shot.usda"), stage("(1, 0, 0)")).unwrap();
    let args = [
        "convert",
        "shot.usda",
        "-o",
        "shot.json",
        "--frames",
        "0-9:3",
    ];
    let out = run(&folder, python(), &args);
    assert!(out.status.success(), "{}", said(&out));
    for name in [
        "shot.0000.json",
        "shot.0003.json",
        "shot.0006.json",
        "shot.0009.json",
    ] {
        resolvent_scene::Scene::read(folder.join(name)).unwrap_or_else(|e| panic!("{e}"));
    }
    let out = run(&folder, python(), &[&args[..4], &["--strict"]].concat());
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
}

/// A scene that goes to USD and comes back has the same parts.
#[test]
fn exported_and_back() {
    let folder = folder("usd_export");
    std::fs::write(folder.join("shot.usda"), stage("(1, 0, 0)")).unwrap();
    for args in [
        ["convert", "shot.usda", "-o", "there.json"],
        ["export", "there.json", "-o", "stage.usda"],
        ["convert", "stage.usda", "-o", "back.json"],
    ] {
        let out = run(&folder, python(), &args);
        assert!(out.status.success(), "{}", said(&out));
    }
    let [there, back] = ["there.json", "back.json"]
        .map(|f| resolvent_scene::Scene::read(folder.join(f)).unwrap_or_else(|e| panic!("{e}")));
    assert_eq!(back.shapes.len(), there.shapes.len());
    assert_eq!(back.lights.len(), there.lights.len());
    assert_eq!(back.camera.to_world(), there.camera.to_world());
}

#[test]
fn what_cannot_be_converted_is_wrong_input() {
    let folder = folder("usd_errors");
    let broken = "#usda 1.0\ndef Xform \"bad\" (references = @./none.usda@)\n{\n}\n";
    std::fs::write(folder.join("shot.usda"), broken).unwrap();
    let out = run(&folder, python(), &RENDER);
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    let last = said(&out).lines().last().unwrap_or_default().to_owned();
    assert!(
        last.starts_with("error: /bad: ") && last.contains("none.usda"),
        "{last}"
    );
    assert!(!folder.join("shot.exr").exists());
    // Nothing of it stays in the cache.
    let left = std::fs::read_dir(folder.join("cache/resolvent/usd")).map_or(0, Iterator::count);
    assert_eq!(left, 0);

    for (python, args, words) in [
        (
            Path::new("/none/python"),
            &RENDER[..],
            "RESOLVENT_PYTHON is /none/python",
        ),
        (
            python(),
            &["render", "shot.usda", "--sun", "none"],
            "--sun is for VDB files",
        ),
        (python(), &["info", "shot.usda"], "resolvent convert"),
    ] {
        let out = run(&folder, python, args);
        assert_eq!(out.status.code(), Some(2), "{}", said(&out));
        assert!(said(&out).contains(words), "{}", said(&out));
    }
}

/// Without any Python the message has the command that makes one.
#[test]
fn a_missing_package_has_a_recipe() {
    let folder = folder("usd_missing");
    let fake = folder.join("python");
    std::fs::write(
        &fake,
        "#!/bin/sh\necho \"No module named 'resolvent_usd'\" >&2\nexit 1\n",
    )
    .unwrap();
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(&fake, std::fs::Permissions::from_mode(0o755)).unwrap();
    std::fs::write(folder.join("shot.usda"), stage("(1, 0, 0)")).unwrap();
    let out = run(&folder, &fake, &RENDER);
    assert_eq!(out.status.code(), Some(2), "{}", said(&out));
    for words in ["No module named 'resolvent_usd'", "-m venv", "pip install"] {
        assert!(said(&out).contains(words), "{}", said(&out));
    }
}

/// The stage of the book's gallery, of which nothing is lost.
#[test]
fn the_gallerys_stage() {
    let folder = folder("usd_gallery");
    let stage = repository().join("scenes/stage/stage.usda");
    let stage = stage.to_string_lossy();
    let render = [
        "render",
        &stage,
        "-o",
        "stage.exr",
        "--resolution",
        "24x16",
        "--spp",
        "4",
    ];
    let out = run(&folder, python(), &render);
    assert!(out.status.success(), "{}", said(&out));
    assert!(!said(&out).contains("warning"), "{}", said(&out));
}

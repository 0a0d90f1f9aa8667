//! Builds the fixtures: Rust packages outside the workspace, and single C files.

use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, OnceLock};

/// Where everything is built.
fn scratch() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("plugin-boundary")
}

/// The folder of this package in the sources.
pub fn package() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A folder of its own for a test.
pub fn folder(name: &str) -> PathBuf {
    let path = scratch().join(name);
    create_dir(&path);
    path
}

fn create_dir(path: &Path) {
    std::fs::create_dir_all(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

/// Writes a file, unless it is there with the same content: builds look at the time of the last change.
pub fn write(path: &Path, content: &[u8]) {
    if std::fs::read(path).is_ok_and(|old| old == content) {
        return;
    }
    std::fs::write(path, content).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

fn copy(from: &Path, to: &Path, edit: &dyn Fn(&str) -> String) {
    create_dir(to);
    let entries = std::fs::read_dir(from).unwrap_or_else(|e| panic!("{}: {e}", from.display()));
    for entry in entries {
        let path = entry.unwrap_or_else(|e| panic!("{e}")).path();
        let name = path.file_name().unwrap_or_default();
        if path.is_dir() {
            if name != "target" {
                copy(&path, &to.join(name), edit);
            }
        } else if name != "Cargo.lock" {
            let text = std::fs::read_to_string(&path);
            let text = text.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            write(&to.join(name), edit(&text).as_bytes());
        }
    }
}

/// Copies the package at `from` (relative to this one), replaces the path `placeholder` by that of `core/api`, and takes over
/// the lock file: what the renderer was built with needs no download.
fn outside(from: &str, name: &str, placeholder: &str) -> PathBuf {
    let api = package().join("../core/api");
    let api = api
        .canonicalize()
        .unwrap_or_else(|e| panic!("{}: {e}", api.display()));
    let path = format!("{:?}", api.display().to_string());
    let to = folder("sources").join(name);
    copy(&package().join(from), &to, &|text| {
        text.replace(&format!("\"{placeholder}\""), &path)
    });
    let lock = package().join("../Cargo.lock");
    if let Ok(lock) = std::fs::read(lock) {
        write(&to.join("Cargo.lock"), &lock);
    }
    to
}

/// What a run of cargo came to.
struct Ran {
    libraries: BTreeMap<String, PathBuf>,
    errors: Option<String>,
}

/// Runs cargo on a package, first without the network.
fn cargo(command: &str, package: &Path, more: &[&str]) -> Ran {
    // One at a time: the machine is busy enough, and they share a target folder.
    static ONE: Mutex<()> = Mutex::new(());
    let _guard = ONE.lock().unwrap_or_else(|e| e.into_inner());
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let run = |offline: &[&str]| {
        let out = Command::new(&cargo)
            .arg(command)
            .args(offline)
            .args(["--release", "--message-format=json-render-diagnostics"])
            .args(["--config", "profile.release.codegen-units=16"])
            .arg("--manifest-path")
            .arg(package.join("Cargo.toml"))
            .arg("--target-dir")
            .arg(scratch().join("target"))
            .args(more)
            .output()
            .unwrap_or_else(|e| panic!("cannot run {}: {e}", cargo.display()));
        let mut libraries = BTreeMap::new();
        for line in String::from_utf8_lossy(&out.stdout).lines() {
            let Ok(message) = serde_json::from_str::<Value>(line) else {
                continue;
            };
            if message["target"]["kind"][0] != "cdylib" {
                continue;
            }
            let files = message["filenames"].as_array().cloned().unwrap_or_default();
            for file in files.iter().filter_map(Value::as_str) {
                if file.ends_with(std::env::consts::DLL_SUFFIX) {
                    let name = message["target"]["name"].as_str().unwrap_or_default();
                    libraries.insert(name.to_owned(), PathBuf::from(file));
                }
            }
        }
        let errors =
            (!out.status.success()).then(|| String::from_utf8_lossy(&out.stderr).into_owned());
        Ran { libraries, errors }
    };
    let ran = run(&["--offline"]);
    match &ran.errors {
        Some(why) if why.contains("--offline") || why.contains("no matching package") => run(&[]),
        _ => ran,
    }
}

fn built(package: &Path) -> BTreeMap<String, PathBuf> {
    let ran = cargo("build", package, &[]);
    if let Some(why) = ran.errors {
        panic!("{} does not build:\n{why}", package.display());
    }
    ran.libraries
}

fn library(built: &BTreeMap<String, PathBuf>, name: &str) -> PathBuf {
    match built.get(name) {
        Some(path) => path.clone(),
        None => panic!("cargo built no library '{name}', only {built:?}"),
    }
}

/// The library of `fixtures/apart`.
pub fn wedge() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        library(
            &built(&outside("fixtures/apart", "apart", "@API@")),
            "apart",
        )
    })
}

/// What cargo says about `fixtures/apart` with panics that abort.
pub fn wedge_that_aborts() -> Option<String> {
    let package = outside("fixtures/apart", "apart", "@API@");
    cargo(
        "check",
        &package,
        &["--config", "profile.release.panic=\"abort\""],
    )
    .errors
}

/// The library of the medium that `resolvent plugin new` writes.
pub fn template() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| {
        let to = folder("sources").join("template");
        drop(std::fs::remove_dir_all(&to));
        let new = Command::new(crate::program::program())
            .args(["plugin", "new", "soft-ball", "--kind", "medium", "--to"])
            .arg(&to)
            .output()
            .unwrap_or_else(|e| panic!("{e}"));
        assert!(
            new.status.success(),
            "{}",
            String::from_utf8_lossy(&new.stderr)
        );
        if let Ok(lock) = std::fs::read(package().join("../Cargo.lock")) {
            write(&to.join("Cargo.lock"), &lock);
        }
        library(&built(&to), "resolvent_medium_soft_ball")
    })
}

/// The library of the unruly plugin of a kind; all of them are in one folder.
pub fn unruly(kind: &str) -> PathBuf {
    static ALL: OnceLock<BTreeMap<String, PathBuf>> = OnceLock::new();
    let all = ALL.get_or_init(|| built(&outside("fixtures/unruly", "unruly", "@API@")));
    library(all, &format!("resolvent_{kind}_unruly"))
}

/// The folder of the unruly plugins.
pub fn unruly_folder() -> PathBuf {
    match unruly("medium").parent() {
        Some(folder) => folder.to_path_buf(),
        None => panic!("a library without a folder"),
    }
}

/// Compiles `fixtures/c/{source}` with further arguments to `output`.
fn cc(source: &str, arguments: &[String], output: &Path) {
    let out = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-O2"])
        .arg("-I")
        .arg(package().join("../core/api/include"))
        .args(arguments)
        .arg(package().join("fixtures/c").join(source))
        .arg("-o")
        .arg(output)
        .arg("-lm")
        .output()
        .unwrap_or_else(|e| panic!("these tests need a C compiler, and `cc` does not run: {e}"));
    let errors = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "cc {source} {arguments:?}:\n{errors}");
}

/// The file name of a shared library.
pub fn library_name(stem: &str) -> String {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    format!("{DLL_PREFIX}{stem}{DLL_SUFFIX}")
}

/// A shared library of the C phase function, with definitions such as `ABI_MAJOR=2`.
pub fn c_phase(name: &str, definitions: &[&str]) -> PathBuf {
    let path = folder("c").join(library_name(name));
    let mut arguments = vec!["-shared".to_owned(), "-fPIC".to_owned()];
    arguments.extend(definitions.iter().map(|d| format!("-D{d}")));
    cc("phase.c", &arguments, &path);
    path
}

/// A library of the C phase function that needs `libgone.so`, which is taken away.
pub fn c_phase_that_needs_another() -> PathBuf {
    let at = folder("gone");
    let (gone, path) = (
        at.join("libgone.so"),
        at.join(library_name("needs_another")),
    );
    let shared = ["-shared", "-fPIC"].map(str::to_owned);
    cc(
        "phase.c",
        &[&shared[..], &["-DSYMBOL=gone".to_owned()]].concat(),
        &gone,
    );
    let link = ["-Wl,--no-as-needed".to_owned(), gone.display().to_string()];
    cc(
        "phase.c",
        &[&shared[..], &link, &["-Wl,-soname,needy.so".to_owned()]].concat(),
        &path,
    );
    std::fs::remove_file(&gone).unwrap_or_else(|e| panic!("{}: {e}", gone.display()));
    path
}

/// What `fixtures/c/{source}` prints.
pub fn c_output(source: &str) -> String {
    let path = folder("c")
        .join(source)
        .with_extension(std::env::consts::EXE_EXTENSION);
    cc(source, &[], &path);
    let out = Command::new(&path).output();
    let out = out.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

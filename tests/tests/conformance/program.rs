//! Runs the program, and compiles plugins for it.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of this package in the sources.
pub fn package() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The program, two folders above the tests' executables.
pub fn resolvent() -> Command {
    let exe = std::env::current_exe().unwrap_or_else(|e| panic!("{e}"));
    let folder = exe
        .parent()
        .and_then(Path::parent)
        .unwrap_or(Path::new("."));
    let path = folder.join(format!("resolvent{}", std::env::consts::EXE_SUFFIX));
    assert!(
        path.is_file(),
        "{} is not built: run `cargo build --release` first",
        path.display()
    );
    Command::new(path)
}

/// A report of `plugin check`.
pub struct Report {
    /// As it was printed.
    pub json: Value,
    /// Exit code.
    pub code: Option<i32>,
    /// What was said beside it.
    pub stderr: String,
}

impl Report {
    /// Names of the properties that don't hold.
    pub fn broken(&self) -> Vec<&str> {
        let all = self.json["properties"].as_array().map_or(&[][..], |a| a);
        let broken = all.iter().filter(|p| p["holds"] == false);
        broken.filter_map(|p| p["property"].as_str()).collect()
    }

    /// The first failure of a property.
    pub fn failure(&self, property: &str) -> String {
        let all = self.json["properties"].as_array().map_or(&[][..], |a| a);
        let found = all.iter().find(|p| p["property"] == property);
        found.map_or_else(String::new, |p| p["failures"][0]["what"].to_string())
    }
}

/// Checks a plugin.
pub fn check(plugin: &str, more: &[&str]) -> Report {
    let out = resolvent()
        .args(["plugin", "check", plugin, "--json"])
        .args(more)
        .output()
        .unwrap_or_else(|e| panic!("{e}"));
    Report {
        json: serde_json::from_slice(&out.stdout).unwrap_or_default(),
        code: out.status.code(),
        stderr: String::from_utf8_lossy(&out.stderr).into_owned(),
    }
}

/// Compiles `fixtures/broken/{kind}.c` with a definition, or none.
pub fn library(kind: &str, definition: Option<&str>) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("conformance");
    std::fs::create_dir_all(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let name = definition.unwrap_or("whole").to_lowercase();
    let path = folder.join(format!("{kind}_{name}{}", std::env::consts::DLL_SUFFIX));
    let out = Command::new("cc")
        .args([
            "-std=c11",
            "-Wall",
            "-Wextra",
            "-Wpedantic",
            "-Werror",
            "-O1",
            "-shared",
            "-fPIC",
            "-I",
        ])
        .arg(package().join("../core/api/include"))
        .args(definition.map(|d| format!("-D{d}")))
        .arg(package().join(format!("fixtures/broken/{kind}.c")))
        .arg("-o")
        .arg(&path)
        .arg("-lm")
        .output()
        .unwrap_or_else(|e| panic!("these tests need a C compiler, and `cc` does not run: {e}"));
    let errors = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{kind}.c, {definition:?}:\n{errors}");
    path
}

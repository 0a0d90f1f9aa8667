//! The header by the compilers that are there.

use std::path::Path;
use std::process::Command;

/// Warnings that are errors.
const STRICT: [&str; 4] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// Compiles a file that includes the header and defines a plugin; `None` if there is no such compiler.
fn compiles(compiler: &str, language: &str, standard: &str) -> Option<Result<(), String>> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let source = folder.join(format!("include-{compiler}.{language}"));
    let text = include_str!("plugin.c");
    std::fs::write(&source, text).unwrap_or_else(|e| panic!("{}: {e}", source.display()));
    let out = Command::new(compiler)
        .args(STRICT)
        .args([standard, "-fsyntax-only", "-I"])
        .arg(super::api().join("include"))
        .arg(&source)
        .output()
        .ok()?;
    let errors = String::from_utf8_lossy(&out.stderr).into_owned();
    Some(if out.status.success() {
        Ok(())
    } else {
        Err(errors)
    })
}

#[test]
fn without_warnings() {
    let mut compilers = 0;
    for (compiler, language, standard) in [
        ("gcc", "c", "-std=c11"),
        ("clang", "c", "-std=c11"),
        ("g++", "cpp", "-std=c++17"),
        ("clang++", "cpp", "-std=c++17"),
    ] {
        if let Some(outcome) = compiles(compiler, language, standard) {
            compilers += 1;
            assert_eq!(outcome, Ok(()), "{compiler} {standard}");
        }
    }
    assert!(compilers >= 2, "neither gcc nor clang is here");
}

//! The program and the repository.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The folder that programs and plugins are built into.
pub fn built() -> PathBuf {
    let exe = std::env::current_exe().unwrap_or_else(|e| panic!("{e}"));
    let folder = exe.parent().and_then(Path::parent).map(Path::to_path_buf);
    let folder = folder.unwrap_or_default();
    assert!(
        folder.join(NAME).is_file(),
        "{NAME} is not in {}: run `cargo build --release` first",
        folder.display()
    );
    folder
}

/// File name of the program.
pub const NAME: &str = if cfg!(windows) {
    "resolvent.exe"
} else {
    "resolvent"
};

/// The repository.
pub fn repository() -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    path.canonicalize()
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A folder of this test's own inside of the folder of builds, which outlasts the test.
pub fn kept(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("book")
        .join(name);
    std::fs::create_dir_all(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    path
}

/// Runs a command to its end.
#[track_caller]
pub fn run(command: &mut Command) -> Output {
    command
        .output()
        .unwrap_or_else(|e| panic!("{command:?}: {e}"))
}

/// Both streams of what a command said.
pub fn said(out: &Output) -> String {
    let text = [&out.stdout[..], &out.stderr[..]].concat();
    String::from_utf8_lossy(&text).into_owned()
}

/// Runs a command, which must succeed; its standard output.
#[track_caller]
pub fn succeed(command: &mut Command) -> String {
    let out = run(command);
    assert!(out.status.success(), "{command:?}:\n{}", said(&out));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

/// The text of a file.
#[track_caller]
pub fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

//! Running the program, and reading what it wrote.

use resolvent_image::Image;
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The program, beside the folder of the tests' executables.
pub fn path() -> PathBuf {
    let exe = std::env::current_exe().unwrap_or_else(|e| panic!("{e}"));
    let folder = exe.parent().and_then(Path::parent);
    let path = folder
        .unwrap_or(Path::new("."))
        .join(format!("resolvent{}", std::env::consts::EXE_SUFFIX));
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

/// The repository.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A scene or volume of the repository.
pub fn scene(name: &str) -> PathBuf {
    repository().join("scenes").join(name)
}

/// A VDB file of the reader's tests.
pub fn vdb(name: &str) -> PathBuf {
    repository().join("formats/vdb/tests/data").join(name)
}

/// A folder of its own for each test, empty.
pub fn folder(test: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("cli")
        .join(test);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    path
}

/// What a run of the program left.
#[derive(Debug)]
pub struct Run {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Run {
    /// Runs the program in `folder`.
    pub fn new<A: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = A>) -> Self {
        let out = Command::new(path())
            .args(args)
            .current_dir(folder)
            .env_remove("RESOLVENT_PLUGIN_PATH")
            .env("RUST_BACKTRACE", "1")
            .output()
            .unwrap_or_else(|e| panic!("{e}"));
        let run = Self {
            code: out.status.code(),
            stdout: String::from_utf8_lossy(&out.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&out.stderr).into_owned(),
        };
        for sign in ["panicked", "backtrace", "internal error"] {
            assert!(!run.stderr.contains(sign), "{run:?}");
        }
        run
    }

    /// The same run, which must have succeeded.
    #[track_caller]
    pub fn done(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:?}");
        self
    }

    /// What it printed as JSON.
    #[track_caller]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}: {self:?}"))
    }
}

/// Renders `input` with further options into a picture, which is returned. Quiet runs must be silent.
#[track_caller]
pub fn render(folder: &Path, input: &Path, name: &str, options: &[&str]) -> Image {
    let mut args = vec![
        OsStr::new("render"),
        input.as_os_str(),
        OsStr::new("--quiet"),
        OsStr::new("-o"),
        OsStr::new(name),
    ];
    args.extend(options.iter().map(OsStr::new));
    let run = Run::new(folder, args).done();
    assert_eq!(run.stderr, "", "a quiet run says nothing");
    picture(&folder.join(name))
}

/// Reads a picture; every value must be finite.
#[track_caller]
pub fn picture(path: &Path) -> Image {
    let image = Image::read_exr(path).unwrap_or_else(|e| panic!("{e}"));
    for layer in &image.layers {
        for c in &layer.channels {
            assert!(
                c.data.iter().all(|v| v.is_finite()),
                "{} {}",
                layer.name,
                c.name
            );
        }
    }
    image
}

/// Every value of a picture, as bits.
pub fn bits(image: &Image) -> Vec<(String, Vec<u32>)> {
    let mut out = Vec::new();
    for layer in &image.layers {
        for c in &layer.channels {
            let values = c.data.iter().map(|v| v.to_bits()).collect();
            out.push((format!("{}.{}", layer.name, c.name), values));
        }
    }
    out
}

/// Mean of red, green and blue.
#[track_caller]
pub fn mean(image: &Image) -> f64 {
    let rgb = image.color().unwrap_or_else(|| panic!("no colour"));
    let sum: f64 = rgb
        .iter()
        .flat_map(|c| c.iter())
        .map(|v| f64::from(*v))
        .sum();
    sum / (3 * image.pixels()) as f64
}

/// Reads JSON.
#[track_caller]
pub fn json(path: &Path) -> Value {
    let text = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_slice(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Writes a scene: that of the repository, changed.
#[track_caller]
pub fn changed(folder: &Path, name: &str, change: impl FnOnce(&mut Value)) -> PathBuf {
    let original = scene(name);
    let mut value = json(&original);
    change(&mut value);
    // Files that the scene names stay where they are.
    let base = original.parent().unwrap_or(Path::new("."));
    if let Some(media) = value.get_mut("media").and_then(Value::as_object_mut) {
        for medium in media.values_mut() {
            if let Some(file) = medium["params"]["file"].as_str() {
                let file = base.join(file);
                medium["params"]["file"] = file.to_string_lossy().into();
            }
        }
    }
    let path = folder.join("scene.json");
    std::fs::write(&path, value.to_string()).unwrap_or_else(|e| panic!("{e}"));
    path
}

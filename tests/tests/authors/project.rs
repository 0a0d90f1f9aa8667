//! A plugin's project in a folder of its own.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// The sources that plugins are built against.
pub fn api() -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/api");
    path.canonicalize()
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A folder outside of the workspace, for this test alone; empty but for what builds leave.
pub fn scratch() -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("authors");
    std::fs::create_dir_all(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    path
}

/// The program, two folders above the tests' executables.
pub fn resolvent() -> Command {
    let exe = std::env::current_exe().unwrap_or_else(|e| panic!("{e}"));
    let folder = exe
        .parent()
        .and_then(Path::parent)
        .unwrap_or(Path::new("."));
    Command::new(folder.join(format!("resolvent{}", std::env::consts::EXE_SUFFIX)))
}

/// Runs a command, which must succeed; its standard output.
#[track_caller]
pub fn run(command: &mut Command) -> String {
    let out = command
        .output()
        .unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let (stdout, stderr) = (
        String::from_utf8_lossy(&out.stdout),
        String::from_utf8_lossy(&out.stderr),
    );
    assert!(out.status.success(), "{command:?}:\n{stdout}\n{stderr}");
    stdout.into_owned()
}

/// A project.
pub struct Project {
    /// Its folder.
    pub folder: PathBuf,
}

impl Project {
    /// Runs cargo, first without the network: what the renderer was built with needs no download. All projects share a target
    /// folder, so `resolvent-api` is built once.
    #[track_caller]
    pub fn cargo(&self, command: &str) {
        self.cargo_with(command, |_| {});
    }

    /// The same with whatever else is to be set.
    #[track_caller]
    pub fn cargo_with(&self, command: &str, set: impl Fn(&mut Command)) {
        static ONE: Mutex<()> = Mutex::new(());
        let _guard = ONE.lock().unwrap_or_else(|e| e.into_inner());
        let target = scratch().join("target");
        std::fs::create_dir_all(&target).unwrap_or_else(|e| panic!("{e}"));
        let here = self.folder.join("target");
        if !here.exists() {
            std::os::unix::fs::symlink(&target, &here).unwrap_or_else(|e| panic!("{e}"));
        }
        let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("../Cargo.lock");
        if let Ok(lock) = std::fs::read(lock) {
            std::fs::write(self.folder.join("Cargo.lock"), lock).unwrap_or_else(|e| panic!("{e}"));
        }
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let at = |more: &[&str]| {
            let mut c = Command::new(&cargo);
            c.args([command, "--release", "--quiet"]).args(more);
            c.current_dir(&self.folder);
            set(&mut c);
            c
        };
        let offline = at(&["--offline"]).output();
        if !offline.is_ok_and(|o| o.status.success()) {
            run(&mut at(&[]));
        }
    }

    /// Runs make.
    #[track_caller]
    pub fn make(&self, arguments: &[&str]) {
        run(Command::new("make")
            .args(arguments)
            .current_dir(&self.folder));
    }

    /// Has the plugin checked.
    #[track_caller]
    pub fn check(&self, library: &str) {
        let mut check = resolvent();
        check.args(["plugin", "check", &format!("./{library}"), "--isolate"]);
        run(check.current_dir(&self.folder));
    }

    /// Renders its scene, in which something is to be seen.
    #[track_caller]
    pub fn render(&self, spp: u32) {
        let picture = self.folder.join("picture.exr");
        let mut render = resolvent();
        render.args([
            "render",
            "scene.json",
            "--quiet",
            "--resolution",
            "96x72",
            "-o",
            "picture.exr",
        ]);
        render.args(["--aov", "variance", "--spp", &spp.to_string()]);
        run(render.current_dir(&self.folder));
        let image = resolvent_image::Image::read_exr(&picture);
        let image = image.unwrap_or_else(|e| panic!("{}: {e}", picture.display()));
        let rgb: Vec<f32> = image
            .color()
            .iter()
            .flatten()
            .copied()
            .flatten()
            .copied()
            .collect();
        let mean = rgb.iter().sum::<f32>() / rgb.len() as f32;
        let spread = rgb.iter().map(|v| (v - mean).abs()).sum::<f32>() / rgb.len() as f32;
        assert!(
            rgb.iter().all(|v| v.is_finite()) && mean > 0.01,
            "mean {mean}"
        );
        assert!(
            spread > 0.05 * mean,
            "nothing to be seen: {spread} around {mean}"
        );
    }
}

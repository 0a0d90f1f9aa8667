//! `render --watch`.

use crate::program::{bits, folder, path, picture, repository, vdb};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A running `render --watch scene.json` in a folder.
struct Watch {
    at: PathBuf,
    child: Child,
    lines: Receiver<String>,
    said: Vec<String>,
}

impl Watch {
    fn start(at: &Path) -> Self {
        let mut child = Command::new(path())
            .args(["render", "--watch", "scene.json", "-o", "out.exr"])
            .current_dir(at)
            .env_remove("RESOLVENT_PLUGIN_PATH")
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|e| panic!("{e}"));
        let stderr = child.stderr.take().unwrap_or_else(|| panic!("no stderr"));
        let (send, lines) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                drop(send.send(line));
            }
        });
        Self {
            at: at.to_path_buf(),
            child,
            lines,
            said: vec![],
        }
    }

    /// Waits for a line with these words.
    #[track_caller]
    fn says(&mut self, words: &str) -> String {
        loop {
            match self.lines.recv_timeout(Duration::from_secs(60)) {
                Ok(line) => {
                    self.said.push(line.clone());
                    if line.contains(words) {
                        return line;
                    }
                }
                Err(_) => panic!("no \"{words}\" in:\n{}", self.said.join("\n")),
            }
        }
    }

    /// The picture once it has been written, which is none of the `earlier` ones.
    #[track_caller]
    fn next(&mut self, earlier: &mut Vec<Bits>) {
        self.says("wrote out.exr");
        self.says("watching");
        let new = self.picture();
        assert!(
            !earlier.contains(&new),
            "nothing new:\n{}",
            self.said.join("\n")
        );
        earlier.push(new);
    }

    /// An error with these words leaves the last picture.
    #[track_caller]
    fn fails(&mut self, words: &str, pictures: &[Bits]) {
        self.says(words);
        self.says("no picture was written");
        assert_eq!(Some(&self.picture()), pictures.last());
    }

    /// Lets it get into the middle of a render.
    fn works(&self) {
        std::thread::sleep(Duration::from_millis(1500));
    }

    fn picture(&self) -> Bits {
        bits(&picture(&self.at.join("out.exr")))
    }

    fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        let kill = Command::new("kill").args([name, &id]).status();
        assert!(kill.is_ok_and(|k| k.success()));
    }

    fn file(&self, name: &str) -> PathBuf {
        self.at.join(name)
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

type Bits = Vec<(String, Vec<u32>)>;

fn write(path: &Path, content: impl AsRef<[u8]>) {
    std::fs::write(path, content).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

/// As editors do who want nothing to be lost: another file takes the name.
fn replace(path: &Path, content: impl AsRef<[u8]>) {
    let new = path.with_extension("new");
    write(&new, content);
    std::fs::rename(&new, path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

/// The bytes of the phase function of the conformance tests, with or without a mistake.
fn phase(at: &Path, mistake: Option<&str>) -> Vec<u8> {
    let library = at.join("built.so");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/broken/phase.c");
    let out = Command::new("cc")
        .args(["-std=c11", "-O1", "-shared", "-fPIC", "-I"])
        .arg(repository().join("core/api/include"))
        .args(mistake.map(|m| format!("-D{m}")))
        .args([&fixtures, Path::new("-o"), &library, Path::new("-lm")])
        .output()
        .unwrap_or_else(|e| panic!("cc: {e}"));
    assert!(
        out.status.success(),
        "{}",
        String::from_utf8_lossy(&out.stderr)
    );
    let bytes = std::fs::read(&library).unwrap_or_else(|e| panic!("{e}"));
    std::fs::remove_file(&library).unwrap_or_else(|e| panic!("{e}"));
    bytes
}

/// A cloud of the file `cloud.vdb` with the phase function of the library `phase.so`.
fn scene(sigma_t: f64, spp: u32) -> Value {
    json!({
        "resolvent": 1,
        "camera": {"type": "perspective", "origin": [0, 0, -15], "target": [0, 0, 0], "fov_x_deg": 40},
        "film": {"resolution": [16, 16]},
        "sampling": {"spp": spp},
        "lights": [{"type": "distant", "to_light": [1, 1, 0], "irradiance": 3}],
        "media": {"cloud": {"plugin": "vdb", "params": {
            "file": "cloud.vdb", "sigma_t": sigma_t, "phase": {"plugin": "./phase.so"}}}}
    })
}

#[test]
fn renders_after_every_change() {
    let at = folder("watch");
    let read = |name| std::fs::read(vdb(name)).unwrap_or_else(|e| panic!("{e}"));
    let (cloud, other) = (
        read("real/smoke_000002.vdb"),
        read("real/densityAndHeat.vdb"),
    );
    write(&at.join("scene.json"), scene(1.0, 4).to_string());
    write(&at.join("cloud.vdb"), &cloud);
    let mut w = Watch::start(&at);
    let mut pictures = Vec::new();

    // What is named and not there is waited for.
    w.says("phase.so");
    w.says("no picture was written");
    write(&w.file("phase.so"), phase(&at, None));
    w.next(&mut pictures);

    // The scene: edited, broken off in the middle, repaired.
    replace(&w.file("scene.json"), scene(2.0, 4).to_string());
    w.next(&mut pictures);
    let text = scene(3.0, 4).to_string();
    write(&w.file("scene.json"), &text[..text.len() / 2]);
    w.fails("error: scene.json:1:", &pictures);
    write(&w.file("scene.json"), &text);
    w.next(&mut pictures);

    // A file that it names, half of it first.
    write(&w.file("cloud.vdb"), &other[..other.len() / 2]);
    w.fails("cloud.vdb", &pictures);
    write(&w.file("cloud.vdb"), &other);
    w.next(&mut pictures);

    // A plugin: overwritten in its place, replaced, crashing, repaired.
    write(&w.file("phase.so"), phase(&at, Some("BRIGHT")));
    w.next(&mut pictures);
    replace(&w.file("phase.so"), phase(&at, Some("ONE_WAY")));
    w.next(&mut pictures);
    let cut = phase(&at, None);
    write(&w.file("phase.so"), &cut[..cut.len() / 2]);
    w.fails("bytes at its end are missing", &pictures);
    write(&w.file("phase.so"), phase(&at, Some("CRASHES")));
    w.fails("it crashes: SIGSEGV", &pictures);
    write(&w.file("phase.so"), phase(&at, Some("WEIGHT")));
    w.next(&mut pictures);

    // A render that would take hours ends with the next change, and leaves no picture; a plugin that is overwritten while it is in use
    // harms nothing.
    write(&w.file("scene.json"), scene(4.0, 8_000_000).to_string());
    w.says("scene.json has changed");
    w.works();
    write(&w.file("phase.so"), phase(&at, Some("REVERSE")));
    w.says("phase.so has changed");
    w.works();
    assert_eq!(Some(&w.picture()), pictures.last());
    write(&w.file("scene.json"), scene(5.0, 4).to_string());
    w.next(&mut pictures);

    // Ctrl-C ends it, also in the middle of a render, and nothing is left over.
    write(&w.file("scene.json"), scene(4.0, 8_000_000).to_string());
    w.says("scene.json has changed");
    w.works();
    w.signal("-INT");
    let status = w.child.wait().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(status.code(), Some(0), "{}", w.said.join("\n"));
    assert_eq!(Some(&w.picture()), pictures.last());
    let mut left: Vec<_> = std::fs::read_dir(&at)
        .unwrap_or_else(|e| panic!("{e}"))
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    left.sort();
    assert_eq!(left, ["cloud.vdb", "out.exr", "phase.so", "scene.json"]);
}

/// What no change of a file can mend ends it.
#[test]
fn wrong_usage_is_not_waited_with() {
    let at = folder("watch_usage");
    write(&at.join("scene.json"), scene(1.0, 4).to_string());
    for (more, words) in [
        (
            &["scene.json", "-o", "out.txt"][..],
            "cannot tell the format",
        ),
        (&["nothing.json"], "nothing.json"),
        (&["scene.json", "--checkpoint", "c"], "cannot be used with"),
        (
            &["scene.json", "--plugin-path", "none"],
            "there is no such folder",
        ),
    ] {
        let args = ["render", "--watch"].iter().chain(more);
        let run = crate::program::Run::new(&at, args);
        assert!(run.code == Some(2) && run.stderr.contains(words), "{run:?}");
    }
}

//! Ctrl-C, and paths without end.

use crate::program::{Run, folder, path, picture, scene};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

/// Sends a signal to a process.
pub fn signal(name: &str, pid: u32) {
    let status = Command::new("kill")
        .args([name, &pid.to_string()])
        .status()
        .unwrap_or_else(|e| panic!("{e}"));
    assert!(status.success());
}

/// Renders for hours, is interrupted once it has reported progress, and saves what is finished.
#[test]
fn the_finished_part_is_saved() {
    let at = folder("interrupt");
    for name in ["-INT", "-TERM"] {
        let mut child = Command::new(path())
            .arg("render")
            .arg(scene("bench/cloud_sun.json"))
            .args([
                "--resolution",
                "32x32",
                "--spp",
                "8000000",
                "--threads",
                "2",
            ])
            .args([
                "-o", "out.exr", "-o", "out.png", "--stats", "s.json", "--aov", "samples",
            ])
            .current_dir(&at)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|e| panic!("{e}"));
        let stderr = child.stderr.take().unwrap_or_else(|| panic!("no stderr"));
        let mut lines = BufReader::new(stderr).lines().map_while(Result::ok);
        let first = lines.find(|l| l.contains(" spp"));
        assert!(first.is_some(), "it reports progress");
        signal(name, child.id());
        let rest: Vec<String> = lines.collect();
        let status = child.wait().unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(status.code(), Some(3), "{rest:?}");
        let text = rest.join("\n");
        assert!(text.contains("stopping and saving"), "{text}");
        assert!(
            text.contains("interrupted; what was finished is saved in out.exr, out.png"),
            "{text}"
        );

        let image = picture(&at.join("out.exr"));
        let samples = image.channel("samples", "N").unwrap_or_default();
        assert!(
            samples.iter().all(|n| *n >= 16.0 && *n < 8e6),
            "{samples:?}"
        );
        assert_eq!(
            image.metadata.get("interrupted").map(String::as_str),
            Some("true")
        );
        assert!(at.join("out.png").is_file());
        let stats = crate::program::json(&at.join("s.json"));
        assert_eq!(stats["sampling"]["interrupted"], true);
        let taken: f64 = samples.iter().map(|n| f64::from(*n)).sum();
        assert_eq!(stats["sampling"]["samples"].as_f64(), Some(taken));
    }
}

/// In the middle of a medium that absorbs nothing and is a million free paths thick a path has no end worth waiting for: neither
/// Ctrl-C nor the end of the time do, and integrators that keep paths say so.
#[test]
fn paths_without_end_are_left() {
    let at = folder("endless");
    let scene = r#"{
        "resolvent": 1,
        "camera": { "type": "perspective", "origin": [0, 0, 5], "target": [0, 0, 0], "fov_x_deg": 40 },
        "film": { "resolution": [8, 8] },
        "lights": [{ "type": "environment", "radiance": 1 }],
        "media": { "milk": { "plugin": "homogeneous", "params": { "sigma_t": 1, "albedo": 1, "radius": 1e6 } } }
    }"#;
    std::fs::write(at.join("s.json"), scene).unwrap_or_else(|e| panic!("{e}"));
    let start = std::time::Instant::now();
    let run = Run::new(&at, ["render", "s.json", "-o", "a.exr", "--time", "0.2"]);
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stderr.contains("the time was over"), "{run:?}");
    let options = ["render", "s.json", "-o", "a.exr", "--integrator", "bdpt"];
    let run = Run::new(&at, options);
    assert_eq!(run.code, Some(2), "{run:?}");
    assert!(run.stderr.contains("max_depth"), "{run:?}");
    let mut child = Command::new(path())
        .args(["render", "s.json", "-o", "a.exr"])
        .current_dir(&at)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|e| panic!("{e}"));
    let stderr = child.stderr.take().unwrap_or_else(|| panic!("no stderr"));
    std::thread::sleep(std::time::Duration::from_millis(500));
    signal("-INT", child.id());
    let text: Vec<String> = BufReader::new(stderr)
        .lines()
        .map_while(Result::ok)
        .collect();
    let status = child.wait().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(status.code(), Some(1), "{text:?}");
    assert!(text.join(" ").contains("nothing is saved"), "{text:?}");
    assert!(!at.join("a.exr").exists());
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
}

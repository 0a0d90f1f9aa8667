//! Ctrl-C.

use crate::program::{folder, path, picture, scene};
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

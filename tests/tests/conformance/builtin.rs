//! Every plugin of this repository.

use super::program::{check, package, resolvent};
use serde_json::Value;

/// Parameters that some need to be anything at all.
pub fn params(kind: &str, name: &str) -> Option<String> {
    Some(match (kind, name) {
        ("bsdf", "conductor") => r#"{"metal": "Au"}"#.into(),
        ("phase", "tabulated") => r#"{"at": [-1, 0, 1], "values": [0.2, 0.1, 1]}"#.into(),
        ("medium", "homogeneous") => {
            r#"{"sigma_t": [1.5, 1, 0.5], "bounds": [-1, -1, -1, 1, 1, 1]}"#.into()
        }
        ("medium", "procedural") => r#"{"bounds": [-1, -1, -1, 1, 1, 1]}"#.into(),
        ("medium", "vdb") => {
            let file = package().join("../formats/vdb/tests/data/cloud_s.vdb");
            format!(r#"{{"file": "{}", "sigma_t": 20}}"#, file.display())
        }
        _ => return None,
    })
}

/// Checks every second plugin that the program finds beside itself.
fn conform(part: usize) {
    let out = resolvent().args(["plugin", "list", "--json"]).output();
    let out = out.unwrap_or_else(|e| panic!("{e}"));
    let list: Value = serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{e}"));
    let all = list["plugins"].as_array().map_or(&[][..], |a| a);
    assert!(all.len() >= 21, "only {} plugins", all.len());
    for p in all.iter().skip(part).step_by(2) {
        let text = |key: &str| p[key].as_str().unwrap_or_default();
        let given = params(text("kind"), text("name"));
        let more: Vec<&str> = given.iter().flat_map(|p| ["--params", p]).collect();
        let report = check(text("path"), &more);
        let broken = report.broken();
        assert!(
            report.code == Some(0) && broken.is_empty() && report.json["conforms"] == true,
            "{} {}: {broken:?} {}\n{}",
            text("kind"),
            text("name"),
            broken
                .first()
                .map_or_else(String::new, |b| report.failure(b)),
            report.stderr
        );
    }
}

#[test]
fn one_half_conforms() {
    conform(0);
}

#[test]
fn the_other_half_conforms() {
    conform(1);
}

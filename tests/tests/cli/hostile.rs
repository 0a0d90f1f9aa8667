//! Damaged files: the corpus through the program.

use crate::program::{Run, folder, json, vdb};

/// What must not be read ends in exit code 2 and one sentence that names the file; everything else in that or in a picture.
#[test]
fn every_file_of_the_corpus_ends_in_order() {
    let at = folder("hostile");
    let manifest = json(&vdb("corpus/manifest.json"));
    let mut counts = [0usize; 2];
    let mut refused = 0;
    for (name, expect) in entries(&manifest) {
        let path = vdb("corpus").join(&name);
        let path = path.to_string_lossy();
        let shot = [
            "--spp",
            "1",
            "--resolution",
            "8x8",
            "-o",
            "out.exr",
            "--quiet",
        ];
        let run = Run::new(&at, [&["render", &path], &shot[..]].concat());
        match run.code {
            Some(0) => counts[0] += 1,
            Some(2) => {
                counts[1] += 1;
                let errors: Vec<_> = run
                    .stderr
                    .lines()
                    .filter(|l| l.starts_with("error: "))
                    .collect();
                assert!(errors.len() == 1 && errors[0].contains(&name), "{run:?}");
                assert!(errors[0].len() < 500, "{run:?}");
            }
            _ => panic!("{name}: {run:?}"),
        }
        let run = Run::new(&at, ["info", &path, "--json"]);
        assert!(matches!(run.code, Some(0 | 2)), "{name}: {run:?}");
        if expect == "error" {
            let grids = if run.code == Some(0) {
                run.json()["grids"].clone()
            } else {
                json_list()
            };
            let grids = grids.as_array().cloned().unwrap_or_default();
            let told = run.code == Some(2)
                || run.json()["damage"].is_string()
                || grids.iter().any(|g| g["refused"].is_string());
            assert!(told, "{name}: {run:?}");
            refused += 1;
        }
    }
    assert!(
        counts[0] > 50 && counts[1] > 20 && refused > 20,
        "{counts:?} {refused}"
    );
}

fn json_list() -> serde_json::Value {
    serde_json::Value::Array(Vec::new())
}

/// Names and expectations in the manifest.
fn entries(manifest: &serde_json::Value) -> Vec<(String, String)> {
    let text = |v: &serde_json::Value, k: &str| v[k].as_str().unwrap_or_default().to_owned();
    let files = manifest.as_array().into_iter().flatten();
    files
        .map(|f| (text(f, "file"), text(f, "expect")))
        .collect()
}

//! `resolvent bench`.

use crate::program::{Run, folder, json};

#[test]
fn smoke() {
    let at = folder("bench");
    let run = Run::new(&at, ["bench", "--smoke", "--quiet", "-o", "b"]);
    run.done();
    let b = json(&at.join("b.json"));
    let scenes = b["scenes"].as_array().map_or(0, Vec::len);
    assert_eq!(scenes, 3, "{b:#}");
    for s in b["scenes"].as_array().into_iter().flatten() {
        let fit = &s["renderers"][0]["fit"];
        assert!(fit["efficiency"].as_f64() > Some(1.0), "{s:#}");
        // The mean agrees with the reference within five standard errors and half a per cent.
        let [off, error] = [0, 1].map(|k| fit["mean_off"][k].as_f64().unwrap_or(f64::NAN));
        assert!(off.abs() < 5.0 * error + 0.005, "{s:#}");
    }
    for form in ["md", "svg", "png"] {
        let size = std::fs::metadata(at.join(format!("b.{form}"))).map_or(0, |m| m.len());
        assert!(size > 1000, "b.{form} has {size} bytes");
    }
    // Against itself nothing is worse.
    let same = resolvent_bench::compare::compare(&b, &b);
    assert!(same.iter().all(|r| !r.worse()));
}

#[test]
fn mistakes_are_named() {
    let at = folder("bench-errors");
    std::fs::write(at.join("other.json"), "{}").unwrap_or_else(|e| panic!("{e}"));
    for (args, word) in [
        (&["--scene", "clod_sun"][..], "cloud_sun"),
        (&["--against", "arnold"], "mitsuba"),
        (
            &["--against", "mitsuba", "--python", "/nowhere/python"],
            "/nowhere/python",
        ),
        (&["--compare", "other.json"], "other.json"),
        (&["--compare", "none.json"], "none.json"),
        (&["--root", "."], "scenes/bench"),
        (&["-o", "no/such/folder/x"], "no/such/folder"),
        (&["--only-scaling", "--series", "sizes"], "voxels"),
    ] {
        let run = Run::new(&at, [&["bench", "--smoke", "--quiet"], args].concat());
        assert!(matches!(run.code, Some(1 | 2)), "{run:?}");
        assert!(run.stderr.contains(word), "{args:?}: {run:?}");
    }
}

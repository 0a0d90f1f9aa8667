//! Parameters that do not fit their declarations, and what arrives of those that do.

use crate::build;
use crate::drive::{fault, says, scene};
use serde_json::{Value, json};

fn with(params: Value) -> Value {
    let mut s = scene();
    s["media"]["cloud"] = json!({ "plugin": "unruly", "params": params });
    s
}

#[test]
fn what_does_not_fit_is_refused_with_its_place() {
    let at = "$.media.cloud.params.";
    for (params, place, words) in [
        (
            json!({ "colr": 1 }),
            "colr",
            &[
                "medium unruly has no parameter \"colr\"",
                "did you mean \"colour\"?",
            ][..],
        ),
        (
            json!({ "sigma_q": 1 }),
            "sigma_q",
            &["has no parameter \"sigma_q\""],
        ),
        (
            json!({ "flag": 1 }),
            "flag",
            &["\"flag\" of medium unruly: expected true or false, found 1"],
        ),
        (
            json!({ "count": 2.5 }),
            "count",
            &["expected a whole number", "found 2.5"],
        ),
        (json!({ "count": 10 }), "count", &["[1", "9]", "found 10"]),
        (
            json!({ "count": "3" }),
            "count",
            &["expected a whole number", "found \"3\""],
        ),
        (
            json!({ "density": 0 }),
            "density",
            &["expected a number", "(1/length)", "found 0"],
        ),
        (
            json!({ "density": 1 }),
            "density",
            &["expected a number", "found 1"],
        ),
        (
            json!({ "density": [0.5] }),
            "density",
            &["expected a number", "found a list of 1"],
        ),
        (
            json!({ "colour": [1, 2] }),
            "colour",
            &["three of them (RGB)", "found a list of 2"],
        ),
        (
            json!({ "colour": [1, -2, 1] }),
            "colour",
            &["expected a number", "found a list of 3"],
        ),
        (json!({ "axis": 1 }), "axis", &["expected three numbers"]),
        (
            json!({ "table": 1 }),
            "table",
            &["expected a list of numbers"],
        ),
        (
            json!({ "table": [1, "2"] }),
            "table",
            &["expected a list of numbers"],
        ),
        (
            json!({ "table": [1, -2] }),
            "table",
            &["expected a list of numbers"],
        ),
        (json!({ "mode": 3 }), "mode", &["expected a text, found 3"]),
        (
            json!({ "file": "" }),
            "file",
            &["expected the path of a file"],
        ),
        (
            json!({ "shape": "rond" }),
            "shape",
            &["one of \"round\", \"square\"", "did you mean \"round\"?"],
        ),
        (
            json!({ "phase": 0.5 }),
            "phase",
            &["expected a phase plugin"],
        ),
        (
            json!({ "phase": "isotropik" }),
            "phase",
            &["no phase plugin 'isotropik'", "did you mean 'isotropic'?"],
        ),
        (
            json!({ "phase": "diffuse" }),
            "phase",
            &["there is no phase plugin 'diffuse'"],
        ),
        (
            json!({ "phase": { "plugin": "hg", "params": { "g": 2 } } }),
            "phase.params.g",
            &["\"g\" of phase hg: expected a number", "found 2"],
        ),
        (
            json!({ "phase": { "plugin": "hg", "params": { "G": 0 } } }),
            "phase.params.G",
            &["phase hg has no parameter \"G\"; did you mean \"g\"?"],
        ),
    ] {
        let f = fault(&with(params));
        says(&f.text, &["fixtures/test.json:", &format!("{at}{place}: ")]);
        says(&f.text, words);
    }
}

#[test]
fn a_nested_plugin_of_another_kind() {
    let f = fault(&with(
        json!({ "phase": { "plugin": build::unruly("medium") } }),
    ));
    let wrong = "is a plugin of the kind medium where one of the kind phase is needed";
    says(&f.text, &["$.media.cloud.params.phase: ", wrong]);
}

#[test]
fn what_is_missing() {
    let mut s = scene();
    s["media"]["veil"] = json!({ "plugin": build::wedge(), "params": {} });
    says(
        &fault(&s).text,
        &[
            "$.media.veil: ",
            "medium wedge needs the parameter \"sigma_t\": mean extinction",
        ],
    );
}

/// All problems of a block at once, each in a line of its own.
#[test]
fn several_problems() {
    let f = fault(&with(json!({ "flag": 1, "colr": 1, "axis": 1 })));
    assert_eq!(f.text.lines().count(), 3, "{}", f.text);
    assert!(
        f.text
            .lines()
            .all(|l| l.contains("test.json:") && l.contains("$.media.cloud.params."))
    );
}

/// With nothing else in the scene, it is placed relative to the camera at x = 0.5.
#[test]
fn defaults_arrive() {
    says(
        &fault(&with(json!({ "mode": "tell" }))).text,
        &[
            "flag=true count=3 density=0.5 colour=Some([0.25, 0.5, 0.75]) axis=None table=None file=None \
             shape=Some(\"round\") phase=false lanes=3 x0=-0.5",
        ],
    );
}

#[test]
fn values_arrive() {
    let mut s = with(json!({
        "mode": "tell", "flag": false, "count": 9, "density": 0.125, "colour": 2, "axis": [1, 2, 3], "table": [5, 6, 7, 8],
        "file": "sub/data.bin", "shape": "square", "phase": "isotropic"
    }));
    s["media"]["cloud"]["transform"] = json!([{ "translate": [4, 0, 0] }]);
    // Placed relative to the middle of the scene, which reaches from −5 to 4.
    s["materials"]["paint"] = json!({ "plugin": "diffuse" });
    s["shapes"] =
        json!([{ "type": "sphere", "center": [-4, 0, 0], "radius": 1, "material": "paint" }]);
    let file = build::package().join("fixtures/sub/data.bin");
    says(
        &fault(&s).text,
        &[
            "flag=false count=9 density=0.125 colour=Some([2.0, 2.0, 2.0]) axis=Some([1.0, 2.0, 3.0]) \
             table=Some([5.0, 6.0, 7.0, 8.0])",
            &format!("file=Some({:?})", file.display().to_string()),
            "shape=Some(\"square\") phase=true lanes=3 x0=4.5",
        ],
    );
}

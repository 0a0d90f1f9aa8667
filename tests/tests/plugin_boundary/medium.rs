//! Media that break the rules.

use crate::build;
use crate::drive::{blames, cloud, describe, fault, picture, registry, says};
use resolvent_api::math::Vec3;
use resolvent_api::{Affine, PluginKind, Segment};
use resolvent_engine::plugin::{ForeignMedium, Message, set_log};
use serde_json::json;
use std::sync::Mutex;

/// The unruly medium itself is fine: what follows is about its modes.
#[test]
fn without_a_mode_it_renders() {
    let p = picture(&cloud("none"), &registry(), 32).unwrap_or_else(|f| panic!("{}", f.text));
    assert!(p.counters.collisions > 10_000 && p.counters.nulls > 1000);
    assert_eq!(p.counters.violations, 0);
    assert!(p.pixels.iter().flatten().all(|v| *v > 0.0 && v.is_finite()));
}

/// Wrong before the first ray: the place in the scene is named as well.
#[test]
fn broken_when_made() {
    let library = build::unruly("medium");
    for (mode, words) in [
        (
            "create panics",
            &["panicked at ", "lib.rs:", "unruly as asked: create panics"][..],
        ),
        ("create fails", &["the wick is wet"]),
        (
            "a task panics",
            &[
                "panicked at ",
                "unruly as asked: task 2",
                "in a parallel task",
            ],
        ),
        ("a panic panics again", &["panicked at ", "(no message)"]),
        (
            "info panics",
            &["panicked at ", "unruly as asked: info panics"],
        ),
        (
            "bounds are NaN",
            &["impossible bounds or extinction", "NaN"],
        ),
        (
            "extinction is infinite",
            &["impossible bounds or extinction", "inf"],
        ),
        (
            "extinction is negative",
            &["impossible bounds or extinction", "-1"],
        ),
    ] {
        let f = fault(&cloud(mode));
        blames(&f.text, "medium", &library, words);
        says(&f.text, &["test.json:", "$.media.cloud"]);
        assert!(f.kept.is_none());
    }
    let f = fault(&cloud("bounds are infinite"));
    says(
        &f.text,
        &[
            "$.media.cloud",
            "the medium 'cloud' has no bounds of its own",
        ],
    );
}

/// Wrong on the way: plugin and medium are named.
#[test]
fn broken_on_the_way() {
    let library = build::unruly("medium");
    let impossible = &["gave an impossible flight", "Segment"][..];
    for (mode, words) in [
        (
            "sample panics",
            &["panicked at ", "unruly as asked: sample panics"][..],
        ),
        (
            "a collision panics",
            &["panicked at ", "unruly as asked: a collision panics"],
        ),
        (
            "transmit panics",
            &["panicked at ", "unruly as asked: transmit panics"],
        ),
        ("value is NaN", impossible),
        ("one lane is NaN", impossible),
        ("ratio is NaN", impossible),
        ("t is NaN", impossible),
        ("t is beyond", impossible),
        ("t is before", impossible),
        ("emits infinitely", impossible),
        ("sigma_s is NaN", impossible),
        ("event is unknown", impossible),
        ("phase is unknown", impossible),
        ("transmittance is NaN", impossible),
    ] {
        let f = fault(&cloud(mode));
        blames(&f.text, "medium", &library, words);
        says(&f.text, &["of the medium 'cloud'"]);
    }
}

/// Two media, one of them unruly: the right one is blamed, also where flights are replayed.
#[test]
fn the_right_medium_is_blamed() {
    let mut s = cloud("none");
    s["media"]["innocent"] = json!({
        "plugin": "homogeneous", "params": { "sigma_t": 1, "bounds": [0, 0, 0, 1, 1, 1] }
    });
    s["media"]["culprit"] = json!({ "plugin": "unruly", "params": { "mode": "transmit panics" } });
    let f = fault(&s);
    blames(
        &f.text,
        "medium",
        &build::unruly("medium"),
        &["of the medium 'culprit'"],
    );
}

/// Functions that no integrator here calls are guarded like the others.
#[test]
fn calls_outside_a_render() {
    let registry = registry();
    let medium = |mode: &str| {
        let described = describe(&cloud(mode)).unwrap_or_else(|e| panic!("{e}"));
        let block = &described.media["cloud"].block;
        registry
            .instantiate(PluginKind::Medium, block, &described, &Affine::IDENTITY, 3)
            .and_then(ForeignMedium::new)
            .unwrap_or_else(|e| panic!("{e}"))
    };
    let s = Segment {
        o: [0.5, 0.5, -1.0],
        t0: 0.0,
        d: [0.0, 0.0, 1.0],
        t1: 9.0,
    };
    let good = medium("none");
    assert_eq!(good.depth(&s).map_err(|f| f.0).unwrap_or_default()[0], 1.5);
    let at = |m: &ForeignMedium| m.coefficients(Vec3::splat(0.5)).map_err(|f| f.0);
    assert_eq!(at(&good).unwrap_or_default().sigma_t[2], 2.0);
    for (mode, word) in [
        ("depth panics", "unruly as asked: depth"),
        ("depth is NaN", "is NaN"),
    ] {
        let why = medium(mode).depth(&s).map_err(|f| f.0).unwrap_err();
        says(&why, &[word]);
    }
    says(
        &at(&medium("coefficients panic")).unwrap_err(),
        &["unruly as asked: coefficients"],
    );
}

/// Extinction above its majorant makes no error, but is counted: a picture that may be wrong.
#[test]
fn a_majorant_that_is_too_small_is_counted() {
    let p = picture(&cloud("majorant too small"), &registry(), 32);
    let p = p.unwrap_or_else(|f| panic!("{}", f.text));
    assert!(p.counters.violations > 1000, "{}", p.counters.violations);
    assert!(p.pixels.iter().flatten().all(|v| v.is_finite()));
}

/// The picture is done when instances end, so a panic there is a warning.
#[test]
fn a_panic_at_the_end_is_a_warning() {
    static HEARD: Mutex<Vec<String>> = Mutex::new(Vec::new());
    set_log(|m| {
        if let (Message::Warning(text), Ok(mut heard)) = (m, HEARD.lock()) {
            heard.push(text);
        }
    });
    let p = picture(&cloud("destroy panics"), &registry(), 16);
    assert!(p.is_ok_and(|p| p.samples == 16));
    let heard = HEARD.lock().unwrap_or_else(|e| e.into_inner());
    let found = heard
        .iter()
        .find(|t| t.contains("unruly as asked: destroy panics"));
    let text = found.unwrap_or_else(|| panic!("only {heard:?}"));
    blames(text, "medium", &build::unruly("medium"), &["panicked at "]);
}

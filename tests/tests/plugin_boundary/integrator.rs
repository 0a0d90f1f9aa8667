//! Integrators that break the rules.

use crate::build;
use crate::drive::{blames, fault, picture, registry, says, walk};

#[test]
fn without_a_mode_it_renders() {
    let p = picture(&walk("none"), &registry(), 32).unwrap_or_else(|f| panic!("{}", f.text));
    assert!(p.pixels.iter().flatten().all(|v| *v == 1.0));
}

#[test]
fn broken() {
    let library = build::unruly("integrator");
    for (mode, words) in [
        (
            "create panics",
            &["$.integrator", "panicked at ", "unruly as asked: create"][..],
        ),
        ("create fails", &["$.integrator", "the path is overgrown"]),
        (
            "render panics",
            &["panicked at ", "unruly as asked: render"],
        ),
        ("fails without a word", &["failed without saying why"]),
        ("fails with a reason", &["the thread is lost"]),
        ("adds beyond its tile", &["which is not in its tile"]),
        ("adds far away", &["which is not in its tile"]),
    ] {
        let f = fault(&walk(mode));
        blames(&f.text, "integrator", &library, words);
        assert!(f.kept.is_none());
    }
}

/// Layers that an integrator knows nothing of are not left black.
#[test]
fn layers_by_order_are_not_faked() {
    let mut s = walk("none");
    s["film"]["aovs"] = serde_json::json!(["orders:2"]);
    let f = fault(&s);
    let words = ["does not tell light by scattering order"];
    blames(&f.text, "integrator", &build::unruly("integrator"), &words);
    assert!(f.kept.is_none());
}

/// Layers that leave out some of the light, or have more.
#[test]
fn layers_by_order_must_sum_to_the_picture() {
    for mode in ["forgets an order", "counts an order twice"] {
        let mut s = walk(mode);
        s["film"]["aovs"] = serde_json::json!(["orders:2"]);
        let words = ["told of the light 1 by scattering order, but its sum is"];
        let f = fault(&s);
        blames(&f.text, "integrator", &build::unruly("integrator"), &words);
    }
}

/// What was finished before stays.
#[test]
fn earlier_passes_are_kept() {
    let f = fault(&walk("a later pass panics"));
    blames(
        &f.text,
        "integrator",
        &build::unruly("integrator"),
        &["unruly as asked: later"],
    );
    let kept = f.kept.unwrap_or_else(|| panic!("nothing was kept"));
    assert!(kept.samples > 0 && kept.samples < 32, "{}", kept.samples);
    assert!(kept.pixels.iter().flatten().all(|v| *v == 1.0));
}

/// Samples that are not finite, or beyond what the film can hold, end the render with the first of them.
#[test]
fn samples_that_are_not_finite() {
    for mode in [
        "radiance is NaN",
        "radiance is infinite",
        "radiance is enormous",
        "alpha is NaN",
    ] {
        let words = [
            "gave sample 1 of pixel (",
            "not finite or more than a film can hold",
        ];
        blames(
            &fault(&walk(mode)).text,
            "integrator",
            &build::unruly("integrator"),
            &words,
        );
    }
}

/// A medium is no integrator.
#[test]
fn of_another_kind() {
    let mut s = walk("none");
    s["integrator"]["plugin"] = build::unruly("medium").display().to_string().into();
    let f = fault(&s);
    says(
        &f.text,
        &[
            "$.integrator",
            "is a plugin of the kind medium where one of the kind integrator is needed",
        ],
    );
}

//! Phase functions and BSDFs that break the rules.

use crate::build;
use crate::drive::{blames, fault, haze, picture, registry, says, wall};
use serde_json::json;

#[test]
fn without_a_mode_they_render() {
    for scene in [haze("none"), wall("none")] {
        let p = picture(&scene, &registry(), 32).unwrap_or_else(|f| panic!("{}", f.text));
        assert!(p.pixels.iter().flatten().all(|v| *v > 0.0 && v.is_finite()));
    }
}

#[test]
fn phase_functions() {
    let library = build::unruly("phase");
    for (mode, words) in [
        (
            "create panics",
            &["$.media.haze", "unruly as asked: create panics"][..],
        ),
        ("create fails", &["$.media.haze", "the mirror is misted"]),
        (
            "closure panics",
            &["medium 'haze'", "unruly as asked: closure"],
        ),
        ("eval panics", &["medium 'haze'", "panicked in eval"]),
        ("sample panics", &["medium 'haze'", "panicked in sample"]),
        (
            "eval is NaN",
            &["medium 'haze'", "eval gave a value that is not finite"],
        ),
        (
            "density is NaN",
            &["medium 'haze'", "eval gave a value that is not finite"],
        ),
        (
            "sample is NaN",
            &["medium 'haze'", "sample gave a value that is not finite"],
        ),
        (
            "direction is NaN",
            &["medium 'haze'", "sample gave a value that is not finite"],
        ),
    ] {
        blames(&fault(&haze(mode)).text, "phase", &library, words);
    }
}

#[test]
fn bsdfs() {
    let library = build::unruly("bsdf");
    for (mode, words) in [
        (
            "create panics",
            &["$.materials.plaster", "unruly as asked: create panics"][..],
        ),
        ("create fails", &["$.materials.plaster", "the paint is dry"]),
        (
            "traits panic",
            &["$.materials.plaster", "unruly as asked: traits"],
        ),
        (
            "closure panics",
            &["material 'plaster'", "unruly as asked: closure"],
        ),
        ("eval panics", &["material 'plaster'", "panicked in eval"]),
        (
            "sample panics",
            &["material 'plaster'", "panicked in sample"],
        ),
        (
            "eval is NaN",
            &["material 'plaster'", "eval gave a value that is not finite"],
        ),
        (
            "sample is NaN",
            &[
                "material 'plaster'",
                "sample gave a value that is not finite",
            ],
        ),
    ] {
        blames(&fault(&wall(mode)).text, "bsdf", &library, words);
    }
}

/// A closure's `lobes` has no way to say that it failed; the render must end all the same.
#[test]
fn lobes_that_panic() {
    let f = fault(&wall("lobes panic"));
    says(
        &f.text,
        &[
            "a closure of 'unruly' panicked at bsdf/src/lib.rs:",
            "unruly as asked: lobes",
        ],
    );
}

/// A reverse density that is not the one of the opposite direction makes weights wrong that no picture shows: integrators that
/// recompute their paths find it, and say where.
#[test]
fn a_wrong_reverse_density_is_found() {
    for (integrator, params) in [
        ("bdpt", json!({ "verify": true })),
        ("bdpt", json!({ "verify": true, "media_weights": "depth" })),
        ("mlt", json!({ "verify": true })),
    ] {
        let corner = |mode: &str| {
            let mut s = wall(mode);
            let mut second = s["shapes"][0].clone();
            second["edge_u"] = json!([0, 0, -1]);
            s["shapes"].as_array_mut().unwrap().push(second);
            s["lights"] = json!([{ "type": "rectangle", "corner": [0.2, 0.4, -0.9], "edge_u": [0, 0.2, 0],
                                   "edge_v": [0.2, 0, 0], "radiance": 3, "two_sided": true }]);
            s["integrator"] = json!({ "plugin": integrator, "params": params });
            s
        };
        picture(&corner("none"), &registry(), 32).unwrap_or_else(|f| panic!("{}", f.text));
        let text = fault(&corner("reverse density is wrong")).text;
        let words = [
            "verify: strategy (s ",
            "the path x0 ",
            "the density of x",
            "recomputed",
        ];
        says(&text, &words);
        assert!(text.contains(&format!("'{integrator}'")), "{text}");
    }
}

//! Phase functions and BSDFs that break the rules.

use crate::build;
use crate::drive::{blames, fault, haze, picture, registry, says, wall};

#[test]
fn without_a_mode_they_render() {
    for scene in [haze("none"), wall("none")] {
        let p = picture(&scene, &registry(), 32).unwrap_or_else(|f| panic!("{}", f.text));
        assert_eq!(p.counters.rejected, 0);
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

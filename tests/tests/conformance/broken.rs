//! Plugins with one mistake each, and the check that finds it.

use super::program::{check, library};

/// Without a mistake the fixture conforms; with each, the named property fails, in a process of its own, and the program goes on.
fn caught(kind: &str, mistakes: &[(&str, &str)]) {
    let report = check(&library(kind, None).display().to_string(), &[]);
    let broken = report.broken();
    assert!(
        report.code == Some(0) && broken.is_empty(),
        "{kind} without a mistake: {broken:?} {}\n{}",
        broken
            .first()
            .map_or_else(String::new, |b| report.failure(b)),
        report.stderr
    );
    for (mistake, property) in mistakes {
        let path = library(kind, Some(mistake)).display().to_string();
        let report = check(&path, &["--isolate", "--patience", "300"]);
        let broken = report.broken();
        assert!(
            report.code == Some(1) && broken.contains(property),
            "{kind} with {mistake}: {property} is not among {broken:?} (code {:?})\n{}",
            report.code,
            report.stderr
        );
        assert!(
            report.stderr.contains("does not conform"),
            "{}",
            report.stderr
        );
        assert!(!report.failure(property).is_empty());
    }
}

#[test]
fn phase_functions() {
    caught(
        "phase",
        &[
            ("SAMPLING", "sampling"),
            ("DENSITY", "normalisation"),
            ("BRIGHT", "energy"),
            ("REVERSE", "adjoint"),
            ("MODES", "adjoint"),
            ("ONE_WAY", "reciprocity"),
            ("WEIGHT", "weights"),
            ("LONG", "weights"),
            ("NAN_AT_POLE", "edges"),
            ("FAILS", "failures"),
            ("COUNTS", "determinism"),
            ("RACE", "threads"),
            ("LEAKS", "instances"),
            ("SHARED", "instances"),
            ("DEFAULT_OUTSIDE", "parameters"),
            ("WIDE_RANGE", "parameters"),
        ],
    );
}

#[test]
fn bsdfs() {
    caught(
        "bsdf",
        &[
            ("BRIGHT", "energy"),
            ("TWO_FACED", "reciprocity"),
            ("UNIFORM_HEMISPHERE", "sampling"),
            ("MIRROR", "weights"),
            ("STRIPES", "facts"),
            ("NO_END", "parameters"),
        ],
    );
}

/// What is not reciprocal and says so conforms.
#[test]
fn a_declared_exception() {
    let report = check(
        &library("bsdf", Some("DECLARED")).display().to_string(),
        &[],
    );
    assert!(
        report.code == Some(0),
        "{:?} {}",
        report.broken(),
        report.stderr
    );
}

#[test]
fn media() {
    caught(
        "medium",
        &[
            ("LOW_MAJORANT", "majorant"),
            ("LOW_MAXIMUM", "majorant"),
            ("FLIGHT", "free flight"),
            ("TRANSMITTANCE", "transmittance"),
            ("OWN_RANDOM", "replay"),
            ("PREFIX", "prefix"),
            ("GLOWS", "emission"),
            ("OUTSIDE", "facts"),
            ("SCATTERS_MORE", "energy"),
            ("FORGETS", "edges"),
        ],
    );
}

#[test]
fn integrators() {
    caught(
        "integrator",
        &[
            ("OWN_RANDOM", "determinism"),
            ("NOT_FINITE", "failures"),
            ("BRIGHT", "energy"),
            ("BRIGHTENS", "energy"),
            ("REPEATS", "samples"),
            ("FIRST", "prefix"),
            ("FEW", "failures"),
        ],
    );
}

/// What ends the process is the plugin's fault in the report, with the signal and what was being checked.
#[test]
fn crashes() {
    for (mistake, how) in [
        ("CRASHES", "SIGSEGV"),
        ("TWICE", "SIGABRT"),
        ("HANGS", "hangs"),
    ] {
        let path = library("phase", Some(mistake)).display().to_string();
        let report = check(&path, &["--isolate", "--patience", "5"]);
        assert_eq!(
            report.broken(),
            ["survival"],
            "{mistake}: {}",
            report.stderr
        );
        let text = report.failure("survival");
        assert!(
            text.contains(how) && text.contains("while checking"),
            "{text}"
        );
        assert_eq!(report.code, Some(1));
    }
}

//! Whatever the bytes are: a scene or an error, never a panic, a hang or much memory.

mod common;

use std::time::Instant;

use common::FULL;
use proptest::prelude::*;
use resolvent_scene::Scene;

fn message(text: &[u8]) -> String {
    Scene::parse(text, "x.json")
        .expect_err("accepted")
        .to_string()
}

#[test]
fn deep_nesting() {
    for open in ["[", "{\"a\":"] {
        let error = message(open.repeat(1_000_000).as_bytes());
        assert!(error.contains("nested more than 64 deep"), "{error}");
    }
}

#[test]
fn long_texts_and_numbers() {
    let start = Instant::now();
    let long = "x".repeat(60 << 20);
    for text in [
        format!("\"{long}\""),
        format!("{{\"{long}\": 1}}"),
        format!("{{\"resolvent\": \"{long}\"}}"),
        format!("\"{long}"),
    ] {
        let error = message(text.as_bytes());
        assert!(error.len() < 2000, "{} bytes of error", error.len());
    }
    let digits = "1".repeat(1 << 20);
    let number = format!("{{\"resolvent\": 1, \"camera\": {digits}}}");
    assert!(message(number.as_bytes()).len() < 2000);
    assert!(message(&vec![b' '; 65 << 20]).contains("64 MiB"));
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
}

#[test]
fn many_values_on_one_line() {
    let start = Instant::now();
    let params: String = (0..150_000)
        .map(|i| format!("\"p{i}\": {{\"plugin\": \"x\"}}, "))
        .collect();
    let text = |params: &str| {
        FULL.replace("\"max_depth\": 12", &format!("{params}\"max_depth\": 12"))
            .replace('\n', " ")
    };
    let error = message(text(&params).as_bytes());
    assert!(
        error.contains("more than 200000 plugin parameters"),
        "{error}"
    );
    let fewer: String = (0..90_000).map(|i| format!("\"p{i}\": 1, ")).collect();
    let scene = Scene::parse(text(&fewer).as_bytes(), "x.json").unwrap();
    assert_eq!(scene.integrator.params.len(), 90_001);
    // Each of many shapes names a material that is not there, and there are many to compare with.
    let materials: String = (0..20_000)
        .map(|i| format!("\"material{i}\": {{\"plugin\": \"x\"}}, "))
        .collect();
    let shapes = "{\"type\": \"ply\", \"file\": \"x\", \"material\": \"matrial\"}, ".repeat(20_000);
    let text = FULL
        .replace(
            "\"floor\": {\"plugin\"",
            &format!("{materials} \"floor\": {{\"plugin\""),
        )
        .replace(
            "{\"type\": \"sphere\"",
            &format!("{shapes}{{\"type\": \"sphere\""),
        );
    assert!(message(text.as_bytes()).contains("did you mean \"material"));
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
}

#[test]
fn every_truncation_is_an_error() {
    for end in 0..FULL.trim_end().len() {
        assert!(
            Scene::parse(&FULL.as_bytes()[..end], "x.json").is_err(),
            "{end}"
        );
    }
}

/// Pieces that make interesting mutants.
const PIECES: [&str; 24] = [
    "{",
    "}",
    "[",
    "]",
    "\"",
    ",",
    ":",
    "null",
    "true",
    "-",
    "1e308",
    "-1e308",
    "0",
    "1e-320",
    "18446744073709551616",
    "\\u",
    "\\ud800",
    "\"type\"",
    "\"plugin\"",
    "\"transform\"",
    "[{\"scale\": 0}]",
    "[1, 2, 3]",
    "\u{0}",
    "☁",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mutants_do_not_panic(edits in prop::collection::vec((0.0..1.0f64, 0usize..20, 0usize..PIECES.len(), any::<u8>()), 1..4)) {
        let mut bytes = FULL.as_bytes().to_vec();
        for (at, remove, piece, byte) in edits {
            let at = (at * bytes.len() as f64) as usize;
            let end = (at + remove).min(bytes.len());
            let insert = if byte < 64 { vec![byte.wrapping_mul(5)] } else { PIECES[piece].as_bytes().to_vec() };
            bytes.splice(at..end, insert);
        }
        match Scene::parse(&bytes, "x.json") {
            // What is accepted can be written and read again.
            Ok(scene) => {
                let again = Scene::parse(scene.to_text().unwrap().as_bytes(), "x.json").unwrap();
                prop_assert_eq!(scene, again);
            }
            Err(error) => {
                prop_assert!(!error.problems().is_empty());
                for p in error.problems() {
                    prop_assert!(p.place.is_known() && !p.what.is_empty());
                }
            }
        }
    }

    #[test]
    fn random_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(Scene::parse(&bytes, "x.json").is_err());
    }

    #[test]
    fn random_values_under_random_keys_do_not_panic(
        line in 3usize..48, value in "\\PC{0,12}|-?[0-9]{1,3}(\\.[0-9]{1,3})?([eE][+-]?[0-9]{1,3})?|\\[[0-9, .-]{0,16}\\]",
    ) {
        let mut lines: Vec<String> = FULL.lines().map(String::from).collect();
        let at = line % lines.len();
        if let Some((key, _)) = lines[at].clone().split_once(':') {
            lines[at] = format!("{key}: {value},");
        }
        let _ = Scene::parse(lines.join("\n").as_bytes(), "x.json");
    }
}

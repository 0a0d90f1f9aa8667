//! Tests of the plugin.

use super::*;
use core::f64::consts::PI;
use resolvent_api::Spectrum;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Density, Measured, check, directions};

/// An instance from the text of a file, which is named after the test.
fn from_file(test: &str, text: &str, abscissa: &str) -> Result<Tabulated, String> {
    let path = std::env::temp_dir().join(format!("tabulated-{test}-{}.txt", std::process::id()));
    std::fs::write(&path, text).unwrap();
    let params = serde_json::json!({ "file": path, "abscissa": abscissa });
    let made = create(&params.to_string());
    std::fs::remove_file(&path).unwrap();
    made
}

fn inline(at: &str, values: &str) -> Result<Tabulated, String> {
    create(&format!(r#"{{ "at": {at}, "values": {values} }}"#))
}

fn value(k: &Tabulated, cos: f64) -> Spectrum {
    let angle = Angle {
        one_minus_cos: (1.0 - cos) as f32,
        one_plus_cos: (1.0 + cos) as f32,
    };
    k.table.value(angle).0
}

/// A lobe of Henyey and Greenstein as a table in degrees, at steps that grow from the peak.
fn lobe_in_degrees(g: f64) -> String {
    let mut text = String::from("# angle  value\n");
    let mut angle = 0.0f64;
    while angle < 180.0 {
        let cos = angle.to_radians().cos();
        let p = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5);
        text += &format!("{angle}\t{p:e}  # a comment\n");
        angle += 0.02 + angle * 0.01;
    }
    text + &format!("\n180, {}\n", (1.0 - g * g) / (1.0 + g).powi(3))
}

#[test]
fn samples_weights_and_energy() {
    let tables = [
        ("two angles", inline("[-1, 1]", "[1, 3]").unwrap()),
        ("constant", inline("[1, -1]", "[7, 7]").unwrap()),
        (
            "zero at an end and inside",
            inline("[-1, -0.5, 0, 0.2, 1]", "[0, 1, 0, 0, 2]").unwrap(),
        ),
        (
            "colours",
            inline(
                "[-1, -0.2, 0.7, 1]",
                "[1, 0.05, 0.2, 0.5, 1, 0.1, 0.02, 2, 0.3, 3, 2, 9]",
            )
            .unwrap(),
        ),
        (
            "steep lobe",
            from_file("steep", &lobe_in_degrees(0.97), "degrees").unwrap(),
        ),
    ];
    let mut suite = Suite::new();
    for (name, k) in &tables {
        let k = k.closure(&MediumPoint::default());
        for wo in directions(2, 41) {
            check(&mut suite, name, &k, Measured::Phase, wo);
            let d = Density::new(&k, Measured::Phase, wo, -wo, Mode::Radiance);
            suite.close(&format!("{name}: norm"), d.total, 1.0, 1e-3, 0.0);
            for (lane, albedo) in d.albedo.iter().enumerate() {
                suite.close(&format!("{name}: lane {lane}"), *albedo, 1.0, 1e-3, 0.0);
            }
        }
    }
    suite.assert();
}

/// The norm and mean cosine of linear pieces in closed form.
#[test]
fn normalised_exactly() {
    let k = inline("[-1, 0.25, 1]", "[0.3, 2, 5, 0, 1, 3, 4, 0, 1]").unwrap();
    for (lane, raw) in [[0.3, 0.0, 4.0], [2.0, 1.0, 0.0], [5.0, 3.0, 1.0]]
        .iter()
        .enumerate()
    {
        let mass = 2.0 * PI * (1.25 * 0.5 * (raw[0] + raw[1]) + 0.75 * 0.5 * (raw[1] + raw[2]));
        for (cos, raw) in [-1.0, 0.25, 1.0].iter().zip(raw) {
            let p = f64::from(value(&k, *cos)[lane]);
            assert!((p - raw / mass).abs() < 1e-7, "lane {lane}, {cos}: {p}");
        }
        let middle = f64::from(value(&k, -0.375)[lane]);
        assert!((middle - 0.5 * (raw[0] + raw[1]) / mass).abs() < 1e-7);
    }
}

/// The distribution function at a sampled angle, summed from linear pieces in `f64`, gives back `u`.
#[test]
fn inversion_is_exact() {
    let at = [1.0, 1.0 - 1e-9, 0.999, 0.4, 0.39999, -0.6, -1.0];
    let raw = [1e9, 2e3, 3.0, 3.0, 0.0, 0.5, 0.0];
    let k = inline(&format!("{at:?}"), &format!("{raw:?}")).unwrap();
    let width = |i: usize| at[i] - at[i + 1];
    let mass: f64 = (0..6).map(|i| width(i) * 0.5 * (raw[i] + raw[i + 1])).sum();
    for u in [1e-7f32, 0.1, 0.19, 0.2, 0.5, 0.77, 0.9, 0.999, 0.9999999] {
        let (angle, _, p) = k.table.sample(u).unwrap();
        let x = if angle.one_minus_cos < 1.0 {
            f64::from(angle.one_minus_cos)
        } else {
            2.0 - f64::from(angle.one_plus_cos)
        };
        let below: f64 = (0..6)
            .map(|i| {
                let t = ((x - (1.0 - at[i])) / width(i)).clamp(0.0, 1.0);
                width(i) * t * (raw[i] + 0.5 * t * (raw[i + 1] - raw[i]))
            })
            .sum();
        // The nodes' values and x itself are rounded to `f32`.
        let slack = 3e-7 + 1.2e-7 * 2.0 * PI * f64::from(p) * x.min(2.0 - x);
        assert!(
            (below / mass - f64::from(u)).abs() < slack,
            "u {u}: 1 - cos {x}, distribution {}",
            below / mass
        );
    }
}

/// A fine table comes out as the function that it was made from.
#[test]
fn follows_the_function_it_holds() {
    let g = 0.97;
    let k = from_file("fine", &lobe_in_degrees(g), "degrees").unwrap();
    for degrees in [0.0f64, 0.01, 0.3, 2.0, 30.0, 90.0, 179.0, 180.0] {
        let cos = degrees.to_radians().cos();
        let exact = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cos).powf(1.5) / (4.0 * PI);
        let p = f64::from(value(&k, cos)[0]);
        assert!((p / exact - 1.0).abs() < 1e-3, "{degrees}: {p} {exact}");
    }
}

/// Grey tables leave the throughput as it is, to the last bit; order and unit don't matter.
#[test]
fn grey_weights_are_one() {
    let a = inline("[-1, 0.1, 0.3, 1]", "[0.7, 0.1, 0.37, 1.9]").unwrap();
    let b = inline("[1, 0.3, 0.1, -1]", "[19e200, 3.7e200, 1e200, 7e200]").unwrap();
    for i in 0..1000 {
        let u = ScatterDraws {
            lobe: 0.0,
            dir: [i as f32 / 1000.0, 0.3],
        };
        let (sample, other) = (Tabled(&a.table), Tabled(&b.table));
        let sample = sample.sample(Vec3::Y, u, Mode::Radiance).unwrap();
        assert_eq!(sample.weight, Spectrum::ONE);
        let other = other.sample(Vec3::Y, u, Mode::Radiance).unwrap();
        assert!((Vec3::from(sample.wi) - Vec3::from(other.wi)).length() < 1e-5);
    }
}

#[test]
fn faults_name_file_and_line() {
    for (name, text, abscissa, expected) in [
        (
            "word",
            "-1 1\n0 x\n1 1",
            "cosine",
            "line 2: 'x' is no number",
        ),
        (
            "three",
            "-1 1 2\n1 1 2",
            "cosine",
            "line 1: an angle and one value or three",
        ),
        ("five", "-1 1 2 3 4\n", "cosine", "line 1: more than"),
        (
            "mixed",
            "-1 1\n\n# c\n1 1 2 3",
            "cosine",
            "line 4: 4 numbers, but",
        ),
        (
            "range",
            "-1 1\n1.01 1",
            "cosine",
            "line 2: the angle 1.01 is outside of -1 to 1",
        ),
        (
            "degrees",
            "-1 1\n1 1",
            "degrees",
            "line 1: the angle -1 is outside of 0 to 180",
        ),
        (
            "order",
            "-1 1\n0.5 1\n0.4 2\n1 1",
            "cosine",
            "line 3: angles must rise or fall",
        ),
        (
            "twice",
            "0 1\n90 1\n90 2\n180 1",
            "degrees",
            "line 3: angles must rise or fall",
        ),
        (
            "first",
            "-1 1\n-1 1\n1 1",
            "cosine",
            "line 2: angles must rise or fall",
        ),
        (
            "negative",
            "-1 1\n1 -0.5",
            "cosine",
            "line 2: the value -0.5",
        ),
        ("nan", "-1 1\n1 nan", "cosine", "line 2: the value NaN"),
        ("infinite", "-1 inf\n1 1", "cosine", "line 1: the value inf"),
        (
            "short",
            "-1 1\n0.9 1",
            "cosine",
            "must reach from cosine -1 to 1",
        ),
        ("one", "-1 1", "cosine", "a table of 1 angles"),
        ("empty", "# nothing\n", "cosine", "a table of 0 angles"),
        (
            "zero",
            "0 1 0 1\n180 1 0 1\n",
            "degrees",
            "second channel is zero",
        ),
    ] {
        let error = from_file(name, text, abscissa).unwrap_err();
        assert!(error.contains(expected), "{name}: {error}");
        if expected.starts_with("line") {
            assert!(error.contains(&format!("tabulated-{name}-")), "{error}");
        }
    }
    for (at, values, expected) in [
        (
            "[-1, 1]",
            "[1, 2, 3]",
            "'values' has 3 numbers for the 2 of 'at'",
        ),
        (
            "[-1, 0.5, 0.2, 1]",
            "[1, 2, 3, 4]",
            "'at' [2]: angles must rise",
        ),
        ("[]", "[]", "a table of 0 angles"),
    ] {
        let error = inline(at, values).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
    let missing = create::<Tabulated>(r#"{ "file": "/nowhere/table.txt" }"#).unwrap_err();
    assert!(
        missing.contains("cannot read '/nowhere/table.txt'"),
        "{missing}"
    );
    let endless = create::<Tabulated>(r#"{ "file": "/dev/zero" }"#).unwrap_err();
    assert!(endless.contains("64 MiB"), "{endless}");
    for both in [
        r#"{}"#,
        r#"{ "at": [-1, 1] }"#,
        r#"{ "file": "a", "at": [-1, 1], "values": [1, 1] }"#,
    ] {
        let error = create::<Tabulated>(both).unwrap_err();
        assert!(error.contains("'file', or else by 'at'"), "{error}");
    }
    // A solid angle of 10⁻⁶³ sr takes all: the density there is beyond `f32`.
    let needle = from_file("needle", "0 1\n1e-30 0\n180 0\n", "degrees").unwrap_err();
    assert!(needle.contains("too narrow"), "{needle}");
}

//! Tests of the plugin.

use super::*;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Density, Measured, check, directions};

fn two(g1: f64, g2: f64, weight: f64) -> TwoLobes {
    create(&format!(
        r#"{{ "g1": {g1}, "g2": {g2}, "weight": {weight} }}"#
    ))
    .unwrap()
}

#[test]
fn samples_weights_and_energy() {
    let mut suite = Suite::new();
    for (g1, g2, w) in [
        (0.85, -0.3, 0.9),
        (0.95, -0.95, 0.5),
        (0.0, 0.7, 0.25),
        (0.999, 0.2, 0.7),
        (-0.6, 0.6, 0.0),
        (-0.6, 0.6, 1.0),
    ] {
        let k = two(g1, g2, w);
        for wo in directions(2, 17) {
            let name = format!("two-lobe-hg {g1} {g2} {w}");
            check(&mut suite, &name, &k, Measured::Phase, wo);
            let d = Density::new(&k, Measured::Phase, wo, -wo, Mode::Radiance);
            suite.close(&format!("{name}: norm"), d.total, 1.0, 1e-4, 0.0);
            let g = w * g1 + (1.0 - w) * g2;
            suite.close(&format!("{name}: g"), d.mean_cosine, g, 1e-4, 2e-5);
        }
    }
    suite.assert();
}

#[test]
fn defaults_and_ranges() {
    let k: TwoLobes = create("{}").unwrap();
    assert_eq!(k.weight, 0.9);
    for bad in [
        r#"{ "g1": 1 }"#,
        r#"{ "g2": -1 }"#,
        r#"{ "weight": 1.01 }"#,
        r#"{ "weight": -0.01 }"#,
    ] {
        assert!(create::<TwoLobes>(bad).is_err(), "{bad}");
    }
}

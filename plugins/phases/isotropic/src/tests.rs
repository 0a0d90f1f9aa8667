//! Tests of the plugin.

use super::*;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Density, Measured, check, directions};

#[test]
fn samples_weights_and_energy() {
    let k: Isotropic = create("{}").unwrap();
    let mut suite = Suite::new();
    for wo in directions(3, 3) {
        check(&mut suite, "isotropic", &k, Measured::Phase, wo);
        let d = Density::new(&k, Measured::Phase, wo, -wo, Mode::Radiance);
        suite.close("norm", d.total, 1.0, 1e-6, 0.0);
        suite.close("mean cosine", d.mean_cosine, 0.0, 0.0, 1e-6);
    }
    suite.assert();
}

#[test]
fn takes_no_parameters() {
    assert!(create::<Isotropic>(r#"{ "g": 0 }"#).is_err());
}

//! Tests of the plugin.

use super::*;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Density, Measured, check, directions};

#[test]
fn samples_weights_and_energy() {
    let k: Diffuse = create(r#"{ "reflectance": [0.8, 1, 0.25] }"#).unwrap();
    let mut suite = Suite::new();
    // Both sides, and grazing.
    let mut all = directions(3, 23);
    all.extend([
        Vec3::Z,
        Vec3::NEG_Z,
        Vec3::new(0.999_95, 0.0, -0.01).normalize(),
    ]);
    for wo in all {
        check(&mut suite, "diffuse", &k, Measured::Bsdf, wo);
        let d = Density::new(&k, Measured::Bsdf, wo, Vec3::Z, Mode::Radiance);
        suite.close("norm", d.total, 1.0, 1e-5, 0.0);
        for (lane, rho) in [0.8, 1.0, 0.25].into_iter().enumerate() {
            suite.close("albedo", d.albedo[lane], rho, 1e-5, 0.0);
        }
    }
    suite.assert();
}

#[test]
fn nothing_comes_through() {
    let k: Diffuse = create("{}").unwrap();
    assert_eq!(k.reflectance.to_rgb(), [0.5; 3]);
    let (up, down) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, -0.8));
    assert_eq!(k.eval(up, down, Mode::Radiance), ScatterEval::default());
    assert_eq!(k.eval(down, up, Mode::Radiance), ScatterEval::default());
    assert!(
        k.sample(Vec3::X, ScatterDraws::default(), Mode::Radiance)
            .is_none()
    );
}

#[test]
fn black_ends_walks_and_says_so() {
    let k: Diffuse = create(r#"{ "reflectance": 0 }"#).unwrap();
    assert_eq!(k.lobes(), 0);
    assert!(
        k.sample(Vec3::Z, ScatterDraws::default(), Mode::Radiance)
            .is_none()
    );
    assert_eq!(k.eval(Vec3::Z, Vec3::Z, Mode::Radiance).forward, 0.0);
    assert!(create::<Diffuse>(r#"{ "reflectance": 1.1 }"#).is_err());
    assert!(create::<Diffuse>(r#"{ "reflectance": [0.5, -0.1, 0.5] }"#).is_err());
}

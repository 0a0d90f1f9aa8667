//! Tests of the plugin.

use super::*;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Density, Measured, check, directions};

fn lambert(params: &str) -> Lambert {
    let bsdf: Diffuse = create(params).unwrap();
    assert_eq!(bsdf.traits(), bsdf_traits::UNIFORM);
    bsdf.closure(&SurfacePoint::default())
}

/// A texture is asked for at every point, and closures keep what it said.
#[test]
fn reflectance_follows_a_texture() {
    let bsdf: Diffuse = create(r#"{ "reflectance": { "texture": "uv" } }"#).unwrap();
    assert_eq!(bsdf.traits(), 0);
    for uv in [[0.25, 0.75], [0.0, 1.0]] {
        let at = SurfacePoint {
            uv,
            ..SurfacePoint::default()
        };
        let k = bsdf.closure(&at);
        assert_eq!(k.reflectance.to_rgb(), [uv[0], uv[1], 0.0]);
        assert_eq!(k.reflectance[3], 0.0);
    }
}

#[test]
fn samples_weights_and_energy() {
    let k = lambert(r#"{ "reflectance": [0.8, 1, 0.25] }"#);
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
    let k = lambert("{}");
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
    let k = lambert(r#"{ "reflectance": 0 }"#);
    assert_eq!(k.lobes(), 0);
    assert!(
        k.sample(Vec3::Z, ScatterDraws::default(), Mode::Radiance)
            .is_none()
    );
    assert_eq!(k.eval(Vec3::Z, Vec3::Z, Mode::Radiance).forward, 0.0);
    assert!(create::<Diffuse>(r#"{ "reflectance": 1.1 }"#).is_err());
    assert!(create::<Diffuse>(r#"{ "reflectance": [0.5, -0.1, 0.5] }"#).is_err());
}

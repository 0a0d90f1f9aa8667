//! Tests of the plugin.

use super::*;
use resolvent_api::operator::lobes;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Density, Measured, check, directions};

fn hg(g: f64) -> HenyeyGreenstein {
    create(&format!(r#"{{ "g": {g} }}"#)).unwrap()
}

/// p in `f64` from the textbook form, whose cancellation is harmless at this precision.
fn exact(g: f64, cos: f64) -> f64 {
    (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
}

/// cos θ at `u` in `f64` from the textbook form.
fn exact_cos(g: f64, u: f64) -> f64 {
    let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
    (1.0 + g * g - s * s) / (2.0 * g)
}

#[test]
fn samples_weights_and_energy() {
    let mut suite = Suite::new();
    for g in [-0.95, -0.3, 0.0, 1e-6, 0.5, 0.85, 0.99, 0.999] {
        for wo in directions(2, 11) {
            check(
                &mut suite,
                &format!("hg, g = {g}"),
                &hg(g),
                Measured::Phase,
                wo,
            );
        }
    }
    suite.assert();
}

#[test]
fn normalised_with_mean_cosine_g() {
    let mut suite = Suite::new();
    for g in [-0.9999, -0.7, -1e-6, 0.0, 0.001, 0.3, 0.9, 0.999, 0.9999] {
        let wo = Vec3::new(0.36, 0.48, 0.8);
        let d = Density::new(&hg(g), Measured::Phase, wo, -wo, Mode::Radiance);
        suite.close(&format!("norm, g = {g}"), d.total, 1.0, 1e-4, 0.0);
        suite.close(
            &format!("mean cosine, g = {g}"),
            d.mean_cosine,
            g,
            1e-4,
            2e-5,
        );
    }
    suite.assert();
}

/// The inverse of the distribution function and the value at the poles and the side, against 10-digit references.
#[test]
fn near_one_and_zero() {
    let u = [0.0, 1e-6, 0.25, 0.5, 0.75, 0.999999, 1.0];
    let table: [(f64, [f64; 7], [f64; 3]); 5] = [
        (
            0.999,
            [
                -1.0,
                -0.9920318864,
                0.9999925165,
                0.9999985005,
                0.999999611,
                1.0,
                1.0,
            ],
            [159075.3656, 5.632606062e-05, 1.991427719e-05],
        ),
        (
            -0.999,
            [
                -1.0,
                -1.0,
                -0.999999611,
                -0.9999985005,
                -0.9999925165,
                0.9920318864,
                1.0,
            ],
            [1.991427719e-05, 5.632606062e-05, 159075.3656],
        ),
        (
            0.9999,
            [
                -1.0,
                -0.9223451009,
                0.999999925,
                0.999999985,
                0.9999999961,
                1.0,
                1.0,
            ],
            [15914698.53, 5.627539695e-06, 1.989635747e-06],
        ),
        (
            0.001,
            [
                -1.0,
                -0.999997994,
                -0.4988742499,
                0.0014999995,
                0.5011242501,
                0.999998006,
                1.0,
            ],
            [0.07981660241, 0.0795772726, 0.07933913646],
        ),
        (
            -1e-6,
            [
                -1.0,
                -0.999998,
                -0.500001125,
                -1.5e-06,
                0.499998875,
                0.999998,
                1.0,
            ],
            [0.07957723281, 0.07957747155, 0.07957771028],
        ),
    ];
    let wo = Vec3::new(0.0, 0.0, -1.0);
    for (g, cos, p) in table {
        let lobe = Lobe::new(g).unwrap();
        for (u, cos) in u.into_iter().zip(cos) {
            // The table is for `u` itself, `f32` has the nearest number to it: at 0.999999 that matters.
            assert!((exact_cos(g, u) - cos).abs() < 1e-9, "g {g}, u {u}");
            let a = lobe.sample(u as f32);
            let near = exact_cos(g, f64::from(u as f32));
            for c in [
                1.0 - f64::from(a.one_minus_cos),
                f64::from(a.one_plus_cos) - 1.0,
            ] {
                assert!((c - near).abs() < 1e-6, "g {g}, u {u}: {a:?}, {near}");
            }
        }
        for (wi, p) in [-wo, Vec3::X, wo].into_iter().zip(p) {
            let value = hg(g).eval(wo, wi, Mode::Radiance);
            assert!(
                (f64::from(value.forward) / p - 1.0).abs() < 1e-5,
                "g {g}: {value:?}, {p}"
            );
        }
    }
}

/// 1 − cos θ keeps its digits: at g = 0.9999 the median deflection is 10⁻⁴ rad, 1 − cos = 1.5·10⁻⁸.
#[test]
fn small_angles_keep_their_digits() {
    for g in [0.9f64, 0.999, 0.9999, 0.999_999] {
        for u in [0.1f32, 0.5, 0.9, 0.999] {
            let v = f64::from(u);
            let d = 1.0 - g + 2.0 * g * v;
            let truth = 2.0 * (1.0 - g).powi(2) * (1.0 - v) * (1.0 + g * v) / (d * d);
            let a = Lobe::new(g).unwrap().sample(u);
            assert!(
                (f64::from(a.one_minus_cos) / truth - 1.0).abs() < 2e-6,
                "g {g}, u {u}"
            );
            if g > 0.9999 {
                // Here the textbook form of p loses its digits even in f64.
                continue;
            }
            let cos = 1.0 - truth;
            let p = Lobe::new(g)
                .unwrap()
                .density(a.one_minus_cos, a.one_plus_cos);
            assert!(
                (f64::from(p) / exact(g, cos) - 1.0).abs() < 1e-4,
                "g {g}, u {u}"
            );
        }
    }
}

/// A walk of 10⁵ events must not shrink or grow its directions.
#[test]
fn directions_stay_unit_over_long_walks() {
    let k = hg(0.999);
    let mut stream = resolvent_api::rng::Stream::new(5);
    let mut wo = Vec3::new(0.6, 0.0, 0.8);
    for _ in 0..100_000 {
        let u = ScatterDraws {
            lobe: stream.uniform(),
            dir: stream.uniform2(),
        };
        wo = -Vec3::from(k.sample(wo, u, Mode::Radiance).unwrap().wi);
        assert!((wo.length_squared() - 1.0).abs() < 1e-6, "{wo}");
    }
}

#[test]
fn ends_of_the_range_are_refused() {
    for g in ["1", "-1", "1.2", "-3", "0.99999999"] {
        let r = create::<HenyeyGreenstein>(&format!(r#"{{ "g": {g} }}"#));
        assert!(r.is_err(), "{g}");
    }
    assert!(Lobe::new(f64::NAN).is_err());
    assert_eq!(hg(0.5).lobes(), lobes::SMOOTH);
}

//! Tests of the plugin.

use super::*;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::quadrature::integrate;
use resolvent_tests::scatter::{Density, Measured, check, directions};

fn rayleigh(depolarization: f64) -> Rayleigh {
    create(&format!(r#"{{ "depolarization": {depolarization} }}"#)).unwrap()
}

/// No particle is more than 6/7, and JSON's decimals stay just below it.
const FACTORS: [f64; 5] = [0.0, 0.028, 0.3, 0.7, 0.857142857142857];

#[test]
fn samples_weights_and_energy() {
    let mut suite = Suite::new();
    for rho in FACTORS {
        let k = rayleigh(rho);
        for wo in directions(2, 23) {
            check(
                &mut suite,
                &format!("rayleigh, rho = {rho}"),
                &k,
                Measured::Phase,
                wo,
            );
            let d = Density::new(&k, Measured::Phase, wo, -wo, Mode::Radiance);
            suite.close(&format!("norm, rho = {rho}"), d.total, 1.0, 1e-6, 0.0);
            suite.close(
                &format!("mean cosine, rho = {rho}"),
                d.mean_cosine,
                0.0,
                0.0,
                1e-6,
            );
        }
    }
    suite.assert();
}

/// The distribution function by quadrature of the textbook form, at the sampled cosine, gives back `u`.
#[test]
fn inversion_is_exact() {
    for rho in FACTORS {
        let gamma = rho / (2.0 - rho);
        let p = |c: f64| {
            3.0 / 8.0 * ((1.0 + 3.0 * gamma) + (1.0 - gamma) * c * c) / (1.0 + 2.0 * gamma)
        };
        for u in [0.0f32, 1e-7, 0.01, 0.25, 0.4999999, 0.5, 0.6, 0.99, 1.0] {
            let c = rayleigh(rho).cosine(u);
            let back = integrate(-1.0, c, 4, p);
            assert!(
                (back - f64::from(u)).abs() < 1e-14,
                "rho {rho}, u {u}: cosine {c}, distribution {back}"
            );
        }
    }
}

/// ρ is the ratio of the intensities polarised in and across the plane of scattering, at a right angle: it follows that the
/// value there over the value forward is (1 + ρ)/2.
#[test]
fn right_angle_shows_the_depolarization() {
    for rho in FACTORS {
        let k = rayleigh(rho);
        let at = |wi| f64::from(k.eval(Vec3::Z, wi, Mode::Radiance).forward);
        let ratio = at(Vec3::X) / at(-Vec3::Z);
        assert!(
            (ratio - 0.5 * (1.0 + rho)).abs() < 1e-6,
            "rho {rho}: {ratio}"
        );
        assert_eq!(at(Vec3::Z), at(-Vec3::Z));
    }
}

#[test]
fn ends_of_the_range_are_refused() {
    for rho in ["-0.001", "0.8572", "1"] {
        let r = create::<Rayleigh>(&format!(r#"{{ "depolarization": {rho} }}"#));
        assert!(r.is_err(), "{rho}");
    }
    assert_eq!(rayleigh(0.0).lobes(), lobes::SMOOTH);
    assert_eq!(create::<Rayleigh>("{}").unwrap().ratio, 1.0);
}

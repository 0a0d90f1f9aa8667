//! Tests of the plugin.

use super::*;
use crate::draine::{cosine, g_of};
use crate::fit::mean_cosine_of_draine;
use core::f64::consts::PI;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::quadrature::integrate;
use resolvent_tests::scatter::{Density, Measured, check, directions};

fn mie(diameter: f64) -> MieApprox {
    create(&format!(r#"{{ "diameter": {diameter} }}"#)).unwrap()
}

/// Draine's lobe in `f64` from the textbook form, times 2π: the density of cos θ.
fn exact(g: f64, alpha: f64, cos: f64) -> f64 {
    let hg = (1.0 - g * g) / (2.0 * (1.0 + g * g - 2.0 * g * cos).powf(1.5));
    hg * (1.0 + alpha * cos * cos) / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0)
}

#[test]
fn samples_weights_and_energy() {
    let mut suite = Suite::new();
    // Both sides of every step between the fit's ranges, and the ends.
    for d in [1e-3, 0.1, 0.11, 1.49, 1.5, 4.99, 5.0, 50.0] {
        let k = mie(d);
        for wo in directions(1, 31) {
            let name = format!("mie-approx, {d} um");
            check(&mut suite, &name, &k, Measured::Phase, wo);
            let density = Density::new(&k, Measured::Phase, wo, -wo, Mode::Radiance);
            suite.close(&format!("{name}: norm"), density.total, 1.0, 1e-5, 0.0);
            let g = Fit::new(d).mean_cosine();
            suite.close(&format!("{name}: g"), density.mean_cosine, g, 1e-5, 2e-6);
        }
    }
    suite.assert();
}

/// The lobe alone, beyond what the fit uses: steep, backward, α = 0 and large.
#[test]
fn draine_inversion_is_exact() {
    for g in [-0.9, -0.3, -1e-7, 0.0, 1e-9, 0.01, 0.55, 0.95] {
        for alpha in [0.0, 1e-6, 1.0, 27.0, 250.0, 1e4] {
            let lobe = Draine::new(g, alpha).unwrap();
            let alpha = f64::from(alpha as f32);
            for u in [0.0f32, 1e-6, 0.1, 0.3, 0.5, 0.62, 0.9, 0.999, 1.0] {
                let a = lobe.sample(u);
                // From the pole that is nearer: its digits are the ones that count.
                let (one_minus, one_plus) = (f64::from(a.one_minus_cos), f64::from(a.one_plus_cos));
                let cos = if one_minus < 1.0 {
                    1.0 - one_minus
                } else {
                    one_plus - 1.0
                };
                let back = integrate(-1.0, cos, 10_000, |c| exact(g, alpha, c));
                // `f32` holds the angle to 6·10⁻⁸ of its distance from the pole.
                let slack = 1.3e-7 * exact(g, alpha, cos) * one_minus.min(one_plus) + 1e-11;
                assert!(
                    (back - f64::from(u)).abs() < slack,
                    "g {g}, alpha {alpha}, u {u}: {a:?}, distribution {back}"
                );
            }
        }
    }
}

#[test]
fn draine_moments_by_quadrature() {
    for g in [-0.8, 0.0, 0.3, 0.62, 0.9] {
        for alpha in [0.0, 1.0, 30.0, 250.0] {
            let lobe = Draine::new(g, alpha).unwrap();
            let p = |c: f64| {
                let (one_minus_cos, one_plus_cos) = ((1.0 - c) as f32, (1.0 + c) as f32);
                2.0 * PI
                    * f64::from(lobe.density(Angle {
                        one_minus_cos,
                        one_plus_cos,
                    }))
            };
            let total = integrate(-1.0, 1.0, 4000, p);
            let mean = integrate(-1.0, 1.0, 4000, |c| c * p(c));
            assert!((total - 1.0).abs() < 1e-6, "{g} {alpha}: {total}");
            let expected = mean_cosine_of_draine(g, alpha);
            assert!((mean - expected).abs() < 1e-6, "{g} {alpha}: {mean}");
        }
    }
}

/// G against quadrature of cos², also where the textbook's form divides by g³.
#[test]
fn closed_form_of_the_distribution() {
    for g in [-0.95, -1e-5, 0.0, 1e-8, 0.2, 0.6, 0.99] {
        for w in [-1.0, -0.4, 0.3, 0.97, 1.0] {
            let q = integrate(0.0, w, 400, |w| cosine(g, w).powi(2));
            assert!(
                (g_of(g, w) - q).abs() < 1e-9,
                "g {g}, w {w}: {} {q}",
                g_of(g, w)
            );
        }
        // The terms of P cancel as D → 0: 10⁻¹⁵ of what D³ divides is left.
        let (total, slack) = (
            g_of(g, 1.0) - g_of(g, -1.0),
            1e-15 / (1.0 - g.abs()).powi(3),
        );
        let expected = 2.0 * (1.0 + 2.0 * g * g) / 3.0;
        assert!(
            (total - expected).abs() < slack,
            "g {g}: {total} {expected}"
        );
    }
}

/// Every diameter gives a phase function; large droplets have the mean cosine of Mie's theory, 0.84 to 0.89 in visible light, and
/// the smallest scatter like molecules.
#[test]
fn fit_is_sound_over_its_range() {
    for i in 0..=2000 {
        let d = 50.0 * (1e-4f64).powf(1.0 - f64::from(i) / 2000.0);
        let f = Fit::new(d);
        assert!(
            (0.0..1.0).contains(&f.g_hg) && f.g_d.abs() < 1.0,
            "{d}: {f:?}"
        );
        assert!((0.0..=1.0).contains(&f.w_d) && f.alpha >= 0.0, "{d}: {f:?}");
        if d >= 5.0 {
            assert!(
                (0.80..0.90).contains(&f.mean_cosine()),
                "{d}: {}",
                f.mean_cosine()
            );
        }
    }
    let k = mie(1e-3);
    for cos in [-1.0f32, -0.5, 0.0, 0.3, 1.0] {
        let sin = (1.0 - cos * cos).sqrt();
        let p = k
            .eval(-Vec3::Z, Vec3::new(sin, 0.0, cos), Mode::Radiance)
            .forward;
        let rayleigh = 3.0 / (16.0 * core::f32::consts::PI) * (1.0 + cos * cos);
        assert!((p / rayleigh - 1.0).abs() < 2e-2, "{cos}: {p}, {rayleigh}");
    }
}

#[test]
fn ends_of_the_range_are_refused() {
    for d in ["0", "-3", "50.001"] {
        let r = create::<MieApprox>(&format!(r#"{{ "diameter": {d} }}"#));
        assert!(r.is_err(), "{d}");
    }
    for alpha in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(Draine::new(0.5, alpha).is_err(), "{alpha}");
    }
    assert!(Draine::new(1.0, 1.0).is_err());
    assert_eq!(mie(10.0).lobes(), lobes::SMOOTH);
}

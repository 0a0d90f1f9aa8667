//! Tests of the plugin.

use super::*;
use resolvent_api::operator::flight_flags;
use resolvent_api::{Affine, Event};
use resolvent_tests::host::{create, create_at};
use resolvent_tests::medium::{March, check, draws, segment};
use resolvent_tests::{Moments, Suite, samples};

fn skewed() -> Affine {
    Affine::from_rows([
        [1.5, 0.4, 0.0, 20.0],
        [-0.3, 1.0, 0.2, -3.0],
        [0.0, 0.1, 2.0, 7.0],
    ])
}

/// Grey, chromatic with a transparent lane, and dense; a box, an ellipsoid and no boundary; with and without emission.
#[test]
fn flights_connections_and_emission() {
    let mut suite = Suite::new();
    let at = Vec3::new(20.0, -3.0, 7.0);
    let through = [
        segment(at + Vec3::new(-3.0, 0.4, 0.2), at, 8.0),
        segment(at, at + Vec3::new(0.2, -0.5, 0.6), 9.0),
        segment(at + Vec3::new(0.1, 0.1, -9.0), at, 9.2),
    ];
    for (name, params) in [
        (
            "grey box",
            r#"{ "sigma_t": 1.2, "albedo": [0.9, 0.5, 0.2], "bounds": [-1, -1, -1, 1, 1, 1], "emission": [1, 0.5, 0] }"#,
        ),
        (
            "chromatic box",
            r#"{ "sigma_t": [0.2, 1, 3], "albedo": [0.9, 0.5, 0.2], "bounds": [-1, -1, -1, 1, 1, 1], "emission": [1, 0.5, 2] }"#,
        ),
        (
            "ellipsoid",
            r#"{ "sigma_a": [0.5, 0, 0.1], "sigma_s": [0.2, 0, 1.5], "center": [0, 0, 0.2], "radius": 1.1, "emission": 0.3 }"#,
        ),
        (
            "unbounded",
            r#"{ "sigma_t": [0.4, 0.1, 0], "emission": [0.1, 0.2, 0.3] }"#,
        ),
        ("dense", r#"{ "sigma_t": [10000, 300, 2], "radius": 1 }"#),
    ] {
        let m: Homogeneous = create_at(params, &skewed()).unwrap();
        check(&mut suite, name, &m, &through, 2e-6);
    }
    suite.assert();
}

/// 2·10⁻⁶ relative down to 10⁻³⁰, also a million units from the origin.
#[test]
fn transmittance_over_twelve_decades() {
    for offset in [0.0, 1e6] {
        let to = Affine::from_translation(DVec3::new(offset, -offset, offset));
        for tau in [1e-6, 1e-4, 0.01, 1.0, 10.0, 69.0, 80.0, 100.0, 1e4, 1e6] {
            // Thickness 0.25 is exact in f32 at 10⁶; the extinction makes up for it.
            let params = format!(
                r#"{{ "sigma_t": {}, "albedo": 0, "bounds": [-4, -4, 0, 4, 4, 0.25] }}"#,
                4.0 * tau
            );
            let m: Homogeneous = create_at(&params, &to).unwrap();
            let s = Segment {
                o: [offset as f32, -offset as f32, offset as f32 - 3.0],
                t0: 0.0,
                d: [0.0, 0.0, 1.0],
                t1: f32::INFINITY,
            };
            let f = m.transmit(&s, &FlightDraws::default());
            // What f32 keeps of the extinction is the medium's true one.
            let truth = (-f64::from((4.0 * tau) as f32) * 0.25).exp();
            let value = f64::from(f.value[0] / f.ratio[0]);
            if truth > 1e-30 {
                assert!(
                    (value / truth - 1.0).abs() < 2e-6,
                    "{tau}: {value}, {truth}"
                );
            } else {
                assert!((0.0..=1e-30).contains(&value), "{tau}: {value}");
            }
        }
    }
}

/// −expm1(−τ), without noise if nothing else is there.
#[test]
fn thin_and_thick_emission() {
    for tau in [1e-6, 1e-4, 0.01, 1.0, 10.0, 80.0, 1e4, 1e6] {
        let params =
            format!(r#"{{ "sigma_a": {tau}, "emission": {tau}, "bounds": [-1, -1, 0, 1, 1, 1] }}"#);
        let m: Homogeneous = create(&params).unwrap();
        let s = segment(Vec3::new(0.0, 0.0, -1.0), Vec3::ZERO, 5.0);
        let expected = -(-f64::from(tau as f32)).exp_m1();
        let u = FlightDraws {
            flags: flight_flags::ALONE,
            ..draws(1, 1, Spectrum::ONE)
        };
        let value = f64::from(m.sample(&s, &u).emitted[0]);
        assert!((value / expected - 1.0).abs() < 1e-6, "{tau}: {value}");
        let noisy = Moments::of((0..samples(100_000)).map(|i| {
            let e = m.sample(&s, &draws(2, i, Spectrum::ONE)).emitted;
            f64::from(e[0])
        }));
        // What is met is min(X, τ) of an exponential X. Its variance is known, while the sample's says nothing where
        // collisions are rare.
        let t = f64::from(tau as f32);
        let variance = if t < 0.01 {
            t * t * t / 3.0
        } else {
            2.0 * (1.0 - (-t).exp() * (1.0 + t)) - expected * expected
        };
        let error = (variance / noisy.count() as f64).sqrt();
        let off = (noisy.mean() - expected).abs();
        assert!(
            off < 4.0 * error + 1e-6 * expected,
            "{tau}: off by {off}, error {error}"
        );
    }
}

/// At τ = 10⁻⁶ collisions must happen once in a million flights, not in multiples of 2⁻²⁴.
#[test]
fn thin_media_collide_at_the_right_rate() {
    let m: Homogeneous = create(r#"{ "sigma_t": 1e-7, "bounds": [0, 0, 0, 1, 1, 1] }"#).unwrap();
    let s = segment(Vec3::new(0.5, 0.5, -1.0), Vec3::new(0.5, 0.5, 0.0), 3.0);
    // Only draws with tau = 0 can collide: continue those, which have a probability of 2⁻²⁴ each.
    let n = samples(200_000);
    let hits = (0..n)
        .filter(|&i| {
            let mut u = draws(3, i, Spectrum::ONE);
            u.tau = if i % 2 == 0 { 0.0 } else { 1.0 / 16_777_216.0 };
            m.sample(&s, &u).collided()
        })
        .count();
    // P(collision | tau among the two lowest steps) = 10⁻⁷/(2·2⁻²⁴).
    let p = 1e-7 * 16_777_216.0 / 2.0;
    let error = (p * (1.0 - p) / n as f64).sqrt();
    let off = hits as f64 / n as f64 - p;
    assert!(
        off.abs() < 4.0 * error,
        "{} instead of {p}",
        hits as f64 / n as f64
    );
}

/// One box cut into touching slabs is the whole box.
#[test]
fn slabs_that_touch_are_one_box() {
    let slab = |a: f64, b: f64| -> Homogeneous {
        create(&format!(
            r#"{{ "sigma_t": 3, "bounds": [0, 0, {a}, 1, 1, {b}] }}"#
        ))
        .unwrap()
    };
    let s = segment(Vec3::new(0.1, 0.3, -1.0), Vec3::new(0.6, 0.5, 0.4), 9.0);
    let whole = slab(0.0, 1.0).depth(&s)[0];
    let cuts = 1000;
    let parts: f64 = (0..cuts)
        .map(|i| {
            let at = |i: i32| f64::from(i) / f64::from(cuts);
            f64::from(slab(at(i), at(i + 1)).depth(&s)[0])
        })
        .sum();
    assert!(
        (parts / f64::from(whole) - 1.0).abs() < 1e-6,
        "{parts}, {whole}"
    );
    let truth = March::new(&slab(0.0, 1.0), &s).depth[0];
    assert!((f64::from(whole) / truth - 1.0).abs() < 1e-6);
}

#[test]
fn facts_follow_the_parameters() {
    let traits = |p: &str| create::<Homogeneous>(p).unwrap().info().traits;
    let base = medium_traits::HOMOGENEOUS | medium_traits::ANALYTIC;
    assert_eq!(traits(r#"{ "sigma_t": 1 }"#), base | medium_traits::GREY);
    assert_eq!(traits(r#"{ "sigma_t": [1, 2, 1] }"#), base);
    assert_eq!(
        traits(r#"{ "sigma_a": 1, "emission": 1 }"#),
        base | medium_traits::GREY | medium_traits::EMISSIVE | medium_traits::ABSORBS_ONLY
    );
    for empty in [
        r#"{ "sigma_t": 0 }"#,
        r#"{ "sigma_t": 1, "bounds": [0, 0, 0, 1, 0, 1] }"#,
        r#"{ "sigma_t": 1, "radius": 0 }"#,
    ] {
        let m = create::<Homogeneous>(empty).unwrap();
        assert!(m.info().traits & medium_traits::EMPTY != 0, "{empty}");
        let s = segment(Vec3::new(0.5, 0.0, -1.0), Vec3::new(0.5, 0.0, 0.0), 3.0);
        let f = m.sample(&s, &draws(1, 2, Spectrum::ONE));
        assert_eq!((f.event, f.value), (Event::Survived as u32, Spectrum::ONE));
    }
    let m: Homogeneous = create(r#"{ "sigma_t": [2, 4, 8], "albedo": 0.5 }"#).unwrap();
    let c = m.coefficients(Vec3::ZERO);
    assert_eq!(c.sigma_s.to_rgb(), [1.0, 2.0, 4.0]);
}

#[test]
fn parameters_that_exclude_each_other_are_refused() {
    for (bad, word) in [
        (r#"{}"#, "sigma_t"),
        (r#"{ "sigma_t": 1, "sigma_a": 1 }"#, "excludes"),
        (r#"{ "sigma_a": 1, "albedo": 0.5 }"#, "albedo"),
        (
            r#"{ "sigma_t": 1, "bounds": [0, 0, 0, 1, 1, 1], "radius": 1 }"#,
            "not both",
        ),
        (
            r#"{ "sigma_t": 1, "bounds": [0, 0, 0, 1, 1] }"#,
            "6 numbers",
        ),
        (r#"{ "sigma_t": 1, "bounds": [0, 0, 2, 1, 1, 1] }"#, "above"),
        (r#"{ "sigma_t": 1, "center": [0, 0, 0] }"#, "radius"),
        (r#"{ "sigma_t": -1 }"#, "range"),
        (r#"{ "sigma_t": 1, "albedo": 1.5 }"#, "range"),
        (r#"{ "sigma_t": 1e39 }"#, "too large"),
    ] {
        let error = create::<Homogeneous>(bad).unwrap_err();
        assert!(error.contains(word), "{bad}: {error}");
    }
    let mut flat = skewed();
    flat.columns[2] = flat.columns[0];
    assert!(create_at::<Homogeneous>(r#"{ "sigma_t": 1, "radius": 1 }"#, &flat).is_err());
}

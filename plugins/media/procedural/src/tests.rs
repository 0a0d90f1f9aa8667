//! Tests of the plugin.

use super::*;
use resolvent_api::Affine;
use resolvent_api::rng::Stream;
use resolvent_tests::Suite;
use resolvent_tests::host::{create, create_at};
use resolvent_tests::medium::{March, check, draws, edges, segment};

fn skewed() -> Affine {
    Affine::from_rows([
        [1.5, 0.4, 0.0, 20.0],
        [-0.3, 1.0, 0.2, -3.0],
        [0.0, 0.1, 2.0, 7.0],
    ])
}

fn through(at: Vec3) -> [Segment; 2] {
    [
        segment(at + Vec3::new(-3.0, 0.4, 0.2), at, 8.0),
        segment(
            at + Vec3::new(0.2, 0.5, 0.1),
            at + Vec3::new(0.1, -0.5, -0.8),
            6.0,
        ),
    ]
}

#[test]
fn clouds() {
    let mut suite = Suite::new();
    for (name, params) in [
        (
            "grey box",
            r#"{ "sigma_t": 3, "albedo": [1, 0.8, 0.3], "bounds": [-1, -0.5, -1, 1, 0.5, 1], "coverage": 0.8 }"#,
        ),
        (
            "ball",
            r#"{ "sigma_t": [1, 4, 9], "radius": 1.2, "octaves": 3, "seed": 7, "coverage": 0.7, "falloff": 0.6 }"#,
        ),
        (
            "sharp",
            r#"{ "sigma_t": [6, 2, 2], "radius": 1, "octaves": 6, "gain": 0.7, "softness": 0.05, "coverage": 0.75, "falloff": 0 }"#,
        ),
    ] {
        let m: Procedural = create_at(params, &skewed()).unwrap();
        check(
            &mut suite,
            name,
            &m,
            &through(Vec3::new(20.0, -3.0, 7.0)),
            2e-4,
        );
    }
    suite.assert();
}

#[test]
fn fog() {
    let mut suite = Suite::new();
    for (name, params) in [
        (
            "fog in a box",
            r#"{ "kind": "height_fog", "sigma_t": 0.5, "albedo": [1, 0.8, 0.3], "bounds": [-2, -1, -2, 2, 1, 2], "scale_height": 0.4 }"#,
        ),
        (
            "fog in a ball",
            r#"{ "kind": "height_fog", "sigma_t": [0.2, 1, 3], "radius": 1.5, "axis": [1, 2, -1], "height": -0.3, "scale_height": 0.7 }"#,
        ),
        (
            "open fog",
            r#"{ "kind": "height_fog", "sigma_t": [0.4, 0.2, 0], "height": -2, "scale_height": 2 }"#,
        ),
    ] {
        let m: Procedural = create_at(params, &skewed()).unwrap();
        check(
            &mut suite,
            name,
            &m,
            &through(Vec3::new(20.0, -3.0, 7.0)),
            1e-5,
        );
    }
    suite.assert();
}

/// Straight up from the ground the optical depth is σ₀ H (1 − exp(−z/H)), along it σ₀ x.
#[test]
fn fog_has_its_textbook_depths() {
    let m: Procedural =
        create(r#"{ "kind": "height_fog", "sigma_t": 0.5, "scale_height": 8, "height": 1 }"#)
            .unwrap();
    let ground = Vec3::new(3.0, 1.0, -2.0);
    let depth = |to: Vec3, t1: f32| {
        let s = segment(ground, ground + to, t1);
        let f = m.transmit(&s, &FlightDraws::default());
        let depth = f64::from(m.depth(&s)[0]);
        assert!((f64::from(f.value[0]) / (-depth).exp() - 1.0).abs() < 1e-5);
        depth
    };
    for z in [1e-4, 0.1, 5.0, 40.0] {
        let expected = -0.5 * 8.0 * f64::exp_m1(-f64::from(z as f32) / 8.0);
        assert!(
            (depth(Vec3::Y, z as f32) / expected - 1.0).abs() < 1e-6,
            "{z}"
        );
        assert!((depth(Vec3::Y, f32::INFINITY) / 4.0 - 1.0).abs() < 1e-6);
    }
    assert!((depth(Vec3::X, 7.0) / 3.5 - 1.0).abs() < 1e-6);
    assert_eq!(depth(Vec3::NEG_Y, 50.0), 0.0);
    assert_eq!(
        m.info().bounds.min,
        [f32::NEG_INFINITY, 1f32.next_down(), f32::NEG_INFINITY]
    );
}

/// The mean of a cloud's approximate depth comes close to the true one, so weights made of it are good.
#[test]
fn approximate_depths_are_near() {
    let m: Procedural = create(r#"{ "sigma_t": 10, "radius": 1, "coverage": 0.8 }"#).unwrap();
    for i in 0..20 {
        let y = -0.5 + 0.05 * i as f32;
        let s = segment(Vec3::new(-2.0, y, 0.1), Vec3::new(0.0, y, 0.0), 4.0);
        let truth = March::new(&m, &s).depth[0];
        let approximate = f64::from(m.depth(&s)[0]);
        assert!(
            (approximate - truth).abs() < 0.05 * truth + 0.05,
            "{approximate}, {truth}"
        );
    }
}

/// The grid's bounds must pay: 3.5 look-ups a collision where a single majorant needs 51, and emptiness costs nothing.
#[test]
fn bounds_are_tight() {
    let m: Procedural = create(r#"{ "sigma_t": 30, "radius": 1 }"#).unwrap();
    let (mut lookups, mut collisions) = (0, 0);
    for i in 0..2000 {
        let y = -0.8 + 1.6 * i as f32 / 2000.0;
        let s = segment(Vec3::new(-2.0, y, 0.1), Vec3::new(0.0, y, 0.0), 4.0);
        let f = m.sample(&s, &draws(1, i, Spectrum::ONE));
        lookups += f.lookups;
        collisions += f.event;
    }
    assert!(collisions > 500, "{collisions}");
    assert!(
        lookups < 4 * collisions,
        "{lookups} look-ups for {collisions} collisions"
    );
    let past = segment(Vec3::new(-2.0, 0.99, 0.99), Vec3::new(0.0, 0.99, 0.99), 4.0);
    assert_eq!(m.sample(&past, &draws(1, 1, Spectrum::ONE)).lookups, 0);
}

/// Majorants hold whatever the parameters are, seen from anywhere.
#[test]
fn no_extinction_above_its_majorant() {
    let mut stream = Stream::new(0xb0);
    let mut suite = Suite::new();
    for seed in 0..if cfg!(debug_assertions) { 3 } else { 40 } {
        let mut u = || f64::from(stream.uniform());
        let shape = if seed % 2 == 0 {
            format!(r#""radius": {}"#, 0.01 + 100.0 * u())
        } else {
            format!(
                r#""bounds": [-1, -2, 0, {}, {}, 50]"#,
                20.0 * u(),
                3.0 * u()
            )
        };
        let params = format!(
            r#"{{ {shape}, "seed": {seed}, "sigma_t": {}, "octaves": {}, "frequency": {}, "lacunarity": {},
                 "gain": {}, "coverage": {}, "softness": {}, "falloff": {} }}"#,
            10.0 * u(),
            1 + (8.0 * u()) as u32,
            0.2 + 9.0 * u(),
            1.0 + 1.5 * u(),
            u(),
            0.4 + 0.6 * u(),
            0.01 + 0.9 * u(),
            u(),
        );
        let m: Procedural = create_at(&params, &skewed()).unwrap();
        edges(&mut suite, &params, &m);
    }
    suite.assert();
}

#[test]
fn parameters() {
    for (bad, word) in [
        (r#"{}"#, "needs 'bounds'"),
        (
            r#"{ "radius": 1, "octaves": 12, "lacunarity": 4 }"#,
            "finest layer",
        ),
        (r#"{ "radius": 1, "octaves": 0 }"#, "range"),
        (r#"{ "radius": 1, "kind": "smoke" }"#, "none of"),
        (r#"{ "kind": "height_fog", "axis": [0, 0, 0] }"#, "axis"),
        (
            r#"{ "kind": "height_fog", "bounds": [0, -1000, 0, 1, 0, 1] }"#,
            "too dense",
        ),
        (
            r#"{ "radius": 1, "sigma_t": [1, 1e9, 1] }"#,
            "optical thickness",
        ),
    ] {
        let error = create::<Procedural>(bad).err().unwrap_or_default();
        assert!(error.contains(word), "{bad}: {error}");
    }
    for empty in [
        r#"{ "radius": 1, "sigma_t": 0 }"#,
        r#"{ "radius": 1, "coverage": 0 }"#,
        r#"{ "radius": 0 }"#,
    ] {
        let m = create::<Procedural>(empty).unwrap();
        assert!(m.info().traits & medium_traits::EMPTY != 0, "{empty}");
    }
}

//! Tests of the plugin.

use super::*;
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Measured, albedo, check_around, directions};

fn surface(params: &str) -> <Conductor as Bsdf>::Closure {
    let plugin: Conductor = create(params).unwrap_or_else(|e| panic!("{params}: {e}"));
    plugin.closure(&SurfacePoint::default())
}

fn at(z: f32, turn: f32) -> Vec3 {
    resolvent_api::math::warp::around_z(z, turn).normalize()
}

/// χ², weights, densities both ways, reciprocity and modes over roughness, anisotropy and side.
#[test]
fn samples_follow_their_density() {
    let mut suite = Suite::new();
    for (params, wo) in [
        (r#"{ "metal": "Au", "roughness": 0.5 }"#, at(0.9, 0.1)),
        (r#"{ "metal": "Cu", "roughness": 0.5 }"#, at(-0.4, 0.3)),
        (r#"{ "metal": "Cr", "roughness": 1 }"#, at(0.7, 0.8)),
        (r#"{ "metal": "Ag", "roughness": 1 }"#, at(0.05, 0.6)),
        (
            r#"{ "metal": "Al", "roughness": 0.7, "anisotropy": 0.6 }"#,
            at(-0.6, 0.2),
        ),
        (
            r#"{ "eta": [0.2, 0.9, 1.1], "k": [3, 2, 2], "roughness": 0.3, "anisotropy": 0.5 }"#,
            at(0.8, 0.45),
        ),
        (
            r#"{ "metal": "W", "roughness": 0.5, "thin_film": 1, "thin_film_thickness": 200, "thin_film_ior": 2.3 }"#,
            at(0.7, 0.45),
        ),
    ] {
        let k = surface(params);
        assert_eq!(k.lobes(), lobes::SMOOTH);
        check_around(&mut suite, params, &k, Measured::Bsdf, wo, Vec3::Z, 0.02);
    }
    // Narrow lobes, with the grid's pole at the mirrored direction.
    for (roughness, z) in [(0.1, 0.8), (0.03, 0.95)] {
        let params = format!(r#"{{ "metal": "Au", "roughness": {roughness} }}"#);
        let wo = at(z, 0.7);
        let mirrored = Vec3::new(-wo.x, -wo.y, wo.z);
        let k = surface(&params);
        check_around(&mut suite, &params, &k, Measured::Bsdf, wo, mirrored, 0.02);
    }
    suite.assert();
}

/// White furnace: what reflects everything loses nothing and makes nothing, at any roughness and angle, to 1 %; strongly
/// anisotropic ones to 1.4 %.
#[test]
fn nothing_is_lost() {
    let mut suite = Suite::new();
    // k so large that F = 1 to six digits.
    let perfect = |roughness: f32, anisotropy: f32| {
        surface(&format!(
            r#"{{ "eta": 1e-3, "k": 1e3, "roughness": {roughness}, "anisotropy": {anisotropy} }}"#
        ))
    };
    for roughness in [0.0, 0.2, 0.5, 0.8, 1.0] {
        for anisotropy in [0.0, 0.3, 0.7, 0.9] {
            let k = perfect(roughness, anisotropy);
            for z in [1.0, 0.6, -0.3, 0.1, 0.05] {
                for turn in [0.0, 0.09, 0.17, 0.25] {
                    let wo = at(z, turn);
                    let what = format!("roughness {roughness}, anisotropy {anisotropy} at {wo}");
                    let bound = if anisotropy > 0.8 { 0.014 } else { 0.01 };
                    suite.close(&what, albedo(&k, wo, 20_000)[0], 1.0, 0.0, bound);
                }
            }
        }
    }
    suite.assert();
}

/// Metals have their colours, at normal incidence from the closed form ((η − 1)² + k²)/((η + 1)² + k²).
#[test]
fn mirrors_of_measured_metals() {
    for (symbol, eta, k) in metals::METALS {
        let mirror = surface(&format!(r#"{{ "metal": "{symbol}" }}"#));
        assert_eq!(mirror.lobes(), lobes::DELTA);
        assert_eq!(
            mirror.eval(Vec3::Z, Vec3::Z, Mode::Radiance),
            ScatterEval::default()
        );
        let s = mirror.sample(Vec3::NEG_Z, ScatterDraws::default(), Mode::Radiance);
        let s = s.unwrap();
        assert_eq!((s.wi, s.forward, s.reverse), ([0.0, 0.0, -1.0], 1.0, 1.0));
        assert_eq!(s.measure, Measure::Discrete as u32);
        for lane in 0..3 {
            let (e, k) = (eta[lane], k[lane]);
            let r = ((e - 1.0).powi(2) + k * k) / ((e + 1.0).powi(2) + k * k);
            assert!((f64::from(s.weight[lane]) - r).abs() < 1e-5, "{symbol}");
        }
        assert!(metals::NAMES.split('|').any(|n| n == symbol));
    }
    assert_eq!(metals::NAMES.split('|').count(), metals::METALS.len());
    let gold = surface(r#"{ "metal": "Au" }"#);
    let s = gold.sample(Vec3::Z, ScatterDraws::default(), Mode::Radiance);
    let [r, g, b] = s.unwrap().weight.to_rgb();
    assert!(r > 0.9 && r > g && g > b && b < 0.6, "{r} {g} {b}");
}

/// A film colours what is reflected, loses nothing over what reflects everything, and is none without thickness or presence.
#[test]
fn films_on_metals() {
    let mut suite = Suite::new();
    let film = r#""thin_film": 0.8, "thin_film_thickness": 150, "thin_film_ior": 2.3"#;
    let k = surface(&format!(r#"{{ "metal": "Cr", {film} }}"#));
    assert!(matches!(k, Either::B(_)));
    let (_, eta, absorbs) = metals::METALS[4];
    for z in [1.0, 0.6, 0.2] {
        let s = k.sample(at(z, 0.2), ScatterDraws::default(), Mode::Radiance);
        let weight = s.unwrap().weight;
        let exact = Film::new(0.8, 150.0, 2.3, 1.0).at(z, rgb(eta), rgb(absorbs));
        for lane in 0..3 {
            suite.close("mirror", weight[lane].into(), exact[lane].into(), 1e-4, 0.0);
        }
    }
    for roughness in [0.0, 0.4, 1.0] {
        let perfect = surface(&format!(
            r#"{{ "eta": 1e-3, "k": 1e3, "roughness": {roughness}, {film} }}"#
        ));
        for z in [1.0, 0.5, 0.1] {
            let a = albedo(&perfect, at(z, 0.1), 20_000);
            suite.close("furnace", a[1], 1.0, 0.0, 0.01);
        }
    }
    for off in [
        r#""thin_film": 0"#,
        r#""thin_film": 1, "thin_film_thickness": 0"#,
    ] {
        let k = surface(&format!(r#"{{ "metal": "Cr", {off} }}"#));
        assert!(matches!(k, Either::A(_)));
    }
    suite.assert();
}

/// Towards roughness 0 the albedo is the mirror's, and the brightest direction its own.
#[test]
fn the_smooth_limit() {
    let mut suite = Suite::new();
    let mirror = surface(r#"{ "metal": "Cu" }"#);
    for roughness in [0.01, 0.02, 0.05] {
        let k = surface(&format!(r#"{{ "metal": "Cu", "roughness": {roughness} }}"#));
        for wo in [at(1.0, 0.0), at(0.5, 0.3), at(-0.2, 0.8)] {
            let (a, b) = (albedo(&k, wo, 20_000), albedo(&mirror, wo, 1));
            for lane in 0..3 {
                suite.close("albedo", a[lane], b[lane], 0.0, 0.005);
            }
            let u = ScatterDraws {
                lobe: 0.5,
                dir: [0.5, 0.0],
            };
            let s = k.sample(wo, u, Mode::Radiance).unwrap();
            let off = (Vec3::from(s.wi) - Vec3::new(-wo.x, -wo.y, wo.z)).length();
            suite.claim(off < 4.0 * roughness * roughness + 1e-5, || {
                format!("{roughness}: {s:?}")
            });
        }
    }
    suite.assert();
}

#[test]
fn nothing_is_ever_nan() {
    let mut suite = Suite::new();
    let mut all = directions(40, 0xa7);
    for z in [1e-8f32, -1e-8, 1e-6, -1e-4, 1e-3, 0.0] {
        all.push(Vec3::new(1.0, 0.0, z));
        all.push(Vec3::new(-0.6, -0.8, z));
    }
    for params in [
        r#"{ "metal": "Al", "roughness": 0.01 }"#,
        r#"{ "metal": "Al", "roughness": 1 }"#,
        r#"{ "metal": "W", "roughness": 1, "anisotropy": 1 }"#,
        r#"{ "eta": 0, "k": 0, "roughness": 0.5 }"#,
        r#"{ "eta": 1, "k": 0, "roughness": 0.5 }"#,
        r#"{ "eta": 1e4, "k": 1e4, "roughness": 0.02 }"#,
    ] {
        let k = surface(params);
        for (i, &wo) in all.iter().enumerate() {
            for &wi in &all {
                let e = k.eval(wo, wi, Mode::Radiance);
                let good = [e.f[0], e.forward, e.reverse];
                suite.claim(good.iter().all(|v| v.is_finite() && *v >= 0.0), || {
                    format!("{params}: {e:?} at {wo} {wi}")
                });
            }
            let u = ScatterDraws {
                lobe: (0.618 * i as f32).fract(),
                dir: [(0.755 * i as f32).fract(), (0.57 * i as f32).fract()],
            };
            if let Some(s) = k.sample(wo, u, Mode::Importance) {
                suite.claim(s.weight.is_finite() && s.forward > 0.0, || format!("{s:?}"));
            }
        }
    }
    suite.assert();
}

/// Under water gold keeps its colour but reflects less: only the ratio of the indices counts.
#[test]
fn surroundings() {
    let plugin: Conductor = create(r#"{ "metal": "Au" }"#).unwrap();
    let k = plugin.closure(&SurfacePoint {
        outside_ior: 1.33,
        ..SurfacePoint::default()
    });
    let s = k
        .sample(Vec3::Z, ScatterDraws::default(), Mode::Radiance)
        .unwrap();
    let (e, kk) = (0.14312 / 1.33, 3.9832 / 1.33);
    let r = ((e - 1.0f64).powi(2) + kk * kk) / ((e + 1.0).powi(2) + kk * kk);
    assert!((f64::from(s.weight[0]) - r).abs() < 1e-5);
}

#[test]
fn refusals() {
    for bad in [
        "{}",
        r#"{ "metal": "Xx" }"#,
        r#"{ "eta": 1 }"#,
        r#"{ "metal": "Au", "eta": 1, "k": 1 }"#,
        r#"{ "eta": -1, "k": 1 }"#,
        r#"{ "metal": "Au", "roughness": 2 }"#,
    ] {
        assert!(create::<Conductor>(bad).is_err(), "{bad}");
    }
}

//! Tests of the plugin.

use super::*;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::{Mode, Scatter, ScatterDraws, Vec3};
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::{Measured, albedo, check_around, directions};

fn boundary(params: &str) -> Boundary {
    let plugin: RoughDielectric = create(params).unwrap();
    plugin.closure(&SurfacePoint::default())
}

/// Directions at polar cosines of the given signs, azimuths spread.
fn fans(cosines: &[f32]) -> Vec<Vec3> {
    cosines
        .iter()
        .enumerate()
        .map(|(i, &z)| {
            let (s, c) = (1.3 * i as f32 + 0.4).sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * c, r * s, z).normalize()
        })
        .collect()
}

/// χ², weights, densities both ways, reciprocity and modes over roughness, index and side.
#[test]
fn samples_follow_their_density() {
    let mut suite = Suite::new();
    for (params, cosines) in [
        (r#"{ "roughness": 0.5 }"#, &[0.95, 0.3, -0.5][..]),
        (r#"{ "roughness": 0.75, "ior": 1.33 }"#, &[0.1, -0.4]),
        (
            r#"{ "roughness": 0.7, "anisotropy": 0.6, "ior": 2.2 }"#,
            &[0.8, -0.2],
        ),
        (r#"{ "roughness": 0.6, "ior": 0.75 }"#, &[0.4, -0.3]),
        (
            r#"{ "roughness": 0.6, "thin": true, "anisotropy": 0.3 }"#,
            &[0.7, -0.25],
        ),
        // A narrow lobe, around the poles of the grid.
        (r#"{ "roughness": 0.15 }"#, &[1.0, -1.0]),
    ] {
        let k = boundary(params);
        assert_eq!(k.lobes(), lobes::SMOOTH);
        for wo in fans(cosines) {
            // The poles of the grid where light passes nearly unbent: the facets' density ends abruptly around there.
            check_around(&mut suite, params, &k, Measured::Bsdf, wo, wo, 0.007);
        }
    }
    suite.assert();
}

/// White furnace: nothing is absorbed and nothing made, from either side, at any angle, to 1 %; anisotropic facets to 1.4 %.
#[test]
fn nothing_is_lost() {
    let mut suite = Suite::new();
    let mut furnace = |params: &str, wo: Vec3, bound: f64| {
        let k = boundary(params);
        let what = format!("{params} at {wo}");
        suite.close(&what, albedo(&k, wo, 20_000)[0], 1.0, 0.0, bound);
    };
    for ior in [0.8, 1.02, 1.05, 1.2, 1.33, 1.5, 2.5] {
        for roughness in [0.25, 0.4, 0.7, 0.85, 1.0] {
            let params = format!(r#"{{ "ior": {ior}, "roughness": {roughness} }}"#);
            // Where facets are nearly smooth the table's nodes are widest apart: 1.05 % at ior 1.2, from inside at a cosine of 0.05.
            let bound = if roughness < 0.3 { 0.011 } else { 0.01 };
            for wo in fans(&[1.0, 0.6, 0.2, 0.05, -0.05, -0.15, -0.3, -0.6, -0.8, -1.0]) {
                furnace(&params, wo, bound);
            }
            let params = format!(r#"{{ "ior": {ior}, "roughness": {roughness}, "thin": true }}"#);
            for wo in fans(&[1.0, 0.2, -0.05]) {
                furnace(&params, wo, 0.01);
            }
        }
    }
    for (anisotropy, ior) in [(0.3, 1.5), (0.9, 1.5), (0.5, 1.05), (0.8, 1.2)] {
        for roughness in [0.5, 1.0] {
            let params = format!(
                r#"{{ "ior": {ior}, "roughness": {roughness}, "anisotropy": {anisotropy} }}"#
            );
            for z in [1.0, 0.6, 0.2, 0.07, -0.1, -0.3, -0.8f32] {
                let r = (1.0 - z * z).sqrt();
                for i in 0..5 {
                    let (s, c) = (0.393 * i as f32).sin_cos();
                    furnace(&params, Vec3::new(r * c, r * s, z).normalize(), 0.014);
                }
            }
        }
    }
    suite.assert();
}

/// Towards roughness 0 the lobes close in on the smooth boundary's directions and shares.
#[test]
fn the_smooth_limit() {
    let mut suite = Suite::new();
    let smooth = boundary(r#"{ "roughness": 0 }"#);
    assert_eq!(smooth.lobes(), lobes::DELTA);
    for roughness in [0.01, 0.011, 0.02, 0.05] {
        let k = boundary(&format!(r#"{{ "roughness": {roughness} }}"#));
        let alpha = roughness * roughness;
        for wo in fans(&[1.0, 0.7, 0.3, -0.95, -0.8]) {
            let mut reflected = [0.0; 2];
            let n = 20_000;
            for i in 0..n {
                let u = ScatterDraws {
                    lobe: (i as f32 + 0.5) / n as f32,
                    // Low-discrepancy points of the plane (Roberts' sequence).
                    dir: [0.754_877_7, 0.569_840_3].map(|a: f32| (a * i as f32).fract()),
                };
                let s = smooth.sample(wo, u, Mode::Radiance).unwrap();
                reflected[0] += f64::from(u8::from(s.lobe == 0)) / f64::from(n);
                let Some(r) = k.sample(wo, u, Mode::Radiance) else {
                    continue;
                };
                suite.claim(r.weight.is_finite() && r.forward.is_finite(), || {
                    format!("{r:?}")
                });
                reflected[1] += f64::from(u8::from(r.lobe == 0)) / f64::from(n);
            }
            suite.close(
                "share",
                reflected[1],
                reflected[0],
                0.0,
                0.002 + 2.0 * alpha,
            );
            let u = ScatterDraws {
                lobe: 0.999,
                dir: [0.5, 0.0],
            };
            // The facet at the middle of the distribution is the macroscopic surface.
            let (s, r) = (
                smooth.sample(wo, u, Mode::Radiance).unwrap(),
                k.sample(wo, u, Mode::Radiance).unwrap(),
            );
            suite.claim(
                (Vec3::from(s.wi) - Vec3::from(r.wi)).length() < 8.0 * alpha as f32 + 1e-5,
                || format!("{roughness}: {s:?} {r:?}"),
            );
        }
    }
    assert_eq!(boundary(r#"{ "roughness": 0.009 }"#).lobes(), lobes::DELTA);
    suite.assert();
}

/// Grazing directions and random pairs give finite, non-negative numbers for all widths and indices.
#[test]
fn nothing_is_ever_nan() {
    let mut suite = Suite::new();
    let mut all = directions(40, 0xa7);
    for z in [1e-8f32, -1e-8, 1e-6, -1e-4, 1e-3, 0.0] {
        all.push(Vec3::new(1.0, 0.0, z));
        all.push(Vec3::new(-0.6, -0.8, z));
    }
    for roughness in [0.01, 0.1, 1.0] {
        for ior in [0.2, 1.0, 1.0001, 1.01, 1.5, 5.0] {
            for rest in ["", r#", "thin": true"#, r#", "anisotropy": 1"#] {
                let params = format!(r#"{{ "ior": {ior}, "roughness": {roughness}{rest} }}"#);
                let k = boundary(&params);
                for (i, &wo) in all.iter().enumerate() {
                    for &wi in &all {
                        let e = k.eval(wo, wi, Mode::Radiance);
                        let good = [e.f[0], e.forward, e.reverse];
                        suite.claim(good.iter().all(|v| v.is_finite() && *v >= 0.0), || {
                            format!("{params}: {e:?} at {wo} {wi}")
                        });
                    }
                    for j in 0..8 {
                        let at = |k: usize| (k as f32 + 0.5) / 8.0;
                        let u = ScatterDraws {
                            lobe: at(j),
                            dir: [at((i + j) % 8), at((3 * i + 5 * j) % 8)],
                        };
                        let Some(s) = k.sample(wo, u, Mode::Importance) else {
                            continue;
                        };
                        let good = s.weight.is_finite()
                            && s.weight[0] >= 0.0
                            && s.forward > 0.0
                            && (Vec3::from(s.wi).length() - 1.0).abs() < 1e-5;
                        suite.claim(good, || format!("{params}: {s:?} at {wo}"));
                    }
                }
            }
        }
    }
    suite.assert();
}

/// At roughness 1 the facets' density ends abruptly where they stand upright, which the grid of the χ² test can't follow:
/// moments of samples against a plain sum over the sphere.
#[test]
fn the_roughest() {
    let mut suite = Suite::new();
    let moments = |w: Vec3| [1.0, w.x, w.y, w.z, w.z.abs(), w.x * w.z].map(f64::from);
    for (ior, thin) in [(1.33, false), (1.5, false), (1.5, true)] {
        let k = boundary(&format!(
            r#"{{ "ior": {ior}, "roughness": 1, "thin": {thin} }}"#
        ));
        for wo in fans(&[0.9, 0.4, -0.6]) {
            let (mut expected, mut found) = ([0.0; 6], [0.0; 6]);
            let n = 1000u32;
            for i in 0..n * n {
                let at = |k: u32| (k as f32 + 0.5) / n as f32;
                let wi = resolvent_api::math::warp::sphere([at(i % n), at(i / n)]);
                let p = f64::from(k.eval(wo, wi, Mode::Radiance).forward);
                let omega = 4.0 * core::f64::consts::PI / f64::from(n * n);
                for (e, m) in expected.iter_mut().zip(moments(wi)) {
                    *e += p * m * omega;
                }
            }
            let m = 200_000;
            let mut stream = resolvent_api::rng::Stream::new(0x2011);
            for _ in 0..m {
                let u = ScatterDraws {
                    lobe: stream.uniform(),
                    dir: stream.uniform2(),
                };
                if let Some(s) = k.sample(wo, u, Mode::Radiance) {
                    for (f, m) in found.iter_mut().zip(moments(s.wi.into())) {
                        *f += m;
                    }
                }
            }
            for (e, f) in expected.into_iter().zip(found) {
                // Four standard errors of a mean of values within ±1, and the sum's own error.
                let bound = 4.0 / f64::from(m).sqrt() + 1e-3;
                suite.close(
                    &format!("{ior} {thin} {wo}"),
                    f / f64::from(m),
                    e,
                    0.0,
                    bound,
                );
            }
        }
    }
    suite.assert();
}

/// Beyond the critical angle a nearly smooth boundary reflects all but what rough facets let through.
#[test]
fn total_reflection() {
    let k = boundary(r#"{ "roughness": 0.05 }"#);
    let wo = Vec3::new(0.8, 0.0, -0.6);
    for i in 0..1000 {
        let u = ScatterDraws {
            lobe: 0.999_9,
            dir: [i as f32 / 1000.0, (0.618_034 * i as f32).fract()],
        };
        if let Some(s) = k.sample(wo, u, Mode::Radiance) {
            assert_eq!((s.lobe, s.eta), (0, 1.0), "{s:?}");
            assert_eq!(s.measure, Measure::SolidAngle as u32);
        }
    }
}

#[test]
fn tints_and_refusals() {
    let plain = boundary("{}");
    let k = boundary(r#"{ "reflection_tint": [0.5, 0, 1], "transmission_tint": 0.25 }"#);
    let (wo, up) = (Vec3::Z, Vec3::new(0.1, 0.2, 1.0).normalize());
    let f = |k: &Boundary, wi| k.eval(wo, wi, Mode::Radiance).f.to_rgb();
    let [a, ..] = f(&plain, up);
    assert_eq!(f(&k, up), [0.5 * a, 0.0, a]);
    let [a, ..] = f(&plain, -up);
    assert!(a > 0.0);
    assert_eq!(f(&k, -up), [0.25 * a; 3]);
    let plugin: RoughDielectric = create(r#"{ "ior": 1.6 }"#).unwrap();
    assert_eq!(plugin.ior(), 1.6);
    for bad in [
        r#"{ "ior": 0 }"#,
        r#"{ "roughness": 1.1 }"#,
        r#"{ "anisotropy": -1 }"#,
    ] {
        assert!(create::<RoughDielectric>(bad).is_err());
    }
}

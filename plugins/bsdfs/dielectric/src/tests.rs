//! Tests of the plugin.

use super::*;
use resolvent_api::operator::{Measure, lobes};
use resolvent_api::{Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample, Vec3};
use resolvent_tests::Suite;
use resolvent_tests::host::create;
use resolvent_tests::scatter::directions;

fn boundary(params: &str) -> Boundary {
    let plugin: Dielectric = create(params).unwrap();
    plugin.closure(&SurfacePoint::default())
}

fn draw(lobe: f32) -> ScatterDraws {
    ScatterDraws {
        lobe,
        dir: [0.5; 2],
    }
}

/// The reflectance that a sweep over the lobe's random number shows.
fn reflectance(k: &Boundary, wo: Vec3) -> f64 {
    let n = 100_000;
    let reflected = (0..n)
        .filter(|i| {
            let s = k.sample(wo, draw((*i as f32 + 0.5) / n as f32), Mode::Radiance);
            s.is_some_and(|s| s.wi[2] * wo.z > 0.0)
        })
        .count();
    reflected as f64 / f64::from(n)
}

/// Fresnel's equations in terms of angles, in double precision.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let i = cos.acos();
    let sin = i.sin() / eta;
    if sin >= 1.0 {
        return 1.0;
    }
    let t = sin.asin();
    if i < 1e-9 {
        return ((eta - 1.0) / (eta + 1.0)).powi(2);
    }
    let rs = ((i - t).sin() / (i + t).sin()).powi(2);
    let rp = ((i - t).tan() / (i + t).tan()).powi(2);
    0.5 * (rs + rp)
}

#[test]
fn reflectance_from_both_sides() {
    let mut suite = Suite::new();
    for ior in [1.31, 1.5, 2.42, 0.8] {
        let k = boundary(&format!(r#"{{ "ior": {ior} }}"#));
        for cos in [1.0, 0.9, 0.65, 0.3, 0.05] {
            let sin = (1.0f32 - cos * cos).sqrt();
            for z in [cos, -cos] {
                let wo = Vec3::new(0.6 * sin, 0.8 * sin, z);
                let eta = if z > 0.0 { ior } else { 1.0 / ior };
                let expected = fresnel(f64::from(cos), eta);
                suite.close("reflectance", reflectance(&k, wo), expected, 1e-4, 3e-5);
            }
        }
    }
    suite.assert();
}

/// Directions, densities, and Snell's law n sin θ, from both sides; both modes agree and the way back has the same density.
#[test]
fn samples() {
    let mut suite = Suite::new();
    let k = boundary(r#"{ "ior": 1.5 }"#);
    assert_eq!(k.lobes(), lobes::DELTA);
    for wo in directions(200, 0x61a5) {
        for lobe in [0.0, 0.5, 0.999] {
            for mode in [Mode::Radiance, Mode::Importance] {
                let s = k.sample(wo, draw(lobe), mode).unwrap();
                let wi = Vec3::from(s.wi);
                assert_eq!(s.measure, Measure::Discrete as u32);
                suite.close("length", f64::from(wi.length()), 1.0, 0.0, 1e-6);
                // In the plane of incidence, on the other side of the normal.
                suite.claim(wo.cross(wi).z.abs() < 1e-6, || format!("{wo} {wi}"));
                suite.close("weight", f64::from(s.weight[0]), 1.0, 0.0, 0.0);
                let reflected = wi.z * wo.z > 0.0;
                let eta = match (reflected, wo.z > 0.0) {
                    (true, _) => 1.0,
                    (false, true) => 1.5,
                    (false, false) => 1.0 / 1.5,
                };
                suite.close("eta", f64::from(s.eta), f64::from(eta), 1e-6, 0.0);
                for (a, b) in [(wi.x, wo.x), (wi.y, wo.y)] {
                    suite.close("Snell", f64::from(a * eta), f64::from(-b), 0.0, 2e-6);
                }
                let cos = f64::from(wo.z.abs());
                let f = fresnel(cos, if wo.z > 0.0 { 1.5 } else { 1.0 / 1.5 });
                let p = if reflected { f } else { 1.0 - f };
                suite.close("density", f64::from(s.forward), p, 1e-4, 1e-5);
                suite.close("reverse", f64::from(s.reverse), p, 1e-4, 1e-5);
                // The way back along the same ray.
                let back = [0.0, 0.999].map(|l| k.sample(wi, draw(l), mode));
                let same = |b: &Option<ScatterSample>| {
                    b.is_some_and(|b| (Vec3::from(b.wi) - wo).length() < 1e-3)
                };
                // Near grazing the refracted cosine has lost its digits.
                suite.claim(cos < 0.05 || back.iter().any(same), || {
                    format!("{wo} {wi} {back:?}")
                });
            }
        }
    }
    suite.assert();
}

#[test]
fn total_reflection() {
    let k = boundary(r#"{ "ior": 1.5 }"#);
    let wo = Vec3::new(0.8, 0.0, -0.6);
    assert_eq!(reflectance(&k, wo), 1.0);
    let s = k.sample(wo, draw(0.999_9), Mode::Radiance).unwrap();
    assert_eq!((s.wi, s.forward), ([-0.8, 0.0, -0.6], 1.0));
}

/// A plate: two boundaries with all reflections between them, summed as the geometric series they are.
#[test]
fn a_thin_sheet_is_a_plate() {
    let mut suite = Suite::new();
    let k = boundary(r#"{ "ior": 1.5, "thin": true }"#);
    for wo in directions(20, 3) {
        let f = fresnel(f64::from(wo.z.abs()), 1.5);
        let t = 1.0 - f;
        let mut plate = f;
        let mut inside = t;
        for _ in 0..2000 {
            // Reflected at the far face, out through the near one.
            plate += inside * f * t;
            inside *= f * f;
        }
        suite.close("plate", reflectance(&k, wo), plate, 1e-4, 3e-5);
        let s = k.sample(wo, draw(0.9999), Mode::Radiance).unwrap();
        suite.claim(s.wi == (-wo).to_array() || plate > 0.999, || {
            format!("{s:?}")
        });
        suite.claim(s.eta == 1.0, || format!("{s:?}"));
    }
    let plugin: Dielectric = create(r#"{ "thin": true }"#).unwrap();
    assert_eq!((plugin.ior(), k.eta()), (1.0, 1.0));
    suite.assert();
}

/// Inside another dielectric only the ratio counts; without a difference light passes unchanged.
#[test]
fn surroundings() {
    let plugin: Dielectric = create(r#"{ "ior": 1.33 }"#).unwrap();
    assert_eq!(plugin.ior(), 1.33);
    let at = |outside_ior| {
        plugin.closure(&SurfacePoint {
            outside_ior,
            ..SurfacePoint::default()
        })
    };
    let wo = Vec3::new(0.48, 0.0, 0.877_3).normalize();
    let k = at(1.5);
    assert!((reflectance(&k, wo) - fresnel(f64::from(wo.z), 1.33 / 1.5)).abs() < 3e-5);
    let k = at(1.33);
    assert_eq!(reflectance(&k, wo), 0.0);
    let s = k.sample(wo, draw(0.0), Mode::Radiance).unwrap();
    assert!((Vec3::from(s.wi) + wo).length() < 1e-6 && s.eta == 1.0);
}

#[test]
fn tints_and_refusals() {
    let k = boundary(r#"{ "reflection_tint": [0.5, 0, 1], "transmission_tint": 0.25 }"#);
    let s = |lobe| k.sample(Vec3::Z, draw(lobe), Mode::Radiance).unwrap();
    assert_eq!(s(0.0).weight.to_rgb(), [0.5, 0.0, 1.0]);
    assert_eq!(s(0.9).weight.to_rgb(), [0.25; 3]);
    let k = boundary(r#"{ "transmission_tint": 0 }"#);
    assert!(k.sample(Vec3::Z, draw(0.9), Mode::Radiance).is_none());
    assert!(k.sample(Vec3::X, draw(0.9), Mode::Radiance).is_none());
    assert_eq!(
        k.eval(Vec3::Z, Vec3::Z, Mode::Radiance),
        ScatterEval::default()
    );
    for bad in [
        r#"{ "ior": 0 }"#,
        r#"{ "ior": 9 }"#,
        r#"{ "reflection_tint": 2 }"#,
    ] {
        assert!(create::<Dielectric>(bad).is_err());
    }
}

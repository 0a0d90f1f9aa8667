//! Sampling warps and their inverses, computed in `f64`: the round trip returns the numbers that went in.

use crate::cases;
use proptest::prelude::*;
use resolvent_api::math::{Frame, Vec3, hg::Lobe, warp};
use std::f64::consts::PI;

/// Numbers in [0, 1], as samplers make them: the ends and their neighbours more often than chance has them.
fn unit() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => 0f32..1.0,
        1 => Just(0.0f32),
        1 => Just(1.0f32 - f32::EPSILON / 2.0),
        1 => 1e-30f32..1e-3,
        1 => (1e-7f32..1e-3).prop_map(|x| 1.0 - x),
    ]
}

fn f64s(v: Vec3) -> [f64; 3] {
    [v.x, v.y, v.z].map(f64::from)
}

/// Azimuth over 2π, in [0, 1).
fn turn(x: f64, y: f64) -> f64 {
    (y.atan2(x) / (2.0 * PI)).rem_euclid(1.0)
}

/// Distance on a circle of circumference 1.
fn apart(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(1.0);
    d.min(1.0 - d)
}

/// The inverse of Shirley and Chiu's map.
fn undo_disk([x, y]: [f64; 2]) -> [f64; 2] {
    let r = x.hypot(y);
    let mut phi = y.atan2(x);
    if phi < -PI / 4.0 {
        phi += 2.0 * PI;
    }
    let (a, b) = if phi < PI / 4.0 {
        (r, phi * r / (PI / 4.0))
    } else if phi < 3.0 * PI / 4.0 {
        (-(phi - PI / 2.0) * r / (PI / 4.0), r)
    } else if phi < 5.0 * PI / 4.0 {
        (-r, -(phi - PI) * r / (PI / 4.0))
    } else {
        ((phi - 3.0 * PI / 2.0) * r / (PI / 4.0), -r)
    };
    [(a + 1.0) / 2.0, (b + 1.0) / 2.0]
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn sphere(u in [unit(), unit()]) {
        let [x, y, z] = f64s(warp::sphere(u));
        prop_assert!((x.hypot(y).hypot(z) - 1.0).abs() < 3e-7);
        prop_assert!(((1.0 - z) / 2.0 - f64::from(u[0])).abs() < 1e-7);
        // At the poles the azimuth has no digits: weighted by the distance from the axis.
        prop_assert!(apart(turn(x, y), f64::from(u[1])) * x.hypot(y) < 4e-7);
    }

    #[test]
    fn disk(u in [unit(), unit()]) {
        let p = warp::disk(u).map(f64::from);
        prop_assert!(p[0].hypot(p[1]) <= 1.0 + 1e-6);
        let back = undo_disk(p);
        for k in 0..2 {
            prop_assert!((back[k] - f64::from(u[k])).abs() < 4e-7, "{:?} {:?} {:?}", u, p, back);
        }
    }

    #[test]
    fn cosine_hemisphere(u in [unit(), unit()]) {
        let d = warp::cosine_hemisphere(u);
        let [x, y, z] = f64s(d);
        prop_assert!(z >= 0.0 && (x.hypot(y).hypot(z) - 1.0).abs() < 4e-4);
        let back = undo_disk([x, y]);
        for k in 0..2 {
            prop_assert!((back[k] - f64::from(u[k])).abs() < 4e-7);
        }
    }

    #[test]
    fn cone(u in [unit(), unit()], log in -12f64..0.3) {
        let one_minus_cos = 10f64.powf(log).min(2.0) as f32;
        let [x, y, z] = f64s(warp::cone(u, one_minus_cos));
        // 1 − z has no digits left in a narrow cone: sin² θ = h (2 − h) has.
        let h = f64::from(u[0]) * f64::from(one_minus_cos);
        let sin2 = x * x + y * y;
        prop_assert!((sin2 - h * (2.0 - h)).abs() <= 2e-6 * h * (2.0 - h).max(1e-3) + 1e-6 * h * h);
        prop_assert!((z - (1.0 - h)).abs() < 1e-7 + 1e-7 * h);
        prop_assert!(apart(turn(x, y), f64::from(u[1])) * sin2.sqrt() <= 4e-7 * sin2.sqrt().max(1e-30));
    }

    /// The distribution function of the angle that a number became is that number.
    #[test]
    fn henyey_greenstein(u in unit(), log in 0f64..6.9, back in any::<bool>()) {
        let g = (1.0 - 10f64.powf(-log)) * if back { -1.0 } else { 1.0 };
        let lobe = Lobe::new(g).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let angle = lobe.sample(u);
        let (a, b) = (f64::from(angle.one_minus_cos), f64::from(angle.one_plus_cos));
        prop_assert!((a + b - 2.0).abs() < 1e-5, "{a} {b}");
        // P(cos θ' < cos θ) from whichever of the two holds more digits:
        //   F = (1 − g²)/(2g) (1/√(h) − 1/(1 + g)), h = (1 − g)² + 2g (1 − cos θ) = (1 + g)² − 2g (1 + cos θ).
        let h = if a < b { (1.0 - g).powi(2) + 2.0 * g * a } else { (1.0 + g).powi(2) - 2.0 * g * b };
        let root = h.sqrt();
        // 1/√h − 1/(1+g) = ((1+g)² − h)/(√h (1+g) (1+g+√h)), and (1+g)² − h = 2g (1 + cos θ): no difference.
        let below = (1.0 - g) * b / (root * (1.0 + g + root));
        let above = (1.0 + g) * a / (root * (1.0 - g + root));
        prop_assert!((below + above - 1.0).abs() < 1e-4, "{below} + {above}");
        let u = f64::from(u);
        prop_assert!((below - u).abs() < 2e-6 + 3e-6 * u, "g = {g}: u = {u} gives F = {below}");
        prop_assert!((above - (1.0 - u)).abs() < 4e-6, "g = {g}: 1 - u = {} gives {above}", 1.0 - u);
    }

    /// Scattered directions keep their angle from the axis and stay unit vectors.
    #[test]
    fn henyey_greenstein_directions(u in [unit(), unit()], g in -0.99f64..0.99, axis in [unit(), unit()]) {
        let n = warp::sphere(axis);
        let lobe = Lobe::new(g).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let angle = lobe.sample(u[0]);
        let w = angle.direction(Frame::around(n), u[1]);
        prop_assert!((w.length() - 1.0).abs() < 3e-7);
        let (n, w) = (f64s(n), f64s(w));
        let apart2: f64 = (0..3).map(|k| (n[k] - w[k]).powi(2)).sum();
        let expected = 2.0 * f64::from(angle.one_minus_cos);
        prop_assert!((apart2 - expected).abs() < 3e-6 * expected.sqrt() + 1e-12, "{apart2} {expected}");
    }
}

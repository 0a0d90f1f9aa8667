//! Every strategy of bidirectional paths alone, against quadrature: light scattered once, by a surface or in a chromatic fog.

use crate::harness::{self, BATCH};
use crate::scenes;
use resolvent_tests::quadrature::gauss;
use resolvent_tests::{Moments, Suite};
use serde_json::json;
use std::f64::consts::PI;

const SIGMA: [f64; 3] = [0.1, 0.4, 1.0];
const ALBEDO: f64 = 0.8;
const G: f64 = 0.5;
const GROUND: [f64; 3] = [0.8, 0.5, 0.3];
const RADIANCE: f64 = 5.0;
const FOV: f64 = 70.0;
/// Height of the camera and of the lamp above the ground.
const CAMERA: f64 = 1.0;
const LAMP: f64 = 1.6;
const HALF: f64 = 0.4;

/// A lamp above ground in a chromatic fog, seen from above by a camera below the lamp.
pub fn scene() -> serde_json::Value {
    let mut scene = scenes::scene([0.3, 0.1, CAMERA], [0.0, 0.0, -1.0]);
    scene["camera"] = scenes::camera([0.3, 0.1, CAMERA], [0.0, 0.0, -1.0], FOV);
    scenes::diffuse(&mut scene, "ground", json!(GROUND));
    let ground = json!({ "type": "rectangle", "corner": [-5, -5, 0], "edge_u": [10, 0, 0],
                         "edge_v": [0, 10, 0], "material": "ground" });
    scenes::add(&mut scene, "shapes", ground);
    let lamp = json!({ "type": "rectangle", "corner": [-HALF, -HALF, LAMP],
                       "edge_u": [0, 2.0 * HALF, 0], "edge_v": [2.0 * HALF, 0, 0],
                       "radiance": RADIANCE });
    scenes::add(&mut scene, "lights", lamp);
    scenes::medium(
        &mut scene,
        "fog",
        json!({ "sigma_t": SIGMA, "albedo": ALBEDO, "bounds": [-6, -6, -1, 6, 6, 6],
                "phase": scenes::hg(G) }),
    );
    scene
}

/// Light from the lamp at `p` times what `f` of the cosine at the lamp's direction gives, and times transmittance.
fn lamp(p: [f64; 3], sigma: f64, f: impl Fn([f64; 3]) -> f64) -> f64 {
    let mut sum = 0.0;
    for (x, wx) in gauss(-HALF, HALF) {
        for (y, wy) in gauss(-HALF, HALF) {
            let d = [x - p[0], y - p[1], LAMP - p[2]];
            let r2 = d.iter().map(|v| v * v).sum::<f64>();
            let r = r2.sqrt();
            let w = d.map(|v| v / r);
            sum += wx * wy * RADIANCE * f(w) * w[2].max(0.0) / r2 * (-sigma * r).exp();
        }
    }
    sum
}

/// The picture's mean, per lane: of light scattered once, at the ground or in the fog.
pub fn exact() -> [f64; 3] {
    let half = (0.5 * FOV).to_radians().tan();
    let mut out = [0.0; 3];
    for (u, wu) in gauss(-half, half) {
        for (v, wv) in gauss(-half, half) {
            let share = wu * wv / (4.0 * half * half);
            let length = (1.0 + u * u + v * v).sqrt();
            let d = [u, v, -1.0].map(|c| c / length);
            let at = |t: f64| [0.3 + t * d[0], 0.1 + t * d[1], CAMERA + t * d[2]];
            let end = CAMERA * length;
            for lane in 0..3 {
                let sigma = SIGMA[lane];
                let irradiance = lamp(at(end), sigma, |w| w[2]);
                out[lane] += share * (-sigma * end).exp() * GROUND[lane] / PI * irradiance;
                for (t, wt) in gauss(0.0, end) {
                    let phase = |w: [f64; 3]| {
                        // Light travels along −w and leaves along −d.
                        let cos = (0..3).map(|i| w[i] * d[i]).sum::<f64>();
                        (1.0 - G * G) / (4.0 * PI * (1.0 + G * G - 2.0 * G * cos).powf(1.5))
                    };
                    let inner = lamp(at(t), sigma, phase);
                    out[lane] += share * wt * (-sigma * t).exp() * sigma * ALBEDO * inner;
                }
            }
        }
    }
    out
}

#[test]
fn strategies_agree_with_quadrature() {
    let expected = exact();
    let mut suite = Suite::new();
    for (s, t, spp) in [(0, 3, 512), (1, 2, 64), (2, 1, 256)] {
        let mut scene = scene();
        scene["integrator"] = json!({ "plugin": "bdpt", "params": {
            "s": s, "t": t, "heuristic": "alone", "max_depth": 1 } });
        let ready = harness::build(&scene).unwrap_or_else(|e| panic!("{e}"));
        let mut lanes = [Moments::default(); 3];
        // Pictures of other seeds are independent; pixels of splats are not quite.
        for seed in 0..16 {
            let spp = (spp / if cfg!(debug_assertions) { 8 } else { 1 }).max(BATCH);
            let rendered = ready.render(100 + seed, 0, spp);
            let count = (harness::EDGE * harness::EDGE) as usize;
            for (lane, m) in lanes.iter_mut().enumerate() {
                let sum: f64 = (0..count)
                    .map(|i| rendered.film.estimate(i).mean[lane])
                    .sum();
                m.add(sum / count as f64);
            }
        }
        for (lane, m) in lanes.iter().enumerate() {
            let what = format!("strategy s {s} t {t}, lane {lane}");
            println!(
                "{what}: {:.6} +- {:.6}, exact {:.6}",
                m.mean(),
                m.standard_error(),
                expected[lane]
            );
            suite.mean(what, m, expected[lane], 0.0);
        }
    }
    let rejected = suite.rejected(1e-3);
    assert!(rejected.is_empty(), "{rejected:#?}");
}

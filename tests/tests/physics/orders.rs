//! Light by scattering order: the layers against closed form, and against sums of the series that end early.

use crate::harness;
use crate::scenes;
use crate::strategies;
use resolvent_engine::film::Film;
use resolvent_tests::{Moments, Suite};
use serde_json::{Value, json};

fn means(film: &Film, f: impl Fn(&Film, usize) -> [f64; 3]) -> [f64; 3] {
    let count = (harness::EDGE * harness::EDGE) as usize;
    let mut sum = [0.0; 3];
    for i in 0..count {
        for (s, v) in sum.iter_mut().zip(f(film, i)) {
            *s += v / count as f64;
        }
    }
    sum
}

/// Light scattered once, told from all other orders by every integrator, against quadrature; no light is seen directly.
#[test]
fn first_order_agrees_with_quadrature() {
    let expected = strategies::exact();
    let mut suite = Suite::new();
    for (integrator, spp) in [("pt", 64), ("bdpt", 32), ("light", 256), ("mlt", 32)] {
        let mut scene = strategies::scene();
        scene["integrator"] = json!({ "plugin": integrator });
        scene["film"]["aovs"] = json!(["orders:1"]);
        let ready = harness::build(&scene).unwrap_or_else(|e| panic!("{e}"));
        let mut lanes = [Moments::default(); 3];
        for seed in 0..16 {
            let film = ready.render(300 + seed, 0, spp).film;
            assert_eq!(means(&film, |f, i| f.order(i, 0)), [0.0; 3]);
            for (m, v) in lanes.iter_mut().zip(means(&film, |f, i| f.order(i, 1))) {
                m.add(v);
            }
        }
        for (lane, m) in lanes.iter().enumerate() {
            let what = format!("scattered once, {integrator}, lane {lane}");
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

/// A cloud in the sun above ground, lit by sky as well, that glows a little: walks branch, light is met, connected to and emitted.
fn cloud() -> Value {
    let mut s = scenes::scene([0.0; 3], [0.0, 1.0, 0.0]);
    s["camera"] = scenes::camera([0.0, -3.6, 0.3], [0.0, 1.0, -0.1], 45.0);
    scenes::diffuse(&mut s, "ground", json!([0.5, 0.4, 0.3]));
    let ground = json!({ "type": "rectangle", "corner": [-1.5, -1.5, -1], "edge_u": [3, 0, 0],
                         "edge_v": [0, 3, 0], "material": "ground" });
    scenes::add(&mut s, "shapes", ground);
    s["media"]["cloud"] = json!({ "plugin": "procedural", "params": {
        "kind": "cloud", "bounds": [-0.8, -0.8, -0.8, 0.8, 0.8, 0.6],
        "sigma_t": [6, 8, 12], "albedo": 0.95, "phase": scenes::hg(0.6) } });
    scenes::medium(
        &mut s,
        "glow",
        json!({ "sigma_t": 0.2, "albedo": 0.5, "emission": 0.05, "bounds": [-1, -1, -1, 1, 1, 1] }),
    );
    let sun = json!({ "type": "distant", "to_light": [0.4, -0.5, 0.8],
                      "irradiance": [3, 2.8, 2.4], "angle_deg": 2.0 });
    scenes::add(&mut s, "lights", sun);
    scenes::add(&mut s, "lights", scenes::dome(json!([0.3, 0.4, 0.6])));
    s
}

/// The sum Σ (GK)^k G of the first terms, k ≤ n: a picture of paths that end after n scatterings is that of the first layers, sample
/// for sample with `pt`, whose walks are the same until then; and with `bdpt` as well as noise allows.
#[test]
fn truncated_sums_are_the_first_layers() {
    const SPP: u32 = 16;
    let mut whole = cloud();
    whole["film"]["aovs"] = json!(["orders:3"]);
    let layers = harness::build(&whole).unwrap_or_else(|e| panic!("{e}"));
    let mut suite = Suite::new();
    for n in 0..=3usize {
        let first = |f: &Film, i: usize| {
            (0..=n).fold([0.0; 3], |sum, k| {
                let v = f.order(i, k);
                [0, 1, 2].map(|lane| sum[lane] + v[lane])
            })
        };
        let mut part = cloud();
        part["integrator"]["params"] = json!({ "max_depth": n });
        let pt = harness::build(&part).unwrap_or_else(|e| panic!("{e}"));
        part["integrator"]["plugin"] = json!("bdpt");
        let bdpt = harness::build(&part).unwrap_or_else(|e| panic!("{e}"));
        let mut lanes = [[Moments::default(); 3]; 2];
        for seed in 0..8 {
            let (a, b) = (
                layers.render(seed, 0, SPP).film,
                pt.render(seed, 0, SPP).film,
            );
            for i in 0..(harness::EDGE * harness::EDGE) as usize {
                let (sum, mean) = (first(&a, i), b.estimate(i).mean);
                for lane in 0..3 {
                    // The same f32 terms, added to f32 in another order.
                    let gap = (sum[lane] - mean[lane]).abs();
                    assert!(
                        gap <= 1e-5 * mean[lane].abs() + 1e-9,
                        "{n} {i}: {sum:?} {mean:?}"
                    );
                }
            }
            let c = bdpt.render(100 + seed, 0, SPP).film;
            let (a, c) = (means(&a, first), means(&c, |f, i| f.estimate(i).mean));
            for (of, means) in lanes.iter_mut().zip([a, c]) {
                of.iter_mut().zip(means).for_each(|(m, v)| m.add(v));
            }
        }
        let [layers, pictures] = &lanes;
        for (lane, (a, b)) in layers.iter().zip(pictures).enumerate() {
            let what = format!("up to order {n}, lane {lane}");
            println!(
                "{what}: layers {:.6} +- {:.6}, bdpt {:.6} +- {:.6}",
                a.mean(),
                a.standard_error(),
                b.mean(),
                b.standard_error()
            );
            suite.p_value(what, crate::agreement::welch(a, b));
        }
    }
    let rejected = suite.rejected(1e-3);
    assert!(rejected.is_empty(), "{rejected:#?}");
}

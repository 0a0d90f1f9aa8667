//! What an integrator cannot see is known, and is this and nothing else.

use crate::agreement::welch;
use crate::harness;
use crate::scenes;
use resolvent_tests::Moments;
use serde_json::{Value, json};

/// Mean radiance of the picture over eight seeds.
fn mean(scene: &Value, integrator: &str, spp: u32) -> Moments {
    let mut s = scene.clone();
    s["integrator"] = json!({ "plugin": integrator });
    let ready = harness::build(&s).unwrap_or_else(|e| panic!("{e}"));
    let mut out = Moments::default();
    for seed in 0..8 {
        let film = ready.render(40 + seed, 0, spp).film;
        let count = (harness::EDGE * harness::EDGE) as usize;
        let sum: f64 = (0..count).map(|i| film.estimate(i).mean[0]).sum();
        out.add(sum / count as f64);
    }
    println!(
        "limits: {integrator} {:.5} +- {:.5}",
        out.mean(),
        out.standard_error()
    );
    out
}

/// The caustic of a point light through smooth glass: no walk from the sensor meets the light, and no connection passes the
/// glass. `pt` sees what the floor around scatters alone; walks from the light see all.
#[test]
fn path_tracing_misses_caustics_of_points() {
    let mut s = scenes::scene([0.0; 3], [0.0, 1.0, 0.0]);
    s["camera"] = scenes::camera([1.6, 0.0, 0.6], [-1.6, 0.0, -0.6], 8.0);
    scenes::diffuse(&mut s, "white", json!(0.7));
    s["materials"]["glass"] = json!({ "plugin": "dielectric", "params": { "ior": 1.5 } });
    let floor = json!({ "type": "rectangle", "corner": [-3, -3, 0], "edge_u": [6, 0, 0],
                        "edge_v": [0, 6, 0], "material": "white" });
    scenes::add(&mut s, "shapes", floor);
    let ball = json!({ "type": "sphere", "center": [0, 0, 1], "radius": 0.5, "material": "glass" });
    scenes::add(&mut s, "shapes", ball);
    let bulb = json!({ "type": "point", "position": [0, 0, 2.5], "intensity": 5 });
    scenes::add(&mut s, "lights", bulb);
    let [pt, bdpt, light] =
        [("pt", 16), ("bdpt", 16), ("light", 64)].map(|(name, spp)| mean(&s, name, spp));
    assert!(welch(&bdpt, &light) > 1e-3);
    assert!(welch(&pt, &bdpt) < 1e-6 && pt.mean() < 0.5 * bdpt.mean());
    assert!(pt.mean() > 0.0);
}

/// A lit wall in a mirror: the last vertex before the lens is specular, and no walk from a light connects there. `light` sees
/// nothing at all; walks from the sensor do.
#[test]
fn particles_are_not_seen_in_mirrors() {
    let mut s = scenes::scene([0.0; 3], [0.0, 1.0, 0.0]);
    s["camera"] = scenes::camera([0.0, -1.0, 0.0], [0.0, 1.0, 0.0], 20.0);
    scenes::diffuse(&mut s, "white", json!(0.7));
    s["materials"]["mirror"] =
        json!({ "plugin": "conductor", "params": { "metal": "Al", "roughness": 0.0 } });
    for (y, side, material) in [(1.0, 1.0, "mirror"), (-2.0, 3.0, "white")] {
        let wall = json!({ "type": "rectangle", "corner": [-side, y, -side], "edge_u": [2.0 * side, 0, 0],
                           "edge_v": [0, 0, 2.0 * side], "material": material });
        scenes::add(&mut s, "shapes", wall);
    }
    let bulb = json!({ "type": "point", "position": [1.5, -1, 0.5], "intensity": 4 });
    scenes::add(&mut s, "lights", bulb);
    let [pt, bdpt, light] =
        [("pt", 16), ("bdpt", 16), ("light", 16)].map(|(name, spp)| mean(&s, name, spp));
    assert_eq!(light.mean(), 0.0);
    assert!(welch(&pt, &bdpt) > 1e-3 && pt.mean() > 0.0);
}

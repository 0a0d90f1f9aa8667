//! A long run over mixed scenes: no sample that is not finite, no drift, no growth of memory.
//!
//! A million samples by default; `RESOLVENT_SOAK=1e9` takes that many.

use crate::harness::{build, open_small};
use crate::scenes;
use resolvent_tests::Moments;
use serde_json::{Value, json};

/// Memory this process holds, bytes.
fn memory() -> f64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = text.split_whitespace().nth(1).and_then(|p| p.parse().ok());
    4096.0 * pages.unwrap_or(0.0)
}

/// Fog, smoke, glass and mirrors, areas, points and suns, chromatic and grey, seen through ordinary cameras.
fn mixture() -> Vec<(&'static str, Value)> {
    let mut room = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
    room["camera"] = scenes::camera([0.1, -3.5, 0.2], [0.0, 1.0, -0.05], 50.0);
    scenes::diffuse(&mut room, "wall", json!([0.7, 0.6, 0.5]));
    room["materials"]["glass"] = json!({ "plugin": "dielectric", "params": { "ior": 1.5 } });
    room["materials"]["metal"] =
        json!({ "plugin": "conductor", "params": { "metal": "Au", "roughness": 0.2 } });
    let fog = json!({
        "sigma_t": [0.2, 0.4, 1.5], "albedo": [0.99, 0.9, 0.5], "bounds": [-2, -2, -1, 2, 2, 2],
        "phase": scenes::hg(0.8)
    });
    scenes::medium(&mut room, "fog", fog);
    for shape in [
        json!({ "type": "rectangle", "corner": [-3, -3, -1], "edge_u": [6, 0, 0], "edge_v": [0, 6, 0], "material": "wall" }),
        json!({ "type": "sphere", "center": [-0.6, 0, 0], "radius": 0.5, "material": "glass" }),
        json!({ "type": "sphere", "center": [0.7, 0.3, -0.3], "radius": 0.6, "material": "metal" }),
        json!({ "type": "rectangle", "corner": [-0.5, -0.5, 2.5], "edge_u": [0, 1, 0], "edge_v": [1, 0, 0], "emission": 9 }),
    ] {
        scenes::add(&mut room, "shapes", shape);
    }
    let mut cloud = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
    cloud["camera"] = scenes::camera([0.0, 0.3, 4.0], [0.0, -0.05, -1.0], 40.0);
    let p = json!({
        "kind": "cloud", "sigma_t": 40, "albedo": 0.999, "center": [0, 0, 0], "radius": 1, "seed": 5,
        "phase": scenes::hg(0.85)
    });
    cloud["media"]["cloud"] = json!({ "plugin": "procedural", "params": p });
    scenes::add(&mut cloud, "lights", scenes::beam([0.5, -0.6, -0.4], 3.0));
    scenes::add(&mut cloud, "lights", scenes::dome(0.1));

    let mut milk = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
    milk["camera"] = scenes::camera([0.0, 0.0, 4.0], [0.0, 0.0, -1.0], 35.0);
    milk["materials"]["glass"] = json!({ "plugin": "dielectric", "params": { "ior": 1.33 } });
    scenes::medium(
        &mut milk,
        "milk",
        json!({ "sigma_t": [8, 9, 10], "albedo": [0.999, 0.998, 0.99] }),
    );
    scenes::add(
        &mut milk,
        "shapes",
        json!({ "type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "glass", "interior": "milk" }),
    );
    scenes::add(&mut milk, "lights", scenes::dome(0.5));
    scenes::add(
        &mut milk,
        "lights",
        json!({ "type": "point", "position": [2, 2, 3], "intensity": 8 }),
    );
    vec![("room", room), ("cloud", cloud), ("milk", milk)]
}

#[test]
fn nothing_breaks_drifts_or_grows() {
    let wanted: f64 = std::env::var("RESOLVENT_SOAK")
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(if cfg!(debug_assertions) { 1e5 } else { 1e6 });
    let mut ready: Vec<_> = mixture()
        .into_iter()
        .map(|(name, s)| (name, build(&s).unwrap_or_else(|e| panic!("{name}: {e}"))))
        .collect();
    // Every material, a thousand lights, a plume that glows, and shafts of light.
    for name in [
        "materials/materials",
        "lights/lights",
        "bench/fire",
        "bench/mist",
    ] {
        ready.push((name, open_small(&format!("{name}.json"))));
    }
    // One round: 32 samples of all pixels of all scenes. `render` fails at samples that are not finite and at majorants too small.
    const SPP: u32 = 32;
    let round = f64::from(SPP) * f64::from(crate::harness::EDGE).powi(2) * ready.len() as f64;
    let rounds = (wanted / round).ceil().max(8.0) as u32;
    let mut halves = vec![[[Moments::default(); 3]; 2]; ready.len()];
    let mut after_first = 0.0;
    for k in 0..rounds {
        let half = usize::from(2 * k >= rounds);
        for (of, (_, scene)) in halves.iter_mut().zip(&ready) {
            // Far along each pixel's sequence as well as with new seeds.
            let begin = if k % 2 == 0 { 0 } else { SPP * k };
            let m = scene.measure_range(1000 + u64::from(k), begin, begin + SPP);
            of[half]
                .iter_mut()
                .zip(m.mean)
                .for_each(|(of, v)| of.add(v));
        }
        // The first rounds fill pools and tables.
        if k == rounds / 4 {
            after_first = memory();
        }
    }
    let grown = memory() - after_first;
    assert!(grown < 8e6, "memory grew by {grown:.1e} bytes");
    for ((name, _), of) in ready.iter().zip(&halves) {
        let [first, second] = of;
        for (lane, (a, b)) in first.iter().zip(second).enumerate() {
            let error = a.standard_error().hypot(b.standard_error());
            let z = (a.mean() - b.mean()) / error;
            println!(
                "{name} [{lane}]: {:.5} then {:.5}, z = {z:.2}",
                a.mean(),
                b.mean()
            );
            // Few rounds make the standard error itself uncertain: six of them instead of four.
            assert!(z.abs() < 6.0, "{name} drifts: {} {}", a.mean(), b.mean());
        }
    }
}

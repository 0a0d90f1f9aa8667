//! Paths sampled from both ends, held against sums from scratch: contributions, densities, weights.

use crate::harness::{self, Ready};
use crate::scenes;
use resolvent_api::integrator::SceneView;
use resolvent_api::vertex::vertex_flags;
use resolvent_api::{Spectrum, VertexKind};
use resolvent_engine::scene::View;
use resolvent_pathspace::bidirectional::path::Path;
use resolvent_pathspace::bidirectional::{Bidirectional, Draws, End, NetDraws};
use resolvent_pathspace::mis::Heuristic;
use resolvent_pathspace::sampler::Purpose;
use serde_json::json;

const WALKS: f64 = 1024.0;

/// A room of surfaces that scatter in all ways, with a chromatic cloud, fog within a rough glass ball, and lights of all
/// kinds that emit.
fn room() -> Ready {
    let mut s = scenes::scene([0.0, -3.4, 0.2], [0.0, 1.0, 0.0]);
    s["camera"] = scenes::camera([0.0, -3.4, 0.2], [0.0, 1.0, -0.05], 60.0);
    s["integrator"] = json!({ "plugin": "bdpt" });
    scenes::diffuse(&mut s, "white", json!([0.8, 0.7, 0.6]));
    s["materials"]["glass"] =
        json!({ "plugin": "rough-dielectric", "params": { "roughness": 0.4 } });
    s["materials"]["metal"] =
        json!({ "plugin": "conductor", "params": { "metal": "Cu", "roughness": 0.3 } });
    for (corner, u, v, material) in [
        ([-2.0, -2.0, -1.0], [4, 0, 0], [0, 4, 0], "white"),
        ([-2.0, 2.0, -1.0], [4, 0, 0], [0, 0, 3], "metal"),
        ([-2.0, -2.0, -1.0], [0, 4, 0], [0, 0, 3], "white"),
    ] {
        let shape = json!({ "type": "rectangle", "corner": corner, "edge_u": u, "edge_v": v,
                            "material": material });
        scenes::add(&mut s, "shapes", shape);
    }
    s["media"]["cloud"] = json!({ "plugin": "procedural", "params": {
        "kind": "cloud", "sigma_t": [1.0, 3.0, 9.0], "albedo": [0.95, 0.9, 0.7],
        "bounds": [-1.6, -1, -0.9, 0.4, 1, 1.0], "phase": scenes::hg(0.6) } });
    s["media"]["milk"] = json!({ "plugin": "homogeneous", "params": {
        "sigma_t": [2.0, 1.5, 1.0], "albedo": 0.9, "phase": scenes::hg(0.3) } });
    let ball = json!({ "type": "sphere", "center": [0.9, 0.3, -0.3], "radius": 0.6,
                       "material": "glass", "interior": "milk" });
    scenes::add(&mut s, "shapes", ball);
    let lamp = json!({ "type": "rectangle", "corner": [-0.5, -0.5, 1.7], "edge_u": [0, 1, 0],
                       "edge_v": [1, 0, 0], "radiance": [9, 8, 7] });
    scenes::add(&mut s, "lights", lamp);
    scenes::add(&mut s, "lights", scenes::dome(json!([0.2, 0.3, 0.5])));
    let bulb = json!({ "type": "point", "position": [-1.5, -1.5, 1.2], "intensity": 0.7 });
    scenes::add(&mut s, "lights", bulb);
    scenes::add(&mut s, "lights", scenes::beam([0.3, 0.5, -0.8], 0.4));
    harness::build(&s).unwrap_or_else(|e| panic!("{e}"))
}

/// Calls `f` for connected pairs of walks through the room, with the strategy and what it gave.
fn each_path(mut f: impl FnMut(&SceneView<'_>, &Bidirectional, usize, usize, Spectrum)) {
    let ready = room();
    let view = View::new(ready.scene());
    let table = view.table();
    // SAFETY: the table is complete and outlives its view.
    let scene = unsafe { SceneView::new(&table) };
    let mut paths = Bidirectional::new(WALKS, Heuristic::Balance);
    let samples = resolvent_tests::samples(150_000) as u32;
    for i in 0..samples {
        let mut draws = NetDraws::new(9, u64::from(i % 1024), i / 1024, scene.lanes());
        let [a, b, c, d] = draws.four(End::Sensor, 0, Purpose::Camera);
        let pixel = [i % harness::EDGE, i / harness::EDGE % harness::EDGE];
        let ray = scene.camera_ray(pixel, [a, b], [c, d]).unwrap().unwrap();
        // Lanes are kept apart in the walks, so that contributions are those of the sums from scratch.
        paths
            .sensor
            .from_sensor::<true, _>(&scene, &ray, &mut draws, 6)
            .unwrap();
        paths
            .light
            .from_light::<true, _>(&scene, &mut draws, 6)
            .unwrap();
        for t in 2..=paths.sensor.len() {
            for s in 2..=paths.light.len() {
                let nodes = |n: &[resolvent_pathspace::bidirectional::Node]| {
                    n.iter()
                        .any(|n| n.delta || n.vertex.is(VertexKind::Emitter))
                };
                if nodes(&paths.sensor.nodes()[1..t]) || nodes(&paths.light.nodes()[1..s]) {
                    continue;
                }
                let value = paths.join(&scene, s, t, &mut draws).unwrap();
                if !value.is_zero() {
                    f(&scene, &paths, s, t, value);
                }
            }
        }
    }
    assert_eq!(view.take_error(), None);
}

/// The importance of the camera's ray, from the density of its first vertex.
fn importance(paths: &Bidirectional) -> f64 {
    let nodes = paths.sensor.nodes();
    let w = nodes[1].vertex.position() - nodes[0].vertex.position();
    let d2 = w.as_dvec3().length_squared();
    nodes[1].forward * d2 / f64::from(nodes[1].vertex.cosine(w.normalize()))
}

/// What the walks carry and weigh, against contribution and densities from scratch; and the weights of a path under all
/// strategies, each with densities asked for along its own walks, sum to 1.
#[test]
fn walks_agree_with_sums_from_scratch() {
    let (mut count, mut kinds) = (0u64, [0u64; 3]);
    let (mut worst_value, mut worst_sum) = (0f64, 0f64);
    let (mut off_value, mut off_sum) = (0u64, 0u64);
    each_path(|scene, paths, s, t, value| {
        let lanes = scene.lanes();
        let path = Path::of(paths, s, t, paths.edge, importance(paths));
        let n = s + t - 1;
        let f = path.contribution(scene).unwrap();
        let track = path.track();
        let scale = track.iter().take(lanes as usize).sum::<f64>() / f64::from(lanes);
        let relative = Spectrum(track.map(|v| (v / scale) as f32));
        let own = path.densities(scene, s, WALKS).unwrap();
        let grey: f64 = own.from_light[..s].iter().product::<f64>()
            * own.from_sensor[s..n].iter().product::<f64>();
        let divisor = own.divisor(s, relative, lanes, Heuristic::Balance) * scale * grey;
        let roulette = roulette(paths, s, t);
        for lane in 0..lanes as usize {
            let expected = f[lane] / divisor;
            let found = f64::from(value[lane]) / roulette;
            let error = (found - expected).abs() / expected.abs().max(1e-30);
            worst_value = worst_value.max(error);
            off_value += u64::from(error > 1e-3);
        }
        let delta = path.vertices[0].flags & vertex_flags::DELTA != 0;
        let sum: f64 = (usize::from(delta)..=n)
            .map(|k| path.densities(scene, k, WALKS).unwrap())
            .enumerate()
            .map(|(i, d)| d.weight(i + usize::from(delta), relative, lanes))
            .sum();
        worst_sum = worst_sum.max((sum - 1.0).abs());
        off_sum += u64::from((sum - 1.0).abs() > 1e-6);
        count += 1;
        let media = path.vertices[1..n]
            .iter()
            .filter(|v| v.is(VertexKind::Medium));
        let media = media.count();
        kinds[if media == 0 {
            0
        } else if media == n - 1 {
            1
        } else {
            2
        }] += 1;
    });
    println!(
        "weights: {count} paths (surfaces, media, mixed: {kinds:?}), values off by up to {worst_value:.1e} \
         ({off_value} by more than 1e-3), sums of weights by up to {worst_sum:.1e} ({off_sum} by more than 1e-6)"
    );
    assert!(kinds.iter().all(|k| *k > 100), "{kinds:?}");
    // Directions are recomputed from positions: where vertices almost touch or a surface is grazed, few digits are left.
    assert!(
        worst_value < 0.02 && off_value * 1000 <= count,
        "{off_value} of {count}"
    );
    // Closures are asked in single precision, and in another direction for every strategy.
    assert!(
        worst_sum < 2e-5 && off_sum * 10_000 <= count,
        "{off_sum} of {count}"
    );
}

/// What roulette multiplied the walks' weights by: what is left when contribution and densities are taken out.
fn roulette(paths: &Bidirectional, s: usize, t: usize) -> f64 {
    paths.light.nodes()[s - 1].survival * paths.sensor.nodes()[t - 1].survival
}

//! Paths sampled from both ends, held against sums from scratch: contributions, densities, weights; in a room with all there is,
//! by the switch that integrators have as well.

use crate::harness::{self, Ready};
use crate::scenes;
use resolvent_api::VertexKind;
use resolvent_api::integrator::{Outcome, SceneView};
use resolvent_engine::scene::{Until, View};
use resolvent_pathspace::bidirectional::{Bidirectional, NetDraws, Node};
use resolvent_pathspace::mis::{Heuristic, MediaDensities};
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
    s["materials"]["clear"] = json!({ "plugin": "dielectric", "params": { "ior": 1.5 } });
    let lens = json!({ "type": "sphere", "center": [-0.9, -0.6, -0.5], "radius": 0.35,
                       "material": "clear" });
    scenes::add(&mut s, "shapes", lens);
    let lamp = json!({ "type": "rectangle", "corner": [-0.5, -0.5, 1.7], "edge_u": [0, 1, 0],
                       "edge_v": [1, 0, 0], "radiance": [9, 8, 7] });
    scenes::add(&mut s, "lights", lamp);
    scenes::add(&mut s, "lights", scenes::dome(json!([0.2, 0.3, 0.5])));
    let bulb = json!({ "type": "point", "position": [-1.5, -1.5, 1.2], "intensity": 0.7 });
    scenes::add(&mut s, "lights", bulb);
    scenes::add(&mut s, "lights", scenes::beam([0.3, 0.5, -0.8], 0.4));
    harness::build(&s).unwrap_or_else(|e| panic!("{e}"))
}

/// All strategies of random paths through the room, recomputed: the densities at which either end finds every vertex, what the walks
/// carry and weigh, and the weights of a path under all strategies, which sum to 1.
fn recompute(media: MediaDensities, heuristic: Heuristic, samples: u32) {
    let ready = room();
    let view = View::new(ready.scene(), Until::NEVER);
    let table = view.table();
    // SAFETY: the table is complete and outlives its view.
    let scene = unsafe { SceneView::new(&table) };
    let mut paths = Bidirectional::new(WALKS, heuristic, media).verify(true);
    let mut kinds = [0u64; 3];
    for i in 0..samples {
        let mut draws = NetDraws::new(9, u64::from(i % 1024), i / 1024, scene.lanes());
        let pixel = [i % harness::EDGE, i / harness::EDGE % harness::EDGE];
        // Lanes are kept apart in the walks, so that contributions are those of the sums from scratch.
        let all = trace(&mut paths, &scene, pixel, &mut draws, &mut kinds);
        assert!(
            all.is_ok(),
            "{:?} {:?}",
            paths.difference(),
            view.take_error()
        );
    }
    assert_eq!(view.take_error(), None);
    let found = paths.verified.unwrap_or_default();
    let [value, density, sum] = found.worst;
    println!(
        "weights, {media:?} {heuristic:?}: {} paths (surfaces, media, mixed: {kinds:?}); of what is allowed, contributions are off \
         by {value:.2}, densities by {density:.2}, sums of weights by {sum:.2} ({} by more than 1e-6)",
        found.paths, found.loose
    );
    assert!(kinds.iter().all(|k| *k > 100), "{kinds:?}");
    // Closures are asked in single precision, and in another direction for every strategy.
    assert!(
        found.loose * 2000 <= found.paths,
        "{} of {}",
        found.loose,
        found.paths
    );
}

fn trace(
    paths: &mut Bidirectional,
    scene: &SceneView<'_>,
    pixel: [u32; 2],
    draws: &mut NetDraws,
    kinds: &mut [u64; 3],
) -> Outcome<()> {
    paths.look::<true, _>(scene, pixel, draws, 6, false)?;
    paths.light.from_light::<true, _>(scene, draws, 6)?;
    let mut light = 0.0;
    for t in 2..=paths.sensor.len() {
        light += paths.hit(scene, t)?[0];
        light += paths.next_event(scene, t, draws)?[0];
        for s in 2..=paths.light.len() {
            let value = paths.join(scene, s, t, draws)?;
            if !value.is_zero() {
                let media =
                    |n: &[Node]| n.iter().filter(|n| n.vertex.is(VertexKind::Medium)).count();
                let inner = s + t - 2;
                let in_media = media(&paths.sensor.nodes()[..t]) + media(&paths.light.nodes()[..s]);
                kinds[if in_media == 0 {
                    0
                } else if in_media == inner {
                    1
                } else {
                    2
                }] += 1;
            }
        }
    }
    for s in 2..=paths.light.len() {
        light += paths
            .project(scene, s, draws)?
            .map_or(0.0, |p| p.radiance[0]);
    }
    assert!(light >= 0.0);
    Ok(())
}

#[test]
fn walks_agree_with_sums_from_scratch() {
    recompute(
        MediaDensities::Exact,
        Heuristic::Balance,
        resolvent_tests::samples(60_000) as u32,
    );
}

#[test]
fn other_weights_agree_with_sums_from_scratch() {
    let few = resolvent_tests::samples(10_000) as u32;
    recompute(MediaDensities::Depth, Heuristic::Balance, few);
    recompute(MediaDensities::Exact, Heuristic::Power, few);
}

//! Media within boundaries that refract nothing: what glows behind several of them, and rays that start inside.

use crate::harness::{self, Precision, each};
use crate::judge::Table;
use crate::scenes;
use serde_json::{Value, json};

/// A layer across the z axis that absorbs and glows, lane by lane.
struct Layer {
    z: [f64; 2],
    sigma: [f64; 3],
    emission: [f64; 3],
}

fn layer(z: [f64; 2], sigma: [f64; 3], emission: [f64; 3]) -> Layer {
    Layer { z, sigma, emission }
}

/// What they radiate along +z: Σ over the intervals between boundaries, from above, of T j (1 − e^(−σd))/σ.
fn radiance(layers: &[Layer]) -> [f64; 3] {
    let mut z: Vec<f64> = layers.iter().flat_map(|l| l.z).collect();
    z.sort_by(|a, b| b.total_cmp(a));
    [0, 1, 2].map(|k| {
        let (mut sum, mut clear) = (0.0, 1.0);
        for w in z.windows(2) {
            let there = || layers.iter().filter(|l| l.z[0] <= w[1] && w[0] <= l.z[1]);
            let sigma: f64 = there().map(|l| l.sigma[k]).sum();
            let emission: f64 = there().map(|l| l.emission[k]).sum();
            let d = w[0] - w[1];
            let reached = match sigma {
                0.0 => d,
                _ => -(-sigma * d).exp_m1() / sigma,
            };
            sum += clear * emission * reached;
            clear *= (-sigma * d).exp();
        }
        sum
    })
}

/// The camera looks down through layers that are interiors of boxes, or media of their own, in all colours and in grey. They scatter,
/// so that nothing is integrated in closed form, but what is scattered does not count.
#[test]
fn what_glows_behind_boundaries() {
    let piles = [
        (
            "apart",
            vec![
                layer([0.0, 1.0], [2.0, 0.5, 0.1], [0.0; 3]),
                layer([-3.0, -1.0], [1.0; 3], [1.0; 3]),
            ],
        ),
        (
            "grey, three deep",
            vec![
                layer([3.0, 4.0], [0.7; 3], [0.2, 0.0, 0.1]),
                layer([1.0, 2.0], [0.5; 3], [0.0, 0.4, 0.1]),
                layer([-1.0, 0.0], [0.2; 3], [2.0, 1.0, 3.0]),
            ],
        ),
        (
            "overlapping",
            vec![
                layer([-2.0, 0.0], [1.0, 2.0, 0.3], [0.1, 0.2, 0.3]),
                layer([-1.0, 1.0], [0.5, 0.1, 2.0], [0.3, 0.1, 0.05]),
            ],
        ),
        (
            "grey, overlapping",
            vec![
                layer([-2.0, 0.0], [1.0; 3], [0.1, 0.2, 0.3]),
                layer([-1.0, 1.0], [0.5; 3], [0.3, 0.1, 0.05]),
            ],
        ),
    ];
    let mut cases = Vec::new();
    for (what, layers) in &piles {
        for within in [true, false] {
            let mut scene = scenes::scene([0.1, 0.2, 10.0], [0.0, 0.0, -1.0]);
            scene["integrator"]["params"] = json!({ "max_depth": 0 });
            for (i, l) in layers.iter().enumerate() {
                let (min, max) = ([-9.0, -9.0, l.z[0]], [9.0, 9.0, l.z[1]]);
                let name = format!("layer {i}");
                let mut params =
                    json!({ "sigma_t": l.sigma, "albedo": 1e-3, "emission": l.emission });
                if within {
                    let mut shape = scenes::cuboid(min, max);
                    shape["interior"] = json!(name);
                    scenes::add(&mut scene, "shapes", shape);
                } else {
                    params["bounds"] = json!([min, max].concat());
                }
                scenes::medium(&mut scene, &name, params);
            }
            let how = if within { "interiors" } else { "bounds" };
            cases.push((format!("{what}, {how}"), scene, radiance(layers)));
        }
    }
    let mut out = Table::new("what_glows_behind_boundaries");
    let found = each(&cases, |(name, scene, exact)| {
        harness::measure(scene, name, &Precision::of(*exact))
    });
    for ((name, _, exact), m) in cases.iter().zip(&found) {
        let lanes = [0, 1, 2].map(|k| (k, exact[k]));
        out.row(name, m, &lanes, &Precision::of(*exact));
    }
    out.assert();
}

/// A box of ink below the plane z = 1, its right half of all that a camera at the origin sees.
fn ink(camera: Value) -> Value {
    let mut scene = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
    scene["camera"] = camera;
    let mut shape = scenes::cuboid([0.0, -9.0, -3.0], [9.0, 9.0, 1.0]);
    shape["interior"] = json!("ink");
    scenes::add(&mut scene, "shapes", shape);
    scenes::add(&mut scene, "lights", scenes::dome(1.0));
    scenes::medium(&mut scene, "ink", json!({ "sigma_t": 0.5, "albedo": 0 }));
    scene
}

/// Rays of one camera that start in a medium and outside of it.
#[test]
fn cameras_half_inside() {
    let through = (-1.5f64).exp();
    let parallel = json!({
        "type": "orthographic", "origin": [0, 0, 0], "target": [0, 0, -1], "up": [0, 1, 0], "width": 8
    });
    let ready = harness::build(&ink(parallel)).unwrap_or_else(|e| panic!("{e}"));
    let film = ready.render(1, 0, harness::BATCH).film;
    for i in 0..(harness::EDGE * harness::EDGE) {
        let exact = match i % harness::EDGE {
            x if x < harness::EDGE / 2 => 1.0,
            _ => through,
        };
        let found = film.estimate(i as usize).mean[0];
        assert!((found / exact - 1.0).abs() < 1e-5, "{i}: {found} {exact}");
    }
    // All rays of a lens that is focused so far away are parallel.
    let mut lens = scenes::camera([0.0; 3], [0.0, 0.0, -1.0], 1e-6);
    (lens["lens_radius"], lens["focus_distance"]) = (json!(0.5), json!(1e6));
    let exact = [0.5 * (1.0 + through); 3];
    let precision = Precision::of(exact);
    let m = harness::measure(&ink(lens), "lens half inside", &precision);
    let mut out = Table::new("cameras_half_inside");
    out.row("lens", &m, &[(0, exact[0])], &precision);
    out.assert();
}

/// A lamp in the middle of an absorbing ball, whose walks the integrators connect to the camera from the lamp itself.
#[test]
fn lamps_inside() {
    let exact = [(-1f64).exp(); 3];
    let precision = Precision::of(exact);
    let cases = ["pt", "light", "bdpt"].map(|integrator| {
        let mut scene = scenes::scene([0.0, 0.0, 4.0], [0.0, 0.0, -1.0]);
        scene["camera"]["fov_x_deg"] = json!(0.05);
        scene["integrator"] = json!({ "plugin": integrator });
        let mut ball = json!({ "type": "sphere", "center": [0, 0, 0], "radius": 1 });
        ball["interior"] = json!("smoke");
        scenes::add(&mut scene, "shapes", ball);
        scenes::add(
            &mut scene,
            "shapes",
            json!({ "type": "disk", "center": [0, 0, 0], "normal": [0, 0, 1], "radius": 0.004, "emission": 1 }),
        );
        scenes::medium(&mut scene, "smoke", json!({ "sigma_t": 1, "albedo": 0 }));
        (integrator, scene)
    });
    let found = each(&cases, |(name, scene)| {
        harness::measure(scene, name, &precision)
    });
    let mut out = Table::new("lamps_inside");
    for ((name, _), m) in cases.iter().zip(&found) {
        out.row(name, m, &[(0, exact[0])], &precision);
    }
    out.assert();
}

//! Paths that neighbouring pixels share (`pt`, parameter `reuse`): the mean is that of paths that share nothing, the error is less.
//!
//! The pixels of a block err alike, so regions' means are compared over seeds, by Welch's t-test. Films of 24 × 24 pixels have tiles
//! that blocks do not divide.

use crate::agreement::{ball, bsdf, cloud, fog, outdoors, regions, room, wall, welch};
use crate::{harness, scenes};
use resolvent_tests::{Moments, Suite};
use serde_json::{Value, json};

fn pt(params: Value) -> Value {
    json!({ "plugin": "pt", "params": params })
}

/// A matt room with a lamp that has no edges to be seen.
fn point_light() -> Value {
    let mut s = room(false);
    let point = json!({ "type": "point", "position": [0.2, -0.3, 0.5], "intensity": [1, 2, 3] });
    scenes::add(&mut s, "lights", point);
    s
}

/// A matt room where much is hidden from most places.
fn crowded() -> Value {
    let mut s = room(true);
    for (corner, u, v, material) in [
        ([-0.6, -0.5, -1.0], [0, 1, 0], [0, 0, 1], "red"),
        ([-0.2, 0.4, -1.0], [1, 0, 0], [0, 0, 1], "white"),
        ([0.3, -0.8, -0.7], [0, 1, 0], [0, 0, 1], "green"),
    ] {
        wall(&mut s, corner, u, v, material);
    }
    s
}

/// Surfaces that are neither matt nor smooth, those that are, and both at once.
fn shiny() -> Value {
    let mut s = room(true);
    bsdf(
        &mut s,
        "gloss",
        "principled",
        json!({ "base_color": [0.6, 0.4, 0.2], "roughness": 0.35, "clearcoat": 0.7 }),
    );
    bsdf(&mut s, "glass", "dielectric", json!({ "ior": 1.5 }));
    bsdf(
        &mut s,
        "frosted",
        "rough-dielectric",
        json!({ "roughness": 0.3, "ior": 1.5, "thin": true }),
    );
    bsdf(
        &mut s,
        "metal",
        "conductor",
        json!({ "metal": "Cu", "roughness": 0.25 }),
    );
    bsdf(
        &mut s,
        "mirror",
        "conductor",
        json!({ "metal": "Al", "roughness": 0.0 }),
    );
    bsdf(
        &mut s,
        "half",
        "mix",
        json!({ "weight": 0.5, "a": { "plugin": "diffuse" },
                "b": { "plugin": "conductor", "params": { "metal": "Ag", "roughness": 0.0 } } }),
    );
    for (shape, material) in [(0, "gloss"), (2, "half"), (3, "metal")] {
        s["shapes"][shape]["material"] = json!(material);
    }
    ball(&mut s, [-0.4, 0.2, -0.6], 0.35, "glass", None);
    ball(&mut s, [0.5, -0.2, -0.7], 0.25, "mirror", None);
    let pane = json!({ "type": "rectangle", "corner": [0.1, -0.3, -0.4], "edge_u": [0.7, 0.2, 0],
                       "edge_v": [0.1, 0, 0.7], "material": "frosted" });
    scenes::add(&mut s, "shapes", pane);
    s
}

/// Sky and sun, thin sheets that are seen and lit from both sides, a lens and a wide filter.
fn sheets() -> Value {
    let mut s = outdoors();
    s["camera"]["lens_radius"] = json!(0.1);
    s["camera"]["focus_distance"] = json!(3.6);
    s["film"]["filter"] = json!({ "type": "gaussian", "radius": 1.5, "sigma": 0.5 });
    scenes::diffuse(&mut s, "leaf", json!([0.2, 0.7, 0.1]));
    bsdf(
        &mut s,
        "lattice",
        "mask",
        json!({ "opacity": 0.6, "bsdf": { "plugin": "diffuse" } }),
    );
    wall(&mut s, [-0.8, 0.0, -0.9], [1, 0, 0], [0, 0, 1], "leaf");
    wall(&mut s, [0.2, -0.5, -0.8], [0, 1, 0], [0, 0, 1], "lattice");
    scenes::add(&mut s, "lights", scenes::dome(json!([0.5, 0.6, 0.9])));
    scenes::add(&mut s, "lights", scenes::beam([0.3, 0.4, -0.9], 2.0));
    s
}

/// Fog that fills a room, glows, and ends at walls and at what stands in it.
fn foggy(glows: bool) -> Value {
    let mut s = crowded();
    fog(&mut s, json!(0.9), json!([0.95, 0.9, 0.8]), 0.5);
    if glows {
        s["media"]["fog"]["params"]["emission"] = json!([0.3, 0.2, 0.1]);
    }
    s
}

/// Two clouds that overlap, in a room, seen from within.
fn clouds() -> Value {
    let mut s = room(true);
    s["camera"] = scenes::camera([0.2, -0.8, 0.1], [-0.2, 1.0, -0.1], 70.0);
    for (name, sigma_t, seed, g) in [("a", 6, 4, 0.6), ("b", 9, 9, -0.2)] {
        let params =
            json!({ "sigma_t": sigma_t, "albedo": 0.97, "seed": seed, "phase": scenes::hg(g) });
        cloud(&mut s, name, params);
    }
    s
}

/// A cloud with peaked scattering in the sun, whose light walks look for by branches, before the sky.
fn sunny() -> Value {
    let mut s = outdoors();
    let params = json!({ "sigma_t": 8, "albedo": 0.99, "phase": scenes::hg(0.85) });
    cloud(&mut s, "cloud", params);
    scenes::add(&mut s, "lights", scenes::beam([0.3, 0.4, -0.9], 2.0));
    scenes::add(&mut s, "lights", scenes::dome(json!([0.3, 0.4, 0.6])));
    s
}

/// Milk in rough glass, and a ball of it without glass.
fn milk() -> Value {
    let mut s = room(true);
    let params = json!({ "roughness": 0.35, "ior": 1.5 });
    bsdf(&mut s, "glass", "rough-dielectric", params);
    bsdf(&mut s, "nothing", "null", json!({}));
    let params = json!({ "sigma_t": 4, "albedo": [0.97, 0.95, 0.9], "phase": scenes::hg(0.5) });
    scenes::medium(&mut s, "milk", params);
    ball(&mut s, [-0.3, 0.0, -0.5], 0.45, "glass", Some("milk"));
    ball(&mut s, [0.5, 0.1, 0.2], 0.35, "nothing", Some("milk"));
    s
}

#[test]
fn sharing_changes_no_mean() {
    let two = json!({ "max_depth": 2 });
    let cases = [
        ("crowded room", crowded(), json!({}), 3, 128),
        ("crowded room, two events", crowded(), two, 4, 64),
        ("point light", point_light(), json!({}), 2, 64),
        (
            "no connections",
            room(true),
            json!({ "sample_lights": false }),
            2,
            64,
        ),
        ("shiny room", shiny(), json!({}), 4, 256),
        ("sheets", sheets(), json!({}), 3, 128),
        ("fog", foggy(false), json!({}), 4, 64),
        ("fog that glows", foggy(true), json!({}), 3, 48),
        ("clouds", clouds(), json!({}), 3, 32),
        ("cloud in the sun", sunny(), json!({}), 4, 48),
        ("milk", milk(), json!({}), 3, 48),
    ];
    let only = std::env::var("RESOLVENT_CASE").unwrap_or_default();
    let mut suite = Suite::new();
    for (name, scene, params, edge, spp) in cases {
        if !name.contains(&only) {
            continue;
        }
        let spp = if cfg!(debug_assertions) { 8 } else { spp };
        let alone = regions(&scene, &pt(params.clone()), spp, 0, 1000);
        let mut sharing = params;
        sharing["reuse"] = json!(edge);
        let shared = regions(&scene, &pt(sharing), spp, 0, 2000);
        let sum = |m: &[Moments]| m.iter().map(Moments::mean).sum::<f64>();
        let ratio = sum(&shared) / sum(&alone);
        let mut least = 1f64;
        for (k, (a, b)) in shared.iter().zip(&alone).enumerate() {
            let p = welch(a, b);
            least = least.min(p);
            let what = format!(
                "{name}: shared {:.5} +- {:.5}, alone {:.5} +- {:.5} in region {} lane {}",
                a.mean(),
                a.standard_error(),
                b.mean(),
                b.standard_error(),
                k / 3,
                k % 3
            );
            suite.p_value(what, p);
        }
        let error = alone.iter().map(|m| m.standard_error() / m.mean());
        let error = 100.0 * error.sum::<f64>() / alone.len() as f64;
        println!("reuse: {name}, ratio {ratio:.5}, regions to {error:.2} %, least p {least:.1e}");
    }
    let rejected = suite.rejected(1e-3);
    assert!(rejected.is_empty(), "{rejected:#?}");
}

/// Mean over the pixels of their variance over seeds, relative to the mean's square.
fn noise(params: Value) -> f64 {
    let mut s = point_light();
    s["film"]["resolution"] = json!([48, 48]);
    s["integrator"] = pt(params);
    let ready = harness::build(&s).unwrap_or_else(|e| panic!("{e}"));
    let films: Vec<_> = (0..6).map(|seed| ready.render(seed, 0, 16).film).collect();
    let of = |i: usize| {
        let m = Moments::of(films.iter().map(|f| f.estimate(i).mean[1]));
        m.variance() / (m.mean().powi(2) + 0.01)
    };
    (0..48 * 48).map(of).sum::<f64>() / f64::from(48 * 48)
}

/// In a matt room most of the error comes from where a path goes after its first vertex: sixteen pixels that share have a fraction of it.
#[test]
fn sharing_takes_most_of_the_noise() {
    let (alone, shared) = (noise(json!({})), noise(json!({ "reuse": 4 })));
    println!(
        "reuse: squared error alone {alone:.5}, shared {shared:.5}, ratio {:.2}",
        alone / shared
    );
    assert!(alone > 4.0 * shared, "{alone} to {shared}");
}

/// Pixels of a small film of this scene by `pt` with these parameters, on so many threads.
fn pixels(scene: &Value, params: Value, threads: usize) -> Vec<[f64; 3]> {
    let mut s = scene.clone();
    s["film"]["resolution"] = json!([40, 24]);
    s["integrator"] = pt(params);
    let ready = harness::build(&s).unwrap_or_else(|e| panic!("{e}"));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let film = pool
        .expect("threads")
        .install(|| ready.render(7, 0, 32).film);
    (0..40 * 24).map(|i| film.estimate(i).mean).collect()
}

/// Blocks are made of pixels and samples alone. Where media tell lanes apart nothing is shared.
#[test]
fn sharing_is_deterministic_and_leaves_coloured_media_alone() {
    for scene in [shiny(), foggy(true)] {
        let shared = |threads| pixels(&scene, json!({ "reuse": 3 }), threads);
        let one = shared(1);
        assert_eq!(one, shared(3));
        assert_ne!(one, pixels(&scene, json!({}), 2));
    }
    let mut coloured = room(true);
    fog(&mut coloured, json!([0.5, 0.7, 1.5]), json!(0.9), 0.0);
    let alone = pixels(&coloured, json!({}), 2);
    assert_eq!(alone, pixels(&coloured, json!({ "reuse": 3 }), 2));
}

//! Integrators that share nothing but the scene's operators must agree: `pt` walks from the sensor, `light` from lights, `bdpt`
//! joins both, `mlt` runs Markov chains over them.
//!
//! Every scene is rendered with several seeds by each; regions' means, of all light and of light by scattering order, over the seeds are compared by Welch's t-test, which
//! makes no assumption on how a picture's pixels hang together. All comparisons of all scenes are one family.

use crate::harness;
use crate::scenes;
use crate::student;
use resolvent_tests::{Moments, Suite};
use serde_json::{Value, json};

/// Edge of the film, and of a region.
const EDGE: u32 = 24;
const REGION: u32 = 8;
/// Layers by scattering order: not scattered, once, twice, and more often.
const LAYERS: usize = 4;
/// Pictures of each integrator; four times as many with `RESOLVENT_FULL`.
const SEEDS: u64 = 8;

/// `bdpt` with weights of approximate depths.
const DEPTH: &str = "bdpt by depth";

struct Case {
    name: &'static str,
    scene: Value,
    /// Samples per pixel of `pt`; the others have as many, `light` three times.
    spp: u32,
    /// What cannot see all of it, and why.
    without: &'static [(&'static str, &'static str)],
}

/// A room 2 × 2 × 2, open towards the camera, with a lamp below its ceiling.
pub fn room(lamp: bool) -> Value {
    let mut s = scenes::scene([0.0; 3], [0.0, 1.0, 0.0]);
    s["camera"] = scenes::camera([0.0, -3.6, 0.0], [0.0, 1.0, 0.0], 39.0);
    s["film"]["resolution"] = json!([EDGE, EDGE]);
    for (name, c) in [
        ("white", [0.73, 0.73, 0.73]),
        ("red", [0.63, 0.06, 0.05]),
        ("green", [0.14, 0.45, 0.09]),
    ] {
        scenes::diffuse(&mut s, name, json!(c));
    }
    for (corner, u, v, material) in [
        ([-1, -1, -1], [2, 0, 0], [0, 2, 0], "white"),
        ([-1, -1, 1], [0, 2, 0], [2, 0, 0], "white"),
        ([-1, 1, -1], [2, 0, 0], [0, 0, 2], "white"),
        ([-1, -1, -1], [0, 2, 0], [0, 0, 2], "red"),
        ([1, -1, -1], [0, 0, 2], [0, 2, 0], "green"),
    ] {
        wall(&mut s, corner.map(f64::from), u, v, material);
    }
    if lamp {
        let lamp = json!({ "type": "rectangle", "corner": [-0.3, -0.3, 0.99],
                           "edge_u": [0, 0.6, 0], "edge_v": [0.6, 0, 0], "radiance": [17, 12, 4] });
        scenes::add(&mut s, "lights", lamp);
    }
    s
}

pub fn wall(s: &mut Value, corner: [f64; 3], u: [i32; 3], v: [i32; 3], material: &str) {
    let shape = json!({ "type": "rectangle", "corner": corner, "edge_u": u, "edge_v": v,
                        "material": material });
    scenes::add(s, "shapes", shape);
}

pub fn ball(s: &mut Value, center: [f64; 3], radius: f64, material: &str, interior: Option<&str>) {
    let mut shape =
        json!({ "type": "sphere", "center": center, "radius": radius, "material": material });
    if let Some(interior) = interior {
        shape["interior"] = json!(interior);
    }
    scenes::add(s, "shapes", shape);
}

pub fn fog(s: &mut Value, sigma_t: Value, albedo: Value, g: f64) {
    let params = json!({ "sigma_t": sigma_t, "albedo": albedo, "phase": scenes::hg(g),
                         "bounds": [-0.999, -0.999, -0.999, 0.999, 0.999, 0.98] });
    scenes::medium(s, "fog", params);
}

pub fn cloud(s: &mut Value, name: &str, params: Value) {
    let mut all = json!({ "kind": "cloud", "bounds": [-0.8, -0.8, -0.8, 0.8, 0.8, 0.6] });
    for (k, v) in params.as_object().into_iter().flatten() {
        all[k] = v.clone();
    }
    s["media"][name] = json!({ "plugin": "procedural", "params": all });
}

pub fn bsdf(s: &mut Value, name: &str, plugin: &str, params: Value) {
    s["materials"][name] = json!({ "plugin": plugin, "params": params });
}

pub fn outdoors() -> Value {
    let mut s = scenes::scene([0.0; 3], [0.0, 1.0, 0.0]);
    s["camera"] = scenes::camera([0.0, -3.6, 0.3], [0.0, 1.0, -0.1], 45.0);
    s["film"]["resolution"] = json!([EDGE, EDGE]);
    scenes::diffuse(&mut s, "ground", json!([0.5, 0.4, 0.3]));
    wall(&mut s, [-1.5, -1.5, -1.0], [3, 0, 0], [0, 3, 0], "ground");
    s
}

fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    let mut add = |name, scene, spp, without| {
        all.push(Case {
            name,
            scene,
            spp,
            without,
        });
    };
    add("cornell box", room(true), 32, &[]);

    let mut s = room(true);
    fog(&mut s, json!(0.7), json!(0.9), 0.3);
    add("box with fog", s, 24, &[]);

    let mut s = room(true);
    fog(&mut s, json!(0.7), json!(0.9), 0.3);
    s["camera"] = json!({ "type": "orthographic", "origin": [0.3, -3.6, 0.2], "target": [0, 1, 0],
                          "up": [0, 0, 1], "width": 2.6, "shift": [0.1, -0.05] });
    s["film"]["pixel_aspect"] = json!(1.25);
    add("box seen by parallel rays", s, 24, &[]);

    let mut s = room(false);
    fog(&mut s, json!(0.3), json!(0.9), 0.0);
    for lamp in [
        json!({ "type": "disk", "center": [-0.4, 0, 0.9], "normal": [0, 0, -1], "radius": 0.25,
                "emission": [40, 30, 20],
                "shaping": { "axis": [0.2, -0.2, -1], "angle_deg": 110, "softness": 0.5,
                             "focus": 2, "focus_tint": [0.3, 0, 0] } }),
        json!({ "type": "sphere", "center": [0.5, 0.2, 0.2], "radius": 0.15, "emission": [20, 24, 40],
                "shaping": { "axis": [0.3, -1, -0.5], "angle_deg": 160, "softness": 1 } }),
    ] {
        scenes::add(&mut s, "shapes", lamp);
    }
    add("lamps that favour directions", s, 32, &[]);

    let mut s = room(true);
    bsdf(
        &mut s,
        "glass",
        "rough-dielectric",
        json!({ "roughness": 0.35, "ior": 1.5 }),
    );
    scenes::medium(
        &mut s,
        "milk",
        json!({ "sigma_t": [4, 5, 6], "albedo": [0.97, 0.95, 0.9],
                                           "phase": scenes::hg(0.5) }),
    );
    ball(&mut s, [0.1, 0.0, -0.4], 0.55, "glass", Some("milk"));
    add("rough glass of milk", s, 32, &[]);

    let mut s = room(true);
    bsdf(
        &mut s,
        "glass",
        "rough-dielectric",
        json!({ "roughness": 0.25, "ior": 1.5 }),
    );
    fog(&mut s, json!(0.6), json!(0.9), 0.0);
    ball(&mut s, [0.0, 0.0, 0.35], 0.4, "glass", None);
    add("caustic through rough glass into fog", s, 48, &[]);

    let mut s = room(true);
    cloud(
        &mut s,
        "cloud",
        json!({ "sigma_t": [3, 8, 20], "albedo": [0.98, 0.9, 0.6],
                                   "phase": scenes::hg(0.6) }),
    );
    add("chromatic cloud under an area light", s, 24, &[]);

    let mut s = room(true);
    s["camera"] = scenes::camera([0.2, -0.8, 0.1], [-0.2, 1.0, -0.1], 70.0);
    fog(&mut s, json!([0.5, 1.0, 2.0]), json!(0.9), 0.5);
    add("camera inside a chromatic medium", s, 24, &[]);

    let mut s = room(true);
    cloud(
        &mut s,
        "a",
        json!({ "sigma_t": 6, "albedo": 0.98, "seed": 4 }),
    );
    cloud(
        &mut s,
        "b",
        json!({ "sigma_t": [8, 2, 1], "albedo": [0.5, 0.9, 0.95], "seed": 9 }),
    );
    fog(&mut s, json!(0.3), json!(0.8), -0.3);
    add("overlapping clouds and fog", s, 16, &[]);

    let mut s = room(false);
    cloud(
        &mut s,
        "cloud",
        json!({ "sigma_t": 5, "albedo": 0.95, "phase": scenes::hg(0.7) }),
    );
    let bulb = json!({ "type": "sphere", "center": [0.1, 0, -0.1], "radius": 0.15,
                       "emission": [9, 8, 7] });
    scenes::add(&mut s, "shapes", bulb);
    add("sphere light inside a cloud", s, 24, &[]);

    let mut s = room(false);
    for i in 0..40 {
        let k = f64::from(i);
        let at = [
            0.9 * (2.4 * k).sin(),
            0.9 * (1.7 * k + 1.0).cos(),
            0.9 * (0.9 * k).sin(),
        ];
        let value = [0.05 + 0.02 * (k % 5.0), 0.06, 0.1 - 0.015 * (k % 5.0)];
        let light = json!({ "type": "point", "position": at, "intensity": value });
        scenes::add(&mut s, "lights", light);
    }
    add("many lights", s, 48, &[]);

    let mut s = room(true);
    bsdf(
        &mut s,
        "mirror",
        "conductor",
        json!({ "metal": "Al", "roughness": 0.0 }),
    );
    for i in [2, 3, 4] {
        s["shapes"][i]["material"] = json!("mirror");
    }
    add(
        "mirror box",
        s,
        96,
        &[("light", "no walk from a light is seen in a mirror")],
    );

    let mut s = room(true);
    bsdf(&mut s, "glass", "dielectric", json!({ "ior": 1.5 }));
    fog(&mut s, json!(0.5), json!(0.9), 0.2);
    ball(&mut s, [0.0, 0.0, -0.3], 0.5, "glass", None);
    add(
        "smooth glass in fog",
        s,
        128,
        &[("light", "no walk from a light is seen through smooth glass")],
    );

    let mut s = outdoors();
    cloud(
        &mut s,
        "cloud",
        json!({ "sigma_t": 8, "albedo": 0.99, "phase": scenes::hg(0.6) }),
    );
    scenes::add(
        &mut s,
        "lights",
        json!({ "type": "distant", "to_light": [0.4, -0.5, 0.8],
                                           "irradiance": [3, 2.8, 2.4], "angle_deg": 2.0 }),
    );
    scenes::add(&mut s, "lights", scenes::dome(json!([0.3, 0.4, 0.6])));
    add("cloud under sun and sky", s, 24, &[]);

    let mut s = outdoors();
    s["camera"]["lens_radius"] = json!(0.15);
    s["camera"]["focus_distance"] = json!(3.6);
    s["film"]["filter"] = json!({ "type": "gaussian", "radius": 1.5, "sigma": 0.5 });
    bsdf(
        &mut s,
        "gold",
        "conductor",
        json!({ "metal": "Au", "roughness": 0.3 }),
    );
    ball(&mut s, [0.1, 0.2, -0.4], 0.6, "gold", None);
    scenes::add(&mut s, "lights", scenes::beam([0.3, 0.4, -0.9], 3.0));
    scenes::add(
        &mut s,
        "lights",
        json!({ "type": "rectangle", "corner": [-1.4, 0.9, 0.2],
        "edge_u": [0.8, 0, 0], "edge_v": [0, 0, 0.8], "radiance": [3, 4, 5], "two_sided": true }),
    );
    add("lens, wide filter, rough gold", s, 32, &[]);

    let mut s = room(true);
    fog(&mut s, json!([0.2, 0.6, 1.2]), json!(0.0), 0.0);
    add("fog that absorbs only", s, 24, &[]);

    let mut s = room(true);
    fog(&mut s, json!(0.8), json!(0.7), 0.0);
    s["media"]["fog"]["params"]["emission"] = json!([0.3, 0.2, 0.1]);
    add(
        "fog that glows",
        s,
        48,
        &[("light", "light from media is met, not sent")],
    );
    all
}

/// Means of the regions of pictures with seeds from `first` on, lane by lane: of all light, and of each of `layers` layers by scattering
/// order, 0 or at least 2.
pub fn regions(
    scene: &Value,
    integrator: &Value,
    spp: u32,
    layers: usize,
    first: u64,
) -> Vec<Moments> {
    let mut s = scene.clone();
    s["integrator"] = integrator.clone();
    if layers > 0 {
        s["film"]["aovs"] = json!([format!("orders:{}", layers - 2)]);
    }
    let ready = harness::build(&s).unwrap_or_else(|e| panic!("{e}"));
    let across = EDGE / REGION;
    let one = (across * across * 3) as usize;
    let mut out = vec![Moments::default(); one * (1 + layers)];
    let seeds = if harness::full() { 4 * SEEDS } else { SEEDS };
    for seed in 0..seeds {
        let film = ready.render(first + seed, 0, spp).film;
        for (k, m) in out.iter_mut().enumerate() {
            let (layer, region, lane) = (k / one, (k % one) as u32 / 3, k % 3);
            let (x0, y0) = (region % across * REGION, region / across * REGION);
            let mut sum = 0.0;
            for i in 0..REGION * REGION {
                let (x, y) = (x0 + i % REGION, y0 + i / REGION);
                let i = (y * EDGE + x) as usize;
                let found = match layer {
                    0 => film.estimate(i).mean,
                    _ => film.order(i, layer - 1),
                };
                sum += found[lane];
            }
            m.add(sum / f64::from(REGION * REGION));
        }
    }
    out
}

/// Probability that two means of independent samples differ as much by chance (Welch 1947).
pub fn welch(a: &Moments, b: &Moments) -> f64 {
    let (va, vb) = (a.standard_error().powi(2), b.standard_error().powi(2));
    if va + vb == 0.0 {
        return f64::from(u8::from(a.mean() == b.mean()));
    }
    // Rounding of the sums.
    let gap = ((a.mean() - b.mean()).abs() - 1e-6 * a.mean().abs()).max(0.0);
    let freedom = |m: &Moments| m.count() as f64 - 1.0;
    student::difference(gap, [(va, freedom(a)), (vb, freedom(b))]).1
}

#[test]
fn integrators_agree() {
    let mut suite = Suite::new();
    let only = std::env::var("RESOLVENT_CASE").ok();
    for case in cases() {
        if only
            .as_ref()
            .is_some_and(|o| !case.name.contains(o.as_str()))
        {
            continue;
        }
        let spp = if cfg!(debug_assertions) { 16 } else { case.spp };
        let reference = regions(&case.scene, &json!({ "plugin": "pt" }), spp, LAYERS, 1000);
        let one = reference.len() / (1 + LAYERS);
        let mut line = format!("agreement: {}", case.name);
        for (integrator, factor) in [("bdpt", 1), (DEPTH, 1), ("mlt", 1), ("light", 3)] {
            if let Some((_, why)) = case.without.iter().find(|w| w.0 == integrator) {
                line += &format!(", without {integrator}: {why}");
                continue;
            }
            let mut plugin = json!({ "plugin": integrator.split(' ').next() });
            if integrator == DEPTH {
                // Weights that know media only approximately are as unbiased: held in media that lanes see differently, that
                // overlap, and that fill a shape.
                if !["chromatic cloud", "overlapping", "milk"]
                    .iter()
                    .any(|n| case.name.contains(n))
                {
                    continue;
                }
                plugin["params"] = json!({ "media_weights": "depth" });
            }
            let found = regions(&case.scene, &plugin, spp * factor, LAYERS, 1000);
            let mut least = (1.0f64, 0);
            for (k, (a, b)) in found.iter().zip(&reference).enumerate() {
                let p = welch(a, b);
                if p < least.0 {
                    least = (p, k);
                }
                let what = format!(
                    "{}: {integrator} {:.5} +- {:.5}, pt {:.5} +- {:.5} in layer {} region {} lane {}",
                    case.name,
                    a.mean(),
                    a.standard_error(),
                    b.mean(),
                    b.standard_error(),
                    k / one,
                    k % one / 3,
                    k % 3
                );
                suite.p_value(what, p);
            }
            let whole = |m: &[Moments]| m[..one].iter().map(Moments::mean).sum::<f64>();
            let ratio = whole(&found) / whole(&reference);
            line += &format!(
                ", {integrator} {ratio:.4} (p {:.1e} in {})",
                least.0, least.1
            );
        }
        println!("{line}");
    }
    let rejected = suite.rejected(1e-3);
    assert!(rejected.is_empty(), "{rejected:#?}");
}

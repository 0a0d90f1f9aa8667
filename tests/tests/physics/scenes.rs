//! Pieces of scene descriptions.

use crate::harness::EDGE;
use resolvent_image::{BEAUTY, Image};
use serde_json::{Value, json};
use std::sync::OnceLock;

/// Field of view of a camera that sees a single ray, degrees.
const NARROW: f64 = 1e-6;

/// A scene with a camera that sees a single ray; the rest is to be filled in.
pub fn scene(origin: [f64; 3], direction: [f64; 3]) -> Value {
    json!({
        "resolvent": 1,
        "camera": camera(origin, direction, NARROW),
        "film": { "resolution": [EDGE, EDGE] },
        "integrator": { "plugin": "pt" },
        "lights": [],
        "media": {},
        "materials": {},
        "shapes": []
    })
}

/// A camera.
pub fn camera(origin: [f64; 3], direction: [f64; 3], fov: f64) -> Value {
    let target = [0, 1, 2].map(|i| origin[i] + direction[i]);
    let least = (0..3).min_by(|a, b| direction[*a].abs().total_cmp(&direction[*b].abs()));
    let mut up = [0.0; 3];
    up[least.unwrap_or(0)] = 1.0;
    json!({ "type": "perspective", "origin": origin, "target": target, "up": up, "fov_x_deg": fov })
}

/// Light scattered exactly `n` times is all that is measured: the layer of that order.
pub fn scattered(scene: &mut Value, n: u32) {
    scene["integrator"]["params"] = json!({ "max_depth": n });
    scene["film"]["aovs"] = json!([format!("orders:{n}")]);
}

/// Adds to a list of the scene.
pub fn add(scene: &mut Value, list: &str, what: Value) {
    match scene[list].as_array_mut() {
        Some(all) => all.push(what),
        None => panic!("the scene has no list '{list}'"),
    }
}

/// Adds a medium.
pub fn medium(scene: &mut Value, name: &str, params: Value) {
    scene["media"][name] = json!({ "plugin": "homogeneous", "params": params });
}

/// A Henyey–Greenstein phase function.
pub fn hg(g: f64) -> Value {
    json!({ "plugin": "hg", "params": { "g": g } })
}

/// Parameters of a slab 0 ≤ z ≤ 1 that reaches `half_width` sideways.
pub fn slab(tau: f64, albedo: f64, g: f64, half_width: f64) -> Value {
    let w = half_width;
    json!({ "sigma_t": tau, "albedo": albedo, "bounds": [-w, -w, 0, w, w, 1], "phase": hg(g) })
}

/// Parameters of a sphere.
pub fn ball(centre: [f64; 3], radius: f64, sigma_a: f64, sigma_s: f64, g: f64) -> Value {
    json!({
        "sigma_a": sigma_a, "sigma_s": sigma_s, "center": centre, "radius": radius, "phase": hg(g)
    })
}

/// Adds a diffuse material.
pub fn diffuse(scene: &mut Value, name: &str, reflectance: Value) {
    scene["materials"][name] =
        json!({ "plugin": "diffuse", "params": { "reflectance": reflectance } });
}

/// Light of the radiance `value` from everywhere.
pub fn dome(value: impl Into<Value>) -> Value {
    json!({ "type": "environment", "radiance": value.into() })
}

/// Parallel light that travels along `direction`.
pub fn beam(direction: [f64; 3], irradiance: f64) -> Value {
    json!({ "type": "distant", "to_light": direction.map(|x| -x), "irradiance": irradiance })
}

/// Hemispheres of radiance 1 about the z axis: the upper one in the first lane, the lower one in the second, both in the
/// third. `lower` false leaves the lower one dark in all lanes.
pub fn hemispheres(lower: bool) -> Value {
    static FILES: OnceLock<[String; 2]> = OnceLock::new();
    let files = FILES.get_or_init(|| {
        ["both", "upper"].map(|which| {
            let down = if which == "both" { 1.0 } else { 0.0 };
            let mut image = Image::new(2, 2);
            let rows = |up: f32, down: f32| vec![up, up, down, down];
            let channels = [
                ("R", rows(1.0, 0.0)),
                ("G", rows(0.0, down)),
                ("B", rows(1.0, down)),
            ];
            image.push(BEAUTY, channels);
            let name = format!("resolvent-physics-{}-{which}.exr", std::process::id());
            let path = std::env::temp_dir().join(name);
            image
                .write_exr(&path)
                .unwrap_or_else(|e| panic!("cannot write {}: {e}", path.display()));
            path.display().to_string()
        })
    });
    let file = &files[usize::from(!lower)];
    // The image's +y becomes +z.
    json!({
        "type": "environment", "image": file,
        "transform": [{ "rotate_deg": { "axis": [1, 0, 0], "angle": 90 } }]
    })
}

/// A box, wound outwards.
pub fn cuboid(min: [f64; 3], max: [f64; 3]) -> Value {
    let positions: Vec<[f64; 3]> = (0..8)
        .map(|i| [0, 1, 2].map(|k| if i >> k & 1 == 0 { min[k] } else { max[k] }))
        .collect();
    let mut indices = Vec::new();
    for [a, b, c, d] in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        indices.extend([[a, b, c], [a, c, d]]);
    }
    json!({ "type": "mesh", "positions": positions, "indices": indices })
}

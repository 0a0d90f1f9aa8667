//! Scenes that are made at run time: too big to be files, or one of a series.

use crate::error::{Error, Result};
use crate::volume::Ball;
use serde_json::{Value, json};
use std::path::Path;

/// A sequence of numbers in [0, 1) (SplitMix64).
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in the ball of radius 1.
    fn in_ball(&mut self) -> [f64; 3] {
        loop {
            let p = [0; 3].map(|_| 2.0 * self.next() - 1.0);
            if p.iter().map(|x| x * x).sum::<f64>() < 1.0 {
                return p;
            }
        }
    }
}

/// A scene without anything in it.
pub fn scene(resolution: [u32; 2], origin: [f64; 3], target: [f64; 3], fov: f64) -> Value {
    json!({
        "resolvent": 1,
        "camera": {"type": "perspective", "origin": origin, "target": target, "up": [0, 1, 0], "fov_x_deg": fov},
        "film": {"resolution": resolution, "filter": {"type": "box", "radius": 0.5}, "aovs": ["variance"]},
        "sampling": {"spp": 64, "seed": 0},
        "integrator": {"plugin": "pt", "params": {}},
        "lights": [], "materials": {}, "media": {}, "shapes": []
    })
}

/// Reads a scene.
pub fn read(path: &Path) -> Result<Value> {
    let text = std::fs::read(path).map_err(Error::io(path))?;
    serde_json::from_slice(&text).map_err(|e| Error::invalid(format!("{}: {e}", path.display())))
}

/// Writes a scene.
pub fn write(scene: &Value, path: &Path) -> Result<()> {
    std::fs::write(path, scene.to_string()).map_err(Error::io(path))
}

fn sun_and_sky() -> Value {
    json!([
        {"type": "distant", "to_light": [-0.6, 0.7, 0.4], "irradiance": [3, 2.9, 2.7]},
        {"type": "environment", "radiance": [0.1, 0.13, 0.18]}
    ])
}

/// A ball of about `voxels` voxels in the sun, of optical radius about `tau`; the volume is written beside it.
pub fn ball(voxels: f64, tau: f64, resolution: [u32; 2], vdb: &Path) -> Result<Value> {
    if !vdb.is_file() {
        Ball::new(voxels).write(vdb)?;
    }
    let mut s = scene(resolution, [0.0, 0.4, 4.2], [0.0; 3], 34.0);
    s["lights"] = sun_and_sky();
    // The mean value along a radius is about one half.
    s["media"]["ball"] = json!({"plugin": "vdb", "params": {
        "file": vdb, "sigma_t": 2.0 * tau, "albedo": 0.97, "phase": {"plugin": "hg", "params": {"g": 0.6}}
    }});
    Ok(s)
}

/// `count` balls of fog of a radius that overlap in a ball of radius 1, together with as much fog for every count.
pub fn puffs(count: usize, radius: f64, resolution: [u32; 2]) -> Value {
    let mut s = scene(resolution, [0.0, 0.6, 5.0], [0.0; 3], 34.0);
    s["lights"] = sun_and_sky();
    let mut u = Uniform(7);
    for i in 0..count {
        let center = if count == 1 {
            [0.0; 3]
        } else {
            u.in_ball().map(|x| x * (1.0 - radius))
        };
        // Σ σ V is that of one ball of optical radius 5.
        let r = if count == 1 { 1.0 } else { radius };
        let sigma = 5.0 / (count as f64 * r * r * r);
        s["media"][format!("puff {i}")] = json!({"plugin": "homogeneous", "params": {
            "sigma_t": sigma, "albedo": 0.95, "center": center, "radius": r,
            "phase": {"plugin": "hg", "params": {"g": 0.5}}
        }});
    }
    s
}

/// A floor and three balls under `count` point lights of one total power.
pub fn lights(count: usize, resolution: [u32; 2]) -> Value {
    let mut s = scene(resolution, [0.0, 2.2, 6.0], [0.0, 0.3, 0.0], 44.0);
    s["materials"] = json!({
        "floor": {"plugin": "diffuse", "params": {"reflectance": [0.5, 0.48, 0.45]}},
        "clay": {"plugin": "diffuse", "params": {"reflectance": [0.7, 0.4, 0.3]}}
    });
    s["shapes"] = json!([
        {"type": "rectangle", "corner": [-8, 0, 8], "edge_u": [16, 0, 0], "edge_v": [0, 0, -16], "material": "floor"},
        {"type": "sphere", "center": [-1.6, 0.6, 0.3], "radius": 0.6, "material": "clay"},
        {"type": "sphere", "center": [0.1, 0.6, -0.6], "radius": 0.6, "material": "clay"},
        {"type": "sphere", "center": [1.6, 0.6, 0.4], "radius": 0.6, "material": "clay"}
    ]);
    let mut u = Uniform(11);
    let lights = (0..count).map(|_| {
        let position = [
            8.0 * u.next() - 4.0,
            0.3 + 2.7 * u.next(),
            8.0 * u.next() - 4.0,
        ];
        let color = [0; 3].map(|_| (0.4 + u.next()) * 30.0 / count as f64);
        json!({"type": "point", "position": position, "intensity": color})
    });
    s["lights"] = lights.collect();
    s
}

/// A ball of fog without absorption, of optical radius 20, in a constant sky; paths end after `depth` scatterings.
pub fn depth(depth: i64, resolution: [u32; 2]) -> Value {
    let mut s = scene(resolution, [0.0, 0.0, 4.0], [0.0; 3], 30.0);
    s["lights"] = json!([{"type": "environment", "radiance": 1}]);
    s["integrator"]["params"] = json!({"max_depth": depth});
    s["media"]["ball"] = json!({"plugin": "homogeneous", "params": {
        "sigma_t": 20, "albedo": 1, "center": [0, 0, 0], "radius": 1, "phase": {"plugin": "isotropic"}
    }});
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_amount_of_fog_does_not_depend_on_the_count() {
        for count in [1, 10, 1000] {
            let s = puffs(count, 0.3, [8, 8]);
            let media = s["media"].as_object().unwrap();
            assert_eq!(media.len(), count);
            let sum: f64 = media
                .values()
                .map(|m| {
                    let n = |k: &str| m["params"][k].as_f64().unwrap();
                    n("sigma_t") * n("radius").powi(3)
                })
                .sum();
            assert!((sum - 5.0).abs() < 1e-9, "{count}: {sum}");
        }
    }
}

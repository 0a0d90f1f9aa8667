//! Lambertian surfaces without media: closed enclosures, and irradiance from lights.

use crate::harness::{self, Precision, each, list, number, table, text, vector};
use crate::judge::Table;
use crate::scenes;
use serde_json::{Value, json};
use std::f64::consts::PI;

struct Case {
    name: String,
    scene: Value,
    exact: f64,
}

fn run(name: &'static str, cases: &[Case]) {
    let mut out = Table::new(name);
    let precision = |c: &Case| Precision::of([c.exact; 3]).lanes(1);
    let found = each(cases, |c| {
        harness::measure(&c.scene, &c.name, &precision(c))
    });
    for (c, m) in cases.iter().zip(&found) {
        out.row(&c.name, m, &[(0, c.exact)], &precision(c));
    }
    out.assert();
}

/// Triangles of a sphere seen from inside, which is where its normals point: only the outer side of a shape emits.
/// `part` chooses triangles by their centre.
fn shell(radius: f64, part: impl Fn([f64; 3]) -> bool) -> Value {
    let (rows, columns) = (24usize, 48usize);
    let at = |i: usize, j: usize| {
        let (theta, phi) = (
            PI * i as f64 / rows as f64,
            2.0 * PI * j as f64 / columns as f64,
        );
        [
            radius * theta.sin() * phi.cos(),
            radius * theta.sin() * phi.sin(),
            radius * theta.cos(),
        ]
    };
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for i in 0..rows {
        for j in 0..columns {
            let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let centre = [0, 1, 2].map(|k| quad.iter().map(|p| p[k]).sum::<f64>() / 4.0);
            if part(centre) {
                let n = positions.len();
                positions.extend(quad);
                indices.extend([[n, n + 2, n + 1], [n, n + 3, n + 2]]);
            }
        }
    }
    json!({ "type": "mesh", "positions": positions, "indices": indices })
}

/// Six rectangles that face inwards.
fn cuboid(half: [f64; 3]) -> Vec<Value> {
    let mut out = Vec::new();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let (mut corner, mut a, mut b) = ([0.0; 3], [0.0; 3], [0.0; 3]);
            (corner[axis], corner[u], corner[v]) = (side * half[axis], -half[u], -half[v]);
            (a[u], b[v]) = (2.0 * half[u], 2.0 * half[v]);
            let (a, b) = if side < 0.0 { (a, b) } else { (b, a) };
            out.push(json!({ "type": "rectangle", "corner": corner, "edge_u": a, "edge_v": b }));
        }
    }
    out
}

fn finish(scene: &mut Value, mut shape: Value, albedo: f64, exitance: f64) {
    let name = format!("albedo {albedo}");
    scenes::diffuse(scene, &name, json!(albedo));
    shape["material"] = json!(name);
    if exitance > 0.0 {
        shape["emission"] = json!(exitance / PI);
    }
    scenes::add(scene, "shapes", shape);
}

/// Enclosures whose walls emit everywhere: L = M/(π (1 − ρ)), whatever their form. With a limit on bounces, each order.
#[test]
fn closed_surfaces() {
    let mut cases = Vec::new();
    let table = table("surfaces");
    let inside = || scenes::scene([0.1, -0.2, 0.05], [0.3, 0.5, -0.7]);
    for e in list(&table, "sphere_uniform") {
        let [albedo, m] = ["albedo", "exitance_emitted"].map(|k| number(e, k));
        let mut whole = inside();
        finish(&mut whole, shell(number(e, "radius"), |_| true), albedo, m);
        for (bounces, exact) in list(e, "L_by_bounces").iter().enumerate() {
            let mut scene = whole.clone();
            scene["integrator"]["params"] = json!({ "max_depth": bounces });
            let exact = exact.as_f64().unwrap_or(f64::NAN);
            let name = format!("sphere albedo {albedo}, {bounces} bounces");
            cases.push(Case { name, scene, exact });
        }
        let name = format!("sphere albedo {albedo}");
        cases.push(Case {
            name,
            scene: whole,
            exact: number(e, "L"),
        });
    }
    for e in list(&table, "box_uniform") {
        let [albedo, m] = ["albedo", "exitance_emitted"].map(|k| number(e, k));
        let mut scene = inside();
        for wall in cuboid([1.0, 0.7, 2.0]) {
            finish(&mut scene, wall, albedo, m);
        }
        let name = format!("box albedo {albedo}");
        cases.push(Case {
            name,
            scene,
            exact: number(e, "L"),
        });
    }
    run("closed_surfaces", &cases);
}

/// Irradiance on a plane from rectangles, disks, spheres (partly below the horizon too), suns, points and the sky, as the
/// radiance of a receiver of albedo 0.5.
#[test]
fn irradiance() {
    let mut cases = Vec::new();
    let table = table("surfaces");
    for e in list(&table, "irradiance") {
        let normal = if e["receiver_normal"].is_array() {
            vector(e, "receiver_normal")
        } else {
            [0.0, 0.0, 1.0]
        };
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let n = normal.map(|x| x / length);
        // The camera is so near that no light is between.
        let mut scene = scenes::scene(n.map(|x| 1e-3 * x), n.map(|x| -x));
        let radiance = e["L"].clone();
        match text(e, "kind") {
            "rectangle" => {
                let (c, u, v) = (
                    vector(e, "corner"),
                    vector(e, "edge_u"),
                    vector(e, "edge_v"),
                );
                // One-sided lights face the receiver.
                let cross = [
                    u[1] * v[2] - u[2] * v[1],
                    u[2] * v[0] - u[0] * v[2],
                    u[0] * v[1] - u[1] * v[0],
                ];
                let centre = [0, 1, 2].map(|i| c[i] + 0.5 * (u[i] + v[i]));
                let away = (0..3).map(|i| cross[i] * centre[i]).sum::<f64>() > 0.0;
                let (u, v) = if away { (v, u) } else { (u, v) };
                scenes::add(
                    &mut scene,
                    "lights",
                    json!({ "type": "rectangle", "corner": c, "edge_u": u, "edge_v": v, "radiance": radiance }),
                );
            }
            "sphere" => {
                let (sin, cos) = number(e, "angle_from_normal_deg").to_radians().sin_cos();
                let d = number(e, "centre_distance");
                scenes::add(
                    &mut scene,
                    "shapes",
                    json!({
                        "type": "sphere", "center": [d * sin, 0, d * cos], "radius": e["radius"],
                        "emission": radiance
                    }),
                );
            }
            "disk" => {
                let at = [number(e, "lateral_offset"), 0.0, number(e, "height")];
                let disk = json!({
                    "type": "disk", "center": at, "normal": [0, 0, -1], "radius": e["radius"],
                    "emission": radiance
                });
                scenes::add(&mut scene, "shapes", disk);
            }
            "dome" => match list(e, "L_coefficients_in_cos").len() {
                1 => scenes::add(&mut scene, "lights", scenes::dome(1)),
                _ => continue,
            },
            kind @ ("distant" | "distant_disk") => {
                let (sin, cos) = number(e, "angle_from_normal_deg").to_radians().sin_cos();
                let mut light = scenes::beam([-sin, 0.0, -cos], number(e, "E_perp"));
                if kind == "distant_disk" {
                    light["angle_deg"] = json!(2.0 * number(e, "half_angle_deg"));
                }
                scenes::add(&mut scene, "lights", light);
            }
            "point" => {
                let at = [number(e, "lateral_offset"), 0.0, number(e, "height")];
                let light = json!({ "type": "point", "position": at, "intensity": e["intensity"] });
                scenes::add(&mut scene, "lights", light);
                let sigma = number(e, "sigma_t");
                if sigma > 0.0 {
                    // The camera's own ray is in it too, but short.
                    scenes::medium(
                        &mut scene,
                        "fog",
                        scenes::ball([0.0; 3], 10.0, sigma, 0.0, 0.0),
                    );
                    scene["camera"] = scenes::camera([0.0, 0.0, 1e-6], [0.0, 0.0, -1.0], 1e-3);
                }
            }
            _ => continue,
        }
        scenes::diffuse(&mut scene, "receiver", json!(0.5));
        // An infinite plane for what is above it: a small patch.
        let up = if n[0].abs() < 0.5 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        let a = [
            n[1] * up[2] - n[2] * up[1],
            n[2] * up[0] - n[0] * up[2],
            n[0] * up[1] - n[1] * up[0],
        ];
        let b = [
            n[1] * a[2] - n[2] * a[1],
            n[2] * a[0] - n[0] * a[2],
            n[0] * a[1] - n[1] * a[0],
        ];
        let size = 1e-5;
        let corner = [0, 1, 2].map(|i| -0.5 * size * (a[i] + b[i]));
        scenes::add(
            &mut scene,
            "shapes",
            json!({
                "type": "rectangle", "corner": corner, "edge_u": a.map(|x| x * size),
                "edge_v": b.map(|x| x * size), "material": "receiver"
            }),
        );
        let exact = 0.5 / PI * number(e, "E");
        cases.push(Case {
            name: text(e, "name").to_owned(),
            scene,
            exact,
        });
    }
    run("irradiance", &cases);
}

/// A point light in a white-ish sphere: direct and indirect light at four points of its wall.
#[test]
fn sphere_with_a_point_light() {
    let mut cases = Vec::new();
    let table = table("surfaces");
    for e in list(&table, "sphere_point_light") {
        let [radius, albedo, power, offset] =
            ["radius", "albedo", "light_power", "light_offset"].map(|k| number(e, k));
        for w in list(e, "wall") {
            let theta = number(w, "theta_deg");
            let (sin, cos) = theta.to_radians().sin_cos();
            // Beside the centre, so that the light is not on the ray.
            let origin = [0.0, 0.1, 0.0];
            let direction = [radius * sin, -origin[1], radius * cos];
            let mut scene = scenes::scene(origin, direction);
            scenes::add(
                &mut scene,
                "lights",
                json!({ "type": "point", "position": [0, 0, offset], "intensity": power / (4.0 * PI) }),
            );
            let sphere = json!({ "type": "sphere", "center": [0, 0, 0], "radius": radius });
            finish(&mut scene, sphere, albedo, 0.0);
            let name = format!("{} theta {theta}", text(e, "name"));
            cases.push(Case {
                name,
                scene,
                exact: number(w, "L"),
            });
        }
    }
    run("sphere_point_light", &cases);
}

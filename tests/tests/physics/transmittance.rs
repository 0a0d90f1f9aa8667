//! Light that only fades and glows: transmittance and emission-absorption, without noise where media only absorb.

use crate::harness::{self, Measured, Precision, build, list, number, table, text, vector};
use crate::judge::Table;
use crate::scenes;
use serde_json::{Value, json};

/// Relative accuracy asked of transmittances down to 1e-30; what is smaller must be smaller.
const EXACT: f64 = 2e-6;
const LEAST: f64 = 1e-30;

/// A few samples are enough where there is no noise.
pub fn once(scene: &Value, name: &str) -> Measured {
    let ready = build(scene).unwrap_or_else(|e| panic!("{name}: {e}"));
    ready.measure_range(harness::hash(name), 0, 16)
}

/// The lanes of a measurement without noise.
pub fn exactly(out: &mut Table, what: &str, m: &Measured, exact: [f64; 3]) {
    for (lane, value) in exact.into_iter().enumerate() {
        let what = format!("{what} [{lane}]");
        out.near(&what, m.mean[lane], value, EXACT * value + LEAST);
        out.near(
            &format!("{what} noise"),
            m.error[lane],
            0.0,
            EXACT * value + LEAST,
        );
    }
}

/// An absorbing medium in a shape of the table.
fn absorber(shape: &Value, sigma: Value) -> Value {
    let mut p = match text(shape, "kind") {
        "sphere" => json!({ "center": shape["centre"], "radius": shape["radius"] }),
        "box" => {
            let (a, b) = (vector(shape, "min"), vector(shape, "max"));
            json!({ "bounds": [a[0], a[1], a[2], b[0], b[1], b[2]] })
        }
        kind => panic!("unknown shape {kind}"),
    };
    p["sigma_t"] = sigma;
    p["albedo"] = json!(0);
    p
}

/// Rays through spheres and boxes, and rays of given length to an emitting wall.
#[test]
fn transmittance() {
    let mut out = Table::new("transmittance");
    let table = table("analytic");
    let mut rows = 0;
    for e in list(&table, "shapes") {
        if text(&e["profile"], "kind") != "homogeneous" {
            continue;
        }
        let mut s = scenes::scene(vector(e, "ray_origin"), vector(e, "ray_direction"));
        scenes::add(&mut s, "lights", scenes::dome(1));
        scenes::medium(
            &mut s,
            "m",
            absorber(&e["shape"], e["profile"]["sigma_t"].clone()),
        );
        let name = text(e, "name");
        let (m, t) = (once(&s, name), number(e, "transmittance"));
        // Where the ray grazes the sphere by 1e-6 of its radius, f32 moves the camera by up to 3 % of that.
        if name.ends_with("grazing") {
            out.near(name, m.mean[0], t, 0.03 * (1.0 - t));
        } else {
            exactly(&mut out, name, &m, [t; 3]);
            out.near(&format!("{name} coverage"), m.alpha, 1.0 - t, 2e-6);
        }
        rows += 1;
    }
    for e in list(&table, "chromatic_transmittance") {
        let mut s = scenes::scene(vector(e, "ray_origin"), vector(e, "ray_direction"));
        scenes::add(&mut s, "lights", scenes::dome(1));
        scenes::medium(&mut s, "m", absorber(&e["shape"], e["sigma_t"].clone()));
        let name = text(e, "name");
        exactly(&mut out, name, &once(&s, name), vector(e, "transmittance"));
        rows += 1;
    }
    for e in list(&table, "segments") {
        if text(&e["profile"], "kind") != "homogeneous" {
            continue;
        }
        let (a, b) = (vector(e, "start"), vector(e, "end"));
        let d = [0, 1, 2].map(|i| b[i] - a[i]);
        let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
        let mut s = scenes::scene(a, d);
        let all = json!({
            "sigma_t": e["profile"]["sigma_t"], "albedo": 0, "center": a, "radius": 2.0 * length
        });
        scenes::medium(&mut s, "m", all);
        wall(&mut s, a, d.map(|x| x / length), length, json!(1));
        let name = text(e, "name");
        exactly(
            &mut out,
            name,
            &once(&s, name),
            [number(e, "transmittance"); 3],
        );
        rows += 1;
    }
    println!("transmittance: {rows} rays");
    out.assert();
}

/// A wall of the given radiance across the ray.
fn wall(scene: &mut Value, from: [f64; 3], d: [f64; 3], distance: f64, radiance: Value) {
    let up = if d[0].abs() < 0.6 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let u = cross(up, d);
    let v = cross(u, d);
    let size = 0.1 * distance;
    let corner = [0, 1, 2].map(|i| from[i] + distance * d[i] - 0.5 * size * (u[i] + v[i]));
    // (u × v) points back along the ray, to the camera.
    scenes::add(
        scene,
        "lights",
        json!({
            "type": "rectangle", "corner": corner, "edge_u": u.map(|x| x * size),
            "edge_v": v.map(|x| x * size), "radiance": radiance
        }),
    );
}

/// Constant emission along a ray before a background. In grey media there is no noise; with lanes that differ there is.
#[test]
fn emission_and_absorption() {
    let mut out = Table::new("emission_absorption");
    let table = table("analytic");
    for e in list(&table, "emission_absorption") {
        let constant = |v: &Value| number(v, "slope") == 0.0;
        let (sigma, j) = (&e["sigma_t"], &e["emitted_radiance_per_length"]);
        if !(constant(sigma) && constant(j)) {
            continue;
        }
        let s = glowing(e, sigma["at_camera"].clone(), j["at_camera"].clone());
        let name = text(e, "name");
        exactly(&mut out, name, &once(&s, name), [number(e, "L"); 3]);
    }
    for e in list(&table, "chromatic_emission") {
        let s = glowing(
            e,
            e["sigma_t"].clone(),
            e["emitted_radiance_per_length"].clone(),
        );
        let name = text(e, "name");
        let exact = vector(e, "L");
        // Below 1e-6 there is the background alone.
        let p = Precision::of(exact).at_least(1e-12);
        let m = harness::measure(&s, name, &p);
        out.row(name, &m, &[(0, exact[0]), (1, exact[1]), (2, exact[2])], &p);
    }
    out.assert();
}

fn glowing(e: &Value, sigma: Value, emission: Value) -> Value {
    let length = number(e, "length");
    let mut s = scenes::scene([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let w = 0.5 * length;
    let m = json!({
        "sigma_t": sigma, "albedo": 0, "emission": emission, "bounds": [-w, -w, -length, w, w, 0]
    });
    scenes::medium(&mut s, "m", m);
    scenes::add(&mut s, "lights", scenes::dome(e["background"].clone()));
    s
}

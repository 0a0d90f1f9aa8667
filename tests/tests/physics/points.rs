//! Point lights and spheres: single scattering in closed form, and all orders round a point source.

use crate::harness::{self, Precision, each, full, list, number, table, text, vector};
use crate::judge::Table;
use crate::scenes;
use serde_json::{Value, json};

fn run(name: &'static str, cases: &[(String, Value, f64)]) {
    let mut out = Table::new(name);
    let precision = |exact: f64| Precision::of([exact; 3]).lanes(1);
    let found = each(cases, |(n, s, exact)| {
        harness::measure(s, n, &precision(*exact))
    });
    for ((n, _, exact), m) in cases.iter().zip(&found) {
        out.row(n, m, &[(0, *exact)], &precision(*exact));
    }
    out.assert();
}

fn unit(d: [f64; 3]) -> [f64; 3] {
    let l = d.iter().map(|x| x * x).sum::<f64>().sqrt();
    d.map(|x| x / l)
}

/// A point light in an infinite medium, stood for by a sphere of optical radius 30 around camera and light. Rays of finite
/// length end at a black wall.
///
/// Left out by default: the light 0.001 beside the ray and the light behind the camera in a forward medium, whose
/// connections have relative variances of 900 and 140. Left out always: "dense", where the light is 22 mean free paths
/// away and distances that follow the transmittance alone have a relative variance of 1e6.
#[test]
fn point_light_once() {
    let mut cases = Vec::new();
    let table = table("single_scattering");
    for e in list(&table, "point_light") {
        let name = text(e, "name");
        let hard = ["iso_close_pass", "hg09_backward_side"].contains(&name);
        if name == "dense" || hard && !full() {
            continue;
        }
        let [a, s] = ["sigma_a", "sigma_s"].map(|k| number(e, k));
        let (origin, d) = (vector(e, "ray_origin"), unit(vector(e, "ray_direction")));
        let mut scene = scenes::scene(origin, d);
        scenes::scattered(&mut scene, 1);
        let radius = 30.0 / (a + s) + 7.0;
        scenes::medium(
            &mut scene,
            "all",
            scenes::ball(origin, radius, a, s, number(e, "g")),
        );
        let light = json!({
            "type": "point", "position": e["light_position"], "intensity": e["light_intensity"]
        });
        scenes::add(&mut scene, "lights", light);
        if let Some(length) = e["ray_length"].as_f64() {
            // Only rays along z are finite; the wall is small enough not to shade anything.
            assert_eq!(d, [0.0, 0.0, 1.0]);
            scenes::diffuse(&mut scene, "black", json!(0));
            let wall = json!({
                "type": "rectangle", "corner": [-0.01, -0.01, length], "edge_u": [0.02, 0, 0],
                "edge_v": [0, 0.02, 0], "material": "black"
            });
            scenes::add(&mut scene, "shapes", wall);
        }
        cases.push((name.to_owned(), scene, number(e, "L")));
    }
    run("point_light", &cases);
}

/// A sphere under parallel light.
#[test]
fn sphere_once() {
    let mut cases = Vec::new();
    let table = table("single_scattering");
    for e in list(&table, "sphere") {
        let [a, s, g] = ["sigma_a", "sigma_s", "g"].map(|k| number(e, k));
        let mut scene = scenes::scene(vector(e, "ray_origin"), vector(e, "ray_direction"));
        scenes::scattered(&mut scene, 1);
        let ball = scenes::ball(vector(e, "centre"), number(e, "radius"), a, s, g);
        scenes::medium(&mut scene, "ball", ball);
        let beam = scenes::beam(vector(e, "light_direction"), number(e, "E_perp"));
        scenes::add(&mut scene, "lights", beam);
        cases.push((text(e, "name").to_owned(), scene, number(e, "L")));
    }
    run("sphere", &cases);
}

/// All orders round a point source, by reciprocity.
///
/// With ψ(r) the fluence round a source of power 1, a ball of radius R that emits j per length gives its own centre the
/// fluence 4π j ∫ ψ dV = 4π j (1 − P(R))/σ_a, where P(R) is the net power through the sphere R, which the table holds. A
/// camera at the centre sees a 4π-th of it in every direction. Emission is an extinction-free medium of its own, so this is
/// also a test of overlapping media.
///
/// A point light itself would not do: connections to it from everywhere in a medium have weights 1/d² with d³ as the
/// probability to come so near, and so no variance.
#[test]
fn point_source() {
    let mut cases = Vec::new();
    let table = table("point_source");
    for m in list(&table, "media") {
        let [albedo, sigma] = ["albedo", "sigma_t"].map(|k| number(m, k));
        let decay = number(m, "asymptotic_decay_per_length");
        let absorbed = sigma * (1.0 - albedo);
        for f in list(m, "fluence") {
            let distance = number(f, "distance");
            let share = 1.0 - number(f, "net_power_outward");
            if !(absorbed > 0.0 && decay > 0.0) {
                continue;
            }
            // Light that comes back from further out is a part of 1e-5 of the least.
            let radius = distance + 10.0 / sigma + 12.0 / decay;
            let mut scene = scenes::scene([0.0; 3], [0.2, -0.7, 0.4]);
            let all = scenes::ball([0.0; 3], radius, absorbed, sigma * albedo, 0.0);
            scenes::medium(&mut scene, "all", all);
            let glow =
                json!({ "sigma_t": 0, "emission": 1, "center": [0, 0, 0], "radius": distance });
            scenes::medium(&mut scene, "glow", glow);
            let name = format!("point source albedo {albedo} r {distance}");
            cases.push((name, scene, share / absorbed));
        }
    }
    run("point_source", &cases);
}

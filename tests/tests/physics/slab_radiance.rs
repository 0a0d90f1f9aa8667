//! Radiance that leaves slabs under parallel light: all orders of scattering, or one order alone.

use crate::harness::{self, Precision, each, full, hash, list, number, table, text, vector};
use crate::judge::Table;
use crate::scenes;
use serde_json::{Value, json};

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

/// A slab of the entry `e` under its beam, seen where light leaves in direction `exit`.
fn seen(e: &Value, beam: &str, exit: [f64; 3]) -> Value {
    let tau = number(e, "tau");
    let top = exit[2] > 0.0;
    // Over a surface, the camera stands on it: its ray goes through the slab.
    let ground = e["surface_albedo"].as_f64().unwrap_or(0.0);
    let away = if ground > 0.0 && !top { 0.0 } else { 2.0 };
    let start = if top { 1.0 } else { 0.0 };
    let origin = [0, 1, 2].map(|i| if i == 2 { start } else { 0.0 } + away * exit[i]);
    let mut s = scenes::scene(origin, exit.map(|x| -x));
    let w = if tau < 1.0 { 100.0 } else { 30.0 };
    let slab = scenes::slab(tau, number(e, "albedo"), number(e, "g"), w);
    scenes::medium(&mut s, "slab", slab);
    scenes::add(
        &mut s,
        "lights",
        scenes::beam(vector(e, beam), number(e, "E_perp")),
    );
    if ground > 0.0 {
        scenes::diffuse(&mut s, "ground", json!(ground));
        // A little below the camera on the lower side, so that it is not behind the surface.
        let z = -1e-6;
        scenes::add(
            &mut s,
            "shapes",
            json!({
                "type": "rectangle", "corner": [-w, -w, z], "edge_u": [2.0 * w, 0, 0],
                "edge_v": [0, 2.0 * w, 0], "material": "ground"
            }),
        );
    }
    s
}

/// Default part: every fifth view.
#[test]
fn slab_radiance() {
    let mut cases = Vec::new();
    let table = table("slab_radiance");
    for e in list(&table, "entries") {
        for (i, v) in list(e, "views").iter().enumerate() {
            let (mu, phi) = (number(v, "mu"), number(v, "phi_deg"));
            for (side, dir) in [("L_top", "exit_dir_top"), ("L_bottom", "exit_dir_bottom")] {
                let name = format!("{} mu {mu} phi {phi} {side}", text(e, "name"));
                if full() || (i + usize::from(side == "L_top")) % 5 == 0 {
                    let scene = seen(e, "beam_dir", vector(v, dir));
                    cases.push(Case {
                        name,
                        scene,
                        exact: number(v, side),
                    });
                }
            }
        }
    }
    run("slab_radiance", &cases);
}

/// Light scattered exactly n times: the layer of that order, by `pt`, and for a quarter of the values by `bdpt` as well. Default
/// part: every eighth value by a hash of the name, of those above 0.003.
///
/// Left out always: values below 2e-4 and the slab of optical thickness 1e-6, where one path in a million collides.
#[test]
fn slab_orders() {
    let mut cases = Vec::new();
    let table = table("single_scattering");
    for e in list(&table, "slab") {
        for v in list(e, "views") {
            let (mu, phi) = (number(v, "mu"), number(v, "phi_deg"));
            for n in 1..=4 {
                for side in ["top", "bottom"] {
                    let key = format!("L{n}_{side}");
                    let Some(exact) = v[&key].as_f64() else {
                        continue;
                    };
                    let name = format!("{} mu {mu} phi {phi} {key}", text(e, "name"));
                    let part = exact > 3e-3 && hash(&name).is_multiple_of(8);
                    if exact < 2e-4 || number(e, "tau") < 1e-3 || !(full() || part) {
                        continue;
                    }
                    let mut scene =
                        seen(e, "beam_direction", vector(v, &format!("exit_dir_{side}")));
                    scenes::scattered(&mut scene, n);
                    if full() || hash(&name).is_multiple_of(32) {
                        let mut scene = scene.clone();
                        scene["integrator"]["plugin"] = json!("bdpt");
                        let name = format!("{name}, bdpt");
                        cases.push(Case { name, scene, exact });
                    }
                    cases.push(Case { name, scene, exact });
                }
            }
        }
    }
    run("slab_orders", &cases);
}

/// Half-spaces, as slabs so thick that they differ by 1e-5: radiance under a beam, and of an emitting isothermal medium.
/// Default part: every fifth radiance and every second emission.
#[test]
fn half_space() {
    let mut cases = Vec::new();
    let table = table("half_space");
    for m in list(&table, "media") {
        let albedo = number(m, "albedo");
        // Conservative half-spaces have none: light comes back from any depth.
        let Some(tau) = m["slab_thickness_for"]
            .as_array()
            .into_iter()
            .flatten()
            .find(|t| number(t, "relative_error") == 1e-5)
            .and_then(|t| t["tau"].as_f64())
        else {
            continue;
        };
        for (i, v) in list(m, "radiance").iter().enumerate() {
            let (mu0, mu) = (number(v, "mu0"), number(v, "mu"));
            if !(full() || i % 5 == 2) {
                continue;
            }
            let out = (1.0 - mu * mu).sqrt();
            let e = json!({
                "tau": tau, "albedo": albedo, "g": 0, "E_perp": 1,
                "beam": [(1.0 - mu0 * mu0).sqrt(), 0, -mu0]
            });
            cases.push(Case {
                name: format!("half-space albedo {albedo} mu0 {mu0} mu {mu}"),
                scene: seen(&e, "beam", [0.6 * out, 0.8 * out, mu]),
                exact: number(v, "L"),
            });
        }
        for (i, v) in list(m, "emission").iter().enumerate() {
            let mu = number(v, "mu");
            if !(full() || i % 2 == 0) || number(v, "L") == 0.0 {
                continue;
            }
            let d = [-(1.0 - mu * mu).sqrt(), 0.0, -mu];
            let mut s = scenes::scene([-2.0 * d[0], 0.0, 1.0 - 2.0 * d[2]], d);
            // Reflection misses what would go down and up again, emission what comes up only: twice the thickness.
            let tau = 2.0 * tau;
            let mut slab = scenes::slab(tau, albedo, 0.0, 30.0);
            slab["emission"] = json!(tau * (1.0 - albedo));
            scenes::medium(&mut s, "slab", slab);
            let name = format!("half-space albedo {albedo} emission mu {mu}");
            cases.push(Case {
                name,
                scene: s,
                exact: number(v, "L"),
            });
        }
    }
    run("half_space", &cases);
}

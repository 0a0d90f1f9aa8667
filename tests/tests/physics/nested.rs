//! Closed shapes that overlap: the one of the highest priority is there, with its index of refraction and its medium.

use crate::harness::{self, Precision, each};
use crate::judge::Table;
use crate::scenes;
use serde_json::{Value, json};

/// A layer between two heights, wide enough for its sides not to matter.
fn layer(z0: f64, z1: f64) -> Value {
    scenes::cuboid([-3e3, -3e3, z0], [3e3, 3e3, z1])
}

fn add(scene: &mut Value, mut shape: Value, priority: i32, rest: &[(&str, &str)]) {
    shape["priority"] = json!(priority);
    for (key, value) in rest {
        shape[key] = json!(value);
    }
    scenes::add(scene, "shapes", shape);
}

fn dielectric(scene: &mut Value, name: &str, ior: f64) {
    scene["materials"][name] = json!({ "plugin": "dielectric", "params": { "ior": ior } });
}

/// Fresnel's reflectance for unpolarised light that comes from index `n` at the cosine `c` to index `m`, and the cosine there.
fn fresnel(c: f64, n: f64, m: f64) -> (f64, f64) {
    let s2 = (n / m).powi(2) * (1.0 - c * c);
    if s2 >= 1.0 {
        return (1.0, 0.0);
    }
    let t = (1.0 - s2).sqrt();
    let s = (n * c - m * t) / (n * c + m * t);
    let p = (m * c - n * t) / (m * c + n * t);
    (0.5 * (s * s + p * p), t)
}

/// A rectangle that shines upwards, and absorbs.
fn lamp(z: f64) -> Value {
    json!({ "type": "rectangle", "corner": [-80, -80, z], "edge_u": [160, 0, 0], "edge_v": [0, 160, 0], "emission": 1 })
}

struct Case {
    name: String,
    scene: Value,
    exact: f64,
    /// Standard error wanted, relative.
    share: f64,
}

fn run(name: &'static str, cases: &[Case]) {
    let mut out = Table::new(name);
    let precision = |c: &Case| {
        Precision::relative([c.exact; 3], c.share)
            .at_least(1e-4)
            .lanes(1)
    };
    let found = each(cases, |c| {
        harness::measure(&c.scene, &c.name, &precision(c))
    });
    for (c, m) in cases.iter().zip(&found) {
        out.row(&c.name, m, &[(0, c.exact)], &precision(c));
    }
    out.assert();
}

/// A sheet of glass, diamond or air in water, seen from within the water: with Fresnel's reflectances R of water against the sheet and
/// all reflections between its faces, (1 − R)/(1 + R) comes through; nothing beyond the critical angle of air.
#[test]
fn sheets_in_water() {
    let mut cases = Vec::new();
    for (what, inside) in [
        ("glass", 1.5),
        ("diamond", 2.4),
        ("air", 1.0),
        ("water", 1.33),
    ] {
        for degrees in [5.0, 30.0, 47.0, 60.0, 75.0f64] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let mut scene = scenes::scene([-3.0 * sin / cos, 0.3, 3.0], [sin, 0.0, -cos]);
            dielectric(&mut scene, "water", 1.33);
            dielectric(&mut scene, "sheet", inside);
            // What is reflected comes back from so far that it misses the lamp.
            add(
                &mut scene,
                layer(-900.0, 1000.0),
                0,
                &[("material", "water")],
            );
            add(&mut scene, layer(-1.0, 0.0), 1, &[("material", "sheet")]);
            scenes::add(&mut scene, "shapes", lamp(-2.0));
            let (r, _) = fresnel(cos, 1.33, inside);
            cases.push(Case {
                name: format!("{what} at {degrees} degrees"),
                scene,
                exact: (1.0 - r) / (1.0 + r),
                share: 0.003,
            });
        }
    }
    run("sheets_in_water", &cases);
}

/// A glass pane on milk that reaches into it, as modellers do: the same as if they met exactly, in closed form. The milk absorbs; the
/// lamp lies on its ground. Seen from above, and from within the part where both are.
#[test]
fn glass_on_milk() {
    let (glass, milk, sigma) = (1.5, 1.35, 0.7);
    let mut cases = Vec::new();
    for overlap in [0.2, 1e-3] {
        for from_within in [false, true] {
            // (Steeper from within, light is caught in the pane.)
            for degrees in [0.5, 25.0, if from_within { 40.0 } else { 70.0f64 }] {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let z = if from_within {
                    1.0 + 0.5 * overlap
                } else {
                    4.0
                };
                let mut scene = scenes::scene([0.1, 0.2, z], [sin, 0.0, -cos]);
                dielectric(&mut scene, "glass", glass);
                dielectric(&mut scene, "milk", milk);
                scenes::medium(
                    &mut scene,
                    "white",
                    json!({ "sigma_a": sigma, "sigma_s": 0 }),
                );
                let filled = [("material", "milk"), ("interior", "white")];
                add(&mut scene, layer(-1.0, 1.0 + overlap), 2, &filled);
                add(&mut scene, layer(1.0, 2.0), 5, &[("material", "glass")]);
                scenes::add(&mut scene, "shapes", lamp(0.0));
                // Upwards in the glass: U = T₂ L + R₂ R₁ U, radiance growing with the index squared.
                let (r1, in_glass) = if from_within {
                    (fresnel(cos, glass, 1.0).0, cos)
                } else {
                    fresnel(cos, 1.0, glass)
                };
                let (r2, in_milk) = fresnel(in_glass, glass, milk);
                let up = if r2 < 1.0 {
                    let source = (-sigma / in_milk).exp() * (glass / milk).powi(2);
                    (1.0 - r2) * source / (1.0 - r1 * r2)
                } else {
                    0.0
                };
                let exact = if from_within {
                    up
                } else {
                    up * (1.0 - r1) / (glass * glass)
                };
                cases.push(Case {
                    name: format!("overlap {overlap}, within {from_within}, {degrees} degrees"),
                    scene,
                    exact,
                    share: if from_within { 1e-4 } else { 5e-4 },
                });
            }
        }
    }
    run("glass_on_milk", &cases);
}

/// The same with milk that scatters, under a sky: how far the glass reaches in changes nothing.
#[test]
fn the_overlap_does_not_matter() {
    let scene = |overlap: f64, degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let mut scene = scenes::scene([0.1, 0.2, 4.0], [sin, 0.0, -cos]);
        dielectric(&mut scene, "glass", 1.5);
        dielectric(&mut scene, "milk", 1.35);
        let white = json!({ "sigma_a": [0.1, 0.3, 1.0], "sigma_s": 3, "phase": scenes::hg(0.5) });
        scenes::medium(&mut scene, "white", white);
        scenes::add(&mut scene, "lights", scenes::dome(1.0));
        let filled = [("material", "milk"), ("interior", "white")];
        add(&mut scene, layer(-1.0, 1.0 + overlap), 0, &filled);
        add(&mut scene, layer(1.0, 2.0), 1, &[("material", "glass")]);
        scene
    };
    let mut table = Table::new("the_overlap_does_not_matter");
    let found = each(&[10.0, 60.0], |&degrees| {
        let p = Precision::relative([0.5; 3], 0.006);
        [0.9, 0.3, 1e-3].map(|overlap| {
            harness::measure(
                &scene(overlap, degrees),
                &format!("{overlap} {degrees}"),
                &p,
            )
        })
    });
    for [a, b, c] in &found {
        table.same("0.9 and 0.3", a, b);
        table.same("0.9 and 0.001", a, c);
        // A body as thick as that shows its colour.
        table.claim(a.mean[0] > 1.2 * a.mean[2], || format!("{:?}", a.mean));
    }
    table.assert();
}

/// Parts of a ray o + t d within a sphere, as (entry, exit).
fn within(o: [f64; 3], d: [f64; 3], centre: [f64; 3], radius: f64) -> (f64, f64) {
    let f = [0, 1, 2].map(|k| o[k] - centre[k]);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (a, b, c) = (dot(d, d), dot(f, d), dot(f, f) - radius * radius);
    let root = (b * b - a * c).max(0.0).sqrt();
    ((-b - root) / a, (-b + root) / a)
}

/// A block of fog with holes and inclusions, some as copies: what comes through unscattered is exp(−∫σ), where at every point the highest
/// priority counts, and media of equal priority add.
#[test]
fn cut_outs() {
    // (centre, radius, priority, extinction; none: a hole)
    type Ball = ([f64; 3], f64, i32, Option<f64>);
    let block = 0.6;
    let sets: Vec<(&str, Vec<Ball>)> = vec![
        ("a hole", vec![([0.0; 3], 0.8, 1, None)]),
        ("an inclusion", vec![([0.2, 0.1, 0.0], 0.8, 3, Some(1.7))]),
        ("hidden", vec![([0.0, 0.1, 0.3], 0.9, -1, Some(1.7))]),
        ("superposed", vec![([0.0, 0.1, 0.3], 0.9, 0, Some(0.9))]),
        (
            "holes that overlap",
            vec![
                ([-0.3, 0.0, 0.0], 0.6, 1, None),
                ([0.4, 0.1, 0.1], 0.7, 1, None),
            ],
        ),
        (
            "everything",
            vec![
                ([-0.3, 0.0, 0.2], 0.6, 1, None),
                ([0.1, 0.1, -0.1], 0.7, 2, Some(0.4)),
                ([0.5, 0.2, 0.1], 0.4, 3, None),
                ([0.7, 0.0, 0.0], 0.5, 2, Some(1.1)),
                ([0.0, 0.0, 0.0], 0.9, -3, Some(5.0)),
            ],
        ),
    ];
    let views = [
        ([-4.0, 0.1, 0.2], [1.0, 0.02, -0.03]),
        ([3.0, -2.5, 2.0], [-0.9, 0.8, -0.62]),
        // From inside the block, and from inside the balls.
        ([-0.95, 0.3, 0.3], [1.0, -0.2, -0.2]),
        ([0.05, 0.08, 0.03], [0.3, 0.5, 0.6]),
    ];
    let mut cases = Vec::new();
    for (what, balls) in &sets {
        for (v, (o, d)) in views.iter().enumerate() {
            for (mode, albedo) in [("shapes", 0.0), ("copies", 0.0), ("shapes", 0.7)] {
                let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
                let d = d.map(|x| x / length);
                let mut scene = scenes::scene(*o, d);
                // Only what is not scattered at all is kept.
                scenes::scattered(&mut scene, 0);
                scenes::add(&mut scene, "lights", scenes::dome(1.0));
                let medium = |s: f64| json!({ "sigma_t": s, "albedo": albedo });
                scenes::medium(&mut scene, "block", medium(block));
                let cube = scenes::cuboid([-1.0; 3], [1.0; 3]);
                add(&mut scene, cube, 0, &[("interior", "block")]);
                scene["materials"]["hole"] = json!({ "plugin": "null" });
                for (k, (centre, radius, priority, sigma)) in balls.iter().enumerate() {
                    let name = format!("ball {k}");
                    let rest = match sigma {
                        Some(s) => {
                            scenes::medium(&mut scene, &name, medium(*s));
                            ("interior", name.as_str())
                        }
                        None => ("material", "hole"),
                    };
                    let ball =
                        |c: [f64; 3], r: f64| json!({ "type": "sphere", "center": c, "radius": r });
                    if mode == "shapes" {
                        add(&mut scene, ball(*centre, *radius), *priority, &[rest]);
                    } else {
                        let mut unit = ball([0.0; 3], 1.0);
                        unit["priority"] = json!(priority);
                        unit[rest.0] = json!(rest.1);
                        scene["prototypes"][&name] = json!([unit]);
                        let place = json!({ "prototype": name, "transform": [{ "scale": [*radius, -*radius, *radius] }, { "translate": centre }] });
                        match scene["instances"].as_array_mut() {
                            Some(all) => all.push(place),
                            None => scene["instances"] = json!([place]),
                        }
                    }
                }
                // ∫σ piece by piece.
                let (mut near, mut far) = (0.0f64, f64::INFINITY);
                for k in 0..3 {
                    let (a, b) = ((-1.0 - o[k]) / d[k], (1.0 - o[k]) / d[k]);
                    near = near.max(a.min(b));
                    far = far.min(a.max(b));
                }
                let mut parts = vec![(near, far, 0, block)];
                for (centre, radius, priority, sigma) in balls {
                    let (a, b) = within(*o, d, *centre, *radius);
                    parts.push((a.max(0.0), b.max(0.0), *priority, sigma.unwrap_or(0.0)));
                }
                let mut ends: Vec<f64> = parts.iter().flat_map(|p| [p.0, p.1]).collect();
                ends.sort_by(f64::total_cmp);
                let mut depth = 0.0;
                for w in ends.windows(2) {
                    let middle = 0.5 * (w[0] + w[1]);
                    let here = || parts.iter().filter(|p| p.0 < middle && middle < p.1);
                    let top = here().map(|p| p.2).max();
                    let sigma: f64 = here().filter(|p| Some(p.2) == top).map(|p| p.3).sum();
                    depth += sigma * (w[1] - w[0]);
                }
                cases.push(Case {
                    name: format!("{what}, view {v}, {mode}, albedo {albedo}"),
                    scene,
                    exact: (-depth).exp(),
                    share: if albedo > 0.0 { 0.02 } else { 0.003 },
                });
            }
        }
    }
    run("cut_outs", &cases);
}

/// Parts of one body: layers of glass that overlap are one sheet, whether as shapes or copies; a hollow body is two sheets; and parts
/// of a fog that overlap are no thicker.
#[test]
fn one_body() {
    let mut cases = Vec::new();
    for degrees in [5.0, 40.0, 60.0f64] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let view = || scenes::scene([-3.0 * sin / cos, 0.3, 3.0], [sin, 0.0, -cos]);
        let (r, _) = fresnel(cos, 1.0, 1.5);
        let one = (1.0 - r) / (1.0 + r);
        let reflected = 2.0 * r / (1.0 + r);
        for (what, exact) in [
            ("shapes", one),
            ("copies", one),
            ("hollow", one * one / (1.0 - reflected * reflected)),
        ] {
            let mut scene = view();
            dielectric(&mut scene, "glass", 1.5);
            scenes::add(&mut scene, "shapes", lamp(-6.0));
            let glass = [("material", "glass")];
            match what {
                "shapes" => {
                    add(&mut scene, layer(-1.0, 0.0), 0, &glass);
                    add(&mut scene, layer(-1.7, -0.4), 0, &glass);
                    add(&mut scene, layer(-0.8, -0.6), 0, &glass);
                }
                "copies" => {
                    let mut part = layer(-1.0, 0.0);
                    part["material"] = json!("glass");
                    scene["prototypes"]["part"] = json!([part]);
                    let copy = |t: Value| json!({ "prototype": "part", "transform": t });
                    scene["instances"] = json!([
                        copy(json!([{ "scale": [1, 1, 1] }])),
                        copy(json!([{ "scale": [1, 1, -0.5] }, { "translate": [0, 0, -1.3] }])),
                    ]);
                }
                _ => {
                    let mut cavity = scenes::cuboid([-2.9e3, -2.9e3, -2.0], [2.9e3, 2.9e3, -1.0]);
                    for t in cavity["indices"].as_array_mut().into_iter().flatten() {
                        if let Some(t) = t.as_array_mut() {
                            t.swap(1, 2);
                        }
                    }
                    add(&mut scene, layer(-3.0, 0.0), 0, &glass);
                    add(&mut scene, cavity, 0, &glass);
                }
            }
            cases.push(Case {
                name: format!("{what} at {degrees} degrees"),
                scene,
                exact,
                share: 0.002,
            });
        }
        let mut scene = view();
        scenes::add(&mut scene, "lights", scenes::dome(1.0));
        scenes::medium(&mut scene, "fog", json!({ "sigma_t": 0.7, "albedo": 0 }));
        for (low, high) in [(-1.0, 0.0), (-1.7, -0.4), (-0.8, -0.6)] {
            // No larger than needed: distances have the error of the triangles' size.
            let part = scenes::cuboid([-10.0, -10.0, low], [10.0, 10.0, high]);
            add(&mut scene, part, 0, &[("interior", "fog")]);
        }
        cases.push(Case {
            name: format!("fog at {degrees} degrees"),
            scene,
            exact: (-0.7f64 * 1.7 / cos).exp(),
            share: 0.003,
        });
    }
    run("one_body", &cases);
}

//! BSDF plugins through the whole renderer: furnaces, glass in an enclosure, stacks of plates, all
//! integrators in one room.

use crate::harness::{self, EDGE, Measured, Precision, each};
use crate::judge::Table;
use crate::scenes;
use resolvent_tests::Moments;
use serde_json::{Value, json};

struct Case {
    name: String,
    scene: Value,
    exact: [f64; 3],
    /// What the material's tables may be off by, relative.
    tables: f64,
}

/// Renders all cases. Where a material's tables are exact a row is a z-test; elsewhere it must come as near as they do.
fn run(name: &'static str, cases: &[Case]) {
    let mut out = Table::new(name);
    let precision = |c: &Case| Precision::of(c.exact);
    let found = each(cases, |c| {
        harness::measure(&c.scene, &c.name, &precision(c))
    });
    for (c, m) in cases.iter().zip(&found) {
        if c.tables == 0.0 {
            let lanes = [0, 1, 2].map(|i| (i, c.exact[i]));
            out.row(&c.name, m, &lanes, &precision(c));
        } else {
            near(&mut out, c, m);
        }
    }
    out.assert();
}

fn near(out: &mut Table, c: &Case, m: &Measured) {
    for lane in 0..3 {
        // Four standard errors beside the tables.
        let bound = c.tables * c.exact[lane] + 4.0 * m.error[lane];
        out.near(&c.name, m.mean[lane], c.exact[lane], bound);
    }
}

fn sphere(material: &str, radius: f64) -> Value {
    json!({ "type": "sphere", "center": [0, 0, 0], "radius": radius, "material": material })
}

/// White materials and how exact their tables are; light crosses some of them several times.
fn white() -> Vec<(Value, f64)> {
    let of = |plugin: &str, params: Value, tables: f64| {
        (json!({ "plugin": plugin, "params": params }), tables)
    };
    vec![
        of("dielectric", json!({ "ior": 1.5 }), 0.0),
        of("dielectric", json!({ "ior": 2.4 }), 0.0),
        of("dielectric", json!({ "ior": 0.7 }), 0.0),
        of("dielectric", json!({ "thin": true }), 0.0),
        of("rough-dielectric", json!({ "roughness": 0.3 }), 0.01),
        of("rough-dielectric", json!({ "roughness": 1 }), 0.01),
        of(
            "rough-dielectric",
            json!({ "roughness": 0.7, "thin": true }),
            0.01,
        ),
        of(
            "conductor",
            json!({ "eta": 1e-3, "k": 1e3, "roughness": 0.6 }),
            0.01,
        ),
        of(
            "principled",
            json!({ "base_color": 1, "roughness": 0.4 }),
            0.01,
        ),
        of(
            "principled",
            json!({ "base_color": 1, "metallic": 1, "roughness": 1 }),
            0.01,
        ),
        of(
            "principled",
            json!({ "base_color": 1, "transmission": 1, "roughness": 0 }),
            0.0,
        ),
        of(
            "mask",
            json!({
                "opacity": 0.4,
                "bsdf": { "plugin": "diffuse", "params": { "reflectance": 1 } }
            }),
            0.0,
        ),
        of(
            "mix",
            json!({
                "weight": 0.3,
                "a": { "plugin": "dielectric", "params": { "ior": 1.4, "thin": true } },
                "b": { "plugin": "mask", "params": {
                    "opacity": 0.5,
                    "bsdf": { "plugin": "diffuse", "params": { "reflectance": 1 } }
                } }
            }),
            0.0,
        ),
    ]
}

/// White furnace: spheres that absorb nothing are invisible in uniform light, off their middle too, whatever they let in.
#[test]
fn white_furnace() {
    let mut cases = Vec::new();
    for (material, tables) in white() {
        for height in [0.2, 0.85] {
            let mut scene = scenes::scene([0.1, height, 4.0], [0.0, 0.0, -1.0]);
            scene["materials"]["m"] = material.clone();
            scenes::add(&mut scene, "shapes", sphere("m", 1.0));
            scenes::add(&mut scene, "lights", scenes::dome(1));
            cases.push(Case {
                name: format!("{material} at {height}"),
                scene,
                exact: [1.0; 3],
                tables,
            });
        }
    }
    run("white_furnace", &cases);
}

/// A closed surface that glows L_e holds L_e everywhere, and n² L_e in a dielectric; one dielectric in another counts against
/// vacuum, by both.
#[test]
fn glass_in_an_enclosure() {
    let mut cases = Vec::new();
    let glow = 0.7;
    for (kind, params, index, tables) in [
        ("dielectric", json!({ "ior": 1.5 }), 1.5f64, 0.0),
        (
            "rough-dielectric",
            json!({ "ior": 1.5, "roughness": 0.5 }),
            1.5,
            0.01,
        ),
        (
            "principled",
            json!({ "base_color": 1, "ior": 1.33, "roughness": 0, "transmission": 1 }),
            1.33,
            0.0,
        ),
    ] {
        for (place, exact) in [
            ([0.2, 0.1, 0.0], index * index * glow),
            ([1.5, 0.3, 0.2], glow),
        ] {
            let direction = [-0.8, 0.1, 0.3];
            let mut scene = scenes::scene(place, direction);
            scene["materials"]["glass"] = json!({ "plugin": kind, "params": params });
            scenes::add(&mut scene, "shapes", sphere("glass", 1.0));
            scenes::add(&mut scene, "lights", scenes::dome(glow));
            let side = if exact == glow { "outside" } else { "inside" };
            cases.push(Case {
                name: format!("{kind} {params}, {side}"),
                scene,
                exact: [exact; 3],
                tables,
            });
        }
    }
    run("glass_in_an_enclosure", &cases);
}

/// Fresnel's reflectance in terms of angles.
fn fresnel(angle: f64, index: f64) -> f64 {
    let inner = (angle.sin() / index).asin();
    if angle < 1e-9 {
        return ((index - 1.0) / (index + 1.0)).powi(2);
    }
    let s = ((angle - inner).sin() / (angle + inner).sin()).powi(2);
    let p = ((angle - inner).tan() / (angle + inner).tan()).powi(2);
    0.5 * (s + p)
}

/// Plates between two hemispheres of radiance 1: what they reflect of the upper, and pass of the lower one. One boundary
/// reflects F, and k parallel ones without absorption k F/(1 + (k − 1) F), however the plates are modelled.
#[test]
fn stacks_of_plates() {
    let mut cases = Vec::new();
    for (plates, thin) in [(1, true), (3, true), (1, false), (2, false)] {
        for degrees in [0.0f64, 50.0, 75.0] {
            let angle = degrees.to_radians();
            let d = [angle.sin(), 0.0, -angle.cos()];
            let mut scene = scenes::scene(d.map(|x| -30.0 * x), d);
            scene["materials"]["glass"] =
                json!({ "plugin": "dielectric", "params": { "ior": 1.5, "thin": thin } });
            let wide = 1e4;
            let mut boundary = |z: f64, up: bool| {
                let (u, v) = ([2.0 * wide, 0.0, 0.0], [0.0, 2.0 * wide, 0.0]);
                let (u, v) = if up { (u, v) } else { (v, u) };
                let shape = json!({
                    "type": "rectangle", "corner": [-wide, -wide, z], "edge_u": u, "edge_v": v, "material": "glass"
                });
                scenes::add(&mut scene, "shapes", shape);
            };
            for k in 0..plates {
                let z = -f64::from(k);
                boundary(z, true);
                if !thin {
                    boundary(z - 0.5, false);
                }
            }
            scenes::add(&mut scene, "lights", scenes::hemispheres(true));
            let f = fresnel(angle, 1.5);
            let k = 2.0 * f64::from(plates);
            let reflected = k * f / (1.0 + (k - 1.0) * f);
            cases.push(Case {
                name: format!("{plates} plates, thin {thin}, {degrees} degrees"),
                scene,
                exact: [reflected, 1.0 - reflected, 1.0],
                tables: 0.0,
            });
        }
    }
    run("stacks_of_plates", &cases);
}

/// A boundary between equal indices changes nothing, beside no boundary at all.
#[test]
fn an_index_matched_boundary() {
    let mut out = Table::new("an_index_matched_boundary");
    let of = |material: Option<Value>| {
        let mut scene = scenes::scene([0.3, 0.2, 4.0], [0.0, 0.05, -1.0]);
        let mut shape = sphere("m", 1.0);
        match material {
            Some(m) => scene["materials"]["m"] = m,
            None => {
                shape["material"] = Value::Null;
                if let Some(s) = shape.as_object_mut() {
                    s.remove("material");
                }
            }
        }
        scenes::medium(
            &mut scene,
            "milk",
            json!({ "sigma_t": [1, 2, 4], "albedo": [0.9, 0.99, 0.5], "phase": scenes::hg(0.4) }),
        );
        shape["interior"] = json!("milk");
        scenes::add(&mut scene, "shapes", shape);
        scenes::add(&mut scene, "lights", scenes::hemispheres(true));
        scene
    };
    let precision = Precision::of([0.3; 3]);
    let plain = harness::measure(&of(None), "no boundary", &precision);
    for (name, material) in [
        (
            "dielectric",
            json!({ "plugin": "dielectric", "params": { "ior": 1 } }),
        ),
        (
            "rough-dielectric",
            json!({ "plugin": "rough-dielectric", "params": { "ior": 1, "roughness": 0.8 } }),
        ),
        ("null", json!({ "plugin": "null" })),
    ] {
        let m = harness::measure(&of(Some(material)), name, &precision);
        out.same(name, &m, &plain);
    }
    out.assert();
}

/// A closed room of rough and layered materials, the floor with a coat that leans, with glass and a body half of glass.
fn room(integrator: &str) -> Value {
    let mut scene = scenes::scene([0.0, 1.2, 4.6], [0.0, -0.07, -1.0]);
    scene["camera"] = scenes::camera([0.0, 1.2, 4.6], [0.0, -0.07, -1.0], 42.0);
    scene["integrator"] = json!({ "plugin": integrator });
    scene["materials"] = json!({
        "wall": { "plugin": "diffuse", "params": { "reflectance": 0.7 } },
        "floor": { "plugin": "principled", "params": {
            "base_color": [0.5, 0.3, 0.2], "clearcoat": 0.7, "clearcoat_roughness": 0.4,
            "clearcoat_normal": [0.65, 0.45, 0.95] } },
        "left": { "plugin": "principled", "params": {
            "base_color": [0.2, 0.2, 0.6], "roughness": 0.8, "sheen": 1, "sheen_roughness": 0.6 } },
        "right": { "plugin": "conductor", "params": {
            "metal": "Au", "roughness": 0.6, "anisotropy": 0.5 } },
        "glass": { "plugin": "rough-dielectric", "params": { "ior": 1.5, "roughness": 0.6 } },
        "half": { "plugin": "mix", "params": {
            "a": { "plugin": "principled", "params": {
                "base_color": [0.9, 0.6, 0.8], "transmission": 0.6, "ior": 1.4 } },
            "b": { "plugin": "diffuse", "params": { "reflectance": 0.5 } },
            "weight": 0.2 } },
    });
    let wall = |corner: [f64; 3], u: [f64; 3], v: [f64; 3], material: &str| json!({ "type": "rectangle", "corner": corner, "edge_u": u, "edge_v": v, "material": material });
    let ball = |x: f64, z: f64, material: &str| json!({ "type": "sphere", "center": [x, 0.6, z], "radius": 0.6, "material": material });
    scene["shapes"] = json!([
        wall([-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0], "floor"),
        wall([-2.0, 2.5, -2.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0], "wall"),
        wall([-2.0, 0.0, -2.0], [4.0, 0.0, 0.0], [0.0, 2.5, 0.0], "wall"),
        wall([-2.0, 0.0, 2.0], [0.0, 0.0, -4.0], [0.0, 2.5, 0.0], "left"),
        wall([2.0, 0.0, -2.0], [0.0, 0.0, 4.0], [0.0, 2.5, 0.0], "right"),
        ball(-0.75, -0.2, "glass"),
        ball(0.75, 0.3, "half"),
    ]);
    let light = json!({
        "type": "rectangle", "corner": [-0.7, 2.45, -0.5], "edge_u": [1.4, 0, 0], "edge_v": [0, 0, 1.2],
        "radiance": [12, 11, 8]
    });
    scenes::add(&mut scene, "lights", light);
    scene
}

/// Means of four strips of a picture over independent renderings.
fn strips(integrator: &str) -> [Measured; 4] {
    const RENDERINGS: u64 = 40;
    const SAMPLES: u32 = 8;
    let ready = harness::build(&room(integrator)).unwrap_or_else(|e| panic!("{e}"));
    let mut moments = [[Moments::default(); 3]; 4];
    for k in 0..RENDERINGS {
        let rendered = ready.render(harness::hash(integrator) ^ k, 0, SAMPLES);
        let pixels = (EDGE * EDGE) as usize;
        let mut sums = [[0.0; 3]; 4];
        for i in 0..pixels {
            let sum = &mut sums[4 * i / pixels];
            let mean = rendered.film.estimate(i).mean;
            sum.iter_mut().zip(mean).for_each(|(s, m)| *s += m);
        }
        for (moments, sum) in moments.iter_mut().zip(sums) {
            for (m, s) in moments.iter_mut().zip(sum) {
                m.add(s * 4.0 / pixels as f64);
            }
        }
    }
    moments.map(|m| Measured {
        mean: m.map(|m| m.mean()),
        error: m.map(|m| m.standard_error()),
        samples: RENDERINGS as f64 * f64::from(SAMPLES * EDGE * EDGE),
        ..Measured::default()
    })
}

/// Paths from the sensor, from the lights and from both ends carry the same light: values and densities of every lobe hold in
/// both modes, and the corrections for refraction are each other's.
#[test]
fn integrators_agree() {
    let mut out = Table::new("integrators_agree");
    let [walks, both, light] = ["pt", "bdpt", "light"].map(strips);
    for (i, pt) in walks.iter().enumerate() {
        for (name, other) in [("bdpt", &both[i]), ("light", &light[i])] {
            out.same(&format!("{name} and pt, strip {i}"), other, pt);
            let worst = other.error[1].hypot(pt.error[1]) / pt.mean[1];
            out.claim(worst < 0.015, || {
                format!("{name}, strip {i}: too noisy to tell, {worst}")
            });
        }
    }
    out.assert();
}

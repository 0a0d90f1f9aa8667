//! What breaks lights, surfaces, cameras and descriptions.

use crate::harness::{Precision, build, measure};
use crate::judge::Table;
use crate::scenes;
use crate::transmittance::{exactly, once};
use resolvent_image::{BEAUTY, Image};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A floor z = 0 of albedo 0.5 seen from just above.
fn floor() -> Value {
    let mut s = scenes::scene([0.0, 0.0, 0.01], [0.0, 0.0, -1.0]);
    scenes::diffuse(&mut s, "floor", json!(0.5));
    scenes::add(
        &mut s,
        "shapes",
        json!({
            "type": "rectangle", "corner": [-1, -1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0],
            "material": "floor"
        }),
    );
    s
}

fn point(position: [f64; 3], intensity: f64) -> Value {
    json!({ "type": "point", "position": position, "intensity": intensity })
}

/// Lights that touch media, sit on their boundary or drown in them.
#[test]
fn lights_and_media() {
    let mut out = Table::new("lights_and_media");
    let fog =
        |albedo: f64| json!({ "sigma_t": 0.8, "albedo": albedo, "bounds": [-1, -1, 0, 1, 1, 1] });
    let mut s = scenes::scene([0.1, 0.1, 2.0], [0.0, 0.0, -1.0]);
    scenes::medium(&mut s, "m", fog(0.0));
    scenes::add(
        &mut s,
        "lights",
        json!({
            "type": "rectangle", "corner": [-1, -1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0],
            "radiance": 3
        }),
    );
    exactly(
        &mut out,
        "light on a face",
        &once(&s, "touching"),
        [3.0 * 0.449_328_964_117; 3],
    );

    // Light scattered once, so that the steep surroundings of the point do not matter.
    let near = |z: f64| {
        let mut s = scenes::scene([0.4, 0.1, 2.0], [0.0, 0.0, -1.0]);
        scenes::medium(&mut s, "m", fog(1.0));
        scenes::add(&mut s, "lights", point([0.0, 0.0, z], 1.0));
        scenes::scattered(&mut s, 1);
        measure(
            &s,
            &format!("light at {z}"),
            &Precision {
                error: [1e-4; 3],
                limit: 1e6,
            },
        )
    };
    let on = near(1.0);
    out.claim(on.mean[0] > 0.01, || {
        "a light on the boundary shows nothing".into()
    });
    for step in [1e-6, -1e-6] {
        out.same(
            &format!("light {step} beside the boundary"),
            &on,
            &near(1.0 + step),
        );
    }

    let mut s = scenes::scene([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]);
    scenes::medium(&mut s, "m", scenes::ball([0.0; 3], 1.0, 1e5, 0.0, 0.0));
    scenes::add(&mut s, "lights", point([0.0; 3], 1e6));
    exactly(&mut out, "drowned light", &once(&s, "drowned"), [0.0; 3]);
    out.assert();
}

/// Lights without area or power, of very different power, and suns in pictures.
#[test]
fn odd_lights() {
    let mut out = Table::new("odd_lights");
    // 10 W/sr 2 above: E = 2.5.
    let exact = [0.5 / PI * 2.5; 3];
    let mut s = floor();
    scenes::add(&mut s, "lights", point([0.0, 0.0, 2.0], 10.0));
    let alone = once(&s, "alone");
    exactly(&mut out, "a point", &alone, exact);
    let nothing = [
        json!({ "type": "rectangle", "corner": [0, 0, 1], "edge_u": [0, 0, 0], "edge_v": [0, 1, 0], "radiance": 5 }),
        json!({ "type": "rectangle", "corner": [1, 0, 1], "edge_u": [1, 0, 0], "edge_v": [0, 1, 0], "radiance": 0 }),
        point([0.5, 0.0, 1.0], 0.0),
        scenes::beam([0.0, 0.0, -1.0], 0.0),
    ];
    for light in nothing {
        let mut s = s.clone();
        let name = light.to_string();
        scenes::add(&mut s, "lights", light);
        match build(&s) {
            // A light without area may be refused, with its place.
            Err(e) => out.claim(e.contains("$.lights[1]"), || e.clone()),
            Ok(ready) => {
                let m = ready.measure_range(3, 0, 64);
                out.near(&name, m.mean[0], exact[0], 4.0 * m.error[0] + 2e-6);
            }
        }
    }
    for bad in ["-1", "1e999", "null", "\"NaN\""] {
        let text = format!(r#"{{ "type": "environment", "radiance": {bad} }}"#);
        let Ok(light) = serde_json::from_str::<Value>(&text) else {
            continue;
        };
        let mut s = floor();
        scenes::add(&mut s, "lights", light);
        let e = build(&s).err();
        out.claim(
            e.as_ref()
                .is_some_and(|e| e.contains("$.lights[0].radiance")),
            || format!("radiance {bad}: {e:?}"),
        );
    }
    // Twelve decades: the strong light is behind the floor.
    let mut s = floor();
    scenes::add(&mut s, "lights", point([0.0, 0.0, -1.0], 1e4));
    scenes::add(&mut s, "lights", point([0.0, 0.0, 1.0], 1e-8));
    let exact = 0.5 / PI * 1e-8;
    let p = Precision::relative([exact; 3], 0.01).lanes(1);
    let m = measure(&s, "weak light", &p);
    out.row("weak light", &m, &[(0, exact)], &p);

    // A texel of radiance 1e9 in an environment of 1.
    let (w, h) = (64usize, 32usize);
    let mut texels = vec![1.0f32; w * h];
    let (x, y) = (30, 20);
    texels[y * w + x] = 1e9;
    let mut image = Image::new(w, h);
    image.push(BEAUTY, ["R", "G", "B"].map(|c| (c, texels.clone())));
    let path =
        std::env::temp_dir().join(format!("resolvent-physics-{}-sun.exr", std::process::id()));
    image.write_exr(&path).unwrap_or_else(|e| panic!("{e}"));
    let mut s = floor();
    scenes::add(
        &mut s,
        "lights",
        json!({ "type": "environment", "image": path }),
    );
    // u = ½ − atan2(x, z)/2π, v = acos(y)/π; the floor's normal is +z.
    let (t0, t1) = (PI * y as f64 / h as f64, PI * (y + 1) as f64 / h as f64);
    let phi = |x: usize| 2.0 * PI * (0.5 - x as f64 / w as f64);
    // ∫ z dω over the texel, z = sin θ cos φ; the texel lies above the horizon.
    let polar = 0.5 * ((t1 - t0) - (t1.sin() * t1.cos() - t0.sin() * t0.cos()));
    let flux = polar * (phi(x).sin() - phi(x + 1).sin());
    let exact = 0.5 / PI * (PI + (1e9 - 1.0) * flux);
    let p = Precision::of([exact; 3]);
    let m = measure(&s, "sun in a picture", &p);
    out.row("sun in a picture", &m, &[(0, exact)], &p);
    let _ = std::fs::remove_file(path);
    out.assert();
}

/// A sphere of 20000 triangles.
fn globe(radius: f64) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let (rows, columns) = (100usize, 100usize);
    let mut positions = Vec::new();
    for i in 0..=rows {
        for j in 0..columns {
            let (sin, cos) = (PI * i as f64 / rows as f64).sin_cos();
            let (s, c) = (2.0 * PI * j as f64 / columns as f64).sin_cos();
            positions.push([radius * sin * c, radius * sin * s, radius * cos]);
        }
    }
    let mut indices = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let at = |i: usize, j: usize| i * columns + j % columns;
            indices.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            indices.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    (positions, indices)
}

/// Meshes without gaps, with triangles that have no area, and with bad indices and vertices.
#[test]
fn meshes() {
    let mut out = Table::new("meshes");
    let (positions, indices) = globe(1.0);
    let mut s = scenes::scene([0.1, 0.0, 0.2], [0.0, 0.0, -1.0]);
    s["camera"] = scenes::camera([0.0; 3], [0.0, 0.0, -1.0], 170.0);
    s["film"]["resolution"] = json!([256, 256]);
    scenes::add(&mut s, "lights", scenes::dome(1));
    scenes::diffuse(&mut s, "black", json!(0));
    let mesh = json!({
        "type": "mesh", "positions": positions, "indices": indices, "material": "black"
    });
    scenes::add(&mut s, "shapes", mesh);
    let m = once(&s, "closed");
    out.claim(m.mean == [0.0; 3] && m.alpha == 1.0, || {
        format!("light leaks in: {:?}", m.mean)
    });

    // Points, lines, needles and doubles added to a floor.
    let plain = floor();
    let mut dirty = floor();
    let mesh = json!({
        "type": "mesh", "material": "floor",
        "positions": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 0], [0, 1e-12, 0], [-1, 0, 0], [1, 0, 0]],
        "indices": [[0, 1, 2], [0, 2, 3], [0, 2, 3], [0, 0, 0], [0, 0, 1], [0, 2, 0], [0, 4, 2], [6, 7, 5]]
    });
    dirty["shapes"] = json!([mesh]);
    let show = |mut s: Value| {
        scenes::add(&mut s, "lights", scenes::dome(1));
        measure(
            &s,
            "floor",
            &Precision {
                error: [5e-4; 3],
                limit: 1e6,
            },
        )
    };
    out.same("degenerate triangles", &show(plain), &show(dirty.clone()));

    for (key, value, place) in [
        ("indices", json!([[0, 1, 9]]), "indices"),
        (
            "positions",
            json!([[0, 0, "NaN"], [1, 0, 0], [0, 1, 0]]),
            "positions",
        ),
    ] {
        let mut s = dirty.clone();
        s["shapes"][0][key] = value;
        let e = build(&s).err();
        out.claim(
            e.as_ref()
                .is_some_and(|e| e.contains("$.shapes[0]") && e.contains(place)),
            || format!("{place}: {e:?}"),
        );
    }
    out.assert();
}

/// Cameras: extremes of the field of view, frames that are none, odd film sizes; and scenes with nothing in them.
#[test]
fn cameras_and_empty_scenes() {
    let mut out = Table::new("cameras_and_empty_scenes");
    for fov in [1e-4, 0.01, 179.0, 179.9] {
        let mut s = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
        s["camera"]["fov_x_deg"] = json!(fov);
        scenes::add(&mut s, "lights", scenes::dome(1));
        let m = once(&s, "sky");
        out.claim(m.mean == [1.0; 3] && m.error == [0.0; 3], || {
            format!("fov {fov}: {:?}", m.mean)
        });
    }
    for fov in [json!(0), json!(180), json!(200), json!(-10), json!("NaN")] {
        let mut s = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
        s["camera"]["fov_x_deg"] = fov.clone();
        let e = build(&s).err();
        out.claim(
            e.as_ref().is_some_and(|e| e.contains("$.camera.fov_x_deg")),
            || format!("fov {fov}: {e:?}"),
        );
    }
    for (key, value) in [("target", json!([0, 0, 0])), ("up", json!([0, 0, 2]))] {
        let mut s = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
        s["camera"][key] = value;
        scenes::add(&mut s, "lights", scenes::dome(1));
        match build(&s) {
            Err(e) => out.claim(e.contains("$.camera"), || e.clone()),
            Ok(ready) => {
                let m = ready.measure_range(0, 0, 16);
                out.claim(m.mean == [1.0; 3], || format!("{key}: {:?}", m.mean));
            }
        }
    }
    for size in [[1, 1], [1, 4096], [4096, 1]] {
        let mut s = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
        s["film"]["resolution"] = json!(size);
        scenes::add(&mut s, "lights", scenes::dome(0.5));
        let m = once(&s, "size");
        out.claim(
            m.mean == [0.5; 3] && m.samples == 16.0 * f64::from(size[0] * size[1]),
            || format!("{size:?}: {:?}", m.mean),
        );
    }
    let mut s = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
    s["film"]["resolution"] = json!([0, 10]);
    out.claim(
        build(&s).err().is_some_and(|e| e.contains("resolution")),
        || "0 × 10".into(),
    );

    // Nothing at all; a medium and a surface without light.
    let s = scenes::scene([0.0; 3], [0.0, 0.0, -1.0]);
    out.claim(once(&s, "nothing").mean == [0.0; 3], || {
        "nothing shines".into()
    });
    let mut s = floor();
    scenes::medium(&mut s, "m", scenes::ball([0.0; 3], 1.0, 0.5, 0.5, 0.0));
    out.claim(once(&s, "dark").mean == [0.0; 3], || {
        "darkness shines".into()
    });
    out.assert();
}

/// An enclosure whose walls emit (1 − ρ) L, filled with a medium that emits σ_a L, shows L everywhere.
#[test]
fn isothermal_enclosure() {
    let mut out = Table::new("isothermal_enclosure");
    let mut s = scenes::scene([0.2, -0.1, 0.3], [0.3, 0.9, -0.2]);
    let fog = json!({
        "sigma_a": [0.1, 0.5, 2], "sigma_s": [0.3, 1, 4], "emission": [0.1, 0.5, 2],
        "bounds": [-1, -1, -1, 1, 1, 1], "phase": scenes::hg(0.7)
    });
    scenes::medium(&mut s, "fog", fog);
    let walls = [0.2, 0.5, 0.9, 0.0, 0.7, 0.4];
    for (k, rho) in walls.into_iter().enumerate() {
        let name = format!("wall {k}");
        scenes::diffuse(&mut s, &name, json!(rho));
        let (axis, side) = (k / 2, if k % 2 == 0 { -1.0 } else { 1.0 });
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let (mut corner, mut a, mut b) = ([-1.0; 3], [0.0; 3], [0.0; 3]);
        corner[axis] = side;
        (a[u], b[v]) = (2.0, 2.0);
        let (a, b) = if side < 0.0 { (a, b) } else { (b, a) };
        scenes::add(
            &mut s,
            "shapes",
            json!({
                "type": "rectangle", "corner": corner, "edge_u": a, "edge_v": b,
                "material": name, "emission": 1.0 - rho
            }),
        );
    }
    let p = Precision::of([1.0; 3]);
    let m = measure(&s, "isothermal", &p);
    out.row("isothermal", &m, &[(0, 1.0), (1, 1.0), (2, 1.0)], &p);
    out.assert();
}

//! Copies of prototypes: they scatter, shine and are filled like the shapes they stand for, under any transform.

use crate::harness::{self, Precision, each};
use crate::judge::Table;
use crate::scenes;
use glam::{DMat3, DVec3};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A transform of a scene file.
fn matrix(linear: DMat3, t: DVec3) -> Value {
    let row = |i: usize| {
        let r = linear.row(i);
        json!([r.x, r.y, r.z, t[i]])
    };
    json!([row(0), row(1), row(2), [0, 0, 0, 1]])
}

fn instance(scene: &mut Value, prototype: &str, linear: DMat3, t: DVec3) {
    let i = json!({ "prototype": prototype, "transform": matrix(linear, t) });
    match scene["instances"].as_array_mut() {
        Some(all) => all.push(i),
        None => scene["instances"] = json!([i]),
    }
}

/// Turned by an angle about an odd axis, after stretching.
fn turned(angle: f64, stretch: [f64; 3]) -> DMat3 {
    let axis = DVec3::new(0.4, -0.7, 0.5).normalize();
    DMat3::from_axis_angle(axis, angle) * DMat3::from_diagonal(DVec3::from(stretch))
}

/// A unit cube about the origin.
fn cube() -> Value {
    scenes::cuboid([-0.5; 3], [0.5; 3])
}

fn with(mut shape: Value, key: &str, value: Value) -> Value {
    shape[key] = value;
    shape
}

/// A box whose six walls are copies of one emitting rectangle, half of them mirrored: L = M/(π (1 − ρ)) everywhere, which holds only
/// if every copy shines, from the right side, with its own area.
#[test]
fn walls_that_shine() {
    let mut table = Table::new("walls_that_shine");
    let half = [1.0, 0.7, 2.0];
    let cases: Vec<(f64, bool)> = [0.0, 0.4, 0.8]
        .into_iter()
        .flat_map(|albedo| [(albedo, false), (albedo, true)])
        .collect();
    let exact = |albedo: f64| 1.5 / (PI * (1.0 - albedo));
    let precision = |albedo: f64| Precision::of([exact(albedo); 3]).lanes(1);
    let found = each(&cases, |&(albedo, mesh)| {
        let mut scene = scenes::scene([0.1, -0.2, 0.05], [0.3, 0.5, -0.7]);
        scenes::diffuse(&mut scene, "wall", json!(albedo));
        let corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]];
        let wall = if mesh {
            json!({ "type": "mesh", "positions": corners, "indices": [[0, 1, 2], [0, 2, 3]] })
        } else {
            json!({ "type": "rectangle", "corner": [-1, -1, 0], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0] })
        };
        let wall = with(wall, "material", json!("wall"));
        scene["prototypes"]["wall"] = json!([with(wall, "emission", json!(1.5 / PI))]);
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let (mut a, mut b, mut n) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
                (a[u], b[v], n[axis]) = (half[u], half[v], -side);
                let linear = DMat3::from_cols(a, b, n);
                instance(&mut scene, "wall", linear, -n * half[axis]);
            }
        }
        harness::measure(
            &scene,
            &format!("walls {albedo} {mesh}"),
            &precision(albedo),
        )
    });
    for ((albedo, mesh), m) in cases.iter().zip(&found) {
        let what = format!("albedo {albedo}, mesh {mesh}");
        table.row(&what, m, &[(0, exact(*albedo))], &precision(*albedo));
    }
    table.assert();
}

/// Spheres that shine above a floor: the irradiance below one is π L r²/d², and those of copies add.
#[test]
fn spheres_that_shine() {
    let mut table = Table::new("spheres_that_shine");
    let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.0);
    let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
    let cases: Vec<Vec<(f64, DVec3, DMat3)>> = vec![
        vec![(0.5, DVec3::new(0.0, 0.0, 2.0), turn)],
        vec![(2.0, DVec3::new(0.0, 0.0, 3.0), mirror)],
        // Beside each other: E = π L r² cosθ/d² for each.
        vec![
            (0.3, DVec3::new(1.0, 0.0, 1.0), turn * mirror),
            (0.5, DVec3::new(-1.0, 1.0, 2.0), turn),
        ],
    ];
    let exact = |case: &[(f64, DVec3, DMat3)]| -> f64 {
        let each = case
            .iter()
            .map(|(r, c, _)| r * r * c.z / c.length().powi(3));
        0.6 * 1.7 * each.sum::<f64>()
    };
    let precision = |case: &[(f64, DVec3, DMat3)]| Precision::of([exact(case); 3]).lanes(1);
    let found = each(&cases, |case| {
        // From below, through the transparent side of nothing: the camera looks at the floor's origin at a grazing angle.
        let mut scene = scenes::scene([0.0, 8.0, 0.6], [0.0, -8.0, -0.6]);
        scenes::diffuse(&mut scene, "floor", json!(0.6));
        scenes::add(
            &mut scene,
            "shapes",
            json!({ "type": "rectangle", "corner": [-1e-3, -1e-3, 0], "edge_u": [2e-3, 0, 0], "edge_v": [0, 2e-3, 0], "material": "floor" }),
        );
        scene["prototypes"]["lamp"] = json!([
            { "type": "sphere", "center": [4, 5, 6], "radius": 1, "emission": 1.7 }
        ]);
        for (r, c, turn) in case {
            let linear = *turn * *r;
            let at = *c - linear * DVec3::new(4.0, 5.0, 6.0);
            instance(&mut scene, "lamp", linear, at);
        }
        harness::measure(&scene, &format!("lamps {}", exact(case)), &precision(case))
    });
    for (case, m) in cases.iter().zip(&found) {
        let what = format!("{} lamps", case.len());
        table.row(&what, m, &[(0, exact(case))], &precision(case));
    }
    table.assert();
}

/// What a transform does to a round light is said, not guessed.
#[test]
fn stretched_lamps_are_refused() {
    let mut scene = scenes::scene([0.0, 0.0, 5.0], [0.0, 0.0, -1.0]);
    scene["prototypes"]["lamp"] = json!([
        { "type": "sphere", "center": [0, 0, 0], "radius": 1, "emission": 1 }
    ]);
    instance(
        &mut scene,
        "lamp",
        DMat3::from_diagonal(DVec3::new(1.0, 2.0, 1.0)),
        DVec3::ZERO,
    );
    let error = harness::build(&scene).err().unwrap_or_default();
    assert!(
        error.contains("instance 0, of the prototype 'lamp', stretches an emitting shape"),
        "{error}"
    );
}

/// Length of the part of a line o + t d (t > 0, d of length 1) within the unit sphere or the unit cube.
fn chord(o: DVec3, d: DVec3, sphere: bool) -> f64 {
    let (near, far) = if sphere {
        let (a, b, c) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
        let root = (b * b - a * c).max(0.0).sqrt();
        ((-b - root) / a, (-b + root) / a)
    } else {
        let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
        for k in 0..3 {
            let (s, t) = ((-0.5 - o[k]) / d[k], (0.5 - o[k]) / d[k]);
            near = near.max(s.min(t));
            far = far.min(s.max(t));
        }
        (near, far)
    };
    (far - near.max(0.0)).max(0.0)
}

/// Copies filled with a medium: what comes through one is exp(−σ chord), whether a transform turns, stretches, mirrors or moves it far
/// away, and wherever the camera stands, also inside.
#[test]
fn filled_copies() {
    let mut table = Table::new("filled_copies");
    let mut cases = Vec::new();
    for (k, (stretch, place)) in [
        ([1.0, 1.0, 1.0], DVec3::ZERO),
        ([2.0, 0.5, 1.0], DVec3::new(3.0, -1.0, 2.0)),
        ([-1.5, 0.7, 1.1], DVec3::new(-1e4, 2e4, 5e3)),
        ([0.02, -0.3, -0.1], DVec3::new(0.2, 0.3, 0.1)),
    ]
    .into_iter()
    .enumerate()
    {
        let linear = turned(0.3 + k as f64, stretch);
        for sphere in [true, false] {
            for j in 0..4 {
                // From outside and from inside, through points off the centre.
                let inside = DVec3::new(0.11, -0.23, 0.17) * (j as f64 * 0.5 - 0.6);
                let from = DVec3::new(0.9 - j as f64, 1.1, -0.7) * [0.2, 3.0][j % 2];
                cases.push((linear, place, sphere, from, inside - from));
            }
        }
    }
    let length = |c: &(DMat3, DVec3, bool, DVec3, DVec3)| {
        let d = c.0 * c.4;
        chord(c.3, c.4 / d.length(), c.2)
    };
    let sigma = |c: &(DMat3, DVec3, bool, DVec3, DVec3)| 0.8 / c.0.determinant().abs().cbrt();
    let exact = |c: &(DMat3, DVec3, bool, DVec3, DVec3)| (-sigma(c) * length(c)).exp();
    let found = each(&cases, |c| {
        let (linear, place, sphere, o, d) = *c;
        let mut scene = scenes::scene((linear * o + place).into(), (linear * d).into());
        scenes::add(&mut scene, "lights", scenes::dome(1.0));
        let s = sigma(c);
        scenes::medium(&mut scene, "ink", json!({ "sigma_a": s, "sigma_s": 0 }));
        let shape = if sphere {
            json!({ "type": "sphere", "center": [0, 0, 0], "radius": 1 })
        } else {
            cube()
        };
        scene["prototypes"]["body"] = json!([with(shape, "interior", json!("ink"))]);
        instance(&mut scene, "body", linear, place);
        // A copy that is elsewhere.
        instance(&mut scene, "body", linear, place - linear * d * 50.0);
        let name = format!("{c:?}");
        harness::measure(&scene, &name, &Precision::of([exact(c); 3]).lanes(1))
    });
    for (c, m) in cases.iter().zip(&found) {
        // Coordinates are f32 relative to the scene's centre, so chords are as exact as those.
        table.near(&format!("{c:?}"), m.mean[0], exact(c), 2e-4);
    }
    table.assert();
}

/// A scene of copies is the scene of the shapes that they stand for: light between them, materials replaced or not.
#[test]
fn copies_like_shapes() {
    let places = [
        (turned(0.4, [1.0, 1.5, 0.6]), DVec3::new(0.0, 0.0, 0.6)),
        (turned(1.9, [-0.7, 0.7, 0.7]), DVec3::new(1.1, 0.2, 0.5)),
        (turned(2.6, [0.4, 0.4, 1.9]), DVec3::new(-0.9, 0.6, 0.9)),
    ];
    let scene = |instanced: bool, to: [f64; 3]| {
        let from = [0.5, -4.0, 2.5];
        let mut scene = scenes::scene(from, [0, 1, 2].map(|k| to[k] - from[k]));
        scenes::diffuse(&mut scene, "white", json!(0.7));
        scenes::diffuse(&mut scene, "red", json!([0.8, 0.2, 0.1]));
        scenes::add(&mut scene, "lights", scenes::dome(0.3));
        scenes::add(
            &mut scene,
            "lights",
            json!({ "type": "rectangle", "corner": [-1, -1, 4], "edge_u": [0, 2, 0], "edge_v": [2, 0, 0], "radiance": 3 }),
        );
        scenes::add(
            &mut scene,
            "shapes",
            json!({ "type": "rectangle", "corner": [-9, -9, 0], "edge_u": [18, 0, 0], "edge_v": [0, 18, 0], "material": "white" }),
        );
        let body = with(cube(), "material", json!("white"));
        if instanced {
            scene["prototypes"]["body"] = json!([body]);
        }
        for (k, (linear, t)) in places.iter().enumerate() {
            if instanced {
                instance(&mut scene, "body", *linear, *t);
                if k == 1 {
                    scene["instances"][k]["material"] = json!("red");
                }
            } else {
                let mut body = with(body.clone(), "transform", matrix(*linear, *t));
                if k == 1 {
                    body["material"] = json!("red");
                }
                scenes::add(&mut scene, "shapes", body);
            }
        }
        scene
    };
    let targets = [
        [0.1, -0.3, 0.8],
        [1.1, 0.1, 0.5],
        [-0.8, 0.4, 1.0],
        [0.5, 0.3, 0.0],
        [-0.4, 0.2, 0.05],
    ];
    let mut table = Table::new("copies_like_shapes");
    let found = each(&targets, |to| {
        let p = Precision::relative([1.0, 1.0, 1.0], 0.001);
        let [a, b] = [true, false].map(|instanced| {
            harness::measure(&scene(instanced, *to), &format!("{instanced} {to:?}"), &p)
        });
        (a, b)
    });
    for (to, (a, b)) in targets.iter().zip(&found) {
        table.same(&format!("towards {to:?}"), a, b);
    }
    table.assert();
}

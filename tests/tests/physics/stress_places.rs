//! What breaks geometry of media: far away, tiny, huge, flat, touching, nested and hollow.

use crate::harness::{Measured, Precision, build, measure};
use crate::judge::Table;
use crate::scenes;
use crate::transmittance::{exactly, once};
use serde_json::{Value, json};

/// A foggy sphere above a floor under a slanting sun and a point light, seen by a single ray through both.
fn still_life(scale: f64, offset: [f64; 3]) -> Value {
    let at = |p: [f64; 3]| [0, 1, 2].map(|i| scale * p[i] + offset[i]);
    let mut s = scenes::scene(at([0.3, -4.0, 2.0]), [0.0; 3]);
    s["camera"]["target"] = json!(at([0.1, 0.2, 1.0]));
    s["camera"]["up"] = json!([0, 0, 1]);
    let fog = json!({
        "sigma_t": 1.5 / scale, "albedo": [0.9, 0.7, 0.5], "phase": scenes::hg(0.3),
        "center": at([0.0, 0.0, 1.0]), "radius": 0.8 * scale
    });
    scenes::medium(&mut s, "fog", fog);
    scenes::diffuse(&mut s, "floor", json!([0.6, 0.5, 0.4]));
    let floor = json!({
        "type": "rectangle", "corner": at([-3.0, -3.0, 0.0]), "edge_u": [6.0 * scale, 0, 0],
        "edge_v": [0, 6.0 * scale, 0], "material": "floor"
    });
    scenes::add(&mut s, "shapes", floor);
    scenes::add(&mut s, "lights", scenes::beam([0.4, 0.2, -1.0], 2.0));
    scenes::add(
        &mut s,
        "lights",
        json!({
            "type": "point", "position": at([2.0, -1.0, 2.0]), "intensity": 3.0 * scale * scale
        }),
    );
    s
}

fn look(s: &Value, name: &str) -> Measured {
    measure(
        s,
        name,
        &Precision {
            error: [5e-4; 3],
            limit: 1e6,
        },
    )
}

/// Moved by a million and scaled by eight decades: the same picture.
#[test]
fn moved_and_scaled() {
    let mut out = Table::new("moved_and_scaled");
    let here = look(&still_life(1.0, [0.0; 3]), "here");
    out.claim(here.mean[0] > 0.1, || "the picture is black".into());
    let there = look(&still_life(1.0, [1e5, -3e5, 1e6]), "there");
    out.same("moved", &here, &there);
    for scale in [1e-4, 1e-2, 1e2, 1e4] {
        let m = look(&still_life(scale, [0.0; 3]), &format!("scale {scale}"));
        out.same(&format!("scaled by {scale}"), &here, &m);
    }
    out.assert();
}

/// Media placed by transforms: rotated, mirrored, sheared, stretched, flattened.
#[test]
fn transforms() {
    let mut out = Table::new("transforms");
    let with = |transform: Value| {
        let mut s = scenes::scene([0.1, 0.2, 4.0], [0.0, 0.0, -1.0]);
        scenes::add(&mut s, "lights", scenes::dome(1));
        let p = json!({ "sigma_t": 0.6, "albedo": 0, "bounds": [-1, -1, -1, 1, 1, 1] });
        scenes::medium(&mut s, "m", p);
        s["media"]["m"]["transform"] = transform;
        s
    };
    let expect = |out: &mut Table, name: &str, transform: Value, length: f64| {
        let m = once(&with(transform), name);
        exactly(out, name, &m, [(-0.6 * length).exp(); 3]);
    };
    expect(&mut out, "mirrored", json!([{ "scale": [-1, 1, 1] }]), 2.0);
    // Turned by 60° about x, the ray enters and leaves through the same pair of faces.
    let turned = json!([{ "rotate_deg": { "axis": [1, 0, 0], "angle": 30 } }]);
    expect(&mut out, "turned", turned, 2.0 / (30f64).to_radians().cos());
    // x and y shift with z: heights stay.
    let sheared = json!([[1, 0, 0.4, 0], [0, 1, -0.3, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
    expect(&mut out, "sheared", sheared, 2.0);
    let stretched = json!([{ "scale": [1000, 1, 0.001] }]);
    expect(&mut out, "stretched", stretched, 0.002);
    let flat = build(&with(json!([{ "scale": [1, 1, 0] }])));
    out.claim(flat.err().is_some_and(|e| e.contains("test.json:")), || {
        "a transform of determinant 0 is accepted, or refused without its place".into()
    });

    // A box of 1e6 × 1 × 1e-3 along each of its axes.
    for (axis, sigma) in [(0, 1e-6), (1, 1.0), (2, 1e3)] {
        let half = [5e5, 0.5, 5e-4];
        let mut d = [0.0; 3];
        d[axis] = -1.0;
        let mut s = scenes::scene(d.map(|x| -x * 2.0 * half[axis]), d);
        // Over this length even the narrowest of ordinary cameras sees beyond the box.
        s["camera"]["fov_x_deg"] = json!(1e-12);
        scenes::add(&mut s, "lights", scenes::dome(1));
        let bounds = [-half[0], -half[1], -half[2], half[0], half[1], half[2]];
        scenes::medium(
            &mut s,
            "m",
            json!({ "sigma_t": sigma, "albedo": 0, "bounds": bounds }),
        );
        let name = format!("aspect, axis {axis}");
        exactly(&mut out, &name, &once(&s, &name), [(-1f64).exp(); 3]);
    }
    out.assert();
}

/// A medium that rests on a surface, with the surface a little lower or higher: 2 ρ E₃(τ) exp(−τ).
#[test]
fn resting_on_a_surface() {
    let mut out = Table::new("resting_on_a_surface");
    let exact = 0.090_788_409_944_8;
    let p = Precision::of([exact; 3]).lanes(1);
    for z in [0.0, -1e-7, -1e-4, 1e-7] {
        let mut s = scenes::scene([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]);
        let w = 1e4;
        let m = json!({ "sigma_t": 0.8, "albedo": 0, "bounds": [-w, -w, 0, w, w, 1] });
        scenes::medium(&mut s, "m", m);
        scenes::add(&mut s, "lights", scenes::dome(1));
        scenes::diffuse(&mut s, "floor", json!(0.7));
        scenes::add(
            &mut s,
            "shapes",
            json!({
                "type": "rectangle", "corner": [-w, -w, z], "edge_u": [2.0 * w, 0, 0],
                "edge_v": [0, 2.0 * w, 0], "material": "floor"
            }),
        );
        let name = format!("floor at {z}");
        out.row(&name, &measure(&s, &name, &p), &[(0, exact)], &p);
    }
    out.assert();
}

/// Media that touch, overlap, nest, and are cut into pieces or stacked copies.
#[test]
fn several_media() {
    let mut out = Table::new("several_media");
    let empty = || {
        let mut s = scenes::scene([0.1, 0.2, 4.0], [0.0, 0.0, -1.0]);
        scenes::add(&mut s, "lights", scenes::dome(1));
        s
    };
    // A box of τ = 1.2, whole and cut into 2 and 1000 touching pieces.
    for pieces in [1, 2, 1000] {
        let mut s = empty();
        for i in 0..pieces {
            let (a, b) = (
                f64::from(i) / f64::from(pieces),
                f64::from(i + 1) / f64::from(pieces),
            );
            let p = json!({ "sigma_t": 1.2, "albedo": 0, "bounds": [-1, -1, a, 1, 1, b] });
            scenes::medium(&mut s, &format!("piece {i}"), p);
        }
        let m = once(&s, "pieces");
        // Each piece's transmittance is rounded to f32, and the product again: two halves of 2⁻²³ of it.
        let tolerance = f64::from(pieces) * f64::from(f32::EPSILON);
        let exact = (-1.2f64).exp();
        out.near(
            &format!("{pieces} pieces"),
            m.mean[0],
            exact,
            tolerance * exact,
        );
    }
    let mut s = empty();
    for (name, sigma, radius) in [("outer", 0.4, 1.0), ("inner", 0.9, 0.5)] {
        scenes::medium(
            &mut s,
            name,
            scenes::ball([0.1, 0.2, 0.0], radius, sigma, 0.0, 0.0),
        );
    }
    exactly(
        &mut out,
        "nested",
        &once(&s, "nested"),
        [0.182_683_524_053; 3],
    );
    let mut s = empty();
    for (name, sigma, low) in [("lower", 0.5, 0.0), ("upper", 0.8, 0.5)] {
        let p = json!({ "sigma_t": sigma, "albedo": 0, "bounds": [-1, -1, low, 1, 1, low + 1.0] });
        scenes::medium(&mut s, name, p);
    }
    exactly(
        &mut out,
        "overlap",
        &once(&s, "overlap"),
        [(-1.3f64).exp(); 3],
    );

    // Eight copies of an eighth of the density, and two touching halves, scatter like one whole.
    let lit = |media: &[Value], name: &str| {
        let mut s = scenes::scene([0.1, 0.2, 4.0], [0.0, 0.0, -1.0]);
        scenes::add(&mut s, "lights", scenes::beam([0.5, 0.0, -1.0], 1.0));
        for (i, m) in media.iter().enumerate() {
            scenes::medium(&mut s, &format!("{i}"), m.clone());
        }
        measure(
            &s,
            name,
            &Precision {
                error: [3e-4; 3],
                limit: 1e6,
            },
        )
    };
    let part = |sigma: f64, a: f64, b: f64| {
        json!({
            "sigma_t": sigma, "albedo": 0.9, "bounds": [-1, -1, a, 1, 1, b], "phase": scenes::hg(0.5)
        })
    };
    let one = lit(&[part(2.0, 0.0, 1.0)], "one medium");
    let copies: Vec<_> = (0..8).map(|_| part(0.25, 0.0, 1.0)).collect();
    out.same("eight copies", &one, &lit(&copies, "eight copies"));
    let halves = [part(2.0, 0.0, 0.5), part(2.0, 0.5, 1.0)];
    out.same("two halves", &one, &lit(&halves, "two halves"));
    out.assert();
}

/// A closed box of triangles.
fn cube(min: [f64; 3], max: [f64; 3]) -> Value {
    let positions: Vec<[f64; 3]> = (0..8)
        .map(|k| [0, 1, 2].map(|i| if k >> i & 1 == 0 { min[i] } else { max[i] }))
        .collect();
    let mut indices = Vec::new();
    for q in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        indices.push([q[0], q[1], q[2]]);
        indices.push([q[0], q[2], q[3]]);
    }
    json!({ "type": "mesh", "positions": positions, "indices": indices })
}

/// A medium given by its own bounds and as the interior of a mesh with the same faces.
#[test]
fn bounds_and_mesh() {
    let mut out = Table::new("bounds_and_mesh");
    let scene = |mesh: bool, camera: [f64; 3]| {
        let mut s = scenes::scene(camera, [0.1, 0.2, -1.0]);
        scenes::add(&mut s, "lights", scenes::beam([0.5, 0.0, -1.0], 1.0));
        let mut p = json!({ "sigma_t": [1, 2, 3], "albedo": 0.9, "phase": scenes::hg(0.5) });
        if mesh {
            let mut shape = cube([-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]);
            shape["interior"] = json!("m");
            scenes::add(&mut s, "shapes", shape);
        } else {
            p["bounds"] = json!([-1, -1, 0, 1, 1, 1]);
        }
        scenes::medium(&mut s, "m", p);
        s
    };
    for (where_from, camera) in [("outside", [-0.1, -0.2, 3.0]), ("inside", [0.1, 0.2, 0.6])] {
        let show = |mesh: bool| look(&scene(mesh, camera), &format!("{where_from} {mesh}"));
        out.same(where_from, &show(false), &show(true));
    }
    out.assert();
}

/// The camera on the boundary of a glowing sphere, in it, and in a hollow one.
#[test]
fn camera_at_the_boundary() {
    let mut out = Table::new("camera_at_the_boundary");
    let sigma = 1.5f64;
    let seen = |length: f64| [-(-sigma * length).exp_m1(); 3];
    let glow = json!({
        "sigma_t": sigma, "albedo": 0, "emission": sigma, "center": [0, 0, 0], "radius": 1
    });
    let from = |z: f64, d: [f64; 3]| {
        let mut s = scenes::scene([0.0, 0.0, z], d);
        scenes::medium(&mut s, "m", glow.clone());
        once(&s, "boundary")
    };
    let down = [0.0, 0.0, -1.0];
    exactly(&mut out, "centre", &from(0.0, down), seen(1.0));
    exactly(&mut out, "on it, inwards", &from(1.0, down), seen(2.0));
    exactly(&mut out, "outside", &from(4.0, down), seen(2.0));
    for (name, d) in [("outwards", [0.0, 0.0, 1.0]), ("along it", [1.0, 0.0, 0.0])] {
        let m = from(1.0, d);
        // The boundary is a rounding away: a tangent there is √(2·6e-8) long at most.
        out.near(name, m.mean[0], 0.0, 1e-3);
    }
    for step in [1e-3, 1e-6, 0.0, -1e-6, -1e-3] {
        let m = from(1.0 + step, down);
        exactly(
            &mut out,
            &format!("step {step}"),
            &m,
            seen(2.0 + f64::min(step, 0.0)),
        );
    }

    // A hollow: the inner mesh's normals point into the cavity, so that its interior is around it.
    let mut s = scenes::scene([0.0; 3], [0.2, 0.1, -1.0]);
    let open = json!({ "sigma_t": sigma, "albedo": 0, "emission": sigma });
    scenes::medium(&mut s, "m", open);
    let mut inner = cube([-1.0; 3], [1.0; 3]);
    for t in inner["indices"].as_array_mut().into_iter().flatten() {
        if let Some(t) = t.as_array_mut() {
            t.swap(1, 2);
        }
    }
    for mut shape in [inner, cube([-2.0; 3], [2.0; 3])] {
        shape["interior"] = json!("m");
        scenes::add(&mut s, "shapes", shape);
    }
    let slant = (1.0f64 + 0.04 + 0.01).sqrt();
    let m = measure(&s, "hollow", &Precision::of(seen(slant)));
    let lanes = [(0, seen(slant)[0])];
    out.row("hollow", &m, &lanes, &Precision::of(seen(slant)));
    out.assert();
}

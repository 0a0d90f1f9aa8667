//! What breaks walks, volumes and shapes at their limits: very thick slabs, boxes without extent, media that are not there, meshes that
//! are open or inside out, tangent lights, and sizes far apart.

use crate::harness::{Measured, Precision, build, full, measure};
use crate::judge::Table;
use crate::scenes;
use crate::transmittance::{exactly, once};
use resolvent_bench::volume::Voxels;
use serde_json::{Value, json};

fn loosely(s: &Value, name: &str, error: f64) -> Measured {
    let p = Precision {
        error: [error; 3],
        limit: 1e6,
    };
    measure(s, name, &p)
}

/// A conservative slab of thickness 1000: T = H(1)/(√3 (τ + 2 q)). Paths scatter some thousand times; in full mode, of thickness 10⁵,
/// some hundred thousand times, and every one of them must end outside.
#[test]
fn conservative_thick_slab() {
    let mut out = Table::new("conservative_thick_slab");
    let thick = |tau: f64| {
        let mut s = scenes::scene([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]);
        scenes::medium(&mut s, "m", scenes::slab(tau, 1.0, 0.0, 3000.0));
        // Lanes: from above, from below, from everywhere.
        scenes::add(&mut s, "lights", scenes::hemispheres(true));
        s
    };
    let s = thick(1000.0);
    let p = Precision {
        error: [f64::INFINITY, 6e-4, f64::INFINITY],
        limit: 1e6,
    };
    // Without a pilot: this is thirty million flights.
    let m = once(&s, "slab of 1000");
    out.row("slab of 1000", &m, &[(1, 0.001_676_443_15)], &p);
    // Light of a picture is found by connections as well, so that this is noisy.
    out.near("R + T", m.mean[2], 1.0, 5.0 * m.error[2] + 2e-5);
    if full() {
        let mut s = thick(1e5);
        s["film"]["resolution"] = json!([16, 16]);
        let ready = build(&s).unwrap_or_else(|e| panic!("{e}"));
        let m = ready.measure_range(1, 0, 4);
        out.near("R + T of 1e5", m.mean[2], 1.0, 5.0 * m.error[2] + 1e-3);
        let each = m.counters.collisions as f64 / m.samples;
        out.claim(each > 1e3, || format!("{each} collisions a path"));
    }
    out.assert();
}

/// A fogged ball, a floor, a sun and a point, all turned by one rotation, permuted and mirrored: the same picture.
#[test]
fn turned_and_mirrored() {
    let mut out = Table::new("turned_and_mirrored");
    let show = |m: [[f64; 3]; 3], name: &str| {
        let at = |p: [f64; 3]| m.map(|row| (0..3).map(|k| row[k] * p[k]).sum::<f64>());
        let mut s = scenes::scene(at([0.3, -4.0, 2.0]), [0.0; 3]);
        s["camera"]["target"] = json!(at([0.1, 0.2, 1.0]));
        s["camera"]["up"] = json!(at([0.0, 0.0, 1.0]));
        let fog = json!({
            "sigma_t": 1.5, "albedo": [0.9, 0.7, 0.5], "phase": scenes::hg(0.3),
            "center": at([0.0, 0.0, 1.0]), "radius": 0.8
        });
        scenes::medium(&mut s, "fog", fog);
        scenes::diffuse(&mut s, "floor", json!([0.6, 0.5, 0.4]));
        scenes::add(
            &mut s,
            "shapes",
            json!({
                "type": "rectangle", "corner": at([-3.0, -3.0, 0.0]), "edge_u": at([6.0, 0.0, 0.0]),
                "edge_v": at([0.0, 6.0, 0.0]), "material": "floor"
            }),
        );
        scenes::add(&mut s, "lights", scenes::beam(at([0.4, 0.2, -1.0]), 2.0));
        scenes::add(
            &mut s,
            "lights",
            json!({ "type": "point", "position": at([2.0, -1.0, 2.0]), "intensity": 3 }),
        );
        loosely(&s, name, 1e-3)
    };
    let as_it_is = show(
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        "as it is",
    );
    // 37° about (1, 2, 3) (Rodrigues).
    let axis = [1.0, 2.0, 3.0].map(|x: f64| x / 14f64.sqrt());
    let (s, c) = 37f64.to_radians().sin_cos();
    let cross = |i: usize, j: usize| match (i, j) {
        (0, 1) => -axis[2],
        (0, 2) => axis[1],
        (1, 0) => axis[2],
        (1, 2) => -axis[0],
        (2, 0) => -axis[1],
        (2, 1) => axis[0],
        _ => 0.0,
    };
    let turned = [0, 1, 2].map(|i| {
        [0, 1, 2].map(|j| {
            let unit = if i == j { c } else { 0.0 };
            unit + (1.0 - c) * axis[i] * axis[j] + s * cross(i, j)
        })
    });
    out.same("turned", &as_it_is, &show(turned, "turned"));
    let permuted = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
    out.same("axes permuted", &as_it_is, &show(permuted, "permuted"));
    let mirrored = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    out.same("mirrored", &as_it_is, &show(mirrored, "mirrored"));
    out.assert();
}

/// Boxes and balls without extent are refused or not there; inverted ones are refused by name. Media without extinction change no bit
/// and cost no look-up.
#[test]
fn media_that_are_not_there() {
    let mut out = Table::new("media_that_are_not_there");
    let before = |params: Value| {
        let mut s = scenes::scene([0.1, 0.2, 3.0], [0.05, 0.1, -1.0]);
        scenes::add(&mut s, "lights", scenes::dome(0.7));
        scenes::medium(&mut s, "m", params);
        s
    };
    for (name, shape) in [
        ("flat", json!({ "bounds": [-1, -1, 0.5, 1, 1, 0.5] })),
        ("a point", json!({ "bounds": [0, 0, 0, 0, 0, 0] })),
        ("a ball of radius 0", json!({ "radius": 0 })),
    ] {
        let mut p = shape;
        p["sigma_t"] = json!(5);
        match build(&before(p)) {
            Err(e) => out.claim(e.contains("test.json:"), || format!("{name}: {e}")),
            Ok(ready) => {
                let m = ready.measure_range(1, 0, 16);
                exactly(&mut out, name, &m, [0.7; 3]);
            }
        }
    }
    for bounds in [[1, -1, -1, -1, 1, 1], [-1, -1, 1, 1, 1, -1]] {
        let e = build(&before(json!({ "sigma_t": 1, "bounds": bounds }))).err();
        out.claim(
            e.as_ref()
                .is_some_and(|e| e.contains("bounds") && e.contains("test.json:")),
            || format!("{bounds:?}: {e:?}"),
        );
    }
    // The light of a small sun on a floor, with and without a medium of no extinction.
    let lit = |medium: bool| {
        let mut s = scenes::scene([0.1, 0.2, 3.0], [0.05, 0.1, -1.0]);
        scenes::add(&mut s, "lights", scenes::beam([0.3, 0.2, -1.0], 2.0));
        scenes::diffuse(&mut s, "floor", json!(0.6));
        let floor = json!({
            "type": "rectangle", "corner": [-3, -3, 0], "edge_u": [6, 0, 0], "edge_v": [0, 6, 0],
            "material": "floor"
        });
        scenes::add(&mut s, "shapes", floor);
        if medium {
            let p = json!({ "sigma_t": 0, "bounds": [-1, -1, 0, 1, 1, 1] });
            scenes::medium(&mut s, "m", p);
        }
        once(&s, "lit")
    };
    let (with, without) = (lit(true), lit(false));
    out.claim(with.mean == without.mean, || {
        format!("{:?} is not {:?}", with.mean, without.mean)
    });
    out.claim(with.counters.lookups == 0, || "look-ups in nothing".into());
    out.assert();
}

/// A mesh with a hole, and one whose normals point inwards, filled with a medium that then has no end for some rays: an error that names
/// the mesh, or a picture of numbers. The medium absorbs; one that scatters without loss and without end is a walk without end.
#[test]
fn open_and_inverted_meshes() {
    let mut out = Table::new("open_and_inverted_meshes");
    let filled = |change: &dyn Fn(&mut Vec<Value>)| {
        let mut s = scenes::scene([0.1, 0.2, 4.0], [0.02, 0.0, -1.0]);
        scenes::add(&mut s, "lights", scenes::dome(1));
        scenes::medium(&mut s, "m", json!({ "sigma_t": 2, "albedo": 0.5 }));
        let mut mesh = scenes::cuboid([-1.0; 3], [1.0; 3]);
        if let Some(t) = mesh["indices"].as_array_mut() {
            change(t);
        }
        mesh["interior"] = json!("m");
        scenes::add(&mut s, "shapes", mesh);
        s
    };
    let invert = |triangles: &mut Vec<Value>| {
        for t in triangles.iter_mut().filter_map(Value::as_array_mut) {
            t.swap(1, 2);
        }
    };
    // Without the last face, which the ray leaves through.
    let open = |triangles: &mut Vec<Value>| triangles.truncate(10);
    for (name, s) in [("inverted", filled(&invert)), ("open", filled(&open))] {
        match build(&s) {
            Err(e) => out.claim(e.contains("$.shapes[0]"), || format!("{name}: {e}")),
            Ok(ready) => {
                let m = ready.measure_range(1, 0, 16);
                out.claim((0.0..=1.0).contains(&m.mean[0]), || {
                    format!("{name}: {:?}", m.mean)
                });
            }
        }
    }
    out.assert();
}

/// A sphere that shines, nearing the boundary of a medium, touching it, reaching into it and around it: no jump where they touch.
#[test]
fn a_sphere_light_at_the_boundary() {
    let mut out = Table::new("a_sphere_light_at_the_boundary");
    let at = |z: f64, radius: f64| {
        let mut s = scenes::scene([0.9, 0.1, 4.0], [-0.1, 0.0, -1.0]);
        let fog = json!({ "sigma_t": 0.8, "albedo": 0.9, "bounds": [-2, -2, 0, 2, 2, 1] });
        scenes::medium(&mut s, "m", fog);
        scenes::add(
            &mut s,
            "shapes",
            json!({ "type": "sphere", "center": [0, 0, z], "radius": radius, "emission": 4 }),
        );
        loosely(&s, &format!("sphere at {z}"), 3e-3)
    };
    let touching = at(1.3, 0.3);
    out.claim(touching.mean[0] > 0.02, || "dark".into());
    for step in [1e-5, -1e-5] {
        let beside = at(1.3 + step, 0.3);
        out.same(&format!("{step} beside"), &touching, &beside);
    }
    // Half inside: continuous as well.
    let half = at(1.0, 0.3);
    out.same("half inside", &half, &at(1.0 + 1e-5, 0.3));
    // All around: the medium sees its radiance from everywhere.
    let mut s = scenes::scene([0.1, 0.0, 0.5], [0.3, 0.2, -1.0]);
    let fog = json!({ "sigma_t": 2, "albedo": 1, "center": [0, 0, 0], "radius": 1 });
    scenes::medium(&mut s, "m", fog);
    let shell = json!({
        "type": "sphere", "center": [0, 0, 0], "radius": 3, "emission": 1, "two_sided": true
    });
    scenes::add(&mut s, "shapes", shell);
    let p = Precision::of([1.0; 3]).lanes(1);
    let m = measure(&s, "around", &p);
    out.row("around", &m, &[(0, 1.0)], &p);
    out.assert();
}

/// A square of edge 10⁶ and one of 10⁻⁴, each alone and both together.
#[test]
fn huge_and_tiny_together() {
    let mut out = Table::new("huge_and_tiny_together");
    let square = |edge: f64, z: f64, material: &str| {
        let h = 0.5 * edge;
        json!({
            "type": "mesh", "material": material, "indices": [[0, 1, 2], [0, 2, 3]],
            "positions": [[-h, -h, z], [h, -h, z], [h, h, z], [-h, h, z]]
        })
    };
    let show = |huge: bool, tiny: bool, aside: f64, name: &str| {
        let mut s = scenes::scene([aside, 0.0, 2e-3], [0.0, 0.0, -1.0]);
        scenes::diffuse(&mut s, "grey", json!(0.3));
        scenes::diffuse(&mut s, "white", json!(0.8));
        if huge {
            scenes::add(&mut s, "shapes", square(1e6, 0.0, "grey"));
        }
        if tiny {
            scenes::add(&mut s, "shapes", square(1e-4, 1e-3, "white"));
        }
        scenes::add(&mut s, "lights", scenes::beam([0.3, 0.0, -1.0], 2.0));
        once(&s, name)
    };
    let irradiance = 2.0 / 1.09f64.sqrt();
    for (name, m, albedo) in [
        ("tiny alone", show(false, true, 0.0, "tiny"), 0.8),
        ("huge alone", show(true, false, 0.1, "huge"), 0.3),
        ("tiny before huge", show(true, true, 0.0, "both"), 0.8),
        // So far aside that the light from one to the other does not count.
        ("huge beside tiny", show(true, true, 0.1, "beside"), 0.3),
    ] {
        exactly(
            &mut out,
            name,
            &m,
            [albedo / std::f64::consts::PI * irradiance; 3],
        );
    }
    out.assert();
}

/// The same fog as a box, as the interior of a mesh, and as a grid of constant voxels; and grids of voxels of size 10⁻⁶ and 10⁶.
#[test]
fn box_mesh_and_grid() {
    let mut out = Table::new("box_mesh_and_grid");
    let folder = std::env::temp_dir().join(format!("resolvent-grids-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap_or_else(|e| panic!("{e}"));
    // Voxels −8 … 7: with nearest sampling a box from −8.5 to 7.5 voxels.
    let grid = |size: f64| {
        let path = folder.join(format!("{size}.vdb"));
        let inside = |v: i32| (-8..8).contains(&v);
        let voxels = Voxels {
            reach: 8,
            size,
            value: &|at| f32::from(u8::from(at.into_iter().all(inside))),
        };
        voxels.write(&path).unwrap_or_else(|e| panic!("{e}"));
        path
    };
    let (low, high) = (-8.5, 7.5);
    let show = |kind: &str, size: f64| {
        let mut s = scenes::scene([0.7 * size, 2.0 * size, 40.0 * size], [0.02, 0.03, -1.0]);
        scenes::add(&mut s, "lights", scenes::beam([0.5, 0.2, -1.0], 1.0));
        let mut p = json!({ "sigma_t": 0.15 / size, "albedo": 0.9, "phase": scenes::hg(0.4) });
        let corners = |v: f64| [v * size; 3];
        match kind {
            "box" => {
                p["bounds"] = json!([corners(low), corners(high)].concat());
                scenes::medium(&mut s, "m", p);
            }
            "mesh" => {
                scenes::medium(&mut s, "m", p);
                let mut mesh = scenes::cuboid(corners(low), corners(high));
                mesh["interior"] = json!("m");
                scenes::add(&mut s, "shapes", mesh);
            }
            _ => {
                p["file"] = json!(grid(size));
                p["interpolation"] = json!("nearest");
                s["media"]["m"] = json!({ "plugin": "vdb", "params": p });
            }
        }
        loosely(&s, &format!("{kind} {size}"), 1e-3)
    };
    let whole = show("box", 1.0);
    out.claim(whole.mean[0] > 0.01, || "dark".into());
    out.same("mesh", &whole, &show("mesh", 1.0));
    for size in [1.0, 1e-6, 1e6] {
        out.same(&format!("grid of {size}"), &whole, &show("grid", size));
    }
    let _ = std::fs::remove_dir_all(folder);
    out.assert();
}

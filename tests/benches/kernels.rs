//! `cargo bench -p resolvent-tests`: CPU time of the kernels that renders are made of, through the plugin boundary as renders call
//! them. Build the plugins first (`cargo build --release`).
//!
//! Each figure is the least of 15 batches of at least 20 ms; with it the middle one, which says how busy the machine is.

use glam::{Vec3, vec3};
use nix::sys::resource::{UsageWho, getrusage};
use resolvent_api::math::warp;
use resolvent_api::rng::Stream;
use resolvent_api::{FlightDraws, Segment, Spectrum};
use resolvent_engine::geometry::{Accel, Geometry, Ray, Shape, Sphere, TriangleMesh};
use resolvent_engine::plugin::{ForeignMedium, Registry};
use resolvent_engine::scene::Scene;
use serde_json::{Value, json};
use std::hint::black_box;

fn cpu() -> f64 {
    getrusage(UsageWho::RUSAGE_THREAD).map_or(0.0, |u| {
        let t = u.user_time();
        t.tv_sec() as f64 + t.tv_usec() as f64 * 1e-6
    })
}

/// Times `f`, which does `work` operations and returns what must not be optimised away.
fn time<R>(name: &str, work: usize, mut f: impl FnMut() -> R) {
    let mut repeats = 1;
    loop {
        let start = cpu();
        (0..repeats).for_each(|_| drop(black_box(f())));
        if cpu() - start > 0.02 {
            break;
        }
        repeats *= 2;
    }
    let mut batches: Vec<f64> = (0..15)
        .map(|_| {
            let start = cpu();
            (0..repeats).for_each(|_| drop(black_box(f())));
            1e9 * (cpu() - start) / (repeats * work) as f64
        })
        .collect();
    batches.sort_by(f64::total_cmp);
    println!(
        "{name:44} {:8.1} ns  (middle {:.1})",
        batches[0], batches[7]
    );
}

fn draws(u: &mut Stream) -> FlightDraws {
    FlightDraws {
        tau: u.uniform(),
        event: u.uniform(),
        key: u.bits(),
        hero: 0,
        lanes: 1,
        flags: 0,
        reserved: 0,
        prior: Spectrum::ONE,
    }
}

/// Segments between points of the medium's box, some of them through empty space, as connections are.
fn segments(medium: &ForeignMedium, u: &mut Stream) -> Vec<(Segment, FlightDraws)> {
    let (low, extent) = (
        Vec3::from(medium.info.bounds.min),
        medium.info.bounds.extent(),
    );
    let point = |u: &mut Stream| low + extent * vec3(u.uniform(), u.uniform(), u.uniform());
    (0..2000)
        .map(|_| {
            let (a, b) = (point(u), point(u));
            let s = Segment {
                o: a.into(),
                t0: 0.0,
                d: (b - a).normalize_or(Vec3::X).into(),
                t1: (b - a).length(),
            };
            (s, draws(u))
        })
        .collect()
}

fn media() {
    let cloud = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/cloud/cloud_s.vdb");
    let grey =
        json!({"plugin": "vdb", "params": {"file": cloud, "sigma_t": 24.56, "albedo": 0.99}});
    let chromatic = json!({"plugin": "vdb", "params": {"file": cloud, "sigma_t": [2.7, 8.2, 24.56], "albedo": 0.99}});
    let fog =
        json!({"plugin": "homogeneous", "params": {"sigma_t": 2, "bounds": [-1, -1, -1, 1, 1, 1]}});
    let noise = json!({"plugin": "procedural", "params": {"sigma_t": 20, "radius": 1, "center": [0, 0, 0]}});
    for (name, block) in [
        ("vdb", grey),
        ("vdb, chromatic", chromatic),
        ("homogeneous", fog),
        ("procedural", noise),
    ] {
        let scene = built(&json!({
            "resolvent": 1,
            "camera": {"type": "perspective", "origin": [0, 0, 9], "target": [0, 0, 0], "fov_x_deg": 40},
            "film": {"resolution": [8, 8]}, "integrator": {"plugin": "pt"},
            "lights": [{"type": "environment", "radiance": 1}], "media": {"m": block}
        }));
        let medium = &scene.media[0].medium;
        let mut u = Stream::new(7);
        let all = segments(medium, &mut u);
        let n = all.len();
        let each = |f: &dyn Fn(&Segment, &FlightDraws) -> f32| {
            all.iter().map(|(s, u)| f(s, u)).sum::<f32>()
        };
        time(&format!("{name}: look-up (exact, at a point)"), n, || {
            each(&|s, _| {
                medium
                    .coefficients(s.at(0.5 * s.t1))
                    .map_or(0.0, |c| c.sigma_t[0])
            })
        });
        time(&format!("{name}: free flight"), n, || {
            each(&|s, u| medium.sample(s, u).map_or(0.0, |f| f.t))
        });
        time(&format!("{name}: transmittance"), n, || {
            each(&|s, u| medium.transmit(s, u).map_or(0.0, |f| f.value[0]))
        });
        time(&format!("{name}: approximate depth"), n, || {
            each(&|s, _| medium.depth(s).map_or(0.0, |d| d[0]))
        });
    }
}

fn built(scene: &Value) -> Scene {
    let registry = Registry::new(&[]);
    let text = scene.to_string();
    let described = resolvent_scene::Scene::parse(text.as_bytes(), "kernels.json")
        .unwrap_or_else(|e| panic!("{e}"));
    Scene::build(&described, &registry).unwrap_or_else(|e| panic!("{e}"))
}

/// A wavy sheet of `n` × `n` squares.
fn sheet(n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for j in 0..=n {
        for i in 0..=n {
            let (x, y) = (
                2.0 * i as f32 / n as f32 - 1.0,
                2.0 * j as f32 / n as f32 - 1.0,
            );
            let z = 0.1 * ((9.0 * x).sin() + (7.0 * y).cos());
            mesh.positions.push(vec3(x, y, z));
        }
    }
    let at = |i, j| j * (n + 1) + i;
    for j in 0..n {
        for i in 0..n {
            mesh.indices
                .push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.indices
                .push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}

fn geometry() {
    let mut u = Stream::new(3);
    let mut rays = |n: usize| -> Vec<Ray> {
        (0..n)
            .map(|_| {
                let o = 2.0 * warp::sphere(u.uniform2());
                let target = vec3(u.uniform() - 0.5, u.uniform() - 0.5, 0.0) * 1.6;
                Ray::new(o, (target - o).normalize_or(Vec3::Z))
            })
            .collect()
    };
    let rays = rays(5000);
    for (name, shapes) in [
        ("a triangle", vec![Shape::Mesh(sheet(1))]),
        (
            "a sphere",
            vec![Shape::Sphere(Sphere {
                center: Vec3::ZERO,
                radius: 0.8,
            })],
        ),
        ("20 000 triangles", vec![Shape::Mesh(sheet(100))]),
        ("2 000 000 triangles", vec![Shape::Mesh(sheet(1000))]),
    ] {
        let Ok(Some(accel)) = Accel::build(Geometry { shapes }) else {
            panic!("{name}: nothing to hit");
        };
        time(&format!("ray, {name}: nearest"), rays.len(), || {
            rays.iter().filter(|r| accel.closest(r).is_some()).count()
        });
        time(&format!("ray, {name}: any"), rays.len(), || {
            rays.iter().filter(|r| accel.occluded(r)).count()
        });
    }
}

fn main() {
    media();
    geometry();
}

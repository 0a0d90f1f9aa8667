//! Rays leave surfaces without meeting them again, and do not slip through shared edges.

use crate::cases;
use glam::{Vec3, vec3};
use proptest::prelude::*;
use resolvent_engine::geometry::{Accel, Geometry, Ray, Shape, TriangleMesh};

/// Rays traced in each of the two tests.
fn rays() -> u64 {
    std::env::var("RESOLVENT_RAYS")
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(if cfg!(debug_assertions) {
            20_000
        } else {
            300_000
        })
}

const MESHES: u32 = 100;

struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 40) as f32 / 16_777_216.0
    }

    fn direction(&mut self) -> Vec3 {
        resolvent_api::math::warp::sphere([self.next(), self.next()])
    }
}

fn accel(positions: Vec<Vec3>, indices: Vec<[u32; 3]>) -> Accel {
    let mesh = TriangleMesh {
        positions,
        indices,
        ..TriangleMesh::default()
    };
    let geometry = Geometry {
        shapes: vec![Shape::Mesh(mesh)],
    };
    Accel::build(geometry)
        .unwrap_or_else(|e| panic!("{e}"))
        .unwrap_or_else(|| panic!("nothing to hit"))
}

/// A size over eight decades and a place that leaves at least three digits of it.
fn place() -> impl Strategy<Value = (f32, Vec3)> {
    (-4f32..4.0, 0f32..3.5, 0u64..1 << 40).prop_map(|(log, away, seed)| {
        let size = 10f32.powf(log);
        let far = Uniform(seed).direction() * (size * 10f32.powf(away));
        (size, far)
    })
}

/// A closed double pyramid over a polygon, with rims at random distances: convex or not, all seen from the middle of its axis.
fn body(corners: usize, seed: u64, size: f32, at: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let mut u = Uniform(seed);
    let mut positions: Vec<Vec3> = (0..corners)
        .map(|k| {
            let turn = (k as f32 + 0.8 * u.next()) / corners as f32;
            let (s, c) = (turn * std::f32::consts::TAU).sin_cos();
            at + size * (0.3 + u.next()) * vec3(c, s, 0.2 * (u.next() - 0.5))
        })
        .collect();
    positions.push(at + size * vec3(0.0, 0.0, 0.5 + u.next()));
    positions.push(at - size * vec3(0.0, 0.0, 0.5 + u.next()));
    let n = corners as u32;
    let mut indices = Vec::new();
    for k in 0..n {
        indices.push([k, (k + 1) % n, n]);
        indices.push([(k + 1) % n, k, n + 1]);
    }
    (positions, indices)
}

proptest! {
    #![proptest_config(proptest::test_runner::Config { cases: MESHES, ..cases(MESHES) })]

    /// From a point on a plane triangle no ray meets that triangle again, whatever its size, place and slant.
    #[test]
    fn origins_are_not_met_again((size, at) in place(), seed in 0u64..1 << 40) {
        let mut u = Uniform(seed);
        let corner = |u: &mut Uniform| at + size * u.direction();
        let positions = vec![corner(&mut u), corner(&mut u), corner(&mut u)];
        let [a, b, c] = [positions[0], positions[1], positions[2]];
        prop_assume!((b - a).cross(c - a).length() > 1e-3 * size * size);
        let one = accel(positions, vec![[0, 1, 2]]);
        for _ in 0..rays() / u64::from(MESHES) {
            let (mut x, mut y) = (u.next(), u.next());
            if x + y > 1.0 {
                (x, y) = (1.0 - x, 1.0 - y);
            }
            let target = a + (b - a) * x + (c - a) * y;
            let from = target + u.direction() * (size * 10f32.powf(4.0 * u.next() - 2.0));
            let ray = Ray::new(from, target - from);
            // On the rim, and edge on, rounding decides whether there is a hit.
            let Some(hit) = one.closest(&ray) else { continue };
            let point = one.interaction(&hit, &ray);
            for _ in 0..4 {
                let w = u.direction();
                let next = point.spawn(w);
                prop_assert!(one.closest(&next).is_none(), "{ray:?} {next:?}");
                prop_assert!(!one.occluded(&next), "{ray:?} {next:?}");
            }
        }
    }

    /// From inside a closed body every ray meets it, aimed at vertices and edges as exactly as numbers allow.
    #[test]
    fn shared_edges_let_nothing_through(corners in 5usize..12, (size, at) in place(), seed in 0u64..1 << 40) {
        let (positions, indices) = body(corners, seed, size, at);
        let closed = accel(positions.clone(), indices.clone());
        let mut u = Uniform(seed ^ 0x6564_6765);
        for i in 0..rays() / u64::from(MESHES) {
            let t = indices[(u.next() * indices.len() as f32) as usize % indices.len()];
            let [a, b] = [t[i as usize % 3], t[(i as usize + 1) % 3]].map(|k| positions[k as usize]);
            let target = match i % 4 {
                0 => a,
                1 => (a + b) * 0.5,
                _ => a + (b - a) * u.next(),
            };
            // Inside: near the axis, where all of the surface is seen.
            let o = at + size * vec3(0.02 * u.next(), 0.02 * u.next(), 0.2 * (u.next() - 0.5));
            let ray = Ray::new(o, target - o);
            prop_assert!(closed.closest(&ray).is_some(), "{ray:?} leaves {positions:?}");
            prop_assert!(closed.occluded(&ray), "{ray:?} leaves {positions:?}");
        }
    }
}

//! Ray throughput on a bumpy sphere of about a million triangles, one thread.
//!
//! `cargo run --release -p resolvent-engine --example rays [subdivisions] [portable]`

use std::time::Instant;

use glam::{Vec3, vec3};
use resolvent_engine::geometry::{Accel, Geometry, Ray, Shape, TriangleMesh};

/// A cube of `n` × `n` squares a side, blown up to a sphere with bumps.
fn bumpy_sphere(n: u32) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for face in 0..6 {
        let base = mesh.positions.len() as u32;
        for j in 0..=n {
            for i in 0..=n {
                let (a, b) = (
                    2.0 * i as f32 / n as f32 - 1.0,
                    2.0 * j as f32 / n as f32 - 1.0,
                );
                let p = match face {
                    0 => vec3(1.0, a, b),
                    1 => vec3(-1.0, b, a),
                    2 => vec3(b, 1.0, a),
                    3 => vec3(a, -1.0, b),
                    4 => vec3(a, b, 1.0),
                    _ => vec3(b, a, -1.0),
                }
                .normalize();
                let bumps =
                    (p * 9.0).sin().element_product() * 0.2 + (p * 41.0).sin().element_sum() * 0.02;
                mesh.positions.push(p * (1.0 + bumps));
            }
        }
        let at = |i, j| base + j * (n + 1) + i;
        for j in 0..n {
            for i in 0..n {
                mesh.indices
                    .push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.indices
                    .push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh
}

/// Numbers in [0, 1) from a hashed counter.
struct Uniform(u64);

impl Uniform {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
    }

    fn direction(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.next();
        let (s, c) = (std::f32::consts::TAU * self.next()).sin_cos();
        let r = (1.0 - z * z).sqrt();
        vec3(r * c, r * s, z)
    }
}

fn report(name: &str, rays: &[Ray], mut hit: impl FnMut(&Ray) -> bool) {
    let mut best = f64::INFINITY;
    let mut hits = 0;
    for _ in 0..5 {
        let start = Instant::now();
        hits = rays.iter().filter(|r| hit(r)).count();
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!(
        "{name:<22} {:6.2} Mray/s  ({hits} of {} hit)",
        rays.len() as f64 / best * 1e-6,
        rays.len()
    );
}

fn main() {
    let mut args = std::env::args().skip(1);
    let n = args.next().and_then(|a| a.parse().ok()).unwrap_or(288);
    let shapes = vec![Shape::Mesh(bumpy_sphere(n))];
    let Ok(Some(mut accel)) = Accel::build(Geometry { shapes }) else {
        panic!("the bumpy sphere has triangles");
    };
    if args.next().as_deref() == Some("portable") {
        accel.use_portable_kernel();
    }
    println!("{} kernel, {:?}", accel.kernel(), accel.stats());

    let mut primary = Vec::new();
    for y in 0..768 {
        for x in 0..768 {
            let d = vec3(
                (x as f32 + 0.5) / 384.0 - 1.0,
                (y as f32 + 0.5) / 384.0 - 1.0,
                -2.2,
            );
            primary.push(Ray::new(vec3(0.0, 0.0, 3.0), d.normalize()));
        }
    }
    let mut random = Uniform(1);
    let mut incoherent = Vec::new();
    let mut shadow = Vec::new();
    let light = vec3(3.0, 4.0, 2.0);
    for ray in &primary {
        if let Some(hit) = accel.closest(ray) {
            let at = accel.interaction(&hit, ray);
            // Diffuse bounce.
            let w = (at.ng + random.direction()).normalize_or(at.ng);
            incoherent.push(at.spawn(w));
            shadow.push(Ray::segment(at.offset(light - at.p), light));
        }
    }
    // Chords between random points around the sphere.
    let chords: Vec<Ray> = (0..500_000)
        .map(|_| {
            let (a, b) = (random.direction() * 1.5, random.direction() * 1.5);
            Ray::new(a, (b - a).normalize_or(Vec3::X))
        })
        .collect();
    for (name, rays) in [
        ("primary", &primary),
        ("diffuse bounce", &incoherent),
        ("shadow", &shadow),
        ("chords", &chords),
    ] {
        report(&format!("{name} closest"), rays, |r| {
            accel.closest(r).is_some()
        });
        report(&format!("{name} any"), rays, |r| accel.occluded(r));
    }
}

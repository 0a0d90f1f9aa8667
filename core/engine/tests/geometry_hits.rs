//! Hits against brute force in f64, and the two kernels against each other.

mod geometry_common;

use geometry_common::{Uniform, icosphere, rays_in_test};
use glam::{DVec3, Vec3, vec3};
use resolvent_engine::geometry::{
    Accel, Cylinder, Disk, Geometry, Hit, Quad, Ray, Shape, Sphere, TriangleMesh,
};

fn soup(n: usize, size: f32, random: &mut Uniform) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..n as u32 {
        let p = random.vector();
        for _ in 0..3 {
            mesh.positions.push(p + random.vector() * size);
        }
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

/// Möller-Trumbore in f64 without tolerances: (t, smallest barycentric weight).
fn brute_triangle(v: [Vec3; 3], ray: &Ray) -> Option<(f64, f64)> {
    let [a, b, c] = v.map(|p| p.as_dvec3());
    let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    let s = o - a;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = d.dot(q) / det;
    let t = e2.dot(q) / det;
    t.is_finite().then_some((t, u.min(v).min(1.0 - u - v)))
}

/// Nearest hit (shape, primitive, t) in f64, and whether some edge within `margin` makes it a matter of rounding.
fn brute(geometry: &Geometry, ray: &Ray, margin: f64) -> (Option<(u32, u32, f64)>, bool) {
    let mut best: Option<(u32, u32, f64)> = None;
    let mut doubtful = false;
    let mut consider = |shape: usize, prim: usize, t: f64| {
        if t > f64::from(ray.t_min) && t < best.map_or(f64::from(ray.t_max), |b| b.2) {
            best = Some((shape as u32, prim as u32, t));
        }
    };
    for (i, shape) in geometry.shapes.iter().enumerate() {
        match shape {
            Shape::Mesh(m) => {
                for (k, t) in m.indices.iter().enumerate() {
                    if let Some((t, inside)) =
                        brute_triangle(t.map(|j| m.positions[j as usize]), ray)
                    {
                        doubtful |= inside.abs() < margin;
                        if inside >= 0.0 {
                            consider(i, k, t);
                        }
                    }
                }
            }
            Shape::Quad(q) => {
                let opposite = q.corner + q.edge_u + q.edge_v;
                let halves = [
                    [q.corner, q.corner + q.edge_u, opposite],
                    [q.corner, opposite, q.corner + q.edge_v],
                ];
                for (k, half) in halves.into_iter().enumerate() {
                    if let Some((t, inside)) = brute_triangle(half, ray) {
                        doubtful |= inside.abs() < margin;
                        if inside >= 0.0 {
                            consider(i, k, t);
                        }
                    }
                }
            }
            Shape::Disk(s) => {
                let n = s.normal.as_dvec3();
                let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
                let t = n.dot(s.center.as_dvec3() - o) / n.dot(d);
                let (from_centre, r) = (
                    (o + d * t).distance(s.center.as_dvec3()),
                    f64::from(s.radius),
                );
                doubtful |= (from_centre - r).abs() < margin * r;
                if from_centre <= r {
                    consider(i, 0, t);
                }
            }
            Shape::Cylinder(s) => {
                // In a frame where the axis is z, the quadratic as it stands in books.
                let z = s.axis.as_dvec3().normalize();
                let x = z.any_orthonormal_vector();
                let to = |v: DVec3| DVec3::new(x.dot(v), z.cross(x).dot(v), z.dot(v));
                let (o, d) = (
                    to(ray.o.as_dvec3() - s.base.as_dvec3()),
                    to(ray.d.as_dvec3()),
                );
                let (r, l) = (f64::from(s.radius), s.axis.as_dvec3().length());
                let a = d.x * d.x + d.y * d.y;
                let b = o.x * d.x + o.y * d.y;
                let h = b * b - a * (o.x * o.x + o.y * o.y - r * r);
                doubtful |= h.abs() < margin * a * r * r;
                if h >= 0.0 {
                    for t in [(-b - h.sqrt()) / a, (-b + h.sqrt()) / a] {
                        let at = o.z + t * d.z;
                        doubtful |= at.abs().min((at - l).abs()) < margin * l;
                        if (0.0..=l).contains(&at) {
                            consider(i, 0, t);
                        }
                    }
                }
            }
            Shape::Sphere(s) => {
                let (f, d, r) = (
                    ray.o.as_dvec3() - s.center.as_dvec3(),
                    ray.d.as_dvec3(),
                    f64::from(s.radius),
                );
                let along = -f.dot(d) / d.length_squared();
                let foot: DVec3 = f + d * along;
                let h = r * r - foot.length_squared();
                doubtful |= h.abs() < margin * r * r;
                if h >= 0.0 {
                    let half = (h / d.length_squared()).sqrt();
                    consider(i, 0, along - half);
                    consider(i, 0, along + half);
                }
            }
        }
    }
    (best, doubtful)
}

fn mixed(random: &mut Uniform) -> Geometry {
    let mut shapes = vec![
        Shape::Mesh(soup(150, 0.2, random)),
        Shape::Mesh(icosphere(1)),
    ];
    for _ in 0..20 {
        shapes.push(Shape::Sphere(Sphere {
            center: random.vector(),
            radius: 0.05 + 0.1 * random.next(),
        }));
        shapes.push(Shape::Quad(Quad {
            corner: random.vector(),
            edge_u: random.vector() * 0.3,
            edge_v: random.vector() * 0.3,
        }));
        shapes.push(Shape::Disk(Disk {
            center: random.vector(),
            normal: random.direction(),
            radius: 0.05 + 0.15 * random.next(),
        }));
        shapes.push(Shape::Cylinder(Cylinder {
            base: random.vector(),
            axis: random.vector() * 0.4,
            radius: 0.02 + 0.1 * random.next(),
        }));
    }
    Geometry { shapes }
}

#[test]
fn agree_with_brute_force() {
    let mut random = Uniform(11);
    let geometry = mixed(&mut random);
    let accel = Accel::build(geometry.clone()).unwrap().unwrap();
    let (mut compared, mut hits) = (0, 0);
    for i in 0..rays_in_test(200_000) {
        let o = random.vector() * 2.0;
        let mut ray = Ray::new(o, (random.vector() - o) * 10f32.powf(3.0 * random.signed()));
        if i % 3 == 0 {
            ray.t_min = 0.5 / ray.d.length();
            ray.t_max = 1.5 / ray.d.length();
        }
        let (expected, doubtful) = brute(&geometry, &ray, 1e-4);
        if doubtful {
            continue;
        }
        compared += 1;
        let found = accel.closest(&ray);
        assert_eq!(accel.occluded(&ray), expected.is_some(), "{ray:?}");
        match (found, expected) {
            (None, None) => {}
            (Some(hit), Some((shape, prim, t))) => {
                hits += 1;
                assert_eq!((hit.shape, hit.prim), (shape, prim), "{ray:?}");
                // f32 distances are exact up to roundoff of the distances of the vertices (at most 5 here).
                let reach = 5.0 / f64::from(ray.d.length());
                let error = (f64::from(hit.t) - t).abs();
                assert!(error <= 1e-5 * reach, "{hit:?} {t} {ray:?}");
                let at = accel.interaction(&hit, &ray);
                let p = ray.o.as_dvec3() + ray.d.as_dvec3() * t;
                // The point stays on the surface, but slides along it as f32 barycentrics do: by roundoff over the cosine.
                let cosine = f64::from(ray.d.normalize().dot(at.ng).abs());
                let error = (at.p.as_dvec3() - p).length();
                assert!(error * cosine < 3e-6, "{at:?} {p} {ray:?}");
            }
            _ => panic!("{ray:?}: {found:?} instead of {expected:?}"),
        }
    }
    assert!(
        compared > rays_in_test(150_000) && hits > compared / 3,
        "{hits} of {compared}"
    );
}

fn bits(h: Option<Hit>) -> Option<[u32; 5]> {
    h.map(|h| [h.t.to_bits(), h.shape, h.prim, h.u.to_bits(), h.v.to_bits()])
}

#[test]
fn kernels_agree_to_the_bit() {
    let mut random = Uniform(12);
    let geometry = mixed(&mut random);
    let accel = Accel::build(geometry).unwrap().unwrap();
    let mut portable = accel.clone();
    portable.use_portable_kernel();
    let special = [0.0, -0.0, 1e-42, -1e-42, 1e-38, 1.0, -1.0];
    let pick = |random: &mut Uniform| special[(random.next() * 7.0) as usize % 7];
    for i in 0..rays_in_test(1_000_000) {
        let mut ray = Ray::new(random.vector() * 2.0, random.vector());
        if i % 4 == 0 {
            ray.d = vec3(pick(&mut random), pick(&mut random), pick(&mut random));
        }
        if i % 5 == 0 {
            ray.t_max = random.next() * 2.0;
        }
        assert_eq!(
            bits(accel.closest(&ray)),
            bits(portable.closest(&ray)),
            "{ray:?}"
        );
        assert_eq!(accel.occluded(&ray), portable.occluded(&ray), "{ray:?}");
    }
}

/// A grid of unit squares at z = 0, rays straight down onto every lattice point, edge and square: all zeros and signs of zeros in
/// the direction, and origins in the planes of boxes' faces.
#[test]
fn axis_parallel_rays() {
    let n = 9;
    let mut mesh = TriangleMesh::default();
    for y in 0..=n {
        for x in 0..=n {
            mesh.positions.push(vec3(x as f32, y as f32, 0.0));
        }
    }
    let at = |x: u32, y: u32| y * (n + 1) + x;
    for y in 0..n {
        for x in 0..n {
            mesh.indices
                .push([at(x, y), at(x + 1, y), at(x + 1, y + 1)]);
            mesh.indices
                .push([at(x, y), at(x + 1, y + 1), at(x, y + 1)]);
        }
    }
    for turn in 0..3 {
        let roll = |p: Vec3| match turn {
            0 => p,
            1 => vec3(p.z, p.x, p.y),
            _ => vec3(p.y, p.z, p.x),
        };
        let mut turned = mesh.clone();
        turned.positions.iter_mut().for_each(|p| *p = roll(*p));
        let mut accel = Accel::build(Geometry {
            shapes: vec![Shape::Mesh(turned)],
        })
        .unwrap()
        .unwrap();
        for _ in 0..2 {
            for zero in [
                vec3(0.0, 0.0, 1.0),
                vec3(-0.0, 0.0, 1.0),
                vec3(0.0, -0.0, 1.0),
                vec3(1e-44, -1e-44, 1.0),
            ] {
                for (height, sign) in [(3.0, -1.0), (-3.0, 1.0)] {
                    for i in 0..=2 * n {
                        for j in 0..=2 * n {
                            let o = vec3(i as f32 * 0.5, j as f32 * 0.5, height);
                            let rim = i % (2 * n) == 0 || j % (2 * n) == 0;
                            if rim && zero.x.abs() > 0.0 {
                                continue; // It drifts past the rim.
                            }
                            let ray = Ray::new(roll(o), roll(vec3(zero.x, zero.y, sign)));
                            let hit = accel.closest(&ray);
                            assert_eq!(hit.map(|h| h.t), Some(3.0), "{ray:?}");
                            assert!(accel.occluded(&ray));
                            let ray = Ray::new(roll(o), roll(vec3(zero.x, zero.y, -sign)));
                            assert!(accel.closest(&ray).is_none(), "{ray:?}");
                        }
                    }
                }
            }
            // In the plane of the mesh: edge on, nothing.
            assert!(
                accel
                    .closest(&Ray::new(roll(vec3(-1.0, 2.5, 0.0)), roll(Vec3::X)))
                    .is_none()
            );
            accel.use_portable_kernel();
        }
    }
}

/// A tiny triangle seen from afar along an axis: slabs with a clamped 1/d lose it.
#[test]
fn tiny_triangle_far_away() {
    for size in [1e-5, 1e-9, 1e-20] {
        let mesh = TriangleMesh {
            positions: vec![
                vec3(-size, -size, 0.0),
                vec3(size, -size, 0.0),
                vec3(0.0, size, 0.0),
            ],
            indices: vec![[0, 1, 2]],
            ..TriangleMesh::default()
        };
        let accel = Accel::build(Geometry {
            shapes: vec![Shape::Mesh(mesh)],
        })
        .unwrap()
        .unwrap();
        for o in [vec3(0.0, 0.0, 1000.0), vec3(0.25 * size, -0.5 * size, 1e6)] {
            let ray = Ray::new(o, -Vec3::Z);
            assert_eq!(accel.closest(&ray).map(|h| h.t), Some(o.z), "{size} {o}");
            assert_eq!(accel.closest(&Ray::new(o, Vec3::Z)), None);
            assert_eq!(
                accel.closest(&Ray::new(o + Vec3::X * 2.0 * size, -Vec3::Z)),
                None
            );
        }
    }
}

/// The interval is open at both ends, to the last bit.
#[test]
fn interval_ends_are_excluded() {
    let quad = Quad {
        corner: vec3(-1.0, -1.0, 2.0),
        edge_u: Vec3::X * 2.0,
        edge_v: Vec3::Y * 2.0,
    };
    let ball = Sphere {
        center: vec3(10.0, 0.0, 3.0),
        radius: 1.0,
    };
    let accel = Accel::build(Geometry {
        shapes: vec![Shape::Quad(quad), Shape::Sphere(ball)],
    })
    .unwrap()
    .unwrap();
    for x in [0.3, 10.0] {
        let at = |t_min: f32, t_max: f32| Ray {
            o: vec3(x, 0.0, 0.0),
            d: Vec3::Z,
            t_min,
            t_max,
        };
        assert!(accel.occluded(&at(0.0, 2f32.next_up())));
        assert!(
            accel
                .closest(&at(2f32.next_down(), 2f32.next_up()))
                .is_some()
        );
        assert!(!accel.occluded(&at(0.0, 2.0)) && accel.closest(&at(0.0, 2.0)).is_none());
        assert!(accel.closest(&at(2.0, 3.0)).is_none() && !accel.occluded(&at(2.0, 3.0)));
        assert!(!accel.occluded(&at(0.0, 2f32.next_down())));
    }
}

/// Of coincident surfaces the first one is hit, from either side.
#[test]
fn equal_distances_go_to_the_first() {
    let mut random = Uniform(13);
    let sheet = |_| {
        Shape::Quad(Quad {
            corner: vec3(-1.0, -1.0, 0.1),
            edge_u: Vec3::X * 2.0,
            edge_v: Vec3::Y * 2.0,
        })
    };
    let accel = Accel::build(Geometry {
        shapes: (0..30).map(sheet).collect(),
    })
    .unwrap()
    .unwrap();
    for _ in 0..rays_in_test(100_000) {
        let o = random.vector() * 0.5 + Vec3::Z * 2.0;
        let ray = Ray::new(
            o,
            vec3(random.signed() * 0.5, random.signed() * 0.5, 0.1) - o,
        );
        assert_eq!(accel.closest(&ray).map(|h| h.shape), Some(0), "{ray:?}");
        assert!(accel.occluded(&ray), "{ray:?}");
    }
}

/// The padded part of a leaf's boxes and the widening of slabs cost nothing in correctness: a ray beside everything misses.
#[test]
fn rays_that_cannot_hit() {
    let accel = Accel::build(Geometry {
        shapes: vec![Shape::Mesh(icosphere(2))],
    })
    .unwrap()
    .unwrap();
    let inf = f32::INFINITY;
    for ray in [
        Ray::new(vec3(f32::NAN, 0.0, 0.0), Vec3::X),
        Ray::new(Vec3::ZERO, vec3(f32::NAN, 0.0, 1.0)),
        Ray::new(Vec3::ZERO, vec3(inf, 0.0, 1.0)),
        Ray::new(vec3(inf, 0.0, 0.0), Vec3::X),
        Ray::new(vec3(-3e18, 0.0, 0.0), Vec3::X),
        Ray::new(Vec3::ZERO, Vec3::ZERO),
        Ray {
            t_max: f32::NAN,
            ..Ray::new(Vec3::ZERO, Vec3::X)
        },
        Ray {
            t_min: f32::NAN,
            ..Ray::new(Vec3::ZERO, Vec3::X)
        },
        Ray {
            t_max: 0.0,
            ..Ray::new(Vec3::ZERO, Vec3::X)
        },
        Ray {
            t_max: -1.0,
            ..Ray::new(Vec3::ZERO, Vec3::X)
        },
        Ray {
            t_min: 2.0,
            t_max: 1.0,
            ..Ray::new(Vec3::ZERO, Vec3::X)
        },
    ] {
        assert!(
            accel.closest(&ray).is_none() && !accel.occluded(&ray),
            "{ray:?}"
        );
    }
    // A negative t_min acts as 0: the surface behind the origin is not hit.
    let ray = Ray {
        t_min: -10.0,
        ..Ray::new(vec3(2.0, 0.0, 0.0), Vec3::X)
    };
    assert!(accel.closest(&ray).is_none());
    let ray = Ray {
        t_min: -10.0,
        ..Ray::new(Vec3::ZERO, Vec3::X)
    };
    assert!(accel.closest(&ray).is_some());
}

//! Instances: the same hits as the shapes would give by themselves, no leaks, no self-intersection, little memory.

mod geometry_common;

use geometry_common::{Uniform, icosphere, rays_in_test};
use glam::{DVec3, Vec3, vec3};
use resolvent_api::Affine;
use resolvent_engine::geometry::{
    Accel, Cylinder, Disk, Geometry, GeometryError, Instance, Quad, Ray, Shape, Sphere,
    TriangleMesh,
};

/// A transform that turns, shears and stretches by up to `stretch`, mirrors half of the time, and moves by `place`.
fn transform(random: &mut Uniform, stretch: f32, place: Vec3) -> Affine {
    let axis = |r: &mut Uniform| r.direction().as_dvec3();
    loop {
        let columns = [(); 3].map(|()| {
            let size = stretch.powf(random.signed());
            axis(random) * f64::from(size)
        });
        let t = Affine {
            columns,
            translation: place.as_dvec3(),
        };
        let volume: f64 = columns.iter().map(|c| c.length()).product();
        // Nearly flat ones have their own test.
        if t.determinant().abs() > 0.05 * volume {
            return t;
        }
    }
}

fn inside_out(mesh: &TriangleMesh, t: &Affine) -> TriangleMesh {
    let mut out = mesh.clone();
    for p in &mut out.positions {
        *p = t.point(p.as_dvec3()).as_vec3();
    }
    if t.determinant() < 0.0 {
        for i in &mut out.indices {
            i.swap(1, 2);
        }
    }
    out
}

fn instanced(prototype: Vec<Shape>, at: &[Affine]) -> Accel {
    let instances: Vec<Instance> = at
        .iter()
        .map(|&to_world| Instance {
            prototype: 0,
            to_world,
        })
        .collect();
    let prototypes = vec![Geometry { shapes: prototype }];
    Accel::build_instanced(Geometry::default(), prototypes, &instances)
        .unwrap()
        .unwrap()
}

/// Many overlapping copies beside loose shapes give the hits, points and normals of the transformed meshes, in both kernels.
#[test]
fn the_same_hits_as_without() {
    let mut random = Uniform(11);
    let mesh = icosphere(2);
    let places: Vec<Affine> = (0..60)
        .map(|_| {
            let place = random.vector() * 6.0;
            transform(&mut random, 3.0, place)
        })
        .collect();
    let loose = vec![
        Shape::Quad(Quad {
            corner: vec3(-8.0, -8.0, -3.0),
            edge_u: vec3(16.0, 0.0, 0.0),
            edge_v: vec3(0.0, 16.0, 0.0),
        }),
        Shape::Sphere(Sphere {
            center: Vec3::ZERO,
            radius: 2.0,
        }),
    ];
    // Two shapes in the prototype: the second is out of the way of nothing.
    let ball = Shape::Mesh(mesh.clone());
    let far = Shape::Quad(Quad {
        corner: vec3(0.0, 0.0, 3.0),
        edge_u: Vec3::X,
        edge_v: Vec3::Y,
    });
    let prototype = Geometry {
        shapes: vec![far, ball],
    };
    let instances: Vec<Instance> = places
        .iter()
        .map(|&to_world| Instance {
            prototype: 0,
            to_world,
        })
        .collect();
    let geometry = Geometry {
        shapes: loose.clone(),
    };
    let mut accel = Accel::build_instanced(geometry, vec![prototype], &instances)
        .unwrap()
        .unwrap();
    let mut shapes = loose;
    for t in &places {
        let corner = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(x, y)| t.point(DVec3::new(x, y, 3.0)).as_vec3());
        shapes.push(Shape::Mesh(inside_out(
            &TriangleMesh {
                positions: vec![
                    vec3(0.0, 0.0, 3.0),
                    vec3(1.0, 0.0, 3.0),
                    vec3(1.0, 1.0, 3.0),
                    vec3(0.0, 1.0, 3.0),
                ],
                indices: vec![[0, 1, 2], [0, 2, 3]],
                ..TriangleMesh::default()
            },
            t,
        )));
        assert!(corner[0].is_finite());
        shapes.push(Shape::Mesh(inside_out(&mesh, t)));
    }
    let flat = Accel::build(Geometry { shapes }).unwrap().unwrap();
    assert_eq!(accel.stats().instances, 60);
    assert_eq!(accel.stats().bvhs, 3);

    let (mut hits, mut differ, mut on_instances) = (0, 0, 0);
    let rays: Vec<Ray> = (0..rays_in_test(100_000))
        .map(|_| {
            let o = random.direction() * 12.0;
            Ray::new(o, random.vector() * 5.0 - o)
        })
        .collect();
    let mut first = Vec::new();
    for kernel in 0..2 {
        for (i, ray) in rays.iter().enumerate() {
            let (a, b) = (accel.closest(ray), flat.closest(ray));
            assert_eq!(a.is_some(), accel.occluded(ray));
            if kernel == 0 {
                first.push(a);
            } else {
                assert_eq!(a, first[i], "the kernels differ");
                continue;
            }
            let (Some(a), Some(b)) = (a, b) else {
                // Silhouettes are a matter of rounding.
                differ += usize::from(a.is_some() != b.is_some());
                continue;
            };
            hits += 1;
            if a.shape != b.shape || (a.t - b.t).abs() > 1e-5 * b.t {
                differ += 1;
                continue;
            }
            let (p, q) = (accel.interaction(&a, ray), flat.interaction(&b, ray));
            on_instances += usize::from(accel.instance_of(a.shape).is_some());
            assert!(p.ng.dot(q.ng) > 0.9999, "{:?} {:?}", p.ng, q.ng);
            // In the same plane, and at the same place there; near edges, points keep off these by their rounding errors, which a
            // copy has more of.
            assert!((p.p - q.p).dot(q.ng).abs() < 1e-5, "{:?} {:?}", p.p, q.p);
            let least = a.u.min(a.v).min(1.0 - a.u - a.v);
            let apart = if least < 1e-3 { 1e-3 } else { 1e-4 };
            assert!(p.p.distance(q.p) < apart, "{:?} {:?}", p.p, q.p);
            assert_eq!((p.shape, p.prim), (a.shape, a.prim));
        }
        accel.use_portable_kernel();
    }
    assert!(on_instances > hits / 2 && hits > rays.len() / 2);
    assert!(differ * 2000 < hits, "{differ} of {hits} hits differ");
}

/// Where copies coincide, the lowest instance is hit.
#[test]
fn ties_go_to_the_first() {
    let same = [Affine::IDENTITY; 40];
    let accel = instanced(vec![Shape::Mesh(icosphere(1))], &same);
    let mut random = Uniform(5);
    for _ in 0..1000 {
        let o = random.direction() * 3.0;
        let hit = accel
            .closest(&Ray::new(o, random.vector() * 0.3 - o))
            .unwrap();
        assert_eq!(accel.instance_of(hit.shape), Some((0, 0)));
    }
}

/// Closed copies do not leak at their edges and vertices, wherever they stand and however large they are.
#[test]
fn closed_copies_are_tight() {
    let mut random = Uniform(3);
    let mesh = icosphere(3);
    let mut leaks = 0;
    for round in 0..14 {
        let size = 10f32.powi(round % 7 * 2 - 6);
        let place = random.vector() * if round < 7 { 0.0 } else { 1e5 * size };
        let mut t = transform(&mut random, 10.0, place);
        t.columns = t.columns.map(|c| c * f64::from(size));
        let accel = instanced(vec![Shape::Mesh(mesh.clone())], &[t]);
        for i in 0..rays_in_test(30_000) {
            let face = mesh.indices[random.bits() as usize % mesh.indices.len()];
            let [a, b] = [face[i % 3], face[(i + 1) % 3]].map(|k| mesh.positions[k as usize]);
            let target = match i % 4 {
                0 => a,
                1 => (a + b) * 0.5,
                _ => a + (b - a) * random.next(),
            };
            let o = random.direction() * (0.3 * random.next());
            let [o, target] = [o, target].map(|p| t.point(p.as_dvec3()).as_vec3());
            let ray = Ray::new(o, target - o);
            leaks += usize::from(accel.closest(&ray).is_none());
            leaks += usize::from(!accel.occluded(&ray));
        }
    }
    assert_eq!(leaks, 0);
}

/// A ray that leaves a copy does not meet the place it left, and one that crosses a convex copy enters and leaves it in turn: for
/// triangles, quads and spheres, under any transform, near and far, down to grazing.
#[test]
fn copies_are_not_hit_again() {
    let mut random = Uniform(8);
    let ball = icosphere(2);
    let (mut tried, mut rims) = (0, 0);
    for round in 0..rays_in_test(600) {
        let size = 10f32.powf(4.0 * random.signed());
        let place = random.vector() * size * 10f32.powf(5.0 * random.next() - 1.0);
        let stretch = if round % 2 == 0 { 2.0 } else { 100.0 };
        let mut t = transform(&mut random, stretch, place);
        t.columns = t.columns.map(|c| c * f64::from(size));
        let shape = match round % 3 {
            0 => Shape::Mesh(ball.clone()),
            1 => Shape::Quad(Quad {
                corner: random.vector(),
                edge_u: random.direction(),
                edge_v: random.direction(),
            }),
            _ => Shape::Sphere(Sphere {
                center: random.vector(),
                radius: 0.3 + random.next(),
            }),
        };
        let accel = instanced(vec![shape], &[t]);
        let (lo, hi) = accel.instance_bounds().unwrap();
        for _ in 0..50 {
            let target = lo + (hi - lo) * (random.vector() * 0.3 + 0.5);
            let o = target + random.direction() * (hi - lo).length();
            let mut ray = Ray::new(o, target - o);
            let Some(hit) = accel.closest(&ray) else {
                continue;
            };
            tried += 1;
            let at = accel.interaction(&hit, &ray);
            // Through, front to back: a convex body is left exactly once.
            let mut sides = vec![at.ng.dot(ray.d) < 0.0];
            let first = at;
            ray = at.spawn(ray.d);
            while let Some(hit) = accel.closest(&ray) {
                let at = accel.interaction(&hit, &ray);
                sides.push(at.ng.dot(ray.d) < 0.0);
                ray = at.spawn(ray.d);
                assert!(sides.len() < 5, "{round}: {sides:?}");
            }
            if round % 3 == 1 {
                assert_eq!(sides.len(), 1, "{round}: a quad was met again");
            } else if sides != [true, false] {
                // At the rim the body may be thinner than its points are known: only that is forgiven.
                let back = Ray::new(first.p + (first.p - o), o - first.p);
                let behind = accel.closest(&back).map(|h| accel.interaction(&h, &back).p);
                let thick = behind.map_or(0.0, |q| (q - first.p).length());
                let known = first.p_error.length();
                assert!(thick < 20.0 * known, "{round}: {sides:?}, {thick} {known}");
                rims += 1;
            }
            // Away from the outside, at all angles.
            for k in 0..4 {
                let steep = if k < 2 {
                    random.next()
                } else {
                    10f32.powf(-6.0 * random.next())
                };
                let tangent = first.ng.any_orthonormal_vector();
                let along = tangent * random.signed() + first.ng.cross(tangent) * random.signed();
                let w = (along + first.ng * steep).normalize();
                if w.dot(first.ng) <= 0.0 {
                    continue;
                }
                let again = accel.closest(&first.spawn(w));
                assert!(again.is_none(), "{round}: {again:?}, {first:?}, {w:?}");
            }
        }
    }
    println!("{tried} rays, {rims} at rims");
    assert!(tried > rays_in_test(600) * 10, "{tried}");
    assert!(rims * 100 < tried, "{rims} of {tried}");
}

/// Segments end just before the surface they lead to, from any distance.
#[test]
fn segments_reach_surfaces() {
    let mut random = Uniform(13);
    let mut tested = 0;
    for round in 0..rays_in_test(2000) {
        let size = 10f32.powf(3.0 * random.signed());
        let place = random.vector() * size * 10f32.powf(4.0 * random.next() - 1.0);
        let mut t = transform(&mut random, 5.0, place);
        t.columns = t.columns.map(|c| c * f64::from(size));
        let quad = Quad {
            corner: random.vector(),
            edge_u: random.direction(),
            edge_v: random.direction(),
        };
        let accel = if round % 2 == 0 {
            instanced(vec![Shape::Quad(quad)], &[t])
        } else {
            let [u, v] = [quad.edge_u, quad.edge_v].map(|e| t.vector(e.as_dvec3()).as_vec3());
            let corner = t.point(quad.corner.as_dvec3()).as_vec3();
            let quad = Quad {
                corner,
                edge_u: u,
                edge_v: v,
            };
            Accel::build(Geometry {
                shapes: vec![Shape::Quad(quad)],
            })
            .unwrap()
            .unwrap()
        };
        let middle = quad.corner + (quad.edge_u + quad.edge_v) * 0.5;
        let middle = t.point(middle.as_dvec3()).as_vec3();
        let from = middle + random.direction() * size;
        let ray = Ray::new(from, middle - from);
        let Some(hit) = accel.closest(&ray) else {
            continue;
        };
        let at = accel.interaction(&hit, &ray);
        for _ in 0..20 {
            let far = size * 10f32.powf(6.0 * random.next());
            let o = at.p + random.direction() * far;
            if (o - at.p).normalize().dot(at.ng).abs() < 1e-5 {
                continue;
            }
            tested += 1;
            let ray = accel.segment(o, at.p, at.p_error, at.ng, at.shape);
            assert!(!accel.occluded(&ray), "{round}: from {far} away, {at:?}");
            assert!(accel.closest(&ray).is_none());
        }
    }
    assert!(tested > rays_in_test(2000) * 5);
}

/// A copy 10¹⁰ times its own size away is hit where it should be, which an origin rounded to f32 in its space could not do: rays
/// start at the copy's box.
#[test]
fn far_away() {
    let t = Affine {
        columns: [DVec3::X * 1e-4, DVec3::Y * 1e-4, DVec3::Z * 1e-4],
        translation: DVec3::ZERO,
    };
    let accel = instanced(vec![Shape::Mesh(icosphere(4))], &[t]);
    // Multiples of whole numbers by powers of two: these rays go through the centre exactly.
    for (x, y, z) in (0..1000).map(|i| (i % 10 - 5, i / 10 % 10 - 5, i / 100 - 5)) {
        if (x, y, z) == (0, 0, 0) {
            continue;
        }
        let d = vec3(x as f32, y as f32, z as f32);
        let ray = Ray::new(d * 1_048_576.0, -d);
        let hit = accel
            .closest(&ray)
            .expect("the ray goes through the centre");
        let p = accel.interaction(&hit, &ray).p;
        assert!((p.length() - 1e-4).abs() < 1e-6, "{p:?} {d:?}");
        assert!(p.normalize().distance(d.normalize()) < 0.01, "{p:?} {d:?}");
    }
}

#[test]
fn wrong_instances_are_errors() {
    let prototypes = || {
        vec![Geometry {
            shapes: vec![Shape::Mesh(icosphere(0))],
        }]
    };
    let build = |prototype, to_world| {
        let instances = [Instance {
            prototype,
            to_world,
        }];
        Accel::build_instanced(Geometry::default(), prototypes(), &instances).err()
    };
    let scale = |x: f64, y: f64| Affine {
        columns: [DVec3::X * x, DVec3::Y * y, DVec3::Z],
        translation: DVec3::ZERO,
    };
    assert_eq!(
        build(3, Affine::IDENTITY),
        Some(GeometryError::NoPrototype {
            instance: 0,
            prototype: 3
        })
    );
    for bad in [
        scale(0.0, 1.0),
        scale(f64::NAN, 1.0),
        scale(1e19, 1.0),
        scale(1.0, 1e-19),
        Affine::from_translation(DVec3::X * 1e18),
        Affine::from_translation(DVec3::X * 1e300),
    ] {
        assert_eq!(
            build(0, bad),
            Some(GeometryError::Instance { instance: 0 }),
            "{bad:?}"
        );
    }
    assert_eq!(build(0, scale(1e-15, 1e15)), None);
    let empty = Accel::build_instanced(Geometry::default(), prototypes(), &[]);
    assert!(empty.unwrap().is_none());
}

/// Many copies (a million with RESOLVENT_FULL set): seconds to build, under 200 bytes each, hits in the right copy.
#[test]
fn a_million() {
    let n = if std::env::var_os("RESOLVENT_FULL").is_some() {
        100
    } else {
        40
    };
    let mut instances = Vec::with_capacity(n * n * n);
    let mut random = Uniform(4);
    for i in 0..n * n * n {
        let at = vec3((i % n) as f32, (i / n % n) as f32, (i / n / n) as f32);
        let mut to_world = transform(&mut random, 1.5, at);
        to_world.columns = to_world.columns.map(|c| c * 0.2);
        instances.push(Instance {
            prototype: 0,
            to_world,
        });
    }
    let prototypes = vec![Geometry {
        shapes: vec![Shape::Mesh(icosphere(2))],
    }];
    let accel = Accel::build_instanced(Geometry::default(), prototypes, &instances)
        .unwrap()
        .unwrap();
    let s = accel.stats();
    println!("{s:?}");
    assert_eq!(s.instances, n * n * n);
    let each = s.bytes as f64 / s.instances as f64;
    assert!(each < 200.0, "{each} bytes for each instance");
    if !cfg!(debug_assertions) {
        assert!(s.build_seconds < 20.0, "{} s", s.build_seconds);
    }
    let mut hits = 0;
    for _ in 0..20_000 {
        let o = random.vector() * 10.0 + n as f32 * 0.5;
        let ray = Ray::new(o, random.direction());
        if let Some(hit) = accel.closest(&ray) {
            let (instance, _) = accel.instance_of(hit.shape).unwrap();
            let i = instance as usize;
            let at = vec3((i % n) as f32, (i / n % n) as f32, (i / n / n) as f32);
            assert!(accel.interaction(&hit, &ray).p.distance(at) < 0.2 * 1.5 * 1.8);
            hits += 1;
        }
    }
    assert!(hits > 10_000, "{hits}");
}

/// Round shapes are met where they are by themselves: near and far side, from outside and from inside.
#[test]
fn round_shapes() {
    let shapes = [
        Shape::Cylinder(Cylinder {
            base: vec3(0.1, 0.0, -0.7),
            axis: vec3(0.0, 0.2, 1.5),
            radius: 0.6,
        }),
        Shape::Disk(Disk {
            center: vec3(0.0, 0.1, 0.2),
            normal: vec3(0.6, 0.0, 0.8),
            radius: 0.9,
        }),
        Shape::Sphere(Sphere {
            center: vec3(0.3, 0.0, 0.0),
            radius: 0.8,
        }),
    ];
    let mut random = Uniform(6);
    for shape in shapes {
        let loose = Accel::build(Geometry {
            shapes: vec![shape.clone()],
        })
        .unwrap()
        .unwrap();
        let copy = instanced(vec![shape], &[Affine::IDENTITY]);
        let mut hits = 0;
        for _ in 0..10_000 {
            let o = random.vector() * 1.5;
            let ray = Ray::new(o, random.vector() * 0.7 - o);
            let (Some(a), Some(b)) = (copy.closest(&ray), loose.closest(&ray)) else {
                continue;
            };
            hits += 1;
            let (p, q) = (copy.interaction(&a, &ray), loose.interaction(&b, &ray));
            assert!(p.p.distance(q.p) < 1e-5, "{:?} {:?}", p.p, q.p);
            assert!(p.ng.distance(q.ng) < 1e-4, "{:?} {:?}", p.ng, q.ng);
        }
        assert!(hits > 1000, "{hits}");
    }
}

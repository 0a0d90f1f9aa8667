//! Bad, degenerate and extreme input.

mod geometry_common;

use geometry_common::{Uniform, icosphere, rays_in_test};
use glam::{Vec2, Vec3, vec3};
use resolvent_engine::geometry::{
    Accel, Geometry, GeometryError, Quad, Ray, Shape, Sphere, TriangleMesh,
};

fn build(shapes: Vec<Shape>) -> Result<Option<Accel>, GeometryError> {
    Accel::build(Geometry { shapes })
}

#[test]
fn errors_name_shape_and_index() {
    let ok = Shape::Sphere(Sphere {
        center: Vec3::ZERO,
        radius: 1.0,
    });
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.1e18, -1e30] {
        let mut mesh = icosphere(1);
        mesh.positions[5].y = bad;
        let error = build(vec![ok.clone(), Shape::Mesh(mesh)]).unwrap_err();
        assert!(
            matches!(
                error,
                GeometryError::Vertex {
                    shape: 1,
                    vertex: 5,
                    ..
                }
            ),
            "{error}"
        );
        assert!(
            error.to_string().starts_with("shape 1: vertex 5 is "),
            "{error}"
        );
        let quad = Quad {
            corner: Vec3::ZERO,
            edge_u: Vec3::X,
            edge_v: vec3(0.0, bad, 0.0),
        };
        let error = build(vec![Shape::Quad(quad)]).unwrap_err();
        assert!(
            matches!(
                error,
                GeometryError::Quad {
                    shape: 0,
                    corner: 2,
                    ..
                }
            ),
            "{error}"
        );
        for (center, radius) in [(vec3(0.0, bad, 0.0), 1.0), (Vec3::ZERO, bad)] {
            let error = build(vec![Shape::Sphere(Sphere { center, radius })]).unwrap_err();
            assert!(
                matches!(error, GeometryError::Sphere { shape: 0, .. }),
                "{error}"
            );
        }
    }
    for radius in [0.0, -1.0] {
        assert!(
            build(vec![Shape::Sphere(Sphere {
                center: Vec3::ZERO,
                radius
            })])
            .is_err()
        );
    }
    let mut mesh = icosphere(0);
    mesh.indices[7] = [0, 12, 1];
    let error = build(vec![Shape::Mesh(mesh)]).unwrap_err();
    assert_eq!(
        error,
        GeometryError::Index {
            shape: 0,
            triangle: 7,
            index: 12,
            vertices: 12
        }
    );
    let mut mesh = icosphere(0);
    mesh.normals = vec![Vec3::X; 11];
    let error = build(vec![Shape::Mesh(mesh)]).unwrap_err();
    assert_eq!(error.to_string(), "shape 0: 11 normals for 12 vertices");
    let mut mesh = icosphere(0);
    mesh.uvs = vec![Vec2::ONE; 12];
    mesh.uvs[3].x = f32::NAN;
    let error = build(vec![Shape::Mesh(mesh)]).unwrap_err();
    assert_eq!(
        error,
        GeometryError::Attribute {
            shape: 0,
            attribute: "uvs",
            vertex: 3
        }
    );
}

#[test]
fn nothing_to_hit_builds_nothing() {
    assert!(build(vec![]).unwrap().is_none());
    assert!(
        build(vec![Shape::Mesh(TriangleMesh::default())])
            .unwrap()
            .is_none()
    );
    let flat = TriangleMesh {
        positions: vec![Vec3::X, Vec3::Y],
        indices: vec![[0, 0, 1], [1, 1, 1]],
        ..TriangleMesh::default()
    };
    assert!(build(vec![Shape::Mesh(flat)]).unwrap().is_none());
}

#[test]
fn degenerate_triangles_are_counted_and_harmless() {
    let mut mesh = icosphere(2);
    let whole = build(vec![Shape::Mesh(mesh.clone())]).unwrap().unwrap();
    let n = mesh.indices.len() as u32;
    for i in 0..100 {
        mesh.indices
            .insert(3 * i, [i as u32, i as u32 + 1, i as u32]);
    }
    let accel = build(vec![Shape::Mesh(mesh.clone())]).unwrap().unwrap();
    let stats = accel.stats();
    assert_eq!(
        (
            stats.bvhs,
            stats.degenerate_triangles,
            stats.triangles,
            stats.quadrics
        ),
        (1, 100, n as usize, 0)
    );
    assert!(stats.nodes > 1 && stats.bytes > stats.nodes * 200 && stats.build_seconds > 0.0);
    let mut random = Uniform(31);
    for _ in 0..1000 {
        let ray = Ray::new(random.vector() * 2.0, random.vector());
        let (a, b) = (whole.closest(&ray), accel.closest(&ray));
        assert_eq!(a.map(|h| h.t), b.map(|h| h.t));
        if let (Some(a), Some(b)) = (a, b) {
            let vertices = |m: &Accel, prim: u32| match &m.geometry().shapes[0] {
                Shape::Mesh(m) => m.indices[prim as usize],
                _ => unreachable!(),
            };
            assert_eq!(
                vertices(&whole, a.prim),
                vertices(&accel, b.prim),
                "primitive numbers count the degenerate ones"
            );
        }
    }
}

/// Single primitives, flat scenes, many equal primitives, and sizes in geometric progression (which make deep trees).
#[test]
fn unusual_scenes() {
    let down = Ray::new(vec3(0.2, 0.3, 5.0), -Vec3::Z);
    let quad = |z: f32, s: f32| {
        Shape::Quad(Quad {
            corner: vec3(0.0, 0.0, z),
            edge_u: Vec3::X * s,
            edge_v: Vec3::Y * s,
        })
    };
    for shapes in [
        vec![quad(0.0, 1.0)],
        vec![quad(0.0, 1.0); 1000],
        (0..1000).map(|i| quad(-(i as f32), 1.0)).collect(),
        vec![
            Shape::Sphere(Sphere {
                center: vec3(0.2, 0.3, -1.0),
                radius: 1.0
            });
            1000
        ],
    ] {
        let accel = build(shapes).unwrap().unwrap();
        let hit = accel.closest(&down).unwrap();
        assert_eq!((hit.t, hit.shape), (5.0, 0));
        assert!(accel.occluded(&down));
        assert!(accel.closest(&Ray { t_max: 5.0, ..down }).is_none());
    }
    let powers = (-100..50).map(|i| quad(2f32.powi(i), 2f32.powi(i)));
    let balls = (-100..50).map(|i| {
        let r = 2f32.powi(i);
        Shape::Sphere(Sphere {
            center: vec3(-2.0 * r, -2.0 * r, 0.0),
            radius: r * 0.1,
        })
    });
    let shapes: Vec<Shape> = powers.chain(balls).collect();
    let accel = build(shapes.clone()).unwrap().unwrap();
    for (i, shape) in shapes.iter().enumerate() {
        let (target, size) = match shape {
            Shape::Quad(q) => (q.corner + (q.edge_u * 0.3 + q.edge_v * 0.6), q.edge_u.x),
            Shape::Sphere(s) => (s.center, s.radius),
            other => unreachable!("{other:?}"),
        };
        // Straight down: quads above are larger and hide the smaller ones, so start just above.
        let ray = Ray::new(target + Vec3::Z * size * 0.5, -Vec3::Z);
        let inside = matches!(shape, Shape::Sphere(_));
        let hit = accel.closest(&ray).unwrap_or_else(|| panic!("shape {i}"));
        assert_eq!(hit.shape as usize, i);
        let expected = if inside { 1.5 } else { 0.5 };
        assert!(
            (hit.t / size - expected).abs() < 1e-5,
            "shape {i}: {} {size}",
            hit.t
        );
    }
}

/// Thin triangles that all cross: boxes overlap as badly as can be.
#[test]
fn star_of_needles() {
    let mut random = Uniform(32);
    let mut mesh = TriangleMesh::default();
    for i in 0..rays_in_test(100_000) as u32 {
        let d = random.direction();
        mesh.positions.extend([d, -d, random.direction() * 1e-3]);
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let accel = build(vec![Shape::Mesh(mesh.clone())]).unwrap().unwrap();
    let mut hits = 0;
    for _ in 0..500 {
        let t = mesh.indices[(random.next() * mesh.indices.len() as f32) as usize];
        let target = t.iter().map(|&i| mesh.positions[i as usize]).sum::<Vec3>() / 3.0;
        let ray = Ray::new(random.direction() * 2.0, Vec3::ZERO);
        let ray = Ray {
            d: target - ray.o,
            ..ray
        };
        hits += u32::from(accel.closest(&ray).is_some_and(|h| h.t < 1.00001));
    }
    assert_eq!(hits, 500);
}

/// Queries from several threads give what one thread gives.
#[test]
fn threads_agree() {
    let accel = build(vec![Shape::Mesh(icosphere(4))]).unwrap().unwrap();
    let run = || {
        let mut random = Uniform(33);
        (0..5000)
            .map(|_| accel.closest(&Ray::new(random.vector(), random.vector())))
            .collect::<Vec<_>>()
    };
    let expected = run();
    std::thread::scope(|scope| {
        for thread in [scope.spawn(run), scope.spawn(run), scope.spawn(run)] {
            assert_eq!(thread.join().unwrap(), expected);
        }
    });
}

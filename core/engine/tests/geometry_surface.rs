//! Surface points and the rays that leave them.

mod geometry_common;

use geometry_common::{Uniform, icosphere, rays_in_test};
use glam::{Vec2, Vec3, vec2, vec3};
use resolvent_engine::geometry::{Accel, Geometry, Quad, Ray, Shape, Sphere, TriangleMesh};

fn triangle(v: [Vec3; 3]) -> Shape {
    Shape::Mesh(TriangleMesh {
        positions: v.to_vec(),
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    })
}

fn one(shape: Shape) -> Accel {
    Accel::build(Geometry {
        shapes: vec![shape],
    })
    .unwrap()
    .unwrap()
}

/// A ray that leaves a triangle does not meet it again: any size, shape, place and angle, down to grazing.
#[test]
fn triangles_are_not_hit_again() {
    let mut random = Uniform(21);
    let mut tried = 0;
    for _ in 0..rays_in_test(20_000) {
        let size = 10f32.powf(random.signed() * 4.0);
        let place = random.vector() * 10f32.powf(random.signed() * 5.0);
        let squeeze = vec3(1.0, 10f32.powf(-4.0 * random.next()), 1.0);
        let v = [0, 1, 2].map(|_| place + random.vector() * squeeze * size);
        let exact = v.map(|p| p.as_dvec3());
        let n = (exact[1] - exact[0]).cross(exact[2] - exact[0]);
        // Triangles a few floats wide have no side to speak of.
        let thin = n.length()
            < 16.0 * f64::from(f32::EPSILON) * f64::from(place.length()) * f64::from(size);
        if thin || v[0] == v[1] || v[1] == v[2] || v[0] == v[2] {
            continue;
        }
        let accel = one(triangle(v));
        for _ in 0..20 {
            let (a, b) = (random.next(), random.next());
            let (a, b) = if a + b > 1.0 {
                (1.0 - a, 1.0 - b)
            } else {
                (a, b)
            };
            let target = v[0] + (v[1] - v[0]) * a + (v[2] - v[0]) * b;
            let ray = Ray::new(target + random.direction() * size, Vec3::ZERO);
            let ray = Ray {
                d: target - ray.o,
                ..ray
            };
            let Some(hit) = accel.closest(&ray) else {
                continue;
            };
            let at = accel.interaction(&hit, &ray);
            // Within the stated error of the true plane.
            let off = n.normalize().dot(at.p.as_dvec3() - v[0].as_dvec3()).abs();
            let bound = n.normalize().abs().dot(at.p_error.as_dvec3());
            assert!(off <= bound * 1.0001, "{off} > {bound}: {v:?}");
            for k in 0..4 {
                let steep = if k < 2 {
                    random.signed()
                } else {
                    random.signed() * 10f32.powf(-8.0 * random.next())
                };
                let along = at.dpdu.normalize() * random.signed()
                    + at.ng.cross(at.dpdu).normalize() * random.signed();
                // Grazing directions are f32 as well: whether one points up or down is what ng·w says.
                let w = (along + at.ng * steep).normalize();
                let o = at.offset(w);
                let side = n.normalize().dot(o.as_dvec3() - v[0].as_dvec3());
                let up = w.dot(at.ng) >= 0.0;
                assert!(
                    if up { side > 0.0 } else { side < 0.0 },
                    "{side} {up} {v:?}"
                );
                // The side is certain. A direction that f32 cannot tell from the plane may still lead back through it; those
                // which leave the plane in exact arithmetic never return.
                let leaving = n.normalize().dot(w.as_dvec3());
                if (leaving >= 0.0) == up {
                    let out = Ray::new(o, w);
                    assert!(accel.closest(&out).is_none(), "{out:?} {v:?}");
                    assert!(!accel.occluded(&out), "{out:?} {v:?}");
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > rays_in_test(200_000), "{tried}");
}

/// Visibility between points on two facing surfaces counts neither of them.
#[test]
fn segments_between_surfaces_are_free() {
    let mut random = Uniform(22);
    for scale in [1e-3, 1.0, 1e4] {
        let shift = vec3(30.0, -7.0, 11.0) * scale;
        let quad = |z: f32, flip: f32| {
            Shape::Quad(Quad {
                corner: vec3(-flip, -1.0, z) * scale + shift,
                edge_u: vec3(2.0 * flip, 0.0, 0.3) * scale,
                edge_v: vec3(0.1, 2.0, -0.2) * scale,
            })
        };
        let accel = Accel::build(Geometry {
            shapes: vec![quad(0.0, 1.0), quad(2.0, -1.0)],
        })
        .unwrap()
        .unwrap();
        let middle = vec3(0.0, 0.0, 1.0) * scale + shift;
        for _ in 0..rays_in_test(100_000) {
            let spread = vec3(random.signed(), random.signed(), 0.0) * 0.8;
            let down = Ray::new(middle, spread - Vec3::Z);
            let spread = vec3(random.signed(), random.signed(), 0.0) * 0.8;
            let up = Ray::new(middle, spread + Vec3::Z);
            let (Some(a), Some(b)) = (accel.closest(&down), accel.closest(&up)) else {
                continue;
            };
            let (a, b) = (accel.interaction(&a, &down), accel.interaction(&b, &up));
            assert_ne!(a.shape, b.shape);
            let d = b.p - a.p;
            let between = Ray::segment(a.offset(d), b.offset(-d));
            assert!(!accel.occluded(&between), "{between:?}");
            // And through them it is blocked.
            let through = Ray::segment(a.offset(-d), b.offset(-d));
            assert!(accel.occluded(&through));
        }
    }
}

/// A ray leaving a sphere outwards never meets it; one leaving inwards meets it once, at the far side.
#[test]
fn spheres_are_left_cleanly() {
    let mut random = Uniform(23);
    for i in 0..rays_in_test(200_000) {
        let radius = 10f32.powf(random.signed() * 4.0);
        // Up to a thousand radii from the origin.
        let center = random.vector() * radius * 10f32.powf(3.0 * random.next());
        let ball = one(Shape::Sphere(Sphere { center, radius }));
        let target = center + random.direction() * radius * 0.999;
        let from = center + random.direction() * radius * if i % 2 == 0 { 3.0 } else { 0.5 };
        let ray = Ray::new(from, target - from);
        let Some(hit) = ball.closest(&ray) else {
            panic!("{ray:?} misses {center} {radius}")
        };
        let at = ball.interaction(&hit, &ray);
        let w = random.direction();
        let w = if i % 3 == 0 {
            (w - at.ng * w.dot(at.ng) * (1.0 - 1e-4)).normalize()
        } else {
            w
        };
        let out = at.spawn(w);
        if w.dot(at.ng) >= 0.0 {
            assert!(
                ball.closest(&out).is_none() && !ball.occluded(&out),
                "{out:?}"
            );
        } else {
            let hit = ball.closest(&out).expect("the far side");
            // Chord: −2r cos. Both ends are rounded.
            let chord = -2.0 * radius * w.dot(at.ng);
            let slack = 1e-5 * (radius + center.length()) / -w.dot(at.ng);
            assert!((hit.t - chord).abs() < slack, "{} {chord} {out:?}", hit.t);
        }
    }
}

/// A small sphere far away is hit where it should be, and missed just beside.
#[test]
fn small_sphere_far_away() {
    for (radius, distance) in [(1e-3, 1e3), (1.0, 1e6), (1e-2, 1e5), (1.0, 1e8)] {
        let ball = one(Shape::Sphere(Sphere {
            center: Vec3::ZERO,
            radius,
        }));
        for k in 0..=20 {
            let x = radius * k as f32 / 10.0;
            // Parallel to an axis, so that the f32 ray passes at x exactly.
            let ray = Ray::new(vec3(x, 0.0, distance), -Vec3::Z);
            let hit = ball.closest(&ray);
            assert_eq!(hit.is_some(), k <= 10, "{radius} {distance} {k}");
            if let Some(hit) = hit {
                let at = ball.interaction(&hit, &ray);
                // p is projected onto the sphere. That f32 t rounds matters as far as the normal is concerned.
                let r = at.p.as_dvec3().length();
                assert!((r - f64::from(radius)).abs() < 1e-6 * f64::from(radius));
                if k == 0 {
                    assert!((at.ng - Vec3::Z).length() < 1e-6);
                }
            }
        }
    }
}

#[test]
fn sphere_coordinates() {
    let ball = one(Shape::Sphere(Sphere {
        center: vec3(1.0, 2.0, 3.0),
        radius: 2.0,
    }));
    for (w, uv) in [
        (Vec3::X, vec2(0.0, 0.5)),
        (Vec3::Y, vec2(0.25, 0.5)),
        (-Vec3::X, vec2(0.5, 0.5)),
        (-Vec3::Y, vec2(0.75, 0.5)),
    ] {
        let ray = Ray::new(vec3(1.0, 2.0, 3.0) + w * 5.0, -w);
        let at = ball.interaction(&ball.closest(&ray).unwrap(), &ray);
        assert!(
            (at.uv - uv).length() < 1e-6 && (at.ng - w).length() < 1e-6,
            "{at:?}"
        );
        assert!(
            (at.dpdu - Vec3::Z.cross(w) * 2.0 * std::f32::consts::TAU).length() < 1e-4,
            "{at:?}"
        );
    }
    let ray = Ray::new(vec3(1.0, 2.0, 9.0), -Vec3::Z);
    let at = ball.interaction(&ball.closest(&ray).unwrap(), &ray);
    assert!(at.uv.y == 0.0 && at.dpdu.length() > 0.0 && at.dpdu.dot(at.ng).abs() < 1e-6);
}

/// Coordinates, tangents and normals of meshes and quads.
#[test]
fn frames() {
    let mesh = TriangleMesh {
        positions: vec![
            vec3(0.0, 0.0, 1.0),
            vec3(4.0, 0.0, 1.0),
            vec3(0.0, 2.0, 1.0),
        ],
        normals: vec![
            vec3(0.0, 0.0, 2.0),
            vec3(1.0, 0.0, 1.0),
            vec3(0.0, 1.0, 1.0),
        ],
        uvs: vec![vec2(0.0, 0.0), vec2(0.0, 2.0), vec2(1.0, 0.0)],
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    let ray = Ray::new(vec3(1.0, 0.5, 5.0), -Vec3::Z);
    let accel = one(Shape::Mesh(mesh.clone()));
    let at = accel.interaction(&accel.closest(&ray).unwrap(), &ray);
    // Barycentric weights 1/2, 1/4, 1/4.
    let h = 0.5f32.sqrt();
    assert!((at.p - vec3(1.0, 0.5, 1.0)).length() < 1e-6 && at.ng == Vec3::Z);
    assert!(
        (at.ns - vec3(h / 4.0, h / 4.0, 0.5 + h / 2.0).normalize()).length() < 1e-6,
        "{at:?}"
    );
    assert!(
        (at.uv - vec2(0.25, 0.5)).length() < 1e-6 && (at.dpdu - Vec3::Y * 2.0).length() < 1e-6,
        "{at:?}"
    );
    // Seen from behind nothing changes.
    let ray = Ray::new(vec3(1.0, 0.5, -5.0), Vec3::Z);
    let back = accel.interaction(&accel.closest(&ray).unwrap(), &ray);
    assert!((back.ng, back.shape) == (at.ng, 0) && (back.ns - at.ns).length() < 1e-6);
    // The other winding turns both normals.
    let turned = one(Shape::Mesh(TriangleMesh {
        indices: vec![[0, 2, 1]],
        ..mesh.clone()
    }));
    let other = turned.interaction(&turned.closest(&ray).unwrap(), &ray);
    assert!(other.ng == -Vec3::Z && (other.ns + at.ns).length() < 1e-6);
    // Without coordinates: barycentrics; with useless ones: some tangent.
    let plain = one(Shape::Mesh(TriangleMesh {
        uvs: vec![],
        ..mesh.clone()
    }));
    let at = plain.interaction(&plain.closest(&ray).unwrap(), &ray);
    assert!((at.uv - vec2(0.25, 0.25)).length() < 1e-6 && at.dpdu == Vec3::X * 4.0);
    let useless = one(Shape::Mesh(TriangleMesh {
        uvs: vec![Vec2::ONE; 3],
        normals: vec![Vec3::ZERO; 3],
        ..mesh.clone()
    }));
    let at = useless.interaction(&useless.closest(&ray).unwrap(), &ray);
    assert!(at.dpdu.length() > 0.5 && at.dpdu.dot(at.ng).abs() < 1e-6 && at.ns == at.ng);

    // Colours are interpolated, and so are tangents, which count before coordinates; shapes without colours are white.
    let plain = TriangleMesh {
        uvs: vec![],
        ..mesh.clone()
    };
    assert_eq!(at.color, [1.0; 4]);
    assert!(accel.uv_mirrored(0, 0));
    let painted = one(Shape::Mesh(TriangleMesh {
        colors: vec![
            [1.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 4.0, 1.0],
        ],
        tangents: vec![
            [0.0, 1.0, 0.0, -1.0],
            [0.0, 3.0, 0.0, -1.0],
            [4.0, 0.0, 0.0, -1.0],
        ],
        ..plain
    }));
    let at = painted.interaction(&painted.closest(&ray).unwrap(), &ray);
    assert_eq!(at.color, [0.5, 0.25, 1.0, 0.75]);
    assert!((at.dpdu - vec3(1.0, 1.25, 0.0)).length() < 1e-6, "{at:?}");
    assert!(painted.uv_mirrored(0, 0));

    let quad = Quad {
        corner: vec3(1.0, 1.0, 0.0),
        edge_u: vec3(3.0, 0.0, 0.0),
        edge_v: vec3(1.0, 2.0, 0.0),
    };
    let accel = one(Shape::Quad(quad));
    for (s, t) in [
        (0.1, 0.7),
        (0.7, 0.1),
        (0.5, 0.5),
        (0.01, 0.99),
        (0.99, 0.01),
    ] {
        let p = quad.corner + quad.edge_u * s + quad.edge_v * t;
        let ray = Ray::new(p + Vec3::Z, -Vec3::Z);
        let at = accel.interaction(&accel.closest(&ray).unwrap(), &ray);
        assert!(
            (at.uv - vec2(s, t)).length() < 1e-6 && at.ng == Vec3::Z && at.dpdu == quad.edge_u,
            "{at:?}"
        );
    }
}

/// A particle bouncing inside a closed mesh for many steps stays inside.
#[test]
fn walks_stay_inside() {
    let mut random = Uniform(24);
    for shift in [Vec3::ZERO, Vec3::splat(100.0)] {
        let mut mesh = icosphere(3);
        mesh.positions.iter_mut().for_each(|p| *p += shift);
        let accel = one(Shape::Mesh(mesh));
        let mut ray = Ray::new(shift, Vec3::X);
        let (mut steps, mut escapes) = (0, 0);
        for _ in 0..rays_in_test(500_000) {
            let Some(hit) = accel.closest(&ray) else {
                escapes += 1;
                ray = Ray::new(shift, random.direction());
                continue;
            };
            let at = accel.interaction(&hit, &ray);
            assert!((at.p.as_dvec3() - shift.as_dvec3()).length() < 1.001);
            let w = (random.direction() - at.ng).normalize_or(-at.ng);
            ray = at.spawn(w);
            steps += 1;
        }
        assert_eq!(escapes, 0, "of {steps}");
    }
}

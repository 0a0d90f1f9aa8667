//! Irradiance from emitting shapes and spots: by connections, by scattered rays, and by quadrature.

use crate::build::octahedron;
use glam::{DVec3, Vec3};
use resolvent_api::Spectrum;
use resolvent_api::math::{Frame, warp};
use resolvent_api::rng::Stream;
use resolvent_engine::geometry::{
    Accel, Cylinder, Disk, Geometry, Quad, Ray, Shape, Sphere, TriangleMesh, offset_origin,
};
use resolvent_engine::light::{Area, Light, Spot, shows};
use resolvent_tests::Moments;
use resolvent_tests::ztest::{sidak, z_test};
use std::f64::consts::PI;

/// Points of a shape with their normals and areas, for quadrature.
fn elements(shape: &Shape, n: usize) -> Vec<(DVec3, DVec3, f64)> {
    let grid = |f: &dyn Fn(f64, f64) -> (DVec3, DVec3, f64)| {
        let step = 1.0 / n as f64;
        (0..n * n)
            .map(|i| {
                let (u, v) = ((i % n) as f64 + 0.5, (i / n) as f64 + 0.5);
                let (p, normal, area) = f(u * step, v * step);
                (p, normal, area * step * step)
            })
            .collect::<Vec<_>>()
    };
    match shape {
        Shape::Quad(q) => {
            let (c, a, b) = (
                q.corner.as_dvec3(),
                q.edge_u.as_dvec3(),
                q.edge_v.as_dvec3(),
            );
            let n = a.cross(b);
            grid(&|u, v| (c + a * u + b * v, n.normalize(), n.length()))
        }
        Shape::Disk(d) => {
            let (c, normal) = (d.center.as_dvec3(), d.normal.as_dvec3().normalize());
            let x = normal.any_orthonormal_vector();
            let y = normal.cross(x);
            let r = f64::from(d.radius);
            // Equal areas: radius √u.
            grid(&|u, v| {
                let (s, c2) = (2.0 * PI * v).sin_cos();
                (c + (x * c2 + y * s) * (r * u.sqrt()), normal, PI * r * r)
            })
        }
        Shape::Cylinder(t) => {
            let (c, axis) = (t.base.as_dvec3(), t.axis.as_dvec3());
            let u_axis = axis.normalize();
            let x = u_axis.any_orthonormal_vector();
            let y = u_axis.cross(x);
            let r = f64::from(t.radius);
            grid(&|u, v| {
                let (s, c2) = (2.0 * PI * v).sin_cos();
                let normal = x * c2 + y * s;
                (
                    c + axis * u + normal * r,
                    normal,
                    2.0 * PI * r * axis.length(),
                )
            })
        }
        Shape::Sphere(s) => {
            let (c, r) = (s.center.as_dvec3(), f64::from(s.radius));
            grid(&|u, v| {
                let z = 1.0 - 2.0 * u;
                let (sin, cos) = (2.0 * PI * v).sin_cos();
                let normal = DVec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z;
                (c + normal * r, normal, 4.0 * PI * r * r)
            })
        }
        Shape::Mesh(m) => m
            .indices
            .iter()
            .flat_map(|t| {
                let [a, b, c] = t.map(|i| m.positions[i as usize].as_dvec3());
                let n = (b - a).cross(c - a);
                // Midpoints of the small triangles of a subdivision, both ways up.
                let k = n_of(n.length());
                let step = 1.0 / k as f64;
                let area = 0.5 * n.length() * step * step;
                let mut out = Vec::new();
                for i in 0..k {
                    for j in 0..k - i {
                        let at = |s: f64, t: f64| a + (b - a) * (s * step) + (c - a) * (t * step);
                        let (i, j) = (i as f64, j as f64);
                        let third = 1.0 / 3.0;
                        out.push((at(i + third, j + third), n.normalize(), area));
                        if i + j + 1.5 < k as f64 {
                            out.push((at(i + 2.0 * third, j + 2.0 * third), n.normalize(), area));
                        }
                    }
                }
                out
            })
            .collect(),
    }
}

fn n_of(_: f64) -> usize {
    150
}

/// ∫ L cos cos/d² dA over what is seen of a convex shape from outside, or of any shape without self-shading.
fn exact(shape: &Shape, two_sided: bool, p: DVec3, n: DVec3) -> f64 {
    elements(shape, 1200)
        .into_iter()
        .map(|(q, normal, area)| {
            let d = q - p;
            let d2 = d.length_squared();
            let at_light = -normal.dot(d);
            let at_light = if two_sided {
                at_light.abs()
            } else {
                at_light.max(0.0)
            };
            at_light * n.dot(d).max(0.0) / (d2 * d2) * area
        })
        .sum()
}

struct Case {
    name: &'static str,
    shape: Shape,
    two_sided: bool,
    /// Receiver's normal; it is at the origin.
    normal: Vec3,
}

fn cases() -> Vec<Case> {
    let tilted = Vec3::new(0.4, -0.2, 1.0).normalize();
    let disk = |center, normal, radius| {
        Shape::Disk(Disk {
            center,
            normal,
            radius,
        })
    };
    let tube = |base, axis, radius| Shape::Cylinder(Cylinder { base, axis, radius });
    let v = Vec3::new;
    let case = |name, shape, two_sided, normal| Case {
        name,
        shape,
        two_sided,
        normal,
    };
    vec![
        case(
            "disk",
            disk(v(0.3, 0.1, 2.0), v(0.0, 0.6, -0.8), 0.7),
            false,
            Vec3::Z,
        ),
        case(
            "disk, its back",
            disk(v(0.3, 0.1, 2.0), v(0.0, 0.6, 0.8), 0.7),
            true,
            tilted,
        ),
        case(
            "disk below the horizon",
            disk(v(1.0, 0.0, 0.1), -Vec3::X, 0.6),
            false,
            Vec3::Z,
        ),
        case(
            "small disk far away",
            disk(v(30.0, 20.0, 50.0), v(-0.6, 0.0, -0.8), 0.05),
            false,
            tilted,
        ),
        case(
            "upright cylinder",
            tube(v(1.5, 0.0, 0.2), Vec3::Z * 2.0, 0.4),
            false,
            Vec3::Z,
        ),
        case(
            "lying cylinder",
            tube(v(-1.0, 0.5, 1.0), Vec3::X * 2.0, 0.1),
            false,
            tilted,
        ),
        case(
            "thin cylinder",
            tube(v(-1.0, 0.5, 1.0), v(2.0, 0.3, 0.2), 1e-3),
            false,
            Vec3::Z,
        ),
        case(
            "sphere",
            Shape::Sphere(Sphere {
                center: v(0.5, -0.4, 1.5),
                radius: 0.6,
            }),
            false,
            tilted,
        ),
        case(
            "octahedron",
            Shape::Mesh(octahedron(v(0.4, 0.3, 1.6), 0.8)),
            false,
            Vec3::Z,
        ),
        case(
            "two-sided triangle",
            Shape::Mesh(TriangleMesh {
                positions: vec![v(-1.0, 0.0, 1.0), v(1.0, 0.2, 1.5), v(0.0, 1.0, 2.0)],
                indices: vec![[0, 1, 2]],
                ..TriangleMesh::default()
            }),
            true,
            Vec3::Z,
        ),
        case(
            "two-sided quad",
            Shape::Quad(Quad {
                corner: v(-0.5, -0.5, 1.0),
                edge_u: Vec3::X,
                edge_v: v(0.0, 1.0, 0.5),
            }),
            true,
            tilted,
        ),
    ]
}

fn area(case: &Case) -> Area {
    let (l, sides) = (Spectrum::ONE, case.two_sided);
    match &case.shape {
        Shape::Quad(q) => Area::quad(0, *q, l, sides),
        Shape::Sphere(s) => Area::sphere(0, *s, l, sides),
        Shape::Disk(d) => Area::disk(0, *d, l, sides),
        Shape::Cylinder(c) => Area::cylinder(0, *c, l, sides),
        Shape::Mesh(m) => Area::mesh(0, m.clone(), l, sides),
    }
}

/// Connections, scattered rays and their multiple importance sampling all give the irradiance of quadrature; points chosen on
/// a light are seen from where they were chosen for.
#[test]
fn irradiance() {
    let mut z = Vec::new();
    let mut s = Stream::new(21);
    for case in cases() {
        let light = area(&case);
        let accel = Accel::build(Geometry {
            shapes: vec![case.shape.clone()],
        })
        .unwrap()
        .unwrap();
        let expected = exact(
            &case.shape,
            case.two_sided,
            DVec3::ZERO,
            case.normal.as_dvec3(),
        );
        let frame = Frame::around(case.normal);
        let (mut connected, mut scattered, mut both) =
            (Moments::default(), Moments::default(), Moments::default());
        let mut hidden = 0;
        for _ in 0..100_000 {
            let (mut a, mut b, mut mixed) = (0.0, 0.0, 0.0);
            if let Some(p) = light.sample(Vec3::ZERO, s.uniform2()) {
                let cosine = case.normal.dot(Vec3::from(p.wi)).max(0.0);
                let at = Vec3::from(p.p);
                let end = offset_origin(at, p.p_error.into(), p.ng.into(), -at);
                if accel.occluded(&Ray::segment(Vec3::ZERO, end)) {
                    hidden += 1;
                }
                a = f64::from(p.radiance[0] * cosine / p.density);
                mixed += f64::from(p.radiance[0] * cosine)
                    / (f64::from(p.density) + f64::from(cosine) / PI);
                let again = light.density(Vec3::ZERO, at, p.ng.into());
                assert!((again / p.density - 1.0).abs() < 1e-3, "{}", case.name);
            }
            let w = frame.to_world(warp::cosine_hemisphere(s.uniform2()));
            let ray = Ray::new(Vec3::ZERO, w);
            if let Some(hit) = accel.closest(&ray) {
                let at = accel.interaction(&hit, &ray);
                let l = f64::from(shows(&light, &at, -w)[0]);
                b = l * PI;
                let cosine = f64::from(case.normal.dot(w));
                let density = f64::from(light.density(Vec3::ZERO, at.p, at.ng));
                mixed += l * cosine / (density + cosine / PI);
            }
            connected.add(a);
            scattered.add(b);
            both.add(mixed);
        }
        // A two-sided convex shape would hide its own far side; there is none here.
        assert_eq!(hidden, 0, "{}", case.name);
        for (how, m) in [
            ("connected", connected),
            ("scattered", scattered),
            ("both", both),
        ] {
            // The small disk is met once in 10⁷: nothing can be said of scattered rays.
            if case.name == "small disk far away" && how == "scattered" {
                continue;
            }
            let test = z_test(m.mean(), m.standard_error(), expected, 2e-5);
            println!(
                "{} {how}: {:.6} ± {:.1e}, {expected:.6}, z {:.2}",
                case.name,
                m.mean(),
                m.standard_error(),
                test.z
            );
            z.push((case.name, how, test));
        }
    }
    let level = sidak(1e-3, z.len());
    for (name, how, test) in &z {
        assert!(test.p > level, "{name} {how}: {test:?}");
    }
}

/// A spot gives I(θ) cos/d², 0 outside its cone, and its power is the integral of its intensity.
#[test]
fn spot() {
    let axis = Vec3::new(0.2, -0.3, -1.0).normalize();
    let spot = Spot::new(
        Vec3::new(1.0, 2.0, 3.0),
        axis,
        Spectrum::splat(7.0),
        80.0,
        50.0,
    );
    let light = Light::Spot(spot);
    let (co, ci) = (40f64.to_radians().cos(), 25f64.to_radians().cos());
    let mut s = Stream::new(22);
    let mut seen = [0; 3];
    for _ in 0..20_000 {
        let w = warp::sphere(s.uniform2());
        let distance = 0.1 + 5.0 * s.uniform();
        let from = spot.position + w * distance;
        let d = from.as_dvec3() - spot.position.as_dvec3();
        let cos = d.normalize().dot(axis.as_dvec3());
        let t = ((cos - co) / (ci - co)).clamp(0.0, 1.0);
        let expected = 7.0 * t * t * (3.0 - 2.0 * t) / d.length_squared();
        seen[if cos <= co {
            0
        } else {
            1 + usize::from(cos >= ci)
        }] += 1;
        match light.sample(from, s.uniform2()) {
            Some(p) => {
                let found = f64::from(p.radiance[0]);
                assert!(
                    (found - expected).abs() < 1e-4 * expected + 1e-5,
                    "{found} {expected}"
                );
                assert!((f64::from(p.distance) - d.length()).abs() < 1e-5 * d.length());
            }
            None => assert!(expected < 1e-5, "{expected}"),
        }
    }
    assert!(seen.iter().all(|n| *n > 500), "{seen:?}");
    // ∫ I dω by Simpson in the cosine.
    let n = 2000;
    let integral: f64 = (0..=n)
        .map(|i| {
            let cos = co + (1.0 - co) * f64::from(i) / f64::from(n);
            let t = ((cos - co) / (ci - co)).clamp(0.0, 1.0);
            let weight = if i == 0 || i == n {
                1.0
            } else {
                f64::from(2 + 2 * (i % 2))
            };
            weight * 7.0 * t * t * (3.0 - 2.0 * t)
        })
        .sum::<f64>()
        * (1.0 - co)
        / f64::from(3 * n)
        * 2.0
        * PI;
    let power = f64::from(light.power(1.0, 3));
    assert!((power / integral - 1.0).abs() < 1e-5, "{power} {integral}");
}

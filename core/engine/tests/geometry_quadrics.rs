//! Disks and cylinders: rays that leave them, miss them narrowly, or come from far away.

mod geometry_common;

use geometry_common::{Uniform, rays_in_test};
use glam::{DVec3, Vec2, Vec3, vec2, vec3};
use resolvent_engine::geometry::{Accel, Cylinder, Disk, Geometry, GeometryError, Ray, Shape};

fn accel(shapes: Vec<Shape>) -> Accel {
    Accel::build(Geometry { shapes }).unwrap().unwrap()
}

/// A random disk or cylinder of any size, up to a thousand of its sizes away from the origin.
fn random_shape(random: &mut Uniform, disk: bool) -> (Shape, f32) {
    let radius = 10f32.powf(random.signed() * 4.0);
    let place = random.vector() * radius * 10f32.powf(3.0 * random.next());
    let shape = if disk {
        Shape::Disk(Disk {
            center: place,
            normal: random.direction(),
            radius,
        })
    } else {
        Shape::Cylinder(Cylinder {
            base: place,
            axis: random.direction() * radius * 10f32.powf(random.signed()),
            radius,
        })
    };
    (shape, radius)
}

/// A point on the shape, and how far exact arithmetic puts `p` on the side of the normal.
fn point_on(shape: &Shape, random: &mut Uniform) -> Vec3 {
    match shape {
        Shape::Disk(d) => {
            let x = d.normal.any_orthonormal_vector();
            let y = d.normal.cross(x);
            let (sin, cos) = (std::f32::consts::TAU * random.next()).sin_cos();
            d.center + (x * cos + y * sin) * (d.radius * 0.999 * random.next().sqrt())
        }
        Shape::Cylinder(c) => {
            let w = c.axis.normalize().any_orthonormal_vector();
            let w = glam::Quat::from_axis_angle(
                c.axis.normalize(),
                std::f32::consts::TAU * random.next(),
            ) * w;
            c.base + c.axis * (0.001 + 0.998 * random.next()) + w * c.radius
        }
        _ => unreachable!("only quadrics are made here"),
    }
}

fn side(shape: &Shape, p: Vec3) -> f64 {
    match shape {
        Shape::Disk(d) => d.normal.as_dvec3().dot(p.as_dvec3() - d.center.as_dvec3()),
        Shape::Cylinder(c) => {
            let u = c.axis.as_dvec3().normalize();
            let f: DVec3 = p.as_dvec3() - c.base.as_dvec3();
            (f - u * f.dot(u)).length() - f64::from(c.radius)
        }
        _ => unreachable!("only quadrics are made here"),
    }
}

/// A point found on a surface lies on it within its stated error; a ray that leaves it starts on the right side and does not
/// meet it again: any size, place and angle, down to grazing. From inside a cylinder it meets the far wall or leaves by an end.
#[test]
fn are_left_cleanly() {
    let mut random = Uniform(41);
    for disk in [true, false] {
        let (mut tried, mut missed) = (0, 0);
        for i in 0..rays_in_test(100_000) {
            let (shape, radius) = random_shape(&mut random, disk);
            let one = accel(vec![shape.clone()]);
            let target = point_on(&shape, &mut random);
            let from = target + random.direction() * radius * 10f32.powf(2.0 * random.signed());
            let ray = Ray::new(from, target - from);
            // Targets are rounded, and grazing rays pass.
            let Some(hit) = one.closest(&ray) else {
                missed += 1;
                continue;
            };
            let at = one.interaction(&hit, &ray);
            let bound = at.ng.abs().as_dvec3().dot(at.p_error.as_dvec3());
            let off = side(&shape, at.p).abs();
            // The normal of a cylinder is rounded too, by a millionth of the bound's share.
            assert!(off <= bound * 1.001, "{off} > {bound}: {shape:?}");
            let w = random.direction();
            let w = if i % 3 == 0 {
                let steep = 10f32.powf(-6.0 * random.next()) * random.signed();
                (w - at.ng * w.dot(at.ng) + at.ng * steep).normalize()
            } else {
                w
            };
            let up = w.dot(at.ng) >= 0.0;
            let out = at.spawn(w);
            let start = side(&shape, out.o);
            assert!(
                if up { start > 0.0 } else { start < 0.0 },
                "{start} {up} {shape:?}"
            );
            if disk || up {
                // Directions that f32 cannot tell from the tangent plane may lead back in exact arithmetic.
                if w.dot(at.ng).abs() > 1e-6 {
                    assert!(
                        one.closest(&out).is_none() && !one.occluded(&out),
                        "{out:?}"
                    );
                    tried += 1;
                }
            } else if let Some(far) = one.closest(&out) {
                let there = one.interaction(&far, &out);
                assert!(
                    there.ng.dot(w) > 0.0,
                    "the far wall is seen from inside: {shape:?}"
                );
                tried += 1;
            }
        }
        assert!(missed < rays_in_test(2_000), "{missed}");
        assert!(tried > rays_in_test(70_000), "{tried}");
    }
}

/// Visibility between points of two facing disks, or of two nested cylinders, counts neither of them.
#[test]
fn segments_between_surfaces_are_free() {
    let mut random = Uniform(42);
    for scale in [1e-3, 1.0, 1e4] {
        let shift = vec3(30.0, -7.0, 11.0) * scale;
        let n = vec3(0.3, -0.2, 1.0).normalize();
        let disks = [0.0, 2.0].map(|z| {
            Shape::Disk(Disk {
                center: shift + n * z * scale,
                normal: n,
                radius: scale,
            })
        });
        let tubes = [1.0, 2.0].map(|r| {
            Shape::Cylinder(Cylinder {
                base: shift,
                axis: n * 3.0 * scale,
                radius: r * scale,
            })
        });
        for [a, b] in [disks, tubes] {
            let both = accel(vec![a.clone(), b.clone()]);
            let mut tried = 0;
            for _ in 0..rays_in_test(50_000) {
                let ends = [&a, &b].map(|s| {
                    let alone = accel(vec![s.clone()]);
                    let p = point_on(s, &mut random);
                    let back = p + random.direction() * scale;
                    let ray = Ray::new(back, p - back);
                    alone.closest(&ray).map(|h| alone.interaction(&h, &ray))
                });
                let [Some(p), Some(q)] = ends else { continue };
                let d = q.p - p.p;
                // Between cylinders only where the inner one does not stand in the way.
                if p.ng.dot(d) < 1e-3 * d.length() {
                    continue;
                }
                let free = Ray::segment(p.offset(d), q.offset(-d));
                assert!(!both.occluded(&free), "{free:?}");
                assert!(both.occluded(&Ray::segment(p.offset(-d), q.offset(-d))));
                assert!(both.occluded(&Ray::segment(p.offset(d), q.offset(d))));
                tried += 1;
            }
            assert!(tried > rays_in_test(10_000), "{tried}");
        }
    }
}

/// Tiny, huge and far away: hit within the rim, missed beyond it.
#[test]
fn rims() {
    for (radius, distance) in [
        (1e-3, 1e3),
        (1.0, 1e6),
        (1e-2, 1e5),
        (1.0, 1e8),
        (1e-18, 1e-10),
        (1e8, 1e9),
        (1e15, 1e17),
    ] {
        let disk = accel(vec![Shape::Disk(Disk {
            center: Vec3::ZERO,
            normal: -Vec3::Z,
            radius,
        })]);
        let tube = accel(vec![Shape::Cylinder(Cylinder {
            base: -Vec3::Y * radius,
            axis: Vec3::Y * (2.0 * radius),
            radius,
        })]);
        for k in 0..=20 {
            let x = radius * k as f32 / 10.0;
            let inside = x <= radius;
            let ray = Ray::new(vec3(x, 0.0, distance), -Vec3::Z);
            assert_eq!(disk.closest(&ray).is_some(), inside, "{radius} {k}");
            assert_eq!(tube.closest(&ray).is_some(), inside, "{radius} {k}");
            let along = Ray::new(vec3(0.0, x, distance), -Vec3::Z);
            let hit = tube.closest(&along);
            assert_eq!(hit.is_some(), inside, "{radius} {k}");
            if let Some(hit) = hit {
                let at = tube.interaction(&hit, &along);
                assert!((at.ng - Vec3::Z).length() < 1e-6);
                let r = at.p.as_dvec3().with_y(0.0).length();
                assert!((r / f64::from(radius) - 1.0).abs() < 1e-6);
            }
        }
        // Within a disk's plane and along a cylinder's axis there is nothing to hit.
        let edge_on = Ray::new(vec3(-distance, 0.0, 0.0), Vec3::X);
        assert!(disk.closest(&edge_on).is_none() && !disk.occluded(&edge_on));
        for x in [0.0, 0.5 * radius, 2.0 * radius] {
            let through = Ray::new(vec3(x, -distance, 0.0), Vec3::Y);
            assert!(tube.closest(&through).is_none() && !tube.occluded(&through));
        }
    }
}

/// Rays that pass a cylinder just outside or inside its radius, from any side, and tangents of disks' rims.
#[test]
fn tangents() {
    let mut random = Uniform(43);
    for _ in 0..rays_in_test(100_000) {
        let axis = random.direction();
        let radius = 10f32.powf(random.signed() * 3.0);
        let base = random.vector() * radius;
        let tube = Cylinder {
            base,
            axis: axis * 4.0 * radius,
            radius,
        };
        let x = axis.any_orthonormal_vector();
        let d = axis.cross(x).normalize();
        for (factor, hits) in [(1.0 + 1e-5, false), (1.0 - 1e-5, true)] {
            let middle = base + axis * 2.0 * radius + x * radius * factor;
            let ray = Ray::new(middle - d * radius * 3.0, d);
            let one = accel(vec![Shape::Cylinder(tube)]);
            assert_eq!(one.closest(&ray).is_some(), hits, "{tube:?}");
            let disk = Disk {
                center: base,
                normal: axis,
                radius,
            };
            let one = accel(vec![Shape::Disk(disk)]);
            let ray = Ray::new(base + x * radius * factor + axis * radius, -axis);
            assert_eq!(one.closest(&ray).is_some(), hits, "{disk:?}");
        }
    }
}

/// A particle bouncing inside a can, a cylinder between two disks, stays inside: lengths are such that the rims coincide.
#[test]
fn walks_stay_inside_a_can() {
    let mut random = Uniform(44);
    let base = vec3(3.0, -2.0, 5.0);
    let axis = vec3(0.0, 2.0, 0.0);
    let radius = 0.75;
    let lid = |center, normal| {
        Shape::Disk(Disk {
            center,
            normal,
            radius,
        })
    };
    let can = accel(vec![
        Shape::Cylinder(Cylinder { base, axis, radius }),
        lid(base, -Vec3::Y),
        lid(base + axis, Vec3::Y),
    ]);
    let middle = base + 0.5 * axis;
    let mut ray = Ray::new(middle, Vec3::X);
    let (mut escapes, mut by_shape) = (0, [0; 3]);
    for _ in 0..rays_in_test(500_000) {
        let Some(hit) = can.closest(&ray) else {
            escapes += 1;
            ray = Ray::new(middle, random.direction());
            continue;
        };
        let at = can.interaction(&hit, &ray);
        assert!(at.ng.dot(ray.d) > 0.0, "walls are seen from inside");
        by_shape[hit.shape as usize] += 1;
        ray = at.spawn((random.direction() - at.ng).normalize_or(-at.ng));
    }
    assert_eq!(escapes, 0);
    assert!(by_shape.iter().all(|n| *n > rays_in_test(50_000)));
}

#[test]
fn coordinates() {
    let disk = Disk {
        center: vec3(1.0, 2.0, 3.0),
        normal: Vec3::Y,
        radius: 2.0,
    };
    let one = accel(vec![Shape::Disk(disk)]);
    let at = |x: f32, z: f32| {
        let ray = Ray::new(disk.center + vec3(x, 4.0, z), -Vec3::Y);
        one.interaction(&one.closest(&ray).unwrap(), &ray)
    };
    let middle = at(0.0, 0.0);
    assert_eq!(
        (middle.uv, middle.ng, middle.p),
        (Vec2::splat(0.5), Vec3::Y, disk.center)
    );
    // u and v grow along dpdu and ng × dpdu.
    let e = at(0.5, -0.25);
    let local = e.p - disk.center;
    let (x, y) = (e.dpdu.normalize(), e.ng.cross(e.dpdu.normalize()));
    let expected = vec2(x.dot(local), y.dot(local)) / 4.0 + 0.5;
    assert!((e.uv - expected).length() < 1e-6, "{e:?}");
    assert!((e.dpdu.length() - 4.0).abs() < 1e-5);

    let tube = Cylinder {
        base: vec3(1.0, 0.0, 0.0),
        axis: vec3(0.0, 4.0, 0.0),
        radius: 2.0,
    };
    let one = accel(vec![Shape::Cylinder(tube)]);
    let mut turns = Vec::new();
    for k in 0..8 {
        let (sin, cos) = (std::f32::consts::TAU * k as f32 / 8.0).sin_cos();
        let w = vec3(sin, 0.0, cos);
        let ray = Ray::new(vec3(1.0, 1.0, 0.0), w);
        let at = one.interaction(&one.closest(&ray).unwrap(), &ray);
        assert!((at.ng - w).length() < 1e-6 && (at.uv.y - 0.25).abs() < 1e-6);
        assert!((at.dpdu - Vec3::Y.cross(w) * 2.0 * std::f32::consts::TAU).length() < 1e-4);
        turns.push(at.uv.x);
    }
    // Equal steps along dpdu are equal steps of u.
    for pair in turns.windows(2) {
        let step = (pair[1] - pair[0]).rem_euclid(1.0);
        assert!((step - 0.125).abs() < 1e-5, "{turns:?}");
    }
}

#[test]
fn bad_input_is_named() {
    let disk = |normal, radius| {
        Shape::Disk(Disk {
            center: Vec3::ZERO,
            normal,
            radius,
        })
    };
    let tube = |axis, radius| {
        Shape::Cylinder(Cylinder {
            base: Vec3::ZERO,
            axis,
            radius,
        })
    };
    for shape in [
        disk(Vec3::Z, 0.0),
        disk(Vec3::Z, f32::NAN),
        disk(Vec3::Z, 1e19),
        disk(Vec3::ZERO, 1.0),
        disk(Vec3::NAN, 1.0),
        disk(Vec3::Z * 2.0, 1.0),
    ] {
        let error = Accel::build(Geometry {
            shapes: vec![shape],
        })
        .unwrap_err();
        assert!(
            matches!(error, GeometryError::Disk { shape: 0, .. }),
            "{error}"
        );
    }
    for shape in [
        tube(Vec3::Z, -1.0),
        tube(Vec3::ZERO, 1.0),
        tube(Vec3::Z * 1e19, 1.0),
        tube(Vec3::NAN, 1.0),
    ] {
        let error = Accel::build(Geometry {
            shapes: vec![shape],
        })
        .unwrap_err();
        assert!(
            matches!(error, GeometryError::Cylinder { shape: 0, .. }),
            "{error}"
        );
    }
}

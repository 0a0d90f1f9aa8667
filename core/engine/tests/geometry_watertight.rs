//! Closed meshes do not leak: rays from inside, aimed exactly at edges and vertices, must hit something.

mod geometry_common;

use geometry_common::{Uniform, icosphere, share_of};
use glam::{Vec3, vec3};
use resolvent_engine::geometry::{Accel, Geometry, Ray, Shape, TriangleMesh};

/// Rays through edge and vertex points of `mesh` from around `center` that hit nothing, for both queries and kernels.
fn leaks(
    mut mesh: TriangleMesh,
    place: impl Fn(Vec3) -> Vec3,
    inside: impl Fn(&mut Uniform) -> Vec3,
) -> usize {
    for p in &mut mesh.positions {
        *p = place(*p);
    }
    let geometry = Geometry {
        shapes: vec![Shape::Mesh(mesh.clone())],
    };
    let mut accel = Accel::build(geometry).unwrap().unwrap();
    let mut random = Uniform(7);
    let mut rays = Vec::new();
    for i in 0..share_of(1_000_000, 150_000) {
        let t =
            mesh.indices[(random.next() * mesh.indices.len() as f32) as usize % mesh.indices.len()];
        let [a, b] = [t[i % 3], t[(i + 1) % 3]].map(|k| mesh.positions[k as usize]);
        let target = match i % 4 {
            0 => a,
            1 => (a + b) * 0.5,
            _ => a + (b - a) * random.next(),
        };
        let o = place(inside(&mut random));
        rays.push(Ray::new(o, target - o));
    }
    let mut leaks = 0;
    for _ in 0..2 {
        leaks += rays.iter().filter(|r| accel.closest(r).is_none()).count();
        leaks += rays.iter().filter(|r| !accel.occluded(r)).count();
        accel.use_portable_kernel();
    }
    leaks
}

fn near_center(random: &mut Uniform) -> Vec3 {
    random.direction() * (0.3 * random.next())
}

#[test]
fn unit_sphere() {
    assert_eq!(leaks(icosphere(5), |p| p, near_center), 0);
}

#[test]
fn far_from_the_origin() {
    assert_eq!(leaks(icosphere(5), |p| p + 1e5, near_center), 0);
    assert_eq!(
        leaks(
            icosphere(5),
            |p| p * 1e5 + vec3(1e9, -1e9, 3e8),
            near_center
        ),
        0
    );
}

#[test]
fn tiny() {
    assert_eq!(leaks(icosphere(5), |p| p * 1e-5, near_center), 0);
    assert_eq!(leaks(icosphere(5), |p| p * 1e-5 + 1.0, near_center), 0);
}

#[test]
fn huge() {
    assert_eq!(leaks(icosphere(5), |p| p * 1e12, near_center), 0);
}

#[test]
fn stretched() {
    assert_eq!(
        leaks(icosphere(5), |p| p * vec3(1.0, 1e-4, 1e4), near_center),
        0
    );
}

/// Where underflow and overflow begin.
#[test]
fn ends_of_the_range() {
    assert_eq!(leaks(icosphere(3), |p| p * 1e-18, near_center), 0);
    assert_eq!(leaks(icosphere(3), |p| p * 9e17, near_center), 0);
}

/// Origins close to large triangles, whose vertices are far beyond the hit and partly behind the origin.
#[test]
fn close_to_large_triangles() {
    let corners = |s: f32| {
        let mut mesh = TriangleMesh::default();
        for i in 0..8 {
            mesh.positions.push(vec3(
                if i & 1 == 0 { -s } else { s },
                if i & 2 == 0 { -s } else { s },
                if i & 4 == 0 { -s } else { s },
            ));
        }
        for [a, b, c, d] in [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ] {
            // A centre vertex in each face: edges along the axes and the diagonals.
            let m = mesh.positions.len() as u32;
            let sum: Vec3 = [a, b, c, d]
                .iter()
                .map(|&k| mesh.positions[k as usize])
                .sum();
            mesh.positions.push(sum / 4.0);
            for [k, l] in [[a, b], [b, c], [c, d], [d, a]] {
                mesh.indices.push([k, l, m]);
            }
        }
        mesh
    };
    let near_a_face = |random: &mut Uniform| {
        let mut p = random.direction() * 2.0;
        p[(random.next() * 3.0) as usize % 3] = 1000.0 - 0.01 - 0.1 * random.next();
        p
    };
    assert_eq!(leaks(corners(1000.0), |p| p, near_a_face), 0);
    assert_eq!(
        leaks(corners(1000.0), |p| p + vec3(17.3, 0.1, -5.7), near_a_face),
        0
    );
    // Targets close to the origin of the ray as well.
    let mesh = corners(1000.0);
    let accel = Accel::build(Geometry {
        shapes: vec![Shape::Mesh(mesh)],
    })
    .unwrap()
    .unwrap();
    let mut random = Uniform(3);
    for _ in 0..share_of(1_000_000, 150_000) {
        let along = 2.0 * random.next() - 1.0;
        // On an edge of the face x = 1000: y = z, y = −z.
        let target = vec3(
            1000.0,
            along,
            if random.next() < 0.5 { along } else { -along },
        );
        let o = target
            - vec3(
                1e-3 + 0.1 * random.next(),
                random.next() - 0.5,
                random.next() - 0.5,
            );
        let ray = Ray::new(o, target - o);
        assert!(accel.closest(&ray).is_some(), "{ray:?}");
        assert!(accel.occluded(&ray), "{ray:?}");
    }
}

/// A floor of large triangles with edges along the axes, where boxes end exactly at edges, seen from close above: rounding moves
/// the vertices by more than the hit's distance explains, which is what boxes are padded for.
#[test]
fn edges_at_the_faces_of_boxes() {
    let mut random = Uniform(9);
    let mut leaks = 0;
    for turn in 0..12 {
        let roll = |p: Vec3| match turn % 3 {
            0 => p,
            1 => vec3(p.z, p.x, p.y),
            _ => vec3(p.y, p.z, p.x),
        };
        let (n, size) = (4, 10f32.powi(turn / 3 + 1));
        let middle = random.vector();
        let mut mesh = TriangleMesh::default();
        for j in 0..=n {
            for i in 0..=n {
                let at = vec3(i as f32 - 2.0, j as f32 - 2.0, 0.0) * size;
                mesh.positions.push(roll(middle + at));
            }
        }
        let at = |i: u32, j: u32| j * (n + 1) + i;
        for j in 0..n {
            for i in 0..n {
                mesh.indices
                    .push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.indices
                    .push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        let accel = Accel::build(Geometry {
            shapes: vec![Shape::Mesh(mesh)],
        })
        .unwrap()
        .unwrap();
        for _ in 0..share_of(200_000, 40_000) {
            // Next to the edges through the middle, within what rounding moves them by, from a height of a millionth to a
            // hundredth of the triangles' size.
            let across = usize::from(random.next() < 0.5);
            let mut target = middle;
            target[1 - across] += random.signed();
            target[across] += random.signed() * size * 10f32.powf(-9.0 + 4.0 * random.next());
            let height = size * 10f32.powf(-6.0 + 4.0 * random.next());
            let o = target + vec3(random.signed(), random.signed(), random.next()) * height;
            let ray = Ray::new(roll(o), roll(target - o));
            // Only a ray that comes down counts: it cannot miss the plane.
            if o.z > target.z {
                leaks += usize::from(accel.closest(&ray).is_none());
                leaks += usize::from(!accel.occluded(&ray));
            }
        }
    }
    assert_eq!(leaks, 0);
}

/// Two quads' halves and a T-shaped crack closed by a triangle whose vertices are on a line.
#[test]
fn vertices_on_a_line_close_gaps() {
    let (a, b, c, d) = (
        vec3(0.0, 0.0, 0.0),
        vec3(7.0, 1.0, 3.0),
        vec3(3.0, 9.0, -1.0),
        vec3(-1.0, -8.0, 2.0),
    );
    let middle = (a + b) * 0.5;
    let mesh = TriangleMesh {
        positions: vec![a, b, c, d, middle],
        indices: vec![[0, 1, 2], [1, 4, 3], [4, 0, 3], [0, 4, 1]],
        ..TriangleMesh::default()
    };
    let accel = Accel::build(Geometry {
        shapes: vec![Shape::Mesh(mesh)],
    })
    .unwrap()
    .unwrap();
    assert_eq!(accel.stats().degenerate_triangles, 0);
    let mut random = Uniform(5);
    let mut on_the_line = 0;
    for _ in 0..share_of(1_000_000, 150_000) {
        let target = a + (b - a) * (0.01 + 0.98 * random.next());
        let o = target + random.direction() * 20.0;
        // Stay clear of the plane of the mesh, where a rim is a rim.
        let n = (b - a).cross(c - a).normalize();
        let ray = Ray::new(o, target - o);
        if ray.d.normalize().dot(n).abs() < 0.1
            || ray
                .d
                .normalize()
                .dot((b - a).cross(d - a).normalize())
                .abs()
                < 0.1
        {
            continue;
        }
        let hit = accel.closest(&ray);
        let Some(hit) = hit else {
            panic!("{ray:?} slips through")
        };
        if hit.prim == 3 {
            on_the_line += 1;
            let at = accel.interaction(&hit, &ray);
            assert!((at.ng.length() - 1.0).abs() < 1e-5);
            assert!((at.p - target).length() < 1e-4);
        }
    }
    println!("{on_the_line} hits on the triangle without area");
}

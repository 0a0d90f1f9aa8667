//! No light leaks: walks inside closed bodies that bounce from edge to edge and from vertex to vertex never get out, and no shadow ray
//! from there reaches a light behind an edge or a vertex. Seven scales and offsets, bodies by themselves and as stretched copies.
//!
//! Two million rays by default; ten million with `RESOLVENT_FULL=1`.

mod geometry_common;

use geometry_common::{Uniform, icosphere, share_of};
use glam::{DMat3, DVec3, Vec3, vec3};
use resolvent_api::Affine;
use resolvent_engine::geometry::{Accel, Geometry, Instance, Ray, Shape, TriangleMesh};

/// Scale and offset.
const PLACES: [(f32, Vec3); 7] = [
    (1.0, Vec3::ZERO),
    (1e-5, Vec3::ZERO),
    (1e5, Vec3::ZERO),
    (1.0, vec3(1e5, -2e4, 3e3)),
    (1e-5, vec3(0.3, 1.0, -0.7)),
    (1e12, vec3(-1e12, 0.0, 3e11)),
    (1e5, vec3(1e9, -1e9, 3e8)),
];

fn tetrahedron() -> TriangleMesh {
    TriangleMesh {
        positions: vec![
            vec3(1.0, 1.0, 1.0),
            vec3(-1.0, -1.0, 1.0),
            vec3(-1.0, 1.0, -1.0),
            vec3(1.0, -1.0, -1.0),
        ],
        indices: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..TriangleMesh::default()
    }
}

fn cube() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for i in 0..8 {
        let side = |bit: u32| if i & bit == 0 { -0.9 } else { 0.9 };
        mesh.positions.push(vec3(side(1), side(2), side(4)));
    }
    for [a, b, c, d] in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        mesh.indices.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// The body in the world, and what traces it.
fn place(mesh: &TriangleMesh, scale: f32, offset: Vec3, copy: bool) -> (TriangleMesh, Accel) {
    let turn = DMat3::from_axis_angle(DVec3::new(0.3, -0.5, 0.8).normalize(), 0.7);
    let stretch = DMat3::from_diagonal(DVec3::new(1.3, -0.6, 1.0) * f64::from(scale));
    let linear = if copy {
        turn * stretch
    } else {
        DMat3::from_diagonal(DVec3::splat(f64::from(scale)))
    };
    let to_world = Affine {
        columns: [linear.x_axis, linear.y_axis, linear.z_axis],
        translation: offset.as_dvec3(),
    };
    let mut world = mesh.clone();
    for p in &mut world.positions {
        *p = to_world.point(p.as_dvec3()).as_vec3();
    }
    let body = |m: &TriangleMesh| Geometry {
        shapes: vec![Shape::Mesh(m.clone())],
    };
    let accel = if copy {
        let instance = Instance {
            prototype: 0,
            to_world,
        };
        Accel::build_instanced(Geometry::default(), vec![body(mesh)], &[instance])
    } else {
        Accel::build(body(&world))
    };
    (world, accel.unwrap().unwrap())
}

/// A point on an edge, a vertex, or within rounding of one.
fn target(mesh: &TriangleMesh, random: &mut Uniform) -> Vec3 {
    let face = mesh.indices[random.bits() as usize % mesh.indices.len()];
    let first = random.bits() as usize % 3;
    let [a, b] = [face[first], face[(first + 1) % 3]].map(|k| mesh.positions[k as usize]);
    match random.bits() % 8 {
        0 | 1 => a,
        2 => (a + b) * 0.5,
        3 => a + (b - a) * (random.next() * 1e-5),
        _ => a + (b - a) * random.next(),
    }
}

/// Escapes and lights seen among `rays` rays of walks inside `mesh`.
fn leaks(mesh: &TriangleMesh, accel: &Accel, size: f32, centre: Vec3, rays: usize) -> [usize; 2] {
    let mut random = Uniform(3);
    let (mut escaped, mut seen, mut traced) = (0, 0, 0);
    while traced < rays {
        let mut ray = Ray::new(centre, target(mesh, &mut random) - centre);
        for _ in 0..32 {
            traced += 2;
            let Some(hit) = accel.closest(&ray) else {
                escaped += 1;
                break;
            };
            escaped += usize::from(!accel.occluded(&ray));
            let at = accel.interaction(&hit, &ray);
            // On to another edge or vertex, which may lie next to this one, but not outside, and not flatter than 1 : 2000. The triangle
            // test moves vertices by up to eight roundings of the triangle's size, the origin leaves its face by those of its own
            // coordinates: a flatter ray may pass an edge between what the two faces beside it take for theirs (one of ten million
            // down to 1 : 10⁶ did, at 1 : 7200, an edge 2·10⁻⁵ of the body's size away; below 10⁻⁷ the sign itself is rounding).
            let Some(w) = (0..20)
                .map(|_| target(mesh, &mut random) - at.p)
                .find(|w| w.dot(at.ng) < -0.0005 * w.length())
            else {
                break;
            };
            ray = at.spawn(w);
            // A light behind there, clearly outside: the bodies are less than four across.
            let light = at.p + w.normalize() * (size * (4.0 + 4.0 * random.next()));
            seen += usize::from(!accel.occluded(&Ray::segment(ray.o, light)));
        }
    }
    [escaped, seen]
}

#[test]
fn nothing_gets_out() {
    let meshes = [
        ("sphere", icosphere(3)),
        ("cube", cube()),
        ("tetrahedron", tetrahedron()),
    ];
    let each = share_of(10_000_000, 2_000_000) / (PLACES.len() * meshes.len() * 2);
    let mut failures = Vec::new();
    for (scale, offset) in PLACES {
        for (name, mesh) in &meshes {
            for copy in [false, true] {
                let (world, accel) = place(mesh, scale, offset, copy);
                let found = leaks(&world, &accel, scale, offset, each);
                if found != [0, 0] {
                    failures.push(format!(
                        "{name}, {scale:e} at {offset}, copy {copy}: {found:?}"
                    ));
                }
            }
        }
    }
    let n = failures.len();
    assert!(
        n == 0,
        "{n} places leak (escapes, lights seen), {each} rays each:\n{}",
        failures.join("\n")
    );
}

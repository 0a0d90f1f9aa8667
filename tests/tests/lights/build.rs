//! Lights to test with.

use glam::Vec3;
use resolvent_api::Spectrum;
use resolvent_api::math::warp;
use resolvent_api::rng::Stream;
use resolvent_engine::geometry::{Cylinder, Disk, Quad, Sphere, TriangleMesh};
use resolvent_engine::light::{Area, BoundingSphere, Light, Lights, Spot};

/// RGB.
pub const LANES: u32 = 3;

/// Bounds of the scenes here.
pub const BOUNDS: BoundingSphere = BoundingSphere {
    center: Vec3::ZERO,
    radius: 10.0,
};

/// A point in the cube of half width `size`.
pub fn point_in(s: &mut Stream, size: f32) -> Vec3 {
    Vec3::new(s.uniform(), s.uniform(), s.uniform()) * (2.0 * size) - Vec3::splat(size)
}

/// An octahedron, seen from outside.
pub fn octahedron(center: Vec3, radius: f32) -> TriangleMesh {
    let positions = [Vec3::X, Vec3::Y, Vec3::Z]
        .into_iter()
        .flat_map(|a| [center + a * radius, center - a * radius])
        .collect();
    let mut indices = Vec::new();
    for (x, y, z) in [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4)] {
        indices.push([x, y, z]);
        indices.push([y, x, z + 1]);
    }
    TriangleMesh {
        positions,
        indices,
        ..TriangleMesh::default()
    }
}

/// `n` lights of all kinds with a place, of sizes and strengths over two decades, in a cube of half width 5.
pub fn mixed(n: usize, seed: u64) -> Vec<Light> {
    let mut s = Stream::new(seed);
    (0..n)
        .map(|i| {
            let p = point_in(&mut s, 5.0);
            let size = 0.3 * 10f32.powf(-2.0 * s.uniform());
            let strength =
                Spectrum::rgb(s.uniform(), s.uniform(), s.uniform()) + Spectrum::splat(0.1);
            let strength = strength * 10f32.powf(2.0 * s.uniform());
            let (normal, sides) = (warp::sphere(s.uniform2()), s.uniform() < 0.5);
            let shape = i as u32;
            match i % 7 {
                0 => Light::Point {
                    position: p,
                    intensity: strength * 0.1,
                },
                1 => Light::Spot(Spot::new(
                    p,
                    normal,
                    strength,
                    60.0 + 60.0 * f64::from(s.uniform()),
                    30.0,
                )),
                2 => {
                    let (center, radius) = (p, size);
                    Light::Area(Area::sphere(
                        shape,
                        Sphere { center, radius },
                        strength,
                        sides,
                    ))
                }
                3 => {
                    let disk = Disk {
                        center: p,
                        normal,
                        radius: size,
                    };
                    Light::Area(Area::disk(shape, disk, strength, sides))
                }
                4 => {
                    let tube = Cylinder {
                        base: p,
                        axis: normal * (3.0 * size),
                        radius: 0.2 * size,
                    };
                    Light::Area(Area::cylinder(shape, tube, strength, sides))
                }
                5 => Light::Area(Area::mesh(shape, octahedron(p, size), strength, sides)),
                _ => {
                    let edge_u = normal.any_orthonormal_vector() * size;
                    let quad = Quad {
                        corner: p,
                        edge_u,
                        edge_v: normal.cross(edge_u),
                    };
                    Light::Area(Area::quad(shape, quad, strength, sides))
                }
            }
        })
        .collect()
}

/// A sky and a sun.
pub fn distant() -> Vec<Light> {
    vec![
        Light::Constant {
            radiance: Spectrum::splat(0.02),
        },
        Light::disc(
            Vec3::new(0.3, 0.4, 0.5).normalize(),
            Spectrum::splat(0.5),
            1.0,
        ),
        Light::Distant {
            to_light: Vec3::new(-0.3, 0.4, 0.1).normalize(),
            irradiance: Spectrum::splat(0.4),
        },
    ]
}

/// With a tree however few there are.
pub fn with_tree(all: Vec<Light>) -> Lights {
    Lights::with_tree_from(all, BOUNDS, LANES, 2)
}

/// Without a tree however many there are.
pub fn by_power(all: Vec<Light>) -> Lights {
    Lights::with_tree_from(all, BOUNDS, LANES, usize::MAX)
}

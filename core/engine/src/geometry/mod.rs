//! Geometry and ray tracing.
//!
//! ```
//! use glam::{Vec3, vec3};
//! use resolvent_engine::geometry::{Accel, Geometry, Quad, Ray, Shape, Sphere};
//!
//! let floor = Quad { corner: vec3(-5.0, -5.0, 0.0), edge_u: vec3(10.0, 0.0, 0.0), edge_v: vec3(0.0, 10.0, 0.0) };
//! let ball = Sphere { center: vec3(0.0, 0.0, 1.0), radius: 1.0 };
//! let shapes = vec![Shape::Quad(floor), Shape::Sphere(ball)];
//! let accel = Accel::build(Geometry { shapes })?.expect("there is something to hit");
//!
//! let ray = Ray::new(vec3(3.0, 0.0, 5.0), -Vec3::Z);
//! let hit = accel.closest(&ray).expect("the floor");
//! let at = accel.interaction(&hit, &ray);
//! assert!(hit.shape == 0 && at.ng == Vec3::Z && at.p.distance(vec3(3.0, 0.0, 0.0)) < 1e-5);
//! assert!(accel.occluded(&at.spawn(vec3(-3.0, 0.0, 1.0))));
//! # Ok::<(), resolvent_engine::geometry::GeometryError>(())
//! ```
//!
//! - [`Geometry`] is a list of [`Shape`]s: triangle meshes, quads, spheres, disks, cylinders. [`Accel::build`] checks it (bad input is a
//!   [`GeometryError`] that names shape and index; triangles with equal vertices are left out and counted) and builds one hierarchy;
//!   a scene with nothing to hit gives `None`.
//! - [`Accel::build_instanced`] adds copies of prototypes: every prototype has a hierarchy of its own, and one over the copies'
//!   boxes leads to them (`instance`, `two_level`). Without copies neither exists, and queries are those of one hierarchy.
//! - [`Accel::closest`] and [`Accel::occluded`] answer rays; `*_with` take a filter, for surfaces that light passes as if they
//!   were not there. [`Accel::interaction`] gives the surface at a hit, [`SurfacePoint::spawn`] or [`offset_origin`] the next
//!   ray's origin, and [`Ray::segment`] tests visibility between two offset points.
//!
//! Nothing slips between triangles which share an edge, and nothing depends on an absolute epsilon:
//! - slabs are conservative, and boxes padded for what the triangle test may move vertices by (`ray.rs`, `triangle.rs`);
//! - triangles are watertight, with f64 where f32 cannot decide, also about which side of a triangle a ray starts on;
//! - equal distances go to the lower primitive, so that hits do not depend on the shape of the hierarchy or on the processor.
//!
//! `ray` → `traverse` (generic over `portable` and `simd` kernels) → `triangle`, `quadric`; `input` → `build` → `collapse`.

mod accel;
mod build;
mod bvh8;
mod collapse;
mod cylinder;
mod disk;
mod input;
mod instance;
mod portable;
mod quadric;
mod ray;
#[cfg(target_arch = "x86_64")]
mod simd;
mod sphere;
mod surface;
mod traverse;
mod triangle;
mod two_level;

pub use accel::{Accel, AccelStats};
pub use input::{Cylinder, Disk, Geometry, GeometryError, Quad, Shape, Sphere, TriangleMesh};
pub use instance::Instance;
pub use ray::{Hit, MAX_COORDINATE, Ray};
pub(crate) use surface::mixed;
pub use surface::{SurfacePoint, offset_origin};

//! Primitives without triangles: spheres, disks and cylinders.

use super::bvh8::Bounds;
use super::cylinder::{self, Tube};
use super::disk::{self, Plate};
use super::input::Shape;
use super::ray::RaySetup;
use super::sphere::{self, Ball};

/// A quadric in the hierarchy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quadric {
    form: Form,
    /// Number among all primitives of the geometry.
    pub prim: u32,
}

#[derive(Clone, Copy, Debug)]
enum Form {
    Ball(Ball),
    Plate(Plate),
    Tube(Tube),
}

impl Quadric {
    /// The primitive number `prim` and its box; `None` for shapes made of triangles.
    pub fn new(shape: &Shape, prim: u32) -> Option<(Self, Bounds)> {
        let (form, bounds) = match shape {
            Shape::Mesh(_) | Shape::Quad(_) => return None,
            Shape::Sphere(s) => (Form::Ball(Ball::new(s)), sphere::bounds(s)),
            Shape::Disk(d) => (Form::Plate(Plate::new(d)), disk::bounds(d)),
            Shape::Cylinder(c) => (Form::Tube(Tube::new(c)), cylinder::bounds(c)),
        };
        Some((Self { form, prim }, bounds))
    }

    /// Nearest t in (t_min, `t_max`\] on the surface, from either side.
    #[inline]
    pub fn intersect(&self, ray: &RaySetup, t_max: f32) -> Option<f32> {
        match &self.form {
            Form::Ball(b) => b.intersect(ray, t_max),
            Form::Plate(p) => p.intersect(ray, t_max),
            Form::Tube(t) => t.intersect(ray, t_max),
        }
    }
}

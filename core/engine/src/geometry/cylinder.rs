//! Open cylinders: lateral surfaces without caps.

use glam::{DVec3, Vec3};

use super::bvh8::Bounds;
use super::disk::around;
use super::input::Cylinder;
use super::ray::RaySetup;

/// A cylinder as it is intersected, in f64 like [`super::sphere::Ball`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Tube {
    base: [f32; 3],
    axis: [f32; 3],
    radius: f32,
}

/// Box of a cylinder, rounded outwards: that of the circles at its ends.
pub(super) fn bounds(c: &Cylinder) -> Bounds {
    let (base, axis) = (c.base.as_dvec3(), c.axis.as_dvec3());
    let u = axis.normalize_or_zero();
    let reach = (DVec3::ONE - u * u).max(DVec3::ZERO);
    let reach = DVec3::new(reach.x.sqrt(), reach.y.sqrt(), reach.z.sqrt()) * f64::from(c.radius);
    let (lo, hi) = (base.min(base + axis), base.max(base + axis));
    around(lo - reach, hi + reach).padded(c.radius * 1e-7)
}

impl Tube {
    pub fn new(c: &Cylinder) -> Self {
        Self {
            base: c.base.to_array(),
            axis: c.axis.to_array(),
            radius: c.radius,
        }
    }

    /// Nearest t in (t_min, `t_max`\] on the lateral surface, from outside or inside.
    ///
    /// Across the axis this is the circle that [`super::sphere::Ball::intersect`] solves in space: the discriminant comes from
    /// the distance of axis and ray, |f|² − r² is a product, and the roots do not cancel. A hit beyond the ends does not
    /// count, the further one may.
    #[inline]
    pub fn intersect(&self, ray: &RaySetup, t_max: f32) -> Option<f32> {
        let (o, d) = (Vec3::from_array(ray.o), Vec3::from_array(ray.d));
        self.solve(o, d, ray.t_min, t_max).map(|t| t as f32)
    }

    /// [`Self::intersect`] before t is rounded to f32.
    #[inline]
    pub fn solve(&self, o: Vec3, d: Vec3, t_min: f32, t_max: f32) -> Option<f64> {
        let d = d.as_dvec3();
        let f = o.as_dvec3() - Vec3::from_array(self.base).as_dvec3();
        let axis = Vec3::from_array(self.axis).as_dvec3();
        let length = axis.length();
        let u = axis / length;
        let (f_along, d_along) = (f.dot(u), d.dot(u));
        // Parts across the axis.
        let (fc, dc) = (f - u * f_along, d - u * d_along);
        let r = f64::from(self.radius);
        let a = dc.length_squared();
        let b = -fc.dot(dc);
        let closest = fc + dc * (b / a);
        let discriminant = r * r - closest.length_squared();
        // Rays along the axis: a = 0, the discriminant is NaN, and nothing is hit.
        if !(discriminant >= 0.0) {
            return None;
        }
        let distance = fc.length();
        let c = (distance - r) * (distance + r);
        let q = b + (a * discriminant).sqrt().copysign(b);
        if q == 0.0 {
            return None;
        }
        let (t0, t1) = (c / q, q / a);
        let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
        let (lo, hi) = (f64::from(t_min), f64::from(t_max));
        let valid = |t: f64| {
            let along = f_along + t * d_along;
            t > lo && t <= hi && (0.0..=length).contains(&along)
        };
        [near, far].into_iter().find(|t| valid(*t))
    }
}

//! Flat round disks.

use glam::{DVec3, Vec3};

use super::bvh8::Bounds;
use super::input::Disk;
use super::ray::RaySetup;

/// A disk as it is intersected, in f64 like [`super::sphere::Ball`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Plate {
    center: [f32; 3],
    /// The input's f32 normal as it is: its length does not matter here, and its direction is the surface's.
    normal: [f32; 3],
    radius: f32,
}

/// Box of a disk, rounded outwards: it reaches r √(1 − n_i²) along axis i.
pub(super) fn bounds(d: &Disk) -> Bounds {
    let n = d.normal.as_dvec3().normalize_or_zero();
    let reach = (DVec3::ONE - n * n).max(DVec3::ZERO);
    let reach = DVec3::new(reach.x.sqrt(), reach.y.sqrt(), reach.z.sqrt()) * f64::from(d.radius);
    around(d.center.as_dvec3() - reach, d.center.as_dvec3() + reach).padded(d.radius * 1e-7)
}

/// The smallest f32 box that is sure to hold an f64 box.
pub(super) fn around(lo: DVec3, hi: DVec3) -> Bounds {
    Bounds {
        min: lo.as_vec3().to_array().map(f32::next_down),
        max: hi.as_vec3().to_array().map(f32::next_up),
    }
}

impl Plate {
    pub fn new(d: &Disk) -> Self {
        Self {
            center: d.center.to_array(),
            normal: d.normal.to_array(),
            radius: d.radius,
        }
    }

    /// The t in (t_min, `t_max`\] on the disk; none for rays within its plane.
    ///
    /// n·(o − c) is a sum of three products that are exact in f64 for coordinates within 2²⁹ of each other, so that its sign
    /// tells the sides apart down to the error-bounded offset that rays leave the surface with.
    #[inline]
    pub fn intersect(&self, ray: &RaySetup, t_max: f32) -> Option<f32> {
        let d = DVec3::from_array(ray.d.map(f64::from));
        let f =
            DVec3::from_array([0, 1, 2].map(|i| f64::from(ray.o[i]) - f64::from(self.center[i])));
        let n = Vec3::from_array(self.normal).as_dvec3();
        let t = -n.dot(f) / n.dot(d);
        // A ray within the plane makes this infinite or NaN, and is a miss.
        if !(t > f64::from(ray.t_min) && t <= f64::from(t_max)) {
            return None;
        }
        let r = f64::from(self.radius);
        ((f + d * t).length_squared() <= r * r).then_some(t as f32)
    }
}

//! Analytic spheres.

use super::bvh8::Bounds;
use super::input::Sphere;
use super::ray::RaySetup;

/// A sphere in the hierarchy.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    center: [f32; 3],
    radius: f32,
}

/// Box of a sphere, rounded outwards.
pub(super) fn bounds(s: &Sphere) -> Bounds {
    let c = s.center.to_array();
    // Two roundings of a sum of this size, plus what f64 loses against the exact sphere.
    Bounds {
        min: c.map(|x| (x - s.radius).next_down()),
        max: c.map(|x| (x + s.radius).next_up()),
    }
    .padded(s.radius * 1e-7)
}

impl Ball {
    pub fn new(s: &Sphere) -> Self {
        Self {
            center: s.center.to_array(),
            radius: s.radius,
        }
    }

    /// Nearest t in (t_min, `t_max`\] on the sphere's surface, from outside or inside.
    ///
    /// In f64, with the discriminant from the distance between centre and ray instead of b² − ac (Hearn & Baker; Haines et al.,
    /// "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems 7), and roots that do not cancel. o − c is
    /// exact for coordinates within 2²⁹ of each other, so that the sign of |o−c|² − r² tells inside from outside down to the
    /// error-bounded offset that rays leave the surface with.
    #[inline]
    pub fn intersect(&self, ray: &RaySetup, t_max: f32) -> Option<f32> {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let d = ray.d.map(f64::from);
        let f = [0, 1, 2].map(|i| f64::from(ray.o[i]) - f64::from(self.center[i]));
        let r = f64::from(self.radius);
        let a = dot(d, d);
        let b = -dot(f, d);
        let along = b / a;
        let l = [0, 1, 2].map(|i| f[i] + along * d[i]);
        let discriminant = r * r - dot(l, l);
        if discriminant < 0.0 {
            return None;
        }
        // |o−c|² − r² as a product, which keeps its sign and digits near the surface.
        let distance = dot(f, f).sqrt();
        let c = (distance - r) * (distance + r);
        let root = (a * discriminant).sqrt();
        let q = b + root.copysign(b);
        // q = 0: the origin is at the centre's foot point and on the surface at once (tangent); t = 0 is not a hit.
        if q == 0.0 {
            return None;
        }
        let (t0, t1) = (c / q, q / a);
        let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
        let (lo, hi) = (f64::from(ray.t_min), f64::from(t_max));
        let t = if near > lo { near } else { far };
        (t > lo && t <= hi).then_some(t as f32)
    }
}

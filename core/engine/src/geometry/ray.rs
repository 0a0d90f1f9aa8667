//! Rays, hits and what a traversal needs to know about a ray.

use glam::Vec3;

/// Largest absolute coordinate accepted in the input, in scene units. Products of two coordinate differences must stay
/// finite in f32 (4·10³⁶ here), which the triangle test relies on.
pub const MAX_COORDINATE: f32 = 1e18;

/// Relative widening of slab distances on both sides, 16 unit roundoffs (u = 2⁻²⁴).
///
/// Four of them cover the slab arithmetic itself: 1/d, its widening, b − o and the product (Ize 2013, "Robust BVH Ray
/// Traversal"). The triangle test moves a sheared vertex by at most u(2|v−o| + 6|S·z|) along each axis; the part of that
/// which scales with the distance of the hit needs 8 more. The part which scales with the size of the triangle is covered by
/// [`super::triangle::PAD`] when boxes are built.
const SLAB_WIDENING: f32 = 16.0 / 16_777_216.0;

/// A ray o + t·d with t in the open interval (`t_min`, `t_max`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin, scene units.
    pub o: Vec3,
    /// Direction; need not be normalised. t is measured in multiples of it.
    pub d: Vec3,
    /// Hits at or before this parameter are ignored. Not negative (a negative value acts as 0).
    pub t_min: f32,
    /// Hits at or after this parameter are ignored. May be infinite.
    pub t_max: f32,
}

impl Ray {
    /// The half line from `o` in direction `d`.
    pub fn new(o: Vec3, d: Vec3) -> Self {
        Self {
            o,
            d,
            t_min: 0.0,
            t_max: f32::INFINITY,
        }
    }

    /// The segment between two points, both excluded: d = `to` − `from`, t in (0, 1).
    ///
    /// Visibility between two surfaces needs both ends moved off their surfaces with [`super::offset_origin`] first.
    pub fn segment(from: Vec3, to: Vec3) -> Self {
        Self {
            o: from,
            d: to - from,
            t_min: 0.0,
            t_max: 1.0,
        }
    }

    /// The point o + t·d.
    pub fn at(&self, t: f32) -> Vec3 {
        self.o + self.d * t
    }
}

/// Where a ray meets a primitive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter of the hit.
    pub t: f32,
    /// Index of the shape in [`super::Geometry::shapes`].
    pub shape: u32,
    /// Primitive within the shape: the triangle of a mesh; 0 or 1 for a quad's halves; 0 for spheres, disks and cylinders.
    pub prim: u32,
    /// Barycentric weight of the triangle's second vertex; 0 for shapes without triangles.
    pub u: f32,
    /// Barycentric weight of the triangle's third vertex; 0 for shapes without triangles.
    pub v: f32,
}

/// Per-ray constants of slab and triangle tests.
#[derive(Clone, Copy, Debug)]
pub(super) struct RaySetup {
    pub o: [f32; 3],
    pub d: [f32; 3],
    /// 1/d, rounded so that distances to near planes are never overestimated; always finite.
    pub inv_near: [f32; 3],
    /// 1/d, rounded so that distances to far planes are never underestimated; infinite where d vanishes.
    pub inv_far: [f32; 3],
    /// Row of [`super::bvh8::Node8::bounds`] with the near plane of each axis; the far plane is in row ^ 1.
    pub near_row: [usize; 3],
    /// Axes permuted so that the last is the one where |d| is largest (Woop, Benthin, Wald 2013).
    pub k: [usize; 3],
    /// Shear constants d\[kx\]/d\[kz\], d\[ky\]/d\[kz\], 1/d\[kz\].
    pub s: [f32; 3],
    pub t_min: f32,
    pub t_max: f32,
}

impl RaySetup {
    /// Constants for `ray`; `None` if it cannot hit anything: non-finite origin or direction, an origin beyond twice
    /// [`MAX_COORDINATE`], a direction without a component in 2⁻¹⁰⁰…2¹⁰⁰, or an empty interval.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Option<Self> {
        let (o, d) = (ray.o.to_array(), ray.d.to_array());
        let a = ray.d.abs();
        let largest = a.max_element();
        let t_min = if ray.t_min > 0.0 { ray.t_min } else { 0.0 };
        // Comparisons are written so that a NaN anywhere makes them false.
        let valid = ray.o.abs().cmple(Vec3::splat(2.0 * MAX_COORDINATE)).all()
            && a.cmple(Vec3::splat(1.267_650_6e30)).all()
            && largest >= 7.888_609e-31
            && ray.t_min.is_finite()
            && t_min < ray.t_max;
        if !valid {
            return None;
        }
        let kz = if a.x >= a.y && a.x >= a.z {
            0
        } else if a.y >= a.z {
            1
        } else {
            2
        };
        let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
        let inv = d.map(|x| 1.0 / x);
        let mut inv_near = [0.0; 3];
        let mut inv_far = [0.0; 3];
        let mut near_row = [0; 3];
        for i in 0..3 {
            // 1/±0 = ±inf. The near distance then uses ±MAX: a plane in front lies at a huge t, a plane through the
            // origin at t = 0, never 0·inf. The far distance keeps inf, and a NaN from 0·inf drops out of the minimum.
            inv_near[i] = (inv[i] * (1.0 - SLAB_WIDENING)).clamp(-f32::MAX, f32::MAX);
            inv_far[i] = inv[i] * (1.0 + SLAB_WIDENING);
            near_row[i] = 2 * i + usize::from(d[i].is_sign_negative());
        }
        Some(Self {
            o,
            d,
            inv_near,
            inv_far,
            near_row,
            k: [kx, ky, kz],
            // Products, not quotients: one more rounding, for two divisions less.
            s: [d[kx] * inv[kz], d[ky] * inv[kz], inv[kz]],
            t_min,
            t_max: ray.t_max,
        })
    }
}

//! Triangles four at a time, and the double precision part of the watertight test.
//!
//! Woop, Benthin, Wald 2013, "Watertight Ray/Triangle Intersection" (JCGT 2(1)): vertices are moved into a frame where the ray
//! is the z axis, then three edge functions decide. A vertex moves the same way whatever triangle it belongs to, and rounding
//! is monotonic, so that the sign of an f32 edge function is right or the function is 0; zeros are decided in f64, where the
//! products are exact. No fused multiply-add anywhere: it would break the antisymmetry of shared edges.

use super::bvh8::Bounds;
use super::ray::RaySetup;
use glam::DVec3;

/// Triangles in one packet.
pub(super) const LANES: usize = 4;

/// Padding of a triangle's box in units of its largest extent, 9 unit roundoffs: the test moves vertices by up to 8u times the
/// triangle's extent in addition to what [`super::ray`] covers.
pub(super) const PAD: f32 = 9.0 / 16_777_216.0;

/// |det| below this is recomputed in f64: products of f32 coordinates may have lost digits to underflow.
pub(super) const TINY_DET: f32 = 1e-30;

/// γ_n = n·u / (1 − n·u), u = 2⁻²⁴: bound on the relative error of n roundings (Higham; pbrt §6.8.1).
pub(super) const fn gamma(n: u32) -> f32 {
    let nu = n as f32 / 16_777_216.0;
    nu / (1.0 - nu)
}

/// Whether `ray` meets the front of a triangle without area, by the orientation its sheared vertices have, which is what the hit
/// was decided on and what agrees with the neighbours.
pub(super) fn meets_front(ray: &RaySetup, vertices: [[f32; 3]; 3]) -> bool {
    let [a, b, c] = vertices.map(|p| shear(ray, p));
    let det =
        (c[0] * b[1] - c[1] * b[0]) + (a[0] * c[1] - a[1] * c[0]) + (b[0] * a[1] - b[1] * a[0]);
    // det is minus the z component of the sheared normal, and the ray runs along ±z.
    det * f64::from(ray.s[2]) >= 0.0
}

/// A vertex in the frame where the ray is the z axis: the same f32 operations as in the kernels.
#[inline(always)]
fn shear(ray: &RaySetup, p: [f32; 3]) -> [f64; 3] {
    let [kx, ky, kz] = ray.k;
    let z = p[kz] - ray.o[kz];
    let x = (p[kx] - ray.o[kx]) - ray.s[0] * z;
    let y = (p[ky] - ray.o[ky]) - ray.s[1] * z;
    [f64::from(x), f64::from(y), f64::from(z)]
}

/// Four triangles, 160 bytes. Unused lanes hold NaN, which fails every comparison.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(super) struct Packet {
    /// \[vertex\]\[axis\]\[lane\]
    pub v: [[[f32; LANES]; 3]; 3],
    /// Number of the triangle among all primitives of the geometry.
    pub prim: [u32; LANES],
}

impl Packet {
    pub const EMPTY: Self = Self {
        v: [[[f32::NAN; LANES]; 3]; 3],
        prim: [u32::MAX; LANES],
    };

    /// A vertex of the triangle in a lane.
    #[inline(always)]
    fn vertex(&self, vertex: usize, lane: usize) -> [f32; 3] {
        let rows = &self.v[vertex];
        let lane = lane % LANES;
        [rows[0][lane], rows[1][lane], rows[2][lane]]
    }

    /// Triangles in it.
    pub fn count(&self) -> usize {
        self.prim.iter().filter(|p| **p != u32::MAX).count()
    }

    pub fn set(&mut self, lane: usize, triangle: [[f32; 3]; 3], prim: u32) {
        for (rows, vertex) in self.v.iter_mut().zip(triangle) {
            for (row, x) in rows.iter_mut().zip(vertex) {
                row[lane] = x;
            }
        }
        self.prim[lane] = prim;
    }
}

/// What a test of one or two packets found: valid in the lanes of the returned mask only. A second packet has the upper four.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct PacketHits {
    pub t: [f32; 2 * LANES],
    pub u: [f32; 2 * LANES],
    pub v: [f32; 2 * LANES],
}

impl PacketHits {
    pub const NONE: Self = Self {
        t: [0.0; 2 * LANES],
        u: [0.0; 2 * LANES],
        v: [0.0; 2 * LANES],
    };
}

/// Box that the watertight test cannot miss.
pub(super) fn bounds(triangle: &[[f32; 3]; 3]) -> Bounds {
    let mut b = Bounds::EMPTY;
    for &p in triangle {
        b.include_point(p);
    }
    let extent = (0..3).map(|i| b.max[i] - b.min[i]).fold(0.0, f32::max);
    b.padded(extent * PAD)
}

/// Decides one lane in double precision, for lanes with an edge function of 0, a tiny determinant, or a t that is too close
/// to an end of the interval for f32.
///
/// Membership is decided on the f32 sheared vertices (that is what makes shared edges consistent), by exact signs. The distance
/// comes from the plane equation in f64, so that a ray which starts within f32 rounding of a triangle is put on the right side.
/// Returns (t, u, v).
///
/// Few lanes come here, and still it is not cold: every ray that leaves a surface does, on the triangle it starts from.
#[inline(never)]
pub(super) fn decide_lane(
    ray: &RaySetup,
    packet: &Packet,
    lane: usize,
    t_max: f32,
) -> Option<(f32, f32, f32)> {
    let (v0, v1, v2) = (
        packet.vertex(0, lane),
        packet.vertex(1, lane),
        packet.vertex(2, lane),
    );
    let s = f64::from(ray.s[2]);
    let z = [v0, v1, v2].map(|v| f64::from(v[ray.k[2]] - ray.o[ray.k[2]]) * s);
    let (nearest, farthest) = (z[0].min(z[1]).min(z[2]), z[0].max(z[1]).max(z[2]));
    let (t_min, t_max_ray) = (f64::from(ray.t_min), f64::from(ray.t_max));
    let plane = plane_distance(ray, v0, v1, v2);
    // Most lanes are that of the triangle the ray leaves, or of the light it ends at: beyond the end whether it meets them or not.
    if let Some(t) = plane
        && ((t <= t_min && nearest <= t_min) || (t >= t_max_ray && farthest >= t_max_ray))
    {
        return None;
    }
    let (a, b, c) = (shear(ray, v0), shear(ray, v1), shear(ray, v2));
    let u = c[0] * b[1] - c[1] * b[0];
    let v_ = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    // Minimum and maximum instead of six comparisons: the signs are as good as random, and branches on them are guesses.
    if u.min(v_).min(w) < 0.0 && u.max(v_).max(w) > 0.0 {
        return None;
    }
    let det = u + v_ + w;
    if det == 0.0 || det.is_nan() {
        return None;
    }
    // The hit lies between the vertices; this also tames a plane seen exactly edge on.
    let t = plane.unwrap_or((u * z[0] + v_ * z[1] + w * z[2]) / det);
    let t = t.max(nearest).min(farthest);
    if t > t_min && t < t_max_ray && t as f32 <= t_max {
        Some((t as f32, (v_ / det) as f32, (w / det) as f32))
    } else {
        None
    }
}

/// Ray parameter of the triangle's plane, in f64; `None` if the triangle has no area or the ray lies in its plane.
#[inline(always)]
fn plane_distance(ray: &RaySetup, v0: [f32; 3], v1: [f32; 3], v2: [f32; 3]) -> Option<f64> {
    let wide = |v: [f32; 3]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
    let a = wide(v0);
    let n = (wide(v1) - a).cross(wide(v2) - a);
    let t = n.dot(a - wide(ray.o)) / n.dot(wide(ray.d));
    (!t.is_nan()).then_some(t)
}

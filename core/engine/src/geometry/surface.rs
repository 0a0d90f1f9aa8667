//! The surface at a hit: position with its error, normals, texture coordinates; and how rays leave it.

use std::f32::consts::{PI, TAU};

use glam::{DVec3, Vec2, Vec3};

use super::cylinder::Tube;
use super::input::{Cylinder, Disk, Geometry, Quad, Shape, Sphere, TriangleMesh};
use super::ray::{Hit, Ray, RaySetup};
use super::triangle;

/// A point on a surface and its local frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Position, scene units: interpolated from the vertices, not o + t·d, and off the edges of triangles by a few roundings.
    pub p: Vec3,
    /// Bound on the distance of `p` from the surface along each axis.
    pub p_error: Vec3,
    /// Geometric normal, unit: (v1 − v0) × (v2 − v0) for triangles, edge_u × edge_v for quads, outwards for spheres
    /// and cylinders. It does not depend on where the ray came from.
    pub ng: Vec3,
    /// Shading normal, unit, on the same side as `ng` (ng·ns ≥ 0): interpolated if the mesh has normals, else `ng`.
    pub ns: Vec3,
    /// Texture coordinates: the mesh's; for meshes without any, the barycentric weights of the second and third vertex; (s, t)
    /// of quads; (φ/2π, θ/π) of spheres with θ from +z; of disks ((x, y)/r + 1)/2, of cylinders (φ/2π, height/length), with x and φ = 0
    /// along some vector that depends on the normal or axis alone.
    pub uv: Vec2,
    /// ∂p/∂u. Where the coordinates do not define it: some vector in the tangent plane of `ng`.
    pub dpdu: Vec3,
    /// Linear colour and opacity of meshes that have them; else white.
    pub color: [f32; 4],
    /// Index of the shape.
    pub shape: u32,
    /// Primitive within the shape.
    pub prim: u32,
}

impl Geometry {
    /// The surface at a `hit` of `ray`.
    ///
    /// # Panics
    /// If the hit names a shape or primitive that does not exist.
    pub fn interaction(&self, hit: &Hit, ray: &Ray) -> SurfacePoint {
        self.interaction_apart(hit, ray, 0.0)
    }

    /// [`Geometry::interaction`] on the quad `hit.shape`, whose halves are known.
    #[inline]
    pub(super) fn interaction_of_quad(
        &self,
        hit: &Hit,
        ray: &Ray,
        halves: &[Facet; 2],
    ) -> SurfacePoint {
        match &self.shapes[hit.shape as usize] {
            Shape::Quad(q) => quad(q, hit, ray, &halves[hit.prim as usize & 1], 0.0),
            _ => self.interaction_apart(hit, ray, 0.0),
        }
    }

    /// [`Geometry::interaction`] for a surface whose points have a further rounding error, summed over the axes.
    pub(super) fn interaction_apart(&self, hit: &Hit, ray: &Ray, further: f64) -> SurfacePoint {
        match &self.shapes[hit.shape as usize] {
            Shape::Mesh(m) => mesh(m, hit, ray, further),
            Shape::Quad(q) => quad(q, hit, ray, &Facet::new(q.triangle(hit.prim)), further),
            Shape::Sphere(s) => sphere(s, hit, ray),
            Shape::Disk(d) => disk(d, hit, ray),
            Shape::Cylinder(c) => cylinder(c, hit, ray),
        }
    }
}

impl Geometry {
    /// True where texture coordinates run clockwise seen from outside: ∂p/∂v is on the other side of ∂p/∂u than ng × ∂p/∂u.
    pub fn uv_mirrored(&self, shape: u32, prim: u32) -> bool {
        match &self.shapes[shape as usize] {
            Shape::Mesh(m) if !m.tangents.is_empty() => {
                m.tangents[m.indices[prim as usize][0] as usize][3] < 0.0
            }
            Shape::Mesh(m) if !m.uvs.is_empty() => {
                let [a, b, c] = m.indices[prim as usize].map(|i| m.uvs[i as usize].as_dvec2());
                (b - a).perp_dot(c - a) < 0.0
            }
            // θ runs from the north pole to the south.
            Shape::Sphere(_) => true,
            _ => false,
        }
    }
}

/// Distance that points keep from the edges of their triangle, in units of their rounding error summed over the axes. Moving a ray's
/// origin off the triangle takes up to 3 of them; at an edge of angle φ it then is on the right side of the neighbour, too, if
/// sin φ times this is more than that: for all but the sharpest edges.
const EDGE_MARGIN: f64 = 16.0;

/// Unit roundoff of f32.
const ROUND: f64 = 1.0 / 16_777_216.0;

/// What a point on a triangle is found from, in f64: the only rounding that matters is the last one to f32.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    a: DVec3,
    /// Edges from the first vertex.
    e1: DVec3,
    e2: DVec3,
    /// Their cross product, its squared length, and that of the longest edge.
    n: DVec3,
    n2: f64,
    sides: f64,
    /// Unit normal; zero if the triangle has no area.
    normal: Vec3,
}

impl Facet {
    #[inline(always)]
    pub fn new(vertices: [Vec3; 3]) -> Self {
        let a = vertices[0].as_dvec3();
        let (e1, e2) = (vertices[1].as_dvec3() - a, vertices[2].as_dvec3() - a);
        let n = e1.cross(e2);
        Self {
            a,
            e1,
            e2,
            n,
            n2: n.length_squared(),
            sides: e1
                .length_squared()
                .max(e2.length_squared())
                .max((e2 - e1).length_squared()),
            normal: n.normalize_or_zero().as_vec3(),
        }
    }

    /// The two of a quad.
    pub fn halves(quad: &Quad) -> [Self; 2] {
        [0, 1].map(|half| Self::new(quad.triangle(half)))
    }

    /// The point with the hit's barycentric weights, and its error.
    #[inline(always)]
    fn point(&self, hit: &Hit, further: f64) -> (Vec3, Vec3) {
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        let mut p = self.a + self.e1 * u + self.e2 * v;
        // The distance to an edge is its weight times the height over it, and heights are at least |n| over the longest edge.
        let least = u.min(v).min(1.0 - u - v);
        let rounding = ROUND * (p.x.abs() + p.y.abs() + p.z.abs()) + further;
        let margin = EDGE_MARGIN * rounding;
        if least.max(0.0).powi(2) * self.n2 < margin * margin * self.sides {
            p = self.off_edge(p, least, margin);
        }
        rounded(p)
    }

    /// A point on or within rounding of an edge, moved inwards by a little more than its rounding error: next to the edge, the origin
    /// of the next ray would otherwise fall behind the neighbouring triangle as often as not, and light would leak. It moves towards
    /// the centre, but no farther than that takes in corners of ordinary angles. `least` is the smallest barycentric weight.
    #[cold]
    fn off_edge(&self, p: DVec3, least: f64, margin: f64) -> DVec3 {
        let wanted = margin * self.sides.sqrt() / self.n.length();
        let towards = self.a + (self.e1 + self.e2) / 3.0 - p;
        let share = ((wanted - least) / (1.0 / 3.0 - least)).min(2.5 * margin / towards.length());
        // False also where the triangle has no area.
        if share > 0.0 && share <= 1.0 {
            p + towards * share
        } else {
            p
        }
    }

    /// Unit normal at a hit of `ray`.
    #[inline(always)]
    fn normal(&self, ray: &Ray) -> Vec3 {
        if self.normal == Vec3::ZERO {
            self.side_of(ray)
        } else {
            self.normal
        }
    }

    /// Three vertices on a line, met at the gap that they cover between their neighbours: any normal, on the right side.
    #[cold]
    fn side_of(&self, ray: &Ray) -> Vec3 {
        let back = ray.d.normalize_or(Vec3::Z);
        let vertices = [self.a, self.a + self.e1, self.a + self.e2];
        let front = RaySetup::new(ray)
            .is_none_or(|r| triangle::meets_front(&r, vertices.map(|v| v.as_vec3().to_array())));
        if front { -back } else { back }
    }
}

/// Rounds a position to f32 and bounds what that did: half a unit in the last place, and a trace for the f64 part before.
#[inline(always)]
fn rounded(p: DVec3) -> (Vec3, Vec3) {
    let error = p.abs() * (1.001 / 16_777_216.0);
    (
        p.as_vec3(),
        error.as_vec3().max(Vec3::splat(f32::MIN_POSITIVE)),
    )
}

fn mesh(m: &TriangleMesh, hit: &Hit, ray: &Ray, further: f64) -> SurfacePoint {
    let corner = m.indices[hit.prim as usize].map(|i| i as usize);
    let facet = Facet::new(corner.map(|i| m.positions[i]));
    let ((p, p_error), ng) = (facet.point(hit, further), facet.normal(ray));
    let Facet { e1, e2, .. } = facet;
    let (u, v) = (hit.u, hit.v);
    let ns = if m.normals.is_empty() {
        ng
    } else {
        let [n0, n1, n2] = corner.map(|i| m.normals[i].normalize_or_zero());
        let n = (n0 * (1.0 - u - v) + n1 * u + n2 * v).normalize_or(ng);
        if n.dot(ng) < 0.0 { -n } else { n }
    };
    let (uv, mut dpdu) = if m.uvs.is_empty() {
        (Vec2::new(u, v), e1.as_vec3())
    } else {
        let [t0, t1, t2] = corner.map(|i| m.uvs[i]);
        let (d1, d2) = ((t1 - t0).as_dvec2(), (t2 - t0).as_dvec2());
        let det = d1.x * d2.y - d1.y * d2.x;
        let dpdu = ((e1 * d2.y - e2 * d1.y) / det).as_vec3();
        let usable = dpdu.is_finite() && dpdu != Vec3::ZERO;
        (
            t0 * (1.0 - u - v) + t1 * u + t2 * v,
            if usable {
                dpdu
            } else {
                ng.any_orthonormal_vector()
            },
        )
    };
    if !m.tangents.is_empty() {
        let along = mixed(corner.map(|i| m.tangents[i]), u, v);
        let along = Vec3::new(along[0], along[1], along[2]);
        // Without a part in the tangent plane it says nothing.
        if along.cross(ns).length_squared() > 1e-12 * along.length_squared() {
            dpdu = along;
        }
    }
    let color = if m.colors.is_empty() {
        WHITE
    } else {
        mixed(corner.map(|i| m.colors[i]), u, v)
    };
    SurfacePoint {
        p,
        p_error,
        ng,
        ns,
        uv,
        dpdu,
        color,
        shape: hit.shape,
        prim: hit.prim,
    }
}

/// Values at the corners of a triangle, interpolated.
pub fn mixed([a, b, c]: [[f32; 4]; 3], u: f32, v: f32) -> [f32; 4] {
    [0, 1, 2, 3].map(|i| a[i] * (1.0 - u - v) + b[i] * u + c[i] * v)
}

/// What shapes without colours have.
const WHITE: [f32; 4] = [1.0; 4];

#[inline(always)]
fn quad(q: &Quad, hit: &Hit, ray: &Ray, facet: &Facet, further: f64) -> SurfacePoint {
    let ((p, p_error), ng) = (facet.point(hit, further), facet.normal(ray));
    let (u, v) = (hit.u, hit.v);
    // Half 0 is corner + u·edge_u + v·(edge_u + edge_v), half 1 is corner + u·(edge_u + edge_v) + v·edge_v.
    let uv = if hit.prim == 0 {
        Vec2::new(u + v, v)
    } else {
        Vec2::new(u, u + v)
    };
    SurfacePoint {
        p,
        p_error,
        ng,
        ns: ng,
        uv,
        dpdu: q.edge_u,
        color: WHITE,
        shape: hit.shape,
        prim: hit.prim,
    }
}

fn sphere(s: &Sphere, hit: &Hit, ray: &Ray) -> SurfacePoint {
    let center = s.center.as_dvec3();
    let r = f64::from(s.radius);
    let local = ray.o.as_dvec3() + ray.d.as_dvec3() * f64::from(hit.t) - center;
    // t is an f32: what it is off along the ray is taken back by projecting onto the sphere.
    let n = local.try_normalize().unwrap_or(DVec3::Z);
    let (p, p_error) = rounded(center + n * r);
    let ng = n.as_vec3();
    let phi = ng.y.atan2(ng.x);
    let phi = if phi < 0.0 { phi + TAU } else { phi };
    let uv = Vec2::new(phi / TAU, ng.z.clamp(-1.0, 1.0).acos() / PI);
    let along = Vec3::new(-ng.y, ng.x, 0.0) * (TAU * s.radius);
    let dpdu = if along == Vec3::ZERO {
        Vec3::Y * s.radius
    } else {
        along
    };
    SurfacePoint {
        p,
        p_error,
        ng,
        ns: ng,
        uv,
        dpdu,
        color: WHITE,
        shape: hit.shape,
        prim: hit.prim,
    }
}

fn disk(s: &Disk, hit: &Hit, ray: &Ray) -> SurfacePoint {
    let center = s.center.as_dvec3();
    let n = s.normal.as_dvec3().normalize_or_zero();
    let local = ray.o.as_dvec3() + ray.d.as_dvec3() * f64::from(hit.t) - center;
    // What the f32 t is off along the ray is taken back: into the plane, and not beyond the rim.
    let local = (local - n * n.dot(local)).clamp_length_max(f64::from(s.radius));
    let (p, p_error) = rounded(center + local);
    let x = n.any_orthonormal_vector();
    let r = f64::from(s.radius);
    let uv = Vec2::new(
        (x.dot(local) / r) as f32,
        (n.cross(x).dot(local) / r) as f32,
    );
    SurfacePoint {
        p,
        p_error,
        ng: s.normal,
        ns: s.normal,
        uv: (uv * 0.5 + 0.5).clamp(Vec2::ZERO, Vec2::ONE),
        dpdu: x.as_vec3() * (2.0 * s.radius),
        color: WHITE,
        shape: hit.shape,
        prim: hit.prim,
    }
}

fn cylinder(c: &Cylinder, hit: &Hit, ray: &Ray) -> SurfacePoint {
    let (base, axis) = (c.base.as_dvec3(), c.axis.as_dvec3());
    let length = axis.length();
    let axis = axis / length;
    // An f32 distance to a thin cylinder far away may be off by more than its radius: find it again.
    let t = Tube::new(c)
        .solve(ray.o, ray.d, ray.t_min, ray.t_max)
        .unwrap_or(f64::from(hit.t));
    let local = ray.o.as_dvec3() + ray.d.as_dvec3() * t - base;
    let height = axis.dot(local).clamp(0.0, length);
    let x = axis.any_orthonormal_vector();
    let n = (local - axis * axis.dot(local))
        .try_normalize()
        .unwrap_or(x);
    let (p, p_error) = rounded(base + axis * height + n * f64::from(c.radius));
    let phi = axis.cross(x).dot(n).atan2(x.dot(n)) as f32;
    let phi = if phi < 0.0 { phi + TAU } else { phi };
    let ng = n.as_vec3();
    SurfacePoint {
        p,
        p_error,
        ng,
        ns: ng,
        uv: Vec2::new(phi / TAU, (height / length) as f32),
        dpdu: axis.cross(n).as_vec3() * (TAU * c.radius),
        color: WHITE,
        shape: hit.shape,
        prim: hit.prim,
    }
}

/// Moves the origin of a ray that leaves the surface at `p` to direction `w` off the surface, to the side of `w`: along ±`ng`
/// far enough that the new origin lies beyond the true surface whatever the rounding of `p` was, then one float further along
/// each axis against the rounding of the move itself (pbrt §6.8.6).
#[inline]
pub fn offset_origin(p: Vec3, p_error: Vec3, ng: Vec3, w: Vec3) -> Vec3 {
    let distance = ng.abs().dot(p_error);
    let offset = ng * if w.dot(ng) < 0.0 { -distance } else { distance };
    let moved = p + offset;
    Vec3::new(
        one_float(moved.x, offset.x),
        one_float(moved.y, offset.y),
        one_float(moved.z, offset.z),
    )
}

/// The float next to `x`, which is finite, on the side of the sign of `towards`; `x` itself if that is 0.
///
/// The signs of normals and positions are as good as random, so that branches on them cost more than all of this: bits of floats
/// are ordered like their magnitudes, which grow by one step if the signs agree.
#[inline(always)]
fn one_float(x: f32, towards: f32) -> f32 {
    let (bits, side) = (x.to_bits(), towards.to_bits());
    let step = 1u32.wrapping_sub((bits ^ side) >> 31 << 1);
    let next = f32::from_bits(bits.wrapping_add(step));
    let next = if x == 0.0 {
        f32::from_bits(1).copysign(towards)
    } else {
        next
    };
    if towards == 0.0 { x } else { next }
}

impl SurfacePoint {
    /// [`offset_origin`] of this point.
    #[inline]
    pub fn offset(&self, w: Vec3) -> Vec3 {
        offset_origin(self.p, self.p_error, self.ng, w)
    }

    /// The ray that leaves this point in direction `w`.
    pub fn spawn(&self, w: Vec3) -> Ray {
        Ray::new(self.offset(w), w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_float_is_the_next_one() {
        let mut stream = resolvent_api::rng::Stream::new(3);
        let mut values = vec![0.0, -0.0, 1.0, -1.0, f32::MIN_POSITIVE, 1e-45, -1e-45, 3e18];
        values.extend((0..1000).map(|_| f32::from_bits(stream.bits() as u32 & 0xbf7f_ffff)));
        for x in values {
            assert_eq!(one_float(x, 1e-30), x.next_up(), "{x:e}");
            assert_eq!(one_float(x, -2.0), x.next_down(), "{x:e}");
            assert_eq!(one_float(x, -0.0), x, "{x:e}");
        }
    }
}

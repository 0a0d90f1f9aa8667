//! One copy of a prototype: how rays get into its space and surface points out of it.
//!
//! A place keeps its object-to-world transform in f32, rounded once and exact from then on, and the inverse of that in f64.
//! A ray is transformed in f64 and rounded to f32, so that all triangles of a copy meet the same ray: a copy is as watertight as
//! its prototype. (Two copies that share an edge are rounded apart: they need not be.) What rounding moves a ray's origin and
//! a hit's position by is in [`SurfacePoint::p_error`] (pbrt §6.8.5, "Error bounds for transformations").

use glam::{DVec3, Vec3};
use resolvent_api::Affine;

use super::bvh8::{Bounds, Node8};
use super::input::{Geometry, GeometryError};
use super::ray::{Hit, MAX_COORDINATE, Ray};
use super::surface::SurfacePoint;

/// A copy of a prototype.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index of the prototype.
    pub prototype: u32,
    /// The prototype's space to world: any affine transform that can be inverted, mirrors included. Rounded to f32.
    pub to_world: Affine,
}

/// Unit roundoff of f32, and a trace for the f64 operations before.
const ROUND: f64 = 1.001 / 16_777_216.0;

/// Margin of world boxes in units of [`ROUND`]: origins that were moved off a surface stay inside the box, and the rounding of
/// the transformed origin does not matter to them.
const MARGIN: f64 = 8.0;

/// An instance ready for rays: 124 bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Rows of the inverse of the linear part.
    inverse: [[f64; 3]; 3],
    /// Rows of the linear part.
    linear: [[f32; 3]; 3],
    translation: [f32; 3],
    pub prototype: u32,
}

fn rows(m: &Affine) -> [[f64; 3]; 3] {
    m.to_rows().map(|[a, b, c, _]| [a, b, c])
}

fn times(m: &[[f64; 3]; 3], v: DVec3) -> DVec3 {
    let row = |r: [f64; 3]| r[0] * v.x + r[1] * v.y + r[2] * v.z;
    DVec3::new(row(m[0]), row(m[1]), row(m[2]))
}

impl Place {
    /// `number` is the instance's, for errors.
    pub fn new(instance: &Instance, number: usize) -> Result<Self, GeometryError> {
        let linear = rows(&instance.to_world).map(|r| r.map(|x| x as f32));
        let translation = instance.to_world.translation.as_vec3();
        let column = |j: usize| DVec3::from([0, 1, 2].map(|i: usize| f64::from(linear[i][j])));
        let rounded = Affine {
            columns: [column(0), column(1), column(2)],
            translation: translation.as_dvec3(),
        };
        let fits = |m: &Affine| {
            let size = m.columns.map(|c| c.abs().max_element());
            // Directions must stay directions for the triangle test; see `RaySetup::new`.
            size.iter().all(|s| (1e-18..=1e18).contains(s))
        };
        match rounded.inverse() {
            Some(inverse) if fits(&rounded) && fits(&inverse) && translation.is_finite() => {
                Ok(Self {
                    inverse: rows(&inverse),
                    linear,
                    translation: translation.to_array(),
                    prototype: instance.prototype,
                })
            }
            _ => Err(GeometryError::Instance { instance: number }),
        }
    }

    fn linear(&self) -> [[f64; 3]; 3] {
        self.linear.map(|r| r.map(f64::from))
    }

    fn translation(&self) -> DVec3 {
        Vec3::from_array(self.translation).as_dvec3()
    }

    /// True if the transform turns right hands into left ones.
    pub fn mirrors(&self) -> bool {
        let [a, b, c] = self.linear().map(DVec3::from);
        a.cross(b).dot(c) < 0.0
    }

    /// What a rounding of `size` in object space is in the world.
    fn outward(&self, size: DVec3) -> DVec3 {
        times(&self.linear.map(|r| r.map(|x| f64::from(x.abs()))), size)
    }

    /// The ray in the prototype's space, from its point at `start` on.
    #[inline(always)]
    pub fn ray(&self, ray: &Ray, start: f32) -> Ray {
        let d = ray.d.as_dvec3();
        let o = ray.o.as_dvec3() - self.translation() + d * f64::from(start);
        Ray {
            o: times(&self.inverse, o).as_vec3(),
            d: times(&self.inverse, d).as_vec3(),
            t_min: ray.t_min - start,
            t_max: ray.t_max - start,
        }
    }

    /// A box around the copy of everything below `root`, wide enough for what rounding does to rays.
    pub fn bounds(&self, root: &Node8, number: usize) -> Result<Bounds, GeometryError> {
        let (linear, t) = (self.linear(), self.translation());
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut reach = DVec3::ZERO;
        for lane in 0..8 {
            let side = |face: usize| {
                DVec3::from(
                    [0, 1, 2].map(|axis: usize| f64::from(root.bounds[2 * axis + face][lane])),
                )
            };
            let (min, max) = (side(0), side(1));
            if min.x > max.x {
                continue;
            }
            // The box of a box: centre and half diagonal (Arvo 1990, "Transforming Axis-Aligned Bounding Boxes").
            let middle = times(&linear, 0.5 * (min + max)) + t;
            let half = self.outward(0.5 * (max - min));
            (lo, hi) = (lo.min(middle - half), hi.max(middle + half));
            reach = reach.max(min.abs()).max(max.abs());
        }
        let pad = MARGIN * ROUND * (self.outward(reach) + lo.abs().max(hi.abs()));
        let (lo, hi) = ((lo - pad).as_vec3(), (hi + pad).as_vec3());
        if lo.abs().max(hi.abs()).max_element() <= MAX_COORDINATE {
            Ok(Bounds {
                min: lo.to_array().map(f32::next_down),
                max: hi.to_array().map(f32::next_up),
            })
        } else {
            Err(GeometryError::Instance { instance: number })
        }
    }

    /// The surface at a `hit` on this copy; its `shape` counts the shapes of the prototype, whose geometry is `geometry` and whose size
    /// is at most `size`.
    pub fn interaction(
        &self,
        geometry: &Geometry,
        size: f64,
        hit: &Hit,
        ray: &Ray,
    ) -> SurfacePoint {
        // From before the prototype, but not from farther away than needed.
        let speed = times(&self.inverse, ray.d.as_dvec3()).length();
        let start = ((f64::from(hit.t) - 1.1 * size / speed) as f32).max(0.0);
        let object = self.ray(ray, start);
        let local = Hit {
            t: hit.t - start,
            ..*hit
        };
        // The errors below, as the prototype sees them.
        let met = ray.o.as_dvec3() - self.translation() + ray.d.as_dvec3() * f64::from(hit.t);
        let inside = times(&self.inverse, met).abs();
        let error = 2.0 * self.outward(inside) + (met + self.translation()).abs();
        let further = times(&self.inverse.map(|r| r.map(f64::abs)), ROUND * error);
        let at = geometry.interaction_apart(&local, &object, further.element_sum());
        let exact = at.p.as_dvec3();
        let p = times(&self.linear(), exact) + self.translation();
        // The position's own error, and that of the next ray's origin when it comes back.
        let error = self.outward(at.p_error.as_dvec3() + ROUND * exact.abs()) + ROUND * p.abs();
        let ng = self.normal(flat_normal(geometry, hit).unwrap_or(at.ng.as_dvec3()));
        let ns = self.normal(at.ns.as_dvec3());
        SurfacePoint {
            p: p.as_vec3(),
            p_error: error.as_vec3().max(Vec3::splat(f32::MIN_POSITIVE)),
            ng,
            ns: if at.ns == at.ng {
                ng
            } else if ns.dot(ng) < 0.0 {
                -ns
            } else {
                ns
            },
            dpdu: times(&self.linear(), at.dpdu.as_dvec3()).as_vec3(),
            ..at
        }
    }

    /// Normals go with the inverse transpose; so the outer side stays the outer one when a transform mirrors.
    fn normal(&self, n: DVec3) -> Vec3 {
        let m = &self.inverse;
        let column = |j: usize| m[0][j] * n.x + m[1][j] * n.y + m[2][j] * n.z;
        let n = DVec3::new(column(0), column(1), column(2));
        // Scaled first: entries reach from 1e-18 to 1e18.
        (n / n.abs().max_element()).normalize_or(DVec3::Z).as_vec3()
    }

    /// Bound on the rounding error, along each world axis, of the end of a segment with world vector `d` at the world point
    /// `p` of this copy: of the transformed origin and direction, which lie apart from the exact ones by their own roundings.
    pub fn end_error(&self, p: Vec3, d: Vec3) -> Vec3 {
        let back = |v: DVec3| times(&self.inverse.map(|r| r.map(f64::abs)), v.abs());
        let size = back(p.as_dvec3() - self.translation()) + 4.0 * back(d.as_dvec3());
        (ROUND * self.outward(size)).as_vec3()
    }
}

/// Normal of the triangle hit, in f64: a transform that stretches multiplies the error of a rounded one. `None` if it has none.
fn flat_normal(geometry: &Geometry, hit: &Hit) -> Option<DVec3> {
    let [a, b, c] = geometry.shapes[hit.shape as usize]
        .triangle(hit.prim)?
        .map(|v| v.as_dvec3());
    (b - a).cross(c - a).try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a million instances cost: the limit for one, nodes included, is 200 bytes.
    #[test]
    fn size() {
        assert!(size_of::<Place>() <= 128, "{}", size_of::<Place>());
    }
}

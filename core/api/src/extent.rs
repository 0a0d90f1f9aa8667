//! The extent of a medium that stands free in the scene: a box or an ellipsoid, clipped in double precision.
//!
//! Media that share these parameters read them here, so that `bounds`, `center` and `radius` mean the same everywhere:
//! list [`Extent::BOUNDS`], [`Extent::CENTER`] and [`Extent::RADIUS`] among the declarations and call [`Extent::from_params`].

use crate::abi::ParamDecl;
use crate::math::{Aabb, Affine, DVec3};
use crate::operator::Segment;
use crate::params::{Decl, Error, Params};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    All,
    Box,
    Ball,
}

/// Where a medium is.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    kind: Kind,
    /// World to the coordinates in which the box is [−1, 1]³ and the ball has radius 1.
    to_unit: Affine,
    bounds: Aabb,
    center: DVec3,
    half: DVec3,
}

impl Extent {
    /// Declaration of `bounds`.
    pub const BOUNDS: ParamDecl = Decl::numbers(
        "bounds",
        "box in object space: min x, y, z, max x, y, z; excludes center and radius",
    )
    .unit("length")
    .build();
    /// Declaration of `center`.
    pub const CENTER: ParamDecl = Decl::vec3(
        "center",
        "centre of a sphere in object space (0 unless given)",
    )
    .unit("length")
    .build();
    /// Declaration of `radius`.
    pub const RADIUS: ParamDecl = Decl::float(
        "radius",
        "radius of a sphere in object space; excludes bounds",
    )
    .unit("length")
    .at_least(0.0)
    .build();

    /// Everywhere: the interior of whatever mesh holds the medium.
    pub const ALL: Self = Self {
        kind: Kind::All,
        to_unit: Affine::IDENTITY,
        bounds: Aabb::ALL,
        center: DVec3::ZERO,
        half: DVec3::INFINITY,
    };

    /// The extent that the parameters describe; [`Extent::ALL`] if there is none among them, `None` if it has no volume.
    ///
    /// # Errors
    /// If a box and a sphere are given, a box has not six numbers or a minimum above its maximum, a centre lacks its radius,
    /// or the transform can't be inverted.
    pub fn from_params(params: &Params<'_>) -> Result<Option<Self>, Error> {
        let (bounds, center) = (params.numbers("bounds"), params.vec3("center"));
        let radius = params.float("radius").ok();
        match (bounds, center, radius) {
            (None, None, None) => Ok(Some(Self::ALL)),
            (Some(b), None, None) => {
                let &[x0, y0, z0, x1, y1, z1] = b else {
                    return Err(Error::new(format!(
                        "'bounds' needs 6 numbers (min x, y, z, max x, y, z), not {}",
                        b.len()
                    )));
                };
                let (min, max) = (DVec3::new(x0, y0, z0), DVec3::new(x1, y1, z1));
                if !min.cmple(max).all() {
                    return Err(Error::new(format!(
                        "'bounds' has a minimum above its maximum: {min} to {max}"
                    )));
                }
                Self::place(Kind::Box, &params.to_world(), min, max)
            }
            (None, center, Some(r)) => {
                let c = center.unwrap_or(DVec3::ZERO);
                Self::place(Kind::Ball, &params.to_world(), c - r, c + r)
            }
            (None, Some(_), None) => Err(Error::new("'center' needs a 'radius'")),
            _ => Err(Error::new(
                "give either 'bounds' (a box) or 'center' and 'radius' (a sphere), not both",
            )),
        }
    }

    /// The box with corners `min`, `max` in object space; `None` if it has no volume.
    ///
    /// # Errors
    /// If the transform can't be inverted.
    pub fn cuboid(to_world: &Affine, min: DVec3, max: DVec3) -> Result<Option<Self>, Error> {
        Self::place(Kind::Box, to_world, min, max)
    }

    fn place(kind: Kind, to_world: &Affine, min: DVec3, max: DVec3) -> Result<Option<Self>, Error> {
        let half = 0.5 * (max - min);
        let object = Affine {
            columns: [DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z],
            translation: min + half,
        };
        if to_world.inverse().is_none() {
            return Err(Error::new(
                "the transform squeezes space flat and can't be inverted",
            ));
        }
        if !(half.min_element() > 0.0) {
            return Ok(None);
        }
        let to = to_world.after(&object);
        let Some(to_unit) = to.inverse() else {
            return Err(Error::new(format!(
                "the extent {min} to {max} is too thin or too far away to be placed"
            )));
        };
        let bounds = match kind {
            Kind::Ball => {
                // An ellipsoid reaches as far along an axis as that row of the matrix is long.
                let [a, b, c] = to.columns;
                let reach = DVec3::new(
                    DVec3::new(a.x, b.x, c.x).length(),
                    DVec3::new(a.y, b.y, c.y).length(),
                    DVec3::new(a.z, b.z, c.z).length(),
                );
                Affine::IDENTITY.bounds(to.translation - reach, to.translation + reach)
            }
            _ => to.bounds(-DVec3::ONE, DVec3::ONE),
        };
        Ok(Some(Self {
            kind,
            to_unit,
            bounds,
            center: object.translation,
            half,
        }))
    }

    /// World bounds, rounded outward.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// True if there is no boundary.
    pub fn is_all(&self) -> bool {
        self.kind == Kind::All
    }

    /// True for spheres and what transforms make of them.
    pub fn is_ball(&self) -> bool {
        self.kind == Kind::Ball
    }

    /// Centre and half the size along each axis, in object space; infinite if there is no boundary.
    pub fn object_box(&self) -> (DVec3, DVec3) {
        (self.center, self.half)
    }

    /// World to the coordinates in which the extent is [−1, 1]³ or the unit ball.
    pub fn to_unit(&self) -> &Affine {
        &self.to_unit
    }

    /// True if the world position `p` is inside or on the boundary.
    pub fn contains(&self, p: DVec3) -> bool {
        let q = self.to_unit.point(p);
        match self.kind {
            Kind::All => true,
            Kind::Box => q.abs().max_element() <= 1.0,
            Kind::Ball => q.length_squared() <= 1.0,
        }
    }

    /// The part of the segment inside, in the segment's own `t`, or `None`.
    ///
    /// In `f64`, because an optical depth of 80 turns a relative error of 10⁻⁷ in the length into one of 10⁻⁵ in the
    /// transmittance.
    #[inline]
    pub fn clip(&self, s: &Segment) -> Option<(f64, f64)> {
        let (mut near, mut far) = (f64::from(s.t0), f64::from(s.t1));
        if self.kind != Kind::All {
            let o = self.to_unit.point(dvec(s.o));
            let d = self.to_unit.vector(dvec(s.d));
            if self.kind == Kind::Box {
                for i in 0..3 {
                    if d[i] == 0.0 {
                        // Half open, so that of two boxes sharing a face one has the ray that runs in it.
                        if !(-1.0..1.0).contains(&o[i]) {
                            return None;
                        }
                        continue;
                    }
                    let inverse = 1.0 / d[i];
                    let (a, b) = ((-1.0 - o[i]) * inverse, (1.0 - o[i]) * inverse);
                    near = near.max(a.min(b));
                    far = far.min(a.max(b));
                }
            } else {
                // The point closest to the centre first: from far away b² − 4ac would be a difference of huge numbers.
                let dd = d.length_squared();
                let middle = -o.dot(d) / dd;
                let clear = 1.0 - (o + middle * d).length_squared();
                if !(clear > 0.0) {
                    return None;
                }
                let half = (clear / dd).sqrt();
                near = near.max(middle - half);
                far = far.min(middle + half);
            }
        }
        (near < far).then_some((near, far))
    }
}

#[inline(always)]
fn dvec(v: [f32; 3]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(o: [f32; 3], d: [f32; 3]) -> Segment {
        Segment {
            o,
            t0: 0.0,
            d,
            t1: f32::INFINITY,
        }
    }

    fn skewed() -> Affine {
        Affine::from_rows([
            [2.0, 0.5, 0.0, 1e6],
            [-0.5, 1.0, 0.25, -3.0],
            [0.0, 0.0, 4.0, 7.0],
        ])
    }

    #[test]
    fn a_box_far_away_keeps_its_thickness() {
        let to_world = Affine::from_translation(DVec3::new(1e6, 0.0, 0.0));
        let e = Extent::cuboid(&to_world, DVec3::ZERO, DVec3::splat(0.1)).unwrap();
        let (a, b) = e
            .unwrap()
            .clip(&segment([1e6, 0.05, -3.0], [0.0, 0.0, 1.0]))
            .unwrap();
        assert!((a - 3.0).abs() < 1e-12 && (b - a - 0.1).abs() < 1e-12);
    }

    #[test]
    fn ellipsoid_ends_lie_on_the_boundary_and_in_the_bounds() {
        let (min, max) = (DVec3::new(-1.0, -2.0, -3.0), DVec3::new(3.0, 2.0, 1.0));
        let e = Extent::place(Kind::Ball, &skewed(), min, max)
            .unwrap()
            .unwrap();
        let s = segment([1_000_000.0, -9.0, 2.0], [0.1, 0.99, 0.1]);
        let (a, b) = e.clip(&s).unwrap();
        for t in [a, b] {
            let p = dvec(s.o) + t * dvec(s.d);
            assert!((e.to_unit.point(p).length() - 1.0).abs() < 1e-9);
            assert!(e.bounds.contains(p.as_vec3()));
        }
        assert!(!e.contains(dvec(s.o) + (a - 1e-3) * dvec(s.d)));
        assert!(e.contains(dvec(s.o) + 0.5 * (a + b) * dvec(s.d)));
    }

    #[test]
    fn a_ray_in_the_shared_face_belongs_to_one_box() {
        let id = Affine::IDENTITY;
        let left = Extent::cuboid(&id, DVec3::ZERO, DVec3::ONE)
            .unwrap()
            .unwrap();
        let right = Extent::cuboid(&id, DVec3::X, DVec3::new(2.0, 1.0, 1.0))
            .unwrap()
            .unwrap();
        let s = segment([1.0, 0.5, -1.0], [0.0, -0.0, 1.0]);
        assert!(left.clip(&s).is_some() != right.clip(&s).is_some());
    }

    #[test]
    fn no_volume_is_nothing_and_a_flat_transform_an_error() {
        let flat = DVec3::new(1.0, 1.0, 0.0);
        assert!(
            Extent::cuboid(&Affine::IDENTITY, DVec3::ZERO, flat)
                .unwrap()
                .is_none()
        );
        let mut singular = skewed();
        singular.columns[1] = 2.0 * singular.columns[0];
        assert!(Extent::cuboid(&singular, DVec3::ZERO, DVec3::ONE).is_err());
    }
}

//! Affine transforms in double precision; scenes are placed with them before anything is rounded to `f32`.

use super::{Aabb, DVec3, Vec3};

/// A point transform x ↦ A x + b, acting on column vectors, kept in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Affine {
    /// Columns of the linear part A.
    pub columns: [DVec3; 3],
    /// Translation b.
    pub translation: DVec3,
}

impl Affine {
    /// x ↦ x.
    pub const IDENTITY: Self = Self {
        columns: [DVec3::X, DVec3::Y, DVec3::Z],
        translation: DVec3::ZERO,
    };

    /// From three rows of four (`rows[i] = [a_i0, a_i1, a_i2, b_i]`).
    pub fn from_rows(rows: [[f64; 4]; 3]) -> Self {
        let column = |j: usize| DVec3::new(rows[0][j], rows[1][j], rows[2][j]);
        Self {
            columns: [column(0), column(1), column(2)],
            translation: column(3),
        }
    }

    /// The inverse of [`Affine::from_rows`].
    pub fn to_rows(&self) -> [[f64; 4]; 3] {
        let row = |i: usize| {
            [
                self.columns[0][i],
                self.columns[1][i],
                self.columns[2][i],
                self.translation[i],
            ]
        };
        [row(0), row(1), row(2)]
    }

    /// A translation by `t`.
    pub fn from_translation(t: DVec3) -> Self {
        Self {
            translation: t,
            ..Self::IDENTITY
        }
    }

    /// `self` after `first`: x ↦ self(first(x)).
    pub fn after(&self, first: &Self) -> Self {
        Self {
            columns: first.columns.map(|c| self.vector(c)),
            translation: self.point(first.translation),
        }
    }

    /// Transforms a point.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.vector(p) + self.translation
    }

    /// Transforms a direction (no translation).
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.columns[0] * v.x + self.columns[1] * v.y + self.columns[2] * v.z
    }

    /// Determinant of the linear part.
    pub fn determinant(&self) -> f64 {
        self.columns[0].dot(self.columns[1].cross(self.columns[2]))
    }

    /// The inverse, or `None` if the transform is singular or not finite.
    ///
    /// Singular is judged relative to the columns' lengths, so that tiny and huge scales are fine.
    pub fn inverse(&self) -> Option<Self> {
        let [a, b, c] = self.columns;
        let volume = a.length() * b.length() * c.length();
        let det = self.determinant();
        let good = det.is_finite() && self.translation.is_finite() && det.abs() > 1e-12 * volume;
        if !good {
            return None;
        }
        let (r0, r1, r2) = (b.cross(c) / det, c.cross(a) / det, a.cross(b) / det);
        let columns = [
            DVec3::new(r0.x, r1.x, r2.x),
            DVec3::new(r0.y, r1.y, r2.y),
            DVec3::new(r0.z, r1.z, r2.z),
        ];
        let linear = Self {
            columns,
            translation: DVec3::ZERO,
        };
        Some(Self {
            translation: -linear.vector(self.translation),
            ..linear
        })
    }

    /// The box around the image of the box with corners `min`, `max`, rounded outward to `f32`.
    pub fn bounds(&self, min: DVec3, max: DVec3) -> Aabb {
        let mut lo = DVec3::INFINITY;
        let mut hi = DVec3::NEG_INFINITY;
        for corner in 0..8 {
            let pick = |i: usize| if corner >> i & 1 == 0 { min[i] } else { max[i] };
            let p = self.point(DVec3::new(pick(0), pick(1), pick(2)));
            lo = lo.min(p);
            hi = hi.max(p);
        }
        // One ulp outward covers the rounding of the conversion.
        let down = |v: f64| (v as f32).next_down();
        let up = |v: f64| (v as f32).next_up();
        Aabb {
            min: [down(lo.x), down(lo.y), down(lo.z)],
            max: [up(hi.x), up(hi.y), up(hi.z)],
        }
    }

    /// Columns and translation rounded to `f32`.
    pub fn to_f32(&self) -> ([Vec3; 3], Vec3) {
        (
            self.columns.map(|c| c.as_vec3()),
            self.translation.as_vec3(),
        )
    }
}

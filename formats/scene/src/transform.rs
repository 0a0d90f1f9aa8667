//! Affine transforms as scene files write them.

use crate::describe::Vec3;

/// A 4×4 matrix, row by row, that acts on column vectors: the translation is in the last column, the
/// last row is `[0, 0, 0, 1]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transform(pub [[f64; 4]; 4]);

impl Default for Transform {
    fn default() -> Transform {
        Transform::IDENTITY
    }
}

impl Transform {
    /// Changes nothing.
    pub const IDENTITY: Transform = Transform([
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);

    /// Moves by `t`.
    pub fn translate(t: Vec3) -> Transform {
        let mut m = Transform::IDENTITY;
        for (row, x) in m.0.iter_mut().zip(t) {
            row[3] = x;
        }
        m
    }

    /// Scales each axis.
    pub fn scale(s: Vec3) -> Transform {
        let mut m = Transform::IDENTITY;
        for (i, x) in s.into_iter().enumerate() {
            m.0[i][i] = x;
        }
        m
    }

    /// Turns around an axis through the origin, right-handed (Rodrigues' formula). The axis need not be
    /// normalised but must not be zero.
    pub fn rotate_deg(axis: Vec3, angle: f64) -> Transform {
        let [x, y, z] = normalize(axis);
        // Whole quarter turns are exact, which degrees promise and radians cannot keep.
        let (s, c) = match angle.rem_euclid(360.0) {
            0.0 => (0.0, 1.0),
            90.0 => (1.0, 0.0),
            180.0 => (0.0, -1.0),
            270.0 => (-1.0, 0.0),
            a => a.to_radians().sin_cos(),
        };
        let k = 1.0 - c;
        Transform([
            [c + x * x * k, x * y * k - z * s, x * z * k + y * s, 0.0],
            [y * x * k + z * s, c + y * y * k, y * z * k - x * s, 0.0],
            [z * x * k - y * s, z * y * k + x * s, c + z * z * k, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ])
    }

    /// A camera at `origin` that looks along −z towards `target`, with y up and x to the right.
    pub fn look_at(origin: Vec3, target: Vec3, up: Vec3) -> Transform {
        let z = normalize(sub(origin, target));
        let x = normalize(cross(normalize(up), z));
        let y = cross(z, x);
        let row = |i: usize| [x[i], y[i], z[i], origin[i]];
        Transform([row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]])
    }

    /// First `self`, then `next`: the matrix product next · self.
    pub fn then(&self, next: &Transform) -> Transform {
        let mut m = [[0.0; 4]; 4];
        for (i, row) in m.iter_mut().enumerate() {
            for (j, x) in row.iter_mut().enumerate() {
                *x = (0..4).map(|k| next.0[i][k] * self.0[k][j]).sum();
            }
        }
        Transform(m)
    }

    /// A point, moved by the transform.
    pub fn point(&self, p: Vec3) -> Vec3 {
        std::array::from_fn(|i| self.vector(p)[i] + self.0[i][3])
    }

    /// A direction or a difference of points: the translation does not apply.
    pub fn vector(&self, v: Vec3) -> Vec3 {
        std::array::from_fn(|i| (0..3).map(|j| self.0[i][j] * v[j]).sum())
    }

    /// Determinant of the linear part: the factor on volumes, negative for a reflection.
    pub fn determinant(&self) -> f64 {
        let [a, b, c] = self.linear();
        dot(a, cross(b, c))
    }

    /// Rows of the linear part.
    fn linear(&self) -> [Vec3; 3] {
        std::array::from_fn(|i| [self.0[i][0], self.0[i][1], self.0[i][2]])
    }

    /// Why this is no transform that can be inverted, if it is none.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.0.iter().flatten().any(|x| !x.is_finite()) {
            return Some("a transform with numbers that are not finite".into());
        }
        if self.0[3] != [0.0, 0.0, 0.0, 1.0] {
            return Some(format!(
                "a matrix whose last row is {:?}, not [0, 0, 0, 1]",
                self.0[3]
            ));
        }
        // Hadamard: |det| is at most the product of the rows' lengths. A ratio near the rounding error
        // means that the rows are dependent, whatever the scale.
        let rows = self.linear();
        let size: f64 = rows.iter().map(|r| length(*r)).product();
        let det = self.determinant();
        if !det.is_normal() || det.abs() <= 1e-13 * size {
            return Some(format!(
                "a matrix that cannot be inverted (determinant {det:e})"
            ));
        }
        None
    }

    /// Why this is no rotation, if it is none. Rotations written with six digits are accepted.
    pub(crate) fn rotation_fault(&self, mirrors: bool) -> Option<String> {
        let rows = self.linear();
        for i in 0..3 {
            for j in 0..3 {
                if (dot(rows[i], rows[j]) - f64::from(u8::from(i == j))).abs() > 1e-5 {
                    return Some("a transform that scales or shears".into());
                }
            }
        }
        if !mirrors && self.determinant() < 0.0 {
            return Some("a reflection".into());
        }
        if (0..3).any(|i| self.0[i][3] != 0.0) {
            return Some("a translation".into());
        }
        None
    }
}

pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|i| a[i] - b[i])
}

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn length(v: Vec3) -> f64 {
    v[0].hypot(v[1]).hypot(v[2])
}

fn normalize(v: Vec3) -> Vec3 {
    let l = length(v);
    v.map(|x| x / l)
}

/// True if two directions span no plane, up to rounding: |a × b| ≤ 1e-9 |a| |b|.
pub(crate) fn parallel(a: Vec3, b: Vec3) -> bool {
    let (la, lb) = (length(a), length(b));
    let sine = length(cross(a.map(|x| x / la), b.map(|x| x / lb)));
    // A vector of length zero gives NaN, which spans no plane either.
    sine.is_nan() || sine <= 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Vec3, b: Vec3) {
        assert!(
            a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-12),
            "{a:?} {b:?}"
        );
    }

    #[test]
    fn operations_apply_in_order() {
        let t = Transform::rotate_deg([0.0, 0.0, 2.0], 90.0)
            .then(&Transform::translate([1.0, 2.0, 3.0]));
        close(t.point([1.0, 0.0, 0.0]), [1.0, 3.0, 3.0]);
        close(t.vector([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        let s = Transform::scale([2.0, 3.0, 4.0]);
        assert_eq!(s.determinant(), 24.0);
        close(s.then(&t).point([1.0, 1.0, 1.0]), [-2.0, 4.0, 7.0]);
    }

    #[test]
    fn a_camera_looks_along_minus_z() {
        let t = Transform::look_at([1.0, 2.0, 3.0], [1.0, 2.0, -7.0], [0.0, 5.0, 0.0]);
        close(t.vector([0.0, 0.0, -1.0]), [0.0, 0.0, -1.0]);
        close(t.vector([1.0, 0.0, 0.0]), [1.0, 0.0, 0.0]);
        close(t.point([0.0; 3]), [1.0, 2.0, 3.0]);
        let t = Transform::look_at([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        close(t.vector([0.0, 0.0, -1.0]), [1.0, 0.0, 0.0]);
        close(t.vector([1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]);
        assert!((t.determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn faults_are_found_at_any_scale() {
        assert!(Transform::scale([1e-30, 1e-30, 1e-30]).fault().is_none());
        assert!(Transform::scale([1e30, 1e-6, 1e30]).fault().is_none());
        assert!(Transform::scale([1.0, 0.0, 1.0]).fault().is_some());
        let mut m = Transform::IDENTITY;
        m.0[1] = [2.0, 0.0, 0.0, 0.0];
        assert!(m.fault().is_some());
        m.0[1] = [2.0, f64::NAN, 0.0, 0.0];
        assert!(m.fault().is_some());
    }

    #[test]
    fn rotations_are_told_from_the_rest() {
        assert!(
            Transform::rotate_deg([1.0, 2.0, -0.5], 33.0)
                .rotation_fault(false)
                .is_none()
        );
        assert!(
            Transform::scale([1.0, 1.0, 1.1])
                .rotation_fault(false)
                .is_some()
        );
        assert!(
            Transform::scale([1.0, 1.0, -1.0])
                .rotation_fault(false)
                .is_some()
        );
        assert!(
            Transform::translate([1.0, 0.0, 0.0])
                .rotation_fault(false)
                .is_some()
        );
    }
}

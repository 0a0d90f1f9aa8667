//! Axis-aligned boxes.

use super::{Float3, Vec3};
use bytemuck::{Pod, Zeroable};

/// An axis-aligned box; empty if any `min` exceeds its `max`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Aabb {
    /// Lower corner.
    pub min: Float3,
    /// Upper corner.
    pub max: Float3,
}

impl Aabb {
    /// Contains nothing.
    pub const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };
    /// Contains everything.
    pub const ALL: Self = Self {
        min: [f32::NEG_INFINITY; 3],
        max: [f32::INFINITY; 3],
    };

    /// The smallest box that holds both corners, whatever their order.
    pub fn new(a: Vec3, b: Vec3) -> Self {
        Self {
            min: a.min(b).into(),
            max: a.max(b).into(),
        }
    }

    /// True if nothing is inside.
    pub fn is_empty(&self) -> bool {
        (0..3).any(|i| !(self.min[i] <= self.max[i]))
    }

    /// Grown to hold `p`.
    pub fn including(self, p: Vec3) -> Self {
        Self {
            min: Vec3::from(self.min).min(p).into(),
            max: Vec3::from(self.max).max(p).into(),
        }
    }

    /// Smallest box around both.
    pub fn union(self, o: Self) -> Self {
        self.including(o.min.into()).including(o.max.into())
    }

    /// Centre; meaningless for an empty box.
    pub fn centre(&self) -> Vec3 {
        0.5 * (Vec3::from(self.min) + Vec3::from(self.max))
    }

    /// Edge lengths, zero for an empty box.
    pub fn extent(&self) -> Vec3 {
        (Vec3::from(self.max) - Vec3::from(self.min)).max(Vec3::ZERO)
    }

    /// True if `p` is inside or on the boundary.
    pub fn contains(&self, p: Vec3) -> bool {
        p.cmpge(self.min.into()).all() && p.cmple(self.max.into()).all()
    }

    /// The part of `t0..t1` where the ray `o + t d` is inside, or `None`.
    ///
    /// A ray that is parallel to two faces is inside them or not, wherever it starts; one that lies exactly in a face
    /// counts as inside.
    #[inline(always)]
    pub fn clip(&self, o: Vec3, d: Vec3, t0: f32, t1: f32) -> Option<(f32, f32)> {
        let inv = d.recip();
        let (mut near, mut far) = (t0, t1);
        for i in 0..3 {
            if d[i] == 0.0 {
                // 0·∞ below would be NaN for a ray in a face.
                if !(self.min[i] <= o[i] && o[i] <= self.max[i]) {
                    return None;
                }
                continue;
            }
            let a = (self.min[i] - o[i]) * inv[i];
            let b = (self.max[i] - o[i]) * inv[i];
            near = a.min(b).max(near);
            far = a.max(b).min(far);
        }
        (near < far).then_some((near, far))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_in_faces_and_beside_them() {
        let b = Aabb {
            min: [0.0; 3],
            max: [1.0, 2.0, 3.0],
        };
        for zero in [0.0, -0.0] {
            let along_x = Vec3::new(1.0, zero, zero);
            for y in [0.0, 1.0, 2.0] {
                let hit = b.clip(Vec3::new(-1.0, y, 3.0), along_x, 0.0, f32::INFINITY);
                assert_eq!(hit, Some((1.0, 2.0)), "y = {y}");
            }
            assert_eq!(
                b.clip(Vec3::new(-1.0, -1e-6, 1.0), along_x, 0.0, f32::INFINITY),
                None
            );
        }
        assert_eq!(
            b.clip(Vec3::splat(0.5), Vec3::NEG_Z, 0.0, 0.25),
            Some((0.0, 0.25))
        );
    }
}

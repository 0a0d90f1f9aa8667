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
    /// A direction component of ±0 gives ±∞ or NaN (0·∞ on a face); `min`/`max` drop the NaN, so a ray that lies
    /// exactly in a face counts as inside.
    #[inline(always)]
    pub fn clip(&self, o: Vec3, d: Vec3, t0: f32, t1: f32) -> Option<(f32, f32)> {
        let inv = d.recip();
        let (mut near, mut far) = (t0, t1);
        for i in 0..3 {
            let a = (self.min[i] - o[i]) * inv[i];
            let b = (self.max[i] - o[i]) * inv[i];
            // The order of the operands matters: `f32::max`/`min` return the other operand if one is NaN.
            near = a.min(b).max(near);
            far = a.max(b).min(far);
        }
        (near < far).then_some((near, far))
    }
}

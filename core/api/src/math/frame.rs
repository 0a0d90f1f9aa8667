//! Orthonormal frames.

use super::{Float3, Vec3};
use bytemuck::{Pod, Zeroable};

/// A right-handed orthonormal frame; `n` is the local z axis.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct Frame {
    /// Local x axis.
    pub s: Float3,
    /// Local y axis.
    pub t: Float3,
    /// Local z axis.
    pub n: Float3,
}

impl Frame {
    /// A frame around the unit vector `n` (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
    #[inline(always)]
    pub fn around(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: [1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x],
            t: [b, sign + n.y * n.y * a, -n.y],
            n: n.into(),
        }
    }

    /// From local to world coordinates.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        Vec3::from(self.s) * v.x + Vec3::from(self.t) * v.y + Vec3::from(self.n) * v.z
    }

    /// From world to local coordinates.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(
            Vec3::from(self.s).dot(v),
            Vec3::from(self.t).dot(v),
            Vec3::from(self.n).dot(v),
        )
    }
}

//! Phase functions: the trait of their plugins.

use crate::math::Float3;
use crate::operator::Scatter;
use bytemuck::{Pod, Zeroable};

/// A point in a medium, as a phase function sees it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct MediumPoint {
    /// Position.
    pub p: Float3,
    /// Lanes in use.
    pub lanes: u32,
}

/// A phase function plugin.
///
/// The closure is given world directions. Its value integrates to 1 over `wi`; with both directions pointing away from
/// the vertex, forward scattering has `wo·wi` = −1.
pub trait PhaseFunction: Send + Sync + 'static {
    /// K/σ_s at one point: at most [`CLOSURE_BYTES`](crate::closure::CLOSURE_BYTES) bytes, stored inline in the vertex. What doesn't fit, such as a table, stays in the
    /// instance and is borrowed: the host destroys an instance only after the last use of its closures.
    type Closure<'a>: Scatter + Copy + Send + Sync
    where
        Self: 'a;
    /// Resolves the phase function at a point.
    fn closure(&self, at: &MediumPoint) -> Self::Closure<'_>;
}

//! Surfaces: the trait of BSDF plugins.

use crate::math::{Float3, Frame};
use crate::operator::Scatter;
use bytemuck::{Pod, Zeroable};

/// A point on a surface, as a BSDF sees it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct SurfacePoint {
    /// Position.
    pub p: Float3,
    /// Geometric normal, unit.
    pub ng: Float3,
    /// Shading frame; `n` is the shading normal, `s` follows ∂p/∂u.
    pub frame: Frame,
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Lanes in use.
    pub lanes: u32,
    /// Zero.
    pub reserved: u32,
}

/// Facts about a BSDF; bits of [`Bsdf::traits`].
pub mod bsdf_traits {
    /// Passes all light unchanged: transport goes through it without a vertex.
    pub const NULL: u32 = 1;
    /// The same at every point.
    pub const UNIFORM: u32 = 2;
}

/// A BSDF plugin: textures are looked up once per vertex, the closure is what gets evaluated and sampled.
pub trait Bsdf: Send + Sync + 'static {
    /// K at one point: at most 240 bytes, stored inline in the vertex.
    type Closure: Scatter + Copy + Send + Sync + 'static;
    /// Bits of [`bsdf_traits`].
    fn traits(&self) -> u32;
    /// Resolves the BSDF at a point.
    fn closure(&self, at: &SurfacePoint) -> Self::Closure;
}

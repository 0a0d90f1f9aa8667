//! Surfaces: the trait of BSDF plugins.

use crate::math::{Float3, Frame};
use crate::operator::Scatter;
use bytemuck::{Pod, Zeroable};

/// A point on a surface, as a BSDF sees it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
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
    /// Index of refraction of what lies on the side that `ng` points to: 1 in vacuum, the outer medium's where dielectrics are
    /// nested.
    pub outside_ior: f32,
    /// Linear colour and opacity that the mesh has here; white where it has none. Textures ask for it. Since minor version 2.
    pub color: [f32; 4],
}

/// A point at the origin in vacuum, its normal along z.
impl Default for SurfacePoint {
    fn default() -> Self {
        let frame = Frame::around(crate::Vec3::Z);
        Self {
            p: [0.0; 3],
            ng: frame.n,
            frame,
            uv: [0.0; 2],
            lanes: 3,
            outside_ior: 1.0,
            color: [1.0; 4],
        }
    }
}

/// Facts about a BSDF; bits of [`Bsdf::traits`].
pub mod bsdf_traits {
    /// Passes all light unchanged: transport goes through it without a vertex.
    pub const NULL: u32 = 1;
    /// The same at every point.
    pub const UNIFORM: u32 = 2;
    /// f(wo, wi) ≠ η² f(wi, wo), on purpose: measured or artistic. Walks from lights and from the sensor see different
    /// materials then, so integrators that join them disagree with those that don't. Since minor version 2.
    pub const NON_RECIPROCAL: u32 = 4;
}

/// A BSDF plugin: textures are looked up once per vertex, the closure is what gets evaluated and sampled.
pub trait Bsdf: Send + Sync + 'static {
    /// K at one point: at most [`CLOSURE_BYTES`](crate::closure::CLOSURE_BYTES) bytes, stored inline in the vertex.
    type Closure: Scatter + Copy + Send + Sync + 'static;
    /// Bits of [`bsdf_traits`].
    fn traits(&self) -> u32;
    /// Index of refraction of what lies inside, on the side that the geometric normal points away from; 1 if light isn't
    /// refracted. The host nests dielectrics by it: what one closed surface reports here is the `outside_ior` of another
    /// inside it.
    fn ior(&self) -> f32 {
        1.0
    }
    /// Resolves the BSDF at a point.
    fn closure(&self, at: &SurfacePoint) -> Self::Closure;
}

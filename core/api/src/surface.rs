//! Surfaces: the trait of BSDF plugins.

use crate::math::{Float3, Frame, Vec3};
use crate::operator::Scatter;
use crate::slot::{Slot, Stored};
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
    /// Tangent space of normal maps: `n` is the shading normal before a normal map has turned it, `s` follows ∂p/∂u, and `t` is the
    /// direction of growing v, so that the three are left-handed where texture coordinates are mirrored. Filled in for BSDFs with
    /// the trait [`bsdf_traits::OWN_NORMALS`] only. Since minor version 3.
    pub tangent: Frame,
}

impl SurfacePoint {
    /// The normal that a normal map says, in world coordinates: red, green and blue of `texel` from 0 to 1 are its components from
    /// −1 to 1 in the space of [`tangent`](Self::tangent), the first two times `scale`. `None` if it has no direction.
    pub fn mapped_normal(&self, texel: [f32; 3], scale: f32) -> Option<Vec3> {
        mapped_normal(&self.tangent, self.ng.into(), texel, scale)
    }
}

/// Smallest cosine between a mapped normal and the geometric one: it stays on the outer side.
const LEAST_COSINE: f32 = 1e-3;

/// [`SurfacePoint::mapped_normal`] of a point with this tangent space and geometric normal. A normal that would point below the
/// surface is lifted until it points just above it.
pub fn mapped_normal(tangent: &Frame, ng: Vec3, texel: [f32; 3], scale: f32) -> Option<Vec3> {
    let [x, y, z] = texel.map(|c| 2.0 * c - 1.0);
    let n = tangent.to_world(Vec3::new(x * scale, y * scale, z));
    let length = n.length();
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
    let n = n / length;
    let below = LEAST_COSINE - n.dot(ng);
    Some(if below > 0.0 {
        (n + ng * (1.01 * below)).normalize_or(ng)
    } else {
        n
    })
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
            tangent: frame,
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
    /// Some lobes have normals of their own, made from [`SurfacePoint::tangent`](super::SurfacePoint::tangent). What they carry in
    /// radiance mode has the cosine of `wi` with that normal, in importance mode that of `wo`, and so
    /// f(wo, wi) in one mode is η² f(wi, wo) in the other. Since minor version 3.
    pub const OWN_NORMALS: u32 = 8;
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
    /// Stores the closure of a point. A BSDF of which some closures need more than others may store one of several types here, so that
    /// none pays for what only others have; each must scatter as [`closure`](Self::closure) does.
    fn store(&self, at: &SurfacePoint, slot: Slot<'_>) -> Stored {
        slot.put(self.closure(at))
    }
}

//! Path vertices and edges as they cross the boundary between the host and integrator plugins.
//!
//! One vertex type serves sensor, lights, surfaces and media (Jakob 2013): they differ in their scattering closure and
//! in the cosine D of the geometry term, nowhere else.

use crate::closure::Closure;
use crate::math::{Float3, Frame, Vec3};
use crate::spectrum::Spectrum;

/// False in a build that leaves the code for media out (`--cfg resolvent_surfaces_only`). Such a build renders scenes without
/// media only; it is there to measure what that code costs them.
pub const WITH_MEDIA: bool = cfg!(not(resolvent_surfaces_only));

/// What a vertex is.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexKind {
    /// On the sensor.
    Sensor = 0,
    /// On a light that is no surface: environment, distant, point.
    Emitter = 1,
    /// On a surface (which may also emit).
    Surface = 2,
    /// Inside a medium.
    Medium = 3,
}

/// Bits of [`Vertex::flags`].
pub mod vertex_flags {
    /// At infinity: `p` holds the direction towards it.
    pub const INFINITE: u32 = 1;
    /// On a light without extent in position or direction; scattering can't find it.
    pub const DELTA: u32 = 2;
    /// The surface emits towards `wo`.
    pub const EMITS: u32 = 4;
    /// Of a camera whose rays are parallel: densities are per area across them, not per steradian. Since minor version 2.
    pub const PARALLEL: u32 = 8;
}

/// No light, no medium.
pub const NONE: u32 = u32::MAX;

/// A vertex of a path.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Vertex {
    /// A [`VertexKind`] as its number.
    pub kind: u32,
    /// Bits of [`vertex_flags`].
    pub flags: u32,
    /// Position, or for [`vertex_flags::INFINITE`] the direction towards it.
    pub p: Float3,
    /// Bound of the absolute rounding error in each coordinate of `p`.
    pub p_error: Float3,
    /// The light this vertex lies on, or [`NONE`].
    pub light: u32,
    /// Geometric normal (surfaces; unit).
    pub ng: Float3,
    /// Which of the medium's phase functions scatters (medium vertices).
    pub phase: u32,
    /// Unit direction towards the previous vertex.
    pub wo: Float3,
    /// The medium that scatters here (medium vertices), or [`NONE`].
    pub medium: u32,
    /// Shading frame (surfaces).
    pub frame: Frame,
    /// Texture coordinates (surfaces).
    pub uv: [f32; 2],
    /// Surface and primitive hit: private to the host.
    pub primitive: [u32; 2],
    /// The interior media a ray leaving on the side of `wo` is in: private to the host.
    pub inside: u64,
    /// Extinction (medium vertices).
    pub sigma_t: Spectrum,
    /// Scattering coefficient (medium vertices).
    pub sigma_s: Spectrum,
    /// Radiance emitted towards `wo`.
    pub emitted: Spectrum,
    /// K at this vertex.
    pub scatter: Closure,
}

impl Vertex {
    /// A vertex with nothing set, as storage for the host to fill.
    #[inline(always)]
    pub fn empty() -> Self {
        Self {
            kind: 0,
            flags: 0,
            p: [0.0; 3],
            p_error: [0.0; 3],
            light: NONE,
            ng: [0.0; 3],
            phase: 0,
            wo: [0.0; 3],
            medium: NONE,
            frame: Frame {
                s: [0.0; 3],
                t: [0.0; 3],
                n: [0.0; 3],
            },
            uv: [0.0; 2],
            primitive: [NONE; 2],
            inside: 0,
            sigma_t: Spectrum::ZERO,
            sigma_s: Spectrum::ZERO,
            emitted: Spectrum::ZERO,
            scatter: Closure::EMPTY,
        }
    }

    /// Position as a vector.
    #[inline(always)]
    pub fn position(&self) -> Vec3 {
        self.p.into()
    }

    /// True if this is a vertex of the given kind.
    #[inline(always)]
    pub fn is(&self, kind: VertexKind) -> bool {
        self.kind == kind as u32 && (WITH_MEDIA || !matches!(kind, VertexKind::Medium))
    }

    /// True if at infinity.
    #[inline(always)]
    pub fn is_infinite(&self) -> bool {
        self.flags & vertex_flags::INFINITE != 0
    }

    /// The factor D of the geometry term: |N·ω| on surfaces, 1 in media and on points.
    #[inline(always)]
    pub fn cosine(&self, w: Vec3) -> f32 {
        if self.is(VertexKind::Surface) {
            Vec3::from(self.ng).dot(w).abs()
        } else {
            1.0
        }
    }
}

/// An edge of a path: what the media between two vertices do, see [`crate::operator::Flight`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Edge {
    /// Contribution of the media, per lane.
    pub value: Spectrum,
    /// Density under free flight, per lane, without the coefficient at its end.
    pub track: Spectrum,
    /// Density under connection, per lane.
    pub ratio: Spectrum,
    /// Radiance picked up on the way.
    pub emitted: Spectrum,
    /// Length; infinite towards vertices at infinity.
    pub length: f32,
    /// 1 if a medium was met on the way.
    pub media: u32,
}

/// A sampled point on a light, seen from a reference vertex.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct LightSample {
    /// Unit direction from the reference towards the light.
    pub wi: Float3,
    /// Distance, infinite for lights at infinity.
    pub distance: f32,
    /// Radiance towards the reference; for delta lights already divided by what would be their density
    /// (intensity/distance², or the irradiance).
    pub radiance: Spectrum,
    /// Density of `wi` per steradian, the choice of the light included; for delta lights the probability of the choice.
    pub density: f32,
    /// The light.
    pub light: u32,
    /// Bits of [`vertex_flags`]: `DELTA`, `INFINITE`.
    pub flags: u32,
    /// Position on the light (finite lights).
    pub p: Float3,
    /// Normal there (area lights).
    pub ng: Float3,
    /// Surface and primitive, so that connections don't stop at the light itself: private to the host.
    pub primitive: [u32; 2],
    /// Rounding error of `p`.
    pub p_error: Float3,
}

/// A camera ray.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CameraRay {
    /// Origin.
    pub o: Float3,
    /// Unit direction.
    pub d: Float3,
    /// Importance over density: the factor of the radiance found.
    pub weight: f32,
    /// The interior media the camera is in: private to the host.
    pub inside: u64,
    /// Density of the direction (sr⁻¹) under film positions of density 1 per pixel area, whatever the reconstruction filter:
    /// what weights between techniques are made of. Per area across the ray, and not per steradian, if `flags` have
    /// [`vertex_flags::PARALLEL`].
    pub density: f32,
    /// Bits of [`vertex_flags`]: `PARALLEL`.
    pub flags: u32,
}

/// A ray that leaves a light: the start of a light walk. The vertex it leaves from is filled beside it.
///
/// Densities: for lights with a place, `position` is per area (a probability for point lights) and `direction` per steradian;
/// for lights at infinity, `position` is that of the direction, per steradian (a probability for parallel light), and
/// `direction` that of the ray's place, per area across it. The choice of the light is part of `position`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct LightRay {
    /// Origin.
    pub o: Float3,
    /// Density of the vertex on the light.
    pub position: f32,
    /// Unit direction.
    pub d: Float3,
    /// Density of the ray, given that vertex.
    pub direction: f32,
    /// Radiance (for lights of delta position: intensity; of delta direction: irradiance) times the cosine at the light,
    /// over both densities.
    pub weight: Spectrum,
    /// The interior media the ray starts in: private to the host.
    pub inside: u64,
}

/// A point on the lens as a vertex of the scene sees it.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct SensorSample {
    /// What to connect to. `density` is that of [`CameraRay`], as are the `PARALLEL` bit and what it means: importance per
    /// steradian at the lens, 1 per pixel area.
    pub target: LightSample,
    /// Position on the film, pixels.
    pub film: [f32; 2],
}

//! The two operators of light transport, K and G, as traits, and the plain data they exchange.
//!
//! L = G(K L + Le), solved by S = (I − G K)⁻¹ G = Σ (G K)ᵏ G. **K** scatters at a vertex (a BSDF, or σ_s times the phase
//! function), **G** transports between vertices (visibility, transmittance). Everything in this file crosses the plugin
//! boundary, so all of it is `repr(C)` plain data.
//!
//! Directions `wo` and `wi` both point away from the vertex: `wo` is known, `wi` is sought.

use crate::math::{Float3, Vec3};
use crate::spectrum::Spectrum;
use bytemuck::{Pod, Zeroable};

/// What is carried along a walk; scattering is not symmetric for shading normals and refraction (Veach 1997, §5.3).
///
/// **Who corrects what.** A closure gives the value for light that travels from `wo` to `wi`, per power: what an
/// importance walk carries. Where nothing is absorbed, ∫ f |cos θ_i| dω_i = 1 on both sides of a refracting surface. It is
/// symmetric but for refraction, with η = n(side of wi)/n(side of wo):
///
///   f(wo, wi) = η² f(wi, wo)                                     (Veach 1997, eq. 5.14)
///
/// Radiance arriving from `wi` is η² times as dense on its side, so a radiance walk carries f/η². That division, and the
/// factor for shading normals, are applied in `resolvent_pathspace::scatter` and nowhere else; closures take the mode only to
/// pass it on, or for lobes with normals of their own ([`OWN_NORMALS`](crate::surface::bsdf_traits::OWN_NORMALS)). The index comes from [`ScatterSample::eta`] for samples and from [`Scatter::eta`] for given pairs.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Radiance, on walks that start at the sensor.
    Radiance = 0,
    /// Importance, on walks that start at a light.
    Importance = 1,
}

impl Mode {
    /// From its number; anything but 1 is radiance.
    pub fn from_u32(v: u32) -> Self {
        if v == 1 {
            Self::Importance
        } else {
            Self::Radiance
        }
    }
}

/// The measure of a density.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Per steradian.
    SolidAngle = 0,
    /// Per area.
    Area = 1,
    /// Per volume.
    Volume = 2,
    /// Probability of a discrete choice (delta lobes, delta lights).
    Discrete = 3,
}

/// The primary samples of one scattering decision, each uniform in [0, 1).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct ScatterDraws {
    /// Chooses a lobe.
    pub lobe: f32,
    /// Chooses a direction within it.
    pub dir: [f32; 2],
}

/// Value and densities of scattering between two given directions.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ScatterEval {
    /// BSDF value for light from `wo` to `wi` (sr⁻¹, no cosine; see [`Mode`]) or phase function value (sr⁻¹, without σ_s).
    /// Delta lobes contribute nothing.
    pub f: Spectrum,
    /// Density of sampling `wi` given `wo`, sr⁻¹.
    pub forward: f32,
    /// Density of sampling `wo` given `wi`, sr⁻¹.
    pub reverse: f32,
}

/// A sampled direction.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct ScatterSample {
    /// f · |cos θ_i| / density for a BSDF (cosine with the shading normal), f / density for a phase function.
    pub weight: Spectrum,
    /// The direction, unit length, in the coordinates of `wo`.
    pub wi: Float3,
    /// Relative index of refraction across the event (1 if not refracted): that of the side of `wi` over that of `wo`.
    pub eta: f32,
    /// Density of `wi` given `wo`; sr⁻¹, or a probability for [`Measure::Discrete`].
    pub forward: f32,
    /// Density of `wo` given `wi`, in the same measure.
    pub reverse: f32,
    /// A [`Measure`] as its number: `SolidAngle` or `Discrete`.
    pub measure: u32,
    /// Which lobe was chosen, for statistics.
    pub lobe: u32,
}

/// Bits of [`Scatter::lobes`].
pub mod lobes {
    /// Has a part with a finite density.
    pub const SMOOTH: u32 = 1;
    /// Has a part that is a delta distribution.
    pub const DELTA: u32 = 2;
    /// Passes light on unchanged: an index-matched boundary (transport goes through it, it is no vertex).
    pub const PASSES: u32 = 4;
}

/// K at one vertex: a BSDF or phase function with everything local resolved.
///
/// BSDFs receive directions in the shading frame (z = shading normal), phase functions in world coordinates.
pub trait Scatter {
    /// Value and densities between two directions.
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> ScatterEval;
    /// Chooses `wi`; `None` if the light is absorbed.
    fn sample(&self, wo: Vec3, u: ScatterDraws, mode: Mode) -> Option<ScatterSample>;
    /// The kinds of lobes present, see [`lobes`].
    fn lobes(&self) -> u32;
    /// Index of refraction below the surface (z < 0) over that above, for pairs of directions on different sides; 1 if light
    /// passes unbent, and for phase functions.
    fn eta(&self) -> f32 {
        1.0
    }
}

/// A stretch of a straight line: the points `o + t d` with `t0 ≤ t ≤ t1`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Segment {
    /// Origin.
    pub o: Float3,
    /// Start, ≥ 0.
    pub t0: f32,
    /// Direction, unit length: `t` measures world length.
    pub d: Float3,
    /// End, > `t0`; may be infinite.
    pub t1: f32,
}

impl Segment {
    /// The point at `t`.
    #[inline(always)]
    pub fn at(&self, t: f32) -> Vec3 {
        Vec3::from(self.o) + t * Vec3::from(self.d)
    }
}

/// The primary samples of one flight through a medium.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct FlightDraws {
    /// Key of the counter-based stream that continues after `tau` and `event`.
    pub key: u64,
    /// Uniform in [0, 1): the first exponential distance.
    pub tau: f32,
    /// Uniform in [0, 1): the first decision.
    pub event: f32,
    /// The lane that decides distances and events, uniform in 0..lanes (single-sample MIS over lanes).
    pub hero: u32,
    /// Lanes in use, 1 to 4.
    pub lanes: u32,
    /// Bits of [`flight_flags`].
    pub flags: u32,
    /// Zero.
    pub reserved: u32,
    /// The path's density up to here, per lane, up to a common factor: what is picked up on the way is weighted by the mean
    /// of `prior · track` over lanes, so that one hero serves the whole path. All ones in grey scenes.
    pub prior: Spectrum,
}

/// Bits of [`FlightDraws::flags`].
pub mod flight_flags {
    /// `sigma_t` and `sigma_s` at a collision must be exact, not just right in their ratios: bidirectional densities
    /// need it, path tracing doesn't and saves a look-up.
    pub const EXACT: u32 = 1;
    /// No other medium reaches into the segment, so the flight won't be cut short by another's collision:
    /// [`super::Flight::emitted`] may be its expectation over the whole segment.
    pub const ALONE: u32 = 2;
}

/// How a flight ended.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Reached the end of the segment.
    Survived = 0,
    /// Collided at `t`.
    Collided = 1,
}

/// Coefficients of a medium at a point.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Coefficients {
    /// Extinction, 1/length.
    pub sigma_t: Spectrum,
    /// Scattering, 1/length.
    pub sigma_s: Spectrum,
    /// Emitted radiance per length, W·sr⁻¹·m⁻³.
    pub emission: Spectrum,
}

/// The outcome of a flight with the three densities that exact MIS on null-collision paths needs.
///
/// With null collisions z on the way, T_maj the majorant transmittance and lane by lane:
/// `value` = T_maj Π σ_n(z), the path's contribution; `track` = density with which free flight produces it, the
/// coefficient at its end left out; `ratio` = density with which [`crate::Medium::transmit`] produces it.
/// All three share one arbitrary scale, so only their ratios mean anything and nothing underflows
/// (Miller, Georgiev & Jarosz 2019, eq. 9-15).
///
/// A collision at y has density `track · sigma_t(y)` per length and contributes `value · sigma_s(y)`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Flight {
    /// Contribution, per lane.
    pub value: Spectrum,
    /// Density under free flight, per lane.
    pub track: Spectrum,
    /// Density under transmittance estimation, per lane.
    pub ratio: Spectrum,
    /// Radiance picked up on the way (W·sr⁻¹·m⁻²), already divided by its density: add it as it is. Only free flights fill it.
    pub emitted: Spectrum,
    /// Extinction at the collision.
    pub sigma_t: Spectrum,
    /// Scattering at the collision.
    pub sigma_s: Spectrum,
    /// Where it ended: the collision, or the segment's `t1`.
    pub t: f32,
    /// An [`Event`] as its number.
    pub event: u32,
    /// Which of the medium's phase functions scatters at the collision (0 if it has one).
    pub phase: u32,
    /// Density look-ups made.
    pub lookups: u32,
    /// Null collisions met.
    pub nulls: u32,
    /// Points where the extinction exceeded the majorant (always 0 in a correct medium).
    pub violations: u32,
}

impl Flight {
    /// A flight through nothing, up to `t`.
    #[inline(always)]
    pub fn vacuum(t: f32) -> Self {
        Self {
            value: Spectrum::ONE,
            track: Spectrum::ONE,
            ratio: Spectrum::ONE,
            t,
            ..Self::default()
        }
    }

    /// True if it ended in a collision.
    #[inline(always)]
    pub fn collided(&self) -> bool {
        self.event == Event::Collided as u32
    }
}

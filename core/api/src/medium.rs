//! Participating media: the outer face a plugin shows, and the inner face (`Field`) that tracking runs over.

use crate::math::{Aabb, Vec3};
use crate::operator::{Coefficients, Flight, FlightDraws, Segment};
use crate::spectrum::{Lanes, Spectrum};
use bytemuck::{Pod, Zeroable};

/// Facts about a medium, found once when it is made; bits of [`MediumInfo::traits`].
pub mod medium_traits {
    /// Coefficients are the same everywhere inside.
    pub const HOMOGENEOUS: u32 = 1;
    /// Extinction is the same in all lanes (the albedo may differ).
    pub const GREY: u32 = 2;
    /// Emits.
    pub const EMISSIVE: u32 = 4;
    /// Flights are sampled in closed form.
    pub const ANALYTIC: u32 = 8;
    /// Never scatters (albedo 0).
    pub const ABSORBS_ONLY: u32 = 16;
    /// Does nothing at all: extinction and emission are zero. The host drops it.
    pub const EMPTY: u32 = 32;
    /// Connections are estimated by survival of a free flight (`ratio` = `track`).
    pub const ANALOG_TRANSMIT: u32 = 64;
}

/// What a medium says about itself.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct MediumInfo {
    /// World bounds; outside, it is never called.
    pub bounds: Aabb,
    /// Bits of [`medium_traits`].
    pub traits: u32,
    /// How many grids were read.
    pub grids_read: u32,
    /// Largest extinction, 1/length.
    pub sigma_max: Spectrum,
    /// Memory held, bytes.
    pub memory: u64,
    /// Bytes read from files.
    pub bytes_read: u64,
    /// Voxels that hold a value (0 for procedural media).
    pub voxels: u64,
}

impl Default for MediumInfo {
    fn default() -> Self {
        Self {
            bounds: Aabb::EMPTY,
            traits: 0,
            grids_read: 0,
            sigma_max: Spectrum::ZERO,
            memory: 0,
            bytes_read: 0,
            voxels: 0,
        }
    }
}

/// τ = σ·`length` of a lane, for media in closed form; 0 for a lane without extinction even if the length is infinite.
#[inline(always)]
pub fn optical_depth(sigma: f32, length: f64) -> f64 {
    if sigma == 0.0 {
        0.0
    } else {
        f64::from(sigma) * length
    }
}

/// A medium as the host sees it: one call per ray segment.
pub trait Medium: Send + Sync {
    /// Bounds and facts.
    fn info(&self) -> MediumInfo;
    /// Free flight: a collision or survival, with densities.
    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight;
    /// Unbiased transmittance of a connection: `value/ratio`, lane by lane.
    fn transmit(&self, s: &Segment, u: &FlightDraws) -> Flight;
    /// Approximate optical depth: deterministic and cheap. Used for roulette and weights only.
    fn depth(&self, s: &Segment) -> Spectrum;
    /// Coefficients at a point, exact.
    fn coefficients(&self, p: Vec3) -> Coefficients;
}

/// A stretch of a ray over which bounds of the extinction are constant.
#[derive(Clone, Copy, Debug)]
pub struct Cell<L> {
    /// Start of the stretch.
    pub t0: f32,
    /// End of the stretch.
    pub t1: f32,
    /// Upper bound of the extinction on it.
    pub majorant: L,
    /// Lower bound of the extinction on it (0 is always right).
    pub minorant: L,
}

/// The inner face of a spatially varying medium: implement this and wrap it in [`crate::tracking::Tracked`].
///
/// Everything here is inlined into the tracking loops, which are compiled inside the plugin: the host is called once
/// per segment, never per voxel.
pub trait Field: Send + Sync {
    /// `f32` if extinction is the same in all lanes, [`Spectrum`] otherwise.
    type Lanes: Lanes;
    /// True if [`Field::emission`] can be non-zero.
    const EMISSIVE: bool;
    /// Per-ray state (the transformed ray, a DDA), on the stack.
    type Cursor<'a>
    where
        Self: 'a;

    /// Bounds and facts.
    fn info(&self) -> MediumInfo;
    /// Starts on a segment; transform the ray here, once. `None` if it misses.
    fn enter(&self, s: &Segment) -> Option<Self::Cursor<'_>>;
    /// The next stretch in order of `t`. Gaps between stretches are vacuum.
    fn next_cell(&self, c: &mut Self::Cursor<'_>) -> Option<Cell<Self::Lanes>>;
    /// Extinction at `t`, within the bounds of the current cell. `jitter` is 63 random bits: an implementation may
    /// use it to evaluate an interpolant stochastically (one tap whose expectation is the interpolant), since extinction
    /// enters delta and ratio tracking linearly.
    fn extinction(&self, c: &mut Self::Cursor<'_>, t: f32, jitter: u64) -> Self::Lanes;
    /// Extinction and scattering at a collision at `t`. `known` is the extinction found there, or `None` if the
    /// collision was accepted by the minorant alone; then only the lanes' ratios need to be right, unless `exact`.
    fn collision(
        &self,
        c: &mut Self::Cursor<'_>,
        t: f32,
        known: Option<Self::Lanes>,
        exact: bool,
    ) -> (Spectrum, Spectrum);
    /// Emitted radiance per length at `t`.
    fn emission(&self, c: &mut Self::Cursor<'_>, t: f32) -> Spectrum;
    /// Coefficients at a point, exact.
    fn coefficients(&self, p: Vec3) -> Coefficients;
    /// Approximate optical depth of a segment.
    fn depth(&self, s: &Segment) -> Spectrum {
        let mut depth = Spectrum::ZERO;
        let Some(mut c) = self.enter(s) else {
            return depth;
        };
        while let Some(cell) = self.next_cell(&mut c) {
            depth += (cell.majorant + cell.minorant).spectrum() * (0.5 * (cell.t1 - cell.t0));
        }
        depth
    }
}

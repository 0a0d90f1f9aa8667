//! The tables of media, phase functions and BSDFs.

use super::{CreateArgs, Status};
use crate::closure::Closure;
use crate::math::Float3;
use crate::medium::MediumInfo;
use crate::operator::{
    Coefficients, Flight, FlightDraws, ScatterDraws, ScatterEval, ScatterSample, Segment,
};
use crate::phase::MediumPoint;
use crate::spectrum::Spectrum;
use crate::surface::SurfacePoint;
use core::ffi::c_void;

/// `create`: null on failure.
pub type Create = unsafe extern "C" fn(args: *const CreateArgs) -> *mut c_void;
/// `destroy`.
pub type Destroy = unsafe extern "C" fn(instance: *mut c_void);

/// Functions of a closure, see [`crate::Scatter`]; `data` are the closure's bytes.
#[repr(C)]
pub struct ScatterTable {
    /// `size_of::<ScatterTable>()`.
    pub size: u32,
    /// Bytes of the closure that are in use.
    pub data_size: u32,
    /// Value and densities between two unit directions that point away from the vertex, see [`crate::Scatter::eval`]. `mode` is a
    /// [`Mode`](crate::Mode) as its number.
    pub eval: unsafe extern "C" fn(
        data: *const c_void,
        wo: *const Float3,
        wi: *const Float3,
        mode: u32,
        out: *mut ScatterEval,
    ) -> Status,
    /// Chooses `wi` for `wo`, see [`crate::Scatter::sample`]; [`Status::NONE`] if the light is absorbed.
    pub sample: unsafe extern "C" fn(
        data: *const c_void,
        wo: *const Float3,
        u: *const ScatterDraws,
        mode: u32,
        out: *mut ScatterSample,
    ) -> Status,
    /// Bits of [`lobes`](crate::operator::lobes), see [`crate::Scatter::lobes`].
    pub lobes: unsafe extern "C" fn(data: *const c_void) -> u32,
    /// Index of refraction below the surface over that above, see [`crate::Scatter::eta`]; null: 1.
    pub eta: Option<unsafe extern "C" fn(data: *const c_void) -> f32>,
}

/// Functions of a medium, see [`crate::Medium`].
#[repr(C)]
pub struct MediumTable {
    /// `size_of::<MediumTable>()`.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Makes an instance.
    pub create: Create,
    /// Ends it.
    pub destroy: Destroy,
    /// Bounds and facts, see [`crate::Medium::info`].
    pub info: unsafe extern "C" fn(instance: *const c_void, out: *mut MediumInfo) -> Status,
    /// Free flight: a collision or survival, with densities; see [`crate::Medium::sample`].
    pub sample: unsafe extern "C" fn(
        instance: *const c_void,
        s: *const Segment,
        u: *const FlightDraws,
        out: *mut Flight,
    ) -> Status,
    /// Unbiased transmittance `value/ratio` of a connection; see [`crate::Medium::transmit`].
    pub transmit: unsafe extern "C" fn(
        instance: *const c_void,
        s: *const Segment,
        u: *const FlightDraws,
        out: *mut Flight,
    ) -> Status,
    /// Approximate optical depth, deterministic and cheap; see [`crate::Medium::depth`].
    pub depth: unsafe extern "C" fn(
        instance: *const c_void,
        s: *const Segment,
        out: *mut Spectrum,
    ) -> Status,
    /// Exact coefficients at a point in the world, see [`crate::Medium::coefficients`].
    pub coefficients: unsafe extern "C" fn(
        instance: *const c_void,
        p: *const Float3,
        out: *mut Coefficients,
    ) -> Status,
}

/// Functions of a phase function, see [`crate::PhaseFunction`].
#[repr(C)]
pub struct PhaseTable {
    /// `size_of::<PhaseTable>()`.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Makes an instance.
    pub create: Create,
    /// Ends it.
    pub destroy: Destroy,
    /// Resolves the phase function at a point, see [`crate::PhaseFunction::closure`]. The closure may point into the instance: no function of it is called after `destroy`.
    pub closure: unsafe extern "C" fn(
        instance: *const c_void,
        at: *const MediumPoint,
        out: *mut Closure,
    ) -> Status,
}

/// Functions of a BSDF, see [`crate::Bsdf`].
#[repr(C)]
pub struct BsdfTable {
    /// `size_of::<BsdfTable>()`.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Makes an instance.
    pub create: Create,
    /// Ends it.
    pub destroy: Destroy,
    /// Bits of [`bsdf_traits`](crate::surface::bsdf_traits), see [`crate::Bsdf::traits`].
    pub traits: unsafe extern "C" fn(instance: *const c_void) -> u32,
    /// Resolves the BSDF at a point, see [`crate::Bsdf::closure`].
    pub closure: unsafe extern "C" fn(
        instance: *const c_void,
        at: *const SurfacePoint,
        out: *mut Closure,
    ) -> Status,
    /// Index of refraction inside, see [`crate::Bsdf::ior`]; null: 1.
    pub ior: Option<unsafe extern "C" fn(instance: *const c_void) -> f32>,
}

//! The tables of the kinds: functions of C that call the safe traits.

use super::Plugin;
use super::instance::{closure_panicked, create, destroy, guarded, instance};
use crate::abi::*;
use crate::closure::Closure;
use crate::integrator::{Integrator, Output, SceneView};
use crate::math::{Float3, Vec3};
use crate::medium::{Medium, MediumInfo};
use crate::operator::*;
use crate::panics::panic_text;
use crate::params::Host;
use crate::phase::{MediumPoint, PhaseFunction};
use crate::slot::Slot;
use crate::spectrum::Spectrum;
use crate::surface::{Bsdf, SurfacePoint};
use core::ffi::c_void;
use core::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The table of a closure type.
pub struct ScatterShim<C>(PhantomData<C>);

impl<C: Scatter + Copy + Send + Sync + 'static> ScatterShim<C> {
    /// The table.
    pub const TABLE: ScatterTable = ScatterTable {
        size: size_of::<ScatterTable>() as u32,
        data_size: size_of::<C>() as u32,
        eval: Self::eval,
        sample: Self::sample,
        lobes: Self::lobes,
        eta: Some(Self::eta),
    };

    unsafe extern "C" fn eval(
        data: *const c_void,
        wo: *const Float3,
        wi: *const Float3,
        mode: u32,
        out: *mut ScatterEval,
    ) -> Status {
        // SAFETY: the host passes the closure's data and valid pointers.
        let (closure, wo, wi) = unsafe { (&*data.cast::<C>(), Vec3::from(*wo), Vec3::from(*wi)) };
        match catch_unwind(AssertUnwindSafe(|| {
            closure.eval(wo, wi, Mode::from_u32(mode))
        })) {
            Ok(e) => {
                // SAFETY: `out` is valid for writing.
                unsafe { *out = e };
                Status::OK
            }
            Err(payload) => closure_panicked(payload),
        }
    }

    unsafe extern "C" fn sample(
        data: *const c_void,
        wo: *const Float3,
        u: *const ScatterDraws,
        mode: u32,
        out: *mut ScatterSample,
    ) -> Status {
        // SAFETY: as above.
        let (closure, wo, u) = unsafe { (&*data.cast::<C>(), Vec3::from(*wo), *u) };
        match catch_unwind(AssertUnwindSafe(|| {
            closure.sample(wo, u, Mode::from_u32(mode))
        })) {
            Ok(Some(s)) => {
                // SAFETY: `out` is valid for writing.
                unsafe { *out = s };
                Status::OK
            }
            Ok(None) => Status::NONE,
            Err(payload) => closure_panicked(payload),
        }
    }

    unsafe extern "C" fn lobes(data: *const c_void) -> u32 {
        // SAFETY: as above.
        let closure = unsafe { &*data.cast::<C>() };
        catch_unwind(AssertUnwindSafe(|| closure.lobes())).unwrap_or_else(|payload| {
            closure_panicked(payload);
            0
        })
    }

    unsafe extern "C" fn eta(data: *const c_void) -> f32 {
        // SAFETY: as above.
        let closure = unsafe { &*data.cast::<C>() };
        catch_unwind(AssertUnwindSafe(|| closure.eta())).unwrap_or_else(|payload| {
            closure_panicked(payload);
            1.0
        })
    }
}

/// Writes what `f` answers, or reports its panic.
///
/// # Safety
/// `out` is valid for writing.
#[inline(always)]
unsafe fn give<T>(host: Host, out: *mut T, f: impl FnOnce() -> T) -> Status {
    guarded(host, || {
        // SAFETY: by contract.
        unsafe { *out = f() };
        Status::OK
    })
}

/// The table of a medium.
pub struct MediumShim<T>(PhantomData<T>);

impl<T: Plugin + Medium> MediumShim<T> {
    /// The table.
    pub const TABLE: MediumTable = MediumTable {
        size: size_of::<MediumTable>() as u32,
        reserved: 0,
        create: create::<T>,
        destroy: destroy::<T>,
        info: Self::info,
        sample: Self::sample,
        transmit: Self::transmit,
        depth: Self::depth,
        coefficients: Self::coefficients,
    };

    unsafe extern "C" fn info(p: *const c_void, out: *mut MediumInfo) -> Status {
        // SAFETY: a live instance and valid pointers, by the ABI; the same below.
        let i = unsafe { instance::<T>(p) };
        // SAFETY: `out` is valid for writing.
        unsafe { give(i.host, out, || i.value.info()) }
    }

    unsafe extern "C" fn sample(
        p: *const c_void,
        s: *const Segment,
        u: *const FlightDraws,
        out: *mut Flight,
    ) -> Status {
        // SAFETY: as above.
        let (i, s, u) = unsafe { (instance::<T>(p), &*s, &*u) };
        // SAFETY: `out` is valid for writing.
        unsafe { give(i.host, out, || i.value.sample(s, u)) }
    }

    unsafe extern "C" fn transmit(
        p: *const c_void,
        s: *const Segment,
        u: *const FlightDraws,
        out: *mut Flight,
    ) -> Status {
        // SAFETY: as above.
        let (i, s, u) = unsafe { (instance::<T>(p), &*s, &*u) };
        // SAFETY: `out` is valid for writing.
        unsafe { give(i.host, out, || i.value.transmit(s, u)) }
    }

    unsafe extern "C" fn depth(p: *const c_void, s: *const Segment, out: *mut Spectrum) -> Status {
        // SAFETY: as above.
        let (i, s) = unsafe { (instance::<T>(p), &*s) };
        // SAFETY: `out` is valid for writing.
        unsafe { give(i.host, out, || i.value.depth(s)) }
    }

    unsafe extern "C" fn coefficients(
        p: *const c_void,
        at: *const Float3,
        out: *mut Coefficients,
    ) -> Status {
        // SAFETY: as above.
        let (i, at) = unsafe { (instance::<T>(p), Vec3::from(*at)) };
        // SAFETY: `out` is valid for writing.
        unsafe { give(i.host, out, || i.value.coefficients(at)) }
    }
}

/// The table of a phase function.
pub struct PhaseShim<T>(PhantomData<T>);

impl<T: Plugin + PhaseFunction> PhaseShim<T> {
    /// Functions are the same for every lifetime of the closure, so those of the longest stand for all. The borrow is kept by
    /// the ABI instead: see [`PhaseTable::closure`].
    const SCATTER: &'static ScatterTable = &ScatterShim::<T::Closure<'static>>::TABLE;

    /// The table.
    pub const TABLE: PhaseTable = PhaseTable {
        size: size_of::<PhaseTable>() as u32,
        reserved: 0,
        create: create::<T>,
        destroy: destroy::<T>,
        closure: Self::closure,
    };

    unsafe extern "C" fn closure(
        p: *const c_void,
        at: *const MediumPoint,
        out: *mut Closure,
    ) -> Status {
        // SAFETY: a live instance and valid pointers, by the ABI.
        let (i, at) = unsafe { (instance::<T>(p), &*at) };
        guarded(i.host, || {
            // SAFETY: the table is the one made for this closure type; `out` is valid for writing.
            unsafe { Closure::store(out, Self::SCATTER, i.value.closure(at)) };
            Status::OK
        })
    }
}

/// The table of a BSDF.
pub struct BsdfShim<T>(PhantomData<T>);

impl<T: Plugin + Bsdf> BsdfShim<T> {
    /// The table.
    pub const TABLE: BsdfTable = BsdfTable {
        size: size_of::<BsdfTable>() as u32,
        reserved: 0,
        create: create::<T>,
        destroy: destroy::<T>,
        traits: Self::traits,
        closure: Self::closure,
        ior: Some(Self::ior),
    };

    unsafe extern "C" fn traits(p: *const c_void) -> u32 {
        // SAFETY: a live instance, by the ABI.
        let i = unsafe { instance::<T>(p) };
        catch_unwind(AssertUnwindSafe(|| i.value.traits())).unwrap_or_else(|payload| {
            // There is no status here: the host looks for a report after the call.
            i.host.fail(&panic_text(payload));
            0
        })
    }

    unsafe extern "C" fn ior(p: *const c_void) -> f32 {
        // SAFETY: a live instance, by the ABI.
        let i = unsafe { instance::<T>(p) };
        catch_unwind(AssertUnwindSafe(|| i.value.ior())).unwrap_or_else(|payload| {
            i.host.fail(&panic_text(payload));
            1.0
        })
    }

    unsafe extern "C" fn closure(
        p: *const c_void,
        at: *const SurfacePoint,
        out: *mut Closure,
    ) -> Status {
        // SAFETY: a live instance and valid pointers, by the ABI.
        let (i, at) = unsafe { (instance::<T>(p), &*at) };
        guarded(i.host, || {
            // SAFETY: `out` is valid for writing.
            i.value.store(at, unsafe { Slot::new(out) });
            Status::OK
        })
    }
}

/// The table of an integrator.
pub struct IntegratorShim<T>(PhantomData<T>);

impl<T: Plugin + Integrator> IntegratorShim<T> {
    /// The table.
    pub const TABLE: IntegratorTable = IntegratorTable {
        size: size_of::<IntegratorTable>() as u32,
        reserved: 0,
        create: create::<T>,
        destroy: destroy::<T>,
        render: Self::render,
    };

    unsafe extern "C" fn render(
        p: *const c_void,
        scene: *const SceneTable,
        tile: *const Tile,
        out: *const OutputTable,
    ) -> Status {
        // SAFETY: a live instance and valid pointers, by the ABI.
        let (i, tile) = unsafe { (instance::<T>(p), &*tile) };
        // SAFETY: as above; the host checked that the versions agree, so the tables are complete.
        let (scene, mut out) = unsafe { (SceneView::new(&*scene), Output::new(&*out)) };
        guarded(i.host, || match i.value.render(&scene, tile, &mut out) {
            Ok(()) => Status::OK,
            Err(_) => Status::ERROR,
        })
    }
}

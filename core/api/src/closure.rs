//! A scattering closure: K at one vertex, resolved by its plugin and stored inline.

use crate::abi::{ScatterTable, Status};
use crate::math::Vec3;
use crate::operator::{Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample};
use core::mem::MaybeUninit;

/// Bytes a closure may occupy. Only those in use are ever written or copied by the SDK, so a small closure doesn't pay for a
/// large one; the bound leaves room for two closures of 216 bytes nested in a third ([`crate::nested`]).
pub const CLOSURE_BYTES: usize = 496;

/// The data of a `Scatter` implementation together with the table of its functions.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Closure {
    table: *const ScatterTable,
    /// Only as many bytes as the table says are ever written: the rest costs nothing to leave as it is.
    data: [MaybeUninit<u64>; CLOSURE_BYTES / 8],
}

// SAFETY: the table is a static of a library that is never unloaded, and the data is that of a type the SDK bounds
// by `Copy + Send + Sync`; what it borrows from its instance is alive by the contract of `store`.
unsafe impl Send for Closure {}
// SAFETY: as above.
unsafe impl Sync for Closure {}

impl Closure {
    /// Addresses of the functions and the data of a closure that a plugin wrote, of which the rest need not be initialised.
    ///
    /// # Safety
    /// `closure` must point to a closure whose table was written.
    pub(crate) unsafe fn parts(closure: *const Self) -> (*const ScatterTable, *const u64) {
        // SAFETY: by contract.
        unsafe { ((*closure).table, (&raw const (*closure).data).cast()) }
    }

    /// Absorbs everything.
    pub const EMPTY: Self = Self {
        table: core::ptr::null(),
        data: [MaybeUninit::uninit(); CLOSURE_BYTES / 8],
    };

    /// Stores `value` with its table into `out`. Checked at compile time: it must fit in size and alignment.
    ///
    /// # Safety
    /// `table` must be the table made for `C` by the SDK, whatever the lifetimes in it, `out` valid for writing; what `value`
    /// borrows must outlive every use of `out`.
    pub unsafe fn store<C: Copy>(out: *mut Self, table: *const ScatterTable, value: C) {
        const {
            assert!(
                size_of::<C>() <= CLOSURE_BYTES,
                "a closure may occupy at most 496 bytes"
            )
        };
        const {
            assert!(
                align_of::<C>() <= 8,
                "a closure may be aligned to at most 8 bytes"
            )
        };
        // SAFETY: `out` is valid for writing by contract; size and alignment are asserted above. Only the bytes
        // in use are written: the rest keeps whatever it held and is never read.
        unsafe {
            (*out).table = table;
            (&raw mut (*out).data).cast::<C>().write(value);
        }
    }

    /// Evaluation with the outcome: `Err` if the plugin panicked.
    #[inline(always)]
    pub fn try_eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> Result<ScatterEval, Status> {
        let mut out = ScatterEval::default();
        if self.table.is_null() {
            return Ok(out);
        }
        let (wo, wi) = (wo.to_array(), wi.to_array());
        // SAFETY: table and data were written together by `store`, or by a C plugin under the same contract.
        let status = unsafe {
            ((*self.table).eval)(
                (&raw const self.data).cast(),
                &wo,
                &wi,
                mode as u32,
                &mut out,
            )
        };
        if status == Status::OK {
            Ok(out)
        } else {
            Err(status)
        }
    }

    /// Sampling with the outcome: `Ok(None)` if absorbed, `Err` if the plugin panicked.
    #[inline(always)]
    pub fn try_sample(
        &self,
        wo: Vec3,
        u: ScatterDraws,
        mode: Mode,
    ) -> Result<Option<ScatterSample>, Status> {
        if self.table.is_null() {
            return Ok(None);
        }
        let mut out = ScatterSample::default();
        let wo = wo.to_array();
        // SAFETY: as in `try_eval`.
        let status = unsafe {
            ((*self.table).sample)(
                (&raw const self.data).cast(),
                &wo,
                &u,
                mode as u32,
                &mut out,
            )
        };
        match status {
            Status::OK => Ok(Some(out)),
            Status::NONE => Ok(None),
            other => Err(other),
        }
    }
}

/// [`Scatter::eta`] of a closure's data; 1 without a table, or where the table doesn't say.
///
/// # Safety
/// `table` must be null or valid, and `data` of its kind.
#[inline(always)]
pub(crate) unsafe fn eta_of(table: *const ScatterTable, data: *const core::ffi::c_void) -> f32 {
    // SAFETY: by contract.
    match unsafe { table.as_ref() } {
        // The function was appended to the table: an older plugin's ends before it.
        Some(t) if t.size as usize >= size_of::<ScatterTable>() => match t.eta {
            // SAFETY: by contract.
            Some(eta) => unsafe { eta(data) },
            None => 1.0,
        },
        _ => 1.0,
    }
}

/// Treats a panic as absorption; use the `try_` functions where it must not pass unseen.
impl Scatter for Closure {
    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> ScatterEval {
        self.try_eval(wo, wi, mode).unwrap_or_default()
    }

    #[inline(always)]
    fn sample(&self, wo: Vec3, u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
        self.try_sample(wo, u, mode).ok().flatten()
    }

    #[inline(always)]
    fn lobes(&self) -> u32 {
        if self.table.is_null() {
            return 0;
        }
        // SAFETY: as in `try_eval`.
        unsafe { ((*self.table).lobes)((&raw const self.data).cast()) }
    }

    #[inline(always)]
    fn eta(&self) -> f32 {
        // SAFETY: the table is null or valid; the data is its own.
        unsafe { eta_of(self.table, (&raw const self.data).cast()) }
    }
}

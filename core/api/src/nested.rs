//! BSDFs nested in another: how a BSDF such as a mixture holds the ones it combines.
//!
//! A plugin takes them from its parameters with [`Params::bsdf`](crate::Params::bsdf), and its closure holds theirs side by side
//! in [`NestedClosures`].

use crate::abi::{BsdfTable, ScatterTable, Status};
use crate::closure::{Closure, eta_of};
use crate::math::Vec3;
use crate::operator::{Mode, ScatterDraws, ScatterEval, ScatterSample};
use crate::surface::SurfacePoint;
use core::ffi::c_void;
use core::mem::MaybeUninit;

/// A nested BSDF: an instance that the host owns and that lives as long as the plugin it is nested in.
#[derive(Clone, Copy)]
pub struct NestedBsdf {
    table: &'static BsdfTable,
    instance: *const c_void,
}

// SAFETY: the ABI asks that instances may be used from any thread.
unsafe impl Send for NestedBsdf {}
// SAFETY: as above.
unsafe impl Sync for NestedBsdf {}

impl NestedBsdf {
    /// # Safety
    /// `table` must be that of the plugin of `instance`, and both must live as long as what holds this.
    pub(crate) unsafe fn new(table: &'static BsdfTable, instance: *const c_void) -> Self {
        Self { table, instance }
    }

    /// Bits of [`crate::surface::bsdf_traits`].
    pub fn traits(&self) -> u32 {
        // SAFETY: a live instance of this table's plugin.
        unsafe { (self.table.traits)(self.instance) }
    }

    /// See [`crate::Bsdf::ior`].
    pub fn ior(&self) -> f32 {
        // SAFETY: as above.
        self.table
            .ior
            .map_or(1.0, |ior| unsafe { ior(self.instance) })
    }

    /// Resolves the closure at a point into `scratch`; where its functions and its data are.
    ///
    /// # Panics
    /// If the nested plugin does: the panic belongs to it, and ends the render like one of its own.
    fn resolve(
        &self,
        at: &SurfacePoint,
        scratch: &mut MaybeUninit<Closure>,
    ) -> (*const ScatterTable, *const u64) {
        let out = scratch.as_mut_ptr();
        // SAFETY: a live instance of this table's plugin, and room for a closure. A call that returns OK has written the table
        // and those bytes of the data that the table says are in use; only addresses are taken here.
        unsafe {
            let status = (self.table.closure)(self.instance, at, out);
            assert!(status == Status::OK, "a nested BSDF failed");
            Closure::parts(out)
        }
    }
}

/// Eight-byte words that a point occupies.
const POINT_WORDS: usize = size_of::<SurfacePoint>().div_ceil(8);
/// In place of a first word: absorbs everything, there is nothing to hold.
const EMPTY: u16 = u16::MAX;
/// In place of a first word: found no room, resolved whenever it is asked.
const ASKED: u16 = u16::MAX - 1;

/// The closures of `N` nested BSDFs at a point, in at most 8·`WORDS` bytes.
///
/// Those that fit are held inline. One that doesn't is resolved again whenever it is asked: slower, but never refused, so that
/// nesting has no limit. The room must at least hold the point itself (10 words).
#[derive(Clone, Copy)]
pub struct NestedClosures<const N: usize, const WORDS: usize> {
    bsdfs: [NestedBsdf; N],
    tables: [*const ScatterTable; N],
    /// First word of each closure. The point, if any closure needs it, stands in the last words.
    starts: [u16; N],
    data: [MaybeUninit<u64>; WORDS],
}

// SAFETY: tables are statics of libraries that are never unloaded, and the data is that of closures, which are
// `Copy + Send + Sync + 'static`.
unsafe impl<const N: usize, const WORDS: usize> Send for NestedClosures<N, WORDS> {}
// SAFETY: as above.
unsafe impl<const N: usize, const WORDS: usize> Sync for NestedClosures<N, WORDS> {}

impl<const N: usize, const WORDS: usize> NestedClosures<N, WORDS> {
    /// Resolves all of them at a point.
    ///
    /// # Panics
    /// If one of the nested plugins does.
    pub fn resolve(bsdfs: [NestedBsdf; N], at: &SurfacePoint) -> Self {
        const { assert!(WORDS >= POINT_WORDS && WORDS < ASKED as usize) };
        let mut out = Self {
            bsdfs,
            tables: [core::ptr::null(); N],
            starts: [EMPTY; N],
            data: [MaybeUninit::uninit(); WORDS],
        };
        if !out.place(at, WORDS) {
            let room = WORDS - POINT_WORDS;
            out.place(at, room);
            // SAFETY: the words from `room` on are as many as a point occupies.
            unsafe {
                let last = out.data.as_mut_ptr().add(room);
                last.cast::<SurfacePoint>().write(*at);
            }
        }
        out
    }

    /// Holds those that fit in the first `room` words; true if all did.
    fn place(&mut self, at: &SurfacePoint, room: usize) -> bool {
        let (mut used, mut all) = (0, true);
        for i in 0..N {
            let mut scratch = MaybeUninit::uninit();
            let (table, data) = self.bsdfs[i].resolve(at, &mut scratch);
            self.tables[i] = table;
            // SAFETY: the table is null or valid.
            let Some(functions) = (unsafe { table.as_ref() }) else {
                self.starts[i] = EMPTY;
                continue;
            };
            let words = (functions.data_size as usize).div_ceil(8);
            if words > room - used {
                self.starts[i] = ASKED;
                all = false;
                continue;
            }
            // SAFETY: a closure holds at least `words` words, which need not be initialised to be copied as they are; there
            // is room for them from `used` on.
            unsafe {
                let to = self.data.as_mut_ptr().add(used);
                core::ptr::copy_nonoverlapping(data.cast::<MaybeUninit<u64>>(), to, words);
            }
            self.starts[i] = used as u16;
            used += words;
        }
        all
    }

    /// Runs `f` on the functions and data of closure `i`; `None` if it absorbs everything.
    #[inline(always)]
    fn with<R>(&self, i: usize, f: impl FnOnce(&ScatterTable, *const c_void) -> R) -> Option<R> {
        match self.starts[i] {
            EMPTY => None,
            ASKED => {
                // SAFETY: where a closure is to be resolved when asked, `resolve` has written the point there.
                let at = unsafe {
                    let last = self.data.as_ptr().add(WORDS - POINT_WORDS);
                    last.cast::<SurfacePoint>().read()
                };
                let mut scratch = MaybeUninit::uninit();
                let (table, data) = self.bsdfs[i].resolve(&at, &mut scratch);
                // SAFETY: the table is null or valid.
                unsafe { table.as_ref() }.map(|table| f(table, data.cast()))
            }
            start => {
                let data = self.data[usize::from(start)..].as_ptr();
                // SAFETY: a closure that is held has a valid table.
                Some(f(unsafe { &*self.tables[i] }, data.cast()))
            }
        }
    }

    /// [`crate::Scatter::eval`] of closure `i`.
    ///
    /// # Panics
    /// If the nested plugin does; the same holds for the other functions.
    pub fn eval(&self, i: usize, wo: Vec3, wi: Vec3, mode: Mode) -> ScatterEval {
        let mut out = ScatterEval::default();
        let (wo, wi) = (wo.to_array(), wi.to_array());
        // SAFETY: table and data belong together.
        let status = self.with(i, |t, data| unsafe {
            (t.eval)(data, &wo, &wi, mode as u32, &mut out)
        });
        assert!(
            status.is_none_or(|s| s == Status::OK),
            "a nested BSDF failed in eval"
        );
        out
    }

    /// [`crate::Scatter::sample`] of closure `i`.
    pub fn sample(&self, i: usize, wo: Vec3, u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
        let mut out = ScatterSample::default();
        let wo = wo.to_array();
        // SAFETY: as above.
        let status = self.with(i, |t, data| unsafe {
            (t.sample)(data, &wo, &u, mode as u32, &mut out)
        })?;
        match status {
            Status::OK => Some(out),
            Status::NONE => None,
            _ => panic!("a nested BSDF failed in sample"),
        }
    }

    /// [`crate::Scatter::lobes`] of closure `i`.
    pub fn lobes(&self, i: usize) -> u32 {
        // SAFETY: as above.
        self.with(i, |t, data| unsafe { (t.lobes)(data) })
            .unwrap_or(0)
    }

    /// [`crate::Scatter::eta`] of closure `i`.
    pub fn eta(&self, i: usize) -> f32 {
        // SAFETY: as above.
        self.with(i, |t, data| unsafe { eta_of(t, data) })
            .unwrap_or(1.0)
    }

    /// True if closure `i` is held inline.
    pub fn is_inline(&self, i: usize) -> bool {
        self.starts[i] != ASKED
    }
}

//! Instances driven by their C tables, with every answer poisoned before the call and every failure kept.

use resolvent_api::abi::{BsdfTable, MediumTable, PhaseTable, Status};
use resolvent_api::medium::MediumInfo;
use resolvent_api::operator::{Coefficients, Flight, FlightDraws, Segment};
use resolvent_api::phase::MediumPoint;
use resolvent_api::surface::SurfacePoint;
use resolvent_api::{
    Closure, Medium, Mode, Scatter, ScatterDraws, ScatterEval, ScatterSample, Spectrum, Vec3,
};
use resolvent_conformance::{Suite, property};
use resolvent_engine::plugin::{Instance, pending_failure};
use std::ffi::c_void;
use std::mem::MaybeUninit;
use std::sync::Mutex;

/// Failures kept.
const KEPT: usize = 8;

/// Calls that failed although there was nothing wrong with their input.
#[derive(Default)]
pub struct Failures(Mutex<(usize, Vec<String>)>);

impl Failures {
    fn note(&self, status: Status, sane: bool, call: impl FnOnce() -> String) {
        if status == Status::OK {
            return;
        }
        let why = pending_failure().unwrap_or_else(|| "without saying why".into());
        if !sane && matches!(status, Status::ERROR | Status::PANIC) {
            return;
        }
        let mut kept = self.0.lock().unwrap_or_else(|e| e.into_inner());
        kept.0 += 1;
        if kept.1.len() < KEPT {
            let text = format!("{} failed with status {}: {why}", call(), status.0);
            kept.1.push(text);
        }
    }

    /// Files what failed.
    pub fn file(&self, suite: &mut Suite, name: &str) {
        // A call that has no status reports a panic in this way alone.
        let silent = pending_failure();
        suite.about(property::FAILURES);
        suite.claim(silent.is_none(), || {
            format!("{name}: {}", silent.unwrap_or_default())
        });
        let kept = self.0.lock().unwrap_or_else(|e| e.into_inner());
        suite.claim(kept.0 == 0, || {
            let first = kept.1.first().map_or("", String::as_str);
            format!("{name}: {} calls fail, the first: {first}", kept.0)
        });
    }
}

/// A value with every bit set: NaN in numbers, and an event, phase or measure that doesn't exist.
fn poisoned<T>() -> MaybeUninit<T> {
    let mut out = MaybeUninit::<T>::uninit();
    // SAFETY: any bytes may be written to uninitialised memory.
    unsafe {
        out.as_mut_ptr()
            .cast::<u8>()
            .write_bytes(0xff, size_of::<T>())
    };
    out
}

/// A medium.
pub struct RawMedium<'a> {
    table: &'static MediumTable,
    instance: *const c_void,
    info: MediumInfo,
    failures: &'a Failures,
}

// SAFETY: the ABI asks that instances may be used from any thread.
unsafe impl Send for RawMedium<'_> {}
// SAFETY: as above.
unsafe impl Sync for RawMedium<'_> {}

impl<'a> RawMedium<'a> {
    /// Of an instance of a medium plugin.
    pub fn new(instance: &'a Instance, failures: &'a Failures) -> Self {
        let (header, pointer) = instance.raw();
        // SAFETY: the kind of the plugin says what its table is.
        let table = unsafe { &*header.table.cast::<MediumTable>() };
        let mut info = MediumInfo::default();
        // SAFETY: a live instance of this table's plugin.
        let status = unsafe { (table.info)(pointer, &mut info) };
        failures.note(status, true, || "info".into());
        Self {
            table,
            instance: pointer,
            info,
            failures,
        }
    }

    fn fly(
        &self,
        what: &str,
        f: unsafe extern "C" fn(
            *const c_void,
            *const Segment,
            *const FlightDraws,
            *mut Flight,
        ) -> Status,
        s: &Segment,
        u: &FlightDraws,
    ) -> Flight {
        let mut out = poisoned::<Flight>();
        // SAFETY: a live instance of this table's plugin; every bit pattern is a valid `Flight`, and all bits are written.
        let (status, flight) = unsafe {
            let status = f(self.instance, s, u, out.as_mut_ptr());
            (status, out.assume_init())
        };
        self.failures
            .note(status, sane(s), || format!("{what} of {s:?} with {u:?}"));
        if status == Status::OK {
            flight
        } else {
            Flight::vacuum(s.t1)
        }
    }
}

fn sane(s: &Segment) -> bool {
    let finite = |v: [f32; 3]| v.iter().all(|x| x.is_finite());
    finite(s.o) && unit(s.d.into()) && s.t0 >= 0.0 && s.t1 > s.t0
}

fn unit(d: Vec3) -> bool {
    (d.length_squared() - 1.0).abs() < 1e-3
}

impl Medium for RawMedium<'_> {
    fn info(&self) -> MediumInfo {
        self.info
    }

    fn sample(&self, s: &Segment, u: &FlightDraws) -> Flight {
        self.fly("sample", self.table.sample, s, u)
    }

    fn transmit(&self, s: &Segment, u: &FlightDraws) -> Flight {
        self.fly("transmit", self.table.transmit, s, u)
    }

    fn depth(&self, s: &Segment) -> Spectrum {
        let mut out = Spectrum::splat(f32::NAN);
        // SAFETY: a live instance of this table's plugin.
        let status = unsafe { (self.table.depth)(self.instance, s, &mut out) };
        self.failures
            .note(status, sane(s), || format!("depth of {s:?}"));
        out
    }

    fn coefficients(&self, p: Vec3) -> Coefficients {
        let nan = Spectrum::splat(f32::NAN);
        let mut out = Coefficients {
            sigma_t: nan,
            sigma_s: nan,
            emission: nan,
        };
        // SAFETY: as above.
        let status = unsafe { (self.table.coefficients)(self.instance, &p.to_array(), &mut out) };
        self.failures
            .note(status, p.is_finite(), || format!("coefficients at {p}"));
        out
    }
}

/// A closure of a phase function or BSDF.
pub struct RawClosure<'a> {
    closure: Closure,
    failures: &'a Failures,
}

impl<'a> RawClosure<'a> {
    /// Of a phase function at a point.
    pub fn phase(instance: &Instance, at: &MediumPoint, failures: &'a Failures) -> Self {
        let (header, pointer) = instance.raw();
        let mut closure = Closure::EMPTY;
        // SAFETY: the kind of the plugin says what its table is; the instance is alive.
        let status = unsafe {
            let table = &*header.table.cast::<PhaseTable>();
            (table.closure)(pointer, at, &mut closure)
        };
        failures.note(status, true, || format!("closure at {at:?}"));
        Self { closure, failures }
    }

    /// Of a BSDF at a point.
    pub fn bsdf(instance: &Instance, at: &SurfacePoint, failures: &'a Failures) -> Self {
        let (header, pointer) = instance.raw();
        let mut closure = Closure::EMPTY;
        // SAFETY: as above.
        let status = unsafe {
            let table = &*header.table.cast::<BsdfTable>();
            (table.closure)(pointer, at, &mut closure)
        };
        failures.note(status, true, || format!("closure at {at:?}"));
        Self { closure, failures }
    }
}

impl Scatter for RawClosure<'_> {
    fn eval(&self, wo: Vec3, wi: Vec3, mode: Mode) -> ScatterEval {
        let outcome = self.closure.try_eval(wo, wi, mode);
        outcome.unwrap_or_else(|status| {
            let sane = unit(wo) && unit(wi);
            self.failures
                .note(status, sane, || format!("eval of wo = {wo}, wi = {wi}"));
            ScatterEval::default()
        })
    }

    fn sample(&self, wo: Vec3, u: ScatterDraws, mode: Mode) -> Option<ScatterSample> {
        let outcome = self.closure.try_sample(wo, u, mode);
        outcome.unwrap_or_else(|status| {
            let draws = [u.lobe, u.dir[0], u.dir[1]];
            let sane = unit(wo) && draws.iter().all(|x| (0.0..1.0).contains(x));
            self.failures
                .note(status, sane, || format!("sample of wo = {wo}, {u:?}"));
            None
        })
    }

    fn lobes(&self) -> u32 {
        self.closure.lobes()
    }

    fn eta(&self) -> f32 {
        self.closure.eta()
    }
}

/// Bits of a BSDF's `traits`.
pub fn bsdf_traits(instance: &Instance) -> u32 {
    let (header, pointer) = instance.raw();
    // SAFETY: only called for BSDFs; a live instance.
    unsafe { ((*header.table.cast::<BsdfTable>()).traits)(pointer) }
}

//! Instances of plugins, and what becomes of their panics.

use super::Plugin;
use crate::abi::{CreateArgs, HostTable, Status};
use crate::panics::{install_hook, panic_text};
use crate::params::{Host, Params};
use core::ffi::c_void;
use core::sync::atomic::{AtomicPtr, Ordering};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// An instance with the way to its host.
pub(super) struct Instance<T> {
    pub value: T,
    pub host: Host,
}

/// Runs `f`, turning a panic into [`Status::PANIC`] with a message to the host.
#[inline(always)]
pub(super) fn guarded(host: Host, f: impl FnOnce() -> Status) -> Status {
    match catch_unwind(AssertUnwindSafe(f)) {
        Ok(status) => status,
        Err(payload) => {
            host.fail(&panic_text(payload));
            Status::PANIC
        }
    }
}

pub(super) unsafe extern "C" fn create<T: Plugin>(args: *const CreateArgs) -> *mut c_void {
    install_hook();
    // SAFETY: the host passes valid arguments for the duration of the call.
    let args = unsafe { &*args };
    HOST.store(args.host.cast_mut(), Ordering::Relaxed);
    NAME.get_or_init(|| T::NAME);
    // SAFETY: as above; the host's table outlives the instance.
    let (params, host) = unsafe { (Params::new(args), Host::new(args.host)) };
    match catch_unwind(AssertUnwindSafe(|| T::create(&params))) {
        Ok(Ok(value)) => Box::into_raw(Box::new(Instance { value, host })).cast(),
        Ok(Err(e)) => {
            host.fail(&e.0);
            core::ptr::null_mut()
        }
        Err(payload) => {
            host.fail(&panic_text(payload));
            core::ptr::null_mut()
        }
    }
}

pub(super) unsafe extern "C" fn destroy<T: Plugin>(instance: *mut c_void) {
    // SAFETY: `instance` came from `create::<T>` and is passed here once.
    let instance = unsafe { Box::from_raw(instance.cast::<Instance<T>>()) };
    let host = instance.host;
    guarded(host, || {
        drop(instance);
        Status::OK
    });
}

/// # Safety
/// `p` came from `create::<T>` and was not destroyed.
#[inline(always)]
pub(super) unsafe fn instance<'a, T>(p: *const c_void) -> &'a Instance<T> {
    // SAFETY: by contract.
    unsafe { &*p.cast::<Instance<T>>() }
}

/// The host's table, for closures: they are plain data and carry no way to the host. A library holds one plugin and is loaded
/// by one program, so one place is enough.
static HOST: AtomicPtr<HostTable> = AtomicPtr::new(core::ptr::null_mut());

/// The plugin's name, for the same.
static NAME: std::sync::OnceLock<&'static str> = std::sync::OnceLock::new();

/// Reports a panic in a closure.
#[cold]
pub(super) fn closure_panicked(payload: Box<dyn std::any::Any + Send>) -> Status {
    let name = NAME.get().copied().unwrap_or_default();
    let text = format!("a closure of '{name}' {}", panic_text(payload));
    let table = HOST.load(Ordering::Relaxed);
    if !table.is_null() {
        // SAFETY: the table came with `create` and lives as long as the process.
        unsafe { Host::new(table) }.fail(&text);
    }
    Status::PANIC
}

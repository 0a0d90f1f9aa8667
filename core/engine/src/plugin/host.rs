//! The host's side of the services plugins may call.

use crate::texture::Binding;
use rayon::prelude::*;
use resolvent_api::SurfacePoint;
use resolvent_api::abi::{ABI_MINOR, HostTable, Task, Text};
use std::cell::RefCell;
use std::ffi::c_void;
use std::sync::RwLock;

/// Something a plugin or the engine wants the user to know.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// The picture may not be what was meant.
    Warning(String),
    /// For information.
    Info(String),
}

type Log = Box<dyn Fn(Message) + Send + Sync>;

static LOG: RwLock<Option<Log>> = RwLock::new(None);

thread_local! {
    static FAILURE: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Sends messages to `log` from now on; without one they are dropped.
pub fn set_log(log: impl Fn(Message) + Send + Sync + 'static) {
    if let Ok(mut slot) = LOG.write() {
        *slot = Some(Box::new(log));
    }
}

pub(crate) fn say(message: Message) {
    if let Ok(slot) = LOG.read()
        && let Some(log) = &*slot
    {
        log(message);
    }
}

pub(crate) fn warn(message: impl Into<String>) {
    say(Message::Warning(message.into()));
}

/// Takes the message of the plugin call on this thread that just failed.
pub(super) fn take_failure() -> String {
    pending_failure().unwrap_or_else(|| "failed without saying why".into())
}

/// Takes what a plugin reported on this thread and nobody asked for yet, if anything: calls without a status (a BSDF's traits,
/// a closure's lobes) report a panic in this way alone.
pub fn pending_failure() -> Option<String> {
    FAILURE.with(|f| f.borrow_mut().take())
}

/// The table every plugin is given.
pub(super) static HOST: HostTable = HostTable {
    size: size_of::<HostTable>() as u32,
    abi_minor: ABI_MINOR,
    ctx: std::ptr::null_mut(),
    log,
    fail,
    parallel_for,
    texture,
    texture_at,
};

/// No lock and no allocation: what it reads was made before the instance that holds the handle.
unsafe extern "C" fn texture(
    _: *mut c_void,
    texture: *const c_void,
    uv: *const [f32; 2],
    out: *mut [f32; 4],
) {
    // SAFETY: the plugin passes a handle that its instance was made with, which keeps the binding alive, and valid pointers.
    unsafe { *out = (*texture.cast::<Binding>()).at(*uv, &WHITE) };
}

/// The colour of meshes that have none.
const WHITE: [f32; 4] = [1.0; 4];

/// As above.
unsafe extern "C" fn texture_at(
    _: *mut c_void,
    texture: *const c_void,
    at: *const SurfacePoint,
    out: *mut [f32; 4],
) {
    // SAFETY: the plugin passes a handle that its instance was made with, which keeps the binding alive, and valid pointers.
    unsafe { *out = (*texture.cast::<Binding>()).at((*at).uv, &(*at).color) };
}

unsafe extern "C" fn log(_: *mut c_void, level: u32, message: Text) {
    // SAFETY: the plugin passes a text valid for the call.
    let text = unsafe { message.to_owned() };
    say(if level == 0 {
        Message::Warning(text)
    } else {
        Message::Info(text)
    });
}

unsafe extern "C" fn fail(_: *mut c_void, message: Text) {
    // SAFETY: as above.
    let text = unsafe { message.to_owned() };
    FAILURE.with(|f| *f.borrow_mut() = Some(text));
}

unsafe extern "C" fn parallel_for(_: *mut c_void, count: usize, task: Task, data: *const c_void) {
    struct Data(*const c_void);
    // SAFETY: the ABI asks for tasks that may run on any thread, several at once.
    unsafe impl Sync for Data {}
    impl Data {
        fn get(&self) -> *const c_void {
            self.0
        }
    }
    let data = Data(data);
    (0..count).into_par_iter().for_each(|i| {
        // SAFETY: `data` is what the plugin gave with `task`, valid until this function returns.
        unsafe { task(data.get(), i) }
    });
}

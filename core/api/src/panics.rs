//! What panics say, kept for the host.

std::thread_local! {
    static PANIC_PLACE: core::cell::RefCell<String> = const { core::cell::RefCell::new(String::new()) };
}

/// Keeps the place of a panic for the message instead of printing it: the host says it once, with the plugin's name.
/// A shared library has its own copy of the standard library, so this hook is the plugin's alone.
pub(crate) fn install_hook() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        std::panic::set_hook(Box::new(|info| {
            let place = info
                .location()
                .map(|l| format!(" at {l}"))
                .unwrap_or_default();
            PANIC_PLACE.with(|p| *p.borrow_mut() = place);
        }));
    });
}

/// A panic in a task of [`Host::parallel_for`](crate::params::Host::parallel_for), passed on with the words of [`panic_text`].
pub(crate) struct TaskPanic(pub String);

/// The words for a caught panic. The payload is leaked: a destructor of it could panic again, outside of any guard.
pub(crate) fn panic_text(payload: Box<dyn std::any::Any + Send>) -> String {
    let payload = Box::leak(payload);
    if let Some(task) = payload.downcast_ref::<TaskPanic>() {
        return format!("{} (in a parallel task)", task.0);
    }
    let text = payload
        .downcast_ref::<&str>()
        .map(|s| s.to_string())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "(no message)".into());
    let place = PANIC_PLACE.with(|p| core::mem::take(&mut *p.borrow_mut()));
    format!("panicked{place}: {text}")
}

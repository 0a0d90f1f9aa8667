//! What is said while working, on standard error.

use indicatif::ProgressBar;
use std::io::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

static QUIET: AtomicBool = AtomicBool::new(false);
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// From now on only warnings and errors are printed, or everything.
pub fn set_quiet(quiet: bool) {
    QUIET.store(quiet, Ordering::Relaxed);
}

/// True if only warnings and errors are printed.
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Lines are printed above this bar while it is shown.
pub fn set_bar(bar: Option<ProgressBar>) {
    *BAR.lock().unwrap_or_else(|e| e.into_inner()) = bar;
}

/// A line that `--quiet` leaves out.
pub fn info(text: impl AsRef<str>) {
    if !is_quiet() {
        line(text.as_ref());
    }
}

/// A line that is always printed: the picture may not be what was meant.
pub fn warning(text: impl AsRef<str>) {
    line(&format!("warning: {}", text.as_ref()));
}

/// A line.
pub fn line(text: &str) {
    // A closed standard error is no reason to stop.
    let print = || drop(writeln!(std::io::stderr(), "{text}"));
    let bar = BAR.lock().unwrap_or_else(|e| e.into_inner());
    match &*bar {
        Some(bar) => bar.suspend(print),
        None => print(),
    }
}

//! How work that has no end in sight is stopped from outside.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Calls of an integrator between two looks at the flags and the clock: less than a millisecond.
const CALLS: u32 = 256;

/// What ends a piece of work before it is done: paths in media that hardly absorb can be of any length.
#[derive(Clone, Copy)]
pub struct Until<'u> {
    /// Any of them may be set by others.
    pub flags: [&'u AtomicBool; 2],
    /// When time is over, if it is limited.
    pub deadline: Option<Instant>,
}

/// No flag that anybody sets.
static UNSET: AtomicBool = AtomicBool::new(false);

impl Until<'_> {
    /// Work that goes on until it is done.
    pub const NEVER: Self = Self {
        flags: [&UNSET; 2],
        deadline: None,
    };

    /// True from the moment on that the work is to end.
    pub fn is_now(&self) -> bool {
        self.flags.iter().any(|f| f.load(Ordering::Relaxed))
            || self.deadline.is_some_and(|d| Instant::now() >= d)
    }

    /// The same at every [`CALLS`]th of the calls that `calls` counts.
    #[inline(always)]
    pub(super) fn is_due(&self, calls: u32) -> bool {
        calls.is_multiple_of(CALLS) && self.is_now()
    }
}

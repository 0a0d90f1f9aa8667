//! Who runs the work: the caller's threads, not the library's.

/// A way to run independent tasks, given by the caller so that decoding uses the caller's threads.
///
/// With rayon: `(0..count).into_par_iter().for_each(|i| task(i))`.
pub trait Parallel: Sync {
    /// Calls `task(i)` exactly once for each `i` in `0..count`, in any order, on any threads, and
    /// returns when all calls have returned. It may leave calls out to give up: reading then ends
    /// with [`ErrorKind::Cancelled`](crate::ErrorKind::Cancelled).
    fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync));
}

/// Runs the tasks one after another on the calling thread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Serial;

impl Parallel for Serial {
    fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
        (0..count).for_each(task);
    }
}

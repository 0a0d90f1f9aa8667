//! `resolvent plugin check` passes every plugin that is built here, and catches every one that is broken on purpose.

mod broken;
mod builtin;
mod program;
#[cfg(target_os = "linux")]
mod races;

//! The program as a user runs it: every test starts the real binary.

mod bench;
mod checkpoint;
mod determinism;
mod errors;
mod files;
mod hostile;
#[cfg(unix)]
mod interrupt;
mod models;
mod program;
mod render;
mod skips;
mod stats;
mod textures;
mod tools;
mod usd;
mod volume;
#[cfg(unix)]
mod watch;

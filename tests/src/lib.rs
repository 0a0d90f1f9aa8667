//! How Resolvent tests itself: the conformance kit, for tests of plugins and of the whole program.

pub use resolvent_conformance::*;

//! Resolvent: engine.

//! Resolvent: procedural.

//! Resolvent: ply.

//! Resolvent: diffuse.

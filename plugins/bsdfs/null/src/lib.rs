//! Resolvent: null.

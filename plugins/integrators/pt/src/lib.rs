//! Resolvent: pt.

//! Resolvent: hg.

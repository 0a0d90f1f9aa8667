//! Resolvent: two-lobe-hg.

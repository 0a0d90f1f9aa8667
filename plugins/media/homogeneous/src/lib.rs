//! Resolvent: homogeneous.

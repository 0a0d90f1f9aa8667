//! Resolvent: pathspace.

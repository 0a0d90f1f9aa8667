//! Resolvent: api.

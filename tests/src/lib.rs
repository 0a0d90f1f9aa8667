//! Resolvent: tests.

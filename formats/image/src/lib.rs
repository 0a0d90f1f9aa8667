//! Resolvent: image.

//! Resolvent: scene.

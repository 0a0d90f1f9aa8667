//! Resolvent: isotropic.

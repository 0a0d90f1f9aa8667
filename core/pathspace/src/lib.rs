//! The path space: what every integrator is written with.
//!
//! A path is a chain of vertices, each on a surface or in a medium; both kinds share one vertex type, one geometry term,
//! one set of density conversions and one weight computation (Jakob 2013, "Light Transport on Path-Space Manifolds", ch. 3).
//! [`scatter`] is K at a vertex with the symmetry corrections, [`measure`] converts densities, [`mis`] weighs techniques,
//! [`sampler`] gives the primary samples, [`roulette`] ends paths, [`orders`] tells light by how often it was scattered.

#![forbid(unsafe_code)]

pub mod bidirectional;
pub mod chain;
pub mod features;
pub mod measure;
pub mod mis;
pub mod nets;
pub mod orders;
pub mod roulette;
pub mod sampler;
pub mod samples;
pub mod scatter;
mod sobol;

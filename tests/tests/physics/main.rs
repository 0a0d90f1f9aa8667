//! The whole renderer against exact answers: scene description, plugins loaded at run time, engine, film.
//!
//! The tables in `data/physics` are closed forms, converged quadratures and deterministic solutions of the transport
//! equation; see the page there. Every test renders the rows of one table and compares means with values at the
//! family-wise level of 0.1 %, with standard errors of at most 0.3 % of the value ([`harness::Precision`]).
//!
//! Some tables run a stated part of their rows by default and all of them with `RESOLVENT_FULL=1` in the environment.
//! Figures are printed with `--nocapture`.

mod agreement;
mod gain;
mod harness;
mod judge;
mod report;
mod scenes;

mod boundaries;
mod instances;
mod lights;
mod limits;
mod materials;
mod nested;
mod orders;
mod peers;
mod points;
mod reuse;
mod slab_flux;
mod slab_radiance;
mod soak;
mod strategies;
mod stress_index;
mod stress_media;
mod stress_places;
mod stress_rest;
mod stress_world;
mod student;
mod surfaces;
mod transmittance;
mod weights;

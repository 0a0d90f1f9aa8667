//! The boundary between the renderer and its plugins, from outside: plugins compiled apart, plugins that misbehave, libraries
//! that are none, plugins in C, and parameters that do not fit.
//!
//! What is loaded here is built by the tests themselves, from `tests/fixtures`, with the `cargo` that runs them and the
//! system's C compiler `cc`. Builds are kept below the target folder, so only the first run pays for them.

mod abi;
mod apart;
mod build;
mod c_plugin;
mod drive;
mod integrator;
mod medium;
mod params;
mod program;
mod scatterers;

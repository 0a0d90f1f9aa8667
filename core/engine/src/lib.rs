//! Resolvent's host: from a scene's description to a film.
//!
//! [`plugin`] finds and loads plugins, [`scene`] builds and plans the scene and is G for the integrators, [`geometry`] traces rays,
//! [`light`] has the lights, [`mod@texture`] the images, [`film`] the sums, [`render()`] divides the work. The engine never names a concrete plugin.

mod camera;
mod error;
pub mod film;
mod filter;
pub mod geometry;
pub mod light;
pub mod plugin;
mod render;
pub mod scene;
pub mod texture;

pub use error::{Error, Result};
pub use render::{Broken, Goal, Progress, Rendered, Settings, render, with_threads};

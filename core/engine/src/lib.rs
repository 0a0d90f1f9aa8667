//! Resolvent's host: from a scene's description to a film.
//!
//! [`plugin`] finds and loads plugins, [`scene`] builds and plans the scene and is G for the integrators, [`geometry`] traces rays,
//! [`light`] has the lights, [`mod@texture`] the images, [`film`] the sums, [`render()`] divides the work,
//! [`checkpoint`] keeps it. The engine never names a concrete plugin.

mod camera;
pub mod checkpoint;
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
pub use render::{Broken, Goal, Keep, Progress, Rendered, Settings, go_on, render, with_threads};

//! Textures: images read once, shared by all who use them, and looked up at texture coordinates.
//!
//! [`Textures`] reads an image when the first user asks for it, [`Texture`] is an image with the settings of one of the
//! scene's textures, [`Binding`] is a texture with the range of one parameter: what plugins hold a handle to.

mod environment;
mod lookup;
mod srgb;
mod store;

pub use environment::read_environment;
pub use lookup::Texture;
pub use store::{Binding, ReadImage, Textures};

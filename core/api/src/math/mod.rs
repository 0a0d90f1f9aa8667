//! Vectors (glam's), frames, boxes, transforms and sampling warps.

mod aabb;
mod affine;
mod frame;
pub mod hg;
pub mod warp;

pub use aabb::Aabb;
pub use affine::Affine;
pub use frame::Frame;
pub use glam::{DVec3, Vec3};

/// A vector as it crosses the plugin boundary: three consecutive `f32`.
pub type Float3 = [f32; 3];

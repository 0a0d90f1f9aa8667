//! The scene: built once from its description, planned once, then only read.

mod build;
mod instances;
mod interiors;
mod media;
mod shapes;
mod transport;
mod view;

pub use build::{Preparation, Scene};
pub use view::{Counters, View};

use crate::plugin::{ForeignBsdf, ForeignMedium};

/// What stands behind a shape.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Index of its material; none absorbs everything.
    pub material: Option<u32>,
    /// Index of the light it is, if it emits.
    pub light: Option<u32>,
    /// What is inside, as a bit of the sets that say where a point is.
    pub interior: Option<u32>,
    /// Light passes as if it were not there.
    pub null: bool,
    /// Bits of the interiors within which it is not there.
    pub hidden_by: u64,
}

impl Surface {
    /// True if a ray that is inside of `inside` passes as if it were not there.
    #[inline(always)]
    pub(crate) fn passes(&self, inside: u64) -> bool {
        self.null || self.hidden_by & inside != 0
    }
}

/// A material of the scene.
pub struct Material {
    /// Its name there.
    pub name: String,
    /// Its BSDF.
    pub bsdf: ForeignBsdf,
}

/// A medium of the scene.
pub struct PlacedMedium {
    /// Its name there.
    pub name: String,
    /// The medium.
    pub medium: ForeignMedium,
    /// Stands free, bounded by itself; otherwise it fills shapes.
    pub free: bool,
    /// Bits of the interiors that it fills.
    pub interiors: u64,
}

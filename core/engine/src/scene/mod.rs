//! The scene: built once from its description, planned once, then only read.

mod build;
mod enclosure;
mod hierarchy;
mod instances;
mod interiors;
mod lights;
mod media;
mod normal_map;
mod shapes;
mod starts;
mod transport;
mod until;
mod view;

pub use build::{Preparation, Scene};
pub use normal_map::NormalMap;
pub use until::Until;
pub use view::{Counters, View};

use crate::plugin::{ForeignBsdf, ForeignMedium};
use std::sync::atomic::AtomicBool;

/// What stands behind a shape.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surface {
    /// Index of its material; none absorbs everything.
    pub material: Option<u32>,
    /// Index of the light it is, if it emits.
    pub light: Option<u32>,
    /// What is inside: the number of a counter in the sets that say where a point is.
    pub interior: Option<u32>,
    /// Light passes as if it were not there.
    pub null: bool,
    /// Counters of the interiors within which it is not there.
    pub hidden_by: u64,
    /// The counter of its own body if that refracts, else 0: within another part of the body it is not there.
    pub body: u64,
}

impl Surface {
    /// False if rays never pass it.
    #[inline(always)]
    pub(crate) fn may_pass(&self) -> bool {
        self.null || self.hidden_by | self.body != 0
    }

    /// True if a ray inside of `inside` passes as if the surface were not there; `leaving` says that it comes from its inner side.
    #[inline(always)]
    pub(crate) fn passes(&self, inside: u64, leaving: bool) -> bool {
        // On the way out, one count is that of the part which is left.
        let own = if leaving {
            self.body & self.body.wrapping_neg()
        } else {
            0
        };
        self.null || self.hidden_by & inside != 0 || self.body & inside > own
    }
}

/// A material of the scene.
pub struct Material {
    /// Its name there.
    pub name: String,
    /// Its BSDF.
    pub bsdf: ForeignBsdf,
    /// Turns the shading frame before the BSDF sees it.
    pub normal_map: Option<NormalMap>,
}

/// A medium of the scene.
pub struct PlacedMedium {
    /// Its name there.
    pub name: String,
    /// The medium.
    pub medium: ForeignMedium,
    /// Stands free, bounded by itself; otherwise it fills shapes.
    pub free: bool,
    /// Counters of the interiors that it fills.
    pub interiors: u64,
    /// Its extinction was found above its majorant.
    pub violated: AtomicBool,
}

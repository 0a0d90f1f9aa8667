//! What is known of a grid before its voxels are read.

use std::fmt;

use crate::encoding::{Compression, Encoding};
use crate::error::Error;
use crate::metadata::Metadata;
use crate::transform::Transform;
use crate::value::ValueType;

/// What a grid's values mean, from its metadata.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum GridClass {
    /// Not said.
    #[default]
    Unknown,
    /// Signed distances near a surface.
    LevelSet,
    /// Densities.
    FogVolume,
    /// Vectors whose components live on the faces of a voxel.
    Staggered,
}

impl GridClass {
    pub(crate) fn from_name(name: &str) -> Self {
        match name {
            "level set" => Self::LevelSet,
            "fog volume" => Self::FogVolume,
            "staggered" => Self::Staggered,
            _ => Self::Unknown,
        }
    }
}

impl fmt::Display for GridClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Unknown => "unknown",
            Self::LevelSet => "level set",
            Self::FogVolume => "fog volume",
            Self::Staggered => "staggered",
        })
    }
}

/// A grid as its descriptor, metadata and transform describe it; its voxels are not read yet.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GridInfo {
    /// Its name. Several grids of a file may share one.
    pub name: String,
    /// Its name, with `[0]`, `[1]`, … appended where several grids share it.
    pub unique_name: String,
    /// The tree's type, for example `Tree_float_5_4_3`.
    pub tree_type: String,
    /// The type of its values, `None` if this reader does not support the tree.
    pub value_type: Option<ValueType>,
    /// What its values mean.
    pub class: GridClass,
    /// Whether its floats are stored with 16 bits.
    pub saved_as_half: bool,
    /// How its buffers are compressed.
    pub compression: Compression,
    /// Its metadata.
    pub metadata: Metadata,
    /// From index to world space; `None` only if the grid is refused.
    pub transform: Option<Transform>,
    /// The unique name of the grid whose tree this one shares, if it is an instance.
    pub instance_of: Option<String>,
    /// The grid's first byte and the one behind its last.
    pub range: [u64; 2],
    /// Why the grid cannot be read, if it cannot.
    pub refusal: Option<Error>,
    pub(crate) tree: Option<TreePlace>,
}

impl GridInfo {
    /// `name (type, class)`, as error messages list grids.
    pub fn summary(&self) -> String {
        let kind = self
            .value_type
            .map_or(self.tree_type.as_str(), |kind| kind.name());
        let class = match self.class {
            GridClass::Unknown => String::new(),
            class => format!(", {class}"),
        };
        let note = if self.refusal.is_some() {
            ", not readable"
        } else {
            ""
        };
        format!("{} ({kind}{class}{note})", self.unique_name.escape_debug())
    }
}

/// Where a grid's tree is and how to decode it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreePlace {
    pub encoding: Encoding,
    /// File offset of the topology.
    pub start: u64,
    /// File offset behind the leaves.
    pub limit: u64,
}

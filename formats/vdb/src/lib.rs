//! A reader of OpenVDB files in safe Rust.
//!
//! Read: format versions 221 to 225; trees `Tree_*_5_4_3` of `float`, `double`, `vec3s`, `vec3d`,
//! `vec3i`, `int32`, `int64`, `bool` and `mask`, floats also saved as half; buffers plain, zip or
//! Blosc, with or without active-mask compression; tiles at every level; all linear transforms;
//! several grids, equal names, instances, files with and without grid offsets. What is not read
//! (points, other trees, frustum transforms) is refused by name and does not hide the other grids.
//!
//! Damaged and hostile files give an [`Error`] that names file, grid, byte and reason. They cannot
//! cause a panic, an endless loop, or an allocation that the file's size does not justify.
//!
//! # Use
//! Reading goes in three steps, so that a caller can decode straight into its own storage:
//!
//! 1. [`File::open`] reads header and grid descriptions: a few kilobytes ([`File::bytes_read`]).
//! 2. [`File::read_topology`] reads the shape of one grid's tree: background, tiles, origin and
//!    active mask of each leaf.
//! 3. [`File::read_leaves_into`] decodes the leaves' 512 values each, in parallel on the caller's
//!    threads ([`Parallel`]), into one element per leaf of the caller's slice.
//!    ([`File::read_leaves`] is the same with a plain callback.)
//!
//! Voxel (x, y, z) of a leaf has the offset `(x << 6) | (y << 3) | z` in values and mask: **x varies
//! slowest**. Voxel (i, j, k) is centred at `transform.to_world([i, j, k])`.
//!
//! ```no_run
//! use resolvent_vdb::{File, Halves, LeafValues, Parallel, Serial};
//!
//! /// The host's threads; with rayon `(0..count).into_par_iter().for_each(|i| task(i))`.
//! struct Pool;
//! impl Parallel for Pool {
//!     fn run(&self, count: usize, task: &(dyn Fn(usize) + Sync)) {
//!         (0..count).for_each(task)
//!     }
//! }
//!
//! let file = File::open("cloud.vdb")?;
//! let grid = file.grid("density")?; // or: file.grids().iter().find(…)
//! let topology = file.read_topology(grid)?;
//!
//! let mut bricks = vec![[0.0_f32; 512]; topology.leaves().len()];
//! file.read_leaves_into(grid, &topology, Halves::Widen, &Pool, &mut bricks, |_leaf, values, brick| {
//!     let scalar = values.to_f32(brick); // false for vectors: look at grid.value_type first
//!     debug_assert!(scalar);
//! })?;
//! for (leaf, brick) in topology.leaves().iter().zip(&bricks) {
//!     let _ = (leaf.origin, leaf.mask, brick);
//! }
//! for tile in topology.tiles() {
//!     let _ = (tile.origin, tile.dim, tile.value.to_f32(), tile.active);
//! }
//!
//! // Halves may stay halves, where the brick pool has them:
//! file.read_leaves(grid, &topology, Halves::Keep, &Serial, |_leaf, values| {
//!     if let LeafValues::F16(_values) = values { /* &[half::f16; 512] */ }
//! })?;
//! # Ok::<(), resolvent_vdb::Error>(())
//! ```
//!
//! # Format
//! OpenVDB has no specification; what is written here follows the files it writes (checked against
//! OpenVDB 10.0.1's reading of them, see `tests/`) and its published headers. Numbers are little
//! endian.
//!
//! ```text
//! archive   magic, version, library version, offsets flag, UUID, metadata, grid count
//! grid      descriptor: name, tree type, instance parent, offsets of grid, leaves and end
//!           compression flags, metadata, transform
//!   topology  background; root tiles; per node: child and value masks, values of its tiles
//!             (a node of 32³, then its nodes of 16³, then their leaves' masks, depth first)
//!   buffers   per leaf, in the same order: mask again, code for inactive values, values
//! ```
#![forbid(unsafe_code)]

mod blosc;
mod descriptor;
mod encoding;
mod error;
mod file;
mod grid;
mod header;
mod leaf_record;
mod leaf_values;
mod leaves;
mod metadata;
mod parallel;
mod reader;
mod source;
mod statistics;
mod tiles;
mod topology;
mod transform;
mod tree;
mod value;
mod walk;

pub use encoding::{Codec, Compression};
pub use error::{Error, ErrorKind, Result};
pub use file::File;
pub use grid::{GridClass, GridInfo};
pub use leaf_values::{Halves, LEAF_VOXELS, LeafValues};
pub use metadata::{MetaEntry, MetaValue, Metadata};
pub use parallel::{Parallel, Serial};
pub use statistics::Statistics;
pub use tiles::Tile;
pub use topology::{LeafNode, Topology};
pub use transform::Transform;
pub use tree::Tree;
pub use value::{Value, ValueType};

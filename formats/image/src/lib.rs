//! Resolvent's images: multi-layer OpenEXR, PNG through a stated tone map, writing that a crash cannot cut
//! in half, and the comparison of two pictures.
//!
//! - [`Image`]: named layers of named f32 channels, and text metadata. The layer [`BEAUTY`] is the picture
//!   itself, linear Rec. 709.
//! - [`Image::read_exr`], [`Image::write_exr`]: OpenEXR, also files of other programs. [`ExrInfo::read`] reads
//!   the header alone.
//! - [`Image::write_png`] with a [`ToneMap`].
//! - [`Texels`]: PNG, JPEG, Radiance HDR and OpenEXR read in the precision that the file has, for textures.
//! - [`write_atomically`]: to a temporary name, synced, renamed.
//! - [`compare()`]: MSE, relative MSE, ratio of means, and a z-test per region.
//!
//! ```
//! use resolvent_image::{BEAUTY, Image, ToneMap};
//!
//! let mut image = Image::new(2, 1);
//! image.push(BEAUTY, [("R", vec![0.1, 4.0]), ("G", vec![0.2, 3.0]), ("B", vec![0.3, 2.0])]);
//! image.push("samples", [("N", vec![64.0, 64.0])]);
//! image.metadata.insert("seed".into(), "7".into());
//! let folder = std::env::temp_dir();
//! let path = folder.join(format!("resolvent-doc-{}.exr", std::process::id()));
//! image.write_exr(&path)?;
//! assert_eq!(Image::read_exr(&path)?, image);
//! # std::fs::remove_file(&path).unwrap();
//! let path = path.with_extension("png");
//! image.write_png(&path, &ToneMap { exposure: -1.0, ..ToneMap::default() })?;
//! # std::fs::remove_file(&path).unwrap();
//! # Ok::<(), resolvent_image::Error>(())
//! ```

mod atomic;
pub mod compare;
mod error;
mod exr_info;
mod exr_read;
mod exr_write;
mod image;
mod png;
mod texels;
mod tone;

pub use atomic::{destination, remove_leftovers, write_atomically};
pub use compare::{Comparison, RegionTest, Regions, compare};
pub use error::Error;
pub use exr_info::{ChannelInfo, ExrInfo};
pub use exr_read::Limits;
pub use image::{BEAUTY, Channel, Image, Layer};
pub use texels::{TexelData, Texels};
pub use tone::{Curve, ToneMap};

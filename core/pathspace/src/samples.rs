//! The samples of a piece of work, in the order in which the film wants them.

use crate::orders::Tally;
use resolvent_api::Output;
use resolvent_api::abi::{PixelSample, Tile};
use resolvent_api::integrator::Outcome;

/// One sample.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Column and row of its pixel.
    pub pixel: [u32; 2],
    /// Number of its pixel in the full image, in rows from the top: what random numbers are keyed by.
    pub index: u64,
    /// Number of the sample in its pixel.
    pub sample: u32,
}

/// Runs `path` for every sample of every pixel of a piece of work, in order, and adds what it gives; `tally` hears of its light.
///
/// # Errors
/// What `path` stops with, or the film.
#[inline(always)]
pub fn each<'o, T: Tally>(
    tile: &Tile,
    out: &mut Output<'o>,
    mut tally: T,
    mut path: impl FnMut(&mut Output<'o>, &mut T, Place) -> Outcome<PixelSample>,
) -> Outcome<()> {
    for y in tile.min[1]..tile.max[1] {
        for x in tile.min[0]..tile.max[0] {
            let index = u64::from(y) * u64::from(tile.resolution[0]) + u64::from(x);
            for sample in tile.sample_begin..tile.sample_end {
                let place = Place {
                    pixel: [x, y],
                    index,
                    sample,
                };
                let found = path(out, &mut tally, place)?;
                tally.finish(out, place.pixel, &found)?;
            }
        }
    }
    Ok(())
}

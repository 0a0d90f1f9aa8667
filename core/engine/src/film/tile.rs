//! Tiles: the pixels that are rendered together, and their sums.

use super::coverage::Coverage;
use super::fixed::{Squares, add, float};
use std::ops::Range;

/// Edge of a tile, pixels. `--error` keeps the error of every tile below its goal, and the smaller they are, the closer samples follow
/// the noise; smaller ones still would leave too few pixels to judge it by.
pub const TILE: u32 = 8;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// First column and row.
    pub min: [u32; 2],
    /// One past the last column and row.
    pub max: [u32; 2],
}

impl Rect {
    /// Number of its pixels.
    pub fn pixels(&self) -> usize {
        (self.max[0] - self.min[0]) as usize * (self.max[1] - self.min[1]) as usize
    }

    /// Where its pixels are in the rows of a window, in rows from its top.
    pub fn indices(&self, window: [u32; 4]) -> impl Iterator<Item = usize> + Clone + use<> {
        let width = (window[2] - window[0]) as usize;
        let columns = self.min[0] - window[0]..self.max[0] - window[0];
        (self.min[1] - window[1]..self.max[1] - window[1]).flat_map(move |y| {
            columns
                .clone()
                .map(move |x| y as usize * width + x as usize)
        })
    }

    /// Those of its pixels that are at most `reach` columns and rows from pixel `i`, counted in rows from the top of the window.
    pub fn near(&self, window: [u32; 4], i: usize, reach: u32) -> Self {
        let width = (window[2] - window[0]) as usize;
        let at = [
            window[0] + (i % width) as u32,
            window[1] + (i / width) as u32,
        ];
        Self {
            min: [0, 1].map(|k| self.min[k].max(at[k].saturating_sub(reach))),
            max: [0, 1].map(|k| self.max[k].min(at[k] + 1 + reach)),
        }
    }
}

/// Tiles across and down.
fn grid(window: [u32; 4]) -> [usize; 2] {
    [0, 1].map(|k| (window[k + 2] - window[k]).div_ceil(TILE) as usize)
}

/// Number of tiles of a window.
pub fn count(window: [u32; 4]) -> usize {
    let [across, down] = grid(window);
    across * down
}

/// Tile `i` of a window, in rows from the top.
pub fn rect(window: [u32; 4], i: usize) -> Rect {
    let across = grid(window)[0];
    let corner = [(i % across) as u32, (i / across) as u32];
    let min = [0, 1].map(|k| window[k] + corner[k] * TILE);
    Rect {
        min,
        max: [0, 1].map(|k| (min[k] + TILE).min(window[k + 2])),
    }
}

/// All tiles of a window.
pub fn all(window: [u32; 4]) -> impl ExactSizeIterator<Item = Rect> + use<> {
    (0..count(window)).map(move |i| rect(window, i))
}

/// The tile that has the pixel at `position`.
pub fn at(window: [u32; 4], position: [u32; 2]) -> usize {
    let [column, row] = [0, 1].map(|k| ((position[k] - window[k]) / TILE) as usize);
    row * grid(window)[0] + column
}

/// The tile that has pixel `i`, counted in rows from the top of the window.
pub fn of_pixel(window: [u32; 4], i: usize) -> usize {
    let width = (window[2] - window[0]) as usize;
    (i / width / TILE as usize) * grid(window)[0] + i % width / TILE as usize
}

/// What a tile has of a net.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Samples of every pixel.
    pub samples: u32,
    /// Sums of its pixels.
    pub pixels: Vec<[i128; 3]>,
    /// Light that its walks from lights left on any pixel.
    pub splats: [i128; 3],
}

impl Part {
    /// Adds another part of the same net.
    pub fn join(&mut self, other: &Self) {
        self.samples += other.samples;
        for (a, b) in self.pixels.iter_mut().zip(&other.pixels) {
            add(a, *b);
        }
        add(&mut self.splats, other.splats);
    }

    /// What it adds to the picture, a mean over the tile's pixels of their sums, for a picture of `pixels` pixels.
    pub fn mean(&self, pixels: usize) -> [f64; 3] {
        tile_mean(&self.pixels, self.splats, pixels)
    }
}

/// A mean over the sums of a tile's own pixels, and of what its walks from lights left on any of the picture's `pixels` pixels: a
/// splat is divided by the samples of all of them.
pub fn tile_mean<'p>(
    own: impl IntoIterator<Item = &'p [i128; 3]>,
    splats: [i128; 3],
    pixels: usize,
) -> [f64; 3] {
    let (mut sum, mut count) = ([0; 3], 0);
    for p in own {
        add(&mut sum, *p);
        count += 1;
    }
    let scale = 1.0 / f64::from(count.max(1));
    [0, 1, 2].map(|k| scale * (float(sum[k]) + float(splats[k]) / pixels.max(1) as f64))
}

/// What is known of a tile beyond its pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TileSums {
    coverage: Coverage,
    samples: u32,
    nets: u32,
    /// Light that its walks from lights left on any pixel.
    pub splats: [i128; 3],
    /// Σ over nets of (mean over the tile's pixels of the net's sums)²/samples of the net.
    pub squares: [Squares; 3],
}

impl TileSums {
    /// Which samples there are.
    pub fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// Samples of every pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Nets, or parts of them, that the samples are of.
    pub fn nets(&self) -> u32 {
        self.nets
    }

    /// Notes that samples are there.
    ///
    /// # Errors
    /// The first of them that are there already.
    pub fn cover(&mut self, samples: Range<u32>) -> Result<(), Range<u32>> {
        self.coverage.insert(samples)?;
        self.note();
        Ok(())
    }

    /// Notes that samples are there, and no others.
    pub fn set(&mut self, coverage: Coverage) {
        self.coverage = coverage;
        self.note();
    }

    /// Adds the sums of the same tile of another film.
    ///
    /// # Errors
    /// The first samples that both have; then something may have changed.
    pub fn join(&mut self, other: &Self) -> Result<(), Range<u32>> {
        self.coverage.join(&other.coverage)?;
        self.note();
        add(&mut self.splats, other.splats);
        let squares = self.squares.iter_mut().zip(other.squares);
        squares.for_each(|(a, b)| a.add(b));
        Ok(())
    }

    fn note(&mut self) {
        self.samples = self.coverage.samples();
        self.nets = self.coverage.nets();
    }
}

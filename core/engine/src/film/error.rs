//! How far a picture may be from the truth.

use super::fixed::is_faint;
use super::{Estimate, Film, tile};

/// Relative errors: of a tile the square root of the mean over its pixels and lanes of variance/(M² + 0.01 m²), with M the tile's
/// mean of the lane and m the picture's mean; of the picture, the root of the mean of their squares over all pixels.
///
/// A pixel's variance is not divided by its own mean: where bright light is rare, pixels that have met it have both large, and their
/// quotient would hide how noisy they are. So the squares are all but unbiased, whatever the tails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Of the picture.
    pub picture: f64,
    /// Of its worst tile.
    pub worst_tile: f64,
    /// Relative standard error of the square of the picture's error by tails alone, if a pixel's light came in as few equal events
    /// as its mean M and variance v allow, M²/v (the excess kurtosis of a Poisson number is the inverse of its mean). Large where
    /// few events have most of the error: then rare light is found by chance alone, and more may not have been found yet. The edge
    /// of a lamp, which every net finds, is none of that.
    pub doubt: f64,
}

/// Beyond this [`Errors::doubt`], that of 25 events, an error estimate is not to be trusted.
pub const DOUBTFUL: f64 = 0.2;

/// What is said of a picture that [`Film::is_faint`].
pub const TOO_FAINT: &str =
    "the picture is too faint for its error to be told: raise the camera's exposure";

impl Errors {
    /// True if tails are so heavy that the errors are no more than a guess.
    pub fn are_doubtful(&self) -> bool {
        !(self.doubt <= DOUBTFUL)
    }
}

impl Film {
    /// True if the picture's mean is above zero but so small (below 10⁻¹⁰) that its variance cannot be told.
    pub fn is_faint(&self) -> bool {
        is_faint(mean((0..self.pixels.len()).map(|i| self.estimate(i))))
    }

    /// Estimated relative errors; `None` before all pixels have two nets, and of a picture that [`Film::is_faint`].
    pub fn errors(&self) -> Option<Errors> {
        let of = |i| self.estimate(i);
        let mean = mean((0..self.pixels.len()).map(of));
        if is_faint(mean) {
            return None;
        }
        let floor = floor(mean);
        let (mut sum, mut tails, mut worst) = (0.0, 0.0, 0f64);
        for t in self.tiles() {
            let x = Square::of(t.indices(self.window).map(of), floor)?;
            sum += x.sum;
            tails += x.tails;
            worst = worst.max(x.mean());
        }
        Some(Errors {
            picture: (sum / self.pixels.len().max(1) as f64).sqrt(),
            worst_tile: worst.sqrt(),
            doubt: if sum > 0.0 { tails.sqrt() / sum } else { 0.0 },
        })
    }

    /// 0.01 m², by this half alone.
    pub(crate) fn half_floor(&self) -> f64 {
        floor(mean((0..self.pixels.len()).map(|i| self.half_estimate(i))))
    }

    /// Square of the relative error of a tile by this half alone, and one standard error of that square more: the first estimate
    /// below a goal is one of those that are too low. `None` before the half has two nets.
    pub(crate) fn half_error(&self, tile: usize, floor: f64) -> Option<f64> {
        let pixels = tile::rect(self.window, tile).indices(self.window);
        Square::of(pixels.map(|i| self.half_estimate(i)), floor).map(|x| x.mean() + x.error())
    }
}

/// Mean radiance over pixels and lanes.
fn mean(pixels: impl ExactSizeIterator<Item = Estimate>) -> f64 {
    let n = pixels.len().max(1) as f64;
    pixels
        .map(|e| e.mean.iter().sum::<f64>() / 3.0)
        .sum::<f64>()
        / n
}

/// What is added to the squares of means in a picture of mean `m`, so that black tiles do not count without bound.
fn floor(m: f64) -> f64 {
    0.01 * m * m
}

/// Squares of the relative errors of a tile's pixels.
struct Square {
    sum: f64,
    /// Sum of their squares.
    squares: f64,
    /// Variance of the sum by tails, see [`Errors::doubt`].
    tails: f64,
    count: f64,
}

impl Square {
    fn of(pixels: impl Iterator<Item = Estimate> + Clone, floor: f64) -> Option<Self> {
        let (mut mean, mut count) = ([0.0; 3], 0.0);
        for e in pixels.clone() {
            count += 1.0;
            mean = [0, 1, 2].map(|k| mean[k] + e.mean[k]);
        }
        let scale = mean.map(|m| match (m / count) * (m / count) + floor {
            s if s > 0.0 => 1.0 / (3.0 * s),
            _ => 0.0,
        });
        let (mut sum, mut squares, mut tails) = (0.0, 0.0, 0.0);
        for e in pixels {
            let v = e.variance?;
            let (mut x, mut over_events) = (0.0, 0.0);
            for k in 0..3 {
                let own = v[k] * scale[k];
                x += own;
                if own > 0.0 {
                    over_events += own * (v[k] / (e.mean[k] * e.mean[k])).min(1.0);
                }
            }
            sum += x;
            squares += x * x;
            // Lanes see the same events.
            tails += x * over_events;
        }
        Some(Self {
            sum,
            squares,
            tails,
            count,
        })
    }

    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    /// Standard error of the mean, by the spread over pixels.
    fn error(&self) -> f64 {
        let spread = self.squares / self.count - self.mean() * self.mean();
        (spread.max(0.0) / self.count).sqrt()
    }
}

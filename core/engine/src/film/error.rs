//! How far a picture may be from the truth.

use super::tile::tile_mean;
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
    /// Relative standard error of the square of the picture's error, by the spread over pixels. Large where few pixels have
    /// most of the error: then rare light is found by chance alone, and more of it may not have been found yet.
    pub doubt: f64,
}

/// Beyond this [`Errors::doubt`] an error estimate is not to be trusted.
pub const DOUBTFUL: f64 = 0.25;

impl Errors {
    /// True if tails are so heavy that the errors are no more than a guess.
    pub fn are_doubtful(&self) -> bool {
        !(self.doubt <= DOUBTFUL)
    }
}

/// The picture's mean, and how far from the truth it may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Mean over all pixels.
    pub mean: [f64; 3],
    /// Half the width of the interval that covers the true mean with a probability of 95 %, Student's t of `degrees`.
    pub half_width: [f64; 3],
    /// Degrees of freedom of the lane that has the least (Satterthwaite 1946). Few if little of the picture has most of the
    /// variance.
    pub degrees: f64,
}

impl Film {
    /// Estimated relative error of the picture, see [`Errors`]; `None` before all pixels have two nets.
    pub fn relative_error(&self) -> Option<f64> {
        self.errors().map(|e| e.picture)
    }

    /// Estimated relative errors; `None` before all pixels have two nets.
    pub fn errors(&self) -> Option<Errors> {
        let of = |i| self.estimate(i);
        let floor = floor((0..self.pixels.len()).map(of));
        let (mut sum, mut squares, mut worst) = (0.0, 0.0, 0f64);
        for t in self.tiles() {
            let x = Square::of(t.indices(self.window).map(of), floor)?;
            sum += x.sum;
            squares += x.squares;
            worst = worst.max(x.mean());
        }
        let n = self.pixels.len().max(1) as f64;
        let mean = sum / n;
        let spread = (squares / n - mean * mean).max(0.0);
        Some(Errors {
            picture: mean.sqrt(),
            worst_tile: worst.sqrt(),
            doubt: if mean > 0.0 {
                (spread / n).sqrt() / mean
            } else {
                0.0
            },
        })
    }

    /// 0.01 m², by this half alone.
    pub(crate) fn half_floor(&self) -> f64 {
        floor((0..self.pixels.len()).map(|i| self.half_estimate(i)))
    }

    /// Square of the relative error of a tile by this half alone, and one standard error of that square more: the first estimate
    /// below a goal is one of those that are too low. `None` before the half has two nets.
    pub(crate) fn half_error(&self, tile: usize, floor: f64) -> Option<f64> {
        let pixels = tile::rect(self.window, tile).indices(self.window);
        Square::of(pixels.map(|i| self.half_estimate(i)), floor).map(|x| x.mean() + x.error())
    }

    /// The picture's mean and its interval, by the spread of the tiles' nets: walks of one tile that light many pixels, or share
    /// their luck, are taken together. `None` before all tiles have two nets.
    pub fn interval(&self) -> Option<Interval> {
        let pixels = self.pixels.len();
        let halves = self.halves().count() as f64;
        let (mut mean, mut variance, mut spread) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for half in self.halves() {
            for (i, t) in half.tiles.iter().enumerate() {
                let rect = tile::rect(self.window, i);
                let own = rect.indices(self.window).map(|i| &half.pixels[i].sum);
                let (n, nets) = (f64::from(t.samples()), f64::from(t.nets()));
                if nets < 2.0 {
                    return None;
                }
                let of_tile = tile_mean(own, t.splats, pixels).map(|s| s / n);
                let share = rect.pixels() as f64 / pixels as f64 / halves;
                for k in 0..3 {
                    let squares = t.squares[k].float() - n * of_tile[k] * of_tile[k];
                    let v = share * share * squares.max(0.0) / ((nets - 1.0) * n);
                    mean[k] += share * of_tile[k];
                    variance[k] += v;
                    spread[k] += v * v / (nets - 1.0);
                }
            }
        }
        let degrees = [0, 1, 2].map(|k| match variance[k] * variance[k] / spread[k] {
            d if d.is_finite() => d.max(1.0),
            _ => f64::INFINITY,
        });
        Some(Interval {
            mean,
            half_width: [0, 1, 2].map(|k| student(degrees[k]) * variance[k].sqrt()),
            degrees: degrees.into_iter().fold(f64::INFINITY, f64::min),
        })
    }
}

/// What is added to the squares of means, so that black tiles do not count without bound.
fn floor(pixels: impl ExactSizeIterator<Item = Estimate>) -> f64 {
    let n = pixels.len().max(1) as f64;
    let m = pixels
        .map(|e| e.mean.iter().sum::<f64>() / 3.0)
        .sum::<f64>()
        / n;
    0.01 * m * m
}

/// Squares of the relative errors of a tile's pixels.
struct Square {
    sum: f64,
    /// Sum of their squares.
    squares: f64,
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
        let (mut sum, mut squares) = (0.0, 0.0);
        for e in pixels {
            let v = e.variance?;
            let x = v[0] * scale[0] + v[1] * scale[1] + v[2] * scale[2];
            sum += x;
            squares += x * x;
        }
        Some(Self {
            sum,
            squares,
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

/// The 97.5 % quantile of Student's t: half of a 95 % interval, in standard errors. Abramowitz & Stegun 26.7.5, below three
/// degrees of freedom interpolated between its values there.
pub fn student(degrees: f64) -> f64 {
    const Z: f64 = 1.959_963_985;
    const FEW: [f64; 3] = [12.706_2, 4.302_65, 3.182_45];
    if degrees < 3.0 {
        let d = degrees.max(1.0);
        let low = d.floor();
        let (a, b) = (FEW[low as usize - 1].ln(), FEW[low as usize].ln());
        let share = (1.0 / low - 1.0 / d) / (1.0 / low - 1.0 / (low + 1.0));
        return (a + share * (b - a)).exp();
    }
    let z = |n: i32| Z.powi(n);
    let terms = [
        (z(3) + Z) / 4.0,
        (5.0 * z(5) + 16.0 * z(3) + 3.0 * Z) / 96.0,
        (3.0 * z(7) + 19.0 * z(5) + 17.0 * z(3) - 15.0 * Z) / 384.0,
        (79.0 * z(9) + 776.0 * z(7) + 1482.0 * z(5) - 1920.0 * z(3) - 945.0 * Z) / 92160.0,
    ];
    terms.iter().rev().fold(0.0, |sum, t| (sum + t) / degrees) + Z
}

#[cfg(test)]
mod tests {
    use super::student;

    #[test]
    fn quantiles_of_the_tables() {
        for (d, t) in [
            (1.0, 12.706),
            (2.0, 4.303),
            (3.0, 3.182),
            (5.0, 2.571),
            (9.0, 2.262),
            (30.0, 2.042),
            (f64::INFINITY, 1.960),
        ] {
            assert!((student(d) / t - 1.0).abs() < 0.004, "{d}: {}", student(d));
        }
        assert!(student(1.5) < 12.7 && student(1.5) > 4.31);
    }
}

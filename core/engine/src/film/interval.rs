//! Intervals that cover the truth with a probability of 95 %.

use super::fixed::is_faint;
use super::tile::{self, tile_mean};
use super::{Estimate, Film};

/// How far neighbours may be whose variances make a pixel's interval, pixels.
const REACH: u32 = 1;

/// The picture's mean, and how far from the truth it may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Mean over all pixels.
    pub mean: [f64; 3],
    /// Half the width of the interval that covers the true mean with a probability of 95 %, Student's t of `degrees`; NaN in lanes
    /// too faint for it to be told (above zero, and below 10⁻¹⁰).
    pub half_width: [f64; 3],
    /// Degrees of freedom of the lane that has the least (Satterthwaite 1946). Few if little of the picture has most of the
    /// variance.
    pub degrees: f64,
}

impl Film {
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
            half_width: [0, 1, 2].map(|k| match is_faint(mean[k]) {
                true => f64::NAN,
                false => student(degrees[k]) * variance[k].sqrt(),
            }),
            degrees: degrees.into_iter().fold(f64::INFINITY, f64::min),
        })
    }

    /// Half the width of every pixel's 95 % interval, lane by lane: Student's t times the root of the mean variance of the 3 × 3 pixels
    /// around it, as far as they are of its tile, with their degrees of freedom together. NaN before its tile has two nets, and of a
    /// picture that [`Film::is_faint`].
    ///
    /// A pixel's own few nets will not do: where bright light is rare, who has not met it has both mean and variance too low. Its
    /// neighbours' luck is not its own.
    pub fn half_widths(&self) -> Vec<[f64; 3]> {
        let mut out = vec![[f64::NAN; 3]; self.pixels.len()];
        if self.is_faint() {
            return out;
        }
        for rect in self.tiles() {
            let window = [rect.min[0], rect.min[1], rect.max[0], rect.max[1]];
            let pixels = rect.indices(self.window);
            let estimates: Vec<Estimate> = pixels.clone().map(|i| self.estimate(i)).collect();
            for (own, i) in pixels.enumerate() {
                let near = rect.near(window, own, REACH).indices(window);
                for k in 0..3 {
                    let near = near.clone().map(|i| {
                        let e = &estimates[i];
                        (e.variance.map_or(f64::NAN, |v| v[k]), e.degrees[k])
                    });
                    out[i][k] = half_width(near);
                }
            }
        }
        out
    }
}

/// Half an interval by independent variances that are taken to be alike, with their degrees of freedom.
fn half_width(near: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut count, mut sum, mut degrees) = (0.0, 0.0, 0.0);
    for (v, d) in near {
        count += 1.0;
        sum += v;
        degrees += d;
    }
    student(degrees) * f64::sqrt(sum / count)
}

/// The 97.5 % quantile of Student's t: half of a 95 % interval, in standard errors. Abramowitz & Stegun 26.7.5, below three
/// degrees of freedom interpolated between its values there.
fn student(degrees: f64) -> f64 {
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
    use super::{half_width, student};

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

    #[test]
    fn neighbours_are_taken_together() {
        let of = |v: &[f64]| half_width(v.iter().map(|v| (*v, 3.0)));
        assert!((of(&[1.0, 7.0]) / (2.0 * student(6.0)) - 1.0).abs() < 1e-12);
        assert_eq!(of(&[0.0; 9]), 0.0);
        assert!(of(&[1.0, f64::NAN]).is_nan());
    }
}

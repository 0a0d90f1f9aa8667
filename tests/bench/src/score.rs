//! How far a picture is from its reference, with the part that noise explains.

use crate::error::{Error, Result};
use resolvent_image::{Image, Layer};

/// Added to the square of the reference, so that black pixels do not decide.
pub const DARK: f64 = 0.01;
/// Worst part of the pixels that the trimmed figure leaves out: single fireflies would decide it otherwise.
const TRIM: f64 = 0.001;

/// A picture and what is known of its noise.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height.
    pub size: [usize; 2],
    /// Red, green and blue of each pixel.
    pub color: Vec<[f64; 3]>,
    /// Variance of each value.
    pub variance: Option<Vec<[f64; 3]>>,
}

impl Picture {
    /// Reads an EXR; the layer `variance`, or else the square of the layer `error`, is its noise.
    pub fn read(path: &std::path::Path) -> Result<Self> {
        let image = Image::read_exr(path)?;
        let pixels = |rgb: [&[f32]; 3]| -> Vec<[f64; 3]> {
            (0..image.pixels())
                .map(|i| rgb.map(|c| f64::from(c[i])))
                .collect()
        };
        let color = image.color().map(pixels).ok_or_else(|| Error::Invalid {
            what: format!("{}: no channels R, G, B", path.display()),
        })?;
        let layer = |name| image.layer(name).and_then(Layer::rgb_or_grey).map(pixels);
        let squared = |v: Vec<[f64; 3]>| v.into_iter().map(|p| p.map(|x| x * x)).collect();
        Ok(Self {
            size: [image.width, image.height],
            color,
            variance: layer("variance").or_else(|| layer("error").map(squared)),
        })
    }

    /// The picture with pixels `n` times as long and wide, which show the means of the pixels they cover: with a box filter
    /// exactly what rendering at that resolution expects.
    pub fn coarser(&self, n: usize) -> Self {
        let size = self.size.map(|s| s / n);
        let over = |from: &[[f64; 3]], power: i32| -> Vec<[f64; 3]> {
            let mut out = vec![[0.0; 3]; size[0] * size[1]];
            let scale = ((n * n) as f64).powi(-power);
            for y in 0..size[1] * n {
                for x in 0..size[0] * n {
                    let to = &mut out[(y / n) * size[0] + x / n];
                    for (a, b) in to.iter_mut().zip(from[y * self.size[0] + x]) {
                        *a += b * scale;
                    }
                }
            }
            out
        };
        Self {
            size,
            color: over(&self.color, 1),
            variance: self.variance.as_ref().map(|v| over(v, 2)),
        }
    }

    /// Mean over all pixels.
    pub fn mean(&self) -> [f64; 3] {
        let n = self.color.len() as f64;
        [0, 1, 2].map(|k| self.color.iter().map(|c| c[k]).sum::<f64>() / n)
    }
}

/// A picture against a reference. Relative squares are means over channels of (x − r)²/(r² + [`DARK`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Mean of relative squares without the worst 0.1 % of the pixels, less the reference's own noise.
    pub rel_mse: f64,
    /// Its relative standard error, by the scatter of pixels round what noise explains.
    pub rel_mse_error: f64,
    /// Mean of relative squares over all pixels, nothing subtracted.
    pub rel_mse_raw: f64,
    /// Plain mean square.
    pub mse: f64,
    /// Relative variance that the picture states: what `rel_mse` is on average if there is no bias. `None` if it states none.
    pub noise: Option<f64>,
    /// Relative variance of the reference.
    pub reference_noise: f64,
    /// Mean of relative squares less both variances: the square of the bias on average.
    pub floor: Option<f64>,
    /// Standard error of `floor`.
    pub floor_error: f64,
    /// Mean of the picture over that of the reference, less 1.
    pub mean_off: f64,
    /// Its standard error by the stated variances.
    pub mean_off_error: f64,
    /// What a black picture would score.
    pub black: f64,
    /// Pixels that are not finite; they are left out.
    pub not_finite: usize,
}

/// Compares.
pub fn score(x: &Picture, r: &Picture) -> Result<Score> {
    if x.size != r.size {
        return Err(Error::Invalid {
            what: format!(
                "a picture of {:?} pixels for a reference of {:?}",
                x.size, r.size
            ),
        });
    }
    let mut out = Score::default();
    let (mut squares, mut own, mut theirs, mut left) = (vec![], vec![], vec![], vec![]);
    let (mut sum, mut reference_sum, mut sum_variance) = (0.0, 0.0, 0.0);
    for (i, (c, e)) in x.color.iter().zip(&r.color).enumerate() {
        if c.iter().any(|v| !v.is_finite()) {
            out.not_finite += 1;
            continue;
        }
        let v = x.variance.as_ref().map(|v| v[i]);
        let w = r.variance.as_ref().map_or([0.0; 3], |v| v[i]);
        let over = |f: &dyn Fn(usize) -> f64| {
            (0..3).map(|k| f(k) / (e[k] * e[k] + DARK)).sum::<f64>() / 3.0
        };
        let square = over(&|k| (c[k] - e[k]).powi(2));
        let noise = v.map_or(0.0, |v| over(&|k| v[k]));
        let reference = over(&|k| w[k]);
        out.black += over(&|k| e[k] * e[k]);
        out.mse += (0..3).map(|k| (c[k] - e[k]).powi(2)).sum::<f64>() / 3.0;
        sum += c.iter().sum::<f64>();
        reference_sum += e.iter().sum::<f64>();
        // Channels share paths: their errors add as if they were one.
        let all = |v: [f64; 3]| v.map(f64::sqrt).iter().sum::<f64>().powi(2);
        sum_variance += all(v.unwrap_or([0.0; 3])) + all(w);
        squares.push(square);
        own.push(noise);
        theirs.push(reference);
        left.push(square - noise - reference);
    }
    let n = squares.len() as f64;
    if squares.is_empty() || reference_sum == 0.0 {
        return Err(Error::Invalid {
            what: "nothing to compare: the reference is black, or no pixel is finite".into(),
        });
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    out.mse /= n;
    out.black /= n;
    out.rel_mse_raw = mean(&squares);
    out.reference_noise = mean(&theirs);
    let floor = mean(&left);
    let scatter = left.iter().map(|d| (d - floor).powi(2)).sum::<f64>();
    out.floor_error = scatter.sqrt() / n;
    out.rel_mse = (trimmed(&mut squares) - trimmed(&mut theirs)).max(0.0);
    out.rel_mse_error = out.floor_error / out.rel_mse.max(1e-300);
    if x.variance.is_some() {
        out.noise = Some(mean(&own));
        out.floor = Some(floor);
    }
    out.mean_off = sum / reference_sum - 1.0;
    out.mean_off_error = sum_variance.sqrt() / reference_sum.abs();
    Ok(out)
}

/// Mean without the largest 0.1 %, rounded up.
fn trimmed(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let keep = values.len() - (values.len() as f64 * TRIM).ceil() as usize;
    let keep = keep.max(1).min(values.len());
    values[..keep].iter().sum::<f64>() / keep as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of mean 1 with triangular noise of variance `v`, by a fixed sequence.
    fn noisy(n: usize, v: f64, mean: f64, seed: u64) -> Picture {
        let mut state = seed;
        let mut uniform = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        // The sum of two uniform numbers less 1 has the variance 1/6.
        let scale = (6.0 * v).sqrt();
        let color = (0..n * n)
            .map(|_| [0; 3].map(|_| mean + scale * (uniform() + uniform() - 1.0)))
            .collect();
        Picture {
            size: [n, n],
            color,
            variance: Some(vec![[v; 3]; n * n]),
        }
    }

    #[test]
    fn noise_alone_leaves_no_floor() {
        let (r, x) = (noisy(64, 1e-5, 1.0, 1), noisy(64, 0.04, 1.0, 2));
        let s = score(&x, &r).unwrap();
        let floor = s.floor.unwrap();
        assert!(floor.abs() < 4.0 * s.floor_error, "{s:?}");
        assert!(s.mean_off.abs() < 4.0 * s.mean_off_error, "{s:?}");
        assert!((s.rel_mse / (0.04 / 1.01) - 1.0).abs() < 0.05, "{s:?}");
        // The reference's own noise moves the mean of 1/(r² + 0.01) by a few of its variances.
        assert!((s.noise.unwrap() - 0.04 / 1.01).abs() < 1e-5);
    }

    #[test]
    fn bias_shows_as_floor_and_mean() {
        let (r, x) = (noisy(64, 1e-5, 1.0, 1), noisy(64, 0.001, 1.05, 2));
        let s = score(&x, &r).unwrap();
        assert!(s.floor.unwrap() > 20.0 * s.floor_error, "{s:?}");
        assert!((s.floor.unwrap() - 0.0025 / 1.01).abs() < 3e-4, "{s:?}");
        assert!((s.mean_off - 0.05).abs() < 4.0 * s.mean_off_error, "{s:?}");
    }

    #[test]
    fn coarser_pixels_are_means() {
        let p = noisy(8, 0.04, 1.0, 3);
        let c = p.coarser(2);
        assert_eq!(c.size, [4, 4]);
        let mean = (p.color[0][0] + p.color[1][0] + p.color[8][0] + p.color[9][0]) / 4.0;
        assert!((c.color[0][0] - mean).abs() < 1e-12);
        assert!((c.variance.unwrap()[0][0] - 0.01).abs() < 1e-12);
    }

    #[test]
    fn refuses_other_sizes() {
        assert!(score(&noisy(4, 1.0, 1.0, 1), &noisy(8, 1.0, 1.0, 1)).is_err());
    }
}

//! The film: sums per pixel in fixed point, so that they do not depend on the order of addition.
//!
//! Every sample is rounded once, to a multiple of 2⁻⁶⁴, and added as an integer. Any division of the work into tiles, sample
//! ranges, threads or machines gives the same bits.

mod splat;

pub use splat::Splats;

use crate::filter::Filter;
use resolvent_api::Spectrum;
use resolvent_api::abi::PixelSample;
use resolvent_pathspace::sampler::BATCH;

/// Fractional bits of the sums.
const FRACTION: i32 = 64;
/// Largest magnitude a single value may have; beyond, it is rejected like an infinity. Leaves room for 2²³ samples.
const LARGEST: f32 = 1e12;

/// Rounds toward zero to fixed point. The value must be finite and not beyond [`LARGEST`].
#[inline(always)]
fn fix(v: f32) -> i128 {
    let bits = v.to_bits();
    let exponent = (bits >> 23 & 0xff) as i32;
    let mantissa = i128::from(if exponent == 0 {
        0
    } else {
        bits & 0x7f_ffff | 0x80_0000
    });
    let shift = exponent - 150 + FRACTION;
    let magnitude = if shift >= 0 {
        mantissa << shift
    } else {
        mantissa >> (-shift).min(127)
    };
    if bits >> 31 == 0 {
        magnitude
    } else {
        -magnitude
    }
}

/// Back to floating point.
fn float(v: i128) -> f64 {
    v as f64 * (0.5f64).powi(FRACTION)
}

/// Sums of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// Radiance, three lanes.
    sum: [i128; 3],
    /// Coverage.
    alpha: i128,
    /// Σ over batches of (sum of the batch)²/samples of the batch.
    squares: [f64; 3],
    samples: u32,
    batches: u32,
}

/// Sums of one pixel's features.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeatureSums {
    depth: i128,
    hits: u32,
    albedo: [i128; 3],
    normal: [i128; 3],
}

/// A rectangle of pixels that one worker fills.
pub struct Buffer {
    min: [u32; 2],
    width: u32,
    pixels: Vec<Pixel>,
    features: Vec<FeatureSums>,
    /// Sums of the batch in progress, of the pixel in progress.
    batch: [i128; 3],
    in_batch: u32,
    current: Option<(u32, u32)>,
    first_sample: u32,
    /// Light from walks that started at lights.
    pub splats: Splats,
    /// Samples that were left out.
    pub rejected: u64,
    /// Where the first of them was.
    pub rejected_at: Option<[u32; 2]>,
}

impl Buffer {
    /// An empty buffer for pixels from `min` up to, not including, `max`, for samples from `first_sample` on.
    pub fn new(min: [u32; 2], max: [u32; 2], first_sample: u32, features: bool) -> Self {
        let width = max[0] - min[0];
        let count = (width * (max[1] - min[1])) as usize;
        Self {
            min,
            width,
            pixels: vec![Pixel::default(); count],
            features: if features {
                vec![FeatureSums::default(); count]
            } else {
                Vec::new()
            },
            batch: [0; 3],
            in_batch: 0,
            current: None,
            first_sample,
            splats: Splats::default(),
            rejected: 0,
            rejected_at: None,
        }
    }

    /// Adds the next sample of pixel (x, y). A sample that is not finite counts as taken and black, and is reported.
    #[inline]
    pub fn add(&mut self, x: u32, y: u32, s: &PixelSample) -> Result<(), String> {
        let (column, row) = (x.wrapping_sub(self.min[0]), y.wrapping_sub(self.min[1]));
        let index = (row as usize) * (self.width as usize) + column as usize;
        if column >= self.width || index >= self.pixels.len() {
            return Err(format!(
                "added a sample to pixel ({x}, {y}), which is not in its tile"
            ));
        }
        if self.current != Some((x, y)) {
            self.end_batch();
            self.current = Some((x, y));
        }
        let good = s.radiance.0[..3]
            .iter()
            .all(|v| v.is_finite() && v.abs() <= LARGEST)
            && s.alpha.is_finite();
        let radiance = if good { s.radiance } else { Spectrum::ZERO };
        if !good {
            self.rejected += 1;
            self.rejected_at.get_or_insert([x, y]);
        }
        let p = &mut self.pixels[index];
        for lane in 0..3 {
            let v = fix(radiance[lane]);
            p.sum[lane] += v;
            self.batch[lane] += v;
        }
        p.alpha += fix(if good { s.alpha } else { 0.0 });
        p.samples += 1;
        self.in_batch += 1;
        if (self.first_sample + p.samples).is_multiple_of(BATCH) {
            self.end_batch();
            self.current = Some((x, y));
        }
        if let Some(f) = self.features.get_mut(index)
            && s.depth > 0.0
            && s.depth <= LARGEST
        {
            f.depth += fix(s.depth);
            f.hits += 1;
            for i in 0..3 {
                f.albedo[i] += fix(s.albedo[i]);
                f.normal[i] += fix(s.normal[i]);
            }
        }
        Ok(())
    }

    /// The first pixel that has not exactly `count` samples, with what it has.
    pub fn uneven(&self, count: u32) -> Option<([u32; 2], u32)> {
        let i = self.pixels.iter().position(|p| p.samples != count)?;
        let at = [
            self.min[0] + i as u32 % self.width,
            self.min[1] + i as u32 / self.width,
        ];
        Some((at, self.pixels[i].samples))
    }

    fn end_batch(&mut self) {
        if let Some((x, y)) = self.current
            && self.in_batch > 0
        {
            let index = ((y - self.min[1]) * self.width + (x - self.min[0])) as usize;
            let p = &mut self.pixels[index];
            for lane in 0..3 {
                let sum = float(self.batch[lane]);
                p.squares[lane] += sum * sum / f64::from(self.in_batch);
            }
            p.batches += 1;
        }
        self.batch = [0; 3];
        self.in_batch = 0;
        self.current = None;
    }
}

/// The sums of a whole image.
pub struct Film {
    /// Window that is rendered: x0, y0, x1, y1 in pixels of the full image.
    window: [u32; 4],
    pixels: Vec<Pixel>,
    features: Vec<FeatureSums>,
    /// Light from walks that started at lights, once there is any.
    splats: Option<splat::Sums>,
    /// Pieces of work merged, and their samples.
    pieces: (u64, u64),
    /// Factor on the picture: the camera's exposure.
    exposure: f64,
}

/// One pixel's estimates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean radiance.
    pub mean: [f64; 3],
    /// Variance of that mean; `None` with fewer than two batches.
    pub variance: Option<[f64; 3]>,
    /// Mean coverage.
    pub alpha: f64,
    /// Samples taken.
    pub samples: u32,
}

/// One pixel's features: means over the samples that met something.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Features {
    /// Distance.
    pub depth: f64,
    /// Albedo.
    pub albedo: [f64; 3],
    /// Normal, of length at most 1.
    pub normal: [f64; 3],
}

impl Film {
    /// An empty film.
    pub fn new(window: [u32; 4], features: bool) -> Self {
        let count = (window[2] - window[0]) as usize * (window[3] - window[1]) as usize;
        Self {
            window,
            pixels: vec![Pixel::default(); count],
            features: if features {
                vec![FeatureSums::default(); count]
            } else {
                Vec::new()
            },
            splats: None,
            pieces: (0, 0),
            exposure: 1.0,
        }
    }

    /// The film with a factor on its picture.
    pub fn exposed(self, exposure: f64) -> Self {
        Self { exposure, ..self }
    }

    /// Width and height of the window.
    pub fn size(&self) -> [u32; 2] {
        [
            self.window[2] - self.window[0],
            self.window[3] - self.window[1],
        ]
    }

    /// Adds a finished buffer; `filter` spreads its splats.
    pub fn merge(&mut self, mut b: Buffer, filter: &Filter) {
        b.end_batch();
        let samples: u64 = b.pixels.iter().map(|p| u64::from(p.samples)).sum();
        if !b.splats.is_empty() && self.splats.is_none() {
            // Pieces that came before had none to give: they count as well.
            let pieces = self.pieces;
            let mut sums = splat::Sums::new(self.pixels.len());
            sums.skip(pieces.0, pieces.1);
            self.splats = Some(sums);
        }
        if let Some(sums) = &mut self.splats {
            sums.add(&b.splats, self.window, filter, samples);
        }
        self.pieces.0 += 1;
        self.pieces.1 += samples;
        let [width, _] = self.size();
        for (i, p) in b.pixels.iter().enumerate() {
            let x = b.min[0] - self.window[0] + i as u32 % b.width;
            let y = b.min[1] - self.window[1] + i as u32 / b.width;
            let at = y as usize * width as usize + x as usize;
            let q = &mut self.pixels[at];
            for lane in 0..3 {
                q.sum[lane] += p.sum[lane];
                q.squares[lane] += p.squares[lane];
            }
            q.alpha += p.alpha;
            q.samples += p.samples;
            q.batches += p.batches;
            if let (Some(f), Some(g)) = (b.features.get(i), self.features.get_mut(at)) {
                g.depth += f.depth;
                g.hits += f.hits;
                for k in 0..3 {
                    g.albedo[k] += f.albedo[k];
                    g.normal[k] += f.normal[k];
                }
            }
        }
    }

    /// True if no pixel has a sample yet.
    pub fn is_empty(&self) -> bool {
        self.pixels.iter().all(|p| p.samples == 0)
    }

    /// The estimates of pixel `i`, counted in rows from the top of the window.
    pub fn estimate(&self, i: usize) -> Estimate {
        let p = &self.pixels[i];
        let n = f64::from(p.samples.max(1));
        let mut mean = p.sum.map(|s| float(s) / n);
        let mut variance = (p.batches >= 2).then(|| {
            let mut v = [0.0; 3];
            for lane in 0..3 {
                let spread = (p.squares[lane] - n * mean[lane] * mean[lane]).max(0.0);
                v[lane] = spread / (f64::from(p.batches - 1) * n);
            }
            v
        });
        if let Some(splats) = &self.splats {
            let (m, v) = splats.estimate(i);
            for lane in 0..3 {
                mean[lane] += m[lane];
            }
            // A pixel's own samples and what falls on it from all others' are all but independent.
            variance = variance.zip(v).map(|(a, b)| [0, 1, 2].map(|k| a[k] + b[k]));
        }
        let e = self.exposure;
        Estimate {
            mean: mean.map(|m| m * e),
            variance: variance.map(|v| v.map(|v| v * e * e)),
            alpha: float(p.alpha) / n,
            samples: p.samples,
        }
    }

    /// The features of pixel `i`; zero if they were not asked for.
    pub fn features(&self, i: usize) -> Features {
        let Some(f) = self.features.get(i).filter(|f| f.hits > 0) else {
            return Features::default();
        };
        let n = f64::from(f.hits);
        Features {
            depth: float(f.depth) / n,
            albedo: f.albedo.map(|v| float(v) / n),
            normal: f.normal.map(|v| float(v) / n),
        }
    }

    /// Estimated relative error of the picture: the square root of the mean over pixels and lanes of
    /// variance/(mean² + 0.01 m²), m the picture's mean; `None` before two batches are there.
    pub fn relative_error(&self) -> Option<f64> {
        let mut total = 0.0;
        for i in 0..self.pixels.len() {
            total += self.estimate(i).mean.iter().sum::<f64>();
        }
        let m = total / (3 * self.pixels.len()).max(1) as f64;
        let (mut sum, mut count) = (0.0, 0usize);
        for i in 0..self.pixels.len() {
            let e = self.estimate(i);
            let v = e.variance?;
            for (v, mean) in v.iter().zip(e.mean) {
                let scale = mean * mean + 0.01 * m * m;
                if scale > 0.0 {
                    sum += v / scale;
                }
                count += 1;
            }
        }
        Some((sum / count.max(1) as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;

    fn sample(v: f32) -> PixelSample {
        PixelSample {
            radiance: Spectrum::rgb(v, 2.0 * v, -v),
            alpha: 1.0,
            ..Default::default()
        }
    }

    #[test]
    fn fixed_point_is_exact_for_ordinary_values() {
        for v in [0.0f32, 1.0, -0.1, 3.25e11, 1e-9, f32::MIN_POSITIVE] {
            let back = float(fix(v));
            assert!(
                (back - f64::from(v)).abs() <= 0.5f64.powi(FRACTION),
                "{v} {back}"
            );
        }
    }

    /// Mean and variance of batches against the textbook formulas, and any division into ranges gives the same sums.
    #[test]
    fn batches_merge_to_the_same_sums() {
        let mut stream = Stream::new(5);
        let values: Vec<f32> = (0..8 * BATCH).map(|_| stream.uniform() * 10.0).collect();
        let run = |cuts: &[u32]| {
            let mut film = Film::new([3, 4, 4, 5], false);
            for w in cuts.windows(2) {
                let mut b = Buffer::new([3, 4], [4, 5], w[0], false);
                for s in w[0]..w[1] {
                    b.add(3, 4, &sample(values[s as usize])).unwrap();
                }
                film.merge(b, &Filter::Box(0.5));
            }
            film
        };
        let whole = run(&[0, 8 * BATCH]);
        let parts = run(&[0, BATCH, 5 * BATCH, 8 * BATCH]);
        assert_eq!(whole.pixels[0].sum, parts.pixels[0].sum);
        assert_eq!(whole.estimate(0), parts.estimate(0));
        let e = whole.estimate(0);
        let means: Vec<f64> = values
            .chunks(BATCH as usize)
            .map(|c| c.iter().map(|v| f64::from(*v)).sum::<f64>() / f64::from(BATCH))
            .collect();
        let mean = means.iter().sum::<f64>() / 8.0;
        let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / 7.0 / 8.0;
        assert!((e.mean[0] - mean).abs() < 1e-12);
        assert!((e.variance.unwrap()[0] / variance - 1.0).abs() < 1e-9);
        assert!((e.variance.unwrap()[1] / (4.0 * variance) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn bad_samples_are_counted_and_left_out() {
        let mut b = Buffer::new([0, 0], [2, 1], 0, false);
        b.add(0, 0, &sample(1.0)).unwrap();
        b.add(0, 0, &sample(f32::NAN)).unwrap();
        b.add(0, 0, &sample(f32::INFINITY)).unwrap();
        assert!(b.add(2, 0, &sample(1.0)).is_err());
        assert_eq!((b.rejected, b.rejected_at), (2, Some([0, 0])));
        let mut film = Film::new([0, 0, 2, 1], false);
        film.merge(b, &Filter::Box(0.5));
        assert_eq!(film.estimate(0).samples, 3);
        assert!((film.estimate(0).mean[0] - 1.0 / 3.0).abs() < 1e-12);
        let (dark, film) = (film.estimate(0), film.exposed(4.0));
        assert!((film.estimate(0).mean[0] - 4.0 / 3.0).abs() < 1e-12);
        let variance = |e: Estimate| e.variance.map(|v| v[0]);
        assert_eq!(variance(film.estimate(0)), variance(dark).map(|v| 16.0 * v));
    }
}

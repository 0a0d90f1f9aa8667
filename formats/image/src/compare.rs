//! How far an image is from a reference, and whether noise explains it.

use crate::image::{Image, Layer};

/// Worst part of the pixels that the relative MSE leaves out: single fireflies would decide it otherwise.
const TRIM: f64 = 0.001;

/// Added to the square of the reference in the relative MSE, so that black pixels do not decide it.
const DARK: f64 = 0.01;

/// Relative error of a region's mean that f32 storage alone can make. It keeps regions without noise from
/// failing on the last bit.
const ROUNDING: f64 = 1e-6;

/// Significance of [`Regions::threshold`].
pub const SIGNIFICANCE: f64 = 0.01;

/// An image compared with a reference, over red, green and blue.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Pixels that were compared.
    pub pixels: usize,
    /// Pixels that were left out because one of the images is not finite there.
    pub not_finite: usize,
    /// Mean over pixels and channels of (x − r)².
    pub mse: f64,
    /// Mean over pixels of the mean over channels of (x − r)² / (r² + 0.01), without the worst 0.1 % of the
    /// pixels (rounded up).
    pub rel_mse: f64,
    /// The same over all pixels.
    pub rel_mse_untrimmed: f64,
    /// Mean of the image, per channel.
    pub mean: [f64; 3],
    /// Mean of the reference, per channel.
    pub reference_mean: [f64; 3],
    /// `mean / reference_mean`; not finite where the reference is black.
    pub mean_ratio: [f64; 3],
    /// Share of the values, a pixel's channels one by one, that differ by no more than the intervals of the layer `error_95` allow
    /// (of both images, if both have one: √(a² + b²)): 95 % if only noise differs. Values that have no noise in
    /// either do not count; `None` if there are no others, or no intervals.
    pub within_error_95: Option<f64>,
    /// The z-tests, if at least one image has a layer `variance`.
    pub regions: Option<Regions>,
}

/// Whether the noise that the images state explains their difference.
///
/// Under the hypothesis that both images have the same expectation, every z is a standard normal number if
/// the means of regions are normal (enough samples) and pixels are independent (a filter no wider than a
/// pixel; wider ones make z too large).
#[derive(Debug, Clone, PartialEq)]
pub struct Regions {
    /// Number of regions across and down.
    pub grid: [usize; 2],
    /// One test per region and channel, then one per channel for the whole image.
    pub tests: Vec<RegionTest>,
    /// The largest |z|.
    pub max_z: f64,
    /// Probability of a |z| as large anywhere if only noise differs, after Šidák's correction for the number
    /// of tests: 1 − (1 − p)^n.
    pub p_value: f64,
    /// The |z| that is exceeded anywhere with probability [`SIGNIFICANCE`] if only noise differs.
    pub threshold: f64,
}

impl Regions {
    /// True if noise explains the difference, at [`SIGNIFICANCE`].
    pub fn passed(&self) -> bool {
        self.p_value >= SIGNIFICANCE
    }

    /// The test with the largest |z|.
    pub fn worst(&self) -> Option<&RegionTest> {
        self.tests
            .iter()
            .max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()))
    }
}

/// The z-test of one channel in one region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RegionTest {
    /// The region, [x0, y0, x1, y1] in pixels; x1 and y1 are outside.
    pub region: [usize; 4],
    /// 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// Mean of the image minus mean of the reference.
    pub difference: f64,
    /// Standard error of the difference.
    pub sigma: f64,
    /// difference / sigma.
    pub z: f64,
}

/// Images that cannot be compared, and why.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Incomparable(pub String);

/// One image of a comparison.
struct Side<'a> {
    color: [&'a [f32]; 3],
    /// Variance of each pixel's mean.
    variance: Option<[&'a [f32]; 3]>,
    /// Half the width of each pixel's 95 % interval.
    error_95: Option<[&'a [f32]; 3]>,
}

impl<'a> Side<'a> {
    fn new(image: &'a Image, which: &str) -> Result<Side<'a>, Incomparable> {
        let color = image.color();
        let color =
            color.ok_or_else(|| Incomparable(format!("the {which} has no channels R, G, B")))?;
        let layer = |name: &str| image.layer(name).and_then(Layer::rgb_or_grey);
        let (variance, error_95) = (layer("variance"), layer("error_95"));
        let complete = |c: &[&[f32]; 3]| c.iter().all(|c| c.len() == image.pixels());
        let noise = [variance, error_95];
        if !complete(&color) || noise.iter().flatten().any(|v| !complete(v)) {
            return Err(Incomparable(format!(
                "a channel of the {which} does not cover its pixels"
            )));
        }
        Ok(Side {
            color,
            variance,
            error_95,
        })
    }

    fn at(&self, pixel: usize) -> [f64; 3] {
        self.color.map(|c| f64::from(c[pixel]))
    }

    fn is_finite(&self, pixel: usize) -> bool {
        let fine = |c: &[&[f32]; 3]| c.iter().all(|c| c[pixel].is_finite());
        let noise = [self.variance, self.error_95];
        fine(&self.color) && noise.iter().flatten().all(fine)
    }
}

/// Compares an image with a reference; `grid` is the number of regions across and down for the z-tests.
pub fn compare(
    image: &Image,
    reference: &Image,
    grid: [usize; 2],
) -> Result<Comparison, Incomparable> {
    if (image.width, image.height) != (reference.width, reference.height) {
        return Err(Incomparable(format!(
            "the image has {} × {} pixels, the reference {} × {}",
            image.width, image.height, reference.width, reference.height
        )));
    }
    let (x, r) = (
        Side::new(image, "image")?,
        Side::new(reference, "reference")?,
    );
    let finite: Vec<bool> = (0..image.pixels())
        .map(|i| x.is_finite(i) && r.is_finite(i))
        .collect();
    let pixels = finite.iter().filter(|f| **f).count();
    if pixels == 0 {
        return Err(Incomparable("no pixel is finite in both images".into()));
    }
    let n = pixels as f64;
    let mut mse = 0.0;
    let mut relative = Vec::with_capacity(pixels);
    let (mut mean, mut reference_mean) = ([0.0; 3], [0.0; 3]);
    for i in (0..finite.len()).filter(|i| finite[*i]) {
        let (a, b) = (x.at(i), r.at(i));
        let mut pixel = 0.0;
        for c in 0..3 {
            let square = (a[c] - b[c]).powi(2);
            mse += square;
            pixel += square / (b[c] * b[c] + DARK) / 3.0;
            mean[c] += a[c];
            reference_mean[c] += b[c];
        }
        relative.push(pixel);
    }
    let (mean, reference_mean) = (mean.map(|m| m / n), reference_mean.map(|m| m / n));
    relative.sort_by(f64::total_cmp);
    let kept = pixels - ((pixels as f64 * TRIM).ceil() as usize).min(pixels - 1);
    let average = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let noisy = x.variance.is_some() || r.variance.is_some();
    Ok(Comparison {
        pixels,
        not_finite: finite.len() - pixels,
        mse: mse / (3.0 * n),
        rel_mse: average(&relative[..kept]),
        rel_mse_untrimmed: average(&relative),
        mean,
        reference_mean,
        mean_ratio: std::array::from_fn(|c| mean[c] / reference_mean[c]),
        within_error_95: within_error_95(&x, &r, &finite),
        regions: noisy.then(|| regions(&x, &r, &finite, [image.width, image.height], grid)),
    })
}

fn within_error_95(x: &Side<'_>, r: &Side<'_>, finite: &[bool]) -> Option<f64> {
    if x.error_95.is_none() && r.error_95.is_none() {
        return None;
    }
    let (mut within, mut all) = (0.0, 0.0);
    for i in (0..finite.len()).filter(|i| finite[*i]) {
        let (a, b) = (x.at(i), r.at(i));
        for c in 0..3 {
            let of = |s: &Side<'_>| s.error_95.map_or(0.0, |e| f64::from(e[c][i]));
            let width = of(x).hypot(of(r));
            if width > ROUNDING * a[c].abs().max(b[c].abs()) {
                all += 1.0;
                within += f64::from(u8::from((a[c] - b[c]).abs() <= width));
            }
        }
    }
    (all > 0.0).then(|| within / all)
}

fn regions(
    x: &Side<'_>,
    r: &Side<'_>,
    finite: &[bool],
    size: [usize; 2],
    grid: [usize; 2],
) -> Regions {
    let grid = [grid[0].clamp(1, size[0]), grid[1].clamp(1, size[1])];
    let mut tests = Vec::new();
    for row in 0..grid[1] {
        for column in 0..grid[0] {
            let edge = |i: usize, axis: usize| i * size[axis] / grid[axis];
            let region = [
                edge(column, 0),
                edge(row, 1),
                edge(column + 1, 0),
                edge(row + 1, 1),
            ];
            tests.extend((0..3).filter_map(|c| test(x, r, finite, size[0], region, c)));
        }
    }
    let all = [0, 0, size[0], size[1]];
    tests.extend((0..3).filter_map(|c| test(x, r, finite, size[0], all, c)));
    let max_z = tests.iter().map(|t| t.z.abs()).fold(0.0, f64::max);
    let count = tests.len() as f64;
    Regions {
        grid,
        max_z,
        // 1 − (1 − p)^n without cancellation for small p.
        p_value: -(count * (-two_sided(max_z)).ln_1p()).exp_m1(),
        threshold: two_sided_inverse(-((-SIGNIFICANCE).ln_1p() / count).exp_m1()),
        tests,
    }
}

/// The test of one channel in one region; none if no pixel there is finite.
fn test(
    x: &Side<'_>,
    r: &Side<'_>,
    finite: &[bool],
    width: usize,
    region: [usize; 4],
    c: usize,
) -> Option<RegionTest> {
    let (mut n, mut difference, mut variance, mut magnitude) = (0.0, 0.0, 0.0, 0.0);
    for y in region[1]..region[3] {
        for i in (y * width + region[0]..y * width + region[2]).filter(|i| finite[*i]) {
            let (a, b) = (f64::from(x.color[c][i]), f64::from(r.color[c][i]));
            n += 1.0;
            difference += a - b;
            magnitude += a.abs().max(b.abs());
            variance += [x, r]
                .iter()
                .filter_map(|s| s.variance)
                .map(|v| f64::from(v[c][i]).max(0.0))
                .sum::<f64>();
        }
    }
    if n == 0.0 {
        return None;
    }
    let sigma = (variance.sqrt() / n).hypot(ROUNDING * magnitude / n);
    let difference = difference / n;
    let z = if difference == 0.0 {
        0.0
    } else {
        difference / sigma
    };
    Some(RegionTest {
        region,
        channel: c,
        difference,
        sigma,
        z,
    })
}

/// P(|Z| ≥ z) for a standard normal Z.
pub fn two_sided(z: f64) -> f64 {
    libm::erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// The z with `two_sided(z) == p`, for p in (0, 1], by bisection.
fn two_sided_inverse(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if two_sided(middle) > p {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_tails_are_the_tabled_ones() {
        for (z, p) in [
            (0.0, 1.0),
            (1.0, 0.317_310_507_862_914),
            (1.959_963_984_540_054, 0.05),
            (5.0, 5.733_031_437_583_869e-7),
        ] {
            assert!((two_sided(z) / p - 1.0).abs() < 1e-12, "{z}");
            assert!((two_sided_inverse(p) - z).abs() < 1e-9, "{p}");
        }
    }
}

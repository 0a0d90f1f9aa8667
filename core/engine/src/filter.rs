//! Reconstruction filters by importance sampling: a pixel's film positions are distributed like its filter, so every sample has
//! the same weight and no sample belongs to two pixels (Ernst et al. 2006, "Filter Importance Sampling").

use resolvent_scene::Filter as Described;
use std::f64::consts::SQRT_2;

/// A separable filter, sampled by inversion along each axis.
#[derive(Clone, Debug)]
pub enum Filter {
    /// Constant within the radius.
    Box(f32),
    /// Falls linearly to 0 at the radius.
    Tent(f32),
    /// A Gaussian less its value at the radius; inverted by a table.
    Gaussian(Box<Table>),
}

/// A truncated Gaussian less its value at the radius.
#[derive(Clone, Debug)]
pub struct Table {
    /// Positions (pixels from the centre) at equal steps of the cumulative distribution, the positive half.
    positions: [f32; STEPS + 1],
    radius: f32,
    /// 1/(2σ²), the value at the radius, and the integral over both halves.
    decay: f32,
    floor: f32,
    total: f32,
}

const STEPS: usize = 2048;

impl Filter {
    /// The filter of a description.
    pub fn new(described: Described) -> Self {
        match described {
            Described::Box { radius } => Self::Box(radius as f32),
            Described::Tent { radius } => Self::Tent(radius as f32),
            Described::Gaussian { radius, sigma } => {
                Self::Gaussian(Box::new(Table::gaussian(radius, sigma)))
            }
        }
    }

    /// An offset from the pixel's centre, in pixels, for `u` in [0, 1).
    #[inline]
    pub fn sample(&self, u: f32) -> f32 {
        match self {
            Self::Box(radius) => radius * (2.0 * u - 1.0),
            // Inverse of 1 − (1−|x|/r)²: the square root spreads the half-interval.
            Self::Tent(radius) => mirrored(u, |v| radius * (1.0 - (1.0 - v).sqrt())),
            Self::Gaussian(table) => mirrored(u, |v| table.at(v)),
        }
    }

    /// Half width, pixels.
    pub fn radius(&self) -> f32 {
        match self {
            Self::Box(radius) | Self::Tent(radius) => *radius,
            Self::Gaussian(table) => table.radius,
        }
    }

    /// The filter at `x` pixels from the pixel's centre, normalised to integral 1 along the axis: the density of [`sample`].
    ///
    /// [`sample`]: Self::sample
    pub fn value(&self, x: f32) -> f32 {
        match self {
            // Half open: a position on the border between two pixels belongs to one.
            Self::Box(radius) if x >= -radius && x < *radius => 0.5 / radius,
            Self::Box(_) => 0.0,
            Self::Tent(radius) => (1.0 - x.abs() / radius).max(0.0) / radius,
            Self::Gaussian(table) if x.abs() < table.radius => {
                ((-x * x * table.decay).exp() - table.floor).max(0.0) / table.total
            }
            Self::Gaussian(_) => 0.0,
        }
    }
}

/// Applies a map of the positive half-axis to both halves.
fn mirrored(u: f32, f: impl Fn(f32) -> f32) -> f32 {
    if u < 0.5 {
        -f(1.0 - 2.0 * u)
    } else {
        f(2.0 * u - 1.0)
    }
}

impl Table {
    fn gaussian(radius: f64, sigma: f64) -> Self {
        let floor = (-0.5 * (radius / sigma).powi(2)).exp();
        // ∫_0^x exp(−t²/2σ²) − floor dt
        let half = sigma * (0.5 * std::f64::consts::PI).sqrt();
        let integral = |x: f64| half * libm::erf(x / (sigma * SQRT_2)) - floor * x;
        let total = integral(radius);
        let mut positions = [radius as f32; STEPS + 1];
        for (i, entry) in positions.iter_mut().enumerate().take(STEPS) {
            let target = total * i as f64 / STEPS as f64;
            let (mut low, mut high) = (0.0, radius);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if integral(middle) < target {
                    low = middle
                } else {
                    high = middle
                }
            }
            *entry = (0.5 * (low + high)) as f32;
        }
        Self {
            positions,
            radius: radius as f32,
            decay: (0.5 / (sigma * sigma)) as f32,
            floor: floor as f32,
            total: (2.0 * total) as f32,
        }
    }

    fn at(&self, v: f32) -> f32 {
        let x = v * STEPS as f32;
        let i = (x as usize).min(STEPS - 1);
        self.positions[i] + (self.positions[i + 1] - self.positions[i]) * (x - i as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values integrate to 1, and their second moment is that of the samples.
    #[test]
    fn values_are_the_density_of_samples() {
        for described in [
            Described::Box { radius: 0.5 },
            Described::Tent { radius: 1.5 },
            Described::Gaussian {
                radius: 1.5,
                sigma: 0.5,
            },
        ] {
            let f = Filter::new(described);
            let n = 100_000;
            let (mut total, mut moment, mut sampled) = (0.0, 0.0, 0.0);
            for i in 0..n {
                let u = (f64::from(i) + 0.5) / f64::from(n);
                let x = f64::from(f.radius()) * (2.0 * u - 1.0);
                let w = f64::from(f.value(x as f32)) * 2.0 * f64::from(f.radius()) / f64::from(n);
                total += w;
                moment += w * x * x;
                sampled += f64::from(f.sample(u as f32)).powi(2) / f64::from(n);
            }
            assert!((total - 1.0).abs() < 1e-4, "{described:?}: {total}");
            assert!(
                (moment / sampled - 1.0).abs() < 1e-3,
                "{described:?}: {moment} {sampled}"
            );
        }
    }

    /// Second moments of the sampled offsets against the filters' own, by midpoint quadrature over u.
    #[test]
    fn offsets_are_distributed_like_the_filter() {
        let moment = |f: &Filter| {
            let n = 200_000;
            (0..n)
                .map(|i| f64::from(f.sample((i as f32 + 0.5) / n as f32)).powi(2))
                .sum::<f64>()
                / f64::from(n)
        };
        let expected = |radius: f64, weight: &dyn Fn(f64) -> f64| {
            let n = 200_000;
            let (mut sum, mut total) = (0.0, 0.0);
            for i in 0..n {
                let x = radius * (f64::from(i) + 0.5) / f64::from(n);
                sum += weight(x) * x * x;
                total += weight(x);
            }
            sum / total
        };
        type Weight = Box<dyn Fn(f64) -> f64>;
        let cases: [(Described, f64, Weight); 3] = [
            (Described::Box { radius: 0.5 }, 0.5, Box::new(|_| 1.0)),
            (Described::Tent { radius: 1.5 }, 1.5, Box::new(|x| 1.5 - x)),
            (
                Described::Gaussian {
                    radius: 2.0,
                    sigma: 0.6,
                },
                2.0,
                Box::new(|x| {
                    (-0.5 * (x / 0.6) * (x / 0.6)).exp() - (-0.5 * (2.0f64 / 0.6).powi(2)).exp()
                }),
            ),
        ];
        for (described, radius, weight) in cases {
            let (got, want) = (moment(&Filter::new(described)), expected(radius, &weight));
            assert!(
                (got / want - 1.0).abs() < 2e-3,
                "{described:?}: {got} {want}"
            );
        }
    }
}

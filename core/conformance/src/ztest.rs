//! Tests of a mean against a known value, and of many at once.

use statrs::function::erf::erfc;

/// A z-test's outcome.
#[derive(Clone, Copy, Debug)]
pub struct ZTest {
    /// Deviation in standard errors.
    pub z: f64,
    /// Two-sided p-value.
    pub p: f64,
}

impl ZTest {
    /// True if the deviation is at most `threshold` standard errors.
    pub fn within(&self, threshold: f64) -> bool {
        self.z.abs() <= threshold
    }
}

/// Compares an estimate with a known value.
///
/// `floor` is the relative accuracy of `expected` and of the arithmetic that made the estimate (10⁻⁶ for sums of `f32` results):
/// it is added to the standard error in quadrature, so that an estimator without noise isn't failed for its last digit.
pub fn z_test(mean: f64, standard_error: f64, expected: f64, floor: f64) -> ZTest {
    let scale = standard_error.hypot(floor * expected);
    let z = match (mean - expected, scale) {
        (0.0, _) => 0.0,
        (d, s) => d / s,
    };
    ZTest {
        z,
        p: erfc(z.abs() * std::f64::consts::FRAC_1_SQRT_2),
    }
}

/// The level for each of `n` tests that keeps the family-wise level at `alpha` (Šidák 1967).
pub fn sidak(alpha: f64, n: usize) -> f64 {
    // 1 − (1 − α)^(1/n) without cancellation.
    -((-alpha).ln_1p() / n.max(1) as f64).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn textbook_values() {
        let t = z_test(1.959_963_985, 1.0, 0.0, 0.0);
        assert!((t.p - 0.05).abs() < 1e-9 && t.within(2.0) && !t.within(1.9));
        assert!((sidak(0.05, 10) - 0.005_116_196_9).abs() < 1e-9);
        assert!((sidak(1e-12, 1_000_000) / 1e-18 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn no_noise_needs_the_value_itself() {
        assert_eq!(z_test(0.5, 0.0, 0.5, 0.0).p, 1.0);
        assert_eq!(z_test(0.5, 0.0, 0.6, 0.0).p, 0.0);
        assert!(z_test(0.5, 0.0, 0.500_000_1, 1e-6).p > 0.5);
        assert!(z_test(f64::NAN, 1.0, 0.5, 0.0).p.is_nan());
    }
}

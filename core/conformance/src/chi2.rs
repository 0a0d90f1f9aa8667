//! Pearson's χ² test of a histogram.

use statrs::function::gamma::{gamma_lr, gamma_ur};

/// A χ² test's outcome.
#[derive(Clone, Copy, Debug)]
pub struct Chi2 {
    /// Σ (observed − expected)²/expected.
    pub statistic: f64,
    /// Degrees of freedom.
    pub freedom: usize,
    /// p-value.
    pub p: f64,
}

/// Fewest counts to expect in a bin for the χ² distribution to hold.
const MIN_EXPECTED: f64 = 5.0;

/// Compares counts with their expectations, which must add up to the number of counts (p = 0 if they differ by 1 %).
///
/// Bins that expect fewer than 5 are merged among themselves, smallest first. What still expects fewer than 5 then is judged
/// apart, by the Poisson probability of so many counts, instead of vanishing in a large bin: counts where there should be
/// none are what a broken sampler makes. The p-value is the smaller of the two, doubled.
pub fn chi2(observed: &[u64], expected: &[f64]) -> Chi2 {
    assert_eq!(observed.len(), expected.len());
    let (seen, hoped): (u64, f64) = (observed.iter().sum(), expected.iter().sum());
    // Written so that a NaN fails.
    if !((seen as f64 - hoped).abs() <= 0.01 * hoped) {
        return Chi2 {
            statistic: f64::INFINITY,
            freedom: 0,
            p: 0.0,
        };
    }
    let mut bins: Vec<(f64, u64)> = expected
        .iter()
        .copied()
        .zip(observed.iter().copied())
        .collect();
    bins.sort_by(|a, b| a.0.total_cmp(&b.0));
    let large = bins.partition_point(|b| b.0 < MIN_EXPECTED);
    let mut merged = bins.split_off(large);
    let mut pool = (0.0, 0);
    for b in bins {
        pool = (pool.0 + b.0, pool.1 + b.1);
        if pool.0 >= MIN_EXPECTED {
            merged.push(std::mem::take(&mut pool));
        }
    }
    let statistic = merged
        .iter()
        .map(|&(e, o)| (o as f64 - e).powi(2) / e)
        .sum::<f64>();
    let freedom = merged.len().saturating_sub(1);
    let p_bins = if freedom == 0 || statistic == 0.0 {
        1.0
    } else {
        gamma_ur(0.5 * freedom as f64, 0.5 * statistic)
    };
    let p_rare = match pool {
        (_, 0) => 1.0,
        (e, _) if e <= 0.0 => 0.0,
        (e, o) => gamma_lr(o as f64, e),
    };
    Chi2 {
        statistic,
        freedom,
        p: (2.0 * p_bins.min(p_rare)).min(1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resolvent_api::rng::Stream;

    #[test]
    fn textbook_value() {
        // 120 throws of a die: Σ (o − 20)²/20 = (0 + 4 + 9 + 4 + 1 + 16)/20 = 1.7 at 5 degrees of freedom.
        let t = chi2(&[20, 22, 17, 18, 19, 24], &[20.0; 6]);
        assert!((t.statistic - 1.7).abs() < 1e-12 && t.freedom == 5);
        // The 95 % point of χ²₅ is 11.0705.
        assert!((gamma_ur(2.5, 11.070_5 / 2.0) - 0.05).abs() < 1e-6);
    }

    #[test]
    fn counts_where_none_are_expected_fail() {
        let expected = [500.0, 499.99, 0.01];
        assert!(chi2(&[500, 500, 0], &expected).p > 0.5);
        assert!(chi2(&[480, 420, 100], &expected).p < 1e-6);
        assert_eq!(chi2(&[1], &[f64::NAN]).p, 0.0);
        assert_eq!(chi2(&[1000, 1], &[1000.0, 0.0]).p, 0.0);
    }

    #[test]
    fn expectations_for_other_counts_fail() {
        assert_eq!(chi2(&[100, 100], &[50.0, 50.0]).p, 0.0);
    }

    #[test]
    fn p_values_of_true_histograms_are_uniform() {
        let mut stream = Stream::new(7);
        let mut tenths = [0u64; 10];
        for _ in 0..2000 {
            let mut bins = [0u64; 16];
            (0..800).for_each(|_| bins[(stream.uniform() * 16.0) as usize] += 1);
            let t = chi2(&bins, &[50.0; 16]);
            let p = gamma_ur(7.5, 0.5 * t.statistic);
            assert!(t.p == (2.0 * p).min(1.0));
            tenths[((p * 10.0) as usize).min(9)] += 1;
        }
        assert!(chi2(&tenths, &[200.0; 10]).p > 1e-3, "{tenths:?}");
    }
}

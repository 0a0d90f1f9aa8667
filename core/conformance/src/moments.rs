//! Running mean and variance.

/// Count, mean and sum of squared deviations, updated one value at a time (Welford 1962).
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    count: u64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// Of the values of an iterator.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut m = Self::default();
        values.into_iter().for_each(|v| m.add(v));
        m
    }

    /// Adds a value.
    pub fn add(&mut self, v: f64) {
        self.count += 1;
        let delta = v - self.mean;
        self.mean += delta / self.count as f64;
        self.squares += delta * (v - self.mean);
    }

    /// Adds all values another one has seen (Chan et al. 1979).
    pub fn merge(&mut self, o: &Self) {
        if o.count == 0 {
            return;
        }
        let (a, b) = (self.count as f64, o.count as f64);
        let delta = o.mean - self.mean;
        self.count += o.count;
        self.mean += delta * b / (a + b);
        self.squares += o.squares + delta * delta * a * b / (a + b);
    }

    /// Values seen.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Their unbiased variance; infinite for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.count < 2 {
            f64::INFINITY
        } else {
            self.squares / (self.count - 1) as f64
        }
    }

    /// Standard error of the mean.
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_and_merging() {
        let all = [4.0, 7.0, 13.0, 16.0, 1e6];
        let whole = Moments::of(all);
        let mut parts = Moments::of(all[..2].iter().copied());
        parts.merge(&Moments::of(all[2..].iter().copied()));
        let small = Moments::of(all[..4].iter().copied());
        assert_eq!((small.mean(), small.variance()), (10.0, 30.0));
        assert!((parts.variance() / whole.variance() - 1.0).abs() < 1e-12);
        assert_eq!(parts.count(), 5);
    }
}

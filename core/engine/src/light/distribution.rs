//! Discrete distributions by inversion of a cumulative table kept in `f64`.

/// A discrete distribution.
#[derive(Clone, Debug)]
pub struct Distribution {
    /// `cumulative[i]` = sum of the weights before i, over the total; one more entry than weights.
    cumulative: Vec<f64>,
    total: f64,
}

impl Distribution {
    /// With probabilities proportional to `weights` (≥ 0). All zero: nothing is ever chosen.
    pub fn new(weights: &[f64]) -> Self {
        let mut cumulative = Vec::with_capacity(weights.len() + 1);
        let mut sum = 0.0;
        cumulative.push(0.0);
        for w in weights {
            sum += w;
            cumulative.push(sum);
        }
        if sum > 0.0 {
            for c in &mut cumulative {
                *c /= sum;
            }
        }
        Self {
            cumulative,
            total: sum,
        }
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Probability of choosing `i`.
    pub fn probability(&self, i: usize) -> f32 {
        (self.cumulative[i + 1] - self.cumulative[i]) as f32
    }

    /// Chooses by `u` in [0, 1); also returns what is left of `u`, uniform in [0, 1) again. `None` if all weights are zero.
    pub fn sample(&self, u: f32) -> Option<(usize, f32)> {
        let (i, rest) = self.sample_wide(f64::from(u))?;
        Some((i, (rest as f32).min(1.0f32.next_down())))
    }

    /// [`Distribution::sample`] in double precision, for what is left to choose from again.
    pub fn sample_wide(&self, u: f64) -> Option<(usize, f64)> {
        if !(self.total > 0.0) {
            return None;
        }
        // The first entry above u has a positive weight before it.
        let i = self
            .cumulative
            .partition_point(|c| *c <= u)
            .clamp(1, self.cumulative.len() - 1)
            - 1;
        let width = self.cumulative[i + 1] - self.cumulative[i];
        let rest = (u - self.cumulative[i]) / width;
        Some((i, rest.clamp(0.0, 1.0f64.next_down())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_weights_are_never_chosen() {
        let d = Distribution::new(&[0.0, 1.0, 0.0, 3.0, 0.0]);
        for k in 0..1000 {
            let (i, rest) = d.sample(k as f32 / 1000.0).unwrap();
            assert!(i == 1 || i == 3, "{i}");
            assert!((0.0..1.0).contains(&rest));
            assert_eq!(i == 1, k < 250);
        }
        assert_eq!((d.probability(1), d.probability(3)), (0.25, 0.75));
        assert!(Distribution::new(&[0.0, 0.0]).sample(0.5).is_none());
        assert!(Distribution::new(&[]).sample(0.5).is_none());
    }
}

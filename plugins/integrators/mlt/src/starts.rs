//! Which samples chains start from, and what each chain carries.

use resolvent_api::rng::{Stream, derive};

/// A piece of work has at most about this many times the chains that are expected, however little of the light the estimate knew.
const MOST: f64 = 16.0;

/// Divides what samples carry into chains of equal energy, by systematic resampling: a sample of importance I starts I/quantum of
/// them on average.
///
/// Where samples carry far more than was expected the quantum grows, so that the number of chains is bounded. It depends on the
/// samples alone, and not on what chains find or where the comb of starts lies: given the samples, the expectation of number times
/// energy is the importance.
pub struct Starts {
    key: u64,
    quantum: f64,
    most: f64,
    /// Importance of all samples so far.
    sum: f64,
    /// The part of a chain that is due.
    due: f64,
    /// Chains that have started.
    count: u64,
}

impl Starts {
    /// Chains of `quantum` each, some `expected` in all; none if the quantum is 0.
    pub fn new(key: u64, quantum: f64, expected: f64) -> Self {
        Self {
            key,
            quantum,
            most: (MOST * expected).max(1.0),
            sum: 0.0,
            due: f64::from(Stream::new(key).uniform()),
            count: 0,
        }
    }

    /// How many chains start from the next sample, which has this importance, and the energy of each.
    pub fn from(&mut self, importance: f64) -> (u64, f64) {
        if !(self.quantum > 0.0) {
            return (0, 0.0);
        }
        self.sum += importance;
        let energy = self.quantum.max(self.sum / self.most);
        self.due += importance / energy;
        let number = self.due.floor();
        self.due -= number;
        (number as u64, energy)
    }

    /// The key of the next chain.
    pub fn key(&mut self) -> u64 {
        self.count += 1;
        derive(self.key, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What chains carry is on average what their sample does, also where the quantum has to grow, and their number is bounded.
    #[test]
    fn energy_is_kept() {
        let samples = [0.3, 1e-6, 2.0, 700.0, 0.1, 5.0, 9000.0, 40.0];
        let (rounds, expected) = (20_000, 4.0);
        let mut means = [0.0; 8];
        for key in 0..rounds {
            let mut starts = Starts::new(derive(9, key), 1.0, expected);
            let mut count = 0;
            for (mean, s) in means.iter_mut().zip(samples) {
                let (number, energy) = starts.from(s);
                *mean += number as f64 * energy / rounds as f64;
                count += number;
            }
            // A logarithm more than the bound at which the quantum grows.
            assert!(count as f64 <= MOST * expected * (1.0 + (9747.4f64 / 64.0).ln()));
        }
        let mut sum = 0.0;
        for (mean, s) in means.into_iter().zip(samples) {
            sum += s;
            let energy = f64::max(1.0, sum / (MOST * expected));
            // The number is one of two that follow each other.
            let share = (s / energy).fract();
            let error = energy * (share * (1.0 - share) / rounds as f64).sqrt();
            assert!(
                (mean - s).abs() <= 4.0 * error + 1e-9 * s,
                "{mean} {s} +- {error}"
            );
        }
    }

    #[test]
    fn darkness_starts_nothing() {
        assert_eq!(Starts::new(1, 0.0, 10.0).from(3.0), (0, 0.0));
    }
}

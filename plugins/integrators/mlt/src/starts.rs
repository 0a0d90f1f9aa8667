//! Which samples chains start from, and what each chain carries.

use resolvent_api::rng::{Stream, derive};

/// Chains of a piece may come to a few times this many of what is expected, however little of the light the estimate knew.
const MOST: f64 = 4.0;

/// Divides what samples carry into chains of equal energy, by systematic resampling: a sample of importance `i` starts `i/quantum` chains on average.
///
/// Where samples carry far more than was expected the quantum grows, so that the number of chains is bounded. It depends on the
/// samples alone, and not on what chains find or where the comb of starts lies: given the samples, the expectation of number times energy is
/// the importance.
pub struct Starts {
    key: u64,
    quantum: f64,
    most: f64,
    /// Importance of all samples so far.
    sum: f64,
    /// Chains that are due.
    due: f64,
    /// What each of them carries, and how many have started.
    energy: f64,
    count: u64,
    open: bool,
}

impl Starts {
    /// Chains of `quantum` each, some `expected` in all.
    pub fn new(key: u64, quantum: f64, expected: f64) -> Self {
        Self {
            key,
            quantum,
            most: (MOST * expected).max(1.0),
            sum: 0.0,
            due: f64::from(Stream::new(key).uniform()),
            energy: 0.0,
            count: 0,
            open: false,
        }
    }

    /// The next chain from the sample of this importance, its key and its energy; `None` ends the sample.
    pub fn next(&mut self, importance: f64) -> Option<(u64, f64)> {
        if !(self.quantum > 0.0) {
            return None;
        }
        if !self.open {
            self.open = true;
            self.sum += importance;
            self.energy = self.quantum.max(self.sum / self.most);
            self.due += importance / self.energy;
        }
        if self.due < 1.0 {
            self.open = false;
            return None;
        }
        self.due -= 1.0;
        self.count += 1;
        Some((derive(self.key, self.count), self.energy))
    }
}

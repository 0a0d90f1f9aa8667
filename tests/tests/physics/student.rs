//! Differences of means whose errors are themselves estimates.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Student's t of a difference of two independent means, and the probability that chance makes it as large (Welch 1947). `parts` are
/// the variance of either mean and its degrees of freedom, infinite if the variance is known.
pub fn difference(gap: f64, parts: [(f64, f64); 2]) -> (f64, f64) {
    let [(a, of_a), (b, of_b)] = parts;
    let variance = a + b;
    let freedom = variance * variance / (a * a / of_a + b * b / of_b);
    let t = gap / variance.sqrt();
    let law = StudentsT::new(0.0, 1.0, freedom.max(1.0)).expect("degrees of freedom");
    (t, 2.0 * (1.0 - law.cdf(t.abs())))
}

//! Gathers the findings of one test and judges them together.

use crate::moments::Moments;
use crate::ztest::{sidak, z_test};

/// Findings shown of those that fail.
const SHOWN: usize = 12;

/// Findings of one test: p-values, and claims that hold or don't.
///
/// All p-values are judged at one family-wise level with Šidák's correction, so adding checks doesn't make a correct plugin
/// fail more often.
#[derive(Debug, Default)]
pub struct Suite {
    tests: Vec<(String, f64)>,
    failures: Vec<String>,
    claims: usize,
}

impl Suite {
    /// With nothing found yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a statistical test's p-value.
    pub fn p_value(&mut self, what: impl Into<String>, p: f64) {
        self.tests.push((what.into(), p));
    }

    /// Adds a z-test of a sample's mean; `floor` is the relative accuracy to which `expected` is known.
    pub fn mean(&mut self, what: impl Into<String>, m: &Moments, expected: f64, floor: f64) {
        let z = z_test(m.mean(), m.standard_error(), expected, floor);
        let text = format!(
            "{}: mean {:.6e} ± {:.1e}, expected {expected:.6e}, z = {:.2}",
            what.into(),
            m.mean(),
            m.standard_error(),
            z.z
        );
        self.tests.push((text, z.p));
    }

    /// Adds something that must hold exactly.
    pub fn claim(&mut self, holds: bool, what: impl FnOnce() -> String) {
        self.claims += 1;
        if !holds {
            self.failures.push(what());
        }
    }

    /// Adds a comparison of two numbers: |a − b| ≤ `relative`·|b| + `absolute`.
    pub fn close(&mut self, what: &str, a: f64, b: f64, relative: f64, absolute: f64) {
        self.claim((a - b).abs() <= relative * b.abs() + absolute, || {
            format!("{what}: {a:.9e}, expected {b:.9e}")
        });
    }

    /// Findings that don't pass at the family-wise level `alpha`.
    pub fn rejected(&self, alpha: f64) -> Vec<String> {
        let level = sidak(alpha, self.tests.len());
        let mut out = self.failures.clone();
        // NaN is rejected: a broken estimate must not look like a good one.
        for (what, p) in self.tests.iter().filter(|(_, p)| !(*p > level)) {
            out.push(format!("{what} (p = {p:.2e}, level {level:.2e})"));
        }
        out
    }

    /// # Panics
    /// If a finding doesn't pass at the family-wise level of 0.1 %, or if there is none.
    #[track_caller]
    pub fn assert(&self) {
        assert!(
            self.tests.len() + self.claims > 0,
            "a suite without findings proves nothing"
        );
        let rejected = self.rejected(1e-3);
        assert!(
            rejected.is_empty(),
            "{} of {} findings fail:\n{}",
            rejected.len(),
            self.tests.len() + self.claims,
            rejected[..rejected.len().min(SHOWN)].join("\n")
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn false_claims_and_small_p_values_are_rejected() {
        let mut s = Suite::new();
        s.claim(true, || "fine".into());
        s.p_value("likely", 0.3);
        s.assert();
        s.claim(false, || "wrong".into());
        s.p_value("unlikely", 1e-9);
        s.p_value("not a number", f64::NAN);
        assert_eq!(s.rejected(1e-3).len(), 3);
    }

    #[test]
    #[should_panic(expected = "proves nothing")]
    fn an_empty_suite_fails() {
        Suite::new().assert();
    }
}

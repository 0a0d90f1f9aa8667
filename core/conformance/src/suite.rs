//! Gathers the findings of one test and judges them together.

use crate::moments::Moments;
use crate::property;
use crate::ztest::{sidak, z_test};

/// Findings shown of those that fail.
const SHOWN: usize = 12;

/// Findings about a plugin: p-values, and claims that hold or don't, each filed under a property.
///
/// All p-values are judged at one family-wise level with Šidák's correction, so adding checks doesn't make a correct plugin
/// fail more often.
#[derive(Debug)]
pub struct Suite {
    effort: f64,
    property: &'static str,
    tests: Vec<Test>,
    /// Properties in the order in which they came up.
    tallies: Vec<Tally>,
}

#[derive(Debug)]
struct Test {
    property: &'static str,
    what: String,
    p: f64,
}

#[derive(Debug)]
struct Tally {
    property: &'static str,
    claims: usize,
    false_claims: usize,
    /// The first of them.
    failures: Vec<Failure>,
}

/// A finding that doesn't pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// What was found, at which input.
    pub what: String,
    /// The figure that doesn't pass: a p-value, or the number that was to be below the threshold. Claims without a number count
    /// how often they were false.
    pub figure: f64,
    /// What it was compared with.
    pub threshold: f64,
}

/// What was found about one property.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Its name.
    pub property: &'static str,
    /// How many findings there are.
    pub findings: usize,
    /// How many don't pass.
    pub failed: usize,
    /// The first of those.
    pub failures: Vec<Failure>,
}

impl Default for Suite {
    fn default() -> Self {
        Self::with_effort(1.0)
    }
}

impl Suite {
    /// With nothing found yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// One whose checks take `effort` times as many samples.
    pub fn with_effort(effort: f64) -> Self {
        Self {
            effort,
            property: property::OTHER,
            tests: Vec::new(),
            tallies: Vec::new(),
        }
    }

    /// True if its checks are to be thorough rather than quick.
    pub fn is_thorough(&self) -> bool {
        self.effort >= 0.1
    }

    /// How many samples to take where a check at full effort takes `full`.
    pub fn samples(&self, full: usize) -> usize {
        crate::samples(((full as f64 * self.effort) as usize).max(100))
    }

    /// Files what follows under a property.
    pub fn about(&mut self, property: &'static str) {
        self.property = property;
        self.tally(property);
    }

    fn tally(&mut self, property: &'static str) -> &mut Tally {
        let at = self.tallies.iter().position(|t| t.property == property);
        let at = at.unwrap_or_else(|| {
            self.tallies.push(Tally {
                property,
                claims: 0,
                false_claims: 0,
                failures: Vec::new(),
            });
            self.tallies.len() - 1
        });
        &mut self.tallies[at]
    }

    /// Adds a statistical test's p-value.
    pub fn p_value(&mut self, what: impl Into<String>, p: f64) {
        self.tally(self.property);
        self.tests.push(Test {
            property: self.property,
            what: what.into(),
            p,
        });
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
        self.p_value(text, z.p);
    }

    /// Adds something that must hold exactly.
    pub fn claim(&mut self, holds: bool, what: impl FnOnce() -> String) {
        self.claim_about(self.property, holds, what);
    }

    /// The same, filed under another property than what follows.
    pub fn claim_about(
        &mut self,
        property: &'static str,
        holds: bool,
        what: impl FnOnce() -> String,
    ) {
        let tally = self.tally(property);
        tally.claims += 1;
        if !holds {
            tally.false_claims += 1;
            if tally.failures.len() < SHOWN {
                tally.failures.push(Failure {
                    what: what(),
                    figure: f64::NAN,
                    threshold: 0.0,
                });
            }
        }
    }

    /// Adds a number that must not exceed `threshold`; NaN does.
    pub fn at_most(&mut self, figure: f64, threshold: f64, what: impl FnOnce() -> String) {
        let tally = self.tally(self.property);
        tally.claims += 1;
        if !(figure <= threshold) {
            tally.false_claims += 1;
            if tally.failures.len() < SHOWN {
                tally.failures.push(Failure {
                    what: what(),
                    figure,
                    threshold,
                });
            }
        }
    }

    /// Adds the outcome of checks made elsewhere: one finding, that passes without a failure.
    pub fn report(&mut self, failure: Option<Failure>) {
        let tally = self.tally(self.property);
        tally.claims += 1;
        if let Some(failure) = failure {
            tally.false_claims += 1;
            if tally.failures.len() < SHOWN {
                tally.failures.push(failure);
            }
        }
    }

    /// Adds a comparison of two numbers: |a − b| ≤ `relative`·|b| + `absolute`.
    pub fn close(&mut self, what: &str, a: f64, b: f64, relative: f64, absolute: f64) {
        let (off, most) = ((a - b).abs(), relative * b.abs() + absolute);
        self.at_most(off, most, || format!("{what}: {a:.9e}, expected {b:.9e}"));
    }

    /// What was found, property by property, with p-values judged at the family-wise level `alpha`.
    pub fn verdicts(&self, alpha: f64) -> Vec<Verdict> {
        let level = sidak(alpha, self.tests.len());
        let of = |tally: &Tally| {
            let tests = self.tests.iter().filter(|t| t.property == tally.property);
            // NaN is rejected: a broken estimate must not look like a good one.
            let rejected: Vec<&Test> = tests.clone().filter(|t| !(t.p > level)).collect();
            let mut failures = tally.failures.clone();
            for f in failures.iter_mut().filter(|f| f.figure.is_nan()) {
                f.figure = tally.false_claims as f64;
            }
            failures.extend(rejected.iter().map(|t| Failure {
                what: t.what.clone(),
                figure: t.p,
                threshold: level,
            }));
            Verdict {
                property: tally.property,
                findings: tally.claims + tests.count(),
                failed: tally.false_claims + rejected.len(),
                failures,
            }
        };
        self.tallies
            .iter()
            .map(of)
            .filter(|v| v.findings > 0)
            .collect()
    }

    /// Findings that don't pass at the family-wise level `alpha`: the first of each property.
    pub fn rejected(&self, alpha: f64) -> Vec<String> {
        let verdicts = self.verdicts(alpha);
        let all = verdicts.iter().flat_map(|v| &v.failures);
        all.map(|f| {
            format!(
                "{} ({:.3e}, threshold {:.3e})",
                f.what, f.figure, f.threshold
            )
        })
        .collect()
    }

    /// # Panics
    /// If a finding doesn't pass at the family-wise level of 0.1 %, or if there is none.
    #[track_caller]
    pub fn assert(&self) {
        let verdicts = self.verdicts(1e-3);
        let all: usize = verdicts.iter().map(|v| v.findings).sum();
        assert!(all > 0, "a suite without findings proves nothing");
        let rejected = self.rejected(1e-3);
        assert!(
            rejected.is_empty(),
            "{} of {all} findings fail:\n{}",
            verdicts.iter().map(|v| v.failed).sum::<usize>(),
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
        s.at_most(f64::NAN, 1.0, || "no number".into());
        assert_eq!(s.rejected(1e-3).len(), 4);
    }

    #[test]
    fn findings_are_filed_under_their_property() {
        let mut s = Suite::new();
        s.about(property::ENERGY);
        s.at_most(1.5, 1.0, || "too bright".into());
        (0..30).for_each(|i| s.claim_about(property::EDGES, i < 5, || format!("{i}")));
        s.about(property::REPLAY);
        s.about(property::SAMPLING);
        s.p_value("likely", 0.5);
        let v = s.verdicts(1e-3);
        let names: Vec<_> = v
            .iter()
            .map(|v| (v.property, v.findings, v.failed))
            .collect();
        // What nothing was found about is not there: it was not checked.
        assert_eq!(
            names,
            [("energy", 1, 1), ("edges", 30, 25), ("sampling", 1, 0)]
        );
        let f = &v[0].failures[0];
        assert_eq!((f.figure, f.threshold), (1.5, 1.0));
        assert_eq!(
            (v[1].failures[0].what.as_str(), v[1].failures[0].figure),
            ("5", 25.0)
        );
        assert_eq!(v[1].failures.len(), SHOWN);
    }

    #[test]
    #[should_panic(expected = "proves nothing")]
    fn an_empty_suite_fails() {
        Suite::new().assert();
    }
}
